"""Waiting for what other processes do, in the tests of sweeps on clusters."""

import time


def until(there, what, seconds=300.0, every=0.2, report=str):
    """Waits until `there()` is true; after so many seconds [s] fails with `what` was waited for and what `report()`
    says, for instance the last lines of logs."""
    end = time.monotonic() + seconds
    while not there():
        assert time.monotonic() < end, f"{what}: not within {seconds:.0f} s\n{report()}"
        time.sleep(every)
