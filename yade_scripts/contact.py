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


class ContactError(ValueError):
    """A contact constant out of range; the message names it, its value and the range."""


@dataclass(frozen=True)
class ContactLaw:
    """stiffness K [N/m] of a whole face in contact; None: that of the joints in closing (k_c A), so that a face
    that loses its joint goes on with the stiffness it had · restitution e in (0, 1] · friction μ ≥ 0
    shear_ratio: K_s/K_n (1 in the paper) · rule: "exact" returns e, "paper" uses equation (3) as printed
    nodes_per_edge: contact nodes along an edge of a block, ≥ 3 · node_radius: share of the half size of a block
    """

    stiffness: float | None = None
    restitution: float = 0.3
    friction: float = 0.5
    ground_friction: float | None = None
    shear_ratio: float = 1.0
    rule: Rule = "exact"
    nodes_per_edge: int = 3
    node_radius: float = 0.01

    def __post_init__(self):
        _within("stiffness", self.stiffness if self.stiffness is not None else 1.0, 0.0, np.inf, "N/m")
        _within("restitution", self.restitution, 0.0, 1.0, "-", closed_above=True)
        _within("friction", self.friction, -1e-300, np.inf, "-")
        _within("shear_ratio", self.shear_ratio, 0.0, 10.0, "-")
        _within("node_radius", self.node_radius, 0.0, 0.2, "of the half size")
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
    def obtained_restitution(self) -> float:
        """The e that a face contact between free bodies returns."""
        return restitution_without_tension(self.damping_ratio)


def _within(name, value, low, high, unit, closed_above=False) -> None:
    if not (low < value < high or (closed_above and value == high)):
        raise ContactError(f"contact.{name} = {value} {unit}; it must lie between {max(low, 0.0)} and {high}")


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


def effective_mass(a, b):
    """m_a m_b / (m_a + m_b) [kg]; an infinite mass stands for a fixed body."""
    return 1.0 / (1.0 / np.asarray(a) + 1.0 / np.asarray(b))
