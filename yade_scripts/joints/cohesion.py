"""The parameters of the joints, and what follows from them and the law.

With r = λ/δ_f, λ = largest opening so far, and p the place of the peak, a law gives two functions without dimensions:

    secant   s(r, p) = T/(T_max r),    work   w(r, p) = ∫₀^r T/T_max dr'           0 ≤ r ≤ 1

and everything else follows from them: k_s = s T_max/δ_f, k_0 = k_s(0), W = w T_max δ_f, G_c = W(1), energy lost for
good D = W - k_s λ²/2. Unloading goes to the origin and damage never heals. Beyond r = 1 nothing holds.
Tractions, works and stiffnesses are per unit area of the joint.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from array_types import Array
from yade_scripts.blocks import quadrature
from yade_scripts.joints import laws, mixed_modes
from yade_scripts.joints.law import CohesiveLaw
from yade_scripts.joints.specialise import in_python

UPLIFTS = ("none", "damage", "full")


class JointParameterError(ValueError):
    """A joint parameter out of range; the message names it, its value and the range."""

    exit_code = 2


@dataclass(frozen=True)
class JointParameters:
    """strength T_max [Pa] · opening_at_failure δ_f [m] · shear_ratio β · closing_ratio k_c/k_0
    damping: share of critical damping of the stiffest joint mode, acts as a stiffness-proportional dashpot
    points: Gauss points along each edge of a joined face, "auto": as many as the law and k_c/k_0 need
    ground: join faces on the ground as well · law: file of `yade_scripts/joints/laws` · peak: opening at T_max
    over δ_f, None: that of the law · mixed_mode: how opening and sliding act together, see `mixed_modes`
    uplift: pressure of the surrounding water between the joined faces, see `Joints.uplift_points`
    """

    strength: float
    opening_at_failure: float
    shear_ratio: float = 1.0
    closing_ratio: float = 1.0
    damping: float = 0.02
    points: int | Literal["auto"] = "auto"
    ground: bool = True
    law: str = "polynomial"
    peak: float | None = None
    mixed_mode: str = "effective"
    uplift: Literal["none", "damage", "full"] = "none"

    def __post_init__(self):
        for name in ("strength", "opening_at_failure", "shear_ratio", "closing_ratio"):
            value = getattr(self, name)
            if not 0.0 < value < np.inf:
                raise JointParameterError(f"joints.{name} = {value}; it must be positive and finite")
        if not 0.0 <= self.damping < 1.0:
            raise JointParameterError(f"joints.damping = {self.damping}; it must lie in [0, 1)")
        if self.points != "auto" and not 1 <= self.points <= quadrature.MOST:
            raise JointParameterError(
                f"joints.points = {self.points}; it must be 'auto' or lie in 1..{quadrature.MOST}"
            )
        if self.uplift not in UPLIFTS:
            raise JointParameterError(
                f"joints.uplift = '{self.uplift}'; it must be one of {', '.join(UPLIFTS)}"
            )
        self._check_law()

    def _check_law(self) -> None:
        low, high = self.cohesive_law.lowest_peak, self.cohesive_law.highest_peak
        if not low <= self.peak_share <= high:
            raise JointParameterError(
                f"joints.peak = {self.peak}; the law '{self.law}' has its peak at "
                + (f"{low:.4g} δ_f, leave it out" if low == high else f"{low:g} to {high:g} δ_f")
            )
        mixed_modes.find(self.mixed_mode)
        if self.mixed_mode == "needleman" and not self.cohesive_law.potential:
            raise JointParameterError(
                f"joints.mixed_mode = 'needleman' with joints.law = '{self.law}'; the potential belongs to the law "
                "'polynomial', use that or mixed_mode = 'effective'"
            )

    def described(self) -> str:
        """One line for people: what the strength of a joint depends on."""
        return (
            f"{self.law} law with its peak at {self.peak_share:.3g} δ_f, mixed mode {self.mixed_mode}, kc/K0 "
            f"{self.closing_ratio:g}, {len(self.rule)} points an edge, G_c {self.work_of_separation:.4g} J/m²"
        )

    @cached_property
    def cohesive_law(self) -> CohesiveLaw:
        """The law by its name."""
        return laws.find(self.law)

    @property
    def peak_share(self) -> float:
        """p, opening at T_max over δ_f."""
        return self.cohesive_law.peak if self.peak is None else self.peak

    def _share(self, function: Callable[[float, float], float], r: Array) -> Array:
        """A function of the law at r (n,) without dimensions, in plain Python: nothing to compile."""
        return np.reshape([in_python(function)(q, self.peak_share) for q in np.ravel(r)], np.shape(r))

    @property
    def rule(self) -> quadrature.Rule:
        """Points and weights along an edge of a joined face."""
        if self.points == "auto":
            return quadrature.enough(self.closing_ratio, self.cohesive_law.points)
        return quadrature.gauss(self.points)

    @property
    def stiffness(self) -> float:
        """k_0 [Pa/m]."""
        return (
            float(self._share(self.cohesive_law.secant, np.zeros(())))
            * self.strength
            / self.opening_at_failure
        )

    @property
    def closing_stiffness(self) -> float:
        """k_c [Pa/m]."""
        return self.closing_ratio * self.stiffness

    @property
    def work_of_separation(self) -> float:
        """G_c [J/m²]."""
        return float(self.work_of_opening(np.array(self.opening_at_failure)))

    def secant_stiffness(self, largest: Array) -> Array:
        """k_s of the largest opening so far (n,) [m], zero from δ_f on   →   (n,) [Pa/m]."""
        r = np.asarray(largest, float) / self.opening_at_failure
        share = np.where(r < 1.0, self._share(self.cohesive_law.secant, np.minimum(r, 1.0)), 0.0)
        return share * self.strength / self.opening_at_failure

    def traction(self, opening: Array) -> Array:
        """T of an opening (n,) [m] that is the largest so far   →   (n,) [Pa]."""
        return self.secant_stiffness(np.maximum(opening, 0.0)) * np.maximum(opening, 0.0)

    def work_of_opening(self, largest: Array) -> Array:
        """W = ∫ T dδ up to the opening (n,) [m], G_c beyond δ_f   →   (n,) [J/m²]."""
        r = np.minimum(np.asarray(largest, float) / self.opening_at_failure, 1.0)
        return self._share(self.cohesive_law.work, r) * self.strength * self.opening_at_failure

    def dissipated(self, largest: Array) -> Array:
        """D = W - k_s λ²/2, the energy dissipated by the damage λ (n,) [m]   →   (n,) [J/m²]."""
        return self.work_of_opening(largest) - 0.5 * self.secant_stiffness(largest) * np.square(largest)
