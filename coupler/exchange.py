"""Where the structure cuts the water: block geometry → physical domain, cut again only where blocks moved."""

from __future__ import annotations

import numpy as np

from fluid.bodies import ConvexBodies
from fluid.domain import cut_domain

Array = np.ndarray

STILL = 1e-3
"""Share of a cell edge that a block may move before its cells are cut again."""
FILM = 1e-4
"""Share of a cell edge by which loose blocks are drawn in, so that water reaches a face that rests on another:
sealed or open must follow from the joints, not from the micrometres of a contact (a sealed face takes the
buoyancy away)."""


class Immersion:
    """The solids in the water: n blocks of the structure, then m fixed solids; keeps the domain they leave.

    mesh: Background · structure: Structure or None · solids: list of (vertices (k, 3), faces) fixed in space.
    """

    def __init__(self, mesh, structure, solids, covers: str):
        self.mesh, self.structure, self.covers = mesh, structure, covers
        self.n_blocks = 0 if structure is None else structure.n
        self.n_solids = len(solids)
        self._solid_centre = np.array([v.mean(axis=0) for v, _ in solids]).reshape(-1, 3)
        shapes = [] if structure is None else list(zip(structure.shape_vertices, structure.shape_faces))
        shapes += [(v - c, f) for (v, f), c in zip(solids, self._solid_centre)]
        self._reference = (
            ConvexBodies.from_polyhedra(shapes, centre=np.zeros((len(shapes), 3)))
            if shapes
            else ConvexBodies.empty()
        )
        self._radius = np.array([np.linalg.norm(v, axis=1).max() for v, _ in shapes])
        self._tolerance = STILL * mesh.spacing
        self._centre, self._rotation = self._pose()
        self._loose = self._loose_blocks()
        self.bodies = self._placed()
        self.domain = cut_domain(mesh, self.bodies, covers)
        self.cut_again = 0
        """Bodies whose cells the last update cut again."""

    def update(self) -> bool:
        """Cut again where blocks moved or came loose since they were last cut; True if the domain changed."""
        if self.n_blocks == 0:
            return False
        centre, rotation = self._pose()
        turned = np.abs(rotation - self._rotation).max(axis=(1, 2)) * self._radius
        loose = self._loose_blocks()
        moved = np.linalg.norm(centre - self._centre, axis=1) + turned > self._tolerance
        moved[: self.n_blocks] |= loose != self._loose
        self.cut_again = int(moved.sum())
        if not self.cut_again:
            return False
        self._centre[moved], self._rotation[moved] = centre[moved], rotation[moved]
        self._loose = loose
        self.bodies = self._placed()
        self.domain = cut_domain(self.mesh, self.bodies, self.covers, previous=self.domain, moved=moved)
        return True

    def _pose(self) -> tuple[Array, Array]:
        """Centre (n + m, 3) and rotation (n + m, 3, 3) of blocks and fixed solids now."""
        fixed = np.broadcast_to(np.eye(3), (self.n_solids, 3, 3))
        if self.structure is None:
            return self._solid_centre.copy(), fixed.copy()
        return (
            np.concatenate([self.structure.centre(), self._solid_centre]),
            np.concatenate([self.structure.rotation(), fixed]),
        )

    def _loose_blocks(self) -> Array:
        """(n,) bool: blocks without a live joint."""
        if self.n_blocks == 0:
            return np.zeros(0, bool)
        loose = np.ones(self.n_blocks, bool)
        loose[self.structure.joined_planes()[0]] = False
        return loose & ~self.structure.fixed

    def _placed(self) -> ConvexBodies:
        bodies = self._reference.moved(self._centre, self._rotation)
        if self.n_blocks == 0:
            return bodies
        growth = np.zeros(len(bodies.offsets))
        plane_body = np.repeat(np.arange(self.n_blocks + self.n_solids), np.diff(bodies.plane_start))
        is_loose = np.append(self._loose, np.zeros(self.n_solids, bool))
        growth[is_loose[plane_body]] = -FILM * self.mesh.spacing
        block, plane, half_gap = self.structure.joined_planes()
        closing = 2.0 * np.maximum(half_gap, 0.0) + self._tolerance  # the other side may be a step behind
        np.maximum.at(growth, bodies.plane_start[block] + plane, closing)
        return bodies.grown(growth)
