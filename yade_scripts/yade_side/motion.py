"""Positions and velocities of the blocks as arrays, read from YADE's bodies.

Leapfrog: positions x, R belong to the present time t, velocities v to half a substep earlier.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from array_types import Array
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.blocks.kinematics import scatter
from yade_scripts.yade_side.scene import STATE, Scene


class Motion:
    """x (n, 3) [m] centres in the scene's coordinates · R (n, 3, 3) body frame → world · v (n, 6) [v, ω]

    all_x, all_v, all_R: the same with a row for each fixed plane behind · dt [s]: length of the substep that led here.
    The lists of bodies persist between readings, because YADE leaks a reference for each fresh item that it is handed.
    """

    def __init__(self, scene: Scene, planes: list[FixedPlane]):
        self._scene = scene
        n, size = len(scene.ids), len(scene.ids) + len(planes)
        self.all_x, self.all_v = np.zeros((size, 3)), np.zeros((size, 6))
        self.all_R = np.tile(np.eye(3), (size, 1, 1))
        self.x, self.v, self.R = self.all_x[:n], self.all_v[:n], self.all_R[:n]
        self.all_x[n:] = np.array([p.point for p in planes]).reshape(-1, 3)
        self.dt = 0.0
        self._all = _Rows(np.arange(n), scene.ids)
        self._watched = _Rows(np.zeros(0, np.int64), scene.ids)
        self._awake: Array | None = None

    def rest(self, asleep: Array) -> None:
        """Keep the sleeping blocks (n,) bool from now on where they were read last."""
        awake = np.flatnonzero(~asleep)
        self._awake = None if len(awake) == len(asleep) else awake
        self._all = _Rows(awake, self._scene.ids)

    def put(self, rows: Array, states: Array) -> None:
        """Set the blocks `rows` to the states (n, 16) of `Scene.save`, whether or not the scene holds them still."""
        order = [*range(3), *range(7, 13), *range(4, 7), 3]
        scatter(states[np.ix_(rows, order)], rows, self._scene.frame, self.x, self.v, self.R)

    def watch(self, rows: Array) -> None:
        """Set the rows that `read_watched` reads."""
        self._watched = _Rows(rows, self._scene.ids)

    def read(self) -> None:
        """Read the states of all blocks."""
        self._take(self._all)

    def read_watched(self) -> None:
        """Read the states of the watched rows; the others keep their last values."""
        self._take(self._watched)

    def _take(self, which: _Rows) -> None:
        if len(which.rows):
            states = self._scene.read(which.ids, which.buffer)
            scatter(states, which.rows, self._scene.frame, self.x, self.v, self.R)

    def before(self) -> tuple[Array, Array]:
        """Places (x, R) one substep ago."""
        x = self.x - self.dt * self.v[:, :3]
        if self._awake is None:
            return x, Rotation.from_rotvec(-self.dt * self.v[:, 3:]).as_matrix() @ self.R
        R = self.R.copy()
        R[self._awake] = Rotation.from_rotvec(-self.dt * self.v[self._awake, 3:]).as_matrix() @ R[self._awake]
        return x, R

    def half_step_back(self) -> Array:
        """Centres (n, 3) at the time of the velocities."""
        return self.x - 0.5 * self.dt * self.v[:, :3]

    def turned_since(self, R: Array) -> Array:
        """Rotation vectors (n, 3) from earlier orientations R (n, 3, 3) to the present ones."""
        if len(R) == 0:
            return np.zeros((0, 3))
        return Rotation.from_matrix(self.R @ R.transpose(0, 2, 1)).as_rotvec()


class _Rows:
    """Rows with their bodies in YADE and a buffer for their states."""

    def __init__(self, rows: Array, ids: list[int]):
        self.rows = rows
        self.ids = [ids[r] for r in rows]
        self.buffer = bytearray(8 * STATE * len(rows))
