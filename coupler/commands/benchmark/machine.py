"""What threads give on this machine whatever the program does with them: a loop that only computes, a triad a = b + s c
in memory, and an empty loop, which shows what it costs to hand one over."""

from __future__ import annotations

import statistics
import time

import numpy as np

from kernels.decorators import ranged
from kernels.threads import over, use

ROWS, TURNS = 1_000, 20_000
"""Rows of the loop that computes, and its turns for each."""
TRIAD = 8_000_000
"""Numbers in each array of the triad: far more than caches hold."""
REPEATS, EMPTY = 5, 2_000


@ranged
def _compute(first, last, turns, out):
    for i in range(first, last):
        x = 1.0 + 1e-9 * i
        for _ in range(turns):
            x = x * 1.0000001 + 1e-9
        out[i] = x


@ranged
def _triad(first, last, a, b, c):
    for i in range(first, last):
        a[i] = b[i] + 1.5 * c[i]


@ranged
def _empty(first, last, out):
    pass


def machine(numbers: list[int]) -> dict[str, dict[str, float]]:
    """By number of threads: wall time [s] of the loop that computes and of the triad, the least of REPEATS, and of the
    empty loop, the median of EMPTY."""
    a, b, c = (np.full(TRIAD, float(k)) for k in range(3))
    out, found = np.zeros(ROWS), {}
    for n in numbers:
        use(n)
        found[str(n)] = {
            "compute": min(_spent(_compute, ROWS, TURNS, out, weight=TURNS) for _ in range(REPEATS)),
            "triad": min(_spent(_triad, TRIAD, a, b, c) for _ in range(REPEATS)),
            "empty": statistics.median(_spent(_empty, ROWS, out, weight=TURNS) for _ in range(EMPTY)),
        }
    use(1)
    return found


def _spent(kernel, count: int, *args, weight: float = 1) -> float:
    began = time.perf_counter()
    over(kernel, count, *args, weight=weight)
    return time.perf_counter() - began
