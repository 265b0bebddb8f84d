"""How numerical kernels are compiled: the decorators that `fluid`, `yade_scripts` and `coupler` share.

There are several, since what numba builds around a function takes as long to compile as a short function itself:

- `kernel`: may make arrays and return them; called from Python and from other kernels.
- `plain`: makes and returns no arrays; called from Python too. Without counting references to the arrays that it is
  handed, and to every view of one, such a function runs up to twice as fast.
- `inner`: the same for functions that only other kernels call; without a Python entry they compile a third faster.
- `inlined`: like `inner`, for long functions that are called in one or two places: their code stands there. Else each
  call copies hundreds of words, since records of arrays are handed over by value.
- `helper`: like `kernel`, for functions that only other kernels call.
- `ranged`: like `plain`, for functions that `kernels.threads` runs on several threads: they take a range first,
  let other threads of Python run meanwhile, and have the entry of `kernels/ranges.py`.
- `released`: like `kernel`, for functions of several threads that make arrays, for work space or for what they return.
- `nogil`: like `plain`, for functions that wait, or work beside other threads of Python, but have no range.

All are kept on disk (`coupler/program/kernel_cache.py`), and compiled once for an argument that is a constant in the
call: numba would compile them anew for each constant (`split(w, 0, 1)`, `split(w, 1, 0)`, ...). Of several processes
that need the same kernel at the same time, one compiles it and the others wait for what it leaves on disk.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import hashlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from numba import njit, types

from kernels.kept import read_less
from kernels.ranges import shared

read_less()

PATIENCE = 60.0
"""Seconds for which a process waits for another one that compiles a kernel: none takes as long, but a process may be
stopped."""


def kernel(function: Callable) -> Any:
    """Compile a function that may make arrays. Python code and other kernels may call it."""
    return _compiled(function)


def plain(function: Callable) -> Any:
    """Compile a function that neither makes nor returns arrays. Python code and other kernels may call it."""
    return _compiled(function, _nrt=False)


def inner(function: Callable) -> Any:
    """Compile a function that neither makes nor returns arrays. Only other kernels may call it."""
    return _compiled(function, _nrt=False, no_cpython_wrapper=True)


def inlined(function: Callable) -> Any:
    """Compile a function that neither makes nor returns arrays into the kernels that call it, which alone may do so."""
    return _compiled(function, _nrt=False, no_cpython_wrapper=True, forceinline=True)


def helper(function: Callable) -> Any:
    """Compile a function that may make arrays. Only other kernels may call it."""
    return _compiled(function, no_cpython_wrapper=True)


def ranged(function: Callable) -> Any:
    """Compile a function of a range, which several threads call at once; it neither makes nor returns arrays."""
    return _shared(function, _nrt=False)


def released(function: Callable) -> Any:
    """Compile a function of a range, which several threads call at once; it may make arrays."""
    return _shared(function)


def nogil(function: Callable) -> Any:
    """Compile a function that makes no arrays and lets other threads of Python run meanwhile."""
    return _compiled(function, _nrt=False, nogil=True)


def _shared(function: Callable, **options: Any) -> Any:
    return _in_turn(shared(njit, function, cache=True, no_cfunc_wrapper=True, **options))


def _compiled(function: Callable, **options: Any) -> Any:
    decorate: Any = njit  # whose stubs lack these options
    return _in_turn(decorate(cache=True, no_cfunc_wrapper=True, **options)(function))


def _in_turn(dispatcher: Any) -> Any:
    """Numba's dispatcher of a function, for which a constant in a call gets the type of a variable, and which one
    process at a time compiles."""
    given, compile_alone = dispatcher.get_call_template, dispatcher.compile
    name = f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}"

    def get_call_template(args: tuple, kws: dict) -> tuple:
        return given(
            tuple(types.unliteral(a) for a in args),
            {name: types.unliteral(a) for name, a in dict(kws).items()},
        )

    def compile(sig: Any) -> Any:
        with _turn(name, lambda: _is_kept(dispatcher, sig)):
            return compile_alone(sig)

    dispatcher.get_call_template, dispatcher.compile = get_call_template, compile
    return dispatcher


def _is_kept(dispatcher: Any, sig: Any) -> bool:
    """Whether the folder of kernels has the code of a function for these types of arguments."""
    cache = dispatcher._cache
    key = cache._index_key(sig, dispatcher.targetctx.codegen())
    file = cache._cache_file
    name = file._load_index().get(key)
    return name is not None and os.path.exists(file._data_path(name))  # numba writes the index first


@contextlib.contextmanager
def _turn(name: str, is_kept: Callable[[], bool]) -> Iterator[None]:
    """While no other process compiles the kernel `name` into the same folder, or when is_kept() says that the code is
    there (the other process only loads it too, and may be stopped meanwhile), or after PATIENCE; numba then looks in
    the folder first. The lock is one byte of a file there, which the system releases if the process ends."""
    at = int.from_bytes(hashlib.sha256(name.encode()).digest()[:7], "big")
    file = _locks(os.environ.get("NUMBA_CACHE_DIR"))
    with contextlib.suppress(OSError):  # from a file system without locks
        until = time.monotonic() + PATIENCE
        while file is not None and time.monotonic() < until:
            try:
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, at)
                break
            except (BlockingIOError, PermissionError):
                if is_kept():
                    break
                time.sleep(0.02)
    try:
        yield
    finally:
        if file is not None:
            with contextlib.suppress(OSError):
                fcntl.lockf(file, fcntl.LOCK_UN, 1, at)


@functools.cache
def _locks(place: str | None) -> int | None:
    """File descriptor of the locks in a folder of kernels; None where there is no such folder."""
    if place is None:
        return None
    try:
        return os.open(Path(place) / "locks", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    except OSError:
        return None
