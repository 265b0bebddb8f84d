"""One thread and the kernel cache of the present sources, before anything imports numba or YADE; what needs VTK first,
since it cannot be imported any more once YADE is."""

import os

from hypothesis import HealthCheck, settings

from coupler.kernel_cache import use_kernel_cache

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(name, "1")
use_kernel_cache()
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")  # a busy machine is no fault of the scenes drawn


def pytest_collection_modifyitems(items):
    items.sort(key=lambda item: item.get_closest_marker("before_yade") is None)
