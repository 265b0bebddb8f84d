"""The gas in a pocket, and its loss through an orifice.

A pocket holds as much air as would fill the *reference volume* V_a at the pressure p_a of the atmosphere.  Compressed
to V without exchange of heat (or, with γ = 1, at constant temperature) it has the gauge pressure

    P = p_a ((V_a/V)^γ - 1),        -dP/dV = γ (P + p_a)/V,                                                (1)

and the energy, net of the work of the atmosphere outside, which the water can recover:

    U = ∫_V^V_a P dV = p_a (V_a^γ V^(1-γ) - V_a)/(γ - 1) - p_a (V_a - V),                                  (2)

with p_a V_a ln(V_a/V) as its first term for γ = 1.

Through an orifice of area A and discharge C_d it loses the mass (Saint-Venant and Wantzel; r the lower pressure over
the higher one, both absolute, ρ the density on the side of the higher one, r not below the value r* of choked flow)

    ṁ = C_d A (γ ρ p)^½ (2/(γ-1) (r^(2/γ) - r^((γ+1)/γ)))^½,        r* = (2/(γ+1))^(γ/(γ-1)).                (3)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array

AIR_DENSITY = 1.2
"""Density [kg/m³] of air at the pressure of the atmosphere (20 °C)."""
SMALLEST_VOLUME = 1e-12
"""Volume [m³] below which the gas law is not followed, so that a vanishing pocket keeps a finite pressure."""
NEARLY_ISOTHERMAL = 1e-6
"""γ - 1 below which the limit of γ = 1 is taken."""
EVEN = 1e-9
"""Difference of pressure [Pa] below which the flow through an orifice goes with it, not with its root."""


@dataclass(frozen=True)
class Gas:
    """gamma: 1 (isothermal) to 1.4 (adiabatic) · atmospheric [Pa]: absolute pressure of the air outside · smallest:
    pockets with a reference volume of fewer bricks of the mesh are bubbles that the mesh does not resolve, and are
    released."""

    gamma: float = 1.4
    atmospheric: float = 101_325.0
    smallest: float = 8.0

    def pressure(self, reference, volume) -> Array:
        """Gauge pressure (K,) [Pa] of (1); reference V_a and volume V (K,) [m³]."""
        v = np.maximum(volume, SMALLEST_VOLUME)
        return self.atmospheric * ((np.asarray(reference) / v) ** self.gamma - 1.0)

    def stiffness(self, reference, volume) -> Array:
        """-dP/dV (K,) [Pa/m³] of (1)."""
        v = np.maximum(volume, SMALLEST_VOLUME)
        return self.gamma * (self.pressure(reference, v) + self.atmospheric) / v

    def energy(self, reference, volume) -> Array:
        """U (K,) [J] of (2)."""
        a, v = np.asarray(reference, float), np.maximum(volume, SMALLEST_VOLUME)
        outside = self.atmospheric * (a - v)
        there = np.maximum(a, 1e-300)
        if self.gamma - 1.0 < NEARLY_ISOTHERMAL:
            return self.atmospheric * a * np.log(there / v) - outside
        inner = self.atmospheric * (there**self.gamma * v ** (1.0 - self.gamma) - a) / (self.gamma - 1.0)
        return inner - outside

    def lost_energy(self, before, volume_before, after, volume_after) -> Array:
        """Energy (K,) [J] that air takes along or that is dissipated while the reference volume of a pocket changes
        from `before` to `after` and its volume with it (K,) [m³], both in proportion: -∫ ∂U/∂V_a dV_a. With U of (2) at
        both ends this leaves the work ∫ P dV of the water."""
        a, b, v, w = (np.asarray(x, float) for x in (before, after, volume_before, volume_after))
        mean = 0.0
        for share in (0.5 - 0.5 / 3.0**0.5, 0.5 + 0.5 / 3.0**0.5):
            there, room = a + share * (b - a), np.maximum(v + share * (w - v), SMALLEST_VOLUME)
            packed = np.log(np.maximum(there, 1e-300) / room)
            if self.gamma - 1.0 < NEARLY_ISOTHERMAL:
                mean += 0.5 * self.atmospheric * packed
            else:
                bent = np.expm1((self.gamma - 1.0) * packed) / (self.gamma - 1.0)
                mean += 0.5 * self.gamma * self.atmospheric * bent
        return (a - b) * mean

    def excess(self, pressure, volume) -> Array:
        """V_a - V (K,) [m³] at a gauge pressure (K,) [Pa] and volume (K,) [m³]: (1) the other way round."""
        return np.asarray(volume) * np.expm1(np.log1p(np.asarray(pressure) / self.atmospheric) / self.gamma)

    def flow(self, one, other, area) -> Array:
        """Reference volume (W,) [m³/s] that passes effective areas C_d A (W,) [m²] by (3), from the gauge pressures
        `one` to `other` (W,) [Pa]; negative the other way."""
        return self.conductance(one, other, area) * (np.asarray(one) - np.asarray(other))

    def conductance(self, one, other, area) -> Array:
        """`flow` over the difference of the pressures (W,) [m³/(s Pa)], of which at least EVEN counts."""
        one, other = np.asarray(one, float), np.asarray(other, float)
        higher = np.maximum(one, other) + self.atmospheric
        difference = np.maximum(np.abs(one - other), EVEN)
        gamma = max(self.gamma, 1.0 + NEARLY_ISOTHERMAL)
        choked = (2.0 / (gamma + 1.0)) ** (gamma / (gamma - 1.0))
        log_r = np.log1p(-np.minimum(difference / higher, 1.0 - choked))
        speed = -2.0 / (gamma - 1.0) * np.exp(2.0 / gamma * log_r) * np.expm1((1.0 - 1.0 / gamma) * log_r)
        density = AIR_DENSITY * (higher / self.atmospheric) ** (1.0 / gamma)
        return area * np.sqrt(gamma * density * higher * speed) / (AIR_DENSITY * difference)
