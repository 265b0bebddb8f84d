"""Energies of a structure and the work done on it by joints, contacts and loads.

Kinetic energy lives at half substeps (leapfrog), so the potentials are taken there too: that of a spring with the
opening u is 1/2 k u(t) u(t - dt), which together with the kinetic energy is constant to round-off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Bools, Floats
from yade_scripts.blocks.kinematics import work_of, work_on_rows
from yade_scripts.contact.forces import ContactForces
from yade_scripts.joints.joints import Joints
from yade_scripts.yade_side.motion import Motion

_SUMS = ("load_work", "joint_work", "driving_work", "handed_over")


@dataclass(frozen=True)
class Masses:
    """mass (n,) [kg] · body_inertia (n, 3, 3) [kg m²] in the block frames · free (n,) bool: motion not prescribed

    gravity (3,) [m/s²].
    """

    mass: Floats
    body_inertia: Floats
    free: Bools
    gravity: Floats

    def inertia(self, R: Array) -> Array:
        """(n, 3, 3) about the centres, world axes."""
        return R @ self.body_inertia @ R.transpose(0, 2, 1)


class EnergySums:
    """Running sums [J]: load_work · joint_work: what the joints did to the blocks · driving_work: done by what moves
    the driven blocks, against joints, and by what holds up weight that has not come on yet · handed_over: energy of
    compressed joints that went over to contacts; lost in a scene without contact.

    contacts: they keep the account of their own work; None in a scene without contact.
    """

    def __init__(
        self,
        masses: Masses,
        motion: Motion,
        joints: Joints | None,
        contacts: ContactForces | None,
    ):
        self._masses, self._motion, self._joints, self._contacts = masses, motion, joints, contacts
        self.load_work = self.joint_work = self.driving_work = self.handed_over = 0.0
        self.stored_asleep = 0.0
        """[J] in joints that rest."""
        self.weight = np.zeros((len(masses.mass), 6))
        """Of the blocks whose motion is not prescribed, (n, 6) [N, N m]."""
        self.weight[masses.free, :3] = masses.mass[masses.free, None] * masses.gravity

    @property
    def free(self) -> Array:
        """Rows of the blocks whose motion is not prescribed."""
        return np.flatnonzero(self._masses.free)

    def start_here(self) -> None:
        """Take the present state as the start, after blocks were displaced directly."""
        self.joint_work = -self.joint_stored() - self.law_dissipation()
        self.joint_work -= 0.0 if self._joints is None else float(self._joints.rubbed.sum())

    def take_joints(self, F: Array, before: Array, rows: Array, dt: float) -> None:
        """Work of the joint forces F (n, 6) on `rows` in a substep dt that began with velocities `before` (n, 6)."""
        free = self._masses.free
        work, driven = work_on_rows(F, before, self._motion.v, rows, free, dt)
        self.joint_work += work
        self.driving_work -= driven

    def take_lift(self, F: Array, before: Array, dt: float) -> None:
        """Work in a substep dt, begun with velocities `before` (n, 6), of the forces F (n, 6) that hold blocks up."""
        self.driving_work += work_of(F, before, self._motion.v, dt)

    def take_load(
        self, load: Array, before: Array, half_before: Array, turn: Array, spin_before: Array
    ) -> float:
        """Work of the held load (n, 6) [J] between the half substeps where the kinetic energy lives; on blocks of
        prescribed motion over their whole way from `before` (n, 3): what drives them takes it up."""
        m, free = self._motion, self._masses.free[:, None]
        moved = np.where(free, m.half_step_back() - half_before, m.x - before)
        turned = np.where(free, turn - 0.5 * m.dt * (m.v[:, 3:] - spin_before), turn)
        work = np.sum(load[:, :3] * moved, axis=1) + np.sum(load[:, 3:] * turned, axis=1)
        self.load_work += float(work.sum())
        self.driving_work -= float(work[~self._masses.free].sum())
        return float(work.sum())

    def energies(self) -> dict[str, float]:
        """See `Structure.energies`."""
        e = self.mechanical()
        e["load_work"], e["driving_work"] = self.load_work, self.driving_work
        e["joint_damping"] = 0.0 if self._joints is None else float(self._joints.damped.sum())
        e["joint_dissipated"] = -self.joint_work - e["joint_stored"] - e["joint_damping"] - self.handed_over
        e["dashpot"], e["friction"] = 0.0, 0.0 if self._joints is None else float(self._joints.rubbed.sum())
        e["joint_dissipated"] -= e["friction"]
        if self._contacts is None:
            e["friction"] += self.handed_over
        else:
            e["driving_work"] += self._contacts.driving
            e["dashpot"] = self._contacts.dashpot
            e["friction"] += self._contacts.friction
        return e

    def law_dissipation(self) -> float:
        """See `Structure.law_dissipation`."""
        return 0.0 if self._joints is None else float(self._joints.lost().sum())

    def mechanical(self) -> dict[str, float]:
        """Kinetic and potential energies."""
        free, m = self._masses.free, self._motion
        v, w = m.v[free, :3], m.v[free, 3:]
        spin = np.einsum("ni,nij,nj->", w, self._masses.inertia(m.R)[free], w)
        mass = self._masses.mass[free]
        height = m.half_step_back()[free] @ self._masses.gravity
        return {
            "kinetic": float(0.5 * (mass @ (v**2).sum(axis=1) + spin)),
            "gravity": float(-mass @ height),
            "joint_stored": self.joint_stored(),
            "contact_stored": self.contact_stored(),
        }

    def joint_stored(self) -> float:
        """Energy [J] in the springs of the live joints half a substep ago."""
        if self._joints is None or not len(self._joints.live):
            return 0.0
        m, j = self._motion, self._joints
        return float(j.stored_between(m.x, m.R, *m.before(), which=j.visited).sum()) + self.stored_asleep

    def of_motion(self, rows: Array) -> float:
        """Kinetic energy [J] of the blocks `rows`, and what their gravity does over the half substep between their
        velocities and their places."""
        m = self._motion
        v, w, mass = m.v[rows, :3], m.v[rows, 3:], self._masses.mass[rows]
        spin = np.einsum("ni,nij,nj->", w, self._masses.inertia(m.R)[rows], w)
        fall = 0.5 * m.dt * float(mass @ (v @ self._masses.gravity))
        return float(0.5 * (mass @ (v**2).sum(axis=1) + spin)) + fall

    def contact_stored(self) -> float:
        """Energy [J] in the springs of the contacts half a substep ago: 1/2 k u(t) u(t - dt)."""
        if self._contacts is None:
            return 0.0
        c, m = self._contacts.now(), self._motion
        closing = np.einsum("ci,ci->c", c.closing_velocity(m.v, m.x), c.normal)
        depth = np.maximum(c.depth, 0.0)
        normal = 0.5 * c.kn * depth * np.maximum(depth - m.dt * closing, 0.0)
        return float(np.sum(normal + c.shear_energy))

    def sums(self) -> dict[str, float]:
        """The running sums, for `restore`."""
        return {name: getattr(self, name) for name in _SUMS}

    def restore(self, sums: dict[str, float]) -> None:
        """Return to earlier sums."""
        for name, value in sums.items():
            setattr(self, name, value)
