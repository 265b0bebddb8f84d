"""The YADE side: bodies, materials, masks and the engine list. Arrays in and out, one row a block.

A block that may touch something is a clump of one Box and small node spheres; contact is Box against sphere with
YADE's spring, dashpot and slider (`Law2_ScGeom_ViscElPhys_Basic`). A block whose joints are all intact is a plain Box
without nodes (the joints carry it) until damage turns it into a clump.

Masks (two bodies meet if they share a bit; equal masks holding bit 1 or 2 do not):

    nodes of an intact block joined to the ground 1, of another intact block 9, of a damaged or loose block 14
    box of an intact block 2, of a damaged block 3 · fixed planes 8

so intact-intact pairs never meet (their joints carry compression), every other pair does.
"""

from __future__ import annotations

import struct
from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from yade_scripts.blocks import Block
from yade_scripts.contact import ContactLaw, effective_mass
from yade_scripts.engine import Engine, YadeError
from yade_scripts.faces import FixedPlane
from yade_scripts.nodes import node_positions, node_radius

Array = np.ndarray

NODE_GROUNDED, NODE_INTACT, NODE_LOOSE = 1, 9, 14
BOX_INTACT, BOX_LOOSE, PLANE = 2, 3, 8
RIGID = 1e30
"""Stiffness of fixed planes: in series with a block's own, the block's own."""
VERLET = 0.05
"""Margin of the collision search as a share of the smallest edge of a block."""
LIKE = 4.1
"""Mass ratio up to which the dashpots of the materials serve every pair (e within 0.02); beyond it each new contact is
looked at in Python, which takes a sixth of the time of a collapse."""
WHITE = (1.0, 1.0, 1.0)
"""Colour of nodes; left to itself, YADE seeds a random generator for each."""
INSTANT = 1e-200
"""Length of a substep in which nothing moves [s]."""
STATE = 13
"""Numbers of a body: position 3, velocity 3, angular velocity 3, orientation 4 (x y z w)."""


class SceneInUse(YadeError):
    """YADE holds one scene in a process; close the structure that has it first."""


@dataclass(frozen=True)
class SceneState:
    """ids: body of each row then · motion: (position, orientation, velocity, spin, angular momentum) of each row

    shear: tangential force of each contact (id1, id2).
    """

    ids: list[int]
    motion: list[tuple]
    shear: dict[tuple[int, int], object]


class Scene:
    """Bodies of `blocks` (local coordinates) in YADE; `face_stiffness` (n,) K [N/m]; law None: no contact at all."""

    _owner: Scene | None = None

    def __init__(
        self,
        engine: Engine,
        blocks: list[Block],
        planes: list[FixedPlane],
        law: ContactLaw | None,
        face_stiffness: Array,
        gravity: Array,
        with_nodes: Array,
    ):
        if Scene._owner is not None:
            raise SceneInUse("YADE holds another structure in this process; call its close() first")
        Scene._owner = self
        self.engine, self.O, self.blocks, self.law = engine, engine.O, blocks, law
        self.O.reset()
        self.K = np.asarray(face_stiffness, float)
        self.moving = np.array([not (b.fixed or b.driven) for b in blocks], bool)
        self.mass = np.array([b.mass for b in blocks])
        self.ids: list[int] = []
        self.nodes: list[list[int]] = [[] for _ in blocks]
        self.box_id: list[int] = []
        self.row_of: dict[int, int] = {}
        self.frame = np.tile(np.eye(3), (len(blocks), 1, 1))
        """Fixed turn from the block frame to YADE's principal frame."""
        self.plain_frame = self.frame.copy()
        """The same of a block before it became a clump."""
        self._corrected_until = 0
        self._materials: dict[tuple, object] = {}
        self._subdomain = engine.wrapper.Subdomain()
        self._set_engines(gravity)
        self._add_planes(planes)
        for row, block in enumerate(blocks):
            self._add_block(row, block, with_nodes[row])

    # ---- building -------------------------------------------------------------------------------------------

    def _add_planes(self, planes: list[FixedPlane]) -> None:
        """Thick fixed boxes whose upper faces lie in the planes, far wider than the scene."""
        if self.law is None or not self.blocks:
            return
        points = np.concatenate([b.world_vertices() for b in self.blocks])
        span = 1e3 * (np.ptp(points, axis=0).max() + 1.0)
        thick = 20.0 * max(b.radius for b in self.blocks)
        material = self._plane_material()
        for number, plane in enumerate(planes):
            turn = _turn_to(plane.normal)
            middle = points.mean(axis=0)
            top = middle - plane.normal * (plane.normal @ (middle - plane.point))
            body = self.engine.utils.box(
                self._v(top - thick * plane.normal),
                self._v((span, span, thick)),
                orientation=self._q(turn),
                fixed=True,
                material=material,
                mask=PLANE,
            )
            self.row_of[self.O.bodies.append(body)] = -1 - number

    def _add_block(self, row: int, block: Block, with_nodes: bool) -> None:
        if block.is_box:
            box = self.engine.utils.box(
                self._v(block.centre),
                self._v(0.5 * block.size),
                orientation=self._q(block.rotation),
                material=self._material(row, node=False),
                mask=BOX_INTACT,
            )
        else:
            box = self._shapeless(block)
        self.box_id.append(self.O.bodies.append(box))
        self.row_of[self.box_id[row]] = row
        self.ids.append(self.box_id[row])
        self._set_inertia(row, np.concatenate([block.velocity, block.spin]))
        if with_nodes and self.law is not None:
            self.add_nodes(row)

    def _shapeless(self, block: Block):
        """A body that only integrates: a polyhedron in a scene without contact."""
        body = self.engine.wrapper.Body()
        body.state.pos, body.state.ori = self._v(block.centre), self._q(block.rotation)
        body.material = self._material(0, node=False)
        return body

    def add_nodes(self, row: int) -> None:
        """Turn the plain box of a row into a clump with contact nodes; its motion goes on unchanged."""
        O, block = self.O, self.blocks[row]
        state = O.bodies[self.box_id[row]].state
        x, R = np.array(state.pos), _matrix(state.ori)
        motion = np.concatenate([np.array(state.vel), np.array(state.angVel)])
        radius = node_radius(block.size, self.law.node_radius)
        material = self._material(row, node=True)
        spheres = [
            self.engine.utils.sphere(self._v(p), radius, material=material, mask=NODE_INTACT, color=WHITE)
            for p in x + node_positions(block.size, self.law.nodes_per_edge, radius) @ R.T
        ]
        self.nodes[row] = list(O.bodies.append(spheres))
        self.ids[row] = O.bodies.clump([self.box_id[row], *self.nodes[row]])
        self.row_of.update(dict.fromkeys(self.nodes[row], row))
        self.frame[row] = _matrix(O.bodies[self.ids[row]].state.ori).T @ R
        self._set_inertia(row, motion)
        self._carry_members(row, x, motion)

    def _carry_members(self, row: int, x: Array, motion: Array) -> None:
        """Velocities of clump members, which contact forces depend on (YADE sets them in its next integration)."""
        states = [self.O.bodies[i].state for i in (self.box_id[row], *self.nodes[row])]
        velocity = motion[:3] + np.cross(motion[3:], np.array([s.pos for s in states]) - x)
        spin = self._v(motion[3:])
        for state, v in zip(states, velocity):
            state.vel, state.angVel = self._v(v), spin

    def _set_inertia(self, row: int, motion: Array) -> None:
        """Exact mass and inertia in YADE's principal frame; velocity and angular momentum to match.

        A clump has a principal frame already, and its members are placed in it; a plain body is turned into one."""
        block, body = self.blocks[row], self.O.bodies[self.ids[row]]
        state = body.state
        if not block.is_box and not self.nodes[row]:
            R = _matrix(state.ori)
            _, axes = np.linalg.eigh(block.inertia)
            axes[:, 2] *= np.sign(np.linalg.det(axes))
            self.frame[row] = axes.T
            state.ori = self._q(R @ axes)
        T = self.frame[row] @ block.inertia @ self.frame[row].T
        state.mass, state.inertia = block.mass, self._v(np.diag(T))
        body.aspherical = True
        state.vel, state.angVel = self._v(motion[:3]), self._v(motion[3:])
        R = _matrix(state.ori)
        state.angMom = self._v(R @ (np.diag(T) * (R.T @ motion[3:])))
        if not self.moving[row]:
            state.blockedDOFs = "xyzXYZ"

    def _material(self, row: int, node: bool):
        """K per node; dashpots of nodes and boxes so that pairs of equal mass and ground contacts are exact.

        In series: node against plane gives 2ζ sqrt(m K)/n², node against box of an equal block
        2ζ sqrt(m K/2)/(2 n²), hence the 2√2 - 1. Other pairs: `correct_dashpots`.
        """
        if self.law is None:
            law, k, c = ContactLaw(), 0.0, 0.0
        else:
            law, n2 = self.law, self.law.nodes_per_edge**2
            k = self.K[row] / n2
            c = 2.0 * law.damping_ratio * np.sqrt(self.mass[row] * self.K[row]) / n2
        if not node:
            c /= 2.0 * np.sqrt(2.0) - 1.0
        return self._viscel(k, law.shear_ratio * k, c, np.sqrt(law.shear_ratio) * c, law.friction)

    def _plane_material(self):
        law = self.law
        mu = law.friction if law.ground_friction is None else law.ground_friction
        c = RIGID if law.damping_ratio > 0.0 else 0.0
        return self._viscel(RIGID, RIGID, c, c, mu)

    def _viscel(self, kn, ks, cn, cs, mu):
        key = (kn, ks, cn, cs, mu)
        if key not in self._materials:
            material = self.engine.wrapper.ViscElMat(
                kn=kn, ks=ks, cn=cn, cs=cs, frictionAngle=float(np.arctan(mu)), density=1000.0
            )
            self.O.materials.append(material)
            self._materials[key] = material
        return self._materials[key]

    def _set_engines(self, gravity: Array) -> None:
        """Two groups that take turns, so that the joints act between contact forces and integration. (YADE warns of
        forces that were not reset in the step of its integration; here that is meant.)"""
        w = self.engine.wrapper
        self.newton = w.NewtonIntegrator(
            damping=0.0, exactAsphericalRot=True, gravity=self._v(gravity), warnNoForceReset=False
        )
        self.collider = None
        self._finders = [w.ForceResetter()]
        if self.law is not None:
            edge = min((b.size.min() for b in self.blocks if b.is_box), default=1.0)
            self.collider = w.InsertionSortCollider(
                [w.Bo1_Box_Aabb(), w.Bo1_Sphere_Aabb()], verletDist=VERLET * edge, avoidSelfInteractionMask=3
            )
            loop = w.InteractionLoop(
                [w.Ig2_Box_Sphere_ScGeom()],
                [w.Ip2_ViscElMat_ViscElMat_ViscElPhys()],
                [w.Law2_ScGeom_ViscElPhys_Basic()],
            )
            self._finders += [self.collider, loop]
        self.O.engines = [*self._finders, self.newton]

    # ---- reading and writing --------------------------------------------------------------------------------

    def read(self, rows_ids: list[int], buffer: bytearray) -> Array:
        """States of body ids into a buffer of 8 * 13 bytes each → (k, 13) view on it.

        The list must persist between calls: YADE leaks a reference per fresh item it is handed.
        """
        struct.pack_into(
            f"{STATE * len(rows_ids)}d", buffer, 0, *self._subdomain.getStateValuesFromIds(rows_ids)
        )
        return np.frombuffer(buffer, float, STATE * len(rows_ids)).reshape(-1, STATE)

    def add_forces(self, ids: list[int], F: Array) -> None:
        """Add F (k, 6) to the bodies for the integration to come.

        YADE's permanent forces are not used: its integrator aborts when bodies are added after one was set."""
        forces = self.O.forces
        deque(map(forces.addF, ids, F[:, :3].tolist()), maxlen=0)
        deque(map(forces.addT, ids, F[:, 3:].tolist()), maxlen=0)

    def set_motion(self, row: int, motion: Array) -> None:
        """Velocity and spin (6,) of a block whose motion is prescribed."""
        state = self.O.bodies[self.ids[row]].state
        state.vel, state.angVel = self._v(motion[:3]), self._v(motion[3:])

    def set_masks(self, row: int, loose: bool, grounded: bool) -> None:
        """Meeting rules of a block by its state (see the module text)."""
        bodies = self.O.bodies
        node = NODE_LOOSE if loose else (NODE_GROUNDED if grounded else NODE_INTACT)
        bodies[self.box_id[row]].mask = BOX_LOOSE if loose else BOX_INTACT
        for i in self.nodes[row]:
            bodies[i].mask = node

    def has_nodes(self) -> Array:
        """(n,) bool: blocks that can touch something."""
        return np.array([len(nodes) > 0 for nodes in self.nodes], bool)

    def find_contacts(self, dt: float) -> None:
        """Contacts and their forces at the present places; tangential springs grow by slip times dt [s]."""
        self.O.dt = dt
        self._take_turn(finders=True)

    def integrate(self) -> None:
        """Move on by the dt of `find_contacts`, under its forces and those added since."""
        self._take_turn(finders=False)

    def _take_turn(self, finders: bool) -> None:
        for engine in self._finders:
            engine.dead = not finders
        self.newton.dead = finders
        self.O.step()

    def look(self) -> None:
        """Contacts at the present places, for reading: nothing moves, and their forces are dropped."""
        if self.collider is not None:
            self.find_contacts(INSTANT)
            self.O.forces.f(0, sync=True)  # YADE resets only forces that have been summed over its threads

    def search_contacts(self) -> None:
        """Look for pairs that may touch among all bodies (after masks or bodies changed)."""
        if self.collider is not None:
            self.collider.doSort = True
            self.collider()

    def displace(self, rows: Array, shift: Array, turn: Array) -> None:
        """Move the blocks `rows` by shift (m, 3) and turn (m, 3, 3) about their centres, with all their members."""
        for row, move, Q in zip(rows, shift, turn):
            centre = np.array(self.O.bodies[self.ids[row]].state.pos)
            for member in {self.ids[row], self.box_id[row], *self.nodes[row]}:
                state = self.O.bodies[member].state
                state.pos = self._v(centre + move + Q @ (np.array(state.pos) - centre))
                state.ori = self._q(Q @ _matrix(state.ori))
        self.look()

    def contacts(self) -> list:
        """Real interactions between a node and a box, at the present places."""
        return list(self.O.interactions) if self.collider is not None else []

    def correct_dashpots(self) -> None:
        """Give new contacts the dashpot of their own pair, C = 2 ζ sqrt(m K) / points with the effective mass.

        The materials in series give it for equal masses and for planes; this is for blocks of unlike mass."""
        since, self._corrected_until = self._corrected_until, self.O.iter
        for i in [i for i in self.O.interactions if i.iterMadeReal >= since]:
            a, b = self.row_of[i.id1], self.row_of[i.id2]
            if a >= 0 and b >= 0:
                phys, c = i.phys, self.pair_dashpot(a, b)
                phys.cn, phys.cs = c, c * np.sqrt(self.law.shear_ratio)

    def pair_dashpot(self, a: int, b: int) -> float:
        """Dashpot of one node contact between two blocks [N s/m]."""
        ma, mb = (self.mass[r] if self.moving[r] else np.inf for r in (a, b))
        if not self.moving[a] and not self.moving[b]:
            return 0.0
        K = 2.0 * self.K[a] * self.K[b] / (self.K[a] + self.K[b])
        points = 2 * self.law.nodes_per_edge**2
        return 2.0 * self.law.damping_ratio * float(np.sqrt(effective_mass(ma, mb) * K)) / points

    @property
    def masses_differ(self) -> bool:
        """Whether the dashpots of the materials are off for some pair by more than a few percent."""
        if not self.moving.any():
            return False
        moving = self.mass[self.moving]
        return bool(not self.moving.all() or moving.max() > LIKE * moving.min())

    # ---- saving and going back ------------------------------------------------------------------------------

    def save(self) -> SceneState:
        """Motion of the bodies and tangential springs of the contacts."""
        states = [self.O.bodies[i].state for i in self.ids]
        # Copies: YADE hands out views of its vectors.
        V, Q = self.engine.Vector3, self.engine.Quaternion
        motion = [(V(s.pos), Q(s.ori), V(s.vel), V(s.angVel), V(s.angMom)) for s in states]
        return SceneState(list(self.ids), motion, self._shear())

    def _shear(self) -> dict[tuple[int, int], object]:
        """Tangential force of each contact by its bodies."""
        V = self.engine.Vector3
        return {(i.id1, i.id2): V(i.phys.shearForce) for i in self.contacts()}

    def restore(self, saved: SceneState) -> None:
        """Back to a saved state. Blocks that became clumps since stay clumps (at the saved place).

        A contact that was lost since and comes back starts with a relaxed tangential spring."""
        for i, (pos, ori, vel, spin, momentum), row in zip(saved.ids, saved.motion, range(len(saved.ids))):
            state = self.O.bodies[self.ids[row]].state
            if i == self.ids[row]:
                state.ori = ori
            else:
                turn = _matrix(ori) @ self.plain_frame[row] @ self.frame[row].T
                state.ori = self._q(turn)
            state.pos, state.vel, state.angVel, state.angMom = pos, vel, spin, momentum
        self.look()
        self.integrate()  # over no time: moves the clump members
        self._renew_contacts(saved.shear)

    def tidy(self) -> None:
        """Store the contacts afresh, in the order of the search.

        Contacts made over a long time lie scattered in memory; the loop over them then takes nearly twice as long."""
        if self.collider is not None:
            self._renew_contacts(self._shear())

    def _renew_contacts(self, shear: dict[tuple[int, int], object]) -> None:
        """All contacts that the masks allow at the present places, with the tangential forces `shear`."""
        self.O.interactions.clear()
        self.search_contacts()
        self.look()
        for i in self.contacts():
            i.phys.shearForce = shear.get((i.id1, i.id2), self._v((0.0, 0.0, 0.0)))

    def close(self) -> None:
        """Give the scene back; the structure cannot be used afterwards."""
        if Scene._owner is self:
            self.O.reset()
            Scene._owner = None

    def _v(self, x) -> object:
        return self.engine.Vector3(*(float(c) for c in x))

    def _q(self, R: Array):
        x, y, z, w = Rotation.from_matrix(R).as_quat()
        return self.engine.Quaternion(float(w), float(x), float(y), float(z))


def _matrix(quaternion) -> Array:
    """Rotation matrix (3, 3) of a YADE quaternion."""
    return np.array(quaternion.toRotationMatrix(), float).reshape(3, 3)


def _turn_to(normal: Array) -> Array:
    """A rotation that takes z to `normal`."""
    return Rotation.align_vectors([normal], [[0.0, 0.0, 1.0]])[0].as_matrix()
