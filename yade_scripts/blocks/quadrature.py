"""Quadrature rules along an edge of a joined face; a face uses them in both directions.

A bent joint that is stiff in closing turns about its compressed edge. Gauss points lie inside the edge, so that the
joint is too weak (three points: by 8 % at k_c/k_0 = 10, 16 % at 100); the Lobatto rule has points on the edges, which
is accurate where the closed strip is narrower than its first interval.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from array_types import Floats

MOST = 12
"""Most points along an edge."""
NEEDED = ((1.2, 3), (2.0, 4), (5.0, 5), (15.0, 6), (200.0, 7), (600.0, 8))
"""Largest k_c/k_0 for each number of Gauss points, for a peak moment within 2 % at axial loads of 0 to 0.5 T_max."""
BEYOND = 6
"""Number of Lobatto points for joints that are stiffer in closing than the last of these."""


@dataclass(frozen=True)
class Rule:
    """places (q,) in 0..1 and weights (q,) of sum 1."""

    places: Floats
    weights: Floats

    def __len__(self) -> int:
        return len(self.places)


@lru_cache
def gauss(points: int) -> Rule:
    """The Gauss-Legendre rule with q points, exact for polynomials of degree 2 q - 1; every face uses it."""
    x, w = np.polynomial.legendre.leggauss(points)
    return Rule(0.5 * (x + 1.0), 0.5 * w)


def lobatto(points: int) -> Rule:
    """The Gauss-Lobatto rule with q points, ends included, exact for degree 2 q - 3 (Abramowitz and Stegun 25.4.32)."""
    P = np.polynomial.legendre.Legendre.basis(points - 1)
    x = np.concatenate([[-1.0], np.sort(P.deriv().roots().real), [1.0]])
    return Rule(0.5 * (x + 1.0), 1.0 / (points * (points - 1) * P(x) ** 2))


def enough(closing_ratio: float, least: int) -> Rule:
    """The cheapest rule for that k_c/k_0 with at least `least` points, the number that the law itself needs."""
    for limit, points in NEEDED:
        if closing_ratio <= limit:
            return gauss(max(points, least))
    return lobatto(max(BEYOND, least))
