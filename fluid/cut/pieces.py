"""Convex pieces of a cell: polyhedra as faces of vertex numbers, split by planes.

Everything is in coordinates relative to the first node of the cell, and every vertex also carries its
barycentric coordinates in the cell. A plane is known by its distances at the four nodes: the distance at a
vertex is their interpolation. Nodes nearer to the plane than the tolerance of the mesh have distance zero,
the same in every cell at the node; so the faces of bodies bend by at most that tolerance, and two cells always agree on
the sides of a plane at their common face.

Moments of a piece: V = ∫ dV, c = ∫ x dV / V, S = ∫ (x - c)(x - c)^T dV as (xx, yy, zz, xy, xz, yz).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Integers, Ints
from kernels.decorators import inlined, inner

DONE, OUTPUT_FULL, WORKSPACE_FULL, BROKEN_CAP = 0, 1, 2, 3

# Distances at vertices made by splitting count as zero below this share of the spacing: round-off.
ROUND_OFF = 1e-13

# Nodes of the face opposite to node k, counter-clockwise from outside for a positive tetrahedron.
TET_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


class Workspace(NamedTuple):
    """Scratch for one cell: a pool of vertices, a stack of convex pieces, a stack of polygons."""

    x: Floats  # (vertices, 7) barycentric coordinates, then position relative to node 0 of the cell
    distance: Floats  # (vertices,) to the current plane, 0 where snapped
    cap: Integers  # (2, edges, 2) edges of the current cross-section, for the outer and the inner half
    edge: Integers  # (vertices, 2) the edge a new vertex lies on
    loop: Integers  # (pieces, faces, corners)
    size: Integers  # (pieces, faces) corners of each face
    tag: Ints  # (pieces, faces) -1..-4 face of the cell; 2g outside plane g; 2g + 1 inside it
    faces: Integers  # (pieces,)
    label: Integers  # (pieces,) part of each live piece
    beside: Floats  # (pieces, 3) mean normal of the faces of bodies that it lies on, by area; 0: none
    polygon: Floats  # (polygons, corners, 7)
    corners: Integers  # (polygons,)
    height: Floats  # (corners,) distances of a polygon to the current plane
    moments: Floats  # (10,) of the current piece
    near_body: Ints  # (bodies,) bodies that meet or touch the cell
    near_start: Ints  # (bodies + 1,)
    near_plane: Ints  # (planes,) their planes that pass through or touch the cell
    near_distance: Floats  # (planes, 4) distances of the nodes of the cell to them
    unclaimed: Floats  # (planes,) area [m²] of faces in them that no body claims, outside less inside


def workspace(scale: int, n_bodies: int, n_planes: int) -> Workspace:
    """Work space for cutting; `scale` is doubled until the most fragmented cell fits."""
    vertices, pieces, loops, corners, polygons = 1024 * scale, 96 * scale, 32 * scale, 32 * scale, 64 * scale
    return Workspace(
        x=np.empty((vertices, 7)),
        distance=np.zeros(vertices),
        cap=np.zeros((2, 4 * corners, 2), dtype=np.uint32),
        edge=np.zeros((vertices, 2), dtype=np.uint32),
        loop=np.zeros((pieces, loops, corners), dtype=np.uint32),
        size=np.zeros((pieces, loops), dtype=np.int32),
        tag=np.zeros((pieces, loops), dtype=np.int64),
        faces=np.zeros(pieces, dtype=np.int32),
        label=np.zeros(pieces, dtype=np.int32),
        beside=np.zeros((pieces, 3)),
        polygon=np.empty((polygons, 3 * corners, 7)),
        corners=np.zeros(polygons, dtype=np.int32),
        height=np.empty(3 * corners),
        moments=np.empty(10),
        near_body=np.zeros(n_bodies + 1, dtype=np.int64),
        near_start=np.zeros(n_bodies + 2, dtype=np.int64),
        near_plane=np.zeros(n_planes + 1, dtype=np.int64),
        near_distance=np.zeros((n_planes + 1, 4)),
        unclaimed=np.zeros(n_planes + 1),
    )


@inner
def start_piece(w, x):
    """The cell x (4, 3) itself as piece 0, positively oriented whatever the numbering of its nodes."""
    det = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        det += (x[1, i] - x[0, i]) * (
            (x[2, j] - x[0, j]) * (x[3, k] - x[0, k]) - (x[2, k] - x[0, k]) * (x[3, j] - x[0, j])
        )
    for k in range(4):
        for c in range(4):
            w.x[k, c] = 1.0 if c == k else 0.0
        for c in range(3):
            w.x[k, 4 + c] = x[k, c] - x[0, c]
    for f in range(4):
        for k in range(3):
            w.loop[0, f, k] = TET_FACES[f, k if det > 0 else 2 - k]
        w.size[0, f] = 3
        w.tag[0, f] = -1 - f
    w.faces[0] = 4


@inner
def interpolated(x, d):
    """Distance at a vertex from its barycentric coordinates and the distances of the nodes."""
    return x[0] * d[0] + x[1] * d[1] + x[2] * d[2] + x[3] * d[3]


@inlined
def classify(w, piece, d, round_off):
    """Fill w.distance for the vertices of a piece -> lowest, highest (0 where snapped)."""
    low, high = 0.0, 0.0
    for f in range(w.faces[piece]):
        for k in range(w.size[piece, f]):
            v = w.loop[piece, f, k]
            value = interpolated(w.x[v], d)
            if abs(value) <= round_off:
                value = 0.0
            low = min(low, value)
            high = max(high, value)
            w.distance[v] = value
    return low, high


@inlined
def lies_outside(w, piece, d, round_off):
    """Whether no vertex of a piece is inside the plane with the distances d (4,) at the nodes: whether `classify` would
    find 0 as the lowest."""
    for f in range(w.faces[piece]):
        for k in range(w.size[piece, f]):
            if interpolated(w.x[w.loop[piece, f, k]], d) < -round_off:
                return False
    return True


@inner
def _edge_vertex(w, a, b, first_new, n_vertices):
    """The vertex where edge ab crosses the plane: made once, shared by the two faces at the edge."""
    if a > b:
        a, b = b, a
    for v in range(first_new, n_vertices):
        if w.edge[v, 0] == a and w.edge[v, 1] == b:
            return v, n_vertices
    v = n_vertices
    t = w.distance[a] / (w.distance[a] - w.distance[b])
    for c in range(7):
        w.x[v, c] = w.x[a, c] + t * (w.x[b, c] - w.x[a, c])
    w.edge[v, 0] = a
    w.edge[v, 1] = b
    w.distance[v] = 0.0
    return v, n_vertices + 1


@inner
def _add_cap_edges(w, piece, f, side, count):
    """Edges of a face that lie in the plane, reversed, are edges of the cap -> their number.

    Where two faces meet in an edge of the plane its two directions cancel."""
    a = w.loop[piece, f, w.size[piece, f] - 1]
    for k in range(w.size[piece, f]):
        b = w.loop[piece, f, k]
        if w.distance[a] == 0.0 and w.distance[b] == 0.0:
            e = 0
            while e < count and not (w.cap[side, e, 0] == a and w.cap[side, e, 1] == b):
                e += 1
            if e < count:
                count -= 1
                w.cap[side, e, 0], w.cap[side, e, 1] = w.cap[side, count, 0], w.cap[side, count, 1]
            else:
                w.cap[side, e, 0], w.cap[side, e, 1] = b, a
                count += 1
        a = b
    return count


@inner
def _close_cap(w, piece, side, edges, tag):
    """Chain the edges of the cap into the last face of a piece -> state."""
    f = w.faces[piece]
    if edges > w.loop.shape[2]:
        return WORKSPACE_FULL
    if edges < 3:
        return BROKEN_CAP
    first = w.cap[side, 0, 0]
    v = first
    for k in range(edges):
        if k > 0 and v == first:
            return BROKEN_CAP
        w.loop[piece, f, k] = v
        e = 0
        while e < edges and w.cap[side, e, 0] != v:
            e += 1
        if e == edges:
            return BROKEN_CAP
        v = w.cap[side, e, 1]
    if v != first:
        return BROKEN_CAP
    w.size[piece, f] = edges
    w.tag[piece, f] = tag
    w.faces[piece] = f + 1
    return DONE


@inner
def _take_flat_faces(w, piece, target, side, edges):
    """Give the faces of a piece that lie wholly in the plane to one of its halves -> edges of the cap.

    The piece continues on both sides, so such a face has no area: it is the remainder of a point or an edge where three
    planes meet up to round-off. It may go to either half, but the cap of one of them may touch itself without it."""
    for f in range(w.faces[piece]):
        flat = True
        for k in range(w.size[piece, f]):
            flat = flat and w.distance[w.loop[piece, f, k]] == 0.0
        if not flat:
            continue
        row = w.faces[target]
        for k in range(w.size[piece, f]):
            w.loop[target, row, k] = w.loop[piece, f, k]
        w.size[target, row] = w.size[piece, f]
        w.tag[target, row] = w.tag[piece, f]
        w.faces[target] = row + 1
        edges = _add_cap_edges(w, target, row, side, edges)
    return edges


@inner
def _close_half(w, piece, target, side, edges, tag):
    """Close one half of a split piece by its cross-section -> state."""
    kept = w.faces[target]
    state = _close_cap(w, target, side, edges, tag)
    if state == BROKEN_CAP:
        edges = _take_flat_faces(w, piece, target, side, edges)
        if w.faces[target] > kept:
            state = _close_cap(w, target, side, edges, tag)
    return state


@inlined
def split(w, piece, outer, inner, plane, n_vertices):
    """Split a piece by the plane whose distances are in w.distance -> (state, number of vertices)."""
    capacity = w.loop.shape[2]
    if w.faces[piece] + 1 > w.loop.shape[1] or n_vertices + w.loop.shape[1] * 2 > len(w.x):
        return WORKSPACE_FULL, n_vertices
    first_new = n_vertices
    f_out, f_in, edges_out, edges_in = 0, 0, 0, 0
    for f in range(w.faces[piece]):
        corners = w.size[piece, f]
        if corners + 2 > capacity or max(edges_out, edges_in) + capacity > w.cap.shape[1]:
            return WORKSPACE_FULL, n_vertices
        n_out, n_in, outside, inside = 0, 0, False, False
        a = w.loop[piece, f, corners - 1]
        for k in range(corners):
            b = w.loop[piece, f, k]
            if w.distance[a] * w.distance[b] < 0.0:
                v, n_vertices = _edge_vertex(w, a, b, first_new, n_vertices)
                w.loop[outer, f_out, n_out] = v
                w.loop[inner, f_in, n_in] = v
                n_out += 1
                n_in += 1
            if w.distance[b] >= 0.0:
                w.loop[outer, f_out, n_out] = b
                n_out += 1
                outside = outside or w.distance[b] > 0.0
            if w.distance[b] <= 0.0:
                w.loop[inner, f_in, n_in] = b
                n_in += 1
                inside = inside or w.distance[b] < 0.0
            a = b
        if outside:
            w.size[outer, f_out] = n_out
            w.tag[outer, f_out] = w.tag[piece, f]
            edges_out = _add_cap_edges(w, outer, f_out, 0, edges_out)
            f_out += 1
        if inside:
            w.size[inner, f_in] = n_in
            w.tag[inner, f_in] = w.tag[piece, f]
            edges_in = _add_cap_edges(w, inner, f_in, 1, edges_in)
            f_in += 1
    w.faces[outer] = f_out
    w.faces[inner] = f_in
    state = _close_half(w, piece, outer, 0, edges_out, 2 * plane)
    if state == DONE:
        state = _close_half(w, piece, inner, 1, edges_in, 2 * plane + 1)
    return state, n_vertices


@inner
def copy_piece(w, source, target):
    """Copy piece `source` to slot `target` of the stack."""
    w.faces[target] = w.faces[source]
    for f in range(w.faces[source]):
        w.tag[target, f] = w.tag[source, f]
        w.size[target, f] = w.size[source, f]
        for k in range(w.size[source, f]):
            w.loop[target, f, k] = w.loop[source, f, k]


@inner
def has_vertex(w, piece, f, vertex):
    """Whether the vertex is a corner of face f of the piece."""
    found = False
    for k in range(w.size[piece, f]):
        found = found or w.loop[piece, f, k] == vertex
    return found


@inner
def piece_moments(w, piece, m):
    """m (10,) <- V, c, S of a convex piece: a fan of tetrahedra from one of its vertices, in coordinates
    relative to that vertex, so that slivers keep their relative accuracy."""
    o = w.loop[piece, 0, 0]
    ox, oy, oz = w.x[o, 4], w.x[o, 5], w.x[o, 6]
    for c in range(10):
        m[c] = 0.0
    for f in range(w.faces[piece]):
        if has_vertex(w, piece, f, o):
            continue
        a = w.loop[piece, f, 0]
        ax, ay, az = w.x[a, 4] - ox, w.x[a, 5] - oy, w.x[a, 6] - oz
        b = w.loop[piece, f, 1]
        bx, by, bz = w.x[b, 4] - ox, w.x[b, 5] - oy, w.x[b, 6] - oz
        for k in range(2, w.size[piece, f]):
            c = w.loop[piece, f, k]
            cx, cy, cz = w.x[c, 4] - ox, w.x[c, 5] - oy, w.x[c, 6] - oz
            v = (ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)) / 6.0
            sx, sy, sz = ax + bx + cx, ay + by + cy, az + bz + cz
            m[0] += v
            m[1] += v * sx / 4.0
            m[2] += v * sy / 4.0
            m[3] += v * sz / 4.0
            v /= 20.0
            m[4] += v * (ax * ax + bx * bx + cx * cx + sx * sx)
            m[5] += v * (ay * ay + by * by + cy * cy + sy * sy)
            m[6] += v * (az * az + bz * bz + cz * cz + sz * sz)
            m[7] += v * (ax * ay + bx * by + cx * cy + sx * sy)
            m[8] += v * (ax * az + bx * bz + cx * cz + sx * sz)
            m[9] += v * (ay * az + by * bz + cy * cz + sy * sz)
            bx, by, bz = cx, cy, cz
    if m[0] <= 0.0:
        m[0] = 0.0
        return
    gx, gy, gz = m[1] / m[0], m[2] / m[0], m[3] / m[0]
    m[4] -= m[0] * gx * gx
    m[5] -= m[0] * gy * gy
    m[6] -= m[0] * gz * gz
    m[7] -= m[0] * gx * gy
    m[8] -= m[0] * gx * gz
    m[9] -= m[0] * gy * gz
    m[1], m[2], m[3] = ox + gx, oy + gy, oz + gz


@inner
def merge_moments(total, m):
    """total <- moments of the union of two disjoint sets (parallel axis theorem)."""
    if m[0] <= 0.0:
        return
    if total[0] <= 0.0:
        for c in range(10):
            total[c] = m[c]
        return
    v = total[0] + m[0]
    reduced = total[0] * m[0] / v
    share = m[0] / v
    dx, dy, dz = m[1] - total[1], m[2] - total[2], m[3] - total[3]
    total[0] = v
    total[1] += share * dx
    total[2] += share * dy
    total[3] += share * dz
    total[4] += m[4] + reduced * dx * dx
    total[5] += m[5] + reduced * dy * dy
    total[6] += m[6] + reduced * dz * dz
    total[7] += m[7] + reduced * dx * dy
    total[8] += m[8] + reduced * dx * dz
    total[9] += m[9] + reduced * dy * dz
