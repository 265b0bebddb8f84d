"""Which part of a tetrahedron lies outside convex bodies: exact, for any number of bodies per cell.

Sequential convex splitting. The fluid in a cell is a list of convex pieces, at first the cell itself. For
each body B, each piece P is split by the planes of B one after the other: what lies outside a plane is set
aside, what lies inside goes on to the next plane. If nothing is left inside, P does not meet B and stays
whole; else P is replaced by what was set aside. The *wetted surface* is then read off the pieces: a face of
a piece that lies in a plane of B, with the piece on the outer side, clipped by the other planes of B. This
one rule serves faces made by splitting and faces of a body that coincide with faces of the mesh, so each is
counted once, in the cell on its water side, and never between two bodies that touch.

Two tolerances: mesh nodes nearer to a plane than `tolerance` [m], one for the whole mesh, lie in it; at
vertices made by splitting only round-off is snapped (see `pieces.py`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from fluid.jit import inner
from fluid.pieces import (
    BROKEN_CAP,
    DONE,
    OUTPUT_FULL,
    ROUND_OFF,
    WORKSPACE_FULL,
    classify,
    copy_piece,
    interpolated,
    merge_moments,
    piece_moments,
    split,
    start_piece,
    workspace,
)
from fluid.polygons import copy_polygon, load_face, polygon_rule, shared_area, split_polygon

# A piece too thin for its cross-section to close goes to one side whole; thicker ones are an error.
THIN = 1e-6
# Wetted polygons below this share of h^2 are round-off.
NO_AREA = 1e-15


class CutFailed(RuntimeError):
    """The cross-section of a piece could not be closed although the piece is not thin."""


class Output(NamedTuple):
    """What the kernel fills; rows beyond the returned counts are unused."""

    part_cell: np.ndarray  # (parts,) background cell
    part_whole: np.ndarray  # (parts,) True where nothing was removed from the cell
    part_moments: np.ndarray  # (parts, 10) V, c, S
    wet_part: np.ndarray  # (wetted polygons,) row of the part it bounds
    wet_body: np.ndarray  # (wetted polygons,)
    wet: np.ndarray  # (wetted triangles, 25) area, centroid, normal, three quadrature points, corners
    open_part: np.ndarray  # (open polygons,)  pieces' faces on faces of the cell
    open_face: np.ndarray  # (open polygons,)  0..3
    open_start: np.ndarray  # (open polygons + 1,)
    open_x: np.ndarray  # (corners, 3)


def output(parts: int, polygons: int, with_openings: bool) -> Output:
    """Room for that many parts and polygons."""
    openings = polygons * 4 if with_openings else 64
    return Output(
        np.zeros(parts, dtype=np.int64),
        np.zeros(parts, dtype=np.bool_),
        np.zeros((parts, 10)),
        np.zeros(polygons, dtype=np.int64),
        np.zeros(polygons, dtype=np.int64),
        np.zeros((polygons, 25)),
        np.zeros(openings, dtype=np.int64),
        np.zeros(openings, dtype=np.int64),
        np.zeros(openings + 1, dtype=np.int64),
        np.zeros((openings * 5, 3)),
    )


@inner
def _nearby(w, x, bodies, normals, offsets, plane_start, tolerance):
    """Bodies that meet or touch the cell x (4, 3), with the planes of each that separate some of its nodes.

    -> number of bodies, or -1 when one body holds the whole cell."""
    n = 0
    w.near_start[0] = 0
    for at in range(len(bodies)):
        body = bodies[at]
        end = w.near_start[n]
        apart = False
        for g in range(plane_start[body], plane_start[body + 1]):
            low, high = np.inf, -np.inf
            for k in range(4):
                d = normals[g, 0] * x[k, 0] + normals[g, 1] * x[k, 1] + normals[g, 2] * x[k, 2] - offsets[g]
                if abs(d) <= tolerance:
                    d = 0.0
                w.near_distance[end, k] = d
                low = min(low, d)
                high = max(high, d)
            if low > 0.0:
                apart = True
                break
            if high > 0.0:
                _align(w, end, tolerance)
                w.near_plane[end] = g
                end += 1
        if apart:
            continue
        if end == w.near_start[n]:
            return -1
        w.near_body[n] = body
        n += 1
        w.near_start[n] = end
    return n


@inner
def _align(w, row, tolerance):
    """Give a plane the distances of an earlier one (or their negatives) that it misses by the tolerance, so
    that touching and flush faces of two bodies are in one plane exactly and not up to their noise."""
    for r in range(row):
        for sign in (1.0, -1.0):
            same = True
            for k in range(4):
                if abs(w.near_distance[row, k] - sign * w.near_distance[r, k]) > tolerance:
                    same = False
                    break
            if same:
                for k in range(4):
                    w.near_distance[row, k] = sign * w.near_distance[r, k]
                return


@inner
def _subtract(w, piece, at, round_off, thin, top, n_vertices):
    """Take body number `at` of the cell away from a piece.

    Fragments are left on top of the stack -> (state, whole, new top, number of vertices)."""
    start, end = w.near_start[at], w.near_start[at + 1]
    for r in range(start, end):
        low, _ = classify(w, piece, w.near_distance[r], round_off)
        if low == 0.0:
            return DONE, True, top, n_vertices
    # Fragments stack up from `top`; what is still inside alternates between the last two slots.
    current, fresh, spare = piece, top, len(w.faces) - 1
    for r in range(start, end):
        low, high = classify(w, current, w.near_distance[r], round_off)
        if low == 0.0:
            return DONE, True, top, n_vertices
        if high == 0.0:
            continue
        if fresh + 3 > len(w.faces):
            return WORKSPACE_FULL, False, top, n_vertices
        state, n_vertices = split(w, current, fresh, spare, w.near_plane[r], n_vertices)
        if state == BROKEN_CAP and (min(high, -low) < thin or _is_thin(w, current, thin)):
            if high >= -low:
                return DONE, True, top, n_vertices
            continue
        if state != DONE:
            return state, False, top, n_vertices
        fresh += 1
        current = spare
        spare = 2 * len(w.faces) - 3 - spare
    return DONE, False, fresh, n_vertices


@inner
def _is_thin(w, piece, thin):
    """Is the volume of a piece below that of a layer `thin` over a tenth of the spacing squared?"""
    piece_moments(w, piece, w.moments)
    return w.moments[0] < thin * (thin / THIN) ** 2 * 0.01


@inner
def _fluid_pieces(w, n_near, round_off, thin):
    """Subtract all bodies near the cell -> (state, number of pieces, nothing removed)."""
    count, n_vertices, whole_cell = 1, 4, True
    for at in range(n_near):
        kept, top = 0, count
        for piece in range(count):
            state, whole, top_new, n_vertices = _subtract(w, piece, at, round_off, thin, top, n_vertices)
            if state != DONE:
                return state, 0, False
            if whole:
                if kept != piece:
                    copy_piece(w, piece, kept)
                kept += 1
            else:
                whole_cell = False
                top = top_new
        for piece in range(count, top):
            if kept != piece:
                copy_piece(w, piece, kept)
            kept += 1
        count = kept
    return DONE, count, whole_cell


@inner
def _lies_in(w, piece, f, r, normals, round_off):
    """Does a face lie in near plane r, with the piece on the outer side of it?"""
    g = w.near_plane[r]
    if w.tag[piece, f] == 2 * g:
        return True
    corners = w.size[piece, f]
    for k in range(corners):
        if abs(interpolated(w.x[w.loop[piece, f, k]], w.near_distance[r])) > round_off:
            return False
    o = w.loop[piece, f, 0]
    facing = 0.0
    for k in range(1, corners - 1):
        a, b = w.loop[piece, f, k], w.loop[piece, f, k + 1]
        ax, ay, az = w.x[a, 4] - w.x[o, 4], w.x[a, 5] - w.x[o, 5], w.x[a, 6] - w.x[o, 6]
        bx, by, bz = w.x[b, 4] - w.x[o, 4], w.x[b, 5] - w.x[o, 5], w.x[b, 6] - w.x[o, 6]
        facing += normals[g, 0] * (ay * bz - az * by)
        facing += normals[g, 1] * (az * bx - ax * bz) + normals[g, 2] * (ax * by - ay * bx)
    return facing < 0.0


@inner
def _claim(w, polygon, at, plane, round_off, top):
    """Clip a polygon in near plane `plane` by the other planes of body number `at` -> (claimed, new top).

    What is left replaces the polygon, the remainders go on top of the stack; if nothing is left the polygon
    stays as it was."""
    work, inner = len(w.corners) - 1, len(w.corners) - 2
    copy_polygon(w, polygon, work)
    new_top = top
    for r in range(w.near_start[at], w.near_start[at + 1]):
        if r == plane:
            continue
        for k in range(w.corners[work]):
            w.height[k] = interpolated(w.polygon[work, k], w.near_distance[r])
        outside, inside = split_polygon(w, work, new_top + 1, inner, round_off)
        if not inside:
            return False, top
        if outside:
            copy_polygon(w, inner, work)
            new_top += 1
    copy_polygon(w, work, polygon)
    return True, new_top


@inner
def _claim_face(w, at, r, origin, normals, round_off, least, top, part, out, n_wet):
    """Let one body claim its share of the polygons 0..top of a face -> (state, new top, polygons written)."""
    planes = w.near_start[at + 1] - w.near_start[at]
    g = w.near_plane[r]
    for polygon in range(top, -1, -1):
        if top + planes + 4 > len(w.corners) or w.corners[polygon] + planes + 2 > w.polygon.shape[1]:
            return WORKSPACE_FULL, top, n_wet
        claimed, top = _claim(w, polygon, at, r, round_off, top)
        if not claimed:
            continue
        state, n_wet = _append(w, polygon, at, g, origin, normals, least, part, out, n_wet)
        if state != DONE:
            return state, top, n_wet
        if polygon != top:
            copy_polygon(w, top, polygon)
        top -= 1
    return DONE, top, n_wet


@inner
def _append(w, polygon, at, g, origin, normals, least, part, out, n_wet):
    """Write a polygon in plane g of body number `at` as triangles -> (state, triangles written).

    Triangles, because the water surface may clip them later."""
    triangle = len(w.corners) - 1
    w.corners[triangle] = 3
    for second in range(1, w.corners[polygon] - 1):
        if n_wet >= len(out.wet_part):
            return OUTPUT_FULL, n_wet
        row = out.wet[n_wet]
        for k in range(3):
            corner = 0 if k == 0 else second + k - 1
            for c in range(7):
                w.polygon[triangle, k, c] = w.polygon[polygon, corner, c]
            for c in range(3):
                row[16 + 3 * k + c] = w.polygon[polygon, corner, 4 + c]
        polygon_rule(w, triangle, normals[g, 0], normals[g, 1], normals[g, 2], least, row)
        if row[0] > 0.0:
            for c in range(3):
                for q in (1, 7, 10, 13, 16, 19, 22):
                    row[q + c] += origin[c]
            out.wet_part[n_wet] = part
            out.wet_body[n_wet] = w.near_body[at]
            n_wet += 1
    return DONE, n_wet


@inner
def _wetted(w, piece, origin, n_near, normals, round_off, least, part, out, n_wet):
    """Append the wetted polygons of a piece -> (state, number of polygons).

    Polygons 0..top of the stack are the part of a face that no body has claimed yet; only bodies that
    overlap and share a plane compete for the same part."""
    for f in range(w.faces[piece]):
        top, loaded = 0, False
        for at in range(n_near):
            for r in range(w.near_start[at], w.near_start[at + 1]):
                if top < 0 or not _lies_in(w, piece, f, r, normals, round_off):
                    continue
                if not loaded:
                    load_face(w, piece, f, 0)
                    loaded = True
                state, top, n_wet = _claim_face(
                    w, at, r, origin, normals, round_off, least, top, part, out, n_wet
                )
                if state != DONE:
                    return state, n_wet
    return DONE, n_wet


@inner
def root(label, i):
    """Representative of item i in a union-find forest, with path halving."""
    while label[i] != i:
        label[i] = label[label[i]]
        i = label[i]
    return i


@inner
def _linked_area(w, one, two, normals, round_off):
    """Area over which two pieces touch: caps of one plane, one from each side."""
    area = 0.0
    for f in range(w.faces[one]):
        tag = w.tag[one, f]
        if tag < 0:
            continue
        for k in range(w.faces[two]):
            if w.tag[two, k] == (tag ^ 1):
                g = tag // 2
                load_face(w, one, f, 0)
                load_face(w, two, k, 1)
                area += shared_area(w, 0, 1, normals[g, 0], normals[g, 1], normals[g, 2], round_off)
    return area


@inner
def _reaches_faces(w, piece):
    """Does a piece have a face on a face of the cell?"""
    reaches = False
    for f in range(w.faces[piece]):
        reaches = reaches or w.tag[piece, f] < 0
    return reaches


@inner
def _label_parts(w, count, normals, round_off, link_area):
    """Number the connected parts of the fluid in w.label -> how many. link_area < 0: one part."""
    for piece in range(count):
        w.label[piece] = 0 if link_area < 0.0 else piece
    if link_area < 0.0:
        return 1
    for one in range(count):
        for two in range(one + 1, count):
            a, b = root(w.label, one), root(w.label, two)
            if a == b:
                continue
            # A piece away from the faces of the cell must belong to one that is not.
            limit = link_area if _reaches_faces(w, one) and _reaches_faces(w, two) else 0.0
            if _linked_area(w, one, two, normals, round_off) > limit:
                w.label[max(a, b)] = min(a, b)
    for piece in range(count):
        w.label[piece] = root(w.label, piece)
    parts = 0
    for piece in range(count):
        if w.label[piece] == piece:
            w.label[piece] = parts
            parts += 1
        else:
            # Roots come before their members, so theirs is already the final number.
            w.label[piece] = w.label[w.label[piece]]
    return parts


@inner
def _openings(w, piece, origin, part, out, n_open):
    """Append the faces of a piece that lie on faces of the cell -> (state, number of openings)."""
    for f in range(w.faces[piece]):
        if w.tag[piece, f] >= 0:
            continue
        start = out.open_start[n_open]
        if n_open + 1 >= len(out.open_part) or start + w.size[piece, f] > len(out.open_x):
            return OUTPUT_FULL, n_open
        out.open_part[n_open] = part
        out.open_face[n_open] = -1 - w.tag[piece, f]
        for k in range(w.size[piece, f]):
            v = w.loop[piece, f, k]
            for c in range(3):
                out.open_x[start + k, c] = origin[c] + w.x[v, 4 + c]
        n_open += 1
        out.open_start[n_open] = start + w.size[piece, f]
    return DONE, n_open


@inner
def _emit(
    w, cell, origin, count, n_near, whole, normals, round_off, least, link_area, out, n_part, n_wet, n_open
):
    """Write the parts of one cell, their moments and wetted polygons (and openings if link_area >= 0)."""
    parts = _label_parts(w, count, normals, round_off, link_area)
    if n_part + parts > len(out.part_cell):
        return OUTPUT_FULL, n_part, n_wet, n_open
    for part in range(n_part, n_part + parts):
        out.part_cell[part] = cell
        out.part_whole[part] = whole
        for c in range(10):
            out.part_moments[part, c] = 0.0
    for piece in range(count):
        part = n_part + w.label[piece]
        piece_moments(w, piece, w.moments)
        merge_moments(out.part_moments[part], w.moments)
        state, n_wet = _wetted(w, piece, origin, n_near, normals, round_off, least, part, out, n_wet)
        if state == DONE and link_area >= 0.0:
            state, n_open = _openings(w, piece, origin, part, out, n_open)
        if state != DONE:
            return state, n_part, n_wet, n_open
    for part in range(n_part, n_part + parts):
        for c in range(3):
            out.part_moments[part, 1 + c] += origin[c]
    return DONE, n_part + parts, n_wet, n_open


@njit(cache=True)
def _cut_cells(
    nodes, cells, chosen, body_start, bodies, normals, offsets, plane_start, tolerance, spacing, link_area,
    w, out, at,
):  # fmt: skip
    """Cut the cells `chosen` from at[0] on; at (4,) <- cells, parts, wetted polygons, openings done."""
    x = np.empty((4, 3))
    round_off, thin, least = ROUND_OFF * spacing, THIN * spacing, NO_AREA * spacing * spacing
    for row in range(at[0], len(chosen)):
        for k in range(4):
            for c in range(3):
                x[k, c] = nodes[cells[chosen[row], k], c]
        near = _nearby(
            w, x, bodies[body_start[row] : body_start[row + 1]], normals, offsets, plane_start, tolerance
        )
        if near >= 0:
            start_piece(w, x)
            state, count, whole = _fluid_pieces(w, near, round_off, thin)
            if state != DONE:
                return state
            if count > 0:
                state, n_part, n_wet, n_open = _emit(
                    w, chosen[row], x[0], count, near, whole, normals, round_off, least, link_area, out,
                    at[1], at[2], at[3],
                )  # fmt: skip
                if state != DONE:
                    return state
                at[1], at[2], at[3] = n_part, n_wet, n_open
        at[0] = row + 1
    return DONE


class Cuts(NamedTuple):
    """Fluid parts of the cells that were cut, in the order of the cells.

    part_cell (K,) · part_whole (K,) nothing removed · moments (K, 10) V [m3], c [m], S [m5]
    wet_part (S,) row of the part · wet_body (S,) · wet (S, 25) triangles: area [m2], centroid, normal, 3 points,
    3 corners
    open_part (O,), open_face (O,) 0..3 (opposite to node k), open_start (O+1,), open_x [m]: the faces of
    the parts on the faces of their cells (only with connected parts)."""

    part_cell: np.ndarray
    part_whole: np.ndarray
    moments: np.ndarray
    wet_part: np.ndarray
    wet_body: np.ndarray
    wet: np.ndarray
    open_part: np.ndarray
    open_face: np.ndarray
    open_start: np.ndarray
    open_x: np.ndarray

    def kept(self, keep) -> Cuts:
        """Only the parts keep (K,) bool, with their polygons."""
        row = np.cumsum(keep) - 1
        wet, openings = keep[self.wet_part], keep[self.open_part]
        length = np.diff(self.open_start)
        return Cuts(
            self.part_cell[keep],
            self.part_whole[keep],
            self.moments[keep],
            row[self.wet_part[wet]],
            self.wet_body[wet],
            self.wet[wet],
            row[self.open_part[openings]],
            self.open_face[openings],
            np.concatenate([[0], np.cumsum(length[openings])]).astype(np.int64),
            self.open_x[np.repeat(openings, length)],
        )


def cut_cells(nodes, cells, chosen, body_start, bodies, solids, tolerance, spacing, link_area=-1.0) -> Cuts:
    """Cut chosen cells by the bodies near each.

    nodes (N, 3) [m] · cells (M, 4) · chosen (C,) cells to cut · body_start (C+1,), bodies: those near each
    solids: ConvexBodies · tolerance [m] for nodes, spacing [m] of the mesh
    link_area [m2]: pieces of a cell are one part where they touch over more than this; < 0: all pieces of
    a cell are one part and no openings are listed.
    Raises CutFailed where the cross-section of a piece that is not thin cannot be closed."""
    at = np.zeros(4, dtype=np.int64)
    scale = 1
    most_bodies = int(np.diff(body_start).max()) if len(chosen) else 0
    most_planes = int(np.diff(solids.plane_start).max()) if len(solids) else 0
    w = workspace(scale, most_bodies, most_bodies * most_planes)
    out = output(len(chosen) * 2 + 64, len(chosen) * 8 + 256, link_area >= 0)
    offsets = solids.cut_offsets()
    while True:
        state = _cut_cells(
            nodes, cells, chosen, body_start, bodies, solids.normals, offsets, solids.plane_start,
            tolerance, spacing, link_area, w, out, at,
        )  # fmt: skip
        if state == DONE:
            return _with_volume(_trimmed(out, at))
        if state == BROKEN_CAP:
            raise CutFailed(_failure(cells, nodes, chosen, body_start, bodies, int(at[0])))
        if state == WORKSPACE_FULL:
            scale *= 2
            w = workspace(scale, most_bodies, most_bodies * most_planes)
        else:
            out = Output(*(_doubled(a) for a in out))


def _with_volume(cuts):
    """Without the parts whose volume is lost in round-off (their surface is of the same order)."""
    solid = cuts.moments[:, 0] > 0.0
    if solid.all():
        return cuts
    return cuts.kept(solid)


def _failure(cells, nodes, chosen, body_start, bodies, row):
    centre = nodes[cells[chosen[row]]].mean(axis=0)
    near = bodies[body_start[row] : body_start[row + 1]].tolist()
    return (
        f"cell {chosen[row]} at {np.round(centre, 6).tolist()} m could not be cut by bodies {near}: "
        "check that the polyhedra are convex and no smaller than a millionth of the cell"
    )


def _doubled(a):
    return np.concatenate([a, np.zeros_like(a)])


def _trimmed(out, at):
    parts, wet, openings = int(at[1]), int(at[2]), int(at[3])
    start = out.open_start[: openings + 1].copy()
    return Cuts(
        out.part_cell[:parts].copy(),
        out.part_whole[:parts].copy(),
        out.part_moments[:parts].copy(),
        out.wet_part[:wet].copy(),
        out.wet_body[:wet].copy(),
        out.wet[:wet].copy(),
        out.open_part[:openings].copy(),
        out.open_face[:openings].copy(),
        start,
        out.open_x[: start[-1]].copy(),
    )
