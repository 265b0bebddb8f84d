"""Springs, dashpots and friction of contacts that were found: their forces, and what these take.

The force on a at the middle of node and face is

    N n + S,   N = max(0, k δ + c δ'),   S: spring k_t over the slip, |S| ≤ μ N, dashpot c_t while it sticks,

with -(N n + S) on b, so momentum is exact. S is kept in the frame of b, where n does not turn.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from yade_scripts.jit import inner

SHARP = 1e-3
"""Sum of the normals of a pair below which they have no mean direction."""


@inner
def set_dashpots(bodies, law, a, b, R, rows, first, count, scratch):
    """Dashpots of all contacts of a pair, c = 2 ζ sqrt(m K) k/K with K = Σ k and the effective mass m at their middle.

    So a face, an edge and a corner that land all return e. scratch (5, 3): work space."""
    K, middle_a, middle_b, n, u, axis = 0.0, scratch[0], scratch[1], scratch[2], scratch[3], scratch[4]
    for i in range(3):
        middle_a[i] = middle_b[i] = n[i] = 0.0
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
        for i in range(3):
            n[i] = rows.normal[first, i]
    for i in range(3):
        middle_a[i] /= K
        middle_b[i] /= K
    across = bodies.inverse_mass[a] + bodies.inverse_mass[b]
    normal = across + _turning(bodies, a, R, middle_a, n, u) + _turning(bodies, b, R, middle_b, n, u)
    cn = 2.0 * law.zeta / np.sqrt(normal * K)
    ct = np.sqrt(law.shear) * cn
    if law.zeta_t >= 0.0:
        trace = _all_turning(bodies, a, R, middle_a, axis, u) + _all_turning(bodies, b, R, middle_b, axis, u)
        tangential = across + 0.5 * (trace - (normal - across))
        ct = 2.0 * law.zeta_t * np.sqrt(law.shear) / np.sqrt(tangential * K)
    for c in range(first, count):
        rows.cn[c], rows.ct[c] = cn * rows.kn[c], ct * rows.kn[c]
        rows.kt[c] = law.shear * rows.kn[c]
        rows.mu[c] = law.friction[bodies.material[rows.a[c]], bodies.material[rows.b[c]]]


@inner
def _turning(bodies, a, R, arm, n, u):
    """(r x n)·I⁻¹(r x n) [1/kg]: how much a body yields by turning under a force along n at the arm r; u (3,): work
    space."""
    t0, t1, t2 = arm[1] * n[2] - arm[2] * n[1], arm[2] * n[0] - arm[0] * n[2], arm[0] * n[1] - arm[1] * n[0]
    for k in range(3):
        u[k] = R[a, 0, k] * t0 + R[a, 1, k] * t1 + R[a, 2, k] * t2
    total = 0.0
    for i in range(3):
        for j in range(3):
            total += u[i] * bodies.inverse_inertia[a, i, j] * u[j]
    return total


@inner
def _all_turning(bodies, a, R, arm, axis, u):
    """Sum of `_turning` over three axes; axis, u (3,): work space."""
    total = 0.0
    for k in range(3):
        for i in range(3):
            axis[i] = 1.0 if i == k else 0.0
        total += _turning(bodies, a, R, arm, axis, u)
    return total


@inner
def apply(slots, x, v, R, dt, rows, first, count, F, scratch):
    """Forces of the contacts first .. count of a pair on F; → work of friction [J]. scratch (5, 3): work space."""
    lost, w, S, n = 0.0, scratch[0], scratch[1], scratch[2]
    for c in range(first, count):
        a, b, s = rows.a[c], rows.b[c], rows.slot[c]
        w[0], w[1], w[2] = slip(v, a, b, rows.arm_a[c], rows.arm_b[c])
        for k in range(3):
            n[k] = rows.normal[c, k]
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
                slots.shear[s, k] = R[b, 0, k] * S[0] + R[b, 1, k] * S[1] + R[b, 2, k] * S[2]
        _add(F, a, 1.0, rows.force[c], rows.arm_a[c])
        _add(F, b, -1.0, rows.force[c], rows.arm_b[c])
    return lost if dt > 0.0 else 0.0


@inner
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
        w = slip(v, a, b, rows.arm_a[c], rows.arm_b[c])
        for k in range(3):
            dashpot -= 0.5 * rows.viscous[c, k] * (rows.velocity[c, k] + w[k]) * dt
        if given[a]:
            driving -= _power(rows.force[c], rows.arm_a[c], v[a]) * dt
        if given[b]:
            driving += _power(rows.force[c], rows.arm_b[c], v[b]) * dt
    return dashpot, driving


@inner
def _power(force, arm, v):
    """Power of a force at a point of a body that moves with v (6,) [W]."""
    u0 = v[0] + v[4] * arm[2] - v[5] * arm[1]
    u1 = v[1] + v[5] * arm[0] - v[3] * arm[2]
    u2 = v[2] + v[3] * arm[1] - v[4] * arm[0]
    return force[0] * u0 + force[1] * u1 + force[2] * u2


@inner
def slip(v, a, b, arm_a, arm_b):
    """Velocity of a against b at a point, given from both centres, as three floats."""
    w0 = v[a, 0] + v[a, 4] * arm_a[2] - v[a, 5] * arm_a[1]
    w1 = v[a, 1] + v[a, 5] * arm_a[0] - v[a, 3] * arm_a[2]
    w2 = v[a, 2] + v[a, 3] * arm_a[1] - v[a, 4] * arm_a[0]
    w0 -= v[b, 0] + v[b, 4] * arm_b[2] - v[b, 5] * arm_b[1]
    w1 -= v[b, 1] + v[b, 5] * arm_b[0] - v[b, 3] * arm_b[2]
    w2 -= v[b, 2] + v[b, 3] * arm_b[1] - v[b, 4] * arm_b[0]
    return w0, w1, w2


@inner
def stiffness_together(K_a, K_b):
    """Stiffness of a face of a against b [N/m].

    Both faces carry nodes where two blocks meet, and their springs are in series; a plane is rigid."""
    return K_a * K_b / (K_a + K_b) if K_b < np.inf else K_a


@inner
def let_go(face, k, rest, spring, s, depth, shear):
    """End a contact; what its springs still held is lost [J]."""
    face[s] = -1
    left = 0.5 * k[s] * max(depth - rest[s], 0.0) ** 2
    left += 0.5 * (spring[s, 0] ** 2 + spring[s, 1] ** 2 + spring[s, 2] ** 2) / (shear * k[s])
    rest[s] = 0.0
    return left
