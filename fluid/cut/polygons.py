"""Convex polygons on the faces of pieces: clipping, area, and the three-point rule.

Corners hold barycentric coordinates in the cell, then the position relative to its first node.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import inlined, inner

PLACE = 4
"""The first number of a corner that belongs to its position: where only that is asked for, the rest is not copied."""
# Corners of the equilateral triangle with unit second moment about its centre.
SQRT2 = np.sqrt(2.0)
TRIANGLE = np.array([[SQRT2, 0.0], [-SQRT2 / 2, np.sqrt(1.5)], [-SQRT2 / 2, -np.sqrt(1.5)]])


@inner
def load_face(w, piece, f, polygon, column):
    """Copy a face of a piece to a polygon slot, from a `column` of its corners on."""
    for k in range(w.size[piece, f]):
        v = w.loop[piece, f, k]
        for c in range(column, 7):
            w.polygon[polygon, k, c] = w.x[v, c]
    w.corners[polygon] = w.size[piece, f]


@inner
def copy_polygon(w, source, target, column):
    """Copy slot `source` to slot `target`, from a `column` of the corners on."""
    w.corners[target] = w.corners[source]
    for k in range(w.corners[source]):
        for c in range(column, 7):
            w.polygon[target, k, c] = w.polygon[source, k, c]


@inner
def split_polygon(w, polygon, outer, inner, round_off, column):
    """Split a convex polygon by the plane whose distances are in w.height -> (outside, inside) not empty. The halves
    get the corners from a `column` on.

    Where one side is empty nothing is written. A polygon within the plane counts as inside."""
    corners = w.corners[polygon]
    outside, inside = False, False
    for k in range(corners):
        if w.height[k] > round_off:
            outside = True
        elif w.height[k] < -round_off:
            inside = True
        else:
            w.height[k] = 0.0
    if not (outside and inside):
        return outside, inside or not outside
    n_out, n_in, a = 0, 0, corners - 1
    for b in range(corners):
        if w.height[a] * w.height[b] < 0.0:
            t = w.height[a] / (w.height[a] - w.height[b])
            for c in range(column, 7):
                x = w.polygon[polygon, a, c] + t * (w.polygon[polygon, b, c] - w.polygon[polygon, a, c])
                w.polygon[outer, n_out, c] = x
                w.polygon[inner, n_in, c] = x
            n_out += 1
            n_in += 1
        if w.height[b] >= 0.0:
            for c in range(column, 7):
                w.polygon[outer, n_out, c] = w.polygon[polygon, b, c]
            n_out += 1
        if w.height[b] <= 0.0:
            for c in range(column, 7):
                w.polygon[inner, n_in, c] = w.polygon[polygon, b, c]
            n_in += 1
        a = b
    w.corners[outer] = n_out
    w.corners[inner] = n_in
    return True, True


@inner
def _doubled_area(o, a, b):
    """Twice the area vector (3,) of a triangle of corners given as in the polygons."""
    ax, ay, az = a[4] - o[4], a[5] - o[5], a[6] - o[6]
    bx, by, bz = b[4] - o[4], b[5] - o[5], b[6] - o[6]
    return ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx


@inner
def polygon_area(w, polygon):
    """Area [m2] of the convex polygon in a slot."""
    sx, sy, sz = 0.0, 0.0, 0.0
    for k in range(1, w.corners[polygon] - 1):
        x, y, z = _doubled_area(w.polygon[polygon, 0], w.polygon[polygon, k], w.polygon[polygon, k + 1])
        sx, sy, sz = sx + x, sy + y, sz + z
    return np.sqrt(sx * sx + sy * sy + sz * sz) / 2.0


@inner
def face_area(w, piece, f):
    """Area [m2] of a face of a piece."""
    sx, sy, sz = 0.0, 0.0, 0.0
    for k in range(1, w.size[piece, f] - 1):
        o, a, b = w.loop[piece, f, 0], w.loop[piece, f, k], w.loop[piece, f, k + 1]
        x, y, z = _doubled_area(w.x[o], w.x[a], w.x[b])
        sx, sy, sz = sx + x, sy + y, sz + z
    return np.sqrt(sx * sx + sy * sy + sz * sz) / 2.0


@inner
def _turn(w, polygon, nx, ny, nz):
    """Twice the area of a polygon, signed by its sense about n."""
    o = w.polygon[polygon, 0]
    turn = 0.0
    for k in range(1, w.corners[polygon] - 1):
        a, b = w.polygon[polygon, k], w.polygon[polygon, k + 1]
        ax, ay, az = a[4] - o[4], a[5] - o[5], a[6] - o[6]
        bx, by, bz = b[4] - o[4], b[5] - o[5], b[6] - o[6]
        turn += nx * (ay * bz - az * by) + ny * (az * bx - ax * bz) + nz * (ax * by - ay * bx)
    return turn


@inner
def split_by_edge(w, polygon, face, k, normal, outer, inner, round_off, column):
    """Split a convex polygon by edge k of a coplanar one in slot `face`, as `split_polygon` does; normal: (3,) that
    `sense` gave. Edges no longer than round-off split nothing."""
    a, b = w.polygon[face, k], w.polygon[face, (k + 1) % w.corners[face]]
    ex, ey, ez = b[4] - a[4], b[5] - a[5], b[6] - a[6]
    nx, ny, nz = normal
    mx, my, mz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
    length = np.sqrt(mx * mx + my * my + mz * mz)
    if length <= round_off:
        return False, True
    for j in range(w.corners[polygon]):
        p = w.polygon[polygon, j]
        w.height[j] = (mx * (p[4] - a[4]) + my * (p[5] - a[5]) + mz * (p[6] - a[6])) / length
    return split_polygon(w, polygon, outer, inner, round_off, column)


@inner
def sense(w, polygon, nx, ny, nz):
    """The unit normal n, or -n, about which the corners of a polygon go counter-clockwise."""
    way = 1.0 if _turn(w, polygon, nx, ny, nz) > 0.0 else -1.0
    return way * nx, way * ny, way * nz


@inner
def shared_area(w, one, two, nx, ny, nz, round_off):
    """Area common to the coplanar convex polygons in slots `one` and `two` (unit normal n); uses the two
    slots behind them and overwrites `one`."""
    normal = sense(w, two, nx, ny, nz)
    spare = max(one, two) + 1
    for k in range(w.corners[two]):
        outside, inside = split_by_edge(w, one, two, k, normal, spare, spare + 1, round_off, PLACE)
        if not inside:
            return 0.0
        if outside:
            copy_polygon(w, spare + 1, one, PLACE)
    return polygon_area(w, one)


@inner
def across(nx, ny, nz):
    """Two unit vectors t, r = n × t in the plane with unit normal n, as six numbers. Any two would do: a rule depends
    on them only by a rotation of its points."""
    if abs(nx) <= abs(ny) and abs(nx) <= abs(nz):
        tx, ty, tz = 0.0, nz, -ny
    elif abs(ny) <= abs(nz):
        tx, ty, tz = -nz, 0.0, nx
    else:
        tx, ty, tz = ny, -nx, 0.0
    length = np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / length, ty / length, tz / length
    return tx, ty, tz, ny * tz - nz * ty, nz * tx - nx * tz, nx * ty - ny * tx


@inlined
def triangle_rule(corners, first, second, n, plane, least, row):
    """row (16,) <- area, centroid, normal and three points, weight area / 3, exact to degree 2, of the triangle of
    corners 0, `first` and `second` of a polygon (corners, 7) with unit normal n; plane: `across` of it.

    Points c + R s_q, R the symmetric root of the in-plane covariance, s_q the corners of an equilateral
    triangle with unit covariance. row[0] = 0 for an area of at most `least` [m2]."""
    tx, ty, tz, rx, ry, rz = plane
    x0, y0, z0 = corners[0, 4], corners[0, 5], corners[0, 6]
    dx, dy, dz = corners[first, 4] - x0, corners[first, 5] - y0, corners[first, 6] - z0
    a_s = dx * tx + dy * ty + dz * tz
    a_t = dx * rx + dy * ry + dz * rz
    dx, dy, dz = corners[second, 4] - x0, corners[second, 5] - y0, corners[second, 6] - z0
    b_s = dx * tx + dy * ty + dz * tz
    b_t = dx * rx + dy * ry + dz * rz
    area = (a_s * b_t - a_t * b_s) / 2.0
    if abs(area) <= least:
        row[0] = 0.0
        return
    s, t = a_s + b_s, a_t + b_t
    fs, ft = area * s / 3.0, area * t / 3.0
    ss = area * (a_s * a_s + b_s * b_s + s * s) / 12.0
    tt = area * (a_t * a_t + b_t * b_t + t * t) / 12.0
    st = area * (a_s * a_t + b_s * b_t + s * t) / 12.0
    fs, ft = fs / area, ft / area
    ss = max(ss / area - fs * fs, 0.0)
    tt = max(tt / area - ft * ft, 0.0)
    st = st / area - fs * ft
    # A sliver may come out with a negative determinant by round-off.
    root = np.sqrt(max(ss * tt - st * st, 0.0))
    most = np.sqrt(ss * tt)
    st = min(max(st, -most), most)
    trace = np.sqrt(max(ss + tt + 2.0 * root, least * 1e-6))
    row[0] = abs(area)
    row[1] = x0 + fs * tx + ft * rx
    row[2] = y0 + fs * ty + ft * ry
    row[3] = z0 + fs * tz + ft * rz
    row[4], row[5], row[6] = n
    for q in range(3):
        s = ((ss + root) * TRIANGLE[q, 0] + st * TRIANGLE[q, 1]) / trace
        t = (st * TRIANGLE[q, 0] + (tt + root) * TRIANGLE[q, 1]) / trace
        row[7 + 3 * q] = row[1] + s * tx + t * rx
        row[8 + 3 * q] = row[2] + s * ty + t * ry
        row[9 + 3 * q] = row[3] + s * tz + t * rz
