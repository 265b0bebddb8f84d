"""Exponential law (Rose, Ferrante and Smith, Phys. Rev. Lett. 47 (1981) 675; Xu and Needleman, J. Mech. Phys. Solids 42
(1994) 1397, pure opening) with the peak at δ = p δ_f, cut at δ_f.

    T = T_max (r/p) e^(1 - r/p)  (r < 1),  0 beyond
    G_c = e p [1 - (1 + 1/p) e^(-1/p)] T_max δ_f;    k_0 = e T_max/(p δ_f)

The tail beyond δ_f, T = e^(1 - 1/p)/p T_max and falling, is cut off: at δ_f it is 0.1 % of T_max for p = 0.1 and 9 %
for 0.2. G_c is the area up to the cut, and the energy left in the spring there counts as dissipated."""

from __future__ import annotations

import numpy as np
from numba import njit

from yade_scripts.joints.law import CohesiveLaw


@njit
def secant(r, peak):
    """T/(T_max r) = e^(1 - r/p)/p."""
    return np.exp(1.0 - r / peak) / peak


@njit
def work(r, peak):
    """∫ T/T_max dr = e p [1 - (1 + r/p) e^(-r/p)]."""
    s = r / peak
    return np.e * peak * (-np.expm1(-s) - s * np.exp(-s))


LAW = CohesiveLaw(secant, work, peak=0.1, lowest_peak=0.01, highest_peak=0.2, points=4)
