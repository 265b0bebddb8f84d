"""Kernels that call a function still to be chosen, compiled once for each choice.

Numba inlines what it knows at compile time, so the laws cost nothing that way, but it keeps no compiled code of
closures between processes. A copy of the kernel with the chosen functions among its globals is kept like any other.
"""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType

from numba import njit


def specialised(kernel: Callable, name: str, cache: bool = True, **chosen: Callable) -> Callable:
    """`kernel`, a plain function, compiled with `chosen` in place of the globals of these names.

    name: must differ for every choice, it tells their compiled codes apart on disk.
    """
    copy = FunctionType(kernel.__code__, kernel.__globals__ | chosen, kernel.__name__, kernel.__defaults__)
    copy.__qualname__, copy.__module__ = f"{kernel.__qualname__}_{name}", kernel.__module__
    return njit(cache=cache)(copy)
