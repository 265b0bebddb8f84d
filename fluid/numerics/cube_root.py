"""Cube root with the same bits on every processor and at every scale.

`numpy.cbrt` has different code for different instruction sets, and the results differ in the last bit; nor is `cbrt(8
x)` always `2 cbrt(x)` to the last bit. Here x = y 8^k with 1/8 ≤ y < 1, and only +, -, *, / act on y, which IEEE 754
defines to the last bit: t ≈ y^(1/3) by Halley's method, then one step of Newton's from a t of 24 bits, whose square is
exact.
"""

from __future__ import annotations

import math

import numpy as np

from array_types import Array
from kernels.decorators import inner

ROUND_TO_24_BITS = 1.5 * 2.0**28
"""Added to a number between 1/2 and 1 and taken away again, it leaves multiples of 2^-24."""


def cube_root(x) -> Array:
    """x^(1/3) of any shape, within one unit in the last place; `cube_root(8 x)` is `2 cube_root(x)` to the last bit.

    Zeros, infinities and NaN are returned unchanged; the root of -x is minus that of x."""
    x = np.asarray(x, float)
    regular = np.isfinite(x) & (x != 0.0)
    mantissa, exponent = np.frexp(np.where(regular, np.abs(x), 1.0))
    k = -(-exponent // 3)
    y = np.ldexp(mantissa, exponent - 3 * k)
    return np.where(regular, np.copysign(np.ldexp(_root_below_one(y), k), x), x)


def _root_below_one(y):
    """y^(1/3) for 1/8 ≤ y < 1."""
    t = 0.46 + 0.57 * y  # within 6 %; each of Halley's steps cubes the error
    for _ in range(2):
        cube = t * t * t
        t = t * (cube + 2.0 * y) / (2.0 * cube + y)
    t = (t + ROUND_TO_24_BITS) - ROUND_TO_24_BITS
    quotient = y / (t * t)
    return t + t * ((quotient - t) / (t + t + quotient))


_below_one = inner(_root_below_one)


@inner
def root_of(x):
    """`cube_root` of one positive number, for kernels."""
    mantissa, exponent = math.frexp(x)
    k = -(-exponent // 3)
    return math.ldexp(_below_one(math.ldexp(mantissa, exponent - 3 * k)), k)
