"""The physical domain: the parts of the background tetrahedra that lie outside the solids.

Every element keeps its P1 functions; only the region of integration shrinks to the fluid part, known by its
exact moments V = ∫ dV, c = ∫ x dV / V, S = ∫ (x - c)(x - c)^T dV, and by its wetted surface, polygons with
owner, normal n (out of the body into the water) and a three-point rule. For linear fields that is all that
integration over the part needs.

With `covers = "single"` nodes and cells are those of the background (cells without fluid left out); with
"multiple" they are the virtual mesh of `covers.py`.

A step that moves few bodies cuts again only the cells near their old or new positions.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from array_types import Array, Bools, Floats, Integers, Ints
from fluid.cut.bodies import ConvexBodies
from fluid.cut.candidate_pairs import near_pairs
from fluid.cut.cut_arrays import Cuts
from fluid.cut.cut_cells import cut_cells
from fluid.cut.facing import facing, near_bodies
from fluid.cut.fans import fans
from fluid.cut.openings import Contacts, find_contacts
from fluid.cut.recut import joined
from fluid.domain.continued_nodes import pick_old_nodes
from fluid.domain.coupling_matrix import wetted_coupling
from fluid.domain.covers import Connection, lies_on, virtual_cells, without_pockets
from fluid.domain.open_columns import OpenColumns
from fluid.mesh.arrays import Hats, WettedPolygons
from fluid.mesh.background import Background
from kernels.decorators import kernel

__all__ = ["PhysicalDomain", "carry", "cut_domain", "wetted_coupling"]

# Tolerances of the mesh within which bodies and cells are near.
SEARCH_MARGIN = 10.0
# Entries of the second moments in the order of the kernel.
XX = np.array([0, 1, 2, 0, 0, 1])
YY = np.array([0, 1, 2, 1, 2, 2])


@dataclass(frozen=True, kw_only=True)
class Memory:
    """Data that the next cut reuses from this one: mesh, bodies, pairs sorted by (cell, body), cut parts; contacts
    of the parts with multiple covers, else None."""

    mesh: Background
    bodies: ConvexBodies
    pair_cell: Ints
    pair_body: Ints
    cuts: Cuts
    connection: Connection
    contacts: Contacts | None


class Elements(NamedTuple):
    """Fluid elements in the order of the background cells: parent (M,) background cell · part (M,) row of the cut
    part, -1 whole or nothing removed · start (cells + 1,) first element of each cell · of_part (K,) element of each cut
    part."""

    parent: Integers
    part: Integers
    start: Ints
    of_part: Ints


@dataclass(frozen=True)
class PhysicalDomain:
    """The part of the background tetrahedra outside the solids: N nodes, M cells, S wetted polygons.

    nodes (N, 3) [m] · cells (M, 4) · parent_node (N,), parent_cell (M,) in the background
    volume (M,) [m3] of the fluid part
    part (M,) row of what is left of the cell among the parts of `memory.cuts`, -1 where nothing was removed
    fan_start (M + 1,), fan_volume (T,) [m3], fan_corners (T, 4, 4): tetrahedra that fill the cut cells (`fans.py`)
    face_cell (S,) row of `cells` · face_body (S,) · face_area (S,) [m2] · face_centroid (S, 3) [m]
    face_normal (S, 3) out of the body · face_points (S, 3, 3) [m] three points, weight area / 3, degree 2
    face_corners (S, 3, 3) [m] (the polygons are triangles)
    several (N,) bool: there is, or was before small pockets were dropped, another copy of the same background node
    n_bodies · body_centre (n_bodies, 3) [m] · covers "single" or "multiple".
    """

    nodes: Floats
    cells: Integers
    parent_node: Ints
    parent_cell: Integers
    volume: Floats
    part: Integers
    fan_start: Integers
    fan_volume: Floats
    fan_corners: Floats
    face_cell: Ints
    face_body: Ints
    face_area: Floats
    face_centroid: Floats
    face_normal: Floats
    face_points: Floats
    face_corners: Floats
    several: Bools
    n_bodies: int
    body_centre: Floats
    covers: str
    memory: Memory = field(repr=False, compare=False)

    def polygons(self, rows=slice(None)) -> WettedPolygons:
        """The listed wetted polygons, as kernels take them."""
        return WettedPolygons(
            self.face_cell[rows],
            self.face_body[rows],
            self.face_area[rows],
            self.face_normal[rows],
            self.face_points[rows],
        )

    @cached_property
    def hats(self) -> Hats:
        """The linear functions of the cells with wetted polygons, as kernels take them; other cells have no row."""
        row = np.zeros(len(self.cells), np.int32)
        row[self.face_cell] = 1
        wetted = np.flatnonzero(row)
        row[wetted] = np.arange(len(wetted))
        return Hats(self.cells, row, self.memory.mesh.gradients_of(self.parent_cell[wetted]))

    @cached_property
    def open_columns(self) -> OpenColumns:
        """What the solids leave of the columns of bins."""
        return OpenColumns.of(self)

    @cached_property
    def is_cut(self) -> Array:
        """(M,) bool: something was removed from the cell."""
        return self.part >= 0

    def second_of(self, rows) -> Array:
        """Second moments (n, 6) [m5] (xx, yy, zz, xy, xz, yz) of the fluid part of cells (n,). They are not stored,
        since they would take a fifth of the memory of a cell and are needed only at cut cells."""
        found, part = _whole_second(self.memory.mesh, self.parent_cell[rows]), self.part[rows]
        cut = part >= 0
        found[cut] = self.memory.cuts.moments[part[cut], 4:10]
        return found

    @property
    def centroid(self) -> Array:
        """(M, 3) [m] of the fluid part of each cell, computed at each call."""
        return self.centroid_of(np.arange(len(self.cells)))

    def centroid_of(self, rows) -> Array:
        """Centroids (n, 3) [m] of the fluid part of cells (n,), not stored either."""
        mesh = self.memory.mesh
        moments = self.memory.cuts.moments
        return _centroids(np.asarray(rows), self.parent_cell, self.part, mesh.cells, mesh.nodes, moments)


def cut_domain(
    mesh: Background,
    bodies: ConvexBodies,
    covers: str = "single",
    previous: PhysicalDomain | None = None,
    moved=None,
    connection: Connection | None = None,
) -> PhysicalDomain:
    """Cut the background mesh by the bodies.

    previous: a domain of the same mesh and bodies. Only cells near bodies whose planes changed since (old or
    new position, growth too) are cut again, which gives the same domain bit for bit as a full cut.
    moved (n_bodies,) bool: bodies to cut again in any case (optional).
    connection: thresholds of the multiple covers (default: connect over any area).

    Raises ValueError for other covers, and for a previous domain of another mesh, other bodies or other thresholds."""
    if covers not in ("single", "multiple"):
        raise ValueError(f"covers = {covers!r} is unknown; choose 'single' or 'multiple'")
    connection = connection or Connection()
    memory = _remembered(mesh, bodies, covers, previous, connection)
    if memory is None:
        memory, again = _cut_all(mesh, bodies, covers, connection), None
    else:
        changed = changed_bodies(memory.bodies, bodies)
        memory, again = _cut_moved(memory, bodies, changed if moved is None else changed | moved, covers)
    elements = _elements(memory)
    if covers == "multiple":
        contacts = find_contacts(
            mesh, elements.part, elements.start, memory.cuts, connection.enough, memory.contacts, again
        )
        memory = replace(memory, contacts=contacts)
    return _assembled(memory, elements, covers)


def changed_bodies(old: ConvexBodies, new: ConvexBodies) -> Array:
    """(n,) bool: some plane of the body differs, in direction, position or growth."""
    if len(new) == 0:
        return np.zeros(0, dtype=bool)
    planes = (old.normals != new.normals).any(axis=1) | (old.cut_offsets() != new.cut_offsets())
    return np.logical_or.reduceat(planes, new.plane_start[:-1])


@kernel
def _centroids(rows, parent, part, cells, nodes, moments):
    """Centroids (n, 3) [m] of the listed elements (n,)."""
    found = np.empty((len(rows), 3))
    for k in range(len(rows)):
        cell, cut = parent[rows[k]], part[rows[k]]
        for c in range(3):
            if cut >= 0:
                found[k, c] = moments[cut, 1 + c]
            else:
                total = nodes[cells[cell, 0], c] + nodes[cells[cell, 1], c] + nodes[cells[cell, 2], c]
                found[k, c] = (total + nodes[cells[cell, 3], c]) / 4.0
    return found


def _whole_second(mesh, cells):
    """Second moments (n, 6) [m5] of full tetrahedra: S = V/20 sum_a (x_a - c)(x_a - c)^T."""
    x = mesh.nodes[mesh.cells[cells]]
    d = x - ((x[:, 0] + x[:, 1] + x[:, 2] + x[:, 3]) / 4)[:, None]
    return (d[:, :, XX] * d[:, :, YY]).sum(axis=1) * (mesh.cell_volume[cells] / 20)[:, None]


def carry(old: PhysicalDomain, new: PhysicalDomain) -> Array:
    """(N_new,) index of the old node each new node takes its values from, -1 = no source.

    Single covers keep their nodes. Multiple covers: the copy of the same background node that shares the
    most fluid volume, sum over parts of min(V_old, V_new)."""
    if old.covers == "single" and new.covers == "single":
        return np.arange(len(new.nodes))
    return pick_old_nodes(old, new)


def _remembered(mesh, bodies, covers, previous, connection):
    if previous is None:
        return None
    memory = previous.memory
    if memory.mesh is not mesh or memory.connection != connection or previous.covers != covers:
        raise ValueError(
            "cut_domain: `previous` belongs to another mesh, other covers or other thresholds; "
            "pass previous=None to start afresh"
        )
    if not np.array_equal(memory.bodies.plane_start, bodies.plane_start):
        raise ValueError(
            f"cut_domain: `previous` holds {len(memory.bodies)} bodies of other shapes than the {len(bodies)} now; "
            "pass previous=None when bodies come, go or change their faces"
        )
    return memory


def _cut_all(mesh, bodies, covers, connection):
    every = np.arange(len(bodies))
    cell, body = near_pairs(mesh, bodies, every, SEARCH_MARGIN * mesh.tolerance)
    cuts = _cut_pairs(mesh, bodies, cell, body, covers, connection)
    return Memory(
        mesh=mesh,
        bodies=bodies,
        pair_cell=cell,
        pair_body=body,
        cuts=cuts,
        connection=connection,
        contacts=None,
    )


def _cut_moved(memory, bodies, moved, covers):
    """Replace the pairs of moved bodies and cut the cells of the pairs that were removed or added → Memory with the
    earlier contacts, and these cells (cells,) bool."""
    mesh = memory.mesh
    if memory.connection.spares > 0.0:
        moved = _with_neighbours(memory.bodies, moved, memory) | _with_neighbours(bodies, moved, memory)
    gone = moved[memory.pair_body]
    new_cell, new_body = near_pairs(mesh, bodies, np.flatnonzero(moved), SEARCH_MARGIN * mesh.tolerance)
    touched = np.zeros(len(mesh.cells), dtype=bool)
    touched[memory.pair_cell[gone]] = True
    touched[new_cell] = True
    cell = np.concatenate([memory.pair_cell[~gone], new_cell])
    body = np.concatenate([memory.pair_body[~gone], new_body])
    order = np.argsort(cell * len(bodies) + body)  # no two are alike
    cell, body = cell[order], body[order]
    again = touched[cell]
    fresh = _cut_pairs(mesh, bodies, cell[again], body[again], covers, memory.connection)
    cuts = joined(memory.cuts, touched, fresh)
    return replace(memory, bodies=bodies, pair_cell=cell, pair_body=body, cuts=cuts), touched


def _cut_pairs(mesh, bodies, cell, body, covers, connection):
    chosen, first = np.unique(cell, return_index=True)
    start = np.append(first, len(cell)).astype(np.int64)
    link_area = -1.0 if covers == "single" else connection.link_area(mesh.local_size[chosen])

    def cut(chosen, start, body, link_area):
        return cut_cells(
            mesh.nodes, mesh.cells, chosen, start, body, bodies, mesh.tolerance, mesh.spacing, link_area
        )

    cuts = cut(chosen, start, body, link_area)
    if covers == "single" or connection.spares == 0.0:
        return cuts
    beside = np.zeros(len(mesh.cells), bool)
    beside[cuts.part_cell[_parts_in_slits(mesh, bodies, cuts, connection)]] = True
    again, rows = beside[chosen], beside[cell]
    first = np.concatenate([[0], np.cumsum(np.diff(start)[again])]).astype(np.int64)
    link_area = connection.link_area_in_slits(mesh.local_size[chosen[again]])
    return joined(cuts, beside, cut(chosen[again], first, body[rows], link_area))


def _parts_in_slits(mesh, bodies, cuts, connection):
    """(K,) bool: cut parts with a wetted polygon that has another surface opposite to it (`Connection.spares`)."""
    found = np.zeros(len(cuts.part_cell), bool)
    if connection.spares > 0.0:
        reach = connection.spares * mesh.local_size[cuts.part_cell[cuts.wet_part]]
        polygons = (cuts.wet_body, cuts.wet[:, 1:4], cuts.wet[:, 4:7])
        in_slit, _ = facing(bodies, polygons, reach, mesh.bounds, np.ones(len(bodies), bool))
        found[cuts.wet_part[in_slit]] = True
    return found


def _normal_beside(cuts, connection):
    """(K, 3): of `lies_on` where a threshold of the covers asks for it, else zero."""
    if connection.face == 0.0:
        return np.zeros((len(cuts.part_cell), 3))
    return lies_on(cuts.wet_part, cuts.wet[:, 4:7], cuts.wet[:, 0], len(cuts.part_cell))


def _with_neighbours(bodies, moved, memory):
    """(n,) bool: moved bodies, and those within reach of a slit to them."""
    box, reach = bodies.bounds(), memory.connection.spares * float(memory.mesh.local_size.max())
    start, near = near_bodies(box[:, 0], box[:, 1], np.ones(len(bodies), bool), reach)
    beside = np.concatenate([[0], np.cumsum(moved[near])])
    return moved | (beside[start[1:]] > beside[start[:-1]])


def _assembled(memory: Memory, elements: Elements, covers: str) -> PhysicalDomain:
    mesh, cuts = memory.mesh, memory.cuts
    if covers == "single":
        every = len(elements.parent) == len(mesh.cells)  # one element each, as parts of a cell are not parted
        cells, parent_node = mesh.cells if every else mesh.cells[elements.parent], np.arange(len(mesh.nodes))
    else:
        cells, parent_node = virtual_cells(
            mesh,
            elements,
            memory.contacts,
            memory.connection,
            _parts_in_slits(mesh, memory.bodies, cuts, memory.connection),
            _normal_beside(cuts, memory.connection),
        )
    volume = _volume(memory, elements)
    of_part = elements.of_part
    face_cell, wet, wet_body = of_part[cuts.wet_part], cuts.wet, cuts.wet_body
    parent, part = elements.parent, elements.part
    keep, several = np.ones(len(parent), bool), np.zeros(len(parent_node), bool)
    if covers == "multiple":
        several = np.bincount(parent_node)[parent_node] > 1
        keep = without_pockets(cells, volume, len(parent_node), _least_pocket(memory, elements))
    if not keep.all():
        used, renumbered, cells = _compressed(cells, keep, len(parent_node))
        parent_node, several = parent_node[used], several[used]
        left = keep[face_cell]
        face_cell, wet, wet_body = renumbered[face_cell[left]], wet[left], wet_body[left]
        of_part = np.where(keep[of_part], renumbered[of_part], -1)
        parent, part, volume = parent[keep], part[keep], volume[keep]
    fan_start, fan_volume, fan_corners = fans(cuts, of_part, len(parent))
    return PhysicalDomain(
        nodes=mesh.nodes if covers == "single" else mesh.nodes[parent_node],
        cells=cells,
        parent_node=parent_node,
        parent_cell=parent,
        volume=volume,
        part=part,
        fan_start=fan_start,
        fan_volume=fan_volume,
        fan_corners=fan_corners,
        face_cell=face_cell,
        face_body=wet_body,
        face_area=wet[:, 0],
        face_centroid=wet[:, 1:4],
        face_normal=wet[:, 4:7],
        face_points=wet[:, 7:16].reshape(-1, 3, 3),
        face_corners=wet[:, 16:].reshape(-1, 3, 3),
        several=several,
        n_bodies=len(memory.bodies),
        body_centre=memory.bodies.centre,
        covers=covers,
        memory=memory,
    )


def _least_pocket(memory, elements):
    """Volume [m³] below which a component of the water is dropped: of each element (M,), or one where all cells have
    the same size."""
    size = memory.mesh.local_size
    if size.strides == (0,):
        return memory.connection.pocket * size[:1] ** 3
    return memory.connection.pocket * size[elements.parent] ** 3


def _volume(memory, elements):
    """Fluid volume (M,) [m3] of the elements: of the whole cell, or of the part."""
    volume = memory.mesh.cell_volume[elements.parent]
    cut = elements.part >= 0
    volume[cut] = memory.cuts.moments[elements.part[cut], 0]
    return volume


@kernel
def _compressed(cells, keep, n_nodes):
    """Nodes (N,) bool of the elements to keep (M,) bool, the new number of each element, and its nodes renumbered."""
    used = np.zeros(n_nodes, np.bool_)
    renumbered = np.empty(len(cells), np.int64)
    n = 0
    for e in range(len(cells)):
        renumbered[e] = n
        if keep[e]:
            n += 1
            for k in range(4):
                used[cells[e, k]] = True
    number = np.cumsum(used) - 1
    left = np.empty((n, 4), np.uint32)
    for e in range(len(cells)):
        if keep[e]:
            for k in range(4):
                left[renumbered[e], k] = number[cells[e, k]]
    return used, renumbered, left


def _elements(memory) -> Elements:
    cuts = memory.cuts
    met = np.zeros(len(memory.mesh.cells), bool)
    met[memory.pair_cell] = True
    return Elements(*_listed(met, cuts.part_cell, cuts.part_whole))


@kernel
def _listed(met, part_cell, part_whole):
    """The Elements: every cell that no body meets, and every part of the others."""
    most = len(met) + len(part_cell)
    parent, part, n = np.empty(most, np.uint32), np.full(most, -1, np.int32), 0
    start, of_part, k = np.empty(len(met) + 1, np.int64), np.empty(len(part_cell), np.int64), 0
    for cell in range(len(met)):
        start[cell] = n
        if not met[cell]:
            parent[n] = cell
            n += 1
        while k < len(part_cell) and part_cell[k] == cell:
            parent[n], of_part[k] = cell, n
            if not part_whole[k]:
                part[n] = k
            n += 1
            k += 1
    start[-1] = n
    return parent[:n].copy(), part[:n].copy(), start, of_part
