"""Connected parts of the water in a cell: pieces that touch across the planes they were split by."""

from __future__ import annotations

from fluid.cut.polygons import load_face, shared_area
from kernels.decorators import inner


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
    """Whether a piece has a face on a face of the cell."""
    reaches = False
    for f in range(w.faces[piece]):
        reaches = reaches or w.tag[piece, f] < 0
    return reaches


@inner
def label_parts(w, count, normals, round_off, link_area):
    """Number the connected parts of the fluid in w.label and return how many there are; with link_area < 0, one
    part."""
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
            # Roots come before their members, so a root already has its final number.
            w.label[piece] = w.label[w.label[piece]]
    return parts
