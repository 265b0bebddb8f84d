"""Arrays that the cut fills, and the filled parts of them that it returns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Bools, Floats, Ints


class Room(NamedTuple):
    """Rows for a number of cells, before there is more: twice what cells take where a broken building lies in them."""

    parts: int = 3
    polygons: int = 10
    openings: int = 14
    corners: int = 56
    tetrahedra: int = 18


ROOM = Room()
SPARE = 256
"""Rows beyond these, for single cells with many pieces."""


class Output(NamedTuple):
    """Arrays that the kernel fills; rows beyond the returned counts are unused."""

    part_cell: Ints  # (parts,) background cell
    part_whole: Bools  # (parts,) True where nothing was removed from the cell
    part_moments: Floats  # (parts, 10) V, c, S
    wet_part: Ints  # (wetted polygons,) row of the part it bounds
    wet_body: Ints  # (wetted polygons,)
    wet: Floats  # (wetted triangles, 25) area, centroid, normal, three quadrature points, corners
    open_part: Ints  # (open polygons,)  pieces' faces on faces of the cell
    open_face: Ints  # (open polygons,)  0..3
    open_start: Ints  # (open polygons + 1,)
    open_x: Floats  # (corners, 3)
    tet_part: Ints  # (tetrahedra,) row of the part that they fill
    tet_volume: Floats  # (tetrahedra,)
    tet_corners: Floats  # (tetrahedra, 16) barycentric coordinates of the four corners


def output(cells: int, with_openings: bool) -> Output:
    """Arrays, not filled, with room for what that many cells usually become; `doubled` where it is more."""
    parts, polygons, openings, corners, tetrahedra = (SPARE + rows * cells for rows in ROOM)
    if not with_openings:
        openings = corners = 1
    out = Output(
        part_cell=np.empty(parts, dtype=np.int64),
        part_whole=np.empty(parts, dtype=np.bool_),
        part_moments=np.empty((parts, 10)),
        wet_part=np.empty(polygons, dtype=np.int64),
        wet_body=np.empty(polygons, dtype=np.int64),
        wet=np.empty((polygons, 25)),
        open_part=np.empty(openings, dtype=np.int64),
        open_face=np.empty(openings, dtype=np.int64),
        open_start=np.empty(openings + 1, dtype=np.int64),
        open_x=np.empty((corners, 3)),
        tet_part=np.empty(tetrahedra, dtype=np.int64),
        tet_volume=np.empty(tetrahedra),
        tet_corners=np.empty((tetrahedra, 16)),
    )
    out.open_start[0] = 0
    return out


class Cuts(NamedTuple):
    """Fluid parts of the cells that were cut, in the order of the cells.

    part_cell (K,) · part_whole (K,) nothing removed · moments (K, 10) V [m3], c [m], S [m5]
    wet_part (S,) row of the part · wet_body (S,) · wet (S, 25) triangles: area [m2], centroid, normal, 3 points,
    3 corners
    open_part (O,), open_face (O,) 0..3 (opposite to node k), open_start (O+1,), open_x [m]: the faces of
    the parts on the faces of their cells (only with connected parts).
    tet_part (T,) row of the part · tet_volume (T,) [m3], tet_corners (T, 16): of the tetrahedra that fill it, the
    latter barycentric coordinates of the four corners in the cell (only of parts that are not whole cells)"""

    part_cell: Ints
    part_whole: Bools
    moments: Floats
    wet_part: Ints
    wet_body: Ints
    wet: Floats
    open_part: Ints
    open_face: Ints
    open_start: Ints
    open_x: Floats
    tet_part: Ints
    tet_volume: Floats
    tet_corners: Floats

    def kept(self, keep) -> Cuts:
        """Only the parts keep (K,) bool, with their polygons."""
        row = np.cumsum(keep) - 1
        wet, openings, filled = keep[self.wet_part], keep[self.open_part], keep[self.tet_part]
        length = np.diff(self.open_start)
        return Cuts(
            part_cell=self.part_cell[keep],
            part_whole=self.part_whole[keep],
            moments=self.moments[keep],
            wet_part=row[self.wet_part[wet]],
            wet_body=self.wet_body[wet],
            wet=self.wet[wet],
            open_part=row[self.open_part[openings]],
            open_face=self.open_face[openings],
            open_start=np.concatenate([[0], np.cumsum(length[openings])]).astype(np.int64),
            open_x=self.open_x[np.repeat(openings, length)],
            tet_part=row[self.tet_part[filled]],
            tet_volume=self.tet_volume[filled],
            tet_corners=self.tet_corners[filled],
        )


def behind(parts: list[Cuts]) -> Cuts:
    """One Cuts from those of consecutive ranges of cells."""
    if len(parts) == 1:
        return parts[0]
    rows = np.cumsum([0, *(len(cuts.part_cell) for cuts in parts)])
    corners = np.cumsum([0, *(len(cuts.open_x) for cuts in parts)])
    moved = [
        cuts._replace(
            wet_part=cuts.wet_part + row,
            open_part=cuts.open_part + row,
            open_start=cuts.open_start[min(1, k) :] + corner,
            tet_part=cuts.tet_part + row,
        )
        for k, (cuts, row, corner) in enumerate(zip(parts, rows, corners))
    ]
    return Cuts(*(np.concatenate(arrays) for arrays in zip(*moved)))


def doubled(out, at) -> Output:
    """Arrays of twice the length with the rows that were filled; at (5,) as in `trimmed`."""
    filled = _filled(out, at)
    grown = Output(*(np.empty((2 * len(a), *a.shape[1:]), a.dtype) for a in out))
    for new, old, count in zip(grown, out, filled):
        new[:count] = old[:count]
    return grown


def _filled(out, at) -> tuple[int, ...]:
    """Rows of each array of the output that were filled."""
    parts, wet, openings, tets = (int(n) for n in at[1:])
    corners = int(out.open_start[openings])
    return (*(parts,) * 3, *(wet,) * 3, *(openings,) * 2, openings + 1, corners, *(tets,) * 3)


def trimmed(out, at) -> Cuts:
    """Views of the rows that were filled; at (5,): cells, parts, wetted polygons, openings, tetrahedra."""
    return Cuts(*(array[:count] for array, count in zip(out, _filled(out, at))))
