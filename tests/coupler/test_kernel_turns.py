"""Of several processes that need the same kernel, one compiles it and the others wait, but not for ever."""

import os
import subprocess
import sys
import time

import pytest

from coupler.program.kernel_cache import ROOT
from kernels import decorators

CHILD = """\
import sys
import kernels.decorators as decorators
decorators.PATIENCE = float(sys.argv[2])
print("ready", flush=True)
with decorators._turn(sys.argv[1], lambda: sys.argv[3] == "kept"):
    print("its turn", flush=True)
"""


USER = """\
import kernels.decorators as decorators
decorators.PATIENCE = 600.0
from tests.coupler.test_kernel_turns import double
print("ready", flush=True)
print(double(21.0), flush=True)
"""


@decorators.kernel
def double(x):
    return 2.0 * x


def never():
    return False


@pytest.fixture
def child(tmp_path, monkeypatch):
    """Starts a process that takes its turn with a kernel of that name, in the folder of this one; it is ready then."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    decorators._locks.cache_clear()
    started = []

    def start(name, patience, kept=False):
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        words = [sys.executable, "-c", CHILD, name, str(patience), "kept" if kept else "new"]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, env=environment)
        started.append(process)
        assert process.stdout.readline() == "ready\n"
        return process

    yield start
    decorators._locks.cache_clear()
    for process in started:
        process.kill()
        process.wait()
        process.stdout.close()


def test_another_process_waits_for_the_one_that_compiles(child):
    with decorators._turn("fluid.f", never):
        waiting = child("fluid.f", 60)
        time.sleep(0.5)
        assert waiting.poll() is None
    assert waiting.stdout.readline() == "its turn\n"
    assert waiting.wait(20) == 0


def test_other_kernels_are_compiled_meanwhile(child):
    with decorators._turn("fluid.f", never):
        assert child("fluid.g", 60).wait(20) == 0


def test_a_process_that_hangs_holds_nobody_up_for_ever(child):
    with decorators._turn("fluid.f", never):
        assert child("fluid.f", 0.1).wait(20) == 0


def test_a_kernel_that_fails_to_compile_gives_its_turn_back(child):
    @decorators.kernel
    def wrong(x):
        return x.nothing

    with pytest.raises(Exception, match="nothing"):
        wrong(1.0)
    assert child(f"{wrong.py_func.__module__}.{wrong.py_func.__qualname__}", 60).wait(20) == 0


def test_a_process_that_stands_still_while_it_loads_a_kernel_holds_nobody_up(child):
    with decorators._turn("fluid.f", never):
        assert child("fluid.f", 600, kept=True).wait(20) == 0


def test_a_kernel_that_is_kept_is_loaded_beside_one_who_has_the_turn():
    double(1.0)
    name = f"{double.py_func.__module__}.{double.py_func.__qualname__}"
    with decorators._turn(name, never):
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        done = subprocess.run(
            [sys.executable, "-c", USER], capture_output=True, text=True, env=environment, timeout=60
        )
    assert done.stdout == "ready\n42.0\n", done.stderr


def test_code_counts_as_kept_when_all_of_it_is_written(tmp_path, monkeypatch):
    double(1.0)
    sig = double.signatures[0]
    assert decorators._is_kept(double, sig)
    monkeypatch.setattr(double._cache._cache_file, "_cache_path", str(tmp_path))
    assert not decorators._is_kept(double, sig)
