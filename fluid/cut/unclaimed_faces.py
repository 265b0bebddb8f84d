"""Faces of pieces beside a void that no body claims.

A face made by splitting lies either beside a body, which claims it, or between two pieces, so that what is left in a
plane of the faces outside it cancels what is left of those inside. Where planes of two bodies cross at a small angle,
their line is known to round-off over that angle only, and the pieces on its two sides find it at different places: the
face between lies beside what was taken from the other piece, yet outside the body whose plane made it. It is a surface
of the body that is nearest.
"""

from __future__ import annotations

import numpy as np

from fluid.cut.pieces import DONE, WORKSPACE_FULL, interpolated
from fluid.cut.polygons import copy_polygon, load_face, polygon_area, sense, split_by_edge
from fluid.cut.wetted_polygons import append_polygon, claim_face
from kernels.decorators import inner


@inner
def _without_face(w, polygon, top, face, normal, round_off):
    """Take the polygon in slot `face` off one of the stack -> new top; uses the slot before `face`."""
    for k in range(w.corners[face]):
        outside, inside = split_by_edge(w, polygon, face, k, normal, top + 1, face - 1, round_off, 0)
        if not inside:
            return top
        if outside:
            copy_polygon(w, face - 1, polygon, 0)
            top += 1
    if polygon != top:
        copy_polygon(w, top, polygon, 0)
    return top - 1


@inner
def _beside_void(cut, tag, count, top):
    """Take what lies beside another piece off the polygons 0..top in a plane -> (state, new top).

    tag: of the faces that they are parts of; pieces 0..count - 1 are those of the cell."""
    w, normal, g = cut.work, cut.planes.normal, tag // 2
    face = len(w.corners) - 1
    for piece in range(count):
        for f in range(w.faces[piece]):
            if w.tag[piece, f] != (tag ^ 1):
                continue
            load_face(w, piece, f, face, 0)
            about = sense(w, face, normal[g, 0], normal[g, 1], normal[g, 2])
            for polygon in range(top, -1, -1):
                corners = w.corners[face] + w.corners[polygon]
                if top + w.corners[face] + 4 > len(w.corners) or corners + 2 > w.polygon.shape[1]:
                    return WORKSPACE_FULL, top
                top = _without_face(w, polygon, top, face, about, cut.limits.round_off)
    return DONE, top


@inner
def _nearest(w, polygon, n_near):
    """The body, by its number in the cell, whose surface is nearest to the middle of a polygon."""
    body, least = 0, np.inf
    for at in range(n_near):
        highest = -np.inf
        for r in range(w.near_start[at], w.near_start[at + 1]):
            height = 0.0
            for k in range(w.corners[polygon]):
                height += interpolated(w.polygon[polygon, k], w.near_distance[r]) / w.corners[polygon]
            highest = max(highest, height)
        if abs(highest) < least:
            body, least = at, abs(highest)
    return body


@inner
def claim_rest(cut, count, n_near, n_part, origin, n_wet):
    """Append, as surfaces of the nearest bodies, faces beside a void in planes where those of the pieces
    0..count - 1 do not cancel (w.unclaimed) -> (state, number of polygons)."""
    w, limits = cut.work, cut.limits
    for r in range(w.near_start[n_near]):
        if abs(w.unclaimed[r]) <= limits.unmatched:
            continue
        inside = w.unclaimed[r] < 0.0
        tag = 2 * w.near_plane[r] + (1 if inside else 0)
        way, n = -1.0 if inside else 1.0, cut.planes.normal[w.near_plane[r]]
        normal = (way * n[0], way * n[1], way * n[2])
        for piece in range(count):
            for f in range(w.faces[piece]):
                if w.tag[piece, f] != tag:
                    continue
                # What bodies claim is written behind the last polygon and written over.
                state, loaded, top, _ = claim_face(cut, piece, f, n_near, origin, 0, n_wet)
                if not loaded:
                    load_face(w, piece, f, 0, 0)
                if state == DONE:
                    state, top = _beside_void(cut, tag, count, top)
                for polygon in range(top + 1):
                    if state == DONE and polygon_area(w, polygon) > limits.least:
                        at, part = _nearest(w, polygon, n_near), n_part + w.label[piece]
                        state, n_wet = append_polygon(cut, polygon, at, normal, origin, part, n_wet)
                if state != DONE:
                    return state, n_wet
    return DONE, n_wet
