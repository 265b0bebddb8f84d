"""Kernels that call a function still to be chosen, compiled once for each choice.

Numba inlines functions that it knows at compile time, so that the choice of a law costs nothing at run time, but it
does not cache compiled closures between processes. A copy of the kernel that has the chosen functions among its globals
is cached like any other kernel."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any
from zlib import crc32

from numba import njit

from kernels.ranges import shared


def specialised(
    kernel: Callable,
    name: str,
    chosen: Mapping[str, Callable],
    cache: bool = True,
    ranged: bool = False,
    inlined: bool = False,
) -> Callable:
    """`kernel`, a plain function, compiled with `chosen` in place of the globals of these names.

    name: must differ for every choice, since it names the compiled code on disk · ranged: it takes a range first, which
    several threads may share (`kernels/ranges.py`) · inlined: its code stands where it is called, and makes no arrays
    """
    copy = FunctionType(
        kernel.__code__, kernel.__globals__ | dict(chosen), kernel.__name__, kernel.__defaults__
    )
    copy.__qualname__, copy.__module__ = f"{kernel.__qualname__}_{name}", kernel.__module__
    if ranged:
        return shared(njit, copy, cache=cache, _nrt=False)
    if inlined:
        decorate: Any = njit  # whose stubs lack these options
        return decorate(cache=False, forceinline=True, _nrt=False)(copy)
    return njit(cache=cache)(copy)


def source_checksum(*functions: Callable) -> int:
    """Of compiled functions: of their files where these can be read, and of the code of all that they call."""
    found = 0
    seen: set[CodeType] = set()
    for function in map(in_python, functions):
        place = Path(function.__code__.co_filename)
        found = crc32(place.read_bytes() if place.is_file() else b"", found)
        found = _code_checksum(function, found, seen)
    return found


def in_python(function: Any) -> Any:
    """The Python form of a function that may be compiled."""
    return getattr(function, "py_func", function)


def _code_checksum(function: FunctionType, found: int, seen: set[CodeType]) -> int:
    """Of code, constants, and the globals that it names; functions among them are followed."""
    code = function.__code__
    if code in seen:
        return found
    seen.add(code)
    found = crc32(
        code.co_code + repr([c for c in code.co_consts if not isinstance(c, CodeType)]).encode(), found
    )
    held = dict(zip(code.co_freevars, (cell.cell_contents for cell in function.__closure__ or ())))
    for name in (*code.co_names, *code.co_freevars):
        value = held.get(name, function.__globals__.get(name))
        inner = in_python(value)
        if isinstance(inner, FunctionType):
            found = _code_checksum(inner, found, seen)
        elif isinstance(value, int | float | tuple | str):
            found = crc32(f"{name}={value!r}".encode(), found)
    return found
