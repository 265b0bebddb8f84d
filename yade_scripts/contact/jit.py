"""How the small kernels are compiled; `fluid/numerics/jit.py` says more, which this package may not import."""

from numba import njit, types


def _numbers(dispatcher):
    """The same function, compiled once for an argument that is a constant in the call: numba would compile it anew for
    each constant (`split(w, 0, 1)`, `split(w, 1, 0)`, ...)."""
    given = dispatcher.get_call_template

    def get_call_template(args, kws):
        return given(
            tuple(types.unliteral(a) for a in args),
            {name: types.unliteral(a) for name, a in dict(kws).items()},
        )

    dispatcher.get_call_template = get_call_template
    return dispatcher


def inner(function):
    """For functions that only other kernels call, and that make no arrays: without their own Python entry they compile
    a third faster; without counting references to the arrays they are handed they run up to twice as fast."""
    return _numbers(njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(function))
