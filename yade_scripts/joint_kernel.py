"""Points of joints in the world: where they are, how fast they part, forces on the blocks, openings; no law.

A point of a joint sits at ξ_a in block a and ξ_b in block b (or at a fixed place). With the separation
d = x_b - x_a, the normal n turning with block a:  δ_n = d·n, δ_t = d - δ_n n. The traction acts on both blocks at the
mid point of the pair, so linear and angular momentum are exact. Absolute positions: no incremental drift.
"""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True)
def rotation_matrix(q, R):
    """R (3, 3) of the unit quaternion q = (x, y, z, w)."""
    x, y, z, w = q[0], q[1], q[2], q[3]
    R[0, 0], R[0, 1], R[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)
    R[1, 0], R[1, 1], R[1, 2] = 2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)
    R[2, 0], R[2, 1], R[2, 2] = 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)


@njit(cache=True)
def place(row, R, x, local, out):
    """World position of a body point; row < 0 stands for the fixed world."""
    for k in range(3):
        if row < 0:
            out[k] = local[k]
        else:
            out[k] = x[row, k] + R[row, k, 0] * local[0] + R[row, k, 1] * local[1] + R[row, k, 2] * local[2]


@njit(cache=True)
def add_velocity(row, sign, x, v, at, out):
    """Add sign times the velocity of the body point now at `at`; v (n, 6) [v, ω]."""
    if row < 0:
        return
    r0, r1, r2 = at[0] - x[row, 0], at[1] - x[row, 1], at[2] - x[row, 2]
    out[0] += sign * (v[row, 0] + v[row, 4] * r2 - v[row, 5] * r1)
    out[1] += sign * (v[row, 1] + v[row, 5] * r0 - v[row, 3] * r2)
    out[2] += sign * (v[row, 2] + v[row, 3] * r1 - v[row, 4] * r0)


@njit(cache=True)
def add_force(row, sign, t, at, x, F):
    """Add the force sign*t at the world point `at` to F (n, 6) [force, moment about the centre]."""
    if row < 0:
        return
    r0, r1, r2 = at[0] - x[row, 0], at[1] - x[row, 1], at[2] - x[row, 2]
    f0, f1, f2 = sign * t[0], sign * t[1], sign * t[2]
    F[row, 0] += f0
    F[row, 1] += f1
    F[row, 2] += f2
    F[row, 3] += r1 * f2 - r2 * f1
    F[row, 4] += r2 * f0 - r0 * f2
    F[row, 5] += r0 * f1 - r1 * f0


@njit(cache=True)
def turned(R, row, local, out):
    """A direction of the body frame in world axes."""
    for k in range(3):
        out[k] = R[row, k, 0] * local[0] + R[row, k, 1] * local[1] + R[row, k, 2] * local[2]


@njit(cache=True)
def split(pa, pb, n, across):
    """Separation pb - pa: returns its part along n, leaves the part across n in `across`."""
    normal = 0.0
    for k in range(3):
        across[k] = pb[k] - pa[k]
        normal += across[k] * n[k]
    for k in range(3):
        across[k] -= normal * n[k]
    return normal


@njit(cache=True)
def dot(a, b):
    """a·b of two vectors (3,)."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(cache=True)
def broken(live, start, largest, df):
    """Live joints all of whose points have failed."""
    dead = np.zeros(len(live), np.bool_)
    for i, j in enumerate(live):
        gone = True
        for p in range(start[j], start[j + 1]):
            if largest[p] < df[j]:
                gone = False
                break
        dead[i] = gone
    return dead


@njit(cache=True)
def joint_openings(live, a, b, start, xi_a, xi_b, weight, normal, x, R, out):
    """Mean normal opening, mean sliding and largest normal opening of joints, out (J, 3) [m]."""
    pa, pb, n = np.empty(3), np.empty(3), np.empty(3)
    for j in live:
        n[:] = R[a[j]] @ normal[j]
        total = open_ = slide = 0.0
        widest = -np.inf
        for p in range(start[j], start[j + 1]):
            place(a[j], R, x, xi_a[p], pa)
            place(b[j], R, x, xi_b[p], pb)
            d = pb - pa
            dn = d[0] * n[0] + d[1] * n[1] + d[2] * n[2]
            s = d - dn * n
            total += weight[p]
            widest = max(widest, dn)
            open_ += weight[p] * dn
            slide += weight[p] * np.sqrt(s[0] ** 2 + s[1] ** 2 + s[2] ** 2)
        out[j, 0], out[j, 1], out[j, 2] = open_ / total, slide / total, widest


@njit(cache=True)
def scatter(states, rows, frame, x, v, R):
    """YADE states (k, 13) of the blocks `rows` (k,) → x (n, 3), v (n, 6), R (n, 3, 3) in the block frames."""
    T = np.empty((3, 3))
    for i in range(len(rows)):
        r = rows[i]
        for k in range(3):
            x[r, k] = states[i, k]
        for k in range(6):
            v[r, k] = states[i, 3 + k]
        rotation_matrix(states[i, 9:13], T)
        for k in range(3):
            for c in range(3):
                R[r, k, c] = T[k, 0] * frame[r, 0, c] + T[k, 1] * frame[r, 1, c] + T[k, 2] * frame[r, 2, c]


@njit(cache=True)
def work_of(F, v_before, v_after, dt):
    """Work [J] of forces F (n, 6) over a leapfrog substep: F·(v⁻ + v⁺)/2 dt, the exact change of kinetic energy."""
    total = 0.0
    for i in range(len(F)):
        for k in range(6):
            total += F[i, k] * (v_before[i, k] + v_after[i, k])
    return 0.5 * total * dt
