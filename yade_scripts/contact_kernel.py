"""The loops over contact nodes: places and velocities of the blocks → contact forces and what they take.

A node of block a inside block b, behind its face f, is a contact: normal n out of f, depth δ = offset - n·y with y the
node in the frame of b. The force on a at the middle of node and face is

    N n + S,   N = max(0, k δ + c δ'),   S: spring k_t over the slip, |S| ≤ μ N, dashpot c_t while it sticks,

with -(N n + S) on b, so momentum is exact. S is kept in the frame of b, where n does not turn.

A contact keeps its face until the node leaves b. Where a node appears deep inside (from the side, or past an edge) its
depth counts from there on, so that no contact begins with a force: contacts add no energy when they begin.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from yade_scripts.contact_edges import crossing, find_crossing

Array = np.ndarray

ALIGNED = 0.02
"""Least cosine between a face and the opposite of one that holds the node: others cannot be what it ran into."""
SHALLOW = 2.0
"""Depth in margins up to which a node beside a face counts as on it."""
ARRIVED = 1.5
"""Depth in paths of one substep up to which a node counts as having come through the face."""
CROSSING = 0.5
"""Overlap of crossing edges over that of faces below which nodes that touch leave the contact to the edges as well."""
SHARP = 1e-3
"""Sum of the normals of a pair below which they have no mean direction."""


class Bodies(NamedTuple):
    """Blocks and planes: inverse_mass (n,) [1/kg], inverse_inertia (n, 3, 3) body frame, zero where motion is given.

    stiffness (n,) K of a face [N/m], inf for planes · material (n,) rows of `Law.friction`.
    """

    inverse_mass: Array
    inverse_inertia: Array
    stiffness: Array
    material: Array


class Law(NamedTuple):
    """shear: k_t/k_n · zeta, zeta_t: damping ratios (zeta_t < 0: c_t = sqrt(shear) c_n) · friction (m, m) μ."""

    shear: float
    zeta: float
    zeta_t: float
    friction: Array


class Pairs(NamedTuple):
    """a < b (p,) bodies; b may be a plane · start (p+1,) first slot: the nodes of a, those of b, then
    one for edges that cross

    fresh (p,) bool: contact takes over from a joint, with the depth there is · touching (p,) bool: had contacts last
    time · calm (p,) [m]: way that the two must move before they can touch.
    """

    a: Array
    b: Array
    start: Array
    fresh: Array
    touching: Array
    calm: Array


class Slots(NamedTuple):
    """What a node remembers of its contact with the other body of the pair: face (s,) or -1 (of edges: the number of
    their pair), k (s,) [N/m],

    rest (s,) [m]: depth at which it began · shear (s, 3) [N] on the node's block, in the frame of the face's.
    """

    face: Array
    k: Array
    rest: Array
    shear: Array


class Rows(NamedTuple):
    """The contacts of one evaluation, one row each: a block of the node, b of the face; slot.

    point, normal (out of b) (c, 3) · depth [m] · kn, kt, cn, ct · mu · force, viscous, shear (c, 3) on a
    arm_a, arm_b (c, 3) [m] · slip (c, 3): velocity of a against b before the substep.
    """

    a: Array
    b: Array
    slot: Array
    point: Array
    normal: Array
    depth: Array
    kn: Array
    kt: Array
    cn: Array
    ct: Array
    mu: Array
    force: Array
    viscous: Array
    shear: Array
    arm_a: Array
    arm_b: Array
    velocity: Array


def empty_rows(size: int) -> Rows:
    """Room for `size` contacts."""
    whole, one, three = (np.zeros(size, np.int64) for _ in range(3)), (size,), (size, 3)
    scalars = [np.zeros(one) for _ in range(6)]
    vectors = [np.zeros(three) for _ in range(8)]
    return Rows(*whole, vectors[0], vectors[1], *scalars, *vectors[2:])


@njit(cache=True)
def contact_forces(shapes, bodies, law, pairs, slots, x, v, R, dt, last_dt, rows, F):
    """Find the contacts at the present places and add their forces to F (n, 6).

    dt [s]: substep to come, 0: only look · last_dt [s]: substep that led here
    → (contacts, work of friction and of springs that were let go [J])
    """
    count, lost = 0, 0.0
    planes = np.empty((np.diff(shapes.face_start).max(), 4))
    for p in range(len(pairs.a)):
        a, b = pairs.a[p], pairs.b[p]
        if pairs.calm[p] > 0.0:
            pairs.calm[p] -= last_dt * _closing_bound(v, a, b, shapes.radius[a], shapes.radius[b])
            if pairs.calm[p] > 0.0:
                continue
        first, apart = count, -np.inf
        for node_body, face_body in ((a, b), (b, a)):
            begin, end = shapes.node_start[node_body], shapes.node_start[node_body + 1]
            if begin == end:
                continue
            faces = _planes_seen_from(
                shapes.face_start, shapes.normal, shapes.offset, node_body, face_body, x, R, planes
            )
            margin = min(shapes.margin[node_body], shapes.margin[face_body])
            gap, nearest = _separation(shapes.node, begin, shapes.vertex_end[node_body], planes, faces)
            apart = max(apart, gap)
            if gap <= margin or pairs.touching[p]:
                slot = pairs.start[p] if node_body == a else pairs.start[p + 1] - 1 - (end - begin)
                count, lost = _scan(
                    shapes, bodies, law.shear, slots, slot, pairs.fresh[p], node_body, face_body, planes, faces,
                    nearest, margin, x, v, R, last_dt, rows, count, lost,
                )  # fmt: skip
        last = pairs.start[p + 1] - 1
        if slots.face[last] >= 0 or (
            apart < 0.0 and b < len(F) and (count == first or not pairs.touching[p])
        ):
            deepest = -apart if count == first else -CROSSING * apart
            count, lost, parted = _cross(
                shapes, bodies, law.shear, slots, last, pairs.fresh[p], a, b, deepest, x, v, R, last_dt, rows, count,
                lost,
            )  # fmt: skip
            apart = max(apart, parted)
        pairs.fresh[p], pairs.touching[p] = False, count > first
        if count > first:
            _set_dashpots(bodies, law, a, b, R, rows, first, count)
            lost += _apply(slots, x, v, R, dt, rows, first, count, F)
        pairs.calm[p] = apart if count == first else 0.0
    return count, lost


@njit(cache=True)
def _closing_bound(v, a, b, radius_a, radius_b):
    """Upper bound of the speed at which points of two bodies approach [m/s]; planes (radius inf) stand still."""
    linear = turn_a = turn_b = 0.0
    for k in range(3):
        linear += (v[a, k] - v[b, k]) ** 2
        turn_a += v[a, 3 + k] ** 2
        turn_b += v[b, 3 + k] ** 2
    speed = np.sqrt(linear) + np.sqrt(turn_a) * radius_a
    return speed + np.sqrt(turn_b) * radius_b if turn_b > 0.0 else speed


@njit(cache=True)
def _planes_seen_from(face_start, normal, offset, a, b, x, R, planes):
    """Face planes of b in the frame of a: depth of a point ξ of a behind face g is d - m·ξ, planes (g, 4) = (m, d).

    → number of faces"""
    first = face_start[b]
    count = face_start[b + 1] - first
    for g in range(count):
        n0, n1, n2 = normal[first + g, 0], normal[first + g, 1], normal[first + g, 2]
        w0 = R[b, 0, 0] * n0 + R[b, 0, 1] * n1 + R[b, 0, 2] * n2
        w1 = R[b, 1, 0] * n0 + R[b, 1, 1] * n1 + R[b, 1, 2] * n2
        w2 = R[b, 2, 0] * n0 + R[b, 2, 1] * n1 + R[b, 2, 2] * n2
        for j in range(3):
            planes[g, j] = R[a, 0, j] * w0 + R[a, 1, j] * w1 + R[a, 2, j] * w2
        between = w0 * (x[a, 0] - x[b, 0]) + w1 * (x[a, 1] - x[b, 1]) + w2 * (x[a, 2] - x[b, 2])
        planes[g, 3] = offset[first + g] - between
    return count


@njit(cache=True)
def _separation(node, begin, end, planes, faces):
    """Largest distance of all nodes begin .. end before one plane [m], and that plane: two bodies are at least that far
    apart. The vertices are enough."""
    best, witness = -np.inf, 0
    for g in range(faces):
        m0, m1, m2 = planes[g, 0], planes[g, 1], planes[g, 2]
        nearest = np.inf
        for i in range(begin, end):
            nearest = min(nearest, m0 * node[i, 0] + m1 * node[i, 1] + m2 * node[i, 2])
        if nearest - planes[g, 3] > best:
            best, witness = nearest - planes[g, 3], g
    return best, witness


@njit(cache=True)
def _scan(
    shapes,
    bodies,
    shear,
    slots,
    slot,
    fresh,
    a,
    b,
    planes,
    faces,
    nearest,
    margin,
    x,
    v,
    R,
    last_dt,
    rows,
    count,
    lost,
):
    """Contacts of the nodes of a with the faces of b; contacts that ended leave their springs' energy in `lost`.

    Most nodes are outside the plane `nearest`, so it is asked first."""
    begin, base = shapes.node_start[a], shapes.face_start[b]
    for i in range(begin, shapes.node_start[a + 1]):
        s = slot + i - begin
        xi0, xi1, xi2 = shapes.node[i, 0], shapes.node[i, 1], shapes.node[i, 2]
        smallest = _behind(planes, nearest, xi0, xi1, xi2)
        for g in range(faces):
            if smallest < -margin:
                break
            smallest = min(smallest, _behind(planes, g, xi0, xi1, xi2))
        g = slots.face[s] - base if slots.face[s] >= 0 else -1
        if g >= 0:
            depth = _behind(planes, g, xi0, xi1, xi2)
            if depth <= 0.0 or smallest < -margin:
                lost += _let_go(slots.face, slots.k, slots.rest, slots.shear, s, depth, shear)
                continue
        elif smallest < -margin:
            continue
        else:
            g, own = _entered(
                shapes.of_start, shapes.of, shapes.normal, i, xi0, xi1, xi2, planes, faces, smallest, margin
            )
            if g < 0:
                continue
            depth = _behind(planes, g, xi0, xi1, xi2)
            slots.face[s] = base + g
            slots.k[s] = _spring(bodies.stiffness[a], bodies.stiffness[b]) / shapes.face_nodes[own]
            slots.shear[s, 0] = slots.shear[s, 1] = slots.shear[s, 2] = 0.0
            closing = 0.0 if fresh else _closing_speed(v, R, x, a, b, xi0, xi1, xi2, planes[g])
            slots.rest[s] = 0.0 if fresh else max(0.0, depth - ARRIVED * last_dt * max(closing, 0.0))
        slots.rest[s] = min(slots.rest[s], depth)
        _write_row(rows, count, a, b, s, planes[g], depth, xi0, xi1, xi2, x, R)
        rows.depth[count], rows.kn[count] = depth - slots.rest[s], slots.k[s]
        count += 1
    return count, lost


@njit(cache=True)
def _cross(shapes, bodies, shear, slots, s, fresh, a, b, deepest, x, v, R, last_dt, rows, count, lost):
    """Contact of an edge of a with one of b, known or new; the third result parts the blocks if it is positive [m]."""
    plane, xi = np.empty(4), np.empty(3)
    known = slots.face[s] >= 0
    if not known:
        slots.face[s], parted = find_crossing(shapes, a, b, x, R, deepest)
        if slots.face[s] < 0:
            return count, lost, parted
    depth = crossing(shapes, a, b, slots.face[s], x, R, plane, xi)
    if depth <= 0.0:
        if known:
            lost += _let_go(slots.face, slots.k, slots.rest, slots.shear, s, depth, shear)
        slots.face[s] = -1
        return count, lost, -1.0
    if not known:
        slots.k[s] = _spring(bodies.stiffness[a], bodies.stiffness[b])
        slots.shear[s, 0] = slots.shear[s, 1] = slots.shear[s, 2] = 0.0
        closing = 0.0 if fresh else _closing_speed(v, R, x, a, b, xi[0], xi[1], xi[2], plane)
        slots.rest[s] = 0.0 if fresh else max(0.0, depth - ARRIVED * last_dt * max(closing, 0.0))
    slots.rest[s] = min(slots.rest[s], depth)
    _write_row(rows, count, a, b, s, plane, depth, xi[0], xi[1], xi[2], x, R)
    rows.depth[count], rows.kn[count] = depth - slots.rest[s], slots.k[s]
    return count + 1, lost, -1.0


@njit(cache=True)
def _behind(planes, g, xi0, xi1, xi2):
    """Depth of the point ξ behind a plane [m]."""
    return planes[g, 3] - planes[g, 0] * xi0 - planes[g, 1] * xi1 - planes[g, 2] * xi2


@njit(cache=True)
def _entered(of_start, of, normal, i, xi0, xi1, xi2, planes, faces, smallest, margin):
    """Face g of b that node i of a is behind, and the face of a opposite; -1 if it is outside.

    Of the faces that the node can have run into, the nearest; one that the node is still before keeps it outside."""
    face, own, best = -1, -1, np.inf
    for g in range(faces):
        depth = _behind(planes, g, xi0, xi1, xi2)
        if depth >= best:
            continue
        cosine = ALIGNED
        for at in range(of_start[i], of_start[i + 1]):
            f = of[at]
            c = -(planes[g, 0] * normal[f, 0] + planes[g, 1] * normal[f, 1] + planes[g, 2] * normal[f, 2])
            if c > cosine:
                cosine, face, own, best = c, g, f, depth
    if best <= 0.0 or (smallest < 0.0 and best > SHALLOW * margin):
        return -1, -1
    return face, own


@njit(cache=True)
def _spring(K_a, K_b):
    """Stiffness of a face of a against b [N/m].

    Both faces carry nodes where two blocks meet, and their springs are in series; a plane is rigid."""
    return K_a * K_b / (K_a + K_b) if K_b < np.inf else K_a


@njit(cache=True)
def _let_go(face, k, rest, spring, s, depth, shear):
    """End a contact; what its springs still held is lost [J]."""
    face[s] = -1
    left = 0.5 * k[s] * max(depth - rest[s], 0.0) ** 2
    left += 0.5 * (spring[s, 0] ** 2 + spring[s, 1] ** 2 + spring[s, 2] ** 2) / (shear * k[s])
    rest[s] = 0.0
    return left


@njit(cache=True)
def _closing_speed(v, R, x, a, b, xi0, xi1, xi2, plane):
    """Speed of the point ξ of a into a face of b, whose normal in the frame of a is plane[:3] [m/s]."""
    arm, point, speed = np.empty(3), np.empty(3), 0.0
    for k in range(3):
        arm[k] = R[a, k, 0] * xi0 + R[a, k, 1] * xi1 + R[a, k, 2] * xi2
        point[k] = x[a, k] + arm[k] - x[b, k]
    w = _slip(v, a, b, arm, point)
    for k in range(3):
        speed -= w[k] * (R[a, k, 0] * plane[0] + R[a, k, 1] * plane[1] + R[a, k, 2] * plane[2])
    return speed


@njit(cache=True)
def _slip(v, a, b, arm_a, arm_b):
    """Velocity of a against b at a point, given from both centres, as three floats."""
    w0 = v[a, 0] + v[a, 4] * arm_a[2] - v[a, 5] * arm_a[1]
    w1 = v[a, 1] + v[a, 5] * arm_a[0] - v[a, 3] * arm_a[2]
    w2 = v[a, 2] + v[a, 3] * arm_a[1] - v[a, 4] * arm_a[0]
    w0 -= v[b, 0] + v[b, 4] * arm_b[2] - v[b, 5] * arm_b[1]
    w1 -= v[b, 1] + v[b, 5] * arm_b[0] - v[b, 3] * arm_b[2]
    w2 -= v[b, 2] + v[b, 3] * arm_b[1] - v[b, 4] * arm_b[0]
    return w0, w1, w2


@njit(cache=True)
def _write_row(rows, c, a, b, s, plane, depth, xi0, xi1, xi2, x, R):
    """Geometry of a contact: half way between the node ξ and the face."""
    rows.a[c], rows.b[c], rows.slot[c] = a, b, s
    for k in range(3):
        n = R[a, k, 0] * plane[0] + R[a, k, 1] * plane[1] + R[a, k, 2] * plane[2]
        arm = R[a, k, 0] * xi0 + R[a, k, 1] * xi1 + R[a, k, 2] * xi2 + 0.5 * depth * n
        rows.normal[c, k], rows.arm_a[c, k] = n, arm
        rows.point[c, k] = x[a, k] + arm
        rows.arm_b[c, k] = rows.point[c, k] - x[b, k]


@njit(cache=True)
def _set_dashpots(bodies, law, a, b, R, rows, first, count):
    """Dashpots of all contacts of a pair, c = 2 ζ sqrt(m K) k/K with K = Σ k and the effective mass m at their middle.

    So a face, an edge and a corner that land all return e."""
    K, middle_a, middle_b, n = 0.0, np.zeros(3), np.zeros(3), np.zeros(3)
    for c in range(first, count):
        k, same = rows.kn[c], rows.a[c] == a
        K += k
        for i in range(3):
            middle_a[i] += k * (rows.arm_a[c, i] if same else rows.arm_b[c, i])
            middle_b[i] += k * (rows.arm_b[c, i] if same else rows.arm_a[c, i])
            n[i] += k * (rows.normal[c, i] if same else -rows.normal[c, i])
    length = np.sqrt(n[0] ** 2 + n[1] ** 2 + n[2] ** 2) / K
    if length > SHARP:
        for i in range(3):
            n[i] /= K * length
    else:
        n[:] = rows.normal[first]
    for i in range(3):
        middle_a[i] /= K
        middle_b[i] /= K
    across = bodies.inverse_mass[a] + bodies.inverse_mass[b]
    normal = across + _turning(bodies, a, R, middle_a, n) + _turning(bodies, b, R, middle_b, n)
    cn = 2.0 * law.zeta / np.sqrt(normal * K)
    ct = np.sqrt(law.shear) * cn
    if law.zeta_t >= 0.0:
        trace = _all_turning(bodies, a, R, middle_a) + _all_turning(bodies, b, R, middle_b)
        tangential = across + 0.5 * (trace - (normal - across))
        ct = 2.0 * law.zeta_t * np.sqrt(law.shear) / np.sqrt(tangential * K)
    for c in range(first, count):
        rows.cn[c], rows.ct[c] = cn * rows.kn[c], ct * rows.kn[c]
        rows.kt[c] = law.shear * rows.kn[c]
        rows.mu[c] = law.friction[bodies.material[rows.a[c]], bodies.material[rows.b[c]]]


@njit(cache=True)
def _turning(bodies, a, R, arm, n):
    """(r x n)·I⁻¹(r x n) [1/kg]: how much a body yields by turning under a force along n at the arm r."""
    t0, t1, t2 = arm[1] * n[2] - arm[2] * n[1], arm[2] * n[0] - arm[0] * n[2], arm[0] * n[1] - arm[1] * n[0]
    u = np.empty(3)
    for k in range(3):
        u[k] = R[a, 0, k] * t0 + R[a, 1, k] * t1 + R[a, 2, k] * t2
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += u[i] * bodies.inverse_inertia[a, i, j] * u[j]
    return total


@njit(cache=True)
def _all_turning(bodies, a, R, arm):
    """Sum of `_turning` over three axes."""
    total, axis = 0.0, np.zeros(3)
    for k in range(3):
        axis[:] = 0.0
        axis[k] = 1.0
        total += _turning(bodies, a, R, arm, axis)
    return total


@njit(cache=True)
def _apply(slots, x, v, R, dt, rows, first, count, F):
    """Forces of the contacts first .. count of a pair on F; → work of friction [J]."""
    lost, w, S, n, local = 0.0, np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for c in range(first, count):
        a, b, s = rows.a[c], rows.b[c], rows.slot[c]
        w[0], w[1], w[2] = _slip(v, a, b, rows.arm_a[c], rows.arm_b[c])
        n[:] = rows.normal[c]
        wn = w[0] * n[0] + w[1] * n[1] + w[2] * n[2]
        spring = rows.kn[c] * rows.depth[c]
        N = max(0.0, spring - rows.cn[c] * wn)
        size = 0.0
        for k in range(3):
            rows.velocity[c, k] = w[k]
            old = (
                R[b, k, 0] * slots.shear[s, 0]
                + R[b, k, 1] * slots.shear[s, 1]
                + R[b, k, 2] * slots.shear[s, 2]
            )
            S[k] = old - dt * rows.kt[c] * (w[k] - wn * n[k])
            size += S[k] ** 2
        size, limit = np.sqrt(size), rows.mu[c] * N
        sticks = size < limit
        if not sticks and size > 0.0:
            lost += limit * (size - limit) / rows.kt[c]
            for k in range(3):
                S[k] *= limit / size
        for k in range(3):
            viscous = -rows.ct[c] * (w[k] - wn * n[k]) if sticks else 0.0
            rows.shear[c, k] = S[k]
            rows.viscous[c, k] = viscous + (N - spring) * n[k]
            rows.force[c, k] = spring * n[k] + S[k] + rows.viscous[c, k]
        if not sticks:
            rows.ct[c] = 0.0
        if dt > 0.0:
            for k in range(3):
                local[k] = R[b, 0, k] * S[0] + R[b, 1, k] * S[1] + R[b, 2, k] * S[2]
            slots.shear[s] = local
        _add(F, a, 1.0, rows.force[c], rows.arm_a[c])
        _add(F, b, -1.0, rows.force[c], rows.arm_b[c])
    return lost if dt > 0.0 else 0.0


@njit(cache=True)
def _add(F, row, sign, force, arm):
    """Force and its moment about the centre; F has rows for blocks only."""
    if row >= len(F):
        return
    f0, f1, f2 = sign * force[0], sign * force[1], sign * force[2]
    F[row, 0] += f0
    F[row, 1] += f1
    F[row, 2] += f2
    F[row, 3] += arm[1] * f2 - arm[2] * f1
    F[row, 4] += arm[2] * f0 - arm[0] * f2
    F[row, 5] += arm[0] * f1 - arm[1] * f0


@njit(cache=True)
def contact_work(rows, count, v, given, dt):
    """Work of the contacts over the substep that ended with velocities v (n+m, 6): F·(w⁻ + w⁺)/2 dt is the exact change
    of kinetic energy in the leapfrog. given (n+m,) bool: bodies of prescribed motion.

    → (taken by dashpots, put in by what moves the driven bodies) [J]
    """
    dashpot = driving = 0.0
    for c in range(count):
        a, b = rows.a[c], rows.b[c]
        w = _slip(v, a, b, rows.arm_a[c], rows.arm_b[c])
        for k in range(3):
            dashpot -= 0.5 * rows.viscous[c, k] * (rows.velocity[c, k] + w[k]) * dt
        if given[a]:
            driving -= _power(rows.force[c], rows.arm_a[c], v[a]) * dt
        if given[b]:
            driving += _power(rows.force[c], rows.arm_b[c], v[b]) * dt
    return dashpot, driving


@njit(cache=True)
def _power(force, arm, v):
    """Power of a force at a point of a body that moves with v (6,) [W]."""
    u0 = v[0] + v[4] * arm[2] - v[5] * arm[1]
    u1 = v[1] + v[5] * arm[0] - v[3] * arm[2]
    u2 = v[2] + v[3] * arm[1] - v[4] * arm[0]
    return force[0] * u0 + force[1] * u1 + force[2] * u2


@njit(cache=True)
def carry_slots(old_pairs, old, new_index, old_index, start, new, shear):
    """Copy the memory of pairs old_index to pairs new_index; → energy of contacts in pairs that are no more [J]."""
    kept = np.zeros(len(old_pairs.a), np.bool_)
    for i in range(len(new_index)):
        p, q = new_index[i], old_index[i]
        kept[q] = True
        for s in range(start[p + 1] - start[p]):
            to, source = start[p] + s, old_pairs.start[q] + s
            new.face[to] = old.face[source]
            new.k[to] = old.k[source]
            new.rest[to] = old.rest[source]
            new.shear[to] = old.shear[source]
    lost = 0.0
    for q in range(len(kept)):
        if not kept[q]:
            for s in range(old_pairs.start[q], old_pairs.start[q + 1]):
                if old.face[s] >= 0:
                    lost += _let_go(old.face, old.k, old.rest, old.shear, s, old.rest[s], shear)
    return lost
