"""What is read of a kernel that the folder of kernels holds."""

import os
import subprocess
import sys

import pytest

from coupler.program.kernel_cache import ROOT

KERNELS = """\
from kernels.decorators import inner, kernel

@inner
def half(x):
    return 0.5 * x

@kernel
def double(x):
    return 4.0 * half(x)

@kernel
def quadruple(x):
    return 2.0 * double(x)
"""
CALL = "import two; print(two.{0}(21.0), sum(two.{0}.stats.cache_hits.values()))"
SHARED = (
    "import two; two.double(1.0); (code,) = two.double.overloads.values(); print(code.library._shared_module)"
)


@pytest.fixture
def process(tmp_path):
    """What a process prints that has the kernels above."""
    (tmp_path / "two.py").write_text(KERNELS)
    paths = os.pathsep.join([str(tmp_path), str(ROOT)])
    environment = os.environ | {"PYTHONPATH": paths, "NUMBA_CACHE_DIR": str(tmp_path / "kept")}

    def run(script):
        words = [sys.executable, "-c", script]
        done = subprocess.run(words, capture_output=True, text=True, env=environment, timeout=60)
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    return run


def test_a_kernel_is_compiled_with_one_that_is_kept(process):
    """Machine code alone cannot go into another kernel."""
    assert process(CALL.format("double")) == ["42.0", "0"]
    assert process(CALL.format("quadruple")) == ["84.0", "0"]
    assert process(CALL.format("quadruple")) == ["84.0", "1"]


def test_the_code_of_llvm_is_read_only_where_it_is_needed(process):
    """Reading it takes a third of the time that a kernel takes to load."""
    process(CALL.format("double"))
    assert process(SHARED) == ["None"]


def test_the_compiler_s_knowledge_is_loaded_only_where_something_is_compiled(process):
    """It takes longer to load than the kernels of a run."""
    known = "import sys; print('numba.np.arraymath' in sys.modules)"
    assert process(f"{CALL.format('double')}; {known}") == ["42.0", "0", "True"]
    assert process(f"{CALL.format('double')}; {known}") == ["42.0", "1", "False"]
