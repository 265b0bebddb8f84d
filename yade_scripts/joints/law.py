"""What a cohesive law is: two functions without dimensions.

With r = λ/δ_f, λ = largest opening so far, and p the place of the peak:

    secant   s(r, p) = T/(T_max r),    work   w(r, p) = ∫₀^r T/T_max dr'           0 ≤ r ≤ 1
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class CohesiveLaw:
    """secant(r, p), work(r, p): numba functions of floats, 0 ≤ r ≤ 1; the joint cuts the secant off at 1 itself

    peak: p where the user gives none · lowest_peak, highest_peak: what p may be
    points: Gauss points along an edge that a joint as stiff in closing as in opening needs
    potential: whether Needleman's potential of 1987 belongs to it
    """

    secant: Callable[[float, float], float]
    work: Callable[[float, float], float]
    peak: float
    lowest_peak: float
    highest_peak: float
    points: int = 3
    potential: bool = False
