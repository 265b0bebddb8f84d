"""Strain rates of P1 velocities, smoothed over the edges of the cells.

    ε̂_k = Σ_e w_e ε_e / Σ_e w_e   over the cells around the edge k,     ε̄_e = mean of ε̂ over the six edges of e

w = 2μ times the water of the cell.  The stress in cells and at walls follows from ε̄ in place of ε (edge-based smoothed
finite elements; He, Li, Zhong, Cheng, Zhang, Liu, Li, Comput. Mech. 52 (2013) 221): a linear velocity is still exact,
the form stays symmetric, and a given velocity dissipates less energy,

    Σ_e w_e ε_e:ε̄_e = Σ_k W_k |ε̂_k|²,  W_k = 1/6 Σ_e w_e.

A piecewise constant ε is always too stiff: the moment on a spinning sphere with four cells over its diameter is 1.21
times that of Stokes with ε and 1.04 times with ε̄; with eight cells it is 1.064 and 1.003 times.  Since w_e |ε̄_e|² ≤
w_e/6 Σ |ε̂|², the bounds of the weak wall condition remain valid.

Strains are (n, 6): xx, yy, zz, yz, xz, xy.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Integers
from kernels.decorators import inner, kernel, ranged
from kernels.threads import over

PAIRS = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
"""Corners at the ends of the edges of a cell."""
ROW, COLUMN = np.array([0, 1, 2, 1, 0, 0]), np.array([0, 1, 2, 2, 2, 1])
"""Row and column in the tensor of each of the six components of a strain."""
PER_CELL, PER_EDGE, PER_NODE = 4, 2, 8
"""Cost of the loops over cells, edges and nodes, in usual rows."""


class StrainEdges(NamedTuple):
    """Edges of listed cells: of_cell (n, 6) numbers of the edges of each cell · weight (n_edges,) W · start
    (n_edges + 1,) of the cells around each edge in around (6 n,), places in the list, in order."""

    of_cell: Integers
    weight: Floats
    start: Integers
    around: Integers

    @classmethod
    def of(cls, of_cell, weight) -> StrainEdges:
        """Edges with the numbers of_cell (n, 6) and W (n_edges,)."""
        start, entry = gathered(of_cell, len(weight))
        return cls(np.asarray(of_cell, np.uint32), weight, start, entry // np.uint32(6))


@kernel
def gathered(number, count):
    """Where each of the numbers 0 ... count stands in number (n, m): start (count + 1,) of its places in place (n m,)
    uint32, m times the row and the column, in order."""
    start = np.zeros(count + 1, np.uint32)
    flat = number.reshape(-1)
    for s in range(len(flat)):
        start[np.uint64(flat[s]) + np.uint64(1)] += np.uint32(1)
    for k in range(count):
        start[k + 1] += start[k]
    following, place = start.copy(), np.empty(len(flat), np.uint32)
    for s in range(len(flat)):
        k = np.uint64(flat[s])
        place[following[k]] = s
        following[k] += np.uint32(1)
    return start, place


@kernel
def edges_of(cell_list, weight, cells, n_nodes):
    """Number of each edge of the listed cells (n, 6) and W (n_edges,); weight (n,)."""
    first = np.full(n_nodes, -1, np.int64)
    following, end = np.empty(6 * len(cell_list), np.int64), np.empty(6 * len(cell_list), np.int64)
    edge, total = np.empty((len(cell_list), 6), np.uint32), np.zeros(6 * len(cell_list))
    count = 0
    for s in range(len(cell_list)):
        for m in range(6):
            i, j = cells[cell_list[s], PAIRS[m, 0]], cells[cell_list[s], PAIRS[m, 1]]
            low, high = min(i, j), max(i, j)
            k = first[low]
            while k >= 0 and end[k] != high:
                k = following[k]
            if k < 0:
                k = count
                following[k], end[k] = first[low], high
                first[low] = k
                count += 1
            edge[s, m] = k
            total[k] += weight[s] / 6.0
    return edge, total[:count].copy()


def edge_strain(cell_list, weight, edges, u, hats):
    """ε̂ (n_edges, 6) [1/s] of u (N, 3); weight (n,) of the listed cells, edges: StrainEdges, hats: Hats."""
    strain, out = np.empty((len(cell_list), 6)), np.empty((len(edges.weight), 6))
    over(_cell_strain, len(cell_list), cell_list, weight, u, hats, strain, weight=PER_CELL)
    over(_edge_mean, len(out), edges, strain, out, weight=PER_EDGE)
    return out


@ranged
def _cell_strain(first, last, cell_list, weight, u, hats, out):
    """w_e ε_e (n, 6) of the listed cells."""
    cells, parent, g = hats
    for row in range(first, last):
        s = np.uint64(row)
        e = np.uint64(cell_list[s])
        p = np.uint64(parent[e])
        xx, yy, zz, yz, xz, xy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for a in range(4):
            i = np.uint64(cells[e, a])
            u0, u1, u2 = u[i, 0], u[i, 1], u[i, 2]
            g0, g1, g2 = g[p, a, 0], g[p, a, 1], g[p, a, 2]
            xx += u0 * g0
            yy += u1 * g1
            zz += u2 * g2
            yz += u1 * g2 + u2 * g1
            xz += u0 * g2 + u2 * g0
            xy += u0 * g1 + u1 * g0
        half = 0.5 * weight[s]
        out[s, 0], out[s, 1], out[s, 2] = weight[s] * xx, weight[s] * yy, weight[s] * zz
        out[s, 3], out[s, 4], out[s, 5] = half * yz, half * xz, half * xy


@ranged
def _edge_mean(first, last, edges, strain, out):
    """Σ_e w_e ε_e / Σ_e w_e over the cells around each edge."""
    start, around, weight = edges.start, edges.around, edges.weight
    for row in range(first, last):
        k = np.uint64(row)
        a, b, c, d, e, f = _sum_of_rows(
            strain, around, np.uint64(start[k]), np.uint64(start[k + np.uint64(1)])
        )
        share = 1.0 / (6.0 * weight[k]) if weight[k] > 0.0 else 0.0
        out[k, 0], out[k, 1], out[k, 2] = share * a, share * b, share * c
        out[k, 3], out[k, 4], out[k, 5] = share * d, share * e, share * f


@inner
def _sum_of_rows(strain, rows, begin, end):
    """Σ of the six components over rows[begin:end]."""
    a, b, c, d, e, f = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for t in range(begin, end):
        s = np.uint64(rows[t])
        a += strain[s, 0]
        b += strain[s, 1]
        c += strain[s, 2]
        d += strain[s, 3]
        e += strain[s, 4]
        f += strain[s, 5]
    return a, b, c, d, e, f


@inner
def add_to_edges(strain, edges, edge_weight, x):
    """Add a sixth of x (6,) over the weight of the edge to each edge of a cell, in place."""
    for m in range(6):
        k = edges[m]
        if edge_weight[k] > 0.0:
            for c in range(6):
                strain[k, c] += x[c] / (6.0 * edge_weight[k])


@inner
def mean_strain(strain, edges, out):
    """Write ε̄ (3, 3) of a cell, from the strains of its edges, to out."""
    for c in range(6):
        total = 0.0
        for m in range(6):
            total += strain[edges[m], c]
        out[ROW[c], COLUMN[c]] = out[COLUMN[c], ROW[c]] = total / 6.0


class NodeCorners(NamedTuple):
    """Nodes of listed cells: nodes (n,) · start (n + 1,) of their corners in corner: four times the place of the cell
    in the list and the number of the corner, in the order of the cells."""

    nodes: Integers
    start: Integers
    corner: Integers

    @classmethod
    def of(cls, cell_list, cells, nodes, n_nodes) -> NodeCorners:
        """Of the listed `cells` (M, 4); nodes (n,) contains all of theirs."""
        place = np.zeros(n_nodes, np.uint32)
        place[nodes] = np.arange(len(nodes))
        return cls(nodes, *gathered(place[cells[cell_list]], len(nodes)))


def spread_stress(cell_list, weight, edges, corners, strain, hats, out):
    """out (N, 3) -= Σ_e w_e ε̄_e ∇N_i over the listed cells; corners: NodeCorners of them."""
    stress = np.empty((len(cell_list), 6))
    over(_cell_stress, len(cell_list), weight, edges.of_cell, strain, stress, weight=PER_CELL)
    over(_to_nodes, len(corners.nodes), corners, cell_list, stress, hats, out, weight=PER_NODE)


@ranged
def _cell_stress(first, last, weight, of_cell, strain, out):
    """w_e ε̄_e (n, 6) of the listed cells."""
    for row in range(first, last):
        s = np.uint64(row)
        a, b, c, d, e, f = _sum_of_rows(strain, of_cell[s], np.uint64(0), np.uint64(6))
        share = weight[s] / 6.0
        out[s, 0], out[s, 1], out[s, 2] = share * a, share * b, share * c
        out[s, 3], out[s, 4], out[s, 5] = share * d, share * e, share * f


@ranged
def _to_nodes(first, last, corners, cell_list, stress, hats, out):
    nodes, start, corner = corners
    parent, g = hats.parent, hats.gradients
    for row in range(first, last):
        k = np.uint64(row)
        x, y, z = 0.0, 0.0, 0.0
        for t in range(np.uint64(start[k]), np.uint64(start[k + np.uint64(1)])):
            s, a = np.uint64(corner[t]) // np.uint64(4), np.uint64(corner[t]) % np.uint64(4)
            p = np.uint64(parent[np.uint64(cell_list[s])])
            g0, g1, g2 = g[p, a, 0], g[p, a, 1], g[p, a, 2]
            x += stress[s, 0] * g0 + stress[s, 5] * g1 + stress[s, 4] * g2
            y += stress[s, 5] * g0 + stress[s, 1] * g1 + stress[s, 3] * g2
            z += stress[s, 4] * g0 + stress[s, 3] * g1 + stress[s, 2] * g2
        i = np.uint64(nodes[k])
        out[i, 0] -= x
        out[i, 1] -= y
        out[i, 2] -= z
