"""Narrow cracks between blocks: which broken joints are still closed for the water, and the flow through them.

An open crack in a wall thinner than about two cells acts on the water as an opening one cell wide, however narrow it
is. So, unless the case asks for open cracks, a broken joint stays closed in the geometry of the water while its faces
are nearly where they were: opened by less than a quarter of a cell, in a wall thinner than two. What flows through it
is left out (`closed`) or lumped (`slit`, see fluid/pressure/slits.py). Wider ones open, and are cut.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from fluid.pressure.slits import Cracks

if TYPE_CHECKING:
    from yade_scripts.dynamics.structure import Structure


WIDEST = 0.25
"""Largest opening in cells of a crack that is closed: below it a closed one is nearer to the truth than an open one."""
THINNEST = 2.0
"""Depth, in cells, from which a crack is open, because the mesh resolves the channel."""
NO_OPENING = 1e-6
"""Openings in cells below which nothing flows."""


class NarrowCracks:
    """The broken joints of a structure that are closed for the water.

    structure: blocks with joints · lumped: water flows through them ·
    spacing [m]: size of the cells at each joint, or one for all."""

    def __init__(self, structure: Structure, spacing: Array | float, lumped: bool) -> None:
        self.structure, self.lumped = structure, lumped
        corners, start = structure.joint_polygons()
        self.spacing = np.broadcast_to(np.asarray(spacing, float), len(start) - 1)
        self._width = np.array([least_width(corners[first:last]) for first, last in pairwise(start)])

    def faces(self) -> tuple[Array, Array, Array]:
        """Faces to be closed: block (m,), face (m,), half of the largest opening (m,) [m]."""
        _, block, face, opening = self._narrow()
        half = 0.5 * np.repeat(opening[:, 2], 2)
        there = block.ravel() >= 0
        return block.ravel()[there], face.ravel()[there], half[there]

    def cracks(self) -> Cracks:
        """The cracks as the water needs them, for the flow through them."""
        joint, block, _, opening = self._narrow()
        flows = opening[:, 0] > NO_OPENING * self.spacing[joint]
        joint, block, opening = joint[flows], block[flows], opening[flows]
        corners, start = self.structure.joint_polygons()
        length = np.diff(start)[joint]
        first = np.concatenate([[0], np.cumsum(length)]).astype(np.int64)
        rows = np.repeat(start[joint] - first[:-1], length) + np.arange(first[-1])
        return Cracks(corners[rows], first, opening[:, 0], block, joint)

    def _narrow(self) -> tuple[Array, Array, Array, Array]:
        """Joint (m,), blocks (m, 2), faces (m, 2), openings (m, 3) [m]: mean, sliding, largest."""
        joint, block, face, opening = self.structure.broken_joints()
        depth = self._width[joint]
        spacing = self.spacing[joint]
        near = (opening[:, 2] < WIDEST * spacing) & (opening[:, 1] < WIDEST * depth)
        near &= depth < THINNEST * spacing
        return joint[near], block[near], face[near], opening[near]


def least_width(corners: Array) -> float:
    """Smallest width [m] of a convex polygon (k, 3) across one of its edges."""
    ahead = np.roll(corners, -1, axis=0) - corners
    normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
    inward = np.cross(normal, ahead)
    inward /= np.linalg.norm(inward, axis=1)[:, None]
    return float(min((((corners - c) @ n).max()) for c, n in zip(corners, inward)))
