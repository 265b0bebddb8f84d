"""Where the structure cuts the water: block geometry → physical domain, cut again only where blocks moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from array_types import Array
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import PhysicalDomain, cut_domain
from fluid.pressure.partly_wet import PartlyWet

if TYPE_CHECKING:
    from fluid.mesh.background import Background
    from yade_scripts.dynamics.structure import Structure


STILL = 1e-3
"""Fraction of a cell edge that a block may move before its cells are cut again."""
STEPS = 4
"""Number of steps, in units of STILL, by which sealed faces are extended as the gap of their joint grows."""
FILM = 1e-4
"""Share of a cell edge by which loose blocks are drawn in, so that water reaches a face that rests on another:
sealed or open must follow from the joints, not from the micrometres of a contact (a sealed face takes the
buoyancy away). Faces that overlap others are drawn in by the overlap as well, in doubling steps."""
MOST_FILM = 0.05
"""Largest inward shift of a face as a fraction of the edge of the cells around the block; in a harder impact the face
is sealed for a moment."""
FACES_IT = 0.5
"""Least n·e of a face of a block that counts as the one which the contact along e is on."""
SPANS = 0.02
"""Share of the edge of the cells around it within which a block that reaches two opposite sides of the tank closes it:
a slice of a long body. A film of micrometres there would be water of no volume, with any velocity. The same holds for
a block that joints hold with a face at an upright side, where it fits the tank from the start: the end of a wall across
a flume. The weight moves it by micrometres, and the water in this slit began with a surface at the face of the wall,
where its pressure was zero: two thirds of the thrust of still water in the first step, 1.3 times in the second."""
FLUSH = 1e-6
"""Share of a cell edge within which a face lies in a side of the tank at the start."""
ALONG = 1e-3
"""Largest 1 - |n·e| of a face that counts as parallel to a side of the tank."""


class Immersion:
    """The solids in the water: n blocks of the structure, then m fixed solids; keeps the domain they leave.

    mesh: Background · structure: Structure or None · solids: list of (vertices (k, 3), faces) fixed in space ·
    cracks: `NarrowCracks` of the structure, or None: broken joints are open · connection: thresholds of the covers.
    """

    def __init__(
        self,
        mesh: Background,
        structure: Structure | None,
        solids: Sequence[tuple[Array, Array]],
        covers: str,
        cracks: Any = None,
        connection: Any = None,
    ) -> None:
        self.mesh, self.covers, self.cracks = mesh, covers, cracks
        self.structure = cast("Structure", structure)  # None without blocks: then nothing asks for theirs
        self.connection = connection
        self.n_blocks = 0 if structure is None else structure.n
        self.n_solids = len(solids)
        self._solid_centre = np.array([v.mean(axis=0) for v, _ in solids]).reshape(-1, 3)
        shapes: list[tuple[Array, Any]] = (
            [] if structure is None else list(zip(self.structure.shape_vertices, structure.shape_faces))
        )
        shapes += [(v - c, f) for (v, f), c in zip(solids, self._solid_centre)]
        self._reference = (
            ConvexBodies.from_polyhedra(shapes, centre=np.zeros((len(shapes), 3)))
            if shapes
            else ConvexBodies.empty()
        )
        self._body_of_plane = np.repeat(np.arange(len(shapes)), np.diff(self._reference.plane_start))
        self._radius = np.array([np.linalg.norm(v, axis=1).max() for v, _ in shapes])
        low, high = mesh.bounds
        self._long = np.flatnonzero(
            2.0 * self._radius[: self.n_blocks] > (high - low)[:2].min() - mesh.local_size.max()
        )
        """Blocks that are long enough to reach from one side of the tank to the opposite one."""
        self._in_side = self._faces_in_sides()
        self._tolerance = STILL * mesh.finest
        self._centre, self._rotation = self._pose()
        self._first_pose = self._centre.copy(), self._rotation.copy()
        none = np.zeros(0, np.int64), np.zeros((0, 3))
        self._flush = none if structure is None else structure.touching_at_start()
        self._sizes = np.full(self.n_blocks, mesh.finest)
        """Those of `cell_sizes`; the least of the mesh before the first cut."""
        unset = np.full(len(self._body_of_plane), -np.inf)
        self._growth = self._new_growth(unset)
        self.bodies = self._placed()
        self.domain = cut_domain(mesh, self.bodies, covers, connection=connection)
        self._sizes = self._sizes_of_cells()
        growth = self._new_growth(unset)
        if (growth != self._growth).any():  # by cells that are larger around a body than elsewhere
            self._growth = growth
            self.bodies = self._placed()
            self.domain = cut_domain(mesh, self.bodies, covers, connection=connection)
        self.cut_again = 0
        """Bodies whose cells the last update cut again."""

    def cell_sizes(self) -> Array:
        """Least size [m] of the cells that each block meets (n,); that of the whole mesh for those that meet none."""
        return self._sizes

    def _sizes_of_cells(self) -> Array:
        """`cell_sizes` of the present domain."""
        memory = self.domain.memory
        size = np.full(len(self.bodies), np.inf)
        np.minimum.at(size, memory.pair_body, self.mesh.local_size[memory.pair_cell])
        return np.where(np.isfinite(size), size, self.mesh.spacing)[: self.n_blocks]

    def update(self) -> bool:
        """Cut the cells again where blocks have moved or come loose since the last cut; True if the domain changed."""
        if self.n_blocks == 0:
            return False
        centre, rotation = self._pose()
        turned = np.abs(rotation - self._rotation).max(axis=(1, 2)) * self._radius
        moved = np.linalg.norm(centre - self._centre, axis=1) + turned > self._tolerance
        growth = self._new_growth(self._growth)
        changed = moved.copy()
        changed[self._body_of_plane[growth != self._growth]] = True
        self.cut_again = int(changed.sum())
        if not self.cut_again:
            return False
        # a block that has just left what it lay on would stand in it still, sealed, where it was cut last
        self._centre[changed], self._rotation[changed] = centre[changed], rotation[changed]
        self._growth = growth
        self.bodies = self._placed()
        self.domain = cut_domain(self.mesh, self.bodies, self.covers, self.domain, connection=self.connection)
        self._sizes = self._sizes_of_cells()
        return True

    def sealed_domain(self) -> PhysicalDomain:
        """The domain without the films by which blocks are drawn in: what touches, or did so before the structure
        settled, has no water between."""
        if (self._growth >= 0.0).all():
            return self.domain
        settled = 2.0 * self._way_since(*self._given_pose()).max(initial=0.0)
        closed = np.where(self._growth < 0.0, self._tolerance + settled, self._growth)
        bodies = self._reference.moved(self._centre, self._rotation).grown(closed)
        return cut_domain(self.mesh, bodies, self.covers, connection=self.connection)

    def films(self) -> tuple[Array, PartlyWet]:
        """Which bodies may move (n + m,) bool, so that films under them transmit the pressure around, and where only a
        share of that pressure acts."""
        held = [block.fixed for block in self.structure.blocks]
        loose = ~np.append(np.array(held, bool), np.ones(self.n_solids, bool))
        block, plane, place, share = self.structure.uplift_shares()
        place = self._centre[block] + np.einsum("kij,kj->ki", self._rotation[block], place)
        return loose, PartlyWet(self._reference.plane_start[block] + plane, place, share)

    def moved_on(self) -> Array:
        """Displacements and rotations (n + m, 6) [m, rad] of the bodies since their cells were last cut."""
        centre, rotation = self._pose()
        turn = rotation @ self._rotation.transpose(0, 2, 1)
        axial = 0.5 * np.stack(
            [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]],
            axis=1,
        )
        return np.concatenate([centre - self._centre, axial], axis=1)

    def save(self) -> dict[str, Array]:
        """The positions of the solids when their cells were last cut, and at the start."""
        centre, rotation = self._first_pose
        return {
            "centre": self._centre.copy(),
            "rotation": self._rotation.copy(),
            "growth": self._growth.copy(),
            "first_centre": centre.copy(),
            "first_rotation": rotation.copy(),
        }

    def restore(self, saved: dict[str, Array]) -> None:
        """Cut the cells again with the bodies at the saved positions, which gives the same domain bit for bit."""
        self._centre, self._rotation = saved["centre"].copy(), saved["rotation"].copy()
        self._growth = saved["growth"].copy()
        self._first_pose = saved["first_centre"].copy(), saved["first_rotation"].copy()
        self.bodies = self._placed()
        self.domain = cut_domain(self.mesh, self.bodies, self.covers, connection=self.connection)
        self._sizes = self._sizes_of_cells()
        self.cut_again = 0

    def _pose(self) -> tuple[Array, Array]:
        """Present centres (n + m, 3) and rotations (n + m, 3, 3) of the blocks and the fixed solids."""
        fixed = np.broadcast_to(np.eye(3), (self.n_solids, 3, 3))
        if self.structure is None:
            return self._solid_centre.copy(), fixed.copy()
        return (
            np.concatenate([self.structure.centre(), self._solid_centre]),
            np.concatenate([self.structure.rotation(), fixed]),
        )

    def _given_pose(self) -> tuple[Array, Array]:
        """Centres (n + m, 3) and rotations (n + m, 3, 3) as the blocks were given, before they settled."""
        blocks, fixed = self._blocks(), np.broadcast_to(np.eye(3), (self.n_solids, 3, 3))
        centre = np.array([b.centre for b in blocks]).reshape(-1, 3)
        rotation = np.array([b.rotation for b in blocks]).reshape(-1, 3, 3)
        return np.concatenate([centre, self._solid_centre]), np.concatenate([rotation, fixed])

    def _new_growth(self, before: Array) -> Array:
        """Outward shift of each plane (P,) [m]: sealed faces reach over the gap to the other block, or are drawn in
        where the joint is so soft that they overlap; loose blocks that touch something are drawn in by a film. The
        shift changes in steps and never decreases while a face stays sealed, so that the planes of a block at rest keep
        their bits and its cells are not cut again."""
        growth = np.zeros(len(self._body_of_plane))
        if self.n_blocks == 0:
            return growth
        block, plane, half_gap = self._closed_faces()
        loose = np.ones(self.n_blocks, bool)
        loose[block] = False
        growth -= self._films(loose)
        rows = self._reference.plane_start[block] + plane
        # Both blocks may stand off by the tolerance from where they are cut. A step comes where the gap has opened by
        # one, not where it opens by anything at all: a whole face grows by it, of which the joint may be a small part,
        # and lifts the water around a block that stands still.
        steps = np.floor(STEPS * np.maximum(2.0 * half_gap, 0.0) / self._tolerance) + 1.0
        # Over the height of an overlap the pressure acts on the block that protrudes. While joints vibrate, that is
        # now one, now the other, which kept a block on soft joints vibrating.
        overlap = np.floor(np.maximum(-half_gap, 0.0) / self._tolerance)
        growth[rows] = -np.inf
        np.maximum.at(growth, rows, (1.0 + steps / STEPS - overlap) * self._tolerance)
        growth[rows] = np.maximum(growth[rows], before[rows])
        closing = self._closing_planes(loose)
        growth[closing] = 2.0 * SPANS * self._sizes[self._body_of_plane[closing]]
        return growth

    def _closed_faces(self) -> tuple[Array, Array, Array]:
        """Faces that joints close, or narrow cracks that count as closed: block (m,), face (m,), half gap (m,) [m]."""
        joined = self.structure.joined_planes()
        if self.cracks is None:
            return joined
        block, face, half = (np.concatenate(two) for two in zip(joined, self.cracks.faces()))
        return block, face, half

    def _films(self, loose: Array) -> Array:
        """Inward shift (P,) [m] of each plane for the contacts of the loose blocks (n,) bool, and for joints that let
        water between their faces."""
        film = np.zeros(len(self._body_of_plane))
        block, direction, depth = self._touching()
        block, direction, depth = (a[loose[block]] for a in (block, direction, depth))
        joined, joined_plane, closing = self.structure.wet_joints()
        if len(block) == 0 and len(joined) == 0:
            return film
        least, start = FILM * self.mesh.finest, self._reference.plane_start
        touching = np.zeros(self.n_blocks + self.n_solids, bool)
        touching[block] = True
        touching[joined[loose[joined]]] = True
        film[touching[self._body_of_plane]] = least
        np.maximum.at(film, start[joined] + joined_plane, self._doubled(closing, joined))
        count = np.diff(start)[block]
        contact = np.repeat(np.arange(len(block)), count)
        plane = np.arange(len(contact)) - np.repeat(np.cumsum(count) - count, count) + start[block][contact]
        local = np.einsum("kij,ki->kj", self.structure.rotation()[block], direction)
        on = np.einsum("ki,ki->k", self._reference.normals[plane], local[contact]) > FACES_IT
        np.maximum.at(film, plane[on], self._doubled(depth, block)[contact[on]])
        return film

    def _doubled(self, depth: Array, block: Array) -> Array:
        """Film (k,) [m] for an overlap of `depth` (k,) [m] of a block (k,), in doubling steps."""
        least = FILM * self.mesh.finest
        doubled = least * 2.0 ** np.ceil(np.log2(1.0 + np.maximum(depth, 0.0) / least))
        return np.minimum(doubled, MOST_FILM * self._sizes[block])

    def _touching(self) -> tuple[Array, Array, Array]:
        """Contacts as `Structure.overlaps`, and faces that touched at the start, at depth 0, of blocks that still stand
        there: their contact may have yet to begin."""
        block, direction, depth = self.structure.overlaps()
        rows, outward = self._flush
        if len(rows) == 0:
            return block, direction, depth
        there = self._way_since(*self._first_pose)[rows] <= self._tolerance
        return (
            np.concatenate([block, rows[there]]),
            np.concatenate([direction, outward[there]]),
            np.concatenate([depth, np.zeros(there.sum())]),
        )

    def _way_since(self, centre: Array, rotation: Array) -> Array:
        """How far (n + m,) [m] points of the bodies have come at most since a pose: centres (n + m, 3) [m] and
        rotations (n + m, 3, 3)."""
        now, turned = self._pose()
        return (
            np.linalg.norm(now - centre, axis=1) + np.abs(turned - rotation).max(axis=(1, 2)) * self._radius
        )

    def _faces_in_sides(self) -> tuple[Array, Array, Array]:
        """Faces of blocks that lie in an upright side of the tank at the start: row of the plane (k,), axis across the
        side (k,), and 0 for its lower, 1 for its upper end (k,)."""
        reference, centre = self._reference, np.array([b.centre for b in self._blocks()]).reshape(-1, 3)
        own = np.flatnonzero(self._body_of_plane < self.n_blocks)
        turned = np.array([b.rotation for b in self._blocks()]).reshape(-1, 3, 3)[self._body_of_plane[own]]
        normals = np.einsum("pij,pj->pi", turned, reference.normals[own])
        found = []
        for axis in range(2):
            along = np.abs(normals[:, axis]) > 1.0 - FLUSH
            sign = np.sign(normals[:, axis])
            at = centre[self._body_of_plane[own], axis] + sign * reference.offsets[own]
            for end in range(2):
                flush = np.abs(at - self.mesh.bounds[end, axis]) < FLUSH * self.mesh.finest
                rows = own[along & flush & (sign == 2 * end - 1)]
                found += [(row, axis, end) for row in rows]
        rows, axes, ends = np.array(found, np.int64).reshape(-1, 3).T
        return rows, axes, ends

    def _blocks(self) -> list:
        return [] if self.structure is None else self.structure.blocks

    def _closing_planes(self, loose: Array) -> Array:
        """(P,) bool: faces along the tank sides of blocks that reach from one upright side to the opposite one, and of
        those not loose (n,) bool that are still in the side in which they lay at the start."""
        closing = np.zeros(len(self._body_of_plane), bool)
        rows, axes, ends = self._in_side
        if len(self._long) == 0 and len(rows) == 0:
            return closing
        low, high = self.mesh.bounds
        margin = SPANS * self._sizes
        centre, rotation = self.structure.centre(), self.structure.rotation()
        normals = np.einsum("pij,pj->pi", self._turns(rotation), self._reference.normals)
        body, sign = self._body_of_plane[rows], 2 * ends - 1
        at = centre[body, axes] + sign * self._reference.offsets[rows]
        there = np.abs(at - self.mesh.bounds[ends, axes]) < margin[body]
        there &= sign * normals[rows, axes] > 1.0 - ALONG
        closing[rows] = there & ~loose[body]
        for b in self._long:
            corners = centre[b] + self.structure.shape_vertices[b] @ rotation[b].T
            spans = (corners.min(axis=0) < low + margin[b]) & (corners.max(axis=0) > high - margin[b])
            spans[2] = False  # water gets under a block as high as the tank
            if spans.any():
                own = self._body_of_plane == b
                closing[own] = (np.abs(normals[own][:, spans]) > 1.0 - ALONG).any(axis=1)
        return closing

    def _turns(self, rotation: Array) -> Array:
        """Rotation of the body of each plane (P, 3, 3)."""
        fixed = np.broadcast_to(np.eye(3), (self.n_solids, 3, 3))
        return np.concatenate([rotation, fixed])[self._body_of_plane]

    def _placed(self) -> ConvexBodies:
        return self._reference.moved(self._centre, self._rotation).grown(self._growth)
