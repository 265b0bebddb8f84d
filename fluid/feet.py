"""Where a path from a node ends on the virtual mesh, without crossing a wall.

A departure point x of the advection lies in some background cell, which may hold several elements, one on
each side of a thin wall. From a node copy, represented by the centroid c of its largest element, the
element with centroid e is within reach if no body near either cell blocks the straight way c-e, or c-x-e.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from fluid.covers import blocked


def reached_elements(domain, origin, points) -> np.ndarray:
    """Element in which a path from each origin ends, -1 where a wall or the end of the mesh is in the way.

    domain: PhysicalDomain · origin (m,) nodes of it · points (m, 3) [m] ends of the paths."""
    memory = domain.memory
    bodies, n_cells = memory.bodies, len(memory.mesh.cells)
    points = np.ascontiguousarray(points, dtype=np.float64)
    return _reached(
        _largest_elements(domain.cells, domain.volume, len(domain.nodes))[origin],
        points,
        memory.mesh.locate(points),
        domain.parent_cell,
        domain.centroid,
        _starts(domain.parent_cell, n_cells),
        _starts(memory.pair_cell, n_cells),
        memory.pair_body,
        bodies.normals,
        bodies.cut_offsets(),
        bodies.plane_start,
    )


def _starts(sorted_cell, n_cells):
    return np.concatenate([[0], np.cumsum(np.bincount(sorted_cell, minlength=n_cells))]).astype(np.int64)


@njit(cache=True)
def _largest_elements(cells, volume, n_nodes):
    """(n_nodes,) the element with the most water at each node."""
    largest = np.full(n_nodes, -1, dtype=np.int64)
    for e in range(len(cells)):
        for k in range(4):
            i = cells[e, k]
            if largest[i] < 0 or volume[e] > volume[largest[i]]:
                largest[i] = e
    return largest


@njit(cache=True)
def _open_way(a, b, one, two, pair_start, pair_body, normals, offsets, plane_start):
    """Is the segment a-b free of the bodies near the cells `one` and `two`?"""
    for cell in (one, two):
        for s in range(pair_start[cell], pair_start[cell + 1]):
            body = pair_body[s]
            if blocked(a, b, normals, offsets, plane_start[body], plane_start[body + 1]):
                return False
    return True


@njit(cache=True)
def _reached(
    home, points, cell, parent, centroid, start, pair_start, pair_body, normals, offsets, plane_start
):
    found = np.full(len(points), -1, dtype=np.int64)
    for m in range(len(points)):
        there = cell[m]
        if there < 0 or home[m] < 0:
            continue
        here, x = parent[home[m]], points[m]
        a = centroid[home[m]]
        nearest, straight = np.inf, -1
        for e in range(start[there], start[there + 1]):
            b = centroid[e]
            distance = (b[0] - x[0]) ** 2 + (b[1] - x[1]) ** 2 + (b[2] - x[2]) ** 2
            if distance >= nearest:
                continue
            free = _open_way(a, b, here, there, pair_start, pair_body, normals, offsets, plane_start)
            if not free:
                if straight < 0:
                    way = _open_way(a, x, here, there, pair_start, pair_body, normals, offsets, plane_start)
                    straight = 1 if way else 0
                free = straight == 1 and _open_way(
                    x, b, here, there, pair_start, pair_body, normals, offsets, plane_start
                )
            if free:
                nearest = distance
                found[m] = e
    return found
