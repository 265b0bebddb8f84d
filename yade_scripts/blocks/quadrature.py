"""Rules of points along an edge of a joined face; faces take them in both directions.

A bent joint that is stiff in closing turns about its compressed edge. Gauss's points lie inside it, and the joint
comes out weak (three points: 8 % at k_c/k_0 = 10, 16 % at 100); Lobatto's rule has points on the edges, good where
the closed strip is narrower than its first interval.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Floats

MOST = 12
"""Most points along an edge."""
NEEDED = ((1.2, 3), (2.0, 4), (5.0, 5), (15.0, 6), (200.0, 7), (600.0, 8))
"""Largest k_c/k_0 and the Gauss points for a peak moment to 2 %, with axial loads of 0 to 0.5 T_max."""
BEYOND = 6
"""Lobatto points for joints that are stiffer in closing than that."""


@dataclass(frozen=True)
class Rule:
    """places (q,) in 0..1 and weights (q,) of sum 1."""

    places: Floats
    weights: Floats

    def __len__(self) -> int:
        return len(self.places)


def gauss(points: int) -> Rule:
    """Gauss and Legendre: exact for polynomials of degree 2 q - 1."""
    x, w = np.polynomial.legendre.leggauss(points)
    return Rule(0.5 * (x + 1.0), 0.5 * w)


def lobatto(points: int) -> Rule:
    """Gauss and Lobatto: ends included, exact for degree 2 q - 3   (Abramowitz and Stegun 25.4.32)."""
    P = np.polynomial.legendre.Legendre.basis(points - 1)
    x = np.concatenate([[-1.0], np.sort(P.deriv().roots().real), [1.0]])
    return Rule(0.5 * (x + 1.0), 1.0 / (points * (points - 1) * P(x) ** 2))


def enough(closing_ratio: float, least: int) -> Rule:
    """The cheapest rule for that k_c/k_0 with at least `least` points, what the law itself needs."""
    for limit, points in NEEDED:
        if closing_ratio <= limit:
            return gauss(max(points, least))
    return lobatto(max(BEYOND, least))
