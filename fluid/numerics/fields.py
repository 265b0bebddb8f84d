"""Fields that a step makes anew, in compiled loops that all threads share."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from array_types import Array
from kernels.decorators import plain, ranged
from kernels.threads import over

PLAIN = 0.1
"""Cost of a number that is copied or added, in usual rows."""


@lru_cache(maxsize=8)
def nothing(n: int) -> np.ndarray:
    """Zeros (n,), the same array each time, which must not be written to: `added`, `less` and `sums.total` know it,
    and do not go through it."""
    out = np.zeros(n)
    out.flags.writeable = False
    return out


def is_nothing(field) -> bool:
    """Whether a field (N,) is `nothing`; other zeros are not."""
    return field is nothing(len(field))


def copied(array) -> np.ndarray:
    """A copy of an array of any shape, contiguous."""
    given, out = np.ascontiguousarray(array), np.empty(array.shape, array.dtype)
    over(_copy, given.size, given.reshape(-1), out.reshape(-1), weight=PLAIN)
    return out


def copied_at(rows, array) -> np.ndarray:
    """An array like `array` (N, 3) with its values at the listed rows (n,); the others hold anything."""
    out = np.empty_like(array)
    over(_copy_rows, len(rows), rows, array, out)
    return out


def taken_at(rows, array) -> Array:
    """array[rows] (n,) of a field (N,)."""
    out = np.empty(len(rows))
    over(_take, len(rows), rows, array, out)
    return out


def places_of(rows, n: int) -> Array:
    """Place (n,) of each of the numbers 0 ... n in the list `rows`, -1 where it is not in it."""
    out = np.empty(n, np.int64)
    over(_nowhere, n, out, weight=PLAIN)
    over(_number, len(rows), rows, out)
    return out


def marks_of(rows, n: int) -> Array:
    """(n,) bool: which of the numbers 0 ... n stand in the list `rows`."""
    out = np.zeros(n, bool)
    over(_mark, len(rows), rows, out)
    return out


@plain
def accumulate(numbers):
    """numbers (n,) ← the sums of the first, the first two, ... of them."""
    last = numbers[0]
    for j in range(1, len(numbers)):
        last += numbers[np.uint64(j)]
        numbers[np.uint64(j)] = last


def added(a, b) -> Array:
    """a + b (N,); a itself where b is `nothing`."""
    if is_nothing(b):
        return a
    out = np.empty(len(a))
    over(_add, len(a), a, b, out, weight=PLAIN)
    return out


def less(a, b) -> Array:
    """a - b (N,); a itself where b is `nothing`."""
    if is_nothing(b):
        return a
    out = np.empty(len(a))
    over(_subtract, len(a), a, b, out, weight=PLAIN)
    return out


def divided(field, by: float) -> Array:
    """A field (N,) divided by a number."""
    out = np.empty(len(field))
    over(_divide, len(field), field, by, out, weight=PLAIN)
    return out


@ranged
def _copy(first, last, array, out):
    for j in range(first, last):
        i = np.uint64(j)  # signed, numba asks each time whether it counts from the end: three times as long
        out[i] = array[i]


@ranged
def _copy_rows(first, last, rows, array, out):
    for s in range(first, last):
        for k in range(3):
            out[rows[s], k] = array[rows[s], k]


@ranged
def _nowhere(first, last, out):
    for j in range(first, last):
        out[np.uint64(j)] = -1


@ranged
def _number(first, last, rows, out):
    for s in range(first, last):
        out[rows[s]] = s


@ranged
def _mark(first, last, rows, out):
    for s in range(first, last):
        out[np.uint64(rows[np.uint64(s)])] = True


@ranged
def _take(first, last, rows, array, out):
    for s in range(first, last):
        out[s] = array[rows[s]]


@ranged
def _add(first, last, a, b, out):
    for j in range(first, last):
        i = np.uint64(j)
        out[i] = a[i] + b[i]


@ranged
def _divide(first, last, field, by, out):
    for j in range(first, last):
        i = np.uint64(j)
        out[i] = field[i] / by


@ranged
def _subtract(first, last, a, b, out):
    for j in range(first, last):
        i = np.uint64(j)
        out[i] = a[i] - b[i]
