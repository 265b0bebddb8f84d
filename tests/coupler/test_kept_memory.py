"""Memory that a step frees stays in the process."""

import subprocess
import sys

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


def test_fields_of_the_next_step_take_no_new_pages():
    """Against the same without it: how many pages there are depends on the system, which may hand out large ones."""
    assert _faults("import kernels") < 0.1 * _faults("")
