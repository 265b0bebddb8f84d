"""Cells with obtuse angles at the surface that would make the pressure matrix indefinite.

The zero of the pressure at the crossings of wet-dry edges (`projection.py`, equation (2)) gives the wet corners i of a
cell the matrix

    A_ij = |e| ∇N_i·∇N_j,      A_ii = |e| [Σ_{j wet} k_ij + Σ_{j dry} k_ij / ϑ_ij],      k_ij = -∇N_i·∇N_j,

indefinite where a dry corner lies behind an obtuse angle.  Away from solids the neighbours outweigh such a cell.
Beside a solid, where cells contain little fluid, they may not: the row of the node then determines no pressure, and any
positive number in place of its diagonal stirs water at rest.  These cells are left out of both matrix and right hand
side: - cells with less than SMALL of their volume in the fluid whose own matrix is not positive, - cells that take from
the diagonal of a row until the sum is no longer clearly positive. Water at rest is in balance in every cell separately,
so it stays at rest.

The remaining matrix may still be indefinite where the surface passes close to a node behind an obtuse angle, 1/ϑ being
large. With K_UU, rows and columns of the unknowns in the stiffness of all cells, the matrix is

    A = K_UU + diag(d),      d_i = Σ_{j dry} k_ij (1/ϑ_ij - 1),

and K_UU ⪰ diag(r) with r_i = Σ_e t_e K_e,ii, t_e the least eigenvalue of the cell's K_e,UU scaled to a diagonal of ones
(above 0 where a corner of the cell is no unknown).  So A is positive definite wherever d > -r; other rows get
|d_i| instead of d_i, and the difference times an estimate of the pressure at the node is added to the right hand side.
The surface then still keeps the pressure near 0, and water at rest is still in balance (`reserve`, `about`).
"""

from __future__ import annotations

import numpy as np

from fluid.pressure.projection import SMALLEST_CUT
from kernels.decorators import inner, kernel

LEAST = 0.05
"""Least share of a row's positive and negative entries on the diagonal that is to be left."""
SMALL = 0.98
"""Fuller cells have neighbours like themselves: without them the surface loses what holds it (growth of 0.1 a step)."""
ROUND_OFF = 1e-12


def without_indefinite(topology, cells, wet, phi):
    """Which of the listed cells (n,) are kept, (n,) bool; wet (N,) bool and phi (N,) [m]: the surface."""
    t = topology
    return _kept(cells, t.fraction, wet, phi, t.cells, t.parent, t.products, t.volume)


def reserve(topology, cells, unknown):
    """r (N,) [m]: by how much the diagonal of each row may be reduced, from the listed cells (n,); unknown (N,)
    bool."""
    t = topology
    return _reserve(cells, unknown, t.cells, t.parent, t.products, t.volume)


@kernel
def _reserve(cell_list, unknown, cells, parent, products, volume):
    out = np.zeros(len(unknown))
    own, scaled = np.empty(4), np.empty(3)
    for e in cell_list:
        count = 0
        for a in range(4):
            count += unknown[cells[e, a]]
        if count == 0 or count == 4:
            continue
        column, pair = 0, 0
        own[:], scaled[:] = 0.0, 0.0
        for a in range(4):
            for b in range(a + 1, 4):
                k = -products[parent[e], column]
                column += 1
                own[a] += k
                own[b] += k
        column = 0
        for a in range(4):
            for b in range(a + 1, 4):
                if unknown[cells[e, a]] and unknown[cells[e, b]]:
                    scaled[pair] = products[parent[e], column] / np.sqrt(own[a] * own[b])
                    pair += 1
                column += 1
        share = 1.0 + _least_root(scaled)
        for a in range(4):
            if unknown[cells[e, a]]:
                out[cells[e, a]] += volume[e] * share * own[a]
    return out


@inner
def _least_root(off):
    """Least eigenvalue of the symmetric 3 x 3 matrix with a zero diagonal and the off-diagonal entries `off` (3,), from
    below: λ³ - p λ - q = 0 by Newton's method, which comes up from -2 sqrt(p/3) without passing the root."""
    p = off[0] * off[0] + off[1] * off[1] + off[2] * off[2]
    q = 2.0 * off[0] * off[1] * off[2]
    root = -2.0 * np.sqrt(p / 3.0)
    for _ in range(6):
        slope = 3.0 * root * root - p
        if slope <= 0.0:
            break
        root -= ((root * root - p) * root - q) / slope
    return root


def about(graph, rows, beside, phi, pressure):
    """Estimate [Pa] of the pressure at the nodes rows (k,): φ times the mean slope p/φ of the nodes around, beside (N,)
    bool the surface, where φ is exact, the deep ones first; pressure (N,) [Pa] a step ago."""
    return _about(rows, graph.row, graph.start, graph.neighbour, beside, phi, pressure)


@kernel
def _about(rows, graph_row, start, neighbour, beside, phi, pressure):
    out = np.zeros(len(rows))
    for r in range(len(rows)):
        i = rows[r]
        up, down = pressure[i] * phi[i], phi[i] * phi[i]
        for s in range(start[graph_row[i]], start[graph_row[i] + 1]):
            j = neighbour[s]
            if beside[j]:
                up += pressure[j] * phi[j]
                down += phi[j] * phi[j]
        out[r] = phi[i] * up / down if down > 0.0 else 0.0
    return out


@kernel
def _kept(cell_list, fraction, wet, phi, cells, parent, products, volume):
    kept = np.ones(len(cell_list), np.bool_)
    part, total, size = np.zeros((len(cell_list), 4)), np.zeros(len(phi)), np.zeros(len(phi))
    matrix = np.empty((4, 4))
    for s in range(len(cell_list)):
        e = cell_list[s]
        n_wet = _cell_matrix(cells[e], products[parent[e]], wet, phi, matrix)
        for a in range(4):
            part[s, a] = volume[e] * matrix[a, a]
        if n_wet < 4 and fraction[e] < SMALL and not _is_positive(matrix):
            kept[s] = False
            continue
        for a in range(4):
            total[cells[e, a]] += part[s, a]
            size[cells[e, a]] += abs(part[s, a])
    dropped = True
    while dropped:
        dropped = False
        for s in range(len(cell_list)):
            e = cell_list[s]
            against = False
            for a in range(4):
                i = cells[e, a]
                against = against or (part[s, a] < 0.0 and total[i] < LEAST * size[i])
            if kept[s] and against:
                kept[s], dropped = False, True
                for a in range(4):
                    total[cells[e, a]] -= part[s, a]
                    size[cells[e, a]] -= abs(part[s, a])
    return kept


@inner
def _cell_matrix(corners, products, wet, phi, matrix):
    """A / |e| in `matrix` (4, 4), rows and columns of dry corners zero; the number of wet corners."""
    matrix[:] = 0.0
    column, n_wet = 0, 0
    for a in range(4):
        n_wet += wet[corners[a]]
        for b in range(a + 1, 4):
            k = -products[column]
            column += 1
            i, j = corners[a], corners[b]
            if wet[i] and wet[j]:
                matrix[a, b] = matrix[b, a] = -k
                matrix[a, a] += k
                matrix[b, b] += k
            elif wet[i]:
                matrix[a, a] += k / _crossing(phi[i], phi[j])
            elif wet[j]:
                matrix[b, b] += k / _crossing(phi[j], phi[i])
    return n_wet


@inner
def _crossing(inside, outside):
    """ϑ of the edge from a wet node to one that is not."""
    return max(inside / (inside - outside), SMALLEST_CUT) if outside >= 0.0 else 1.0


@inner
def _is_positive(matrix):
    """Whether elimination, in place, meets no negative pivot; empty rows are skipped."""
    largest = max(max(matrix[0, 0], matrix[1, 1]), max(matrix[2, 2], matrix[3, 3]))
    for a in range(4):
        if matrix[a, a] < -ROUND_OFF * largest or largest <= 0.0:
            return False
        if matrix[a, a] <= ROUND_OFF * largest:
            continue
        for b in range(a + 1, 4):
            factor = matrix[b, a] / matrix[a, a]
            for c in range(a, 4):
                matrix[b, c] -= factor * matrix[a, c]
    return True
