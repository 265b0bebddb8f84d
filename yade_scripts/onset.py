"""Where contact sets in: which blocks are loose, and which carry contact nodes.

A block is loose once it has lost a joint, moves on its own, or has left its place. Pairs with a loose block meet by
YADE's contact; their joints leave compression to it. Blocks that are not loose stay plain boxes, without nodes, until
something may touch them: most of a building costs no contact at all before it is hit.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from yade_scripts.blocks import Block
from yade_scripts.faces import FixedPlane
from yade_scripts.joints import Joints
from yade_scripts.motion import Motion
from yade_scripts.scene import Scene

Array = np.ndarray

STANDS = 0.02
"""A joined block stands in its place as long as it has moved less than this share of its radius."""
NONE = np.zeros(0, np.int64)


def loose_at_start(blocks: list[Block], joints: Joints | None) -> Array:
    """(n,) bool: blocks without joints, and blocks that move."""
    loose = np.ones(len(blocks), bool) if joints is None else joints.damaged_blocks(len(blocks))
    return loose | np.array([bool(b.velocity.any() or b.spin.any()) for b in blocks], bool)


def near_loose(loose: Array, joints: Joints | None) -> Array:
    """(n,) bool: loose blocks and their neighbours through joints."""
    near = loose.copy()
    if joints is not None:
        inner = np.flatnonzero(joints.b >= 0)
        a, b = joints.a[inner], joints.b[inner]
        near[b[loose[a]]] = True
        near[a[loose[b]]] = True
    return near


def grounded(n: int, joints: Joints | None) -> Array:
    """(n,) bool: blocks with a live joint to a fixed plane."""
    held = np.zeros(n, bool)
    if joints is not None:
        on_plane = joints.live[joints.b[joints.live] < 0]
        held[joints.a[on_plane]] = True
    return held


class ContactOnset:
    """Keeps masks and nodes of the scene in step with the state of the joints.

    planes: in the scene's coordinates · radius (n,) [m] · loose (n,) bool at the start
    plain: blocks that are not loose have no nodes until something comes near
    """

    def __init__(
        self,
        scene: Scene,
        motion: Motion,
        joints: Joints | None,
        planes: list[FixedPlane],
        radius: Array,
        loose: Array,
        plain: bool,
    ):
        self._scene, self._motion, self._joints = scene, motion, joints
        self._planes, self._radius, self._plain = planes, radius, plain
        self.loose = loose
        self.rest_here()
        self.set_masks(np.arange(len(loose)))

    def rest_here(self) -> None:
        """The present places are those that the blocks stand in."""
        self._x_rest, self._R_rest = self._motion.x.copy(), self._motion.R.copy()

    def set_masks(self, rows: Array) -> None:
        """Masks of the blocks `rows` by their state; contacts that become possible are found at once."""
        held = grounded(len(self.loose), self._joints)
        for r in rows:
            self._scene.set_masks(int(r), bool(self.loose[r]), bool(held[r]))
        if len(rows):
            self._scene.search_contacts()

    def moved(self) -> Array:
        """Rows not loose so far that have left their place: intact pieces of a broken wall meet the ground too."""
        if self.loose.all():
            return NONE
        turned = np.abs(self._motion.R - self._R_rest).max(axis=(1, 2)) * self._radius
        moved = np.linalg.norm(self._motion.x - self._x_rest, axis=1) + turned
        return np.flatnonzero(~self.loose & (moved > STANDS * self._radius))

    def of_failed(self, joints: Array) -> Array:
        """Rows not loose so far that have just lost one of `joints`."""
        ends = np.concatenate([self._joints.a[joints], self._joints.b[joints]])
        ends = np.unique(ends[ends >= 0])
        return ends[~self.loose[ends]]

    def loosen(self, rows: Array) -> None:
        """Contact takes over around the blocks `rows`."""
        if len(rows) == 0:
            return
        self.loose[rows] = True
        self._joints.hand_over(self.loose)
        need = near_loose(self.loose, self._joints) if self._plain else np.zeros(len(self.loose), bool)
        bare = np.flatnonzero(need & ~self._scene.has_nodes())
        for row in bare:
            self._scene.add_nodes(int(row))
        self.set_masks(np.union1d(rows, bare))

    def arm(self, dt: float) -> bool:
        """Give nodes to plain blocks that a loose block or a fixed plane may touch within dt: nodes born inside another
        body would add its penetration to the energy. True if there were any."""
        plain = np.flatnonzero(~self._scene.has_nodes())
        if len(plain) == 0:
            return False
        reach = self._radius + dt * np.linalg.norm(self._motion.v[:, :3], axis=1)
        near = np.union1d(self._near_planes(plain, reach), self._near_debris(plain, reach))
        for row in near:
            self._scene.add_nodes(int(row))
        self.set_masks(near)
        return len(near) > 0

    def _near_debris(self, plain: Array, reach: Array) -> Array:
        loose = np.flatnonzero(self.loose)
        if len(loose) == 0:
            return NONE
        tree = cKDTree(self._motion.x[plain])
        near = tree.query_ball_point(self._motion.x[loose], reach[loose] + reach[plain].max())
        return plain[np.unique(np.concatenate([np.array(i, np.int64) for i in near]))]

    def _near_planes(self, plain: Array, reach: Array) -> Array:
        """Blocks within reach of a fixed plane that no joint holds to one."""
        free = plain[~grounded(len(self.loose), self._joints)[plain]]
        near = np.zeros(len(free), bool)
        for plane in self._planes:
            near |= (self._motion.x[free] - plane.point) @ plane.normal < reach[free]
        return free[near]
