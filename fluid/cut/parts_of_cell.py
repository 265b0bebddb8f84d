"""Connected parts of the water in a cell: pieces that touch across the planes they were split by.

A piece is one with what lies before it, over whatever area: bodies in a row whose sides are not quite flush leave
slivers between the side of one and the extended side of the next. As a part of its own, such a sliver would be a film a
thousandth of a cell thick and as long as the row, out of which moving bodies press water with any pressure.
"""

from __future__ import annotations

from fluid.cut.polygons import PLACE, load_face, shared_area
from kernels.decorators import inner

BEFORE = 0.5
"""Cosine of the angle to the normal of a surface within which a plane lies before it."""


@inner
def root(label, i):
    """Representative of item i in a union-find forest, with path halving."""
    while label[i] != i:
        label[i] = label[label[i]]
        i = label[i]
    return i


@inner
def _in_front(w, piece, f, normals):
    """Whether a face that a plane of a body cut into a piece lies before the surface that the piece lies on."""
    g, along = w.tag[piece, f] // 2, 0.0
    for k in range(3):
        along += w.beside[piece, k] * normals[g, k]
    return w.tag[piece, f] % 2 == 1 and along > BEFORE


@inner
def _linked(w, one, two, normals, round_off, enough, least):
    """Whether two pieces touch over more than an area, `enough`, or over more than `least` before the surface that one
    of them lies on: caps of one plane, one from each side."""
    area = 0.0
    for f in range(w.faces[one]):
        tag = w.tag[one, f]
        if tag < 0:
            continue
        for k in range(w.faces[two]):
            if w.tag[two, k] == (tag ^ 1):
                g = tag // 2
                load_face(w, one, f, 0, PLACE)
                load_face(w, two, k, 1, PLACE)
                shared = shared_area(w, 0, 1, normals[g, 0], normals[g, 1], normals[g, 2], round_off)
                if shared > least and (_in_front(w, one, f, normals) or _in_front(w, two, k, normals)):
                    return True
                area += shared
    return area > enough


@inner
def _reaches_faces(w, piece):
    """Whether a piece has a face on a face of the cell."""
    reaches = False
    for f in range(w.faces[piece]):
        reaches = reaches or w.tag[piece, f] < 0
    return reaches


@inner
def label_parts(w, count, normals, round_off, link_area, least):
    """Number the connected parts of the fluid in w.label and return how many there are; with link_area < 0, one
    part. Over areas up to least [m²] pieces touch by round-off only. w.beside is read."""
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
            if _linked(w, one, two, normals, round_off, limit, least):
                w.label[max(a, b)] = min(a, b)
    for piece in range(count):
        w.label[piece] = root(w.label, piece)
    parts = 0
    for piece in range(count):
        if w.label[piece] == piece:
            w.label[piece] = parts
            parts += 1
        else:
            # Roots come before their members, so a root already has its final number.
            w.label[piece] = w.label[w.label[piece]]
    return parts
