"""The walls of the bricks of a box: even, or stretched along an axis by `[[tank.stretch]]`."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from coupler.case.case import Tank


def axes_of(tank: Tank) -> list:
    """Three increasing arrays [m]: the walls of the bricks of a box, even or stretched."""
    return [
        graded(tank.lower[k], tank.upper[k], tank.cell, [s for s in tank.stretch if s.along == along])
        for k, along in enumerate("xyz")
    ]


def graded(low: float, high: float, cell: float, stretches) -> np.ndarray:
    """Coordinates from low to high [m]: cells of about `cell`, in each stretch of about its own, and between them of
    sizes that change by the factor `growth` from cell to cell at most.

    stretches: objects with lower, upper (None: the end of the tank), cell [m] and growth."""
    ends = [
        (low if s.lower is None else max(low, s.lower), high if s.upper is None else min(high, s.upper), s)
        for s in stretches
    ]
    marks = sorted({low, high, *(end for one in ends for end in one[:2])})
    pieces = [_piece(a, b, cell, ends) for a, b in pairwise(marks)]
    return np.concatenate([piece[:-1] for piece in pieces] + [[high]])


def _piece(a: float, b: float, cell: float, ends) -> np.ndarray:
    """Coordinates from a to b, of equal parts of the integral of 1 over the size wanted there."""
    at = np.linspace(a, b, 2001)
    middle = 0.5 * (at[1:] + at[:-1])
    size = np.full(len(middle), cell)
    for first, last, s in ends:
        beyond = np.maximum(np.maximum(first - middle, middle - last), 0.0)
        # sizes that grow by this ratio from cell to cell have the slope ln(growth), here by its first Padé approximant
        grown = s.cell + 2.0 * (s.growth - 1.0) / (s.growth + 1.0) * beyond
        inside = (middle > first) & (middle < last)
        size = np.where(
            inside, np.minimum(size, s.cell) if s.cell < cell else s.cell, np.minimum(size, grown)
        )
    passed = np.concatenate([[0.0], np.cumsum(np.diff(at) / size)])
    parts = max(1, int(np.rint(passed[-1])))
    found = np.interp(np.arange(parts + 1) * (passed[-1] / parts), passed, at)
    found[0], found[-1] = a, b
    return found
