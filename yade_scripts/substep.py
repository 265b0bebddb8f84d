"""One substep: contact forces of YADE, on top of them those of joints and load, then the integration of YADE."""

from __future__ import annotations

import numpy as np

from yade_scripts.accounts import Accounts
from yade_scripts.joints import Joints
from yade_scripts.ledger import ContactWork
from yade_scripts.motion import Motion
from yade_scripts.scene import Scene

Array = np.ndarray


class Substepper:
    """Moves the scene by one substep at a time. load (n, 6) [N, N m] acts in every substep.

    fastest: largest growth of λ/δ_f in a substep since it was set to zero.
    """

    def __init__(
        self,
        scene: Scene,
        motion: Motion,
        joints: Joints | None,
        accounts: Accounts,
        contact_work: ContactWork | None,
    ):
        self._scene, self._motion, self._joints = scene, motion, joints
        self._accounts, self._contact_work = accounts, contact_work
        self.load = np.zeros((len(scene.ids), 6))
        self.fastest = 0.0
        self._F = np.zeros_like(self.load)
        self._unlike = scene.law is not None and scene.masses_differ
        self.list_bodies()

    def list_bodies(self) -> None:
        """Find the bodies to read and push: after joints failed, the load changed or blocks became clumps.

        Read are those with a live joint, or all when contacts are tracked; pushed those with a joint or under load."""
        none = np.zeros(0, np.int64)
        self._joined = self._joints.rows() if self._joints is not None else none
        self._motion.watch(np.arange(len(self.load)) if self._contact_work is not None else self._joined)
        self._pushed = np.union1d(self._joined, np.flatnonzero(self.load.any(axis=1)))
        self._pushed_ids = [self._scene.ids[r] for r in self._pushed]

    def step(self, dt: float) -> None:
        """From the present places to those at dt [s] later."""
        before = self._motion.v.copy()
        self._scene.find_contacts(dt)
        self._push(dt)
        if self._contact_work is not None:
            self._contact_work.take(before, self._motion.x, dt)
        if self._unlike:  # after the reading: the present forces are those of the dashpots before
            self._scene.correct_dashpots()
        self._scene.integrate()
        self._motion.dt = dt
        self._motion.read_watched()
        if len(self._joined):
            self._accounts.take_joints(self._F, before, self._joined, dt)
        if self._contact_work is not None:
            self._contact_work.settle(self._motion.v)

    def _push(self, dt: float) -> None:
        m = self._motion
        if len(self._joined):
            self._F[:] = 0.0
            growth = self._joints.forces(m.x, m.v, m.R, self._F, dt, advance=True)
            self.fastest = max(self.fastest, growth)
        if len(self._pushed):
            joints = self._F[self._pushed] if len(self._joined) else 0.0
            self._scene.add_forces(self._pushed_ids, joints + self.load[self._pushed])
