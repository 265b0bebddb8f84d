"""Areas over which cut parts of neighbouring cells are in contact: the geometry of the multiple covers.

The fluid parts of two cells touch across their common face where their open polygons overlap. A contact depends on the
two cells only, so contacts between cells that were not cut again are kept from one cut to the next.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Ints
from fluid.cut.cut_arrays import Cuts
from fluid.cut.pieces import workspace
from fluid.cut.polygons import shared_area
from fluid.mesh.arrays import Corners
from kernels.decorators import inlined, inner, kernel, released
from kernels.threads import over

CLIP = 1e-12
"""Tolerance for clipping the open polygons, as a share of h."""
WORK = 20
"""Cost of the contacts of a cell, in visits of a node."""


class Contacts(NamedTuple):
    """Contacts across faces with a cut part on one side or both, in the order in which the elements of the lower
    cells, their faces, and the elements beyond follow each other.

    cell (L,) the lower of the two cells · area (L,) [m2] shared, a lower bound where that exceeds the share `enough`
    of the face · full (L,) [m2] area of the face."""

    cell: Ints
    area: Floats
    full: Floats


class PartsOfCells(NamedTuple):
    """Elements in the order of their cells: part (M,) row among the cut parts, -1 whole · start (cells + 1,) first
    element of each cell."""

    part: Ints
    start: Ints


class OpenFaces(NamedTuple):
    """Open polygons of cut parts by the face they lie in: polygon order[s], s from start[4 part + face], has the
    corners x (k, 3) [m] from polygon_start[polygon]."""

    order: Ints
    start: Ints
    polygon_start: Ints
    x: Floats

    @classmethod
    def of(cls, cuts: Cuts) -> OpenFaces:
        """The open faces of parts that were cut."""
        order, start = _openings_by_face(cuts.open_part, cuts.open_face, len(cuts.part_cell))
        return cls(order, start, cuts.open_start, cuts.open_x)


def find_contacts(
    mesh, part, start, cuts, enough: float, old: Contacts | None = None, again=None
) -> Contacts:
    """Contacts of all cells, or with `old` only of cells near those cut `again` (cells,) bool; the others are kept.

    part (M,) row in `cuts` of each element, -1 whole · start (cells + 1,) first element of each cell · enough: share of
    a face above which a lower bound of the area suffices."""
    near = _with_parts(part, start) if again is None else again
    searched = _beside(mesh.neighbours, near)
    elements, openings = PartsOfCells(part, start), OpenFaces.of(cuts)
    found = over(_in_range, len(searched), searched, mesh, elements, openings, enough, weight=WORK)
    fresh = found[0] if len(found) == 1 else Contacts(*(np.concatenate(arrays) for arrays in zip(*found)))
    return fresh if again is None or old is None else _merged(old, searched, fresh)


def _in_range(first, last, searched, mesh, elements, openings, enough) -> Contacts:
    """Contacts of the searched cells from `first` to before `last`."""
    chosen = searched[first:last]
    count = _count(chosen, mesh.neighbours, elements)
    fresh = Contacts(np.empty(count, np.int64), np.empty(count), np.empty(count))
    corners, limits = Corners(mesh.nodes, mesh.cells), (CLIP * mesh.spacing, enough)
    _find(chosen, corners, mesh.neighbours, elements, openings, limits, workspace(1, 0, 0), fresh)
    return fresh


def _merged(old: Contacts, searched, fresh: Contacts) -> Contacts:
    """Contacts of `old` whose cells were not searched again, with the fresh ones, in the order of the cells."""
    there = np.zeros(max(old.cell.max(initial=-1), searched.max(initial=-1)) + 1, bool)
    there[searched] = True
    keep = ~there[old.cell]
    if not keep.any():
        return fresh
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
def _count(searched, neighbours, elements):
    part, start = elements
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
def _find(searched, mesh, neighbours, elements, openings, limits, w, found):
    """Fill the contacts `found`; limits: tolerance [m] of the clipping, share of a face that is enough."""
    part, start = elements
    cell, area, full = found
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
                    ours = 4 * part[e] + f if part[e] >= 0 else -1
                    theirs = 4 * part[other] + g if part[other] >= 0 else -1
                    area[n], full[n] = _contact_area(mesh, one, f, ours, theirs, openings, limits, w)
                    n += 1


@inner
def _load_opening(w, slot, row, openings):
    first = openings.polygon_start[row]
    w.corners[slot] = openings.polygon_start[row + 1] - first
    for k in range(w.corners[slot]):
        for c in range(3):
            w.polygon[slot, k, 4 + c] = openings.x[first + k, c]


@inner
def _open_area(key, openings):
    """Area [m2] of the openings of a part in a face, key = 4 part + face."""
    order, start, polygon_start, x = openings
    area = 0.0
    for s in range(start[key], start[key + 1]):
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


@inlined
def _contact_area(mesh, cell, f, ours, theirs, openings, limits, w):
    """Area over which two parts touch across the face opposite to corner f of `cell`, area of the face.

    ours, theirs: 4 part + face of the two, -1 for a whole cell, which at most one of them is. A lower bound of the area
    suffices where it exceeds the share `enough` of the face."""
    nodes, cells = mesh
    tolerance, enough = limits
    i, j, k = cells[cell, (f + 1) % 4], cells[cell, (f + 2) % 4], cells[cell, (f + 3) % 4]
    ax, ay, az = nodes[j, 0] - nodes[i, 0], nodes[j, 1] - nodes[i, 1], nodes[j, 2] - nodes[i, 2]
    bx, by, bz = nodes[k, 0] - nodes[i, 0], nodes[k, 1] - nodes[i, 1], nodes[k, 2] - nodes[i, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = np.sqrt(nx * nx + ny * ny + nz * nz)
    full = twice / 2
    if theirs < 0:
        return _open_area(ours, openings), full
    open_there = _open_area(theirs, openings)
    if ours < 0:
        return open_there, full
    open_here = _open_area(ours, openings)
    if min(open_here, open_there) == 0.0 or max(open_here, open_there) >= full * (1 - 1e-12):
        return min(open_here, open_there), full
    # Both sides are partly closed, not necessarily in the same place; they share at least this much.
    if open_here + open_there > (1 + enough) * full:
        return open_here + open_there - full, full
    nx, ny, nz = nx / twice, ny / twice, nz / twice
    area = 0.0
    for s in range(openings.start[ours], openings.start[ours + 1]):
        for t in range(openings.start[theirs], openings.start[theirs + 1]):
            _load_opening(w, 0, openings.order[s], openings)
            _load_opening(w, 1, openings.order[t], openings)
            area += shared_area(w, 0, 1, nx, ny, nz, tolerance)
            if area > enough * full:
                return area, full
    return area, full
