"""Contact constants: face stiffness K, dashpot C from the restitution e, friction μ   (equations 1-3 of the paper).

    C = 2 ζ sqrt(m K),   ζ_paper = |ln e| / sqrt(ln² e + π²)                                              (3)

m: effective mass of the pair. Equation (3) returns e when the dashpot may pull at the end of the contact. A contact
that cannot pull ends when its force is zero, after the phase τ (Schwager and Pöschel, Granular Matter 9 (2007) 465):

    e(ζ) = exp(-ζ τ),   tan(s τ) = 2 ζ s / (2 ζ² - 1),   s = sqrt(1 - ζ²)

so `rule = "exact"` inverts this for ζ. A face is carried by several node contacts: each gets its share of K and C.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from scipy.optimize import brentq

Rule = Literal["exact", "paper"]
MOST_SHEAR_RATIO = 10.0
"""Largest K_t/K_n, itself allowed: a round number where no formula has a bound. The longest substep follows from the
normal stiffness alone."""


class ContactError(ValueError):
    """A contact constant out of range; the message names it, its value and the range."""


@dataclass(frozen=True)
class PairFriction:
    """μ where the materials a and b meet, and the share of the pressure of the water around that acts between faces of
    theirs which touch at the start; None: as everywhere."""

    a: str
    b: str
    friction: float | None = None
    uplift: float | None = None

    def __post_init__(self):
        where = f"pair {self.a}-{self.b}"
        if self.friction is not None:
            _within(f"{where}: friction", self.friction, -1e-300, np.inf, "-")
        if self.uplift is not None:
            _within(f"{where}: uplift", self.uplift, -1e-300, 1.0, "-", closed_above=True)


@dataclass(frozen=True)
class ContactLaw:
    """stiffness K [N/m] of a whole face in contact; None: that of the joints in closing (k_c A), so that a face
    whose joint fails keeps its stiffness · restitution e in (0, 1] · friction μ ≥ 0
    shear_ratio: K_t/K_n (1 in the paper) · rule: "exact" returns e, "paper" uses equation (3) as printed
    tangential_restitution in (0, 1]: sets the tangential dashpot by equation (3), with the effective mass along the
    face; None: the normal dashpot times sqrt(shear_ratio) · pairs: what pairs of materials have of their own
    nodes_per_edge: contact nodes along an edge of a block, ≥ 3 · uplift: share of the pressure of the water around that
    acts between faces that touch at the start without a joint, for as long as they lie on one another
    """

    stiffness: float | None = None
    restitution: float = 0.3
    friction: float = 0.5
    shear_ratio: float = 1.0
    tangential_restitution: float | None = None
    rule: Rule = "exact"
    nodes_per_edge: int = 3
    pairs: tuple[PairFriction, ...] = ()
    uplift: float = 1.0

    def __post_init__(self):
        _within("stiffness", self.stiffness if self.stiffness is not None else 1.0, 0.0, np.inf, "N/m")
        _within("restitution", self.restitution, 0.0, 1.0, "-", closed_above=True)
        _within("friction", self.friction, -1e-300, np.inf, "-")
        _within("shear_ratio", self.shear_ratio, 0.0, MOST_SHEAR_RATIO, "-", closed_above=True)
        _within("uplift", self.uplift, -1e-300, 1.0, "-", closed_above=True)
        if self.tangential_restitution is not None:
            _within("tangential_restitution", self.tangential_restitution, 0.0, 1.0, "-", closed_above=True)
        if self.rule not in ("exact", "paper"):
            raise ContactError(f"contact.rule = {self.rule!r}; it must be 'exact' or 'paper'")
        if self.nodes_per_edge < 3:
            raise ContactError(
                f"contact.nodes_per_edge = {self.nodes_per_edge}; at least 3 (with 2, offset blocks fall over)"
            )

    @property
    def damping_ratio(self) -> float:
        """ζ of equation (3)."""
        return (
            paper_damping_ratio(self.restitution) if self.rule == "paper" else damping_ratio(self.restitution)
        )

    @property
    def tangential_damping_ratio(self) -> float:
        """ζ of the tangential dashpot; -1: the normal dashpot decides. (The tangential spring may pull, so equation (3)
        is exact for it.)"""
        e = self.tangential_restitution
        return -1.0 if e is None else paper_damping_ratio(e)

    def friction_table(self, materials: list[str]) -> np.ndarray:
        """μ (m, m) of all pairs of `materials`."""
        table = np.full((len(materials), len(materials)), float(self.friction))
        row = {name: i for i, name in enumerate(materials)}
        for pair in self.pairs:
            if pair.friction is not None and pair.a in row and pair.b in row:
                i, j = row[pair.a], row[pair.b]
                table[i, j] = table[j, i] = pair.friction
        return table

    @property
    def keeps_water_out(self) -> bool:
        """Whether between any faces that lie on one another less than the full pressure of the surrounding water
        acts."""
        return self.uplift < 1.0 or any(p.uplift is not None and p.uplift < 1.0 for p in self.pairs)

    def uplift_between(self, a: str, b: str) -> float:
        """Share of the pressure that acts between faces of the materials a and b that lie on one another."""
        found = self.uplift
        for pair in self.pairs:
            if pair.uplift is not None and {pair.a, pair.b} == {a, b}:
                found = pair.uplift
        return found

    def described(self, face_stiffness) -> str:
        """One line for people; face_stiffness (n,) [N/m] that the blocks have."""
        K, obtained = np.atleast_1d(face_stiffness), self.obtained_restitution
        stiffness = f"{K.min():.3g}" + (f" to {K.max():.3g}" if K.max() > 1.001 * K.min() else "")
        own = "".join(
            f", {p.friction:g} between {p.a} and {p.b}" for p in self.pairs if p.friction is not None
        )
        return (
            f"K {stiffness} N/m, e {obtained:.3g} obtained for {self.restitution:g} asked (rule '{self.rule}'), "
            f"friction {self.friction:g}{own}"
        )

    @property
    def obtained_restitution(self) -> float:
        """The e that a face contact between free bodies returns."""
        return restitution_without_tension(self.damping_ratio)


def _within(name, value, low, high, unit, closed_above=False) -> None:
    if low < value < high or (closed_above and value == high):
        return
    least = "at least 0" if low < 0.0 else f"above {low:g}"
    most = "" if high == np.inf else f", {'at most' if closed_above else 'below'} {high:g}"
    remedy = f"take a finite number {least}{most}"
    if np.isnan(value):
        remedy += "; look for a division by zero or a missing value where it comes from"
    raise ContactError(f"contact.{name} = {value:g} {unit}".rstrip() + f"; {remedy}")


def paper_damping_ratio(e: float) -> float:
    """ζ = |ln e| / sqrt(ln² e + π²)   (paper eq. 3)."""
    return float(-np.log(e) / np.hypot(np.log(e), np.pi))


def restitution_without_tension(zeta: float) -> float:
    """e of a linear spring and dashpot that never pulls, damping ratio ζ ≥ 0 (Schwager and Pöschel 2007, eq. 21).

    The contact ends when K u + C u' = 0: at phase τ with tan(τ s) = 2 ζ s / (2 ζ² - 1) in (0, π), s = sqrt(1 - ζ²);
    there |u'| / v = exp(-ζ τ). For ζ > 1 the same with hyperbolic functions.
    """
    if zeta == 1.0:
        return float(np.exp(-2.0))
    if zeta < 1.0:
        s = np.sqrt(1.0 - zeta**2)
        tau = np.arctan2(2.0 * zeta * s, 2.0 * zeta**2 - 1.0) / s
    else:
        s = np.sqrt(zeta**2 - 1.0)
        tau = np.arctanh(2.0 * zeta * s / (2.0 * zeta**2 - 1.0)) / s
    return float(np.exp(-zeta * tau))


@lru_cache
def damping_ratio(e: float) -> float:
    """ζ for which a contact without tension returns e in (0, 1]."""
    if e >= 1.0:
        return 0.0
    high = 1.0
    while restitution_without_tension(high) > e:
        high *= 2.0
    return float(brentq(lambda z: restitution_without_tension(z) - e, 0.0, high, xtol=1e-14))
