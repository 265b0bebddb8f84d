"""What acted on the blocks over a step, kept apart: impulses of contacts and of joints, and the momentum they change.

A substep changes the momentum of a block by dt F and, since its place moves on with the new velocity,

    x⁺ × m v⁺ - x × m v = x × dt F(x)        (leapfrog: x⁺ = x + dt v⁺)

so that sums of dt F and of dt (x × F + M) at the places of the substeps give linear and angular momentum to
round-off. The spin is that which YADE integrates, less what `spin.py` has lent.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

Array = np.ndarray


@dataclass(frozen=True)
class Impulses:
    """Sums over the substeps of a step, one row a block: force [N s], moment about the block's own centre [N m s], and
    moment about the zero of the coordinates [N m s].

    contact, joint (n, 9) · place (n, 3) [m s]: dt times the place of the centre, about the same zero · dt [s] · zero
    (3,) [m]: that zero in the world.
    """

    contact: Array
    joint: Array
    place: Array
    dt: float
    zero: Array

    @classmethod
    def none(cls, n: int, zero: Array) -> Impulses:
        """Before the first substep."""
        return cls(np.zeros((n, 9)), np.zeros((n, 9)), np.zeros((n, 3)), 0.0, zero)

    def about(self, point: Array, which: Array) -> Array:
        """Impulse and its moment about a point of the world, (n, 6), of `contact` or `joint`."""
        arm = self.zero - np.asarray(point)
        return np.concatenate([which[:, :3], which[:, 6:] + np.cross(arm, which[:, :3])], axis=1)

    def of_held(self, load: Array, point: Array) -> Array:
        """The same (n, 6) of a load (n, 6) about the centres that was held over the step."""
        arm = self.place + self.dt * (self.zero - np.asarray(point))
        moment = np.cross(arm, load[:, :3]) + self.dt * load[:, 3:]
        return np.concatenate([self.dt * load[:, :3], moment], axis=1)


class ImpulseSums:
    """The sums while they grow; `taken` gives them and starts anew."""

    def __init__(self, n: int, zero: Array):
        self._n, self._zero = n, np.asarray(zero, float)
        self.start()

    def start(self) -> None:
        """From here on."""
        self._sums = Impulses.none(self._n, self._zero)
        self._dt = 0.0

    def add(self, dt: float, x: Array, joint: Array, before: Array, whole: Array) -> None:
        """A substep at the places x (n, 3): joint forces (n, 6), and all forces before and with those of contacts."""
        s = self._sums
        _add(dt, x, joint, before, whole, s.joint, s.contact, s.place)
        self._dt += dt

    def taken(self) -> Impulses:
        """Those since `start`."""
        s = self._sums
        return Impulses(s.contact, s.joint, s.place, self._dt, s.zero)


@njit(cache=True)
def _add(dt, x, joint, before, whole, joint_sum, contact_sum, place):
    force = np.empty(6)
    for r in range(len(x)):
        for k in range(3):
            place[r, k] += dt * x[r, k]
        _take(dt, x[r], joint[r], joint_sum[r])
        for k in range(6):
            force[k] = whole[r, k] - before[r, k]
        _take(dt, x[r], force, contact_sum[r])


@njit(cache=True)
def _take(dt, x, F, out):
    if F[0] == 0.0 and F[1] == 0.0 and F[2] == 0.0 and F[3] == 0.0 and F[4] == 0.0 and F[5] == 0.0:
        return
    for k in range(6):
        out[k] += dt * F[k]
    out[6] += dt * (x[1] * F[2] - x[2] * F[1] + F[3])
    out[7] += dt * (x[2] * F[0] - x[0] * F[2] + F[4])
    out[8] += dt * (x[0] * F[1] - x[1] * F[0] + F[5])
