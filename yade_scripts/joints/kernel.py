"""Points of joints in the world: where they are, how fast they part, forces on the blocks, openings; no law.

A point of a joint sits at ξ_a in block a and ξ_b in block b (or at a fixed place). With the separation
d = x_b - x_a, the normal n turning with block a:  δ_n = d·n, δ_t = d - δ_n n. The traction acts on both blocks at the
mid point of the pair, so linear and angular momentum are exact. Absolute positions: no incremental drift.
"""

from __future__ import annotations

import numpy as np

from kernel_decorators import kernel, plain
from yade_scripts.blocks.kinematics import dot, place, turned


@plain
def split(pa, pb, n):
    """Separation pb - pa: its part along n, and what is left across n as a tuple."""
    d = (pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2])
    dn = dot(d, n)
    return dn, (d[0] - dn * n[0], d[1] - dn * n[1], d[2] - dn * n[2])


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


@plain
def joint_openings(live, joints, x, R, out):
    """Mean normal opening, mean sliding and largest normal opening of joints, out (J, 3) [m]; joints: JointPoints."""
    a, b, start, weight, normal = joints.a, joints.b, joints.start, joints.weight, joints.normal
    xi_a, xi_b = joints.xi_a, joints.xi_b
    for j in live:
        n = turned(a[j], R, normal[j])
        total = open_ = slide = 0.0
        widest = -np.inf
        for p in range(start[j], start[j + 1]):
            dn, s = split(place(a[j], R, x, xi_a[p]), place(b[j], R, x, xi_b[p]), n)
            total += weight[p]
            widest = max(widest, dn)
            open_ += weight[p] * dn
            slide += weight[p] * np.sqrt(dot(s, s))
        out[j, 0], out[j, 1], out[j, 2] = open_ / total, slide / total, widest
