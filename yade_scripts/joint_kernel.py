"""The loop over joints: positions and velocities of the blocks → joint forces, damage and energies.

A point of a joint sits at ξ_a in block a and ξ_b in block b (or at a fixed place). With the separation
d = x_b - x_a, the normal n turning with block a:  δ_n = d·n, δ_t = d - δ_n n. The traction acts on both blocks at the
mid point of the pair, so linear and angular momentum are exact. Absolute positions: no incremental drift.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from yade_scripts.cohesion import dissipated, secant_stiffness, step_stiffness

STORED, DISSIPATED, DAMPED = 0, 1, 2
"""Columns of the energies of a joint [J]."""


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
def point_velocity(row, x, v, at, out):
    """Velocity of the body point now at `at`; v (n, 6) [v, ω]."""
    if row < 0:
        out[:] = 0.0
        return
    r0, r1, r2 = at[0] - x[row, 0], at[1] - x[row, 1], at[2] - x[row, 2]
    out[0] = v[row, 0] + v[row, 4] * r2 - v[row, 5] * r1
    out[1] = v[row, 1] + v[row, 5] * r0 - v[row, 3] * r2
    out[2] = v[row, 2] + v[row, 3] * r1 - v[row, 4] * r0


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
def joint_forces(
    live,
    a,
    b,
    start,
    xi_a,
    xi_b,
    weight,
    normal,
    k0,
    df,
    beta,
    kc,
    closing,
    eta,
    x,
    v,
    R,
    largest,
    dt,
    advance,
    F,
    energy,
):
    """Forces of the live joints on the blocks; with `advance` also their history and energies.

    live (l,) joints to visit · a, b (J,) rows · start (J+1,) first point of a joint · xi_a, xi_b (P, 3) [m]
    weight (P,) [m²] · normal (J, 3) in block a · k0, df, beta, kc (J,) law · closing (J,) bool: carries compression
    eta [s] dashpot time · x (n, 3), v (n, 6), R (n, 3, 3) · largest (P,) λ [m] · F (n, 6) is added to
    energy (J, 3): STORED now; DISSIPATED now; DAMPED summed over dt   →   largest growth of λ/δ_f in this call
    """
    pa, pb, mid, n, t = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    va, vb = np.empty(3), np.empty(3)
    fastest = 0.0
    for j in live:
        ra, rb = a[j], b[j]
        for k in range(3):
            n[k] = R[ra, k, 0] * normal[j, 0] + R[ra, k, 1] * normal[j, 1] + R[ra, k, 2] * normal[j, 2]
        stored = lost = damped = 0.0
        for p in range(start[j], start[j + 1]):
            place(ra, R, x, xi_a[p], pa)
            place(rb, R, x, xi_b[p], pb)
            d0, d1, d2 = pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2]
            dn = d0 * n[0] + d1 * n[1] + d2 * n[2]
            s0, s1, s2 = d0 - dn * n[0], d1 - dn * n[1], d2 - dn * n[2]
            ss = s0 * s0 + s1 * s1 + s2 * s2
            opening = np.sqrt(max(dn, 0.0) ** 2 + beta[j] ** 2 * ss)
            before = largest[p]
            after = max(before, opening)
            ks = step_stiffness(before, after, k0[j], df[j]) if before < df[j] else 0.0
            kn = ks if dn > 0.0 else (kc[j] if closing[j] else 0.0)
            kt = beta[j] ** 2 * ks
            t[0], t[1], t[2] = kn * dn * n[0] + kt * s0, kn * dn * n[1] + kt * s1, kn * dn * n[2] + kt * s2
            for k in range(3):
                mid[k] = 0.5 * (pa[k] + pb[k])
            if eta > 0.0:
                point_velocity(ra, x, v, mid, va)
                point_velocity(rb, x, v, mid, vb)
                w0, w1, w2 = vb[0] - va[0], vb[1] - va[1], vb[2] - va[2]
                wn = w0 * n[0] + w1 * n[1] + w2 * n[2]
                power = (kn - kt) * wn * wn + kt * (w0 * w0 + w1 * w1 + w2 * w2)
                damped += weight[p] * eta * power * dt
                for k, wk in enumerate((w0, w1, w2)):
                    t[k] += eta * ((kn - kt) * wn * n[k] + kt * wk)
            for k in range(3):
                t[k] *= weight[p]
            add_force(ra, 1.0, t, mid, x, F)
            add_force(rb, -1.0, t, mid, x, F)
            if advance:
                fastest = max(fastest, (after - before) / df[j])
                largest[p] = after
                k_left = secant_stiffness(after, k0[j], df[j])
                k_open = k_left if dn > 0.0 else (kc[j] if closing[j] else 0.0)
                stored += 0.5 * weight[p] * (k_open * dn * dn + beta[j] ** 2 * k_left * ss)
                lost += weight[p] * dissipated(after, k0[j], df[j])
        if advance:
            energy[j, 0], energy[j, 1] = stored, lost
            energy[j, 2] += damped
    return fastest


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
def stored_between(
    live, a, b, start, xi_a, xi_b, weight, normal, k0, df, beta, kc, closing, largest, x, R, x0, R0
):
    """Elastic energy [J] of the live joints half a substep before (x, R), between it and the earlier place (x0, R0).

    Leapfrog conserves kinetic(t + dt/2) + 1/2 k δ(t)·δ(t + dt) exactly, so the product of the two openings is used.
    """
    pa, pb, n, n0, d, e = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    total = 0.0
    for j in live:
        turned(R, a[j], normal[j], n)
        turned(R0, a[j], normal[j], n0)
        for p in range(start[j], start[j + 1]):
            place(a[j], R, x, xi_a[p], pa)
            place(b[j], R, x, xi_b[p], pb)
            dn = split(pa, pb, n, d)
            place(a[j], R0, x0, xi_a[p], pa)
            place(b[j], R0, x0, xi_b[p], pb)
            en = split(pa, pb, n0, e)
            slide = d[0] * e[0] + d[1] * e[1] + d[2] * e[2]
            ks = secant_stiffness(largest[p], k0[j], df[j])
            kn = ks if dn + en > 0.0 else (kc[j] if closing[j] else 0.0)
            total += 0.5 * weight[p] * (kn * dn * en + beta[j] ** 2 * ks * slide)
    return total


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
