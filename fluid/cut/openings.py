"""Over which area cut parts of neighbouring cells touch: the geometry behind the multiple covers.

The fluid parts of two cells touch across their common face where their open polygons overlap. A contact depends on
the two cells only, so those of cells that were not cut again are kept from one cut to the next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluid.cut.pieces import workspace
from fluid.cut.polygons import shared_area
from fluid.numerics.threads import over
from kernel_decorators import inner, kernel, released

CLIP = 1e-12
"""Tolerance for clipping the open polygons, as a share of h."""
WORK = 20
"""The contacts of a cell take as long as so many visits of a node."""


class Contacts(NamedTuple):
    """Contacts across faces with a cut part on one side or both, in the order in which the elements of the lower
    cells, their faces, and the elements beyond follow each other.

    cell (L,) the lower of the two cells · area (L,) [m2] shared, a lower bound where that exceeds the share `enough`
    of the face · full (L,) [m2] area of the face."""

    cell: np.ndarray
    area: np.ndarray
    full: np.ndarray


def find_contacts(
    mesh, part, start, cuts, enough: float, old: Contacts | None = None, again=None
) -> Contacts:
    """Contacts of all cells, or with `old` only of cells near those cut `again` (cells,) bool; the others are kept.

    part (M,) row in `cuts` of each element, -1 whole · start (cells + 1,) first element of each cell · enough: share of
    a face from which a lower bound of the area will do."""
    near = _with_parts(part, start) if again is None else again
    searched = _beside(mesh.neighbours, near)
    order, open_start = _openings_by_face(cuts.open_part, cuts.open_face, len(cuts.part_cell))
    state = (mesh, part, start, order, open_start, cuts, enough)
    found = over(_in_range, len(searched), searched, *state, weight=WORK)
    fresh = found[0] if len(found) == 1 else Contacts(*(np.concatenate(arrays) for arrays in zip(*found)))
    return fresh if again is None or old is None else _merged(old, searched, fresh)


def _in_range(first, last, searched, mesh, part, start, order, open_start, cuts, enough) -> Contacts:
    """Contacts of the searched cells from `first` to before `last`."""
    chosen = searched[first:last]
    count = _count(chosen, mesh.neighbours, part, start)
    fresh = Contacts(np.empty(count, np.int64), np.empty(count), np.empty(count))
    _find(
        chosen, mesh.nodes, mesh.cells, mesh.neighbours, part, start, order, open_start, cuts.open_start,
        cuts.open_x, CLIP * mesh.spacing, enough, workspace(1, 0, 0), *fresh,
    )  # fmt: skip
    return fresh


def _merged(old: Contacts, searched, fresh: Contacts) -> Contacts:
    """Contacts of `old` whose cells were not searched again, with the fresh ones, in the order of the cells."""
    there = np.zeros(max(old.cell.max(initial=-1), searched.max(initial=-1)) + 1, bool)
    there[searched] = True
    keep = ~there[old.cell]
    joined = [np.concatenate([a[keep], b]) for a, b in zip(old, fresh)]
    order = np.argsort(joined[0], kind="stable")
    return Contacts(*(a[order] for a in joined))


@kernel
def _with_parts(part, start):
    """(cells,) bool: some element of the cell is a cut part."""
    found = np.zeros(len(start) - 1, np.bool_)
    for cell in range(len(found)):
        for e in range(start[cell], start[cell + 1]):
            found[cell] |= part[e] >= 0
    return found


@kernel
def _beside(neighbours, near):
    """Cells (n,) that are `near`, or the lower neighbour of one that is: the lower side of every contact of these."""
    found = np.empty(len(near), np.int64)
    n = 0
    for one in range(len(near)):
        chosen = near[one]
        for f in range(4):
            two = neighbours[one, f]
            chosen |= two > one and near[two]
        if chosen:
            found[n] = one
            n += 1
    return found[:n].copy()


@kernel
def _openings_by_face(open_part, open_face, n_parts):
    """Rows of the openings sorted by (part, face), and where each (part, face) starts."""
    start = np.zeros(4 * n_parts + 1, np.int64)
    for s in range(len(open_part)):
        start[4 * open_part[s] + open_face[s] + 1] += 1
    for k in range(4 * n_parts):
        start[k + 1] += start[k]
    filled, order = start[:-1].copy(), np.empty(len(open_part), np.int64)
    for s in range(len(open_part)):
        key = 4 * open_part[s] + open_face[s]
        order[filled[key]] = s
        filled[key] += 1
    return order, start


@released
def _count(searched, neighbours, part, start):
    n = 0
    for one in searched:
        for e in range(start[one], start[one + 1]):
            for f in range(4):
                two = neighbours[one, f]
                if two < one:
                    continue
                for other in range(start[two], start[two + 1]):
                    n += part[e] >= 0 or part[other] >= 0
    return n


@released
def _find(
    searched, nodes, cells, neighbours, part, start, order, open_start, polygon_start, polygon_x, tolerance,
    enough, w, cell, area, full,
):  # fmt: skip
    n = 0
    for one in searched:
        for e in range(start[one], start[one + 1]):
            for f in range(4):
                two = neighbours[one, f]
                if two < one:
                    continue
                g = 0
                while neighbours[two, g] != one:
                    g += 1
                for other in range(start[two], start[two + 1]):
                    if part[e] < 0 and part[other] < 0:
                        continue
                    cell[n] = one
                    area[n], full[n] = _contact_area(
                        nodes, cells, one, f, part[e], g, part[other], order, open_start, polygon_start,
                        polygon_x, tolerance, enough, w,
                    )  # fmt: skip
                    n += 1


@inner
def _load_opening(w, slot, row, polygon_start, polygon_x):
    first = polygon_start[row]
    w.corners[slot] = polygon_start[row + 1] - first
    for k in range(w.corners[slot]):
        for c in range(3):
            w.polygon[slot, k, 4 + c] = polygon_x[first + k, c]


@inner
def _open_area(key, order, open_start, polygon_start, x):
    """Area [m2] of the openings of a part in a face, key = 4 part + face."""
    area = 0.0
    for s in range(open_start[key], open_start[key + 1]):
        o = polygon_start[order[s]]
        sx, sy, sz = 0.0, 0.0, 0.0
        ax, ay, az = x[o + 1, 0] - x[o, 0], x[o + 1, 1] - x[o, 1], x[o + 1, 2] - x[o, 2]
        for k in range(o + 2, polygon_start[order[s] + 1]):
            bx, by, bz = x[k, 0] - x[o, 0], x[k, 1] - x[o, 1], x[k, 2] - x[o, 2]
            sx += ay * bz - az * by
            sy += az * bx - ax * bz
            sz += ax * by - ay * bx
            ax, ay, az = bx, by, bz
        area += np.sqrt(sx * sx + sy * sy + sz * sz) / 2.0
    return area


@inner
def _contact_area(
    nodes, cells, cell, f, part, g, other, order, open_start, polygon_start, polygon_x, tolerance, enough, w
):
    """Area over which two parts touch across the face opposite to corner f of `cell`, area of the face.

    Part -1 is a whole cell; at most one of the two is. A lower bound of the area serves where it exceeds
    the share `enough` of the face."""
    i, j, k = cells[cell, (f + 1) % 4], cells[cell, (f + 2) % 4], cells[cell, (f + 3) % 4]
    ax, ay, az = nodes[j, 0] - nodes[i, 0], nodes[j, 1] - nodes[i, 1], nodes[j, 2] - nodes[i, 2]
    bx, by, bz = nodes[k, 0] - nodes[i, 0], nodes[k, 1] - nodes[i, 1], nodes[k, 2] - nodes[i, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = np.sqrt(nx * nx + ny * ny + nz * nz)
    full = twice / 2
    if other < 0:
        return _open_area(4 * part + f, order, open_start, polygon_start, polygon_x), full
    theirs = _open_area(4 * other + g, order, open_start, polygon_start, polygon_x)
    if part < 0:
        return theirs, full
    ours = _open_area(4 * part + f, order, open_start, polygon_start, polygon_x)
    if min(ours, theirs) == 0.0 or max(ours, theirs) >= full * (1 - 1e-12):
        return min(ours, theirs), full
    # Both sides are partly closed, not necessarily in the same place; they share at least this much.
    if ours + theirs > (1 + enough) * full:
        return ours + theirs - full, full
    nx, ny, nz = nx / twice, ny / twice, nz / twice
    area = 0.0
    for s in range(open_start[4 * part + f], open_start[4 * part + f + 1]):
        for t in range(open_start[4 * other + g], open_start[4 * other + g + 1]):
            _load_opening(w, 0, order[s], polygon_start, polygon_x)
            _load_opening(w, 1, order[t], polygon_start, polygon_x)
            area += shared_area(w, 0, 1, nx, ny, nz, tolerance)
            if area > enough * full:
                return area, full
    return area, full
