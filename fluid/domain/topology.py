"""Connectivity of the physical domain, laid out for the kernels of the step.

The gradients of a cell are those of its cell in the background mesh (a cover is a copy with the same
corners), so that no geometry is recomputed when solids move.  Every loop over cells reads them: cells of one
shape share a row (`shapes.py`), which stays in the cache of the processor.  Numbers of
nodes and cells are unsigned: a loop that gathers by them need not test for negative indices, which count from the end
in Python, and takes half the time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from array_types import Array, Bools, Floats, Integers, Ints
from fluid.domain.coupling_matrix import polygons_of_nodes
from fluid.domain.layers import WORK, layers_around
from fluid.domain.moments import FluidParts
from fluid.mesh.arrays import Edges, FluidCells, Hats, Paths
from fluid.mesh.background import Background
from fluid.mesh.gradients import gradient_rows
from fluid.numerics.fields import marks_of
from fluid.numerics.spans import spans
from kernels.decorators import inner, kernel, ranged, released
from kernels.threads import over, taken

NO_WATER = 1e-9
"""Share of what a node can hold up to which its water counts as none: what sums of what comes and goes leave over."""


@dataclass(frozen=True)
class Topology:
    """nodes (N, 3) [m] · cells (M, 4) · background (M,) cell of the background mesh, of n_background ·
    parent (M,) row of `gradients` (.., 4, 3) [1/m] and of their `products` ·
    volume (M,) [m³] of the fluid part · fraction (M,) fluid share of the cell ·
    share (K + 1, 4) mean of N_a over the fluid part (∫ N_a = volume · share_a), share_row (M,) its row for each cell:
    the first, 1/4, for whole ones · size (M,) [m] (6 |e|)^(1/3) ·
    node_start (N+1,), node_cells (4M,) cells around each node · neighbours (M, 4) across faces, -1 none ·
    node_volume (N,) [m³] ∫ N_i · covered (N,) bool: nodes inside a solid · beside_solid (N,) bool: nodes of
    cut cells · parts: the fluid parts of the cells · obtuse (M,) bool: cells with obtuse dihedral
    angles, is_obtuse: the mesh has such cells · along (rows of `gradients`,) uint8: `Background.along` ·
    node_size (N,) [m]: `Background.node_size`, slanting, sloping_bed (N,) bool: as in `Background` ·
    divided (N,) bool: copies of a node that has several ·
    spacing [m] of the mesh."""

    nodes: Floats
    cells: Integers
    background: Integers
    n_background: int
    parent: Integers
    gradients: Floats
    products: Floats
    volume: Floats
    fraction: Floats
    share: Floats
    share_row: Integers
    size: Floats
    node_start: Integers
    node_cells: Integers
    neighbours: Integers
    node_volume: Floats
    covered: Bools
    beside_solid: Bools
    parts: FluidParts
    obtuse: Bools
    is_obtuse: bool
    along: Integers
    node_size: Floats
    slanting: Bools
    sloping_bed: Bools
    divided: Bools
    spacing: float

    @classmethod
    def of(cls, mesh: Background, domain) -> Topology:
        """Lay out a PhysicalDomain of the background mesh."""
        cells, background = domain.cells, domain.parent_cell
        nodes = np.ascontiguousarray(domain.nodes)
        start, members = _cells_of_nodes(cells, len(nodes))
        shapes = mesh.shapes
        divided = (np.bincount(domain.parent_node) > 1)[domain.parent_node]
        share, share_row, fraction, size, node_volume, beside_solid = _measures(
            nodes, cells, background, mesh.cell_volume, mesh.cell_size, domain.volume, domain.part,
            domain.memory.cuts.moments,
        )  # fmt: skip
        return cls(
            nodes=nodes,
            cells=cells,
            background=background,
            n_background=len(mesh.cells),
            parent=shapes.row[background],
            gradients=shapes.gradients,
            products=shapes.products,
            volume=domain.volume,
            fraction=fraction,
            share=share,
            share_row=share_row,
            size=size,
            node_start=start,
            node_cells=members,
            neighbours=_neighbours_in(mesh, divided, cells, background),
            node_volume=node_volume,
            covered=covered_nodes(domain),
            beside_solid=beside_solid,
            parts=FluidParts(
                cells,
                domain.volume,
                share,
                share_row,
                domain.fan_start,
                domain.fan_volume,
                domain.fan_corners,
            ),
            obtuse=mesh.obtuse[background],
            is_obtuse=mesh.is_obtuse,
            along=shapes.along,
            node_size=mesh.node_size[domain.parent_node],
            slanting=mesh.slanting[domain.parent_node],
            sloping_bed=mesh.sloping_bed[domain.parent_node],
            divided=divided,
            spacing=mesh.spacing,
        )

    @cached_property
    def fluid_cells(self) -> FluidCells:
        """The cells as kernels take them."""
        return FluidCells(
            self.cells,
            self.parent,
            self.gradients,
            self.volume,
            self.share,
            self.share_row,
            self.size,
            self.along,
        )

    @cached_property
    def hats(self) -> Hats:
        """The linear functions of the cells as kernels take them."""
        return Hats(self.cells, self.parent, self.gradients)

    @property
    def paths(self) -> Paths:
        """The mesh in the form for kernels that follow paths from cell to cell."""
        return Paths(
            self.nodes,
            self.cells,
            self.parent,
            self.gradients,
            self.neighbours,
            self.node_start,
            self.node_cells,
        )

    @cached_property
    def finer(self) -> Array:
        """Factor (N,) by which the mesh at a node is finer than on average, exactly 1 where all cells are equal. A
        length times this factor, over the spacing, is the length in local cells."""
        return self.spacing / self.node_size

    @cached_property
    def room(self) -> Array:
        """(N,) [m³] `node_volume` times the cube of `finer`: what a node could hold if its cells had the mean size."""
        return self.node_volume if self.is_uniform else self.node_volume * self.finer**3

    @cached_property
    def is_uniform(self) -> bool:
        """Whether all cells have the same size."""
        return bool((self.node_size == self.spacing).all())

    @cached_property
    def near_obtuse(self) -> Array:
        """(N,) bool: nodes of cells with obtuse dihedral angles and three layers around them."""
        near = np.zeros(len(self.nodes), bool)
        near[self.cells[self.obtuse]] = True
        near[layers_around(near, 3, *self.around).order] = True
        return near

    @cached_property
    def rows_of_background(self) -> tuple[Array, Array]:
        """First row and number of the cells of each background cell: none inside solids, several where a thin wall
        divides it."""
        start = first_rows(self.background, self.n_background)
        return start[:-1], np.diff(start)

    @property
    def around(self) -> tuple[Array, Array]:
        """start (N+1,), neighbours: the nodes that share a cell with each node."""
        return self.around_by_cells[:2]

    @cached_property
    def around_by_cells(self) -> tuple[Array, Array, Array]:
        """`around`, and the number of cells that each of these neighbours shares with the node."""
        n = len(self.nodes)
        rows = (self.cells, self.node_start, self.node_cells)
        return _concatenated(over(_nodes_around, n, *rows, weight=WORK, pieces=1))

    @cached_property
    def near_solids(self) -> Array:
        """(N,) bool: nodes of cut cells and two layers around them."""
        near = self.beside_solid.copy()
        near[layers_around(near, 2, *self.around).order] = True
        return near

    def cells_around(self, nodes) -> Array:
        """Numbers of the cells with at least one of these nodes (N,) bool, in order; the cost grows with their number
        only, apart from one byte a cell."""
        touched = self._touched
        try:
            over(_touch, len(nodes), nodes, self.node_start, self.node_cells, touched)
            return taken(touched)
        except BaseException:
            del self._touched
            raise

    @cached_property
    def _touched(self) -> Array:
        """(M,) bool, False again after each use: to fill as many anew would take longer than to go through them."""
        return np.zeros(len(self.cells), bool)

    @cached_property
    def cut_cells(self) -> Array:
        """Numbers (k,) of the cells that solids cut, in order."""
        return np.flatnonzero(self.share_row)

    @cached_property
    def cells_near_solids(self) -> Array:
        """Numbers (k,) of the cells with nodes of cut cells and of all that touch them, in order."""
        touching = marks_of(self.cells[self.cells_around(self.beside_solid)].reshape(-1), len(self.nodes))
        return self.cells_around(touching)

    def in_cells(self, length) -> Array:
        """Lengths (N,) [m] times `finer`; unchanged where all cells are equal."""
        return length if self.is_uniform else length * self.finer

    @cached_property
    def active(self) -> Array:
        """(N,) bool: nodes that belong to a cell with fluid volume."""
        return np.diff(self.node_start) > 0


def covered_nodes(domain) -> Array:
    """(N,) bool: nodes that lie, for at least one body, behind all wetted polygons of that body in the cells around
    them.

    A body is convex, so a node with all of its nearby faces in front of it lies inside. A node in the plane of a face
    is in front of it; the face bends by as much as nodes are moved into it."""
    d = domain
    if len(d.face_cell) == 0:
        return np.zeros(len(d.nodes), bool)
    start, members = polygons_of_nodes(d.face_cell, d.cells, len(d.nodes))
    surface, least = (d.face_body, d.face_centroid, d.face_normal), 2.0 * d.memory.mesh.tolerance
    covered = np.zeros(len(d.nodes), bool)
    over(_covered, len(covered), start, members, d.nodes, *surface, d.n_bodies, least, covered)
    return covered


@released
def _covered(first, last, start, members, nodes, body, centroid, normal, n_bodies, least, covered):
    # marks of the current node: bodies met so far, and bodies with a face that the node is in front of
    seen, in_front = np.full(n_bodies, -1, np.int64), np.full(n_bodies, -1, np.int64)
    for i in range(first, last):
        behind = 0
        for t in range(start[i], start[i + 1]):
            s = members[t] // 4
            b = body[s]
            if seen[b] != i:
                seen[b] = i
                behind += 1
            height = 0.0
            for c in range(3):
                height += (nodes[i, c] - centroid[s, c]) * normal[s, c]
            if height >= -least and in_front[b] != i:
                in_front[b] = i
                behind -= 1
        covered[i] = behind > 0


@kernel
def _measures(nodes, cells, parent, full, full_size, volume, part, moments):
    """share (K + 1, 4), share_row (M,), fraction (M,), size (M,), node_volume (N,) and beside_solid (N,) of Topology.

    Mean of N_a over the fluid part of a cell: N_a at its centroid, which stands in the moments of the K cut parts;
    exactly 1/4 in whole cells."""
    share, row = np.full((len(moments) + 1, 4), 0.25), np.empty(len(cells), np.uint32)
    fraction, size, g = np.empty(len(cells)), np.empty(len(cells)), np.empty((4, 3))
    node_volume, beside_solid = np.zeros(len(nodes)), np.zeros(len(nodes), np.bool_)
    for e in range(len(cells)):
        p, r = parent[e], part[e] + 1
        fraction[e], size[e], row[e] = volume[e] / full[p], full_size[p], r
        if r > 0:
            gradient_rows(nodes, cells, e, g)
        for a in range(4):
            if r > 0:
                at = 0.0
                for k in range(3):
                    at += g[a, k] * (moments[r - 1, 1 + k] - nodes[cells[e, 0], k])
                share[r, a] = min(max(at + 1.0 if a == 0 else at, 0.0), 1.0)
                beside_solid[cells[e, a]] = True
            node_volume[cells[e, a]] += volume[e] * share[r, a]
    return share, row, fraction, size, node_volume, beside_solid


@kernel
def first_rows(parent, n):
    """First row (n + 1,) of each number below n in an ascending list (M,) of numbers; M at the end."""
    start = np.zeros(n + 1, np.int32)
    for e in range(len(parent)):
        start[parent[e] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    return start


@kernel
def _cells_of_nodes(cells, n):
    start = np.zeros(n + 1, np.uint32)
    for e in range(cells.shape[0]):
        for a in range(4):
            start[cells[e, a] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    filled = start[:-1].copy()
    members = np.empty(4 * cells.shape[0], np.uint32)
    for e in range(cells.shape[0]):
        for a in range(4):
            i = cells[e, a]
            members[filled[i]] = e
            filled[i] += 1
    return start, members


def _neighbours_in(mesh, divided, cells, parent):
    """neighbours (M, 4); where every node is its background node, those of the parents, renumbered. divided (N,) bool:
    copies of a node that has several."""
    if len(divided) > len(mesh.nodes):
        found = np.full(cells.shape, -1, np.int32)
        rows = first_rows(parent, len(mesh.cells))
        over(_neighbours, len(cells), mesh.neighbours, cells, parent, rows, divided, found, weight=WORK)
        return found
    if cells is mesh.cells:
        return mesh.neighbours
    row = np.full(len(mesh.cells) + 1, -1, np.int32)  # the last entry stands for "no neighbour", -1
    row[parent] = np.arange(len(parent), dtype=np.int32)
    found = np.empty((len(parent), 4), np.int32)
    for some in spans(len(parent)):
        found[some] = row[mesh.neighbours[parent[some]]]
    return found


@ranged
def _neighbours(first, last, parent_neighbours, cells, parent, start, divided, found):
    """found (M, 4) ← copies of the parents' neighbours that share the three nodes of the face, where there are any.
    Where no node of the cell has a further copy, the first copy of the neighbour is known to share them.

    start (parents + 1,): first cell of each parent."""
    for e in range(first, last):
        alone = True
        for a in range(4):
            alone = alone and not divided[cells[e, a]]
        for a in range(4):
            p = parent_neighbours[parent[e], a]
            if p < 0:
                continue
            if alone:
                if start[p] < start[p + 1]:
                    found[e, a] = start[p]
                continue
            for other in range(start[p], start[p + 1]):  # elements are in the order of their parents
                shared = 0
                for b in range(4):
                    for c in range(4):
                        if b != a and cells[other, c] == cells[e, b]:
                            shared += 1
                if shared == 3:
                    found[e, a] = other
                    break


def _concatenated(parts):
    """Concatenate rows that come in parts, each (start, values, values) → start (n + 1,) of all rows, and their
    values."""
    if len(parts) == 1:
        return parts[0]
    starts, first, second = zip(*parts)
    before = np.cumsum([0, *(start[-1] for start in starts)])
    start = np.concatenate([starts[0][:1], *(s[1:] + b for s, b in zip(starts, before))])
    return start.astype(np.uint32), np.concatenate(first), np.concatenate(second)


@released
def _nodes_around(first, last, cells, node_start, node_cells):
    """start (n + 1,), neighbours: nodes that share a cell with each node, in the order of its cells, and the number of
    shared cells."""
    n = last - first
    start = np.zeros(n + 1, np.uint32)
    slot = np.full(node_start.shape[0] - 1, -1, np.int64)
    around, shared = np.empty(16 * n + 64, np.uint32), np.empty(16 * n + 64, np.uint8)
    row, count = _next_around(0, first, n, cells, node_start, node_cells, slot, start, around, shared)
    while row < n:  # not where rows are filled: numba would count references to both arrays in every turn
        more = around.shape[0] + _most_around(first + row, node_start)
        around = np.concatenate((around, np.empty(more, np.uint32)))
        shared = np.concatenate((shared, np.empty(more, np.uint8)))
        row, count = _next_around(row, first, n, cells, node_start, node_cells, slot, start, around, shared)
    return start, around[:count].copy(), shared[:count].copy()


@inner
def _most_around(i, node_start):
    """More neighbours than node i can have."""
    return 3 * (np.int64(node_start[i + 1]) - np.int64(node_start[i]))


@inner
def _next_around(row, first, n, cells, node_start, node_cells, slot, start, around, shared):
    """Fill rows of `_nodes_around`, from one on, for as long as there is room; → the next row, and how many neighbours
    there are so far."""
    count = np.int64(start[row])
    for r in range(row, n):
        i, begun = np.uint64(first + r), count
        if count + _most_around(first + r, node_start) > around.shape[0]:
            return r, count
        for t in range(node_start[i], node_start[i + np.uint64(1)]):
            for a in range(4):
                j = cells[node_cells[t], a]
                if j == i:
                    continue
                if slot[j] < begun:
                    slot[j], around[np.uint64(count)], shared[np.uint64(count)] = count, j, 1
                    count += 1
                else:
                    shared[np.uint64(slot[j])] += 1
        start[np.uint64(r + 1)] = count
    return n, count


@ranged
def _touch(first, last, nodes, node_start, node_cells, touched):
    """(M,) bool: cells around these nodes (N,) bool; several threads may mark one cell."""
    for k in range(first, last):
        i = np.uint64(k)
        if nodes[i]:
            for t in range(node_start[i], node_start[i + np.uint64(1)]):
                touched[node_cells[t]] = True


@dataclass(frozen=True)
class Graph:
    """Edges of the listed nodes with the stiffness of the physical domain.

    row (N,) place of a node in `nodes`, -1 if not listed · start (n+1,), neighbour, stiffness [m]: CSR without
    diagonal, K_ij = Σ_e volume_e ∇N_i·∇N_j · whole: all nodes of the domain that have cells are listed."""

    nodes: Ints
    row: Ints
    start: Integers
    neighbour: Integers
    stiffness: Floats
    whole: bool = False

    @property
    def edges(self) -> Edges:
        """The edges as kernels take them."""
        return Edges(self.row, self.start, self.neighbour, self.stiffness)

    def covers(self, nodes) -> bool:
        """Whether all these nodes (n,) are listed."""
        return self.whole or sum(over(_listed_among, len(nodes), nodes, self.row)) == len(nodes)

    @classmethod
    def of(cls, topology: Topology, nodes) -> Graph:
        """Edges around the given nodes (n,); cost grows with n only."""
        t = topology
        row = np.full(len(t.nodes), -1, np.int64)
        row[nodes] = np.arange(len(nodes))
        mesh = (t.cells, t.parent, t.products, t.volume, t.node_start, t.node_cells)
        start, neighbour, stiffness = _concatenated(
            over(_edges, len(nodes), nodes, *mesh, weight=WORK, pieces=1)
        )
        return cls(nodes, row, start, neighbour, stiffness)

    def without(self, topology: Topology, cell_list) -> Graph:
        """The same edges with the stiffness of the listed cells (k,) taken out."""
        if len(cell_list) == 0:
            return self
        t, stiffness = topology, self.stiffness.copy()
        found = replace(self, stiffness=stiffness)
        _take_out(cell_list, t.cells, t.parent, t.products, t.volume, found.edges)
        return found


PAIR = np.array([[-1, 0, 1, 2], [0, -1, 3, 4], [1, 3, -1, 5], [2, 4, 5, -1]])
"""Column of Background.products that holds the corners a, b."""


@kernel
def _take_out(cell_list, cells, parent, products, volume, edges):
    row, start, neighbour, stiffness = edges
    for e in cell_list:
        for a in range(4):
            r = row[cells[e, a]]
            if r < 0:
                continue
            for s in range(start[r], start[r + 1]):
                for b in range(4):
                    if b != a and neighbour[s] == cells[e, b]:
                        stiffness[s] -= volume[e] * products[parent[e], PAIR[a, b]]


@ranged
def _listed_among(first, last, nodes, row):
    count = 0
    for s in range(first, last):
        count += row[nodes[s]] >= 0
    return count


@released
def _edges(first, last, rows, cells, parent, products, volume, node_start, node_cells):
    n = last - first
    slot = np.full(node_start.shape[0] - 1, -1, np.int64)
    start = np.zeros(n + 1, np.uint32)
    neighbour, stiffness = np.empty(16 * n + 64, np.uint32), np.empty(16 * n + 64)
    mesh = (cells, parent, products, volume, node_start, node_cells)
    row, count = _next_edges(0, rows[first:last], *mesh, slot, start, neighbour, stiffness)
    while row < n:  # as in `_nodes_around`
        more = neighbour.shape[0] + _most_around(rows[first + row], node_start)
        neighbour = np.concatenate((neighbour, np.empty(more, np.uint32)))
        stiffness = np.concatenate((stiffness, np.empty(more)))
        row, count = _next_edges(row, rows[first:last], *mesh, slot, start, neighbour, stiffness)
    return start, neighbour[:count].copy(), stiffness[:count].copy()


@inner
def _next_edges(
    row, nodes, cells, parent, products, volume, node_start, node_cells, slot, start, neighbour, stiffness
):
    """Fill rows of `_edges`, from one on, for as long as there is room; → the next row, and how many edges there are so
    far."""
    count = np.int64(start[row])
    for r in range(row, nodes.shape[0]):
        i, begun = np.uint64(nodes[r]), count
        if count + _most_around(nodes[r], node_start) > neighbour.shape[0]:
            return r, count
        for t in range(node_start[i], node_start[i + np.uint64(1)]):
            e = node_cells[t]
            p, own = parent[e], np.uint64(0)
            while cells[e, own] != i:
                own += np.uint64(1)
            for b in range(4):
                if np.uint64(b) == own:
                    continue
                j = cells[e, b]
                k = volume[e] * products[p, PAIR[own, b]]
                if slot[j] < begun:
                    slot[j], neighbour[np.uint64(count)], stiffness[np.uint64(count)] = count, j, k
                    count += 1
                else:
                    stiffness[np.uint64(slot[j])] += k
        start[np.uint64(r + 1)] = count
    return nodes.shape[0], count
