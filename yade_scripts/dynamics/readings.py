"""What can be read from a structure between its steps: positions, forces, stiffness, joints, contacts, energies.

World coordinates and SI units; one row a block; motions and forces are six numbers a block about its centre,
[velocity, angular velocity] and [force, moment], world axes.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from array_types import Array
from yade_scripts.blocks import tangent
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane, touching_faces
from yade_scripts.blocks.tangent import Springs
from yade_scripts.contact.forces import ContactForces
from yade_scripts.contact.law import ContactLaw
from yade_scripts.contact.state import Contacts, no_contacts, sum_on_blocks
from yade_scripts.dynamics.energy import EnergySums, Masses
from yade_scripts.dynamics.onset import ContactOnset
from yade_scripts.dynamics.spin import SpinCorrection
from yade_scripts.dynamics.substep import Substepper
from yade_scripts.joints.joints import Joints, JointTable
from yade_scripts.joints.seals import Seals, both_faces
from yade_scripts.yade_side.motion import Motion
from yade_scripts.yade_side.scene import Scene

if TYPE_CHECKING:
    from yade_scripts.dynamics.sleep import Sleep


class StructureReadings:
    """The part of `Structure` that reads and changes nothing; `Structure` itself builds the parts and advances them."""

    n: int
    time: float
    blocks: list[Block]
    planes: list[FixedPlane]
    contact: ContactLaw | None
    mass: Array
    fixed: Array
    gravity: Array
    joints: Joints | None
    substep: Callable[[], float]
    _origin: Array
    _masses: Masses
    _scene: Scene
    _motion: Motion
    _spin: SpinCorrection
    _contacts: ContactForces | None
    _onset: ContactOnset
    _seals: Seals | None
    _partly: Seals | None
    _shares: Array
    _energy_sums: EnergySums
    _substepper: Substepper
    _sleep: Sleep | None

    def centre(self) -> Array:
        """(n, 3) [m]"""
        return self._motion.x + self._origin

    def rotation(self) -> Array:
        """(n, 3, 3): body frame → world."""
        return self._motion.R.copy()

    def velocity(self) -> Array:
        """(n, 6) [m/s, rad/s]"""
        return self._motion.v.copy()

    def momentum(self, about: Array) -> Array:
        """Momentum, and angular momentum about a point (3,), of the blocks that move freely (6,) [N s, N m s].

        Of the velocities, half a substep before the places; with these it changes by the impulses to round-off."""
        free = self._energy_sums.free
        if self._sleep is not None:
            free = free[~self._sleep.asleep[free]]
        p = self.mass[free, None] * self._motion.v[free, :3]
        orbital = np.cross(self._motion.x[free] + (self._origin - np.asarray(about)), p)
        spin = self._scene.angular_momentum(free) - self._spin.save()[free]
        return np.concatenate([p.sum(axis=0), (orbital + spin).sum(axis=0)])

    def inertia(self) -> Array:
        """(n, 3, 3) [kg m²] about the centres, world axes."""
        return self._masses.inertia(self._motion.R)

    def loose(self) -> Array:
        """(n,) bool: blocks that lost a joint, never had one, or left their place: they meet others by contact."""
        return self._onset.loose.copy()

    def contacts(self) -> Contacts:
        """Contacts at the present positions."""
        return no_contacts() if self._contacts is None else self._contacts.now()

    def gravity_force(self) -> Array:
        """(n, 6) [N, N m]"""
        force = np.zeros((self.n, 6))
        force[:, :3] = self.mass[:, None] * self.gravity
        return force

    def weight_now(self) -> Array:
        """(n, 6) [N, N m]: as `gravity_force`, less the part of the weight that does not act yet."""
        return self.gravity_force() - self._substepper.missing_weight(self.time) * self._energy_sums.weight

    def internal_force(self, viscous: bool = False) -> Array:
        """Forces of joints and contacts on the blocks at the present state, (n, 6).

        Elastic parts only by default: the dashpots act through the damping matrix of `tangent`.
        """
        m, contacts = self._motion, self.contacts()
        force = contacts.forces(m.v, m.x) if viscous else contacts.elastic_forces()
        F = sum_on_blocks(contacts, force, m.x)
        if self.joints is not None:
            self.joints.forces(m.x, m.v, m.R, F, eta=None if viscous else 0.0)
        return F if self._sleep is None else F + self._sleep.force

    @property
    def sleeps(self) -> Sleep | None:
        """The sleeping blocks; None where sleep is switched off."""
        return self._sleep

    @property
    def asleep(self) -> Array:
        """(n,) bool: blocks that take no substeps, since what acts on them is in balance (`sleep.py`)."""
        return np.zeros(self.n, bool) if self._sleep is None else self._sleep.asleep.copy()

    @property
    def still(self) -> Array:
        """(n,) bool: blocks that no force moves now: of prescribed motion, or asleep."""
        return self.fixed if self._sleep is None else self.fixed | self._sleep.asleep

    def reaction(self) -> Array:
        """(n, 6) [N, N m]: forces that hold the blocks of prescribed motion, the negative sum of all other forces on
        them; zero for the other blocks."""
        total = self.internal_force(viscous=True) + self.gravity_force() + self._substepper.load
        return np.where(self.fixed[:, None], -total, 0.0)

    def tangent(self) -> tuple[sp.csr_array, sp.csr_array]:
        """(K, C), each (6n, 6n): secant stiffness and damping of live joints and of contacts; none of blocks asleep."""
        substep = self.substep()
        dt = substep if math.isfinite(substep) else 0.0  # while all blocks sleep, nothing limits it
        springs = self.contacts().springs(self._motion.v, self._motion.x, dt)
        return tangent.assemble(self._with_joints(springs), self.n)

    def secant_without_friction(self) -> sp.csr_array:
        """(6n, 6n): K of `tangent` for blocks that are displaced directly (`displace`), which stretches no spring of
        friction: contacts have their normal springs only."""
        springs = self._with_joints(self.contacts().pushing_springs(self._motion.x))
        return tangent.assemble(springs, self.n)[0]

    def tangent_without_friction(self) -> sp.csr_array:
        """(6n, 6n): as `secant_without_friction`, with the tangent stiffness of joints that open further, including
        their softening."""
        contacts = tangent.assemble(self.contacts().pushing_springs(self._motion.x), self.n)[0]
        if self.joints is None:
            return contacts
        return contacts + tangent.joint_tangent(self.joints, self._motion.x, self._motion.R, self.n)

    def _with_joints(self, springs: Springs) -> Springs:
        if self.joints is None:
            return springs
        return springs.and_(tangent.joint_springs(self.joints, self._motion.x, self._motion.R))

    def joint_damage(self) -> tuple[Array, Array]:
        """Damage (J,) of every joint, 0 to 1, and whether it still carries tension (J,) bool: the quick part of
        `joint_table`, for every step."""
        if self.joints is None:
            return np.zeros(0), np.zeros(0, bool)
        return self.joints.damage(), self.joints.alive

    def joint_table(self) -> JointTable | None:
        """State of every joint, None without joints."""
        if self.joints is None:
            return None
        table = self.joints.table(self._motion.x, self._motion.R)
        table.centre[:] += self._origin
        return table

    def joint_polygons(self, at_start: bool = False) -> tuple[Array, Array]:
        """Joined faces as polygons where block a of each is, or was at the start: corners (c, 3) [m], first corner of
        each (J + 1,)."""
        if self.joints is None:
            return np.zeros((0, 3)), np.zeros(1, np.int64)
        if at_start:
            x, R = (np.array([getattr(b, name) for b in self.blocks]) for name in ("centre", "rotation"))
            return self.joints.corners(x, R), self.joints.corner_start
        m = self._motion
        return self.joints.corners(m.x, m.R) + self._origin, self.joints.corner_start

    def overlaps(self) -> tuple[Array, Array, Array]:
        """Contacts seen from each block in them: block (m,), direction to the other body (m, 3), depth (m,) [m]."""
        c = self.contacts()
        other = c.b >= 0
        rows = np.concatenate([c.a, c.b[other]])
        return rows, np.concatenate([c.normal, -c.normal[other]]), np.concatenate([c.depth, c.depth[other]])

    def touching_at_start(self) -> tuple[Array, Array]:
        """Faces that touched other blocks or fixed planes as the scene began, seen from each block: block (m,),
        direction to the other body (m, 3). None where blocks have no contact, nor those between bodies that are held,
        which have none either."""
        if self.contact is None:
            return np.zeros(0, np.int64), np.zeros((0, 3))
        free = [not block.fixed for block in self.blocks]
        found = [
            face
            for face in touching_faces(self.blocks, self.planes)
            if free[face.a] or (face.b >= 0 and free[face.b])
        ]
        both = [face for face in found if face.b >= 0]
        rows = [face.a for face in found] + [face.b for face in both]
        outward = [face.normal for face in found] + [-face.normal for face in both]
        return np.array(rows, np.int64), np.array(outward, float).reshape(-1, 3)

    def deepest(self) -> tuple[Array, Array, Array, Array, Array]:
        """Pairs that are in one another: blocks a (p,) and b (p,), -1 - number for a fixed plane, depth (p,) [m], depth
        over the thickness of the thinner block (p,), and (p,) bool: those of live joints. Of contacts: the way that
        parts the two, at most (faces are tried, and edges that cross where these carry); of live joints: the mean
        closing."""
        thickness = 2.0 * np.array([b.planes[1].min() for b in self.blocks])
        a, b, depth = (np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
        if self._contacts is not None:
            a, b, depth = self._contacts.deepest()
        joined = np.zeros(len(a), bool)
        if self.joints is not None:
            live = self.joints.live
            closing = -self.joints.openings(live, self._motion.x, self._motion.R)[:, 0]
            other = np.where(self.joints.b < 0, -1 - self.joints.plane, self.joints.b)
            a, b = np.concatenate([a, self.joints.a[live]]), np.concatenate([b, other[live]])
            depth = np.concatenate([depth, np.maximum(closing, 0.0)])
            joined = np.arange(len(depth)) >= len(joined)
        thinner = np.minimum(thickness[a], np.where(b >= 0, thickness[np.maximum(b, 0)], np.inf))
        return a, b, depth, depth / thinner, joined

    def joined_planes(self) -> tuple[Array, Array, Array]:
        """Faces sealed by a live joint, or by lying on one another where no water comes between: block (m,), face (m,),
        half of the largest opening (m,) [m]."""
        m = self._motion
        none = np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
        glued = none if self.joints is None else self.joints.sealed_faces(m.x, m.R)
        lying = none if self._seals is None else self._seals.closed_faces(m.x, m.R)
        block, face, opening = (np.concatenate(two) for two in zip(glued, lying))
        return block, face, opening

    def wet_joints(self) -> tuple[Array, Array, Array]:
        """Faces between which a live joint lets water: block (m,), face (m,), depth (m,) [m] by which they are in one
        another."""
        if self.joints is None:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
        return self.joints.wet_faces(self._motion.x, self._motion.R)

    def uplift_shares(self) -> tuple[Array, Array, Array, Array]:
        """Where a share of the pressure of the surrounding water acts between faces that rest on one another or that a
        live joint holds: block (m,), face (m,), point of the face in the frame of the block (m, 3) [m], share (m,) at
        all places of the face that are nearest to this point."""
        found = [(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0))]
        if self._partly is not None:
            on = self._partly.closed(self._motion.x, self._motion.R)
            block, face, share = both_faces(self._partly, on, self._shares[on])
            found.append((block, face, self._partly.middles(on), share))
        if self.joints is not None:
            found.append(self.joints.uplift_points())
        block, face, place, share = (np.concatenate(arrays) for arrays in zip(*found))
        return block, face, place, share

    def broken_joints(self) -> tuple[Array, Array, Array, Array]:
        """Joints that have failed: number (m,), blocks and their faces (m, 2), -1 a fixed plane, and now
        their mean normal opening, mean sliding and largest normal opening (m, 3) [m]."""
        if self.joints is None:
            none = np.zeros((0, 2), np.int64)
            return np.zeros(0, np.int64), none, none, np.zeros((0, 3))
        j, m = self.joints, self._motion
        dead = np.flatnonzero(~j.alive)
        blocks, faces = np.column_stack([j.a, j.b])[dead], np.column_stack([j.face_a, j.face_b])[dead]
        return dead, blocks, faces, j.openings(dead, m.x, m.R)

    def energies(self) -> dict[str, float]:
        """Ledger [J]: kinetic + gravity + joint_stored + joint_dissipated + joint_damping + contact_stored + dashpot
        + friction changes by load_work + driving_work.

        Kinetic energy lives at half substeps (leapfrog), so the potentials are taken there too. joint_dissipated,
        dashpot and friction are sums over substeps of force times velocity; friction holds the springs of contacts
        that ended as well.
        """
        return self._energy_sums.energies()

    def law_dissipation(self) -> float:
        """Energy Σ A D(λ) [J] that the damage has dissipated according to the law, for comparison with
        joint_dissipated."""
        return self._energy_sums.law_dissipation()
