"""Which tetrahedra share a face."""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import inner, kernel


def cell_neighbours(cells, n_nodes: int) -> Array:
    """neighbours (M, 4) of cells (M, 4): the cell across the face opposite to each corner, -1 = none. A face that more
    than two cells share leads from the last to the one before, and from each other to the next."""
    return _cell_neighbours(np.ascontiguousarray(cells, np.uint32), n_nodes)


@kernel
def _cell_neighbours(cells, n_nodes):
    """Faces by their lowest node, in the order of the cells, and among these the last one before with equal nodes."""
    start = np.zeros(n_nodes + 1, np.uint32)
    for e in range(cells.shape[0]):
        for a in range(4):
            start[_face(cells, e, a)[0] + 1] += 1
    for i in range(n_nodes):
        start[i + 1] += start[i]
    end, faces = start[:-1].copy(), np.empty(4 * cells.shape[0], np.uint32)
    found = np.full(cells.shape, -1, np.int32)
    for e in range(cells.shape[0]):
        for a in range(4):
            low, middle, high = _face(cells, e, a)
            s = end[low]
            faces[s] = 4 * e + a
            end[low] += 1
            while s > start[low]:
                s -= 1
                other, b = faces[s] // 4, faces[s] % 4
                _, m, h = _face(cells, other, b)
                if m == middle and h == high:
                    found[e, a] = other
                    if found[other, b] < 0:
                        found[other, b] = e
                    break
    return found


@inner
def _face(cells, e, a):
    """The three nodes of cell e other than its corner a, the lowest first."""
    i, j, k = cells[e, (a + 1) % 4], cells[e, (a + 2) % 4], cells[e, (a + 3) % 4]
    low, high = min(i, min(j, k)), max(i, max(j, k))
    return low, i + j + k - low - high, high
