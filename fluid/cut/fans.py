"""The fluid part of a cut cell as tetrahedra, so that a surface linear in the cell can clip it exactly.

Every convex piece is a fan of tetrahedra from one of its vertices.  Their corners are kept as barycentric coordinates
in the cell: a field linear in the cell is known there without any geometry.
"""

from __future__ import annotations

import numpy as np

from fluid.cut.cut_arrays import Cuts
from fluid.cut.pieces import DONE, OUTPUT_FULL, has_vertex
from kernels.decorators import inner, kernel


@inner
def fan(w, piece, part, out, n):
    """Append the tetrahedra of a piece -> (state, number of tetrahedra).

    Volumes are computed from coordinates relative to the common vertex, so that slivers keep their relative
    accuracy."""
    o = w.loop[piece, 0, 0]
    ox, oy, oz = w.x[o, 4], w.x[o, 5], w.x[o, 6]
    for f in range(w.faces[piece]):
        if has_vertex(w, piece, f, o):
            continue
        a = w.loop[piece, f, 0]
        ax, ay, az = w.x[a, 4] - ox, w.x[a, 5] - oy, w.x[a, 6] - oz
        for k in range(2, w.size[piece, f]):
            b, c = w.loop[piece, f, k - 1], w.loop[piece, f, k]
            bx, by, bz = w.x[b, 4] - ox, w.x[b, 5] - oy, w.x[b, 6] - oz
            cx, cy, cz = w.x[c, 4] - ox, w.x[c, 5] - oy, w.x[c, 6] - oz
            v = (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6.0
            if v <= 0.0:
                continue
            if n >= len(out.tet_part):
                return OUTPUT_FULL, n
            out.tet_part[n] = part
            out.tet_volume[n] = v
            for j in range(4):
                out.tet_corners[n, j] = w.x[o, j]
                out.tet_corners[n, 4 + j] = w.x[a, j]
                out.tet_corners[n, 8 + j] = w.x[b, j]
                out.tet_corners[n, 12 + j] = w.x[c, j]
            n += 1
    return DONE, n


def fans(cuts: Cuts, element_of_part, n_elements: int):
    """The tetrahedra of cut parts in the order of their elements element_of_part (K,); -1: the part was dropped.

    -> start (n_elements + 1,), none in whole cells · volume (T,) [m³] · corners (T, 4, 4), the barycentric coordinates
    of the four corners in their cell. Where no part was dropped they are those of `cuts`, not copied, since parts and
    elements follow one another alike."""
    start, order, in_order = _sorted(element_of_part[cuts.tet_part], n_elements)
    volume, corners = cuts.tet_volume, cuts.tet_corners
    if not in_order:
        volume, corners = volume[order], corners[order]
    return start, volume, corners.reshape(-1, 4, 4)


def tetrahedra_of(start, elements):
    """The tetrahedra of elements (n,), where start (n_elements + 1,) is as of `fans`: place (T,) in `elements` of the
    one that each belongs to, and number (T,) of the tetrahedron."""
    count = start[elements + 1] - start[elements]
    which = np.repeat(np.arange(len(elements)), count)
    first = np.repeat(start[elements] - np.concatenate([[0], np.cumsum(count)[:-1]]), count)
    return which, first + np.arange(len(which))


@kernel
def _sorted(element, n_elements):
    """start (n_elements + 1,), the indices that sort the entries (T,) of `element`, without the negative ones, and
    whether these are all entries in their order."""
    start, last, in_order = np.zeros(n_elements + 1, np.int32), 0, True
    for t in range(len(element)):
        in_order = in_order and element[t] >= last
        last = element[t]
        if element[t] >= 0:
            start[element[t] + 1] += 1
    for e in range(n_elements):
        start[e + 1] += start[e]
    filled, order = start[:-1].copy(), np.empty(start[-1], np.int64)
    for t in range(len(element)):
        if element[t] >= 0:
            order[filled[element[t]]] = t
            filled[element[t]] += 1
    return start, order, in_order
