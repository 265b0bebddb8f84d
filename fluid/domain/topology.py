"""Connectivity of the physical domain, laid out for the kernels of the step.

The gradients of a cell are those of its cell in the background mesh (a cover is a copy with the same
corners), so that no geometry is recomputed when solids move.  Every loop over cells reads them: cells of one
shape share a row (`shapes.py`), which stays in the cache of the processor.  Numbers of
nodes and cells are unsigned: a loop that gathers by them need not test for negative indices, which count from the end
in Python, and takes half the time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from array_types import Array, Bools, Floats, Integers
from fluid.domain.coupling_matrix import polygons_of_nodes
from fluid.domain.incidence import cells_of_nodes, first_rows, joined_rows, neighbours_in, nodes_around, touch
from fluid.domain.layers import WORK, layers_around
from fluid.domain.moments import FluidParts
from fluid.mesh.arrays import FluidCells, Hats, Paths
from fluid.mesh.background import Background
from fluid.mesh.gradients import gradient_rows
from fluid.numerics.fields import marks_of
from kernels.decorators import kernel, released
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
        start, members = cells_of_nodes(cells, len(nodes))
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
            neighbours=neighbours_in(mesh, divided, cells, background),
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
        return joined_rows(over(nodes_around, n, *rows, weight=WORK, pieces=1))

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
            over(touch, len(nodes), nodes, self.node_start, self.node_cells, touched)
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
