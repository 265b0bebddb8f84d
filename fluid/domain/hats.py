"""The linear functions of a cell, at points in it."""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import inlined, inner, kernel

POLYGON = 20
"""Cost of an integral over one polygon of a wall, in usual rows of a loop."""


def hat_values(cell_list, points, hats, nodes) -> Array:
    """N_a (k, q, 4) of the listed cells (k,) at points (k, q, 3) [m]; hats, nodes: as in `hats_at`."""
    return _hat_values(cell_list, points, hats, nodes)


@kernel
def _hat_values(cell_list, points, hats, nodes):
    found = np.empty((points.shape[0], points.shape[1], 4))
    for s in range(points.shape[0]):
        for q in range(points.shape[1]):
            hats_at(cell_list[s], points[s, q], hats, nodes, found[s, q])
    return found


@inlined
def hats_at(e, x, hats, nodes, out):
    """out (4,) ← N_a(x) of cell e; x (3,) [m] · hats: `Hats` with a row for the cell · nodes (N, 3) [m].

    The last three from their gradients, the first one from their sum, which is one."""
    cells, parent, g = hats
    cell = np.uint64(e)
    p, o = np.uint64(parent[cell]), np.uint64(cells[cell, 0])
    out[0] = 1.0
    for a in range(1, 4):
        out[a] = 0.0
        for c in range(3):
            out[a] += g[p, a, c] * (x[c] - nodes[o, c])
        out[0] -= out[a]


@inner
def value_at(e, hat, field, cells):
    """Σ_a N_a f_a of a field (N,) in cell e, where its hats are `hat` (4,)."""
    found = 0.0
    for a in range(4):
        found += hat[a] * field[np.uint64(cells[np.uint64(e), a])]
    return found
