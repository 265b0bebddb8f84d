"""Gradients of the linear functions of tetrahedra, from their corners."""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import inner, kernel


def gradients(nodes, cells) -> tuple[Array, Array]:
    """∇N_a (M, 4, 3) [1/m] and volume (M,) [m³] of cells (M, 4) with nodes (N, 3) [m].

    ∇N_a is the row a of the inverse of the edge matrix; ∇N_0 = -Σ ∇N_a, so that they sum to zero exactly.  Cells
    without volume have gradients of zero."""
    return _gradients(np.ascontiguousarray(nodes, float), np.ascontiguousarray(cells, np.uint32))


@inner
def gradient_rows(nodes, cells, e, g):
    """g (4, 3) <- ∇N_a [1/m] of cell e; returns its volume [m³], negative where the cell is turned."""
    o, i, j, k = cells[e, 0], cells[e, 1], cells[e, 2], cells[e, 3]
    x, y, z = nodes[o, 0], nodes[o, 1], nodes[o, 2]
    ax, ay, az = nodes[i, 0] - x, nodes[i, 1] - y, nodes[i, 2] - z
    bx, by, bz = nodes[j, 0] - x, nodes[j, 1] - y, nodes[j, 2] - z
    cx, cy, cz = nodes[k, 0] - x, nodes[k, 1] - y, nodes[k, 2] - z
    g[1, 0], g[1, 1], g[1, 2] = by * cz - bz * cy, bz * cx - bx * cz, bx * cy - by * cx
    g[2, 0], g[2, 1], g[2, 2] = cy * az - cz * ay, cz * ax - cx * az, cx * ay - cy * ax
    g[3, 0], g[3, 1], g[3, 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    six = (ax * g[1, 0] + az * g[1, 2]) + ay * g[1, 1]
    for c in range(3):
        for a in range(1, 4):
            g[a, c] = g[a, c] / six if six != 0.0 else 0.0
        g[0, c] = -(g[1, c] + g[2, c] + g[3, c])
    return six / 6.0


@kernel
def _gradients(nodes, cells):
    g, volume = np.empty((cells.shape[0], 4, 3)), np.empty(cells.shape[0])
    for e in range(cells.shape[0]):
        volume[e] = gradient_rows(nodes, cells, e, g[e])
    return g, volume


@kernel
def products_of(g):
    """∇N_a·∇N_b (n, 6) [1/m²] from g (n, 4, 3), see `Background.products`."""
    out = np.empty((g.shape[0], 6))
    for e in range(g.shape[0]):
        n = 0
        for a in range(4):
            for b in range(a + 1, 4):
                out[e, n] = g[e, a, 0] * g[e, b, 0] + g[e, a, 1] * g[e, b, 1] + g[e, a, 2] * g[e, b, 2]
                n += 1
    return out
