"""The scene in YADE: one body for each block, which YADE moves under given forces.

YADE keeps the bodies, integrates their motion (`NewtonIntegrator`) and looks for neighbours (`InsertionSortCollider`)
when it is called; the laws of contact and joints act through its Python interface: forces go in before each step.
YADE's own contact geometries are not used, because none of them is right for blocks (docs/theory.md).
"""

from __future__ import annotations

import struct
from collections import deque
from itertools import chain, repeat
from operator import attrgetter

import numpy as np
from scipy.spatial.transform import Rotation

from array_types import Array
from yade_scripts.blocks.block import MARGIN, Block
from yade_scripts.yade_side.engine import Engine, YadeError

STANDING, LOOSE = 5, 1
"""Masks: two bodies are neighbours if they share a bit, unless both are fixed (equal masks that hold `APART`)."""
APART = 4
VERLET = 0.1
"""Margin of the search for neighbours as a share of the smallest edge of a block: half of it finds fewer pairs that do
not touch, but has to search twice as often, which takes longer."""
WHITE = (1.0, 1.0, 1.0)
"""Colour of bodies; left to itself, YADE seeds a random generator for each."""
STATE = 13
"""Numbers of a body: position 3, velocity 3, angular velocity 3, orientation 4 (x y z w)."""
_SAVED = [0, 1, 2, 12, 9, 10, 11, 3, 4, 5, 6, 7, 8]
"""Of these, in the order of a saved state: position, orientation (w x y z), velocity, spin."""
_FORCES, _MOMENTS = struct.Struct("3d24x").iter_unpack, struct.Struct("24x3d").iter_unpack
"""Rows [force, moment] as tuples of the one and of the other, sooner than NumPy makes lists of them."""

_FOR_THIS_STEP = repeat(False)
"""That forces are not permanent, which YADE takes sooner than it finds that nothing was said."""

_ENDS = attrgetter("id1", "id2")


class SceneInUse(YadeError):
    """YADE holds only one scene in a process; the structure that uses it must be closed first."""


class Scene:
    """Bodies of `blocks` (local coordinates) in YADE; meets: whether neighbours are looked for.

    ids: body of each row · frame (n, 3, 3): fixed turn from the block frame to YADE's principal frame
    margin [m]: how far a point of a body may go before the neighbours are to be looked for again. (YADE's own measure
    leaves out that bodies turn.)
    """

    _owner: Scene | None = None

    def __init__(self, engine: Engine, blocks: list[Block], meets: bool, gravity: Array):
        if Scene._owner is not None:
            raise SceneInUse("YADE holds another structure in this process; call its close() first")
        Scene._owner = self
        self.engine, self.O, self.blocks = engine, engine.O, blocks
        self.O.reset()
        self.ids: list[int] = []
        self.frame = np.tile(np.eye(3), (len(blocks), 1, 1))
        self.margin = VERLET * min((2.0 * b.planes[1].min() for b in blocks), default=1.0)
        self.driven = np.array([b.driven for b in blocks], bool)
        self._still = np.zeros(len(blocks), bool)
        self._still_states = np.zeros((len(blocks), 16))
        self._bodies: list = []
        """Those of all rows. The bodies of blocks that are held still are taken out of YADE's scene: its loops and its
        search for neighbours pass them by."""
        self._loose = np.zeros(len(blocks), bool)
        self._spins, self._spin_is_read = np.zeros((len(blocks), 3)), np.zeros(len(blocks), bool)
        """Angular momenta, and which of them were read since the bodies moved."""
        self._subdomain = engine.wrapper.Subdomain()
        self._set_engines(gravity, meets)
        for row, block in enumerate(blocks):
            self._add_block(row, block)

    # ---- building -------------------------------------------------------------------------------------------

    def _add_block(self, row: int, block: Block) -> None:
        body = self._shape(block)
        self.ids.append(self.O.bodies.append(body))
        self._bodies.append(body)
        state = body.state
        axes = np.eye(3)
        if not block.is_box:
            axes = np.linalg.eigh(block.inertia)[1]
            axes[:, 2] *= np.sign(np.linalg.det(axes))
        self.frame[row] = axes.T
        principal = np.diag(axes.T @ block.inertia @ axes)
        R = block.rotation @ axes
        state.pos, state.ori = self._v(block.centre), self._q(R)
        state.mass, state.inertia = block.mass, self._v(principal)
        body.aspherical = True
        state.vel, state.angVel = self._v(block.velocity), self._v(block.spin)
        state.angMom = self._v(R @ (principal * (R.T @ block.spin)))
        if block.fixed or block.driven:
            state.blockedDOFs = "xyzXYZ"

    def _shape(self, block: Block):
        """Shape for the neighbour search: the box of the block or a sphere around it, enlarged by the margin of its
        faces."""
        if block.size is not None:
            half = 0.5 * block.size + MARGIN * block.planes[1].min()
            return self.engine.utils.box(self._v(block.centre), self._v(half), mask=STANDING, color=WHITE)
        radius = (1.0 + MARGIN) * block.radius
        return self.engine.utils.sphere(self._v(block.centre), radius, mask=STANDING, color=WHITE)

    def _set_engines(self, gravity: Array, meets: bool) -> None:
        """Integration first: forces are handed over before the step. (YADE warns of forces that were not reset in the
        step of its integration; here that is meant.)"""
        w = self.engine.wrapper
        newton = w.NewtonIntegrator(
            damping=0.0, exactAsphericalRot=True, gravity=self._v(gravity), warnNoForceReset=False
        )
        self.collider = None
        if meets:
            self.collider = w.InsertionSortCollider(
                [w.Bo1_Box_Aabb(), w.Bo1_Sphere_Aabb()],
                verletDist=self.margin,
                targetInterv=-1,  # margins that do not depend on how fast bodies were
                avoidSelfInteractionMask=APART,
            )
        self.O.engines = [newton, w.ForceResetter()]

    # ---- reading and moving ---------------------------------------------------------------------------------

    def read(self, rows_ids: list[int], buffer: bytearray) -> Array:
        """States of body ids into a buffer of 8 * 13 bytes each → (k, 13) view on it.

        The list must persist between calls: YADE leaks a reference per fresh item it is handed.
        """
        struct.pack_into(
            f"{STATE * len(rows_ids)}d", buffer, 0, *self._subdomain.getStateValuesFromIds(rows_ids)
        )
        return np.frombuffer(buffer, float, STATE * len(rows_ids)).reshape(-1, STATE)

    def angular_momentum(self, rows: Array) -> Array:
        """About their own centres, as the integrator keeps it, of the blocks `rows` (k,) → (k, 3) [N m s]."""
        fresh = rows[~self._spin_is_read[rows]]
        if len(fresh):
            self._spins[fresh] = [tuple(self._bodies[r].state.angMom) for r in fresh.tolist()]
            self._spin_is_read[fresh] = True
        return self._spins[rows]

    def step(self, dt: float, ids: list[int], F: Array) -> None:
        """Advance by dt [s] under the forces and moments F (k, 6) on the bodies `ids`.

        YADE's permanent forces are not used: its integrator aborts when bodies are added after one was set."""
        forces = self.O.forces
        F = np.ascontiguousarray(F)
        deque(map(forces.addF, ids, _FORCES(F.data), _FOR_THIS_STEP), maxlen=0)
        deque(map(forces.addT, ids, _MOMENTS(F.data), _FOR_THIS_STEP), maxlen=0)
        self.O.dt = dt
        self._spin_is_read[:] = False
        self.O.step()

    def set_motion(self, row: int, motion: Array) -> None:
        """Velocity and spin (6,) of a block whose motion is prescribed."""
        state = self._bodies[row].state
        state.vel, state.angVel = self._v(motion[:3]), self._v(motion[3:])

    def set_loose(self, loose: Array) -> None:
        """loose (n,) bool: blocks that may meet any other; two that are not do not meet."""
        for row in np.flatnonzero(loose != self._loose).tolist():
            self._bodies[row].mask = LOOSE if loose[row] else STANDING
        self._loose[:] = loose

    def hold(self, rows: Array) -> None:
        """Hold freely moving blocks at their positions from now on; the neighbour search leaves them out."""
        states = self._states(rows.tolist())
        states[:, 7:] = 0.0
        self._write(rows, states)
        for row in rows.tolist():
            self._fix(row, True)
        self._still[rows], self._still_states[rows] = True, states

    def release(self, rows: Array) -> None:
        """Release blocks that were held, at the positions where they were left."""
        self._write(rows, self._still_states[rows])
        for row in rows.tolist():
            self._fix(row, False)
        self._still[rows] = False

    def set_held(self, still: Array) -> None:
        """still (n,) bool: those that are held; `restore` says where."""
        for row in np.flatnonzero(self._still != still).tolist():
            self._fix(row, bool(still[row]))
        self._still[:] = still

    def _fix(self, row: int, still: bool) -> None:
        if still:
            self.O.bodies.erase(self.ids[row])
        else:
            self.O.bodies.insertAtId(self._bodies[row], self.ids[row])

    def neighbours(self) -> Array:
        """Pairs of rows (p, 2) whose bounding boxes at the present places come within the margin of one another, each
        moved by no more than that."""
        assert self.collider is not None  # only blocks that may meet look for neighbours
        self.collider.doSort = True  # masks may have changed, and bodies may have been moved by hand
        self.collider()
        numbers = chain.from_iterable(map(_ENDS, self.O.interactions.all()))
        return np.fromiter(numbers, np.int64).reshape(-1, 2)

    def displace(self, rows: Array, shift: Array, turn: Array) -> None:
        """Move the blocks `rows` by shift (m, 3) and turn (m, 3, 3) about their centres."""
        if len(rows) == 0:
            return
        states = [self._bodies[row].state for row in rows]
        turned = np.array([Q @ _matrix(state.ori) for state, Q in zip(states, turn)])
        for state, move, (x, y, z, w) in zip(states, shift, Rotation.from_matrix(turned).as_quat().tolist()):
            state.pos = self._v(np.array(state.pos) + move)
            state.ori = self.engine.Quaternion(w, x, y, z)

    # ---- saving and going back ------------------------------------------------------------------------------

    def save(self) -> Array:
        """Position 3, orientation 4 (w x y z), velocity 3, spin 3 and angular momentum 3 of each block, (n, 16)."""
        if not self._still.any():
            return self._states(range(len(self.ids)))
        found = self._still_states.copy()
        found[~self._still] = self._states(np.flatnonzero(~self._still).tolist())
        return found

    def _states(self, of) -> Array:
        """The same of the rows `of`, (k, 16)."""
        rows = np.asarray(of, np.int64)
        ids = [self.ids[row] for row in rows]
        read = self.read(ids, bytearray(8 * STATE * len(ids)))
        return np.concatenate([read[:, _SAVED], self.angular_momentum(rows)], axis=1)

    def restore(self, saved: Array) -> None:
        """Return to a saved state, bit for bit."""
        stay = self._still & (self._still_states == saved).all(axis=1)
        rows = np.flatnonzero(~stay)
        self._write(rows, saved[rows])
        self._still_states[rows] = saved[rows]

    def _write(self, rows: Array, saved: Array) -> None:
        """States (k, 16) of the blocks `rows`."""
        V, Q = self.engine.Vector3, self.engine.Quaternion
        self._spin_is_read[rows] = False
        for i, row in zip(rows.tolist(), saved.tolist()):
            state = self._bodies[i].state
            state.pos, state.ori = V(*row[:3]), Q(*row[3:7])
            state.vel, state.angVel, state.angMom = V(*row[7:10]), V(*row[10:13]), V(*row[13:])

    def close(self) -> None:
        """Release the scene; the structure cannot be used afterwards."""
        self._bodies.clear()
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
