"""The edges of the nodes that a step works on, with the stiffness of the physical domain."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from array_types import Floats, Integers, Ints
from fluid.domain.incidence import joined_rows, most_around
from fluid.domain.layers import WORK
from fluid.domain.topology import Topology
from fluid.mesh.arrays import Edges
from kernels.decorators import inner, kernel, ranged, released
from kernels.threads import over

PAIR = np.array([[-1, 0, 1, 2], [0, -1, 3, 4], [1, 3, -1, 5], [2, 4, 5, -1]])
"""Column of Background.products that holds the corners a, b."""


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
        start, neighbour, stiffness = joined_rows(
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
    while row < n:  # as in `nodes_around`
        more = neighbour.shape[0] + most_around(rows[first + row], node_start)
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
        if count + most_around(nodes[r], node_start) > neighbour.shape[0]:
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
