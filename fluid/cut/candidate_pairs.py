"""The cells that each body may meet: the broad search before the exact cut.

A pair (cell, body) is kept unless one plane of the body has the whole cell on its outer side by more than
`margin`. The margin must exceed the tolerance of the cut: with a tighter search, a body that touches a mesh
plane to round-off would lose surface.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.mesh.arrays import Bins, Boxes
from fluid.mesh.background import bin_of
from kernels.decorators import inner, plain


def near_pairs(mesh, solids, chosen, margin) -> tuple[Array, Array]:
    """mesh: Background · solids: ConvexBodies · chosen (c,) bodies to search for · margin [m]
    -> cell (k,), body (k,), sorted by cell, then body."""
    chosen = np.asarray(chosen, dtype=np.int64)
    if len(chosen) == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    bounds = solids.bounds()[chosen]
    low = np.stack([bin_of(a, bounds[:, 0, k] - margin) for k, a in enumerate(mesh.axes)], axis=1)
    high = np.stack([bin_of(a, bounds[:, 1, k] + margin) for k, a in enumerate(mesh.axes)], axis=1)
    bins = Bins(mesh.bin_start, mesh.bin_cells, len(mesh.axes[1]) - 1, len(mesh.axes[2]) - 1)
    planes, reach = solids.planes(), Boxes(low, high)
    capacity = 256 * len(chosen) + 1024
    while True:
        cell, body = np.empty(capacity, dtype=np.int64), np.empty(capacity, dtype=np.int64)
        n = _search(mesh.nodes, mesh.cells, bins, chosen, reach, planes, margin, cell, body)
        if n <= capacity:
            break
        capacity = n
    key = np.sort(cell[:n] * len(solids) + body[:n])
    key = key[np.diff(key, prepend=-1) > 0]  # `np.unique`, which makes a table first, takes longer
    return key // len(solids), key % len(solids)


@inner
def _apart(nodes, cells, e, planes, first, last, margin):
    """Whether the cell lies wholly beyond one of the planes first:last."""
    for g in range(first, last):
        beyond = True
        for k in range(4):
            i = cells[e, k]
            n = planes.normal[g]
            d = n[0] * nodes[i, 0] + n[1] * nodes[i, 1] + n[2] * nodes[i, 2]
            if d - planes.offset[g] <= margin:
                beyond = False
                break
        if beyond:
            return True
    return False


@plain
def _search(nodes, cells, bins, chosen, reach, planes, margin, cell, body):
    """Write as many of the pairs as fit, and return how many there are. reach: bins of each of the chosen
    bodies."""
    n = 0
    for b in range(len(chosen)):
        first, last = planes.start[chosen[b]], planes.start[chosen[b] + 1]
        for i in range(reach.low[b, 0], reach.high[b, 0] + 1):
            for j in range(reach.low[b, 1], reach.high[b, 1] + 1):
                for k in range(reach.low[b, 2], reach.high[b, 2] + 1):
                    at = (i * bins.ny + j) * bins.nz + k
                    for s in range(bins.start[at], bins.start[at + 1]):
                        e = bins.cells[s]
                        if _apart(nodes, cells, e, planes, first, last, margin):
                            continue
                        if n < len(cell):
                            cell[n] = e
                            body[n] = chosen[b]
                        n += 1
    return n
