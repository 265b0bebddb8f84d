"""Springs, dashpots and friction of contacts that were found: their forces, and what these take.

The force on a at the middle of node and face is

    N n + S,   N = max(0, k δ + c δ'),   S: spring k_t over the slip, |S| ≤ μ N, dashpot c_t while it sticks,

with -(N n + S) on b, so momentum is exact. S is kept in the frame of b, where the normal of a face does not turn; that
of two edges does, and S with it.

A force that acts over a substep of dt is the mean of N over it (`normal_force`), to the second order in dt: the speed
δ' is that at the time of δ, and where contact begins or ends within the substep only the part in contact counts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from kernels.decorators import inlined, inner, kernel
from yade_scripts.contact.arrays import BEGINS

SHARP = 1e-3
"""Sum of the normals of a pair below which they have no mean direction."""
ARRIVED = 1.5
"""Depth in paths of one substep up to which a node counts as having come through the face."""
LEAST_TURN = 1e-4
"""1 - ζ² from which on a contact counts as an oscillator; below, and beyond critical damping, as critically damped."""
CATCH_UP = 0.7
"""Speed in ω times the depth of free flight ahead of the oscillator's that leaves restitution within 0.001 (by
integrating an impact at substeps of 0.05 to 0.2/ω, e of 0.05 to 1, any time of touch)."""
TERMS = 12
"""Of the series of `since_touch`."""
HALVINGS = 50
"""Of the interval in which `take_over` seeks the share of the depths that holds the energy of a joint."""


class Mode(NamedTuple):
    """How a pair moves against its contacts: damping ratio ζ and ω = sqrt(K/m) [rad/s] of all of them together."""

    zeta: float
    omega: float


@inlined
def set_dashpots(bodies, law, a, b, R, rows, first, count, scratch):
    """Dashpots of all contacts of a pair, c = 2 ζ sqrt(m K) k/K with K = Σ k and the effective mass m at their middle.

    So a face, an edge and a corner that land all return e. scratch (5, 3): work space, its first two rows are
    set to the middle of the contacts seen from a and from b   →   (1/m [1/kg], K [N/m])"""
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
    return normal, K


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


@inlined
def apply(slots, state, mode, pair_a, rows, first, crossings, count, scratch):
    """Compute the forces of the contacts first .. count of a pair; → work of friction [J]. pair_a: the first block of
    the pair · crossings: first contact of edges, whose normals turn against both blocks · scratch (6, 3): work space,
    whose first two rows are the middles of the contacts seen from both blocks.

    The work of friction is the distance slipped times the mean of the forces before and after, as the leapfrog scheme
    integrates it. A spring that began within the last substep is stretched only over the time since the touch, and acts
    for half of that time and half a substep. The history is left unchanged if the contacts are only read
    (state.dt = 0)."""
    v, R, dt, last_dt = state.v, state.R, state.dt, state.last_dt
    lost, w, S, n, old = 0.0, scratch[2], scratch[3], scratch[4], scratch[5]
    for c in range(first, count):
        a, b, s = np.uint32(rows.a[c]), np.uint32(rows.b[c]), np.uint32(rows.slot[c])
        w[0], w[1], w[2] = slip(v, a, b, rows.arm_a[c], rows.arm_b[c])
        for k in range(3):
            n[k] = rows.normal[c, k]
        wn = w[0] * n[0] + w[1] * n[1] + w[2] * n[2]
        if count - first > 1 and slots.spread[s] < 1.0:
            middle = scratch[0] if a == pair_a else scratch[1]
            set_shift(rows, c, middle, slots.spread[s] - 1.0)
            turn_slip(v, a, b, rows.shift[c], n, w)
        else:
            rows.shift[c, 0] = rows.shift[c, 1] = rows.shift[c, 2] = 0.0
        touched = dt
        if dt == 0.0:
            N = max(0.0, rows.kn[c] * rows.depth[c] - rows.cn[c] * wn)
        else:
            if slots.push[s] == BEGINS and wn < 0.0:
                touched = min(dt, rows.depth[c] / -wn)
            N = normal_force(slots, s, rows, c, -wn, dt, last_dt, mode)
        spring = rows.kn[c] * rows.depth[c]
        size = before = 0.0
        rows.held[c] = 0.0
        for k in range(3):
            old[k] = (
                R[b, k, 0] * slots.shear[s, 0]
                + R[b, k, 1] * slots.shear[s, 1]
                + R[b, k, 2] * slots.shear[s, 2]
            )
        if c >= crossings:
            _turn_into_face(old, n)
        for k in range(3):
            rows.velocity[c, k] = w[k]
            S[k] = old[k] - touched * rows.kt[c] * (w[k] - wn * n[k])
            rows.held[c] += 0.5 * old[k] * (old[k] / rows.kt[c] - last_dt * (w[k] - wn * n[k]))
            size += S[k] ** 2
            before += S[k] * old[k]
        size, limit = np.sqrt(size), rows.mu[c] * N
        sticks = size < limit
        if not sticks and size > 0.0:
            lost += 0.5 * (limit + before / size) * (size - limit) / rows.kt[c]
            for k in range(3):
                S[k] *= limit / size
                lost -= 0.5 * (dt - touched) * S[k] * w[k]
        share = 0.5 * (1.0 + touched / dt) if sticks and dt > 0.0 else 1.0
        for k in range(3):
            viscous = -rows.ct[c] * (w[k] - wn * n[k]) if sticks else 0.0
            rows.shear[c, k] = S[k]
            rows.viscous[c, k] = viscous + (N - spring) * n[k]
            rows.force[c, k] = spring * n[k] + share * S[k] + rows.viscous[c, k]
        if not sticks:
            rows.ct[c] = 0.0
        if dt > 0.0:
            for k in range(3):
                slots.shear[s, k] = R[b, 0, k] * S[0] + R[b, 1, k] * S[1] + R[b, 2, k] * S[2]
        rows.push[c] = N
    return lost if dt > 0.0 else 0.0


@inner
def _turn_into_face(S, n):
    """Turn the force S (3,) of a spring until it is perpendicular to the normal n (3,), with the energy that it holds.
    What is along n would do work that no spring gives."""
    along = S[0] * n[0] + S[1] * n[1] + S[2] * n[2]
    size = S[0] ** 2 + S[1] ** 2 + S[2] ** 2
    across = size - along * along
    if across <= 0.0:
        return
    share = np.sqrt(size / across)
    for k in range(3):
        S[k] = share * (S[k] - along * n[k])


@inner
def add_up(rows, c, F, S):
    """Add the force of the contact c and its moments to F (n, 6); S (3,): work space."""
    for k in range(3):
        S[k] = rows.force[c, k] - rows.push[c] * rows.normal[c, k]
    _add(F, rows.a[c], 1.0, rows.force[c], rows.arm_a[c], S, rows.shift[c])
    _add(F, rows.b[c], -1.0, rows.force[c], rows.arm_b[c], S, rows.shift[c])


@inner
def set_shift(rows, c, middle, share):
    """Set the way from a contact to where it rubs: along the face, `share` of its arm from the middle (3,) of all
    contacts of the pair, seen from the block of the node."""
    across = 0.0
    for k in range(3):
        rows.shift[c, k] = share * (rows.arm_a[c, k] - middle[k])
        across += rows.shift[c, k] * rows.normal[c, k]
    for k in range(3):
        rows.shift[c, k] -= across * rows.normal[c, k]


@inner
def turn_slip(v, a, b, shift, n, w):
    """Take the velocity w (3,) of a against b to a place `shift` further along the face; its part along n stays."""
    w0 = (v[a, 4] - v[b, 4]) * shift[2] - (v[a, 5] - v[b, 5]) * shift[1]
    w1 = (v[a, 5] - v[b, 5]) * shift[0] - (v[a, 3] - v[b, 3]) * shift[2]
    w2 = (v[a, 3] - v[b, 3]) * shift[1] - (v[a, 4] - v[b, 4]) * shift[0]
    along = w0 * n[0] + w1 * n[1] + w2 * n[2]
    w[0] += w0 - along * n[0]
    w[1] += w1 - along * n[1]
    w[2] += w2 - along * n[2]


@inner
def normal_force(slots, s, rows, c, closing, dt, last_dt, mode):
    """Mean of N over the substep of dt around the present time [N]; closing [m/s]: speed half a substep ago.

    A contact that has begun in the last substep moves as a linear oscillator since then; that its depth is of a free
    flight is made good by a lower speed. Later the speed at the present
    time is w + (w - w')/2 + (N' - N) dt/(2 m), w' and N' of the substep before, which makes

        N = [k δ + c (3 w - w')/2 + q N']/(1 + q),   q = c dt/(2 m) = ζ ω dt.

    Where N falls to zero before the end of the next substep, as an oscillator does that went from N' to N, what is
    left of its fall pushes."""
    k, depth = rows.kn[c], rows.depth[c]
    if slots.push[s] == BEGINS:
        if 0.0 < depth <= 1.01 * ARRIVED * last_dt * closing:
            path, _ = since_touch(mode.zeta, mode.omega * depth / closing)
            _, speed = since_touch(mode.zeta, mode.omega * (depth / closing + 0.5 * dt))
            ahead = depth - path * closing / mode.omega
            N = k * (closing * (1.0 - speed) + CATCH_UP * mode.omega * ahead) / (mode.omega**2 * dt)
        else:
            N = max(0.0, k * depth + rows.cn[c] * closing)
        slots.push[s] = N
    else:
        q, push = mode.zeta * mode.omega * dt, slots.push[s]
        N = (k * depth + rows.cn[c] * (1.5 * closing - 0.5 * slots.speed[s]) + q * push) / (1.0 + q)
        N = max(N, 0.0)
        slots.push[s] = N
        phase = mode.omega * dt
        if 0.0 < (2.0 - phase * phase) * N < push:  # else it is the next one's to end
            left, ends = rest_of_the_fall(mode.zeta, phase, push / N)
            if ends:
                N *= left
                slots.push[s] = 0.0
    slots.speed[s] = closing
    return N


@inner
def rest_of_the_fall(zeta, phase, before):
    """Of a force that falls as that of an oscillator of damping ratio zeta, A e^(ζωτ) sin(ω'τ) at a time τ before it
    ends with ω' = ω sqrt(1 - ζ²), and that was `before` times the present one a substep ago, ω dt = phase:

    → (impulse from half a substep ago to its end, over the present force and dt · whether it ends within a substep)"""
    turn = np.sqrt(max(1.0 - zeta * zeta, LEAST_TURN))
    step, growth = turn * phase, zeta / turn
    now = np.arctan2(np.sin(step), before * np.exp(-zeta * phase) - np.cos(step))
    if now >= step:
        return 1.0, False
    start = now + 0.5 * step
    impulse = np.exp(growth * start) * (growth * np.sin(start) - np.cos(start)) + 1.0
    return impulse / ((1.0 + growth * growth) * step * np.exp(growth * now) * np.sin(now)), True


@inner
def since_touch(zeta, phase):
    """Depth in v/ω and speed in v of a mass with spring and dashpot that touched with v at the phase ωt = 0.

    Power series of u'' + 2 ζ u' + u = 0."""
    slope, bend, term = 1.0, -2.0 * zeta, 1.0
    path = 0.0
    speed = 0.0
    for i in range(TERMS):
        speed += slope * term
        term *= phase / (i + 1.0)
        path += slope * term
        slope, bend = bend, -2.0 * zeta * bend - slope
    return path, speed


@inner
def _add(F, row, sign, force, arm, shear, shift):
    """Force and its moment about the centre, of which the part `shear` acts `shift` further on; F has rows for blocks
    only."""
    if row >= len(F):
        return
    f0, f1, f2 = sign * force[0], sign * force[1], sign * force[2]
    F[row, 0] += f0
    F[row, 1] += f1
    F[row, 2] += f2
    s0, s1, s2 = sign * shear[0], sign * shear[1], sign * shear[2]
    F[row, 3] += arm[1] * f2 - arm[2] * f1 + shift[1] * s2 - shift[2] * s1
    F[row, 4] += arm[2] * f0 - arm[0] * f2 + shift[2] * s0 - shift[0] * s2
    F[row, 5] += arm[0] * f1 - arm[1] * f0 + shift[0] * s1 - shift[1] * s0


@kernel
def contact_work(rows, count, v, given, dt):
    """Work of the contacts over the substep that ended with velocities v (n+m, 6): F·(w⁻ + w⁺)/2 dt is the exact change
    of kinetic energy in the leapfrog. given (n+m,) bool: bodies of prescribed motion.

    Springs hold energy from the time at which they touch until they part: what the leapfrog counts beyond these, in the
    substeps in which they do, is taken back.

    → (taken by dashpots, put in by what moves the driven bodies) [J]
    """
    dashpot = driving = 0.0
    w = np.empty(3)
    for c in range(count):
        a, b = rows.a[c], rows.b[c]
        w[0], w[1], w[2] = slip(v, a, b, rows.arm_a[c], rows.arm_b[c])
        turn_slip(v, a, b, rows.shift[c], rows.normal[c], w)
        came = goes = 0.0
        for k in range(3):
            dashpot -= 0.5 * rows.viscous[c, k] * (rows.velocity[c, k] + w[k]) * dt
            came -= rows.velocity[c, k] * rows.normal[c, k] * dt
            goes -= w[k] * rows.normal[c, k] * dt
        depth = rows.depth[c]
        dashpot += 0.5 * rows.kn[c] * depth * (min(depth + goes, 0.0) - min(depth - came, 0.0))
        if given[a]:
            driving -= _power(rows, c, rows.arm_a[c], v[a]) * dt
        if given[b]:
            driving += _power(rows, c, rows.arm_b[c], v[b]) * dt
    return dashpot, driving


@inner
def _power(rows, c, arm, v):
    """Power of the force on a of a contact at its place on a body that moves with v (6,) [W]."""
    f, n, shift = rows.force[c], rows.normal[c], rows.shift[c]
    N = f[0] * n[0] + f[1] * n[1] + f[2] * n[2]
    u0 = v[0] + v[4] * arm[2] - v[5] * arm[1]
    u1 = v[1] + v[5] * arm[0] - v[3] * arm[2]
    u2 = v[2] + v[3] * arm[1] - v[4] * arm[0]
    s0 = (f[0] - N * n[0]) * (v[4] * shift[2] - v[5] * shift[1])
    s1 = (f[1] - N * n[1]) * (v[5] * shift[0] - v[3] * shift[2])
    s2 = (f[2] - N * n[2]) * (v[3] * shift[1] - v[4] * shift[0])
    return f[0] * u0 + f[1] * u1 + f[2] * u2 + s0 + s1 + s2


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
def take_over(slots, rows, first, count, force, held, state):
    """Begin the contacts first .. count of a pair, which have their whole depth, with the normal force [N] of the joint
    that has just failed there and with no more energy than its springs held [J]; contacts that are too soft for that
    keep their whole depth. → energy lost [J], at the time of the velocities half a substep ago.

    Nodes lie on the rim of a face, where a joint that was bent is deeper than on average: with the force of the joint
    they could hold more than it did."""
    full = 0.0
    for c in range(first, count):
        full += rows.kn[c] * rows.depth[c]
    if full <= 0.0:
        return held
    share = min(force / full, 1.0)
    if _stored(rows, first, count, share, state) > held:
        low, high = 0.0, share
        for _ in range(HALVINGS):
            share = 0.5 * (low + high)
            if _stored(rows, first, count, share, state) > held:
                high = share
            else:
                low = share
        share = low
    left = held - _stored(rows, first, count, share, state)
    for c in range(first, count):
        rest = (1.0 - share) * rows.depth[c]
        slots.rest[rows.slot[c]] = rest
        rows.depth[c] -= rest  # to the last bit as when the contact is read again
    return left


@inner
def _stored(rows, first, count, share, state):
    """Energy [J] in the springs of contacts with a share of their depths, half a substep ago."""
    total = 0.0
    for c in range(first, count):
        w = slip(state.v, rows.a[c], rows.b[c], rows.arm_a[c], rows.arm_b[c])
        n, u = rows.normal[c], share * rows.depth[c]
        into = -state.last_dt * (w[0] * n[0] + w[1] * n[1] + w[2] * n[2])
        total += 0.5 * rows.kn[c] * u * max(u - into, 0.0)
    return total


@inner
def release(slots, s, shear, depth, way, R, b):
    """End a contact; → energy [J] left in its springs, which is lost, at the time of the velocities half a substep ago.

    depth [m]: now · way (2, 3) [m]: motion over the last substep from `way_of`, by which the springs were shorter
    then."""
    u, k_t, left = max(depth - slots.rest[s], 0.0), shear * slots.k[s], 0.0
    for k in range(3):
        S = R[b, k, 0] * slots.shear[s, 0] + R[b, k, 1] * slots.shear[s, 1] + R[b, k, 2] * slots.shear[s, 2]
        left += 0.5 * S * (S / k_t - way[0, k])
    into = way[1, 0]
    left += 0.5 * slots.k[s] * u * max(u - into, 0.0)
    slots.face[s], slots.rest[s] = -1, 0.0
    return left


@inner
def way_of(state, a, b, xi0, xi1, xi2, plane, scratch, way):
    """Set way[0] [m] to how far a point ξ of a moved along a face of b in the last substep, and way[1, 0] to how far it
    moved into the face, whose normal in the frame of a is plane[:3]. scratch (3, 3): work space."""
    x, R = state.x, state.R
    arm, point, n = scratch[0], scratch[1], scratch[2]
    for k in range(3):
        arm[k] = R[a, k, 0] * xi0 + R[a, k, 1] * xi1 + R[a, k, 2] * xi2
        point[k] = x[a, k] + arm[k] - x[b, k]
        n[k] = R[a, k, 0] * plane[0] + R[a, k, 1] * plane[1] + R[a, k, 2] * plane[2]
    w = slip(state.v, a, b, arm, point)
    wn = w[0] * n[0] + w[1] * n[1] + w[2] * n[2]
    way[1, 0] = -state.last_dt * wn
    for k in range(3):
        way[0, k] = state.last_dt * (w[k] - wn * n[k])
