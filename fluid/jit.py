"""How the small kernels are compiled."""

from numba import njit

# For functions that only other kernels call: without their own Python entry they compile a third faster.
inner = njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)
