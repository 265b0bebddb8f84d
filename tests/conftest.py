"""One thread and the kernel cache of the present sources, before anything imports numba or YADE; what needs VTK first,
since it cannot be imported any more once YADE is."""

import os

import pytest
from hypothesis import HealthCheck, settings

from coupler.kernel_cache import use_kernel_cache

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")
use_kernel_cache()
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")  # a busy machine is no fault of the scenes drawn


NIGHTLY_TIMEOUT = 1800
"""[s] on the clock for tests that take minutes: on a machine busy with other programs they take several times that."""


def pytest_collection_modifyitems(items):
    for item in items:
        if item.get_closest_marker("nightly"):
            item.add_marker(pytest.mark.timeout(NIGHTLY_TIMEOUT))
    items.sort(key=lambda item: item.get_closest_marker("before_yade") is None)
