"""Memory that a step frees stays in the process."""

import subprocess
import sys
from types import SimpleNamespace

import pytest

from coupler.run import run

FAULTS = """
import resource
import numpy as np
{keep}
def made():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    fields = [np.full(500_000, 1.0) for _ in range(40)]
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before
made()
print(made())
"""
"""Tells how many pages 160 MB take that were filled and freed before."""


def _faults(keep: str) -> int:
    command = [sys.executable, "-c", FAULTS.format(keep=keep)]
    return int(subprocess.run(command, capture_output=True, text=True, check=True).stdout)


KEPT, NOT_KEPT = "from kernels.memory import keep_memory; keep_memory()", ""


def test_fields_of_the_next_step_take_no_new_pages():
    """Against the same without it: how many pages there are depends on the system, which may hand out large ones."""
    assert _faults(KEPT) < 0.1 * _faults(NOT_KEPT)


def test_a_program_that_only_imports_is_left_as_it_is():
    assert _faults("import fluid.step.water, yade_scripts.joints.law, kernels.threads") > 0.5 * _faults(
        NOT_KEPT
    )


def test_a_run_asks_for_it_before_it_builds_its_scene(monkeypatch):
    asked = []

    def build(*_, **__):
        assert asked == ["kept"]
        raise Built

    monkeypatch.setattr(run, "keep_memory", lambda: asked.append("kept"))
    monkeypatch.setattr(run, "build", build)
    with pytest.raises(Built):
        run.run(None, SimpleNamespace(record=lambda **_: None), None)


class Built(Exception):
    pass
