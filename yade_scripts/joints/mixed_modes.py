"""Interaction of normal opening δ_n and sliding δ_t: two rules, each consisting of five short functions for the
kernels.

`effective` (any law; Tvergaard, Mater. Sci. Eng. A 125 (1990) 203; Camacho and Ortiz, Int. J. Solids Struct. 33
(1996) 2899): one history for both,

    λ = max sqrt(<δ_n>² + β² |δ_t|²),    t_n = k_s(λ) δ_n (δ_n > 0),  k_c δ_n (δ_n < 0),    t_t = β² k_s(λ) δ_t

`needleman` (polynomial law; Needleman, J. Appl. Mech. 54 (1987) 525): tractions from the potential

    φ/(T_max δ_f) = 27/4 { u²/2 (1 - 4u/3 + u²/2) + α v²/2 (1 - u)² },   u = δ_n/δ_f, v = |δ_t|/δ_f, α = β²
    t_n = 27/4 T_max [u (1 - u)² - α v² (1 - u)],    t_t = 27/4 T_max α (1 - u)² δ_t/δ_f

Sliding pushes the faces apart and is not limited: without opening, shear never softens and the joint never fails.
The potential itself has no unloading. Here λ = max <δ_n>, L = λ/δ_f, and the stored energy is

    ψ/(T_max δ_f) = 27/4 { (1 - L)² u²/2 + α v²/2 [(1 - L)² + 2 (1 - L)(L - u)] }

Its tractions are those of the potential at u = L and follow their tangent for u < L. Growing damage dissipates
-∂ψ/∂L = 27/4 (1 - L) u² at u = L, as much as in pure opening and never less than zero; at constant L nothing is
dissipated. G_c is that of pure opening in every mode, since sliding returns its energy to the opening.

Names: `ks` secant stiffness in opening, `ss` = |δ_t|², `k0` first stiffness, `kc` closing stiffness, zero where
contact carries compression. All per unit area of the joint. All but `stored` take four points at a time, too
(`kernels/lanes.py`).
"""

from __future__ import annotations

import difflib
from collections.abc import Callable
from dataclasses import dataclass

from numba import njit

from kernels.lanes import larger, root, where_more


class UnknownMixedMode(ValueError):
    """No rule of that name; the message gives the nearest one."""

    exit_code = 2


@dataclass(frozen=True)
class MixedMode:
    """measure: effective opening [m] that drives damage · pace: its rate of growth · response: (t_n, k_n, k_t), where
    t_t = k_t δ_t and k_n, k_t also scale the dashpots · stored: elastic energy between two openings [J/m²]"""

    measure: Callable
    pace: Callable
    response: Callable
    stored: Callable


@njit
def effective_measure(dn, ss, beta):
    """sqrt(<δ_n>² + β² |δ_t|²) [m]."""
    opened = larger(dn, 0.0)
    return root(opened * opened + beta**2 * ss)


@njit
def effective_pace(dn, ss, wn, sw, beta):
    """Change of the measure along a relative motion with normal part wn and δ_t·w = sw."""
    return (larger(dn, 0.0) * wn + beta**2 * sw) / effective_measure(dn, ss, beta)


@njit
def effective_response(ks, dn, ss, largest, k0, df, beta, kc):
    """Normal traction [Pa], and stiffnesses [Pa/m] normal and in sliding, with the secant ks of the measure."""
    kn = where_more(dn, 0.0, ks, kc)
    return kn * dn, kn, beta**2 * ks


@njit
def _stiffness_between(ks, dn, en, kc):
    """Normal stiffness [Pa/m] between the openings dn and en [m]: on both sides of zero only a spring through zero
    holds energy."""
    if dn < 0.0 and en < 0.0:
        return kc
    return ks if dn > 0.0 and en > 0.0 else min(ks, kc)


@njit
def effective_stored(ks, dn, en, slide, largest, k0, df, beta, kc):
    """Elastic energy [J/m²] between the openings dn and en [m]; slide [m²]: scalar product of their slidings."""
    kn = _stiffness_between(ks, dn, en, kc)
    return 0.5 * (kn * dn * en + beta**2 * ks * slide)


@njit
def needleman_measure(dn, ss, beta):
    """<δ_n> [m]."""
    return larger(dn, 0.0)


@njit
def needleman_pace(dn, ss, wn, sw, beta):
    """Change of the measure."""
    return wn


@njit
def needleman_response(ks, dn, ss, largest, k0, df, beta, kc):
    """As `effective_response`; the potential reduces the normal traction by β² k_0 s²/δ_f (1 - L)."""
    whole = larger(1.0 - largest / df, 0.0)
    kn = where_more(dn, 0.0, ks, kc)
    return kn * dn - beta**2 * k0 * ss / df * whole, kn, _needleman_shear(dn, largest, k0, df, beta)


@njit
def _needleman_shear(dn, largest, k0, df, beta):
    """Stiffness in sliding: 27/4 T_max/δ_f α [(1 - L)² + 2 (1 - L)(L - u)]."""
    whole = larger(1.0 - largest / df, 0.0)
    return beta**2 * k0 * whole * (whole + 2.0 * (largest - dn) / df)


@njit
def needleman_stored(ks, dn, en, slide, largest, k0, df, beta, kc):
    """As `effective_stored`."""
    kn = _stiffness_between(ks, dn, en, kc)
    return 0.5 * (kn * dn * en + _needleman_shear(0.5 * (dn + en), largest, k0, df, beta) * slide)


RULES = {
    "effective": MixedMode(effective_measure, effective_pace, effective_response, effective_stored),
    "needleman": MixedMode(needleman_measure, needleman_pace, needleman_response, needleman_stored),
}


def find(name: str) -> MixedMode:
    """The rule of that name. Raises UnknownMixedMode."""
    if name not in RULES:
        near = difflib.get_close_matches(name, RULES, n=1, cutoff=0.0)
        raise UnknownMixedMode(
            f"joints.mixed_mode = '{name}': there is no such rule; did you mean '{near[0]}'? "
            f"Rules: {', '.join(RULES)}"
        )
    return RULES[name]
