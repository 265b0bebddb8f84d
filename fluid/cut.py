"""Which part of a tetrahedron lies outside convex bodies: exact, for any number of bodies per cell.

Sequential convex splitting. The fluid in a cell is a list of convex pieces, at first the cell itself. For
each body B, each piece P is split by the planes of B one after the other: what lies outside a plane is set
aside, what lies inside goes on to the next plane. If nothing is left inside, P does not meet B and stays
whole; else P is replaced by what was set aside. The *wetted surface* is then read off the pieces: a face of
a piece that lies in a plane of B, with the piece on the outer side, clipped by the other planes of B. This
one rule serves faces made by splitting and faces of a body that coincide with faces of the mesh, so each is
counted once, in the cell on its water side, and never between two bodies that touch.

Vertices closer to a plane than one absolute `tolerance` for the whole mesh [m] count as lying in it. A
vertex has one distance per plane, shared by the pieces and faces that meet there.

Moments of a piece: V = ∫ dV, c = ∫ x dV / V, S = ∫ (x - c)(x - c)^T dV as (xx, yy, zz, xy, xz, yz).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

DONE, OUTPUT_FULL, WORKSPACE_FULL, BROKEN_CAP = 0, 1, 2, 3

# Third of the three corners of an equilateral triangle with unit second moment about its centre.
SQRT2 = np.sqrt(2.0)
TRIANGLE = np.array([[SQRT2, 0.0], [-SQRT2 / 2, np.sqrt(1.5)], [-SQRT2 / 2, -np.sqrt(1.5)]])

# Nodes of the face opposite to node k, counter-clockwise from outside for a positive tetrahedron.
TET_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


class CutFailed(RuntimeError):
    """The cross-section of a piece could not be closed: the geometry is finer than the tolerance."""


class Workspace(NamedTuple):
    """Scratch for one cell: a pool of vertices and a stack of convex pieces (faces as vertex loops)."""

    x: np.ndarray  # (vertices, 3)
    distance: np.ndarray  # (vertices,) to the plane in hand, 0 where snapped
    following: np.ndarray  # (vertices,) next vertex of the cap in hand
    edge: np.ndarray  # (vertices, 2) the edge a new vertex lies on
    loop: np.ndarray  # (pieces, faces, corners)
    size: np.ndarray  # (pieces, faces) corners of each face
    tag: np.ndarray  # (pieces, faces) -1..-4 face of the cell; 2g outside plane g; 2g + 1 inside it
    faces: np.ndarray  # (pieces,)
    label: np.ndarray  # (pieces,) part of each live piece
    polygon: np.ndarray  # (polygons, corners, 3)
    corners: np.ndarray  # (polygons,)
    height: np.ndarray  # (corners,)
    near_body: np.ndarray  # (bodies,) bodies that meet or touch the cell
    near_start: np.ndarray  # (bodies + 1,)
    near_plane: np.ndarray  # (planes,) their planes that pass through or touch the cell


def workspace(scale: int, n_bodies: int, n_planes: int) -> Workspace:
    """Scratch arrays; `scale` doubles until the most fragmented cell fits."""
    vertices, pieces, loops, corners, polygons = 1024 * scale, 96 * scale, 32 * scale, 32 * scale, 64 * scale
    return Workspace(
        np.empty((vertices, 3)),
        np.zeros(vertices),
        np.zeros(vertices, dtype=np.int32),
        np.zeros((vertices, 2), dtype=np.int32),
        np.zeros((pieces, loops, corners), dtype=np.int32),
        np.zeros((pieces, loops), dtype=np.int32),
        np.zeros((pieces, loops), dtype=np.int64),
        np.zeros(pieces, dtype=np.int32),
        np.zeros(pieces, dtype=np.int32),
        np.empty((polygons, 3 * corners, 3)),
        np.zeros(polygons, dtype=np.int32),
        np.empty(3 * corners),
        np.zeros(n_bodies + 1, dtype=np.int64),
        np.zeros(n_bodies + 2, dtype=np.int64),
        np.zeros(n_planes + 1, dtype=np.int64),
    )


class Output(NamedTuple):
    """What the kernel fills; rows beyond the returned counts are unused."""

    part_cell: np.ndarray  # (parts,) background cell
    part_whole: np.ndarray  # (parts,) True where nothing was removed from the cell
    part_moments: np.ndarray  # (parts, 10) V, c, S
    wet_part: np.ndarray  # (wetted polygons,) row of the part it bounds
    wet_body: np.ndarray  # (wetted polygons,)
    wet: np.ndarray  # (wetted polygons, 16) area, centroid, normal, three quadrature points
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
        np.zeros((polygons, 16)),
        np.zeros(openings, dtype=np.int64),
        np.zeros(openings, dtype=np.int64),
        np.zeros(openings + 1, dtype=np.int64),
        np.zeros((openings * 5, 3)),
    )


@njit(cache=True)
def _classify(w, piece, nx, ny, nz, offset, tolerance):
    """Distances of the vertices of a piece to a plane -> (some vertex outside, some vertex inside)."""
    outside, inside = False, False
    for f in range(w.faces[piece]):
        for k in range(w.size[piece, f]):
            v = w.loop[piece, f, k]
            d = nx * w.x[v, 0] + ny * w.x[v, 1] + nz * w.x[v, 2] - offset
            if d > tolerance:
                outside = True
            elif d < -tolerance:
                inside = True
            else:
                d = 0.0
            w.distance[v] = d
    return outside, inside


@njit(cache=True)
def _edge_vertex(w, a, b, first_new, n_vertices):
    """The vertex where edge ab crosses the plane: made once, shared by the two faces at the edge."""
    if a > b:
        a, b = b, a
    for v in range(first_new, n_vertices):
        if w.edge[v, 0] == a and w.edge[v, 1] == b:
            return v, n_vertices
    v = n_vertices
    t = w.distance[a] / (w.distance[a] - w.distance[b])
    for c in range(3):
        w.x[v, c] = w.x[a, c] + t * (w.x[b, c] - w.x[a, c])
    w.edge[v, 0] = a
    w.edge[v, 1] = b
    w.distance[v] = 0.0
    return v, n_vertices + 1


@njit(cache=True)
def _close_caps(w, outer, inner, first, edges, plane):
    """Close both halves of a split piece by the polygon of its cross-section."""
    f_out, f_in = w.faces[outer], w.faces[inner]
    v = first
    for k in range(edges):
        if k > 0 and v == first:
            return BROKEN_CAP
        w.loop[inner, f_in, k] = v
        w.loop[outer, f_out, edges - 1 - k] = v
        v = w.following[v]
    if v != first or edges < 3:
        return BROKEN_CAP
    w.size[inner, f_in] = edges
    w.size[outer, f_out] = edges
    w.tag[inner, f_in] = 2 * plane + 1
    w.tag[outer, f_out] = 2 * plane
    w.faces[inner] += 1
    w.faces[outer] += 1
    return DONE


@njit(cache=True)
def _split(w, piece, outer, inner, plane, n_vertices):
    """Split a piece by the plane whose distances are in w.distance -> (state, number of vertices)."""
    capacity = w.loop.shape[2]
    if w.faces[piece] + 1 > w.loop.shape[1] or n_vertices + w.loop.shape[1] * 2 > len(w.x):
        return WORKSPACE_FULL, n_vertices
    first_new = n_vertices
    f_out, f_in, edges, first = 0, 0, 0, -1
    for f in range(w.faces[piece]):
        corners = w.size[piece, f]
        if corners + 2 > capacity:
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
            f_out += 1
        if inside:
            a = w.loop[inner, f_in, n_in - 1]
            for k in range(n_in):
                b = w.loop[inner, f_in, k]
                if w.distance[a] == 0.0 and w.distance[b] == 0.0:
                    w.following[b] = a
                    first = b
                    edges += 1
                a = b
            w.size[inner, f_in] = n_in
            w.tag[inner, f_in] = w.tag[piece, f]
            f_in += 1
    w.faces[outer] = f_out
    w.faces[inner] = f_in
    if edges > capacity or f_out + 1 > w.loop.shape[1] or f_in + 1 > w.loop.shape[1]:
        return WORKSPACE_FULL, n_vertices
    return _close_caps(w, outer, inner, first, edges, plane), n_vertices


@njit(cache=True)
def _copy_piece(w, source, target):
    w.faces[target] = w.faces[source]
    for f in range(w.faces[source]):
        w.tag[target, f] = w.tag[source, f]
        w.size[target, f] = w.size[source, f]
        for k in range(w.size[source, f]):
            w.loop[target, f, k] = w.loop[source, f, k]


@njit(cache=True)
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
                low = min(low, d)
                high = max(high, d)
            if low > tolerance:
                apart = True
                break
            if high > tolerance:
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


@njit(cache=True)
def _subtract(w, piece, at, normals, offsets, tolerance, top, n_vertices):
    """Take body number `at` of the cell away from a piece.

    Fragments are left on top of the stack -> (state, whole, new top, number of vertices)."""
    start, end = w.near_start[at], w.near_start[at + 1]
    for r in range(start, end):
        g = w.near_plane[r]
        _, inside = _classify(w, piece, normals[g, 0], normals[g, 1], normals[g, 2], offsets[g], tolerance)
        if not inside:
            return DONE, True, top, n_vertices
    # Fragments stack up from `top`; what is still inside alternates between the last two slots.
    current, fresh, spare = piece, top, len(w.faces) - 1
    for r in range(start, end):
        g = w.near_plane[r]
        outside, inside = _classify(
            w, current, normals[g, 0], normals[g, 1], normals[g, 2], offsets[g], tolerance
        )
        if not inside:
            return DONE, True, top, n_vertices
        if not outside:
            continue
        if fresh + 3 > len(w.faces):
            return WORKSPACE_FULL, False, top, n_vertices
        state, n_vertices = _split(w, current, fresh, spare, g, n_vertices)
        if state != DONE:
            return state, False, top, n_vertices
        fresh += 1
        current = spare
        spare = 2 * len(w.faces) - 3 - spare
    return DONE, False, fresh, n_vertices


@njit(cache=True)
def _start_piece(w, x):
    """The cell itself as piece 0, positive orientation whatever the numbering of its nodes."""
    det = 0.0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        det += (x[1, i] - x[0, i]) * (
            (x[2, j] - x[0, j]) * (x[3, k] - x[0, k]) - (x[2, k] - x[0, k]) * (x[3, j] - x[0, j])
        )
    for k in range(4):
        for c in range(3):
            w.x[k, c] = x[k, c]
    for f in range(4):
        for k in range(3):
            w.loop[0, f, k] = TET_FACES[f, k if det > 0 else 2 - k]
        w.size[0, f] = 3
        w.tag[0, f] = -1 - f
    w.faces[0] = 4


@njit(cache=True)
def _fluid_pieces(w, n_near, normals, offsets, tolerance):
    """Subtract all bodies near the cell -> (state, number of pieces, nothing removed)."""
    count, n_vertices, whole_cell = 1, 4, True
    for at in range(n_near):
        kept, top = 0, count
        for piece in range(count):
            state, whole, top_new, n_vertices = _subtract(
                w, piece, at, normals, offsets, tolerance, top, n_vertices
            )
            if state != DONE:
                return state, 0, False
            if whole:
                if kept != piece:
                    _copy_piece(w, piece, kept)
                kept += 1
            else:
                whole_cell = False
                top = top_new
        for piece in range(count, top):
            if kept != piece:
                _copy_piece(w, piece, kept)
            kept += 1
        count = kept
    return DONE, count, whole_cell


@njit(cache=True)
def _piece_moments(w, piece, m):
    """m (10,) <- V, c, S of a convex piece: a fan of tetrahedra from one of its vertices, in coordinates
    relative to that vertex, so that slivers keep their relative accuracy."""
    o = w.loop[piece, 0, 0]
    ox, oy, oz = w.x[o, 0], w.x[o, 1], w.x[o, 2]
    m[:] = 0.0
    for f in range(w.faces[piece]):
        touches = False
        for k in range(w.size[piece, f]):
            touches = touches or w.loop[piece, f, k] == o
        if touches:
            continue
        a = w.loop[piece, f, 0]
        ax, ay, az = w.x[a, 0] - ox, w.x[a, 1] - oy, w.x[a, 2] - oz
        b = w.loop[piece, f, 1]
        bx, by, bz = w.x[b, 0] - ox, w.x[b, 1] - oy, w.x[b, 2] - oz
        for k in range(2, w.size[piece, f]):
            c = w.loop[piece, f, k]
            cx, cy, cz = w.x[c, 0] - ox, w.x[c, 1] - oy, w.x[c, 2] - oz
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
        m[:] = 0.0
        m[1], m[2], m[3] = ox, oy, oz
        return
    gx, gy, gz = m[1] / m[0], m[2] / m[0], m[3] / m[0]
    m[4] -= m[0] * gx * gx
    m[5] -= m[0] * gy * gy
    m[6] -= m[0] * gz * gz
    m[7] -= m[0] * gx * gy
    m[8] -= m[0] * gx * gz
    m[9] -= m[0] * gy * gz
    m[1], m[2], m[3] = ox + gx, oy + gy, oz + gz


@njit(cache=True)
def _merge_moments(total, m):
    """total <- moments of the union of two disjoint sets (parallel axis theorem)."""
    if m[0] <= 0.0:
        return
    if total[0] <= 0.0:
        total[:] = m
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


@njit(cache=True)
def _load_face(w, piece, f, polygon):
    """Copy a face of a piece to a polygon slot."""
    for k in range(w.size[piece, f]):
        v = w.loop[piece, f, k]
        for c in range(3):
            w.polygon[polygon, k, c] = w.x[v, c]
    w.corners[polygon] = w.size[piece, f]


@njit(cache=True)
def _split_polygon(w, polygon, outer, inner, nx, ny, nz, offset, tolerance):
    """Split a convex polygon by a plane -> (something outside, something inside)."""
    corners = w.corners[polygon]
    outside, inside = False, False
    for k in range(corners):
        p = w.polygon[polygon, k]
        d = nx * p[0] + ny * p[1] + nz * p[2] - offset
        if d > tolerance:
            outside = True
        elif d < -tolerance:
            inside = True
        else:
            d = 0.0
        w.height[k] = d
    if not (outside and inside):
        return outside, inside or not outside
    n_out, n_in, a = 0, 0, corners - 1
    for b in range(corners):
        if w.height[a] * w.height[b] < 0.0:
            t = w.height[a] / (w.height[a] - w.height[b])
            for c in range(3):
                x = w.polygon[polygon, a, c] + t * (w.polygon[polygon, b, c] - w.polygon[polygon, a, c])
                w.polygon[outer, n_out, c] = x
                w.polygon[inner, n_in, c] = x
            n_out += 1
            n_in += 1
        if w.height[b] >= 0.0:
            for c in range(3):
                w.polygon[outer, n_out, c] = w.polygon[polygon, b, c]
            n_out += 1
        if w.height[b] <= 0.0:
            for c in range(3):
                w.polygon[inner, n_in, c] = w.polygon[polygon, b, c]
            n_in += 1
        a = b
    w.corners[outer] = n_out
    w.corners[inner] = n_in
    return True, True


@njit(cache=True)
def _copy_polygon(w, source, target):
    w.corners[target] = w.corners[source]
    for k in range(w.corners[source]):
        for c in range(3):
            w.polygon[target, k, c] = w.polygon[source, k, c]


@njit(cache=True)
def _polygon_rule(w, polygon, nx, ny, nz, row):
    """row (16,) <- area, centroid, normal and three points, weight area / 3, exact to degree 2.

    Points c + R s_q, R the symmetric root of the in-plane covariance, s_q the corners of an equilateral
    triangle with unit covariance. The area is taken along the normal given; <= 0 where there is none."""
    x0, y0, z0 = w.polygon[polygon, 0, 0], w.polygon[polygon, 0, 1], w.polygon[polygon, 0, 2]
    # Any two directions in the plane: the rule does not depend on them but for a turn of the points.
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        tx, ty, tz = 0.0, nz, -ny
    elif abs(ny) <= abs(nz):
        tx, ty, tz = -nz, 0.0, nx
    else:
        tx, ty, tz = ny, -nx, 0.0
    length = np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / length, ty / length, tz / length
    rx, ry, rz = ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx
    area, fs, ft, ss, tt, st = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    a_s, a_t = 0.0, 0.0
    for k in range(1, w.corners[polygon]):
        dx, dy, dz = (
            w.polygon[polygon, k, 0] - x0,
            w.polygon[polygon, k, 1] - y0,
            w.polygon[polygon, k, 2] - z0,
        )
        b_s = dx * tx + dy * ty + dz * tz
        b_t = dx * rx + dy * ry + dz * rz
        if k > 1:
            half = (a_s * b_t - a_t * b_s) / 2.0
            s, t = a_s + b_s, a_t + b_t
            area += half
            fs += half * s / 3.0
            ft += half * t / 3.0
            ss += half * (a_s * a_s + b_s * b_s + s * s) / 12.0
            tt += half * (a_t * a_t + b_t * b_t + t * t) / 12.0
            st += half * (a_s * a_t + b_s * b_t + s * t) / 12.0
        a_s, a_t = b_s, b_t
    if area == 0.0:
        row[0] = 0.0
        return
    fs, ft = fs / area, ft / area
    ss = max(ss / area - fs * fs, 0.0)
    tt = max(tt / area - ft * ft, 0.0)
    st = st / area - fs * ft
    root = np.sqrt(max(ss * tt - st * st, 0.0))
    trace = np.sqrt(max(ss + tt + 2.0 * root, 1e-300))
    row[0] = abs(area)
    row[1] = x0 + fs * tx + ft * rx
    row[2] = y0 + fs * ty + ft * ry
    row[3] = z0 + fs * tz + ft * rz
    row[4], row[5], row[6] = nx, ny, nz
    for q in range(3):
        s = ((ss + root) * TRIANGLE[q, 0] + st * TRIANGLE[q, 1]) / trace
        t = (st * TRIANGLE[q, 0] + (tt + root) * TRIANGLE[q, 1]) / trace
        row[7 + 3 * q] = row[1] + s * tx + t * rx
        row[8 + 3 * q] = row[2] + s * ty + t * ry
        row[9 + 3 * q] = row[3] + s * tz + t * rz


@njit(cache=True)
def _lies_in(w, piece, f, nx, ny, nz, offset, tolerance):
    """Does a face lie in a plane, with the piece on the outer side of it?"""
    corners = w.size[piece, f]
    for k in range(corners):
        v = w.loop[piece, f, k]
        if abs(nx * w.x[v, 0] + ny * w.x[v, 1] + nz * w.x[v, 2] - offset) > tolerance:
            return False
    o = w.loop[piece, f, 0]
    facing = 0.0
    for k in range(1, corners - 1):
        a, b = w.loop[piece, f, k], w.loop[piece, f, k + 1]
        ax, ay, az = w.x[a, 0] - w.x[o, 0], w.x[a, 1] - w.x[o, 1], w.x[a, 2] - w.x[o, 2]
        bx, by, bz = w.x[b, 0] - w.x[o, 0], w.x[b, 1] - w.x[o, 1], w.x[b, 2] - w.x[o, 2]
        facing += nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx)
    return facing < 0.0


@njit(cache=True)
def _claim(w, polygon, at, plane, normals, offsets, tolerance, top):
    """Clip a polygon in `plane` by the other planes of body number `at` -> (something left, new top).

    What is left replaces the polygon, the remainders go on top of the stack; if nothing is left the polygon
    stays as it was."""
    work, inner = len(w.corners) - 1, len(w.corners) - 2
    _copy_polygon(w, polygon, work)
    new_top = top
    for r in range(w.near_start[at], w.near_start[at + 1]):
        g = w.near_plane[r]
        if g == plane:
            continue
        outside, inside = _split_polygon(
            w, work, new_top + 1, inner, normals[g, 0], normals[g, 1], normals[g, 2], offsets[g], tolerance
        )
        if not inside:
            return False, top
        if outside:
            _copy_polygon(w, inner, work)
            new_top += 1
    _copy_polygon(w, work, polygon)
    return True, new_top


@njit(cache=True)
def _claim_face(w, at, plane, normals, offsets, tolerance, top, part, out, n_wet):
    """Let one body claim its share of the polygons 0..top of a face -> (state, new top, polygons written)."""
    planes = w.near_start[at + 1] - w.near_start[at]
    for polygon in range(top, -1, -1):
        if top + planes + 4 > len(w.corners) or w.corners[polygon] + planes + 2 > w.polygon.shape[1]:
            return WORKSPACE_FULL, top, n_wet
        claimed, top = _claim(w, polygon, at, plane, normals, offsets, tolerance, top)
        if not claimed:
            continue
        if n_wet >= len(out.wet_part):
            return OUTPUT_FULL, top, n_wet
        _polygon_rule(w, polygon, normals[plane, 0], normals[plane, 1], normals[plane, 2], out.wet[n_wet])
        if out.wet[n_wet, 0] > 0.0:
            out.wet_part[n_wet] = part
            out.wet_body[n_wet] = w.near_body[at]
            n_wet += 1
        if polygon != top:
            _copy_polygon(w, top, polygon)
        top -= 1
    return DONE, top, n_wet


@njit(cache=True)
def _wetted(w, piece, n_near, normals, offsets, tolerance, part, out, n_wet):
    """Append the wetted polygons of a piece -> (state, number of polygons).

    Polygons 0..top of the stack are the part of a face that no body has claimed yet; only bodies that
    overlap and share a plane compete for the same part."""
    for f in range(w.faces[piece]):
        top, loaded = 0, False
        for at in range(n_near):
            for r in range(w.near_start[at], w.near_start[at + 1]):
                g = w.near_plane[r]
                if top < 0 or not _lies_in(
                    w, piece, f, normals[g, 0], normals[g, 1], normals[g, 2], offsets[g], tolerance
                ):
                    continue
                if not loaded:
                    _load_face(w, piece, f, 0)
                    loaded = True
                state, top, n_wet = _claim_face(w, at, g, normals, offsets, tolerance, top, part, out, n_wet)
                if state != DONE:
                    return state, n_wet
    return DONE, n_wet


@njit(cache=True)
def _polygon_area(w, polygon):
    sx, sy, sz = 0.0, 0.0, 0.0
    o = w.polygon[polygon, 0]
    for k in range(1, w.corners[polygon] - 1):
        a, b = w.polygon[polygon, k], w.polygon[polygon, k + 1]
        ax, ay, az = a[0] - o[0], a[1] - o[1], a[2] - o[2]
        bx, by, bz = b[0] - o[0], b[1] - o[1], b[2] - o[2]
        sx += ay * bz - az * by
        sy += az * bx - ax * bz
        sz += ax * by - ay * bx
    return np.sqrt(sx * sx + sy * sy + sz * sz) / 2.0


@njit(cache=True)
def _shared_area(w, one, two, nx, ny, nz, tolerance):
    """Area common to the coplanar convex polygons in slots `one` and `two` (normal n)."""
    corners = w.corners[two]
    # Orientation of `two` about n.
    o = w.polygon[two, 0]
    turn = 0.0
    for k in range(1, corners - 1):
        a, b = w.polygon[two, k], w.polygon[two, k + 1]
        ax, ay, az = a[0] - o[0], a[1] - o[1], a[2] - o[2]
        bx, by, bz = b[0] - o[0], b[1] - o[1], b[2] - o[2]
        turn += nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx)
    way = 1.0 if turn > 0.0 else -1.0
    spare = max(one, two) + 1
    for k in range(corners):
        a, b = w.polygon[two, k], w.polygon[two, (k + 1) % corners]
        ex, ey, ez = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        mx, my, mz = way * (ey * nz - ez * ny), way * (ez * nx - ex * nz), way * (ex * ny - ey * nx)
        length = np.sqrt(mx * mx + my * my + mz * mz)
        if length <= tolerance:
            continue
        mx, my, mz = mx / length, my / length, mz / length
        outside, inside = _split_polygon(
            w, one, spare, spare + 1, mx, my, mz, mx * a[0] + my * a[1] + mz * a[2], tolerance
        )
        if not inside:
            return 0.0
        if outside:
            _copy_polygon(w, spare + 1, one)
    return _polygon_area(w, one)


@njit(cache=True)
def _root(label, i):
    while label[i] != i:
        label[i] = label[label[i]]
        i = label[i]
    return i


@njit(cache=True)
def _linked_area(w, one, two, normals, tolerance):
    """Area over which two pieces touch: caps of one plane, one from each side."""
    area = 0.0
    for f in range(w.faces[one]):
        tag = w.tag[one, f]
        if tag < 0:
            continue
        for k in range(w.faces[two]):
            if w.tag[two, k] == (tag ^ 1):
                g = tag // 2
                _load_face(w, one, f, 0)
                _load_face(w, two, k, 1)
                area += _shared_area(w, 0, 1, normals[g, 0], normals[g, 1], normals[g, 2], tolerance)
    return area


@njit(cache=True)
def _label_parts(w, count, normals, tolerance, link_area):
    """Number the connected parts of the fluid in w.label -> how many. link_area < 0: one part."""
    for piece in range(count):
        w.label[piece] = 0 if link_area < 0.0 else piece
    if link_area < 0.0:
        return 1
    for one in range(count):
        for two in range(one + 1, count):
            a, b = _root(w.label, one), _root(w.label, two)
            if a != b and _linked_area(w, one, two, normals, tolerance) > link_area:
                w.label[max(a, b)] = min(a, b)
    for piece in range(count):
        w.label[piece] = _root(w.label, piece)
    parts = 0
    for piece in range(count):
        if w.label[piece] == piece:
            w.label[piece] = parts
            parts += 1
        else:
            # Roots come before their members, so theirs is already the final number.
            w.label[piece] = w.label[w.label[piece]]
    return parts


@njit(cache=True)
def _openings(w, piece, part, out, n_open):
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
                out.open_x[start + k, c] = w.x[v, c]
        n_open += 1
        out.open_start[n_open] = start + w.size[piece, f]
    return DONE, n_open


@njit(cache=True)
def _emit(w, cell, count, n_near, whole, normals, offsets, tolerance, link_area, out, n_part, n_wet, n_open):
    """Write the parts of one cell, their moments and wetted polygons (and openings if link_area >= 0)."""
    parts = _label_parts(w, count, normals, tolerance, link_area)
    if n_part + parts > len(out.part_cell):
        return OUTPUT_FULL, n_part, n_wet, n_open
    for part in range(n_part, n_part + parts):
        out.part_cell[part] = cell
        out.part_whole[part] = whole
        out.part_moments[part] = 0.0
    m = np.empty(10)
    for piece in range(count):
        part = n_part + w.label[piece]
        _piece_moments(w, piece, m)
        _merge_moments(out.part_moments[part], m)
        state, n_wet = _wetted(w, piece, n_near, normals, offsets, tolerance, part, out, n_wet)
        if state != DONE:
            return state, n_part, n_wet, n_open
        if link_area >= 0.0:
            state, n_open = _openings(w, piece, part, out, n_open)
            if state != DONE:
                return state, n_part, n_wet, n_open
    return DONE, n_part + parts, n_wet, n_open


@njit(cache=True)
def _cut_cells(
    nodes, cells, chosen, body_start, bodies, normals, offsets, plane_start, tolerance, link_area, w, out, at
):
    """Cut the cells `chosen` from at[0] on; at (4,) <- cells, parts, wetted polygons, openings done."""
    x = np.empty((4, 3))
    for row in range(at[0], len(chosen)):
        for k in range(4):
            for c in range(3):
                x[k, c] = nodes[cells[chosen[row], k], c]
        near = _nearby(
            w, x, bodies[body_start[row] : body_start[row + 1]], normals, offsets, plane_start, tolerance
        )
        if near >= 0:
            _start_piece(w, x)
            state, count, whole = _fluid_pieces(w, near, normals, offsets, tolerance)
            if state != DONE:
                return state
            if count > 0:
                state, n_part, n_wet, n_open = _emit(
                    w, chosen[row], count, near, whole, normals, offsets, tolerance, link_area, out,
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
    wet_part (S,) row of the part · wet_body (S,) · wet (S, 16) area [m2], centroid, normal, 3 points
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


def cut_cells(nodes, cells, chosen, body_start, bodies, solids, tolerance, link_area=-1.0) -> Cuts:
    """Cut chosen cells by the bodies near each.

    nodes (N, 3) [m] · cells (M, 4) · chosen (C,) cells to cut · body_start (C+1,), bodies: those near each
    solids: ConvexBodies · tolerance [m] · link_area [m2]: pieces of a cell are one part where they touch
    over more than this; < 0: all pieces of a cell are one part and no openings are listed.
    Raises CutFailed where a cross-section cannot be closed."""
    at = np.zeros(4, dtype=np.int64)
    scale = 1
    most_bodies = int(np.diff(body_start).max()) if len(chosen) else 0
    most_planes = int(np.diff(solids.plane_start).max()) if len(solids) else 0
    w = workspace(scale, most_bodies, most_bodies * most_planes)
    out = output(len(chosen) * 2 + 64, len(chosen) * 4 + 256, link_area >= 0)
    offsets = solids.cut_offsets()
    while True:
        state = _cut_cells(
            nodes, cells, chosen, body_start, bodies, solids.normals, offsets, solids.plane_start,
            tolerance, link_area, w, out, at,
        )  # fmt: skip
        if state == DONE:
            return _with_volume(_trimmed(out, at))
        if state == BROKEN_CAP:
            raise CutFailed(_failure(cells, nodes, chosen, body_start, bodies, int(at[0]), tolerance))
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


def _failure(cells, nodes, chosen, body_start, bodies, row, tolerance):
    centre = nodes[cells[chosen[row]]].mean(axis=0)
    near = bodies[body_start[row] : body_start[row + 1]].tolist()
    return (
        f"cell {chosen[row]} at {np.round(centre, 6).tolist()} m could not be cut by bodies {near}: "
        f"their faces meet within the tolerance of {tolerance:.3g} m; move them apart or enlarge `growth`"
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
