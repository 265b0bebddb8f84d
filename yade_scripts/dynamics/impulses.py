"""Impulses of contacts and of joints on the blocks over a step, kept apart, and the momentum that they change.

A substep changes the momentum of a block by dt F and, since its place moves on with the new velocity,

    x⁺ × m v⁺ - x × m v = x × dt F(x)        (leapfrog: x⁺ = x + dt v⁺)

so that sums of dt F and of dt (x × F + M) at the places of the substeps give linear and angular momentum to
round-off. The spin is that which YADE integrates, less the correction that `spin.py` has added for the substep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats
from kernels.decorators import inner, plain


@dataclass(frozen=True, kw_only=True)
class Impulses:
    """Sums over the substeps of a step, one row a block: force [N s], moment about the block's own centre [N m s], and
    moment about the zero of the coordinates [N m s].

    contact, joint (n, 9) · place (n, 3) [m s]: dt times the place of the centre, about the same zero · dt [s] · zero
    (3,) [m]: that zero in the world · lifted (n, 3) [m s], lifted_dt [s]: place and dt of the part of the weight
    that was not there yet.
    """

    contact: Floats
    joint: Floats
    place: Floats
    dt: float
    zero: Floats
    lifted: Floats
    lifted_dt: float = 0.0

    @classmethod
    def none(cls, n: int, zero: Array) -> Impulses:
        """Zero impulses, before the first substep."""
        return cls(
            contact=np.zeros((n, 9)),
            joint=np.zeros((n, 9)),
            place=np.zeros((n, 3)),
            dt=0.0,
            zero=zero,
            lifted=np.zeros((n, 3)),
        )

    def about(self, point: Array, which: Array) -> Array:
        """Impulse and its moment about a point of the world, (n, 6), of `contact` or `joint`."""
        arm = self.zero - np.asarray(point)
        return np.concatenate([which[:, :3], which[:, 6:] + np.cross(arm, which[:, :3])], axis=1)

    def of_held(self, load: Array, point: Array) -> Array:
        """The same (n, 6) of a load (n, 6) about the centres that was held over the step."""
        arm = self.place + self.dt * (self.zero - np.asarray(point))
        moment = np.cross(arm, load[:, :3]) + self.dt * load[:, 3:]
        return np.concatenate([self.dt * load[:, :3], moment], axis=1)

    def of_weight(self, weight: Array, point: Array) -> Array:
        """The same (n, 6) of the whole weight (n, 6), of which a part was not there yet."""
        arm = self.lifted + self.lifted_dt * (self.zero - np.asarray(point))
        lifted = np.concatenate([self.lifted_dt * weight[:, :3], np.cross(arm, weight[:, :3])], axis=1)
        return self.of_held(weight, point) - lifted


class ImpulseSums:
    """The running sums; `taken` returns them and sets them to zero."""

    def __init__(self, n: int, zero: Array):
        self._n, self._zero = n, np.asarray(zero, float)
        self.start()

    def start(self) -> None:
        """Start the sums at the present state."""
        self._sums = Impulses.none(self._n, self._zero)
        self._dt = self._lifted_dt = 0.0

    def lift(self, dt: float, x: Array, share: float) -> None:
        """Add a substep at the positions x (n, 3) in which `share` of the weight did not act yet."""
        self._sums.lifted[:] += dt * share * x
        self._lifted_dt += dt * share

    def add(self, dt: float, x: Array, joint: Array, before: Array, whole: Array) -> None:
        """Add a substep at the positions x (n, 3): joint forces (n, 6), and all forces without and with those of
        contacts."""
        s = self._sums
        _add(dt, x, joint, before, whole, s.joint, s.contact, s.place)
        self._dt += dt

    def give(self, rows: Array, impulse: Array) -> None:
        """Add a further impulse (k, 9) of joints on the blocks `rows` (k,), as in `Impulses`."""
        self._sums.joint[rows] += impulse

    def of_contacts(self, rows: Array) -> Array:
        """Impulses of contacts on the blocks `rows` (k,) since `start`, (k, 9)."""
        return self._sums.contact[rows]

    def taken(self) -> Impulses:
        """The impulses since `start`."""
        s = self._sums
        return Impulses(
            contact=s.contact,
            joint=s.joint,
            place=s.place,
            dt=self._dt,
            zero=s.zero,
            lifted=s.lifted,
            lifted_dt=self._lifted_dt,
        )


@plain
def _add(dt, x, joint, before, whole, joint_sum, contact_sum, place):
    for r in range(len(x)):
        for k in range(3):
            place[r, k] += dt * x[r, k]
        f, m = (joint[r, 0], joint[r, 1], joint[r, 2]), (joint[r, 3], joint[r, 4], joint[r, 5])
        _take(dt, x, r, f, m, joint_sum)
        f = (whole[r, 0] - before[r, 0], whole[r, 1] - before[r, 1], whole[r, 2] - before[r, 2])
        m = (whole[r, 3] - before[r, 3], whole[r, 4] - before[r, 4], whole[r, 5] - before[r, 5])
        _take(dt, x, r, f, m, contact_sum)


@inner
def _take(dt, x, r, force, moment, out):
    f0, f1, f2 = force
    m0, m1, m2 = moment
    if f0 == f1 == f2 == m0 == m1 == m2 == 0.0:
        return
    out[r, 0] += dt * f0
    out[r, 1] += dt * f1
    out[r, 2] += dt * f2
    out[r, 3] += dt * m0
    out[r, 4] += dt * m1
    out[r, 5] += dt * m2
    out[r, 6] += dt * (x[r, 1] * f2 - x[r, 2] * f1 + m0)
    out[r, 7] += dt * (x[r, 2] * f0 - x[r, 0] * f2 + m1)
    out[r, 8] += dt * (x[r, 0] * f1 - x[r, 1] * f0 + m2)
