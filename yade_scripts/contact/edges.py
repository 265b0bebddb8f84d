"""Contacts of edges against edges, which the contact nodes of a pair of blocks do not detect.

Two convex bodies are apart if a plane along a face or along an edge of each parts them (separating axes: Gottschalk,
Lin and Manocha, SIGGRAPH 1996). Where no such plane exists, although no node is in contact or contact has just begun,
and the smallest overlap is that of two edges with directions d_a and d_b, these two edges carry the contact:

    n = ± d_a x d_b / |d_a x d_b|, out of b,   depth δ = n·(p_b - p_a),   p: nearest points of the two lines

with the force of a node contact. The contact lasts until the edges separate, become parallel or slide past an end.
Where faces lie on one another, as those of crossed beams do, further edges cross beside these with the same normal,
each with its own depth (`next_beside`)."""

from __future__ import annotations

import numpy as np

from kernels.decorators import helper, inlined, inner

PARALLEL = 0.05
"""Sine of the angle below which lines count as parallel to a face or to one another."""
CROSSES = 0.002
"""Sine of the angle below which two edges do not cross: long edges that cross at a small angle, next to an end of the
other block, may have no node within it."""
ROUND_OFF = 1e-9
"""Sine of the angle below which two edges have no common normal."""
SUPPORT = 1e-6
"""Share of the radius by which an edge may be off the outermost point of its block."""
FLAT = 0.99875
"""Cosine of the angle of two normals above which further edges may cross beside a pair: sine 0.05."""
ENDS = 0.01
"""Share of an edge, at either end, in which the contact node of the vertex replaces a further crossing."""
SCRATCH = 9
"""Rows of the work space of a pair before those for the vertices of both blocks."""


@helper
def pair_scratch(shapes):
    """Work space (.., 3) of a pair of blocks."""
    most = 0
    for a in range(len(shapes.vertex_end)):
        most = max(most, shapes.vertex_end[a] - shapes.node_start[a])
    return np.empty((SCRATCH + 2 * most, 3))


@inlined
def find_crossing(shapes, a, b, x, R, deepest, scratch):
    """Find the edges of a and b with the smallest overlap, if that is less than `deepest` [m]; scratch: see
    `pair_scratch`. Parallel edges of a block share one normal with each edge of the other: a box has three directions.

    → (number of the pair of edges or -1, distance by which the blocks are apart [m], or -1)
    """
    count = shapes.vertex_end[a] - shapes.node_start[a]
    A, B = scratch[SCRATCH : SCRATCH + count], scratch[SCRATCH + count :]
    n, d, da, db = scratch[0], scratch[1], scratch[2], scratch[3]
    for k in range(3):
        d[k], n[k] = 0.0, x[b, k] - x[a, k]
    _vertices(shapes, a, d, R, A)
    _vertices(shapes, b, n, R, B)
    A, B = A[:count], B[: shapes.vertex_end[b] - shapes.node_start[b]]
    for k in range(3):
        d[k] = x[a, k] - x[b, k]
    off = SUPPORT * (shapes.radius[a] + shapes.radius[b])
    found = -1
    first_a, first_b = shapes.edge_start[a], shapes.edge_start[b]
    count_a, count_b = shapes.edge_end[a] - first_a, shapes.edge_end[b] - first_b
    for i in range(count_a):
        if shapes.edge_like[first_a + i] != i:
            continue
        _along(shapes, first_a + i, A, da)
        for j in range(count_b):
            if shapes.edge_like[first_b + j] != j:
                continue
            _along(shapes, first_b + j, B, db)
            if _normal(da, db, n) < CROSSES:
                continue
            if n[0] * d[0] + n[1] * d[1] + n[2] * d[2] < 0.0:
                for k in range(3):
                    n[k] *= -1.0
            low, high = _least(A, n, 1.0), -_least(B, n, -1.0)
            if low > high:
                return -1, low - high
            if high - low < deepest:
                number = _outermost(shapes, a, b, i, j, A, B, n, low + off, high - off, scratch)
                if number >= 0:
                    found, deepest = number, high - low
    return found, -1.0


@inner
def _along(shapes, edge, points, d):
    """Set d (3,) to the vector along an edge of a block with vertices `points`."""
    first, second = shapes.edge[edge, 0], shapes.edge[edge, 1]
    for k in range(3):
        d[k] = points[second, k] - points[first, k]


@inner
def _outermost(shapes, a, b, like_a, like_b, A, B, n, low, high, scratch):
    """First pair of an edge of a parallel to like_a and one of b parallel to like_b that lie outermost, below `low` and
    above `high` along n (3,), and cross between their ends: its number, or -1."""
    da, db = scratch[4], scratch[5]
    first_a, first_b = shapes.edge_start[a], shapes.edge_start[b]
    count_b = shapes.edge_end[b] - first_b
    for i in range(shapes.edge_end[a] - first_a):
        p = shapes.edge[first_a + i, 0]
        if shapes.edge_like[first_a + i] != like_a or _dot(n, A[p]) >= low:
            continue
        _along(shapes, first_a + i, A, da)
        for j in range(count_b):
            q = shapes.edge[first_b + j, 0]
            if shapes.edge_like[first_b + j] != like_b or _dot(n, B[q]) <= high:
                continue
            _along(shapes, first_b + j, B, db)
            s, t = _nearest(A[p], da, B[q], db)
            if 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0:
                return i * count_b + j
    return -1


@inlined
def crossing(shapes, a, b, number, state, plane, point, scratch):
    """Depth of a pair of edges [m], and the distance of their crossing from the nearest end as a share of that edge,
    which is negative past the end or where the edges no longer cross.

    plane, point (3,): set to the normal out of b and to the point of a, both in the frame of a. They are also set where
    the edges no longer cross, since the energy left in the springs is computed from them. scratch (8, 3): work space,
    of which rows 4 and 5 are not used."""
    x, R = state.x, state.R
    count_b = shapes.edge_end[b] - shapes.edge_start[b]
    ea, eb = shapes.edge_start[a] + number // count_b, shapes.edge_start[b] + number % count_b
    pa, da, pb, db, n, outward = scratch[0], scratch[1], scratch[2], scratch[3], scratch[6], 0.0
    _line(shapes, a, ea, R, pa, da)
    _line(shapes, b, eb, R, pb, db)
    for k in range(3):
        pb[k] += x[b, k] - x[a, k]
    sine = _normal(da, db, n)
    if sine == 0.0:
        for k in range(3):
            plane[k] = point[k] = 0.0
        return 0.0, -1.0
    for k in range(3):
        for j in range(3):
            outward += n[k] * (R[b, k, j] * shapes.edge_out[eb, j] - R[a, k, j] * shapes.edge_out[ea, j])
    sign = 1.0 if outward > 0.0 else -1.0
    s, t = _nearest(pa, da, pb, db)
    depth = 0.0
    for k in range(3):
        plane[k] = sign * (R[a, 0, k] * n[0] + R[a, 1, k] * n[1] + R[a, 2, k] * n[2])
        depth += sign * n[k] * (pb[k] - pa[k])
        point[k] = 0.0
        for j in range(3):
            point[k] += R[a, j, k] * (pa[j] + s * da[j])
    return depth, min(min(s, 1.0 - s), min(t, 1.0 - t)) if sine >= CROSSES else -1.0


@inner
def next_beside(shapes, side, n, number, leading, level, most, state, plane, point, scratch):
    """Find the next pair of edges after `number` that is `leading`, or that cross between their ends and bound faces
    perpendicular to n (3,), which points out of b. level: whether both blocks have such faces · most [m]: depth up to
    which edges count as beside others.

    plane, point, scratch: as in `crossing`   →   (number of the pair or -1, depth [m], negative where they are apart)
    """
    a, b, R = side.a, side.b, state.R
    count_b = shapes.edge_end[b] - shapes.edge_start[b]
    count_a = shapes.edge_end[a] - shapes.edge_start[a]
    if not level:
        ea, eb = shapes.edge_start[a] + leading // count_b, shapes.edge_start[b] + leading % count_b
        if leading <= number or not (
            _across(shapes, a, ea, R, n, -1.0) and _across(shapes, b, eb, R, n, 1.0)
        ):
            return -1, 0.0
        return leading, crossing(shapes, a, b, leading, state, plane, point, scratch)[0]
    start = number + 1
    for i in range(start // count_b, count_a):
        if not _across(shapes, a, shapes.edge_start[a] + i, R, n, -1.0):
            continue
        for j in range(max(start - i * count_b, 0), count_b):
            if not _across(shapes, b, shapes.edge_start[b] + j, R, n, 1.0):
                continue
            depth, within = crossing(shapes, a, b, i * count_b + j, state, plane, point, scratch)
            along = 0.0
            for k in range(3):
                along += n[k] * (R[a, k, 0] * plane[0] + R[a, k, 1] * plane[1] + R[a, k, 2] * plane[2])
            if i * count_b + j == leading or (within > ENDS and along > FLAT and depth <= most):
                return i * count_b + j, depth
    return -1, 0.0


@inner
def _across(shapes, a, edge, R, n, sign):
    """Whether an edge of a is nearly perpendicular to n (3,) and its faces point in the direction of sign n."""
    begin = shapes.node_start[a]
    first, second = begin + shapes.edge[edge, 0], begin + shapes.edge[edge, 1]
    along = size = outward = 0.0
    for j in range(3):
        m = R[a, 0, j] * n[0] + R[a, 1, j] * n[1] + R[a, 2, j] * n[2]
        d = shapes.node[second, j] - shapes.node[first, j]
        along += m * d
        size += d * d
        outward += m * shapes.edge_out[edge, j]
    return sign * outward > 0.0 and along * along < PARALLEL * PARALLEL * size


@inner
def _line(shapes, a, edge, R, p, d):
    """Start p and direction d (3,) of an edge, seen from the centre of its block, world axes."""
    begin = shapes.node_start[a]
    first, second = begin + shapes.edge[edge, 0], begin + shapes.edge[edge, 1]
    for k in range(3):
        p[k] = d[k] = 0.0
        for j in range(3):
            p[k] += R[a, k, j] * shapes.node[first, j]
            d[k] += R[a, k, j] * (shapes.node[second, j] - shapes.node[first, j])


@inner
def _vertices(shapes, a, shift, R, out):
    """Vertices of a block, turned and moved, in out (k, 3)."""
    begin, end = shapes.node_start[a], shapes.vertex_end[a]
    for i in range(end - begin):
        for k in range(3):
            out[i, k] = shift[k]
            for j in range(3):
                out[i, k] += R[a, k, j] * shapes.node[begin + i, j]


@inner
def _normal(da, db, n):
    """Set n (3,) to the unit normal of two directions; → sine of the angle between them, 0 where n is undefined."""
    n[0] = da[1] * db[2] - da[2] * db[1]
    n[1] = da[2] * db[0] - da[0] * db[2]
    n[2] = da[0] * db[1] - da[1] * db[0]
    size = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2)
    sine = size / np.sqrt(_dot(da, da) * _dot(db, db))
    if sine < ROUND_OFF:
        return 0.0
    for k in range(3):
        n[k] /= size
    return sine


@inner
def _dot(u, w):
    return u[0] * w[0] + u[1] * w[1] + u[2] * w[2]


@inner
def _least(points, n, sign):
    """Smallest sign n·p over the points."""
    least = np.inf
    for i in range(len(points)):
        least = min(least, sign * (n[0] * points[i, 0] + n[1] * points[i, 1] + n[2] * points[i, 2]))
    return least


@inner
def _nearest(pa, da, pb, db):
    """Parameters (s, t) of the nearest points of the lines pa + s da and pb + t db."""
    aa, bb, ab = _dot(da, da), _dot(db, db), _dot(da, db)
    ra, rb = _dot(pb, da) - _dot(pa, da), _dot(pb, db) - _dot(pa, db)
    size = (da[1] * db[2] - da[2] * db[1]) ** 2 + (da[2] * db[0] - da[0] * db[2]) ** 2
    size += (da[0] * db[1] - da[1] * db[0]) ** 2  # aa bb - ab² is round-off where they are nearly parallel
    return (ra * bb - rb * ab) / size, (ra * ab - rb * aa) / size
