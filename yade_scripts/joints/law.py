"""Definition of a cohesive law: two dimensionless functions.

With r = λ/δ_f, where λ is the largest opening so far, and the peak at r = p:

    secant   s(r, p) = T/(T_max r),    work   w(r, p) = ∫₀^r T/T_max dr'           0 ≤ r ≤ 1
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class CohesiveLaw:
    """secant(r, p), work(r, p): numba functions of floats for 0 ≤ r ≤ 1; beyond 1 the joint has failed and does not
    call them

    peak: default of p · lowest_peak, highest_peak: range of p
    points: Gauss points along an edge that are needed by a joint as stiff in closing as in opening
    potential: whether the law is that of Needleman's potential of 1987
    """

    secant: Callable[[float, float], float]
    work: Callable[[float, float], float]
    peak: float
    lowest_peak: float
    highest_peak: float
    points: int = 3
    potential: bool = False
