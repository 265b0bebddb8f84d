"""How the small kernels are compiled."""

from numba import njit

# For functions that only other kernels call, and that make no arrays: without their own Python entry they compile a
# third faster; without counting references to the arrays they are handed they run up to twice as fast.
inner = njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
