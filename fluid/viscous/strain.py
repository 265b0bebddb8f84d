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

from array_types import Floats, Ints
from kernels.decorators import kernel

PAIRS = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
"""Corners at the ends of the edges of a cell."""
ROW, COLUMN = np.array([0, 1, 2, 1, 0, 0]), np.array([0, 1, 2, 2, 2, 1])
"""Row and column in the tensor of each of the six components of a strain."""


class StrainEdges(NamedTuple):
    """Edges of listed cells: of_cell (n, 6) numbers of the edges of each cell · weight (n_edges,) W."""

    of_cell: Ints
    weight: Floats


@kernel
def edges_of(cell_list, weight, cells, n_nodes):
    """Number of each edge of the listed cells (n, 6) and W (n_edges,); weight (n,)."""
    first = np.full(n_nodes, -1, np.int64)
    following, end = np.empty(6 * len(cell_list), np.int64), np.empty(6 * len(cell_list), np.int64)
    edge, total = np.empty((len(cell_list), 6), np.int64), np.zeros(6 * len(cell_list))
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


@kernel
def edge_strain(cell_list, weight, edges, u, hats):
    """ε̂ (n_edges, 6) [1/s] of u (N, 3); weight (n,) of the listed cells, edges: StrainEdges, hats: Hats."""
    edge, edge_weight = edges
    cells, parent, g = hats
    out = np.zeros((len(edge_weight), 6))
    G, x = np.empty((3, 3)), np.empty(6)
    for s in range(len(cell_list)):
        e = cell_list[s]
        p = parent[e]
        G[:] = 0.0
        for a in range(4):
            i = cells[e, a]
            for k in range(3):
                for m in range(3):
                    G[k, m] += u[i, k] * g[p, a, m]
        for c in range(6):
            x[c] = 0.5 * weight[s] * (G[ROW[c], COLUMN[c]] + G[COLUMN[c], ROW[c]])
        add_to_edges(out, edge[s], edge_weight, x)
    return out


@kernel
def add_to_edges(strain, edges, edge_weight, x):
    """Add a sixth of x (6,) over the weight of the edge to each edge of a cell, in place."""
    for m in range(6):
        k = edges[m]
        if edge_weight[k] > 0.0:
            for c in range(6):
                strain[k, c] += x[c] / (6.0 * edge_weight[k])


@kernel
def mean_strain(strain, edges, out):
    """Write ε̄ (3, 3) of a cell, from the strains of its edges, to out."""
    for c in range(6):
        total = 0.0
        for m in range(6):
            total += strain[edges[m], c]
        out[ROW[c], COLUMN[c]] = out[COLUMN[c], ROW[c]] = total / 6.0


@kernel
def spread_stress(cell_list, weight, edge, strain, hats, out):
    """out (N, 3) -= Σ_e w_e ε̄_e ∇N_i over the listed cells."""
    cells, parent, g = hats
    mean = np.empty((3, 3))
    for s in range(len(cell_list)):
        e = cell_list[s]
        p = parent[e]
        mean_strain(strain, edge[s], mean)
        for a in range(4):
            i = cells[e, a]
            for k in range(3):
                total = 0.0
                for m in range(3):
                    total += mean[k, m] * g[p, a, m]
                out[i, k] -= weight[s] * total
