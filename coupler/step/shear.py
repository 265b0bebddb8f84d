"""Response of blocks to the wall shear of viscous water within a step.

The viscous stage of the water (`fluid/viscous/viscosity.py`) includes the blocks with their mass. All other forces
accelerate them as in the last two steps: for each component the smaller acceleration if both have the same sign, else
none,

    a_k = (V_k - V_{k-1})/dt - M⁻¹ F_shear,        a = minmod(a_n, a_{n-1}).

A block that sinks at its terminal velocity therefore does so with any step size, and the impulse of an impact is not
repeated in the next step.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from fluid.viscous.viscosity import FreeBodies

if TYPE_CHECKING:
    from yade_scripts.dynamics.structure import Structure


class ShearedBlocks:
    """The n blocks of the structure, then the fixed solids, with the accelerations (2, n, 6) of the last two steps
    without shear."""

    def __init__(self, structure: Structure, n_solids: int) -> None:
        self.structure, self.n_solids = structure, n_solids
        self.accelerations = np.zeros((2, structure.n, 6))

    def now(self) -> FreeBodies:
        """The blocks in their present state, for the next step."""
        n, s = self.structure.n + self.n_solids, self.structure
        found = FreeBodies.none(n)
        found.mass[: s.n] = self._mass()
        found.moves[: s.n] = ~s.fixed
        found.acceleration[: s.n] = minmod(*self.accelerations)
        return found

    def note(self, before: Array, load: Array, dt: float) -> None:
        """Store the accelerations of a step of dt [s] that began with the velocities before (n, 6) and had the shear
        load (n, 6) [N, N m]."""
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
