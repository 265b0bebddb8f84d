"""One substep: forces of contacts, joints and load on the blocks, then the integration of YADE.

    v⁺ = v + dt F(x)/m,   x⁺ = x + dt v⁺

so that a load F held over substeps of any length gives the momentum F dt exactly, as the water counts it. Energies are
taken at the time of the velocities, half a substep before the places.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.prescribed import Prescribed
from yade_scripts.contact.forces import ContactForces
from yade_scripts.dynamics.energy import EnergySums
from yade_scripts.dynamics.impulses import ImpulseSums
from yade_scripts.dynamics.spin import SpinCorrection
from yade_scripts.joints.joints import Joints
from yade_scripts.yade_side.motion import Motion
from yade_scripts.yade_side.scene import Scene


class Substepper:
    """Moves the scene by one substep at a time. load (n, 6) [N, N m] acts in every substep.

    prescribed: motions by the rows of the blocks that are told one, which move in each substep at their mean velocity.

    ramp [s]: time over which the weight grows from the start, as τ² (3 - 2 τ); 0: it acts in full at once.

    fastest: largest growth of λ/δ_f in a substep since it was set to zero.
    """

    def __init__(
        self,
        scene: Scene,
        motion: Motion,
        joints: Joints | None,
        contacts: ContactForces | None,
        spin: SpinCorrection,
        energy_sums: EnergySums,
        impulses: ImpulseSums,
        ramp: float = 0.0,
        prescribed: dict[int, Prescribed] | None = None,
    ):
        self._prescribed = prescribed or {}
        self._scene, self._motion, self._joints, self._contacts = scene, motion, joints, contacts
        self._spin, self._energy_sums, self._impulses = spin, energy_sums, impulses
        self.load = np.zeros((len(scene.ids), 6))
        self.fastest = 0.0
        self._F = np.zeros_like(self.load)
        self._joint_F = np.zeros_like(self.load)
        self._without_contact = np.zeros_like(self.load)
        self.ramp = ramp
        self._lift = np.zeros_like(self.load)
        self.list_bodies(np.ones(len(scene.ids), bool))

    def list_bodies(self, loose: Array, asleep: Array | None = None) -> None:
        """Find the bodies to read and push: after joints failed, the load changed, blocks became loose (n,) bool, woke
        or fell asleep (n,) bool, None: none does.

        Read are those with a live joint, in reach of contact, or free to move; pushed also those under load."""
        none = np.zeros(0, np.int64)
        self._joined = self._joints.rows() if self._joints is not None else none
        self._turning = np.flatnonzero(self._spin.unequal)
        watched = loose.copy() if self._contacts is not None else np.zeros(len(loose), bool)
        watched[self._joined] = watched[self._energy_sums.free] = True
        pushed = watched | self.load.any(axis=1)
        if asleep is not None and asleep.any():
            self._turning = self._turning[~asleep[self._turning]]
            watched, pushed = watched & ~asleep, pushed & ~asleep
        self._motion.watch(np.flatnonzero(watched))
        self._pushed = np.flatnonzero(pushed)
        self._pushed_ids = [self._scene.ids[r] for r in self._pushed]

    def missing_weight(self, time: float) -> float:
        """Share of the weight that does not act yet."""
        if time >= self.ramp:
            return 0.0
        part = time / self.ramp
        return 1.0 - part**2 * (3.0 - 2.0 * part)

    def step(self, dt: float, time: float) -> None:
        """Advance by dt [s] from the present positions, at `time` [s]."""
        m = self._motion
        before = m.v.copy()
        self._F[:] = self.load
        missing = self.missing_weight(time)
        if missing > 0.0:
            self._lift[:] = -missing * self._energy_sums.weight
            self._F += self._lift
            self._impulses.lift(dt, m.x, missing)
        self._joint_F[:] = 0.0
        if self._joints is not None and len(self._joined):
            growth = self._joints.forces(m.x, m.v, m.R, self._joint_F, dt, advance=True)
            self.fastest = max(self.fastest, growth)
            self._F += self._joint_F
        self._without_contact[:] = self._F
        if self._contacts is not None:
            self._contacts.add_forces(dt, self._F)
        self._impulses.add(dt, m.x, self._joint_F, self._without_contact, self._F)
        if len(self._turning):
            self._spin.add(self._turning, m.R, m.v, dt, m.dt, self._F)
        for row, motion in self._prescribed.items():
            self._scene.set_motion(row, np.concatenate([motion.mean_velocity(time, dt), before[row, 3:]]))
        all_are_pushed = len(self._pushed) == len(self._F)
        self._scene.step(dt, self._pushed_ids, self._F if all_are_pushed else self._F[self._pushed])
        m.dt = dt
        m.read_watched()
        if missing > 0.0:
            self._energy_sums.take_lift(self._lift, before, dt)
        if len(self._joined):
            self._energy_sums.take_joints(self._joint_F, before, self._joined, dt)
        if self._contacts is not None:
            self._contacts.settle(dt)
