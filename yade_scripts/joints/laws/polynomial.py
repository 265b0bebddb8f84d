"""Polynomial law (paper eq. 4; Needleman, J. Appl. Mech. 54 (1987) 525, pure opening).

T = 27/4 T_max r (1 - r)²,  r = δ/δ_f;    T_max at r = 1/3;    G_c = 9/16 T_max δ_f;    k_0 = 27/4 T_max/δ_f
"""

from __future__ import annotations

from numba import njit

from yade_scripts.joints.law import CohesiveLaw


@njit
def secant(r, peak):
    """T/(T_max r) = 27/4 (1 - r)²."""
    return 6.75 * (1.0 - r) ** 2


@njit
def work(r, peak):
    """∫ T/T_max dr = 27/4 (r²/2 - 2 r³/3 + r⁴/4)."""
    return 6.75 * r * r * (0.5 - 2.0 * r / 3.0 + 0.25 * r * r)


LAW = CohesiveLaw(secant, work, peak=1.0 / 3.0, lowest_peak=1.0 / 3.0, highest_peak=1.0 / 3.0, potential=True)
