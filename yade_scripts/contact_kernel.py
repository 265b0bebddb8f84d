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

Array = np.ndarray

ALIGNED = 0.02
"""Least cosine between a face and the opposite of one that holds the node: others cannot be what it ran into."""
SHALLOW = 2.0
"""Depth in margins up to which a node beside a face counts as on it."""
ARRIVED = 1.5
"""Depth in paths of one substep up to which a node counts as having come through the face."""
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
    """a < b (p,) bodies; b may be a plane · start (p+1,) first slot: the nodes of a, then those of b

    fresh (p,) bool: contact takes over from a joint, with the depth there is · calm (p,) [m]: way that the two must
    move before they can touch.
    """

    a: Array
    b: Array
    start: Array
    fresh: Array
    calm: Array


class Slots(NamedTuple):
    """What a node remembers of its contact with the other body of the pair: face (s,) or -1, k (s,) [N/m],

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
    Rba, tba = np.empty((3, 3)), np.empty(3)
    for p in range(len(pairs.a)):
        a, b = pairs.a[p], pairs.b[p]
        if pairs.calm[p] > 0.0:
            pairs.calm[p] -= last_dt * _closing_bound(shapes, a, b, v)
            if pairs.calm[p] > 0.0:
                continue
        first = count
        for node, face in ((a, b), (b, a)):
            count, lost = _scan(
                shapes, bodies, law.shear, pairs, slots, p, node, face, x, v, R, last_dt, Rba, tba, rows, count, lost
            )
        pairs.fresh[p] = False
        if count > first:
            _set_dashpots(bodies, law, a, b, R, rows, first, count)
            lost += _apply(law, bodies, slots, x, v, R, dt, rows, first, count, F)
        else:
            pairs.calm[p] = max(
                _separation(shapes, a, b, x, R, Rba, tba), _separation(shapes, b, a, x, R, Rba, tba)
            )
    return count, lost


@njit(cache=True)
def _closing_bound(shapes, a, b, v):
    """Upper bound of the speed at which points of two bodies approach [m/s]."""
    linear = turn_a = turn_b = 0.0
    for k in range(3):
        linear += (v[a, k] - v[b, k]) ** 2
        turn_a += v[a, 3 + k] ** 2
        turn_b += v[b, 3 + k] ** 2
    speed = np.sqrt(linear) + np.sqrt(turn_a) * shapes.radius[a]
    return speed + np.sqrt(turn_b) * shapes.radius[b] if turn_b > 0.0 else speed


@njit(cache=True)
def _relative(a, b, x, R, Rba, tba):
    """Frame of a seen from b: y = Rba ξ + tba."""
    for i in range(3):
        tba[i] = 0.0
        for k in range(3):
            tba[i] += R[b, k, i] * (x[a, k] - x[b, k])
        for j in range(3):
            Rba[i, j] = R[b, 0, i] * R[a, 0, j] + R[b, 1, i] * R[a, 1, j] + R[b, 2, i] * R[a, 2, j]


@njit(cache=True)
def _separation(shapes, a, b, x, R, Rba, tba):
    """Largest distance of all nodes of a from one face plane of b [m]: the two are at least that far apart."""
    if shapes.node_start[a + 1] == shapes.node_start[a]:
        return -np.inf
    _relative(a, b, x, R, Rba, tba)
    best = -np.inf
    for f in range(shapes.face_start[b], shapes.face_start[b + 1]):
        n0, n1, n2 = shapes.normal[f, 0], shapes.normal[f, 1], shapes.normal[f, 2]
        m0 = n0 * Rba[0, 0] + n1 * Rba[1, 0] + n2 * Rba[2, 0]
        m1 = n0 * Rba[0, 1] + n1 * Rba[1, 1] + n2 * Rba[2, 1]
        m2 = n0 * Rba[0, 2] + n1 * Rba[1, 2] + n2 * Rba[2, 2]
        nearest = np.inf
        for i in range(shapes.node_start[a], shapes.node_start[a + 1]):
            nearest = min(nearest, m0 * shapes.node[i, 0] + m1 * shapes.node[i, 1] + m2 * shapes.node[i, 2])
        nearest += n0 * tba[0] + n1 * tba[1] + n2 * tba[2] - shapes.offset[f]
        best = max(best, nearest)
    return best


@njit(cache=True)
def _scan(shapes, bodies, shear, pairs, slots, p, a, b, x, v, R, last_dt, Rba, tba, rows, count, lost):
    """Contacts of the nodes of a with the faces of b; contacts that ended leave their springs' energy in `lost`."""
    _relative(a, b, x, R, Rba, tba)
    first = shapes.node_start[a]
    slot = pairs.start[p] if a == pairs.a[p] else pairs.start[p + 1] - (shapes.node_start[a + 1] - first)
    margin = min(shapes.margin[a], shapes.margin[b]) if shapes.margin[b] > 0.0 else 0.0
    y = np.empty(3)
    for i in range(first, shapes.node_start[a + 1]):
        s = slot + i - first
        for k in range(3):
            y[k] = (
                Rba[k, 0] * shapes.node[i, 0] + Rba[k, 1] * shapes.node[i, 1] + Rba[k, 2] * shapes.node[i, 2] + tba[k]
            )
        f = slots.face[s]
        if f >= 0:
            depth = _depth(shapes, f, y)
            if depth <= 0.0 or _beside(shapes, b, y, margin):
                lost += _let_go(slots, s, depth, shear)
                continue
        else:
            f = _entered(shapes, a, b, i, y, Rba, margin)
            if f < 0:
                continue
            depth = _depth(shapes, f, y)
            _begin(shapes, bodies, slots, s, a, b, i, f, Rba)
            if not pairs.fresh[p]:
                closing = _closing_speed(shapes, a, b, i, f, x, v, R)
                slots.rest[s] = max(0.0, depth - ARRIVED * last_dt * max(closing, 0.0))
        slots.rest[s] = min(slots.rest[s], depth)
        _write_row(shapes, slots, rows, count, a, b, s, f, y, depth, x, R)
        count += 1
    return count, lost


@njit(cache=True)
def _depth(shapes, f, y):
    """Distance of the point y behind the plane of face f [m]."""
    n = shapes.normal[f]
    return shapes.offset[f] - n[0] * y[0] - n[1] * y[1] - n[2] * y[2]


@njit(cache=True)
def _beside(shapes, b, y, margin):
    """Whether y lies farther than the margin outside some face of b."""
    for g in range(shapes.face_start[b], shapes.face_start[b + 1]):
        if _depth(shapes, g, y) < -margin:
            return True
    return False


@njit(cache=True)
def _entered(shapes, a, b, i, y, Rba, margin):
    """Face of b that the node i of a, now at y, is behind; -1 if it is outside.

    Of the faces that the node can have run into, the nearest; one that the node is still before keeps it outside."""
    smallest, face, best = np.inf, -1, np.inf
    for g in range(shapes.face_start[b], shapes.face_start[b + 1]):
        depth = _depth(shapes, g, y)
        if depth < -margin:
            return -1
        smallest = min(smallest, depth)
        if depth < best and _opposed(shapes, i, g, Rba)[0] > ALIGNED:
            face, best = g, depth
    if best <= 0.0 or (smallest < 0.0 and best > SHALLOW * margin):
        return -1
    return face


@njit(cache=True)
def _opposed(shapes, i, g, Rba):
    """Largest cosine between the inward normal of face g of b and the faces of a that hold node i; that face."""
    best, face = -1.0, -1
    n = shapes.normal[g]
    m0 = n[0] * Rba[0, 0] + n[1] * Rba[1, 0] + n[2] * Rba[2, 0]
    m1 = n[0] * Rba[0, 1] + n[1] * Rba[1, 1] + n[2] * Rba[2, 1]
    m2 = n[0] * Rba[0, 2] + n[1] * Rba[1, 2] + n[2] * Rba[2, 2]
    for at in range(shapes.of_start[i], shapes.of_start[i + 1]):
        f = shapes.of[at]
        cosine = -(m0 * shapes.normal[f, 0] + m1 * shapes.normal[f, 1] + m2 * shapes.normal[f, 2])
        if cosine > best:
            best, face = cosine, f
    return best, face


@njit(cache=True)
def _begin(shapes, bodies, slots, s, a, b, i, f, Rba):
    """A new contact: its share of the stiffness of the face of a that lies opposite.

    Both faces carry nodes where two blocks meet, and their springs are in series; a plane is rigid."""
    own = _opposed(shapes, i, f, Rba)[1]
    K = bodies.stiffness[a]
    if bodies.stiffness[b] < np.inf:
        K = K * bodies.stiffness[b] / (K + bodies.stiffness[b])
    slots.face[s] = f
    slots.k[s] = K / shapes.face_nodes[own]
    slots.rest[s] = 0.0
    slots.shear[s] = 0.0


@njit(cache=True)
def _let_go(slots, s, depth, shear):
    """End a contact; what its springs still held is lost [J]."""
    slots.face[s] = -1
    left = 0.5 * slots.k[s] * max(depth - slots.rest[s], 0.0) ** 2
    S = slots.shear[s]
    left += 0.5 * (S[0] ** 2 + S[1] ** 2 + S[2] ** 2) / (shear * slots.k[s])
    slots.rest[s] = 0.0
    return left


@njit(cache=True)
def _closing_speed(shapes, a, b, i, f, x, v, R):
    """Speed of node i of a into face f of b [m/s]."""
    arm, point, n = np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        arm[k] = R[a, k, 0] * shapes.node[i, 0] + R[a, k, 1] * shapes.node[i, 1] + R[a, k, 2] * shapes.node[i, 2]
        point[k] = x[a, k] + arm[k] - x[b, k]
        n[k] = (
            R[b, k, 0] * shapes.normal[f, 0] + R[b, k, 1] * shapes.normal[f, 1] + R[b, k, 2] * shapes.normal[f, 2]
        )
    w = _slip(v, a, b, arm, point)
    return -(w[0] * n[0] + w[1] * n[1] + w[2] * n[2])


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
def _write_row(shapes, slots, rows, c, a, b, s, f, y, depth, x, R):
    """Geometry of a contact: half way between the node y (frame of b) and the face."""
    rows.a[c], rows.b[c], rows.slot[c] = a, b, s
    n = shapes.normal[f]
    for k in range(3):
        rows.normal[c, k] = R[b, k, 0] * n[0] + R[b, k, 1] * n[1] + R[b, k, 2] * n[2]
        arm = R[b, k, 0] * y[0] + R[b, k, 1] * y[1] + R[b, k, 2] * y[2] + 0.5 * depth * rows.normal[c, k]
        rows.arm_b[c, k] = arm
        rows.point[c, k] = x[b, k] + arm
        rows.arm_a[c, k] = rows.point[c, k] - x[a, k]
    rows.depth[c] = depth - slots.rest[s]
    rows.kn[c] = slots.k[s]


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
def _apply(law, bodies, slots, x, v, R, dt, rows, first, count, F):
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
            old = R[b, k, 0] * slots.shear[s, 0] + R[b, k, 1] * slots.shear[s, 1] + R[b, k, 2] * slots.shear[s, 2]
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
                    lost += _let_go(old, s, old.rest[s], shear)
    return lost
