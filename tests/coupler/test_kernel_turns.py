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
with decorators._turn(sys.argv[1]):
    print("its turn", flush=True)
"""


@pytest.fixture
def child(tmp_path, monkeypatch):
    """Starts a process that takes its turn with a kernel of that name, in the folder of this one; it is ready then."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    decorators._locks.cache_clear()
    started = []

    def start(name, patience):
        environment = os.environ | {"PYTHONPATH": str(ROOT)}
        words = [sys.executable, "-c", CHILD, name, str(patience)]
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
    with decorators._turn("fluid.f"):
        waiting = child("fluid.f", 60)
        time.sleep(0.5)
        assert waiting.poll() is None
    assert waiting.stdout.readline() == "its turn\n"
    assert waiting.wait(20) == 0


def test_other_kernels_are_compiled_meanwhile(child):
    with decorators._turn("fluid.f"):
        assert child("fluid.g", 60).wait(20) == 0


def test_a_process_that_hangs_holds_nobody_up_for_ever(child):
    with decorators._turn("fluid.f"):
        assert child("fluid.f", 0.1).wait(20) == 0


def test_a_kernel_that_fails_to_compile_gives_its_turn_back(child):
    @decorators.kernel
    def wrong(x):
        return x.nothing

    with pytest.raises(Exception, match="nothing"):
        wrong(1.0)
    assert child(f"{wrong.py_func.__module__}.{wrong.py_func.__qualname__}", 60).wait(20) == 0
