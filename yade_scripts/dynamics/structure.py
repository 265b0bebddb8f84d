"""The structure: blocks, joints and contact, moved by YADE under given loads.

World coordinates and SI units outside; one row a block; motions and forces are six numbers a block about its centre,
[velocity, angular velocity] and [force, moment], world axes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from array_types import Array, Floats, Ints
from yade_scripts.blocks.block import Block, BlockError
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.arrays import Parted
from yade_scripts.contact.forces import ContactForces
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.description import check_names, local_origin, matched_stiffness, moved_block
from yade_scripts.dynamics.energy import EnergySums, Masses
from yade_scripts.dynamics.faces_at_start import FacesAtStart
from yade_scripts.dynamics.impulses import Impulses, ImpulseSums
from yade_scripts.dynamics.onset import ContactOnset, loose_at_start, moves
from yade_scripts.dynamics.readings import StructureReadings
from yade_scripts.dynamics.spin import SpinCorrection
from yade_scripts.dynamics.state import StructureState, check_belongs
from yade_scripts.dynamics.substep import Substepper
from yade_scripts.dynamics.timestep import QUIET, SubstepLimit, contact_limits, substep_limit
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.joints import Joints
from yade_scripts.joints.rules import JointRules
from yade_scripts.joints.seals import Seals
from yade_scripts.yade_side.engine import load_yade
from yade_scripts.yade_side.motion import Motion
from yade_scripts.yade_side.scene import Scene

GRAVITY = (0.0, 0.0, -9.81)


class NotFinite(RuntimeError):
    """Positions, velocities or loads of blocks are not finite."""


@dataclass(frozen=True, kw_only=True)
class AdvanceReport:
    """substeps · dt_s [s] · opening_rate: largest growth of λ/δ_f in a substep (beyond about 0.25 one substep
    averages over the softening) · mean_velocity (n, 6) = displacement and rotation vector over the step / dt
    load_work [J] done by the load · broken: joints that failed, rows of the joint table
    impulses: what contacts and joints gave to every block
    """

    substeps: int
    dt_s: float
    opening_rate: float
    mean_velocity: Floats
    load_work: float
    broken: Ints
    impulses: Impulses


class Structure(StructureReadings):
    """Rigid blocks with contact (`contact=None`: none) and cohesive joints (`joints=None`: none).

    blocks: list of Block, unique names · ground: level of a horizontal floor [m] or None
    planes: further fixed planes (tank walls) · gravity (3,) [m/s²]
    joints: one law for all touching faces, or rules by pairs and scatter
    threads: of YADE's OpenMP, which the first structure of a process sets
    substep [s]: length to use instead of the accurate one from `substep_limit`; None: that one
    ramp [s]: time over which the weight of the blocks comes on
    sleep: share of the strength of joints by which their tractions may be off while islands of blocks sleep
    (`sleep.py`), None: all blocks take all substeps
    Faces that touch at the start without a joint, and between which no pressure of the surrounding water acts
    (`contact.uplift`), count as sealed as long as they touch (`joined_planes`).

    Fixed blocks are not joined to one another or to planes, since nothing could break there; their faces are sealed
    as those of a joint. Driven blocks are joined: they may part.

    One structure in a process at a time (YADE has one scene): use it as a context manager or call close().
    """

    def __init__(
        self,
        blocks: list[Block],
        contact: ContactLaw | None = None,
        joints: JointParameters | JointRules | None = None,
        ground: float | None = None,
        planes: list[FixedPlane] | tuple = (),
        gravity=GRAVITY,
        threads: int = 1,
        substep: float | None = None,
        ramp: float = 0.0,
        sleep: float | None = None,
    ):
        self._sleep = None
        self._describe(blocks, gravity)
        self.contact = contact
        self.planes = _with_ground(ground, planes)
        origin = self._origin = local_origin(blocks)
        local = [moved_block(b, -origin) for b in blocks]
        local_planes = [replace(p, point=p.point - origin) for p in self.planes]
        self.joint_rules = JointRules(joints) if isinstance(joints, JointParameters) else joints
        faces = FacesAtStart.of(local, local_planes, self.joint_rules, contact)
        self.joints = faces.joints(local, self.joint_rules)
        self._seals = Seals(local, faces.sealed) if faces.sealed else None
        self._partly = Seals(local, [face for face, _ in faces.partly]) if faces.partly else None
        self._shares = np.array([share for _, share in faces.partly])
        self._set_friction_of_failed_points()
        self.face_stiffness = self._face_stiffness()
        self._contact_stable = (
            None if contact is None else contact_limits(self.blocks, self.face_stiffness, contact)
        )
        self._set_damping()
        self._substep = substep
        if substep is not None:
            self._limit_of(holding=False).check(substep)
        self._scene = Scene(load_yade(threads), local, contact is not None, self.gravity)
        self._motion = Motion(self._scene, local_planes)
        self._motion.read()
        self._contacts = self._contact_forces(local, local_planes)
        loose = loose_at_start(blocks, self.joints)
        loose[[row for row in faces.held_rows if not moves(blocks[row])]] = False
        loose[faces.resting_rows] = True  # contact carries them from the start
        self._onset = ContactOnset(
            self._scene, self._motion, self.joints, self._contacts, self._radius, loose
        )
        self._start_energy_sums(ramp)
        if sleep is not None and self.joints is not None:
            self._set_sleep(sleep, self.joints)

    # ---- setting up -----------------------------------------------------------------------------------------

    def _describe(self, blocks: list[Block], gravity) -> None:
        check_names(blocks)
        self.blocks = list(blocks)
        self.n = len(self.blocks)
        self.pause: Callable[[], None] | None = None
        """Called after every substep, where the run may be ended by an exception."""
        self.names = [b.name for b in blocks]
        self.groups = [b.group for b in blocks]
        self.mass = np.array([b.mass for b in blocks])
        self.volume = np.array([b.volume for b in blocks])
        self.fixed = np.array([b.fixed or b.driven for b in blocks], bool)
        """Blocks whose motion is prescribed: still, or driven at their velocity."""
        self.prescribed = {row: b.motion for row, b in enumerate(self.blocks) if b.motion is not None}
        """Motions over time by the rows of the blocks that are told one."""
        self.shape_vertices: list[Array] = [np.asarray(b.vertices) for b in blocks]
        self.shape_faces = [[list(f) for f in b.faces] for b in blocks]
        self.gravity = np.asarray(gravity, float)
        inertia = np.array([b.inertia for b in blocks]).reshape(-1, 3, 3)
        self._masses = Masses(self.mass, inertia, ~self.fixed, self.gravity)
        self._spin = SpinCorrection(inertia, ~self.fixed)
        self._radius = np.array([b.radius for b in blocks])

    def _set_friction_of_failed_points(self) -> None:
        """Friction of contact where a joint has failed in part."""
        if self.joints is None or self.contact is None:
            return
        materials = sorted({b.material for b in self.blocks} | {p.material for p in self.planes})
        row = {name: i for i, name in enumerate(materials)}
        of_block = np.array([row[b.material] for b in self.blocks])
        of_plane = np.array([row[p.material] for p in self.planes], np.int64)
        j = self.joints
        other = of_block[j.b]
        other[j.b < 0] = of_plane[j.plane[j.b < 0]]
        j.set_friction(self.contact.friction_table(materials)[of_block[j.a], other])

    def _face_stiffness(self) -> Array:
        """K [N/m] of each block: as given, or that of its joints in closing."""
        if self.contact is None:
            return np.zeros(self.n)
        if self.contact.stiffness is not None:
            return np.full(self.n, self.contact.stiffness)
        return matched_stiffness(self.blocks, self.joints)

    def _contact_forces(self, blocks: list[Block], planes: list[FixedPlane]) -> ContactForces | None:
        if self.contact is None:
            return None
        scene = self._scene
        return ContactForces(
            blocks,
            planes,
            self.contact,
            self.face_stiffness,
            ~self.fixed,
            self._motion,
            scene.neighbours,
            scene.margin,
        )

    def _set_damping(self) -> None:
        """Dashpot time η = 2 z/ω of the stiffest joint mode; none where all joined blocks are held."""
        self._limits: dict[bool, SubstepLimit] = {}
        if self.joints is not None and self.joints.parameters.damping > 0.0:
            omega = self._limit_of(holding=False).omega
            self.joints.eta = 2.0 * self.joints.parameters.damping / omega if omega > 0.0 else 0.0

    def _start_energy_sums(self, ramp: float) -> None:
        self.time = 0.0
        self._energy_sums = EnergySums(self._masses, self._motion, self.joints, self._contacts)
        self._impulses = ImpulseSums(self.n, self._origin)
        self._substepper = Substepper(
            self._scene,
            self._motion,
            self.joints,
            self._contacts,
            self._spin,
            self._energy_sums,
            self._impulses,
            ramp,
            self.prescribed,
        )
        self._list_bodies()

    def _set_sleep(self, share: float, joints: Joints) -> None:
        from yade_scripts.dynamics.sleep import Sleep

        self._sleep = Sleep(
            share,
            self._scene,
            self._motion,
            joints,
            self._contacts,
            self._onset,
            self._spin,
            self._masses,
            self._energy_sums,
            self._impulses,
            self._sleepers_changed,
        )

    def share_work(self, share: Callable[..., list]) -> None:
        """Run the loops over pairs of blocks and over joints by share(kernel, count, *arguments, weight=...,
        pieces=...), which may call kernel(first, last, *arguments) on several threads and gives what the calls return,
        in order. The bits are the same."""
        for loop in (self._contacts, self.joints):
            if loop is not None:
                loop.share = share

    def _sleepers_changed(self) -> None:
        self._limits.clear()
        self._list_bodies()

    def _list_bodies(self) -> None:
        self._substepper.list_bodies(self._onset.loose, None if self._sleep is None else self._sleep.asleep)

    # ---- moving on ------------------------------------------------------------------------------------------

    def set_load(self, F: Array) -> None:
        """Force and moment (n, 6) [N, N m] on the blocks from now on, about their centres as they move."""
        F = np.asarray(F, float)
        if F.shape != (self.n, 6) or not np.isfinite(F).all():
            raise NotFinite(f"load of shape {F.shape} for {self.n} blocks, finite: {np.isfinite(F).all()}")
        self._substepper.load = F.copy()
        self._list_bodies()

    def drive(self, name: str, velocity=(0.0, 0.0, 0.0), spin=(0.0, 0.0, 0.0)) -> None:
        """New prescribed motion of a driven block: velocity (3,) [m/s], spin (3,) [rad/s]."""
        row = self.names.index(name)
        if not self.blocks[row].driven:
            raise BlockError(
                f"block '{name}' is not driven; only blocks with driven=True take a prescribed motion"
            )
        self.blocks[row] = self.blocks[row].changed(velocity=velocity, spin=spin)
        self._scene.set_motion(row, np.concatenate([np.asarray(velocity, float), np.asarray(spin, float)]))
        self._limits.clear()
        self._motion.read()

    def substep_limit(self) -> SubstepLimit:
        """Largest substep of the present state and what limits it."""
        return self._limit_of(self._joints_hold())

    def _limit_of(self, holding: bool) -> SubstepLimit:
        """The limit while joints hold, or when they no longer do; found anew when joints have failed."""
        if holding not in self._limits:
            damping = 0.0 if self.joints is None else self.joints.parameters.damping
            asleep = None if self._sleep is None else self._sleep.asleep
            self._limits[holding] = substep_limit(
                self.blocks,
                self.joints,
                self.face_stiffness,
                damping,
                self.contact,
                self._contact_stable,
                asleep,
                holding,
            )
        return self._limits[holding]

    def _joints_hold(self) -> bool:
        """Whether all joints hold, and go on to in a substep that is as long as this allows."""
        m = self._motion
        if self.joints is None or not self.joints.holding():
            return False
        return self.joints.pace(m.x, m.v, m.R) * self._limit_of(holding=True).dt <= QUIET

    def stable_substep(self) -> tuple[float, str]:
        """The largest stable substep [s], and the joint or contact that limits it."""
        limit = self.substep_limit()
        return limit.dt, limit.what

    def substep(self) -> float:
        """The substep [s]: the one asked for, or else the accurate one."""
        return self.stable_substep()[0] if self._substep is None else self._substep

    def advance(self, dt: float, substep: float | None = None) -> AdvanceReport:
        """Advance by dt [s] under the load of `set_load`, in substeps no longer than `substep`, by default that of the
        structure. Raises SubstepTooLong where the motion would be unstable."""
        m = self._motion
        self._turn_on_contacts()
        if self._sleep is not None:
            self._sleep.begin(self.weight_now() + self._substepper.load, self.time, self._substepper.ramp)
        x0, R0, half, spin = m.x.copy(), m.R.copy(), m.half_step_back(), m.v[:, 3:].copy()
        self._substepper.fastest = 0.0
        self._impulses.start()
        broken, count = self._substeps(dt, substep)
        m.read()
        self._check_finite()
        turn = m.turned_since(R0)
        if self._sleep is not None:
            self._sleep.end(self.time)
        work = self._energy_sums.take_load(self._substepper.load, x0, half, turn, spin)
        mean = np.concatenate([m.x - x0, turn], axis=1) / dt
        failed = np.concatenate(broken).astype(np.int64)
        return AdvanceReport(
            substeps=count,
            dt_s=dt / count,
            opening_rate=self._substepper.fastest,
            mean_velocity=mean,
            load_work=work,
            broken=failed,
            impulses=self._impulses.taken(),
        )

    def count_substeps(self, dt: float, substep: float | None = None) -> int:
        """Number of equal substeps in which `advance` begins a time dt [s]. Raises SubstepTooLong as it does."""
        return self._count(dt, substep, self.substep_limit())

    def _count(self, dt: float, substep: float | None, most: SubstepLimit) -> int:
        """Number of equal substeps in a time dt [s], as long as `substep`, the one of the structure, or else `most`."""
        asked = self._substep if substep is None else substep
        limit = most.dt if asked is None else asked
        most.check(min(limit, dt))
        if self._sleep is not None and self.still.all() and not self._motion.v.any():
            return 1
        return max(1, int(np.ceil(dt / limit * (1.0 - 1e-12)))) if np.isfinite(limit) else 1

    def _substeps(self, dt: float, substep: float | None) -> tuple[list[Array], int]:
        """Take dt [s] in equal substeps, and in others from where a block woke or a joint began to soften: joints that
        failed in each, and how many there were."""
        broken: list[Array] = []
        holding = self._joints_hold()
        left = self._count(dt, substep, self._limit_of(holding))
        length = dt / left
        holding = holding and self._substep is None and substep is None
        while left:
            broken.append(self._one_substep(length))
            left -= 1
            woke = self._sleep is not None and self._sleep.reached(self.time)
            held, holding = holding, holding and self._still_hold()
            if (woke or held != holding) and left:
                rest = left * length
                left = self._count(rest, substep, self._limit_of(holding))
                length = rest / left
        return broken, len(broken)

    def _still_hold(self) -> bool:
        """Whether joints that held before a substep still do."""
        return self.joints is not None and self._substepper.fastest <= QUIET and self.joints.holding()

    def _turn_on_contacts(self) -> None:
        """Before a step, switch contacts on for pieces that have left their position."""
        if self.contact is None:
            return
        moved = self._onset.moved()
        if len(moved):
            self._motion.read()
            self._onset.loosen(moved)
            self._list_bodies()

    def _one_substep(self, dt: float) -> Array:
        """Take one substep; rows of the table of the joints that failed in it."""
        self._substepper.step(dt, self.time)
        self.time += dt
        broken = self.joints.broken_now() if self.joints is not None else np.zeros(0, np.int64)
        if self.joints is not None and len(broken):
            self._retire(self.joints, broken)
        if self.pause is not None:
            self.pause()
        return broken

    def _retire(self, j: Joints, broken: Array) -> None:
        """Remove failed joints; contact takes over the part of their energy that was compression."""
        m = self._motion
        m.read()
        energy = j.stored_between(m.x, m.R, *m.before(), which=broken)[broken]
        energy -= j.release(broken, m.x, m.R)
        failed = Parted(j.pairs(broken, self.n), j.pressing(broken, m.x, m.R), energy)
        j.retire(broken, m.x, m.R, self.time)
        self._limits.clear()
        self._onset.loosen(self._onset.of_failed(broken))
        self._onset.leave_out_joined(failed)
        self._energy_sums.handed_over += float(energy.sum())
        if self._sleep is not None:
            self._sleep.joints_failed()
        self._list_bodies()

    def _check_finite(self) -> None:
        wrong = np.flatnonzero(~np.isfinite(self._motion.x).all(axis=1))
        if len(wrong):
            raise NotFinite(
                f"block '{self.names[wrong[0]]}' has no finite position at t = {self.time:.6g} s; use a shorter substep"
            )

    def displace(self, rows: Array, shift: Array, turn: Array) -> None:
        """Move blocks at once: shift (m, 3) [m], turn (m, 3, 3) about their centres; the joints take note of what
        opens, velocities stay, and the energy sums start anew from here."""
        m = self._motion
        if self._sleep is not None:
            self._sleep.wake_all(self.time)
        self._scene.displace(rows, shift, turn)
        m.read()
        if self.joints is not None:
            self.joints.forces(m.x, m.v, m.R, np.zeros((self.n, 6)), advance=True)
        self._onset.rest_here()
        if self._contacts is not None:
            self._contacts.moved()
        self._limits.clear()
        self._energy_sums.start_here()

    # ---- saving and going back ------------------------------------------------------------------------------

    def save(self) -> StructureState:
        """Everything that changes in time, for a second pass over a step, or for a file (`StructureState.arrays`)."""
        return StructureState(
            motion=self._scene.save(),
            time=self.time,
            dt=self._motion.dt,
            load=self._substepper.load.copy(),
            lent_spin=self._spin.save(),
            onset=self._onset.save(),
            sums=self._energy_sums.sums(),
            joints=self.joints.history() if self.joints is not None else None,
            contacts=self._contacts.save() if self._contacts is not None else None,
            sleep=self._sleep.save() if self._sleep is not None else None,
        )

    def restore(self, saved: StructureState) -> None:
        """Back to a saved state, bit for bit; it may come from another process, with the structure built alike.

        Raises OtherStructure if the state has other blocks or joints."""
        points = None if self.joints is None else len(self.joints.largest)
        check_belongs(saved, self.n, points, self._contacts is not None, self._sleep is not None)
        self.time, self._motion.dt = saved.time, saved.dt
        self._limits.clear()
        if self._sleep is not None and saved.sleep is not None:
            asleep = saved.sleep["asleep"].astype(bool)
            self._scene.set_held(asleep)
            self._motion.rest(asleep)
            self._motion.put(np.flatnonzero(asleep), saved.motion)
        self._scene.restore(saved.motion)
        self._take_driven(saved.motion)
        self._motion.read()
        self._spin.restore(saved.lent_spin)
        self._onset.restore(saved.onset)
        self._energy_sums.restore(saved.sums)
        if self.joints is not None and saved.joints is not None:
            self.joints.restore(saved.joints)
        if self._contacts is not None and saved.contacts is not None:
            self._contacts.restore(saved.contacts)
        if self._sleep is not None and saved.sleep is not None:
            self._sleep.restore(saved.sleep)
        self.set_load(saved.load)

    def _take_driven(self, motion: Array) -> None:
        """Return to the prescribed motions of a state, in case `drive` has changed them since."""
        for row in np.flatnonzero([b.driven for b in self.blocks]):
            velocity, spin = motion[row, 7:10], motion[row, 10:13]
            block = self.blocks[row]
            if (block.velocity != velocity).any() or (block.spin != spin).any():
                self.blocks[row] = block.changed(velocity=velocity, spin=spin)

    def close(self) -> None:
        """Release YADE's scene; the structure cannot be used afterwards."""
        self._scene.close()

    def __enter__(self) -> Structure:
        return self

    def __exit__(self, *error) -> None:
        self.close()


def _with_ground(ground: float | None, planes) -> list[FixedPlane]:
    floor = (
        []
        if ground is None
        else [FixedPlane(np.array([0.0, 0.0, ground]), np.array([0.0, 0.0, 1.0]), "ground")]
    )
    return [*floor, *planes]
