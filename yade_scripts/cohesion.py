"""Cohesive law in polynomial form (paper eq. 4; Needleman, J. Appl. Mech. 54 (1987) 525) with history and mixed mode.

    T = 27/4 T_max r (1 - r)²,  r = δ/δ_f ≤ 1, else 0;   peak T_max at r = 1/3;   G_c = 9/16 T_max δ_f        (4)

Secant form for normal opening δ_n, sliding δ_t and history λ = max sqrt(<δ_n>² + β² |δ_t|²):

    k_s = k_0 (1 - λ/δ_f)²,   k_0 = 27/4 T_max/δ_f
    t_n = k_s δ_n (δ_n > 0),  k_c δ_n (δ_n < 0),   t_t = β² k_s δ_t

so unloading goes to the origin and damage never heals. Areas, works and stiffnesses are per unit area of the joint.
All functions take floats or arrays and run inside numba kernels as well. Openings [m], tractions [Pa], works [J/m²].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import vectorize

ENERGY_SHARE = 9.0 / 16.0
"""G_c / (T_max δ_f)."""
STIFFNESS_SHARE = 27.0 / 4.0
"""k_0 δ_f / T_max."""


class JointParameterError(ValueError):
    """A joint parameter out of range; the message names it, its value and the range."""


@dataclass(frozen=True)
class JointParameters:
    """strength T_max [Pa] · opening_at_failure δ_f [m] · shear_ratio β · closing_ratio k_c/k_0
    damping: share of critical damping of the stiffest joint mode, acts as a stiffness-proportional dashpot
    points: Gauss points along each edge of a joined face · ground: join faces that stand on the ground too
    """

    strength: float
    opening_at_failure: float
    shear_ratio: float = 1.0
    closing_ratio: float = 1.0
    damping: float = 0.0
    points: int = 3
    ground: bool = True

    def __post_init__(self):
        for name in ("strength", "opening_at_failure", "shear_ratio", "closing_ratio"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise JointParameterError(f"joints.{name} = {value}; it must be positive and finite")
        if not 0.0 <= self.damping < 1.0:
            raise JointParameterError(f"joints.damping = {self.damping}; it must lie in [0, 1)")
        if not 1 <= self.points <= 10:
            raise JointParameterError(
                f"joints.points = {self.points}; it must lie in 1..10 (3 is exact to 1 %)"
            )

    @property
    def stiffness(self) -> float:
        """k_0 [Pa/m]."""
        return STIFFNESS_SHARE * self.strength / self.opening_at_failure

    @property
    def closing_stiffness(self) -> float:
        """k_c [Pa/m]."""
        return self.closing_ratio * self.stiffness

    @property
    def work_of_separation(self) -> float:
        """G_c [J/m²]."""
        return ENERGY_SHARE * self.strength * self.opening_at_failure


@vectorize(["f8(f8,f8,f8)"], cache=True)
def traction(opening, strength, opening_at_failure):
    """T = 27/4 T_max r (1 - r)² for 0 ≤ r = δ/δ_f ≤ 1, else 0   (paper eq. 4) [Pa]."""
    r = opening / opening_at_failure
    return 6.75 * strength * r * (1.0 - r) ** 2 if 0.0 < r < 1.0 else 0.0


@vectorize(["f8(f8,f8,f8)"], cache=True)
def secant_stiffness(largest, stiffness, opening_at_failure):
    """k_s = k_0 (1 - λ/δ_f)², zero beyond failure [Pa/m]."""
    r = largest / opening_at_failure
    return stiffness * (1.0 - r) ** 2 if r < 1.0 else 0.0


@vectorize(["f8(f8,f8,f8)"], cache=True)
def work_of_opening(largest, stiffness, opening_at_failure):
    """W(λ) = ∫₀^λ T dδ = k_0 δ_f² (r²/2 - 2r³/3 + r⁴/4), G_c beyond failure [J/m²]."""
    r = min(largest / opening_at_failure, 1.0)
    return stiffness * opening_at_failure**2 * (r * r / 2.0 - 2.0 * r**3 / 3.0 + r**4 / 4.0)


@vectorize(["f8(f8,f8,f8)"], cache=True)
def dissipated(largest, stiffness, opening_at_failure):
    """Work that damage λ has taken for good: W(λ) - k_s λ²/2 [J/m²]."""
    r = min(largest / opening_at_failure, 1.0)
    return stiffness * opening_at_failure**2 * (2.0 * r**3 / 6.0 - r**4 / 4.0)


@vectorize(["f8(f8,f8,f8,f8)"], cache=True)
def step_stiffness(before, after, stiffness, opening_at_failure):
    """Secant stiffness that acts over a substep in which λ grows from `before` to `after` [Pa/m].

    Slow opening: k_s(after). Fast opening: the mean traction over the path, [W(after) - W(before)]/(Δλ after), so
    that a joint torn open in a few substeps still takes G_c. Weight of the mean: min(1, (4 Δλ/δ_f)²).
    """
    ks = secant_stiffness(after, stiffness, opening_at_failure)
    grown = after - before
    if grown <= 0.0:
        return ks
    share = min(1.0, (4.0 * grown / opening_at_failure) ** 2)
    work = work_of_opening(after, stiffness, opening_at_failure)
    work -= work_of_opening(before, stiffness, opening_at_failure)
    return (1.0 - share) * ks + share * work / (grown * after)
