"""How the small kernels are compiled."""

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


def plain(function):
    """For functions that make no arrays: without counting references to the arrays they are handed, and to every view
    of one, they run up to twice as fast."""
    return _numbers(njit(cache=True, _nrt=False)(function))


def inner(function):
    """The same for functions that only other kernels call: without a Python entry they compile a third faster."""
    return _numbers(njit(cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False)(function))


def ranged(function):
    """For functions that `threads.over` and its like run on several threads: they take a range first, make no arrays,
    and let other threads of Python run meanwhile."""
    return _numbers(njit(cache=True, nogil=True, _nrt=False)(function))


def released(function):
    """The same for functions that make arrays, for work space or for what they return."""
    return _numbers(njit(cache=True, nogil=True)(function))
