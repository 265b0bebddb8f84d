"""How the small kernels are compiled."""

from numba import njit

# For functions that make no arrays: without counting references to the arrays they are handed, and to every view of
# one, they run up to twice as fast.
plain = njit(cache=True, _nrt=False)
# The same for functions that only other kernels call: without their own Python entry they compile a third faster.
inner = njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)
