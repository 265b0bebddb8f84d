"""One thread, one instruction set and the kernel cache of the present sources, before anything imports numpy, numba or
YADE; what needs VTK first, since it cannot be imported any more once YADE is."""

import os
import signal

import pytest
from hypothesis import HealthCheck, settings

from coupler.program.start import one_thread

one_thread()
os.environ.setdefault(
    "SURGEBREAK_THREADS", "1"
)  # of the runs that tests start, two of which share the machine

# under nohup, or as a background job of a script, these are ignored, and so by the runs that tests start
for number, usual in ((signal.SIGHUP, signal.SIG_DFL), (signal.SIGINT, signal.default_int_handler)):
    if signal.getsignal(number) is signal.SIG_IGN:
        signal.signal(number, usual)

settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")  # a busy machine is no fault of the scenes drawn


NIGHTLY_TIMEOUT = 1800
"""[s] on the clock for tests that take minutes: on a machine busy with other programs they take several times that."""


def pytest_collection_modifyitems(items):
    for item in items:
        if item.get_closest_marker("nightly"):
            item.add_marker(pytest.mark.timeout(NIGHTLY_TIMEOUT))
    items.sort(key=lambda item: item.get_closest_marker("before_yade") is None)
