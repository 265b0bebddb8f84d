"""Bilinear law (Hillerborg, Modéer and Petersson, Cem. Concr. Res. 6 (1976) 773, with a ramp; Alfano and Crisfield,
Int. J. Numer. Meth. Eng. 50 (2001) 1701): traction rises linearly to the peak at δ = p δ_f and falls linearly to zero
at δ_f.

    T = T_max r/p  (r ≤ p),   T_max (1 - r)/(1 - p)  (r ≥ p);    G_c = 1/2 T_max δ_f;    k_0 = T_max/(p δ_f)

No energy is dissipated before the peak.
"""

from __future__ import annotations

from numba import njit

from yade_scripts.joints.law import CohesiveLaw


@njit
def secant(r, peak):
    """T/(T_max r)."""
    return 1.0 / peak if r <= peak else (1.0 - r) / ((1.0 - peak) * r)


@njit
def work(r, peak):
    """∫ T/T_max dr."""
    return 0.5 * r * r / peak if r <= peak else 0.5 - 0.5 * (1.0 - r) ** 2 / (1.0 - peak)


LAW = CohesiveLaw(secant, work, peak=0.1, lowest_peak=0.01, highest_peak=0.9, points=8)
