"""The wetted surface of a piece: its faces that lie in a plane of a body, and the part of each that belongs to that
body.

A face of a piece that lies in a plane of a body, with the piece on the outer side, is clipped by the other planes of
the body. Polygons 0..top of the stack are the parts that no body has claimed yet; those of faces made by splitting lie
between two pieces, and cancel over the pieces of a cell (else see `unclaimed_faces.py`).
"""

from __future__ import annotations

from fluid.cut.pieces import DONE, OUTPUT_FULL, WORKSPACE_FULL, interpolated
from fluid.cut.polygons import (
    across,
    copy_polygon,
    face_area,
    load_face,
    polygon_area,
    split_polygon,
    triangle_rule,
)
from kernels.decorators import inlined


@inlined
def _lies_in(w, piece, f, r, normals, round_off):
    """Whether a face whose first corner lies in near plane r lies in it with all corners, the piece on the outer side
    of it."""
    g = w.near_plane[r]
    corners = w.size[piece, f]
    for k in range(1, corners):
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


@inlined
def _claim(w, polygon, at, plane, round_off, top):
    """Clip a polygon in near plane `plane` by the other planes of body number `at` -> (claimed, new top).

    The part inside replaces the polygon and the remainders go on top of the stack; if no part is inside, the polygon
    stays unchanged."""
    work, inner = len(w.corners) - 1, len(w.corners) - 2
    rest, new_top = polygon, top
    for r in range(w.near_start[at], w.near_start[at + 1]):
        if r == plane:
            continue
        for k in range(w.corners[rest]):
            w.height[k] = interpolated(w.polygon[rest, k], w.near_distance[r])
        outside, inside = split_polygon(w, rest, new_top + 1, inner, round_off, 0)
        if not inside:
            return False, top
        if outside:
            copy_polygon(w, inner, work, 0)
            rest = work
            new_top += 1
    if rest == work:
        copy_polygon(w, work, polygon, 0)
    return True, new_top


@inlined
def _claim_face(cut, at, r, origin, top, part, n_wet):
    """Let one body claim its share of the polygons 0..top of a face -> (state, new top, polygons written)."""
    w = cut.work
    planes = w.near_start[at + 1] - w.near_start[at]
    g = w.near_plane[r]
    for polygon in range(top, -1, -1):
        if top + planes + 4 > len(w.corners) or w.corners[polygon] + planes + 2 > w.polygon.shape[1]:
            return WORKSPACE_FULL, top, n_wet
        claimed, top = _claim(w, polygon, at, r, cut.limits.round_off, top)
        if not claimed:
            continue
        n = cut.planes.normal[g]
        state, n_wet = append_polygon(cut, polygon, at, (n[0], n[1], n[2]), origin, part, n_wet)
        if state != DONE:
            return state, top, n_wet
        if polygon != top:
            copy_polygon(w, top, polygon, 0)
        top -= 1
    return DONE, top, n_wet


@inlined
def append_polygon(cut, polygon, at, n, origin, part, n_wet):
    """Write a polygon of normal n (3,), a surface of body number `at`, as triangles -> (state, triangles written).

    Triangles, because the water surface may clip them later."""
    w, out = cut.work, cut.out
    corners, plane = w.polygon[polygon], across(n[0], n[1], n[2])
    for second in range(2, w.corners[polygon]):
        if n_wet >= len(out.wet_part):
            return OUTPUT_FULL, n_wet
        row = out.wet[n_wet]
        triangle_rule(corners, second - 1, second, n, plane, cut.limits.least, row)
        if row[0] > 0.0:
            for c in range(3):
                row[16 + c] = corners[0, 4 + c]
                row[19 + c] = corners[second - 1, 4 + c]
                row[22 + c] = corners[second, 4 + c]
                for q in (1, 7, 10, 13, 16, 19, 22):
                    row[q + c] += origin[c]
            out.wet_part[n_wet] = part
            out.wet_body[n_wet] = w.near_body[at]
            n_wet += 1
    return DONE, n_wet


@inlined
def claim_face(cut, piece, f, n_near, origin, part, n_wet):
    """Let the bodies claim their shares of a face of a piece -> (state, loaded, top, number of polygons written).

    If loaded, polygons 0..top of the stack are left, else the whole face is; only bodies that overlap and share a plane
    compete for the same part."""
    w, normals, round_off = cut.work, cut.planes.normal, cut.limits.round_off
    top, loaded = 0, False
    own, first = w.tag[piece, f], w.x[w.loop[piece, f, 0]]
    for at in range(n_near):
        for r in range(w.near_start[at], w.near_start[at + 1]):
            if own != 2 * w.near_plane[r] and (
                abs(interpolated(first, w.near_distance[r])) > round_off
                or not _lies_in(w, piece, f, r, normals, round_off)
            ):
                continue
            if top < 0:
                continue
            if not loaded:
                load_face(w, piece, f, 0, 0)
                loaded = True
            state, top, n_wet = _claim_face(cut, at, r, origin, top, part, n_wet)
            if state != DONE:
                return state, loaded, top, n_wet
    return DONE, loaded, top, n_wet


@inlined
def wetted(cut, piece, origin, n_near, part, n_wet):
    """Append the wetted polygons of a piece -> (state, number of polygons), and add up in w.unclaimed what is left of
    its faces in the near planes, outside less inside [m²]."""
    w = cut.work
    for f in range(w.faces[piece]):
        state, loaded, top, n_wet = claim_face(cut, piece, f, n_near, origin, part, n_wet)
        if state != DONE:
            return state, n_wet
        tag = w.tag[piece, f]
        if tag >= 0 and top >= 0:
            r = 0
            while w.near_plane[r] != tag // 2:
                r += 1
            area = 0.0 if loaded else face_area(w, piece, f)
            if loaded:
                for polygon in range(top + 1):
                    area += polygon_area(w, polygon)
            w.unclaimed[r] += area if tag % 2 == 0 else -area
    return DONE, n_wet
