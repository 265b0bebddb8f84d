"""Kinematics of the points of joints: positions, rates of separation, openings, and forces on the blocks. No law enters
here.

A point of a joint sits at ξ_a in block a and ξ_b in block b (or at a fixed place). With the separation d = x_b - x_a
and the normal n half way between those that turn with block a and block b:  δ_n = d·n, δ_t = d - δ_n n. The traction
acts on both blocks at the mid point of the pair, so linear and angular momentum are exact. At the mid point the
velocities differ by the rate of d as seen from axes that turn with the mean of both spins ω, d' - ω x d. The normal n
turns with these axes only as long as the blocks have turned alike; beyond that by the rate of its energy (t_n - k_t
δ_n) δ_t·n' a pair of moments belongs to every point,

    on a and -on b:   -1/2 (n_a - n_b)/|n_a + n_b| x (t_n - k_t δ_n) δ_t

with which energy is exact for any turn of the blocks. (With a normal that turns with block a alone, pressed joints that
shear while their blocks spin gained or lost a hundredth of their stored energy; without the moments 6e-5 of it, a
thirteenth of G_c in a wall that flies apart at 100 m/s.) Separations are computed from absolute positions, so they
do not drift."""

from __future__ import annotations

import numpy as np

from kernels.decorators import inlined, kernel, plain
from kernels.lanes import for_both
from yade_scripts.blocks.kinematics import add_forces, dot, parting, place, turned
from yade_scripts.joints.arrays import DF


@for_both
def split(pa, pb, n):
    """Normal component of the separation pb - pa along n, and its tangential part as a tuple."""
    d = (pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2])
    dn = dot(d, n)
    return dn, (d[0] - dn * n[0], d[1] - dn * n[1], d[2] - dn * n[2])


@plain
def facing(a, b, R, normal):
    """Present normal of a joint as a tuple: half way between n_a = normal[0], turned with block a, and n_b = normal[1],
    turned with b."""
    n, _ = facing_and_lean(a, b, R, normal)
    return n


@inlined
def facing_and_lean(a, b, R, normal):
    """As `facing`, and (n_a - n_b)/|n_a + n_b| as a tuple, 0 where the blocks are half a turn apart."""
    n = turned(a, R, normal[0])
    k = turned(b, R, normal[1]) if b >= 0 else (normal[1, 0], normal[1, 1], normal[1, 2])
    m0, m1, m2 = n[0] + k[0], n[1] + k[1], n[2] + k[2]
    size = np.sqrt(m0 * m0 + m1 * m1 + m2 * m2)
    if size == 0.0:
        return n, (0.0, 0.0, 0.0)
    return (m0 / size, m1 / size, m2 / size), (
        (n[0] - k[0]) / size,
        (n[1] - k[1]) / size,
        (n[2] - k[2]) / size,
    )


@for_both
def dashpot(eta, kn, kt, w, n):
    """Traction η (k_n w_n n + k_t w_t) of the relative velocity w as a tuple, and its power [W/m²]."""
    wn = dot(w, n)
    along, across = eta * (kn - kt) * wn, eta * kt
    t = (along * n[0] + across * w[0], along * n[1] + across * w[1], along * n[2] + across * w[2])
    return t, dot(t, w)


@plain
def add_up(live, a, b, x, given, F):
    """Add the forces and moments of the live joints on their blocks a, given (l, 6), to F (n, 6) in their order."""
    for i, j in enumerate(live):
        f = (given[i, 0], given[i, 1], given[i, 2])
        add_forces(a[j], b[j], x, f, (given[i, 3], given[i, 4], given[i, 5]), F)


@kernel
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


@kernel
def holding(live, start, largest, most):
    """Whether no point of the live joints has opened beyond most (J,) [m]."""
    for j in live:
        for p in range(start[j], start[j + 1]):
            if largest[p] > most[j]:
                return False
    return True


@kernel
def pace(live, joints, motion):
    """Largest relative speed of the points of the live joints, over the opening at failure [1/s]; joints: JointPoints,
    motion: Placement."""
    a, b, start, xi_a = joints.a, joints.b, joints.start, joints.xi_a
    x, v, R = motion.x, motion.v, motion.R
    largest = 0.0
    for j in live:
        for p in range(start[j], start[j + 1]):
            apart = parting(a[j], b[j], x, v, place(a[j], R, x, xi_a[p]))
            largest = max(largest, np.sqrt(dot(apart, apart)) / joints.law[j, DF])
    return largest


@plain
def joint_openings(live, joints, x, R, out):
    """Mean normal opening, mean sliding, largest normal opening and mean overlap of joints, out (J, 4) [m]; joints:
    JointPoints."""
    a, b, start, weight, normal = joints.a, joints.b, joints.start, joints.weight, joints.normal
    xi_a, xi_b = joints.xi_a, joints.xi_b
    for j in live:
        n = facing(a[j], b[j], R, normal[j])
        total = open_ = slide = over = 0.0
        widest = -np.inf
        for p in range(start[j], start[j + 1]):
            dn, s = split(place(a[j], R, x, xi_a[p]), place(b[j], R, x, xi_b[p]), n)
            total += weight[p]
            widest = max(widest, dn)
            open_ += weight[p] * dn
            over += weight[p] * max(-dn, 0.0)
            slide += weight[p] * np.sqrt(dot(s, s))
        out[j, 0], out[j, 1], out[j, 2], out[j, 3] = open_ / total, slide / total, widest, over / total
