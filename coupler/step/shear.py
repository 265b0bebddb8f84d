"""Blocks that water sticks to: how they answer to shear within a step.

The viscous stage of the water (`fluid/viscous/viscosity.py`) holds the blocks with their own mass, and lets them be
moved on by everything but shear, as in the last two steps: per component the smaller one if both have the same sign,
else none,

    a_k = (V_k - V_{k-1})/dt - M⁻¹ F_shear,        a = minmod(a_n, a_{n-1}).

So a block that falls at a steady speed does so at any step, and the impulse of an impact is not carried on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from fluid.viscous.viscosity import FreeBodies

if TYPE_CHECKING:
    from yade_scripts.dynamics.structure import Structure


class ShearedBlocks:
    """n blocks of the structure, then fixed solids; remembers the last two accelerations without shear (2, n, 6)."""

    def __init__(self, structure: Structure, n_solids: int) -> None:
        self.structure, self.n_solids = structure, n_solids
        self.accelerations = np.zeros((2, structure.n, 6))

    def now(self) -> FreeBodies:
        """As they stand, for the next step."""
        n, s = self.structure.n + self.n_solids, self.structure
        found = FreeBodies.none(n)
        found.mass[: s.n] = self._mass()
        found.moves[: s.n] = ~s.fixed
        found.acceleration[: s.n] = minmod(*self.accelerations)
        return found

    def note(self, before: Array, load: Array, dt: float) -> None:
        """After a step dt [s] that began with the velocities before (n, 6) and had the shear load (n, 6) [N, N m]."""
        free = ~self.structure.fixed
        change = (self.structure.velocity() - before) / dt
        by_shear = np.linalg.solve(self._mass()[free], load[free, :, None])[..., 0]
        self.accelerations[1] = self.accelerations[0]
        self.accelerations[0, free] = change[free] - by_shear

    def _mass(self) -> Array:
        """(n, 6, 6) [kg, kg m²]"""
        mass = np.zeros((self.structure.n, 6, 6))
        mass[:, [0, 1, 2], [0, 1, 2]] = self.structure.mass[:, None]
        mass[:, 3:, 3:] = self.structure.inertia()
        return mass


def minmod(a: Array, b: Array) -> Array:
    """The smaller of both where they have the same sign, else 0."""
    return np.where(a * b > 0.0, np.sign(a) * np.minimum(np.abs(a), np.abs(b)), 0.0)
