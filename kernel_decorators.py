"""How numerical kernels are compiled: the decorators that `fluid`, `yade_scripts` and `coupler` share.

There are several, since what numba builds around a function takes as long to compile as a short function itself:

- `kernel`: may make arrays and return them; called from Python and from other kernels.
- `plain`: makes and returns no arrays; called from Python too. Without counting references to the arrays that it is
  handed, and to every view of one, such a function runs up to twice as fast.
- `inner`: the same for functions that only other kernels call; without a Python entry they compile a third faster.
- `ranged`: like `plain`, for functions that `fluid.numerics.threads` runs on several threads: they take a range first
  and let other threads of Python run meanwhile.
- `released`: like `kernel`, for functions of several threads that make arrays, for work space or for what they return.

All are kept on disk (`coupler/program/kernel_cache.py`), and compiled once for an argument that is a constant in the
call: numba would compile them anew for each constant (`split(w, 0, 1)`, `split(w, 1, 0)`, ...).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit, types


def kernel(function: Callable) -> Any:
    """Compile a function that may make arrays. Python code and other kernels may call it."""
    return _compiled(function)


def plain(function: Callable) -> Any:
    """Compile a function that neither makes nor returns arrays. Python code and other kernels may call it."""
    return _compiled(function, _nrt=False)


def inner(function: Callable) -> Any:
    """Compile a function that neither makes nor returns arrays. Only other kernels may call it."""
    return _compiled(function, _nrt=False, no_cpython_wrapper=True)


def ranged(function: Callable) -> Any:
    """Compile a function of a range, which several threads call at once; it neither makes nor returns arrays."""
    return _compiled(function, _nrt=False, nogil=True)


def released(function: Callable) -> Any:
    """Compile a function that several threads call at once; it may make arrays."""
    return _compiled(function, nogil=True)


def _compiled(function: Callable, **options: bool) -> Any:
    """Numba's dispatcher of a function, for which a constant in a call has the type of a variable."""
    decorate: Any = njit  # whose stubs lack these options
    dispatcher = decorate(cache=True, no_cfunc_wrapper=True, **options)(function)
    given = dispatcher.get_call_template

    def get_call_template(args: tuple, kws: dict) -> tuple:
        return given(
            tuple(types.unliteral(a) for a in args),
            {name: types.unliteral(a) for name, a in dict(kws).items()},
        )

    dispatcher.get_call_template = get_call_template
    return dispatcher
