"""The structure as its neighbours see it: blocks, joints and contact, moved by YADE under given loads.

World coordinates and SI units outside; one row a block; motions and forces are six numbers a block about its centre,
[velocity, angular velocity] and [force, moment], world axes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from yade_scripts import joint_kernel, tangent
from yade_scripts.blocks import Block, BlockError
from yade_scripts.cohesion import JointParameters
from yade_scripts.contact import ContactLaw
from yade_scripts.contact_state import Contacts, read_contacts, sum_on_blocks
from yade_scripts.description import (
    check_boxes,
    check_names,
    local_origin,
    matched_stiffness,
    moved_block,
)
from yade_scripts.engine import load_yade
from yade_scripts.faces import FixedPlane, touching_faces
from yade_scripts.joints import Joints, JointTable
from yade_scripts.ledger import ContactWork
from yade_scripts.scene import STATE, Scene, SceneState
from yade_scripts.timestep import SubstepLimit, substep_limit

Array = np.ndarray

GRAVITY = (0.0, 0.0, -9.81)
STANDS = 0.02
"""A joined block stands in its place as long as it has moved less than this share of its radius."""


class SubstepFailed(RuntimeError):
    """The joints failed within YADE's loop; the state of the scene is not usable."""


class NotFinite(RuntimeError):
    """Positions or velocities of blocks are no longer numbers."""


_SUMS = ("time", "load_work", "_joint_work", "_driving_work", "_handed_over", "_dt")


@dataclass(frozen=True)
class StructureState:
    """What `Structure.restore` goes back to."""

    scene: SceneState
    loose: Array
    sums: dict[str, float]
    joints: dict[str, Array] | None
    contact_work: tuple | None


@dataclass(frozen=True)
class AdvanceReport:
    """substeps · dt_s [s] · opening_rate: largest growth of λ/δ_f in a substep (beyond about 0.25 the tearing is
    averaged over the substep) · mean_velocity (n, 6) = displacement and rotation vector over the step / dt
    load_work [J] done by the load · broken: joints that failed, rows of the joint table
    """

    substeps: int
    dt_s: float
    opening_rate: float
    mean_velocity: Array
    load_work: float
    broken: Array


class Structure:
    """Rigid blocks with contact (`contact=None`: none) and cohesive joints (`joints=None`: none).

    blocks: list of Block, unique names · ground: level of a horizontal floor [m] or None
    planes: further fixed planes (tank walls) · gravity (3,) [m/s²]
    plain_until_damage: blocks whose joints are intact carry no contact nodes until damage comes near
    track_contacts: count the work of dashpots and friction contact by contact in every substep (a Python pass over
        the contacts); without it their sum is taken from the balance of the other energies

    One structure in a process at a time (YADE has one scene): use it as a context manager or call close().
    """

    def __init__(
        self,
        blocks: list[Block],
        contact: ContactLaw | None = None,
        joints: JointParameters | None = None,
        ground: float | None = None,
        planes: list[FixedPlane] | tuple = (),
        gravity=GRAVITY,
        plain_until_damage: bool = True,
        track_contacts: bool = False,
        threads: int = 1,
    ):
        check_names(blocks)
        self.blocks = list(blocks)
        self.n = len(self.blocks)
        self.names = [b.name for b in blocks]
        self.groups = [b.group for b in blocks]
        self.mass = np.array([b.mass for b in blocks])
        self.volume = np.array([b.volume for b in blocks])
        self.fixed = np.array([b.fixed or b.driven for b in blocks], bool)
        """Blocks whose motion is prescribed: still, or driven at their velocity."""
        self.shape_vertices = [b.vertices for b in blocks]
        self.shape_faces = [[list(f) for f in b.faces] for b in blocks]
        self.gravity = np.asarray(gravity, float)
        self.contact = contact
        self.time = 0.0
        self.load_work = 0.0
        self._origin = local_origin(blocks)
        local = [moved_block(b, -self._origin) for b in blocks]
        fixed_planes = (
            [FixedPlane((0.0, 0.0, ground), (0.0, 0.0, 1.0), "ground")] if ground is not None else []
        )
        fixed_planes += list(planes)
        self.planes = fixed_planes
        local_planes = [FixedPlane(p.point - self._origin, p.normal, p.name) for p in fixed_planes]
        self.joints = self._make_joints(local, local_planes, joints)
        self._body_inertia = np.array([b.inertia for b in blocks]).reshape(-1, 3, 3)
        self.face_stiffness = self._face_stiffness()
        if contact is not None:
            check_boxes(blocks)
        self._loose = self.joints.damaged_blocks(self.n) if self.joints is not None else np.ones(self.n, bool)
        self._loose |= [bool(b.velocity.any() or b.spin.any()) for b in blocks]
        if self.joints is not None and contact is not None:
            self.joints.hand_over(self._loose)
        self._plain = plain_until_damage
        self._scene = Scene(
            load_yade(threads),
            local,
            local_planes,
            contact,
            self.face_stiffness,
            self.gravity,
            self._blocks_with_nodes(),
            self._substep,
        )
        self._prepare(track_contacts)

    # ---- setting up -----------------------------------------------------------------------------------------

    def _make_joints(self, blocks, planes, parameters: JointParameters | None) -> Joints | None:
        if parameters is None:
            return None
        faces = touching_faces(blocks, planes if parameters.ground else ())
        joints = Joints(blocks, faces, parameters)
        return joints if len(joints) else None

    def _face_stiffness(self) -> Array:
        """K [N/m] of each block: as given, or that of its joints in closing."""
        if self.contact is None:
            return np.zeros(self.n)
        if self.contact.stiffness is not None:
            return np.full(self.n, self.contact.stiffness)
        return matched_stiffness(self.blocks, self.joints)

    def _blocks_with_nodes(self) -> Array:
        """(n,) bool: blocks that may touch something from the start."""
        if not self._plain:
            return np.ones(self.n, bool)
        return self._near_loose()

    def _near_loose(self) -> Array:
        """Loose blocks, their neighbours through joints, and blocks not joined to a ground they may fall on."""
        need = self._loose.copy()
        if self.joints is None:
            return need
        inner = np.flatnonzero(self.joints.b >= 0)
        a, b = self.joints.a[inner], self.joints.b[inner]
        need[b[self._loose[a]]] = True
        need[a[self._loose[b]]] = True
        return need

    def _grounded(self) -> Array:
        """(n,) bool: blocks with a live joint to a fixed plane."""
        grounded = np.zeros(self.n, bool)
        if self.joints is not None:
            on_plane = self.joints.live[self.joints.b[self.joints.live] < 0]
            grounded[self.joints.a[on_plane]] = True
        return grounded

    def _prepare(self, track_contacts: bool) -> None:
        n = self.n
        self._x, self._v, self._R = np.zeros((n, 3)), np.zeros((n, 6)), np.tile(np.eye(3), (n, 1, 1))
        self._F = np.zeros((n, 6))
        self._load = np.zeros((n, 6))
        self._contacts: Contacts | None = None
        self._failure: BaseException | None = None
        self._contact_work = ContactWork(self._scene) if track_contacts and self.contact is not None else None
        self._contact_loss = {"dashpot": 0.0, "friction": 0.0}
        self._joint_work = 0.0
        self._handed_over = 0.0
        """Energy of compressed joints that went over to contacts [J]."""
        self._driving_work = 0.0
        self._pending_dt = 0.0
        self._damping_loss = 0.0
        self._fastest = 0.0
        self._broken: list[int] = []
        self._dt = 0.0
        self._unlike = self.contact is not None and self._scene.masses_differ
        self._set_damping()
        self._update_rows()
        self._update_masks(np.arange(n))
        self._read_all()
        self._x_start, self._R_start = self._x.copy(), self._R.copy()
        self._radius = np.array([b.radius for b in self.blocks])
        self._start_energy = sum(self._mechanical().values())

    def _set_damping(self) -> None:
        """Dashpot time η = 2 z/ω of the stiffest joint mode."""
        self._limit: SubstepLimit | None = None
        if self.joints is not None and self.joints.parameters.damping > 0.0:
            omega = self.substep_limit().omega
            self.joints.eta = 2.0 * self.joints.parameters.damping / omega

    def _update_rows(self) -> None:
        """Lists of the bodies read and written in each substep: those with a live joint, or all when contacts are
        tracked. The lists persist because YADE leaks a reference per fresh item."""
        scene = self._scene
        self._all_ids = list(scene.ids)
        self._all_buffer = bytearray(8 * STATE * self.n)
        joined = self.joints.rows() if self.joints is not None else np.zeros(0, np.int64)
        self._rows = np.arange(self.n) if self._contact_work is not None else joined
        self._ids = [scene.ids[r] for r in self._rows]
        self._buffer = bytearray(8 * STATE * len(self._ids))
        self._joined = joined
        self._update_pushed()

    def _update_pushed(self) -> None:
        """Bodies that get a force in each substep: with a live joint or under load."""
        self._pushed = np.union1d(self._joined, np.flatnonzero(self._load.any(axis=1)))
        self._pushed_ids = [self._scene.ids[r] for r in self._pushed]

    def _update_masks(self, rows: Array) -> None:
        grounded = self._grounded()
        for r in rows:
            self._scene.set_masks(int(r), bool(self._loose[r]), bool(grounded[r]))
        self._scene.search_contacts_now()

    # ---- one substep, called by YADE ------------------------------------------------------------------------

    def _substep(self) -> None:
        """Between YADE's contact forces and its integration. Errors are kept: YADE would lose them."""
        if self._scene.is_still:
            if self._unlike:
                self._scene.correct_dashpots()
            return
        try:
            self._joint_step()
        except Exception as error:  # raised again by advance(): YADE's loop would lose it
            self._failure = error

    def _joint_step(self) -> None:
        dt = self._scene.O.dt
        before = self._v[self._rows]
        self._read_rows()
        self._settle_work(before)
        if self.joints is not None and len(self.joints.live):
            self._F[:] = 0.0
            growth = self.joints.forces(self._x, self._v, self._R, self._F, dt, advance=True)
            self._fastest = max(self._fastest, growth)
            self._pending_dt = dt
        if len(self._pushed):
            self._scene.add_forces(self._pushed_ids, self._F[self._pushed] + self._load[self._pushed])
        if self._contact_work is not None:
            self._contact_work.take(self._v, self._x, dt)
        if self._unlike:  # after the reading: this substep's forces are those of the dashpots before
            self._scene.correct_dashpots()

    def _read_rows(self) -> None:
        if len(self._rows):
            states = self._scene.read(self._ids, self._buffer)
            joint_kernel.scatter(states, self._rows, self._scene.frame, self._x, self._v, self._R)

    def _read_all(self) -> None:
        if self.n:
            states = self._scene.read(self._all_ids, self._all_buffer)
            joint_kernel.scatter(states, np.arange(self.n), self._scene.frame, self._x, self._v, self._R)

    def _settle_work(self, before: Array) -> None:
        """Work of the forces of the substep that has just ended, now that its end velocities are known."""
        if self._pending_dt > 0.0:
            F, now = self._F[self._rows], self._v[self._rows]
            self._joint_work += joint_kernel.work_of(F, before, now, self._pending_dt)
            held = self.fixed[self._rows]
            self._driving_work -= joint_kernel.work_of(F[held], before[held], now[held], self._pending_dt)
            self._pending_dt = 0.0
        if self._contact_work is not None:
            self._contact_work.settle(self._v)

    # ---- moving on ------------------------------------------------------------------------------------------

    def set_load(self, F: Array) -> None:
        """Force and moment (n, 6) [N, N m] on the blocks from now on, about their centres as they move."""
        F = np.asarray(F, float)
        if F.shape != (self.n, 6) or not np.isfinite(F).all():
            raise NotFinite(f"load of shape {F.shape} for {self.n} blocks, finite: {np.isfinite(F).all()}")
        self._load = F.copy()
        self._update_pushed()

    def drive(self, name: str, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)) -> None:
        """New prescribed motion of a driven block: velocity (3,) [m/s], spin (3,) [rad/s]."""
        row = self.names.index(name)
        if not self.blocks[row].driven:
            raise BlockError(
                f"block '{name}' is not driven; only blocks with driven=True take a prescribed motion"
            )
        self.blocks[row] = replace(self.blocks[row], velocity=velocity, spin=spin, vertices=None)
        self._scene.set_motion(row, np.concatenate([np.asarray(velocity, float), np.asarray(spin, float)]))
        self._limit = None
        self._read_all()

    def substep_limit(self) -> SubstepLimit:
        """Largest substep and what limits it; found anew when joints have failed."""
        if self._limit is None:
            stiffness = self.face_stiffness if self.contact is not None else None
            damping = 0.0 if self.joints is None else self.joints.parameters.damping
            self._limit = substep_limit(self.blocks, self.joints, stiffness, damping)
        return self._limit

    def stable_substep(self) -> tuple[float, str]:
        """(dt_s [s], the joint or contact that limits it)."""
        limit = self.substep_limit()
        return limit.dt, limit.what

    def advance(self, dt: float, substep: float | None = None) -> AdvanceReport:
        """Move on by dt [s] under the load of `set_load`, in equal substeps no longer than `substep` or the limit."""
        limit = self.stable_substep()[0] if substep is None else substep
        count = max(1, int(np.ceil(dt / limit * (1.0 - 1e-12)))) if np.isfinite(limit) else 1
        self._dt = self._scene.O.dt = dt / count
        self._read_all()
        self._release_moved()
        self._arm_targets(dt)
        x0, R0, half, spin = self._x.copy(), self._R.copy(), self._half_step_place(), self._v[:, 3:].copy()
        self._fastest, self._broken = 0.0, []
        for _ in range(count):
            self._one_substep()
        self._finish()
        turn = (
            Rotation.from_matrix(self._R @ R0.transpose(0, 2, 1)).as_rotvec() if self.n else np.zeros((0, 3))
        )
        work = self._work_of_load(half, turn, spin)
        self.load_work += work
        mean = np.concatenate([self._x - x0, turn], axis=1) / dt
        return AdvanceReport(count, self._dt, self._fastest, mean, work, np.array(self._broken, np.int64))

    def _one_substep(self) -> None:
        self._scene.O.step()
        if self._failure is not None:
            raise SubstepFailed(
                f"substep at t = {self.time:.6g} s failed: {self._failure!r}"
            ) from self._failure
        self.time += self._dt
        if self.joints is not None and len(self.joints.live):
            self._retire_broken()

    def _finish(self) -> None:
        before = self._v[self._rows].copy()
        self._read_all()
        self._settle_work(before)
        if not np.isfinite(self._x).all():
            bad = self.names[int(np.flatnonzero(~np.isfinite(self._x).all(axis=1))[0])]
            raise NotFinite(
                f"block '{bad}' has no finite position at t = {self.time:.6g} s; use a shorter substep"
            )
        if self.contact is not None:
            self._scene.still_step()
            self._contacts = None

    def _retire_broken(self) -> None:
        broken = self.joints.broken_now()
        if not len(broken):
            return
        self._broken += broken.tolist()
        self._read_all_keeping_velocity()
        stored = self._joint_stored()
        self.joints.retire(broken, self._x, self._R, self.time)
        self._limit = None
        ends = np.concatenate([self.joints.a[broken], self.joints.b[broken]])
        ends = np.unique(ends[ends >= 0])
        newly = ends[~self._loose[ends]]
        self._loose[newly] = True
        if self.contact is not None:
            self._turn_on_contact(newly)
            self._handed_over += stored - self._joint_stored()
        self._update_rows_after_loss()

    def _read_all_keeping_velocity(self) -> None:
        """Places now; velocities stay those before the substep, which the account of work still needs."""
        v = self._v.copy()
        self._read_all()
        self._v[:] = v

    def _release_moved(self) -> None:
        """Blocks that left their place count as loose: intact pieces of a broken wall meet the ground and others."""
        if self.contact is None or self._loose.all():
            return
        turned = np.abs(self._R - self._R_start).max(axis=(1, 2)) * self._radius
        moved = np.linalg.norm(self._x - self._x_start, axis=1) + turned
        newly = np.flatnonzero(~self._loose & (moved > STANDS * self._radius))
        if len(newly):
            self._loose[newly] = True
            stored = self._joint_stored()
            self._turn_on_contact(newly)
            self._handed_over += stored - self._joint_stored()
            self._update_rows()

    def _arm_targets(self, dt: float) -> None:
        """Give contact nodes to plain blocks that a loose block or a fixed plane may touch within dt: nodes born inside
        another body would add its penetration to the energy."""
        if self.contact is None:
            return
        plain = np.flatnonzero([not nodes for nodes in self._scene.nodes])
        reach = self._radius + dt * np.linalg.norm(self._v[:, :3], axis=1)
        near = np.union1d(self._near_planes(plain, reach), self._near_debris(plain, reach))
        for row in near:
            self._scene.add_nodes(int(row))
        if len(near):
            self._update_masks(near)
            self._update_rows()

    def _near_debris(self, plain: Array, reach: Array) -> Array:
        loose = np.flatnonzero(self._loose)
        if not len(plain) or not len(loose):
            return np.zeros(0, np.int64)
        tree = cKDTree(self._x[plain])
        near = tree.query_ball_point(self._x[loose], reach[loose] + reach[plain].max())
        return plain[np.unique(np.concatenate([np.array(i, np.int64) for i in near]))]

    def _near_planes(self, plain: Array, reach: Array) -> Array:
        """Blocks within reach of a fixed plane that no joint holds to one."""
        free = plain[~self._grounded()[plain]]
        near = np.zeros(len(free), bool)
        for plane in self.planes:
            height = (self._x[free] + self._origin - plane.point) @ plane.normal
            near |= height < reach[free]
        return free[near]

    def _turn_on_contact(self, newly: Array) -> None:
        self.joints.hand_over(self._loose)
        need = self._near_loose() if self._plain else np.zeros(self.n, bool)
        for row in np.flatnonzero(need):
            if not self._scene.nodes[row]:
                self._scene.add_nodes(int(row))
                newly = np.append(newly, row)
        self._update_masks(np.unique(newly))

    def _update_rows_after_loss(self) -> None:
        """Work of the last substep is settled before the list of bodies shrinks."""
        states = self._v.copy()
        self._read_all()
        self._settle_work(states[self._rows])
        self._F[:] = 0.0
        self._update_rows()

    # ---- what the neighbours read ---------------------------------------------------------------------------

    def centre(self) -> Array:
        """(n, 3) [m]"""
        return self._x + self._origin

    def rotation(self) -> Array:
        """(n, 3, 3): body frame → world."""
        return self._R.copy()

    def velocity(self) -> Array:
        """(n, 6) [m/s, rad/s]"""
        return self._v.copy()

    def inertia(self) -> Array:
        """(n, 3, 3) [kg m²] about the centres, world axes."""
        return self._R @ self._body_inertia @ self._R.transpose(0, 2, 1)

    def contacts(self) -> Contacts:
        """Contacts at the present positions, read from YADE once a step."""
        if self._contacts is None:
            self._contacts = read_contacts(self._scene)
        return self._contacts

    def gravity_force(self) -> Array:
        """(n, 6) [N, N m]"""
        force = np.zeros((self.n, 6))
        force[:, :3] = self.mass[:, None] * self.gravity
        return force

    def internal_force(self, viscous: bool = False) -> Array:
        """Forces of joints and contacts on the blocks at the present state, (n, 6).

        Elastic parts only by default: the dashpots act through the damping matrix of `tangent`.
        """
        F = np.zeros((self.n, 6))
        if self.joints is not None:
            self.joints.forces(self._x, self._v, self._R, F, eta=None if viscous else 0.0)
        if self.contact is not None:
            contacts = self.contacts()
            force = contacts.forces(self._v, self._x) if viscous else contacts.elastic_forces()
            F += sum_on_blocks(contacts, force, self._x)
        return F

    def reaction(self) -> Array:
        """(n, 6): what holds the blocks of prescribed motion, minus every force on them; zero for the others."""
        total = self.internal_force(viscous=True) + self.gravity_force() + self._load
        return np.where(self.fixed[:, None], -total, 0.0)

    def tangent(self) -> tuple[sp.csr_array, sp.csr_array]:
        """(K, C), each (6n, 6n): secant stiffness and damping of live joints and of contacts."""
        springs = tangent.Springs.none()
        if self.joints is not None:
            springs = springs.and_(tangent.joint_springs(self.joints, self._x, self._R))
        if self.contact is not None:
            springs = springs.and_(self.contacts().springs(self._x))
        return tangent.assemble(springs, self.n)

    def joint_table(self) -> JointTable | None:
        """State of every joint, None without joints."""
        if self.joints is None:
            return None
        table = self.joints.table(self._x, self._R)
        table.centre[:] += self._origin
        return table

    def touching(self) -> Array:
        """(n,) bool: blocks with a contact of YADE, to one another or to a fixed plane."""
        found = np.zeros(self.n, bool)
        if self.contact is not None:
            contacts = self.contacts()
            found[contacts.a[contacts.a >= 0]] = True
            found[contacts.b[contacts.b >= 0]] = True
        return found

    def joined_planes(self) -> tuple[Array, Array, Array]:
        """Faces sealed by a live joint: block (m,), face (m,), half of the largest opening (m,) [m]."""
        if self.joints is None:
            return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0)
        live = self.joints.live
        half = 0.5 * self.joints.openings(live, self._x, self._R)[:, 2]
        inner = self.joints.b[live] >= 0
        return (
            np.concatenate([self.joints.a[live], self.joints.b[live][inner]]),
            np.concatenate([self.joints.face_a[live], self.joints.face_b[live][inner]]),
            np.concatenate([half, half[inner]]),
        )

    def displace(self, rows: Array, shift: Array, turn: Array) -> None:
        """Move blocks at once: shift (m, 3) [m], turn (m, 3, 3) about their centres; the joints take note of what
        opens, velocities stay, and the energy accounts start anew from here."""
        self._scene.displace(rows, shift, turn)
        self._read_all()
        if self.joints is not None:
            self._F[:] = 0.0
            self.joints.forces(self._x, self._v, self._R, self._F, advance=True)
            self._joint_work = -self._joint_stored() - self.law_dissipation()
        self._x_start, self._R_start, self._contacts = self._x.copy(), self._R.copy(), None
        self._start_energy = sum(self._mechanical().values()) + self.law_dissipation()

    # ---- energies -------------------------------------------------------------------------------------------

    def energies(self) -> dict[str, float]:
        """Ledger [J]: kinetic + gravity + joint_stored + joint_dissipated + joint_damping + contact_stored + dashpot
        + friction changes by load_work + driving_work.

        Kinetic energy lives at half substeps (leapfrog), so the potentials are taken there too. joint_dissipated is
        the work that the joints took and did not store, from force times velocity in every substep.
        With track_contacts, dashpot and friction are sums over contacts of force times velocity; without, `friction`
        holds both, from the balance.
        """
        e = self._mechanical()
        e["load_work"] = self.load_work
        e["driving_work"] = self._driving_work
        if self._contact_work is not None:
            e["driving_work"] += self._contact_work.driving
        damped = 0.0 if self.joints is None else float(self.joints.energy[:, joint_kernel.DAMPED].sum())
        e["joint_damping"] = damped
        e["joint_dissipated"] = -self._joint_work - e["joint_stored"] - damped - self._handed_over
        if self._contact_work is not None:
            e["dashpot"] = self._contact_work.dashpot
            e["friction"] = self._contact_work.friction
        else:
            e["dashpot"] = 0.0
            known = e["kinetic"] + e["gravity"] + e["joint_stored"] + e["joint_dissipated"] + damped
            given = self.load_work + e["driving_work"] + self._start_energy
            e["friction"] = given - known - e["contact_stored"]
        return e

    def law_dissipation(self) -> float:
        """Energy that the damage stands for by the law, Σ A D(λ) [J]: to compare with joint_dissipated."""
        return 0.0 if self.joints is None else float(self.joints.energy[:, joint_kernel.DISSIPATED].sum())

    def _half_step_place(self) -> Array:
        return self._x - 0.5 * self._dt * self._v[:, :3]

    def _work_of_load(self, half_before: Array, turn: Array, spin_before: Array) -> float:
        """Work of the held load [J] between the half substeps where the kinetic energy lives."""
        free = ~self.fixed
        moved = self._half_step_place() - half_before
        turned = turn - 0.5 * self._dt * (self._v[:, 3:] - spin_before)
        return float(np.sum(self._load[free, :3] * moved[free]) + np.sum(self._load[free, 3:] * turned[free]))

    def _joint_stored(self) -> float:
        if self.joints is None or not len(self.joints.live):
            return 0.0
        x0, R0 = self._place_before()
        return joint_kernel.stored_between(*self.joints.arrays(), self._x, self._R, x0, R0)

    def _place_before(self) -> tuple[Array, Array]:
        """Places one substep ago."""
        back = Rotation.from_rotvec(-self._dt * self._v[:, 3:]).as_matrix()
        return self._x - self._dt * self._v[:, :3], back @ self._R

    def _contact_stored(self) -> float:
        """Springs of the contacts half a substep ago: 1/2 k u(t) u(t + dt) in the normals [J]."""
        if self.contact is None:
            return 0.0
        c = self.contacts()
        closing = np.einsum("ci,ci->c", c.closing_velocity(self._v, self._x), c.normal)
        depth = np.maximum(c.depth, 0.0)
        normal = 0.5 * c.kn * depth * np.maximum(depth - self._dt * closing, 0.0)
        return float(np.sum(normal + 0.5 * (c.shear_force**2).sum(axis=1) / c.ks))

    def _mechanical(self) -> dict[str, float]:
        free = ~self.fixed
        v, w = self._v[free, :3], self._v[free, 3:]
        spin = np.einsum("ni,nij,nj->", w, self.inertia()[free], w)
        kinetic = 0.5 * (self.mass[free] @ (v**2).sum(axis=1) + spin)
        height = self._half_step_place()[free] @ self.gravity
        return {
            "kinetic": float(kinetic),
            "gravity": float(-self.mass[free] @ height),
            "joint_stored": self._joint_stored(),
            "contact_stored": self._contact_stored(),
        }

    # ---- saving and going back ------------------------------------------------------------------------------

    def save(self) -> StructureState:
        """Everything that changes in time, for a second pass over a step."""
        sums = {name: getattr(self, name) for name in _SUMS}
        history = self.joints.history() if self.joints is not None else None
        work = self._contact_work.sums() if self._contact_work is not None else None
        return StructureState(self._scene.save(), self._loose.copy(), sums, history, work)

    def restore(self, saved: StructureState) -> None:
        """Back to a saved state; blocks that got contact nodes since keep them, without effect on their motion."""
        self._loose = saved.loose.copy()
        for name, value in saved.sums.items():
            setattr(self, name, value)
        if self.joints is not None:
            self.joints.restore(saved.joints)
        if self._contact_work is not None:
            self._contact_work.restore(saved.contact_work)
        self._pending_dt, self._limit, self._contacts = 0.0, None, None
        self._F[:] = 0.0
        self._update_rows()
        self._update_masks(np.arange(self.n))
        self._scene.restore(saved.scene)
        self._read_all()

    def close(self) -> None:
        """Give YADE's scene back."""
        self._scene.close()

    def __enter__(self) -> Structure:
        return self

    def __exit__(self, *error) -> None:
        self.close()
