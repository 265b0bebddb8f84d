"""Four points of a joint at a time (`kernels/lanes.py`), with the bits of `forces.joint_forces` for each of them.

Most points of most joints move little in a substep and still hold: these are taken here. Where one of four opens by
more than `SLOW` δ_f in the substep, or has failed and may rub, the four are left to the loop over single points.
"""

from __future__ import annotations

from kernels.decorators import inlined
from kernels.lanes import added, any_more, any_not_less, larger, magnitude, parts, taken, together, where_more
from yade_scripts.blocks.kinematics import arm, cross, dot, parting, place
from yade_scripts.joints.arrays import BETA, DF, K0, KC, LAST, MU, NOT_GROWING, OLDER, PULL, SLOW, UNIT
from yade_scripts.joints.kernel import dashpot, split

softened = measure = pace = response = None  # given by `forces.kernels_of`


def softened_fours(unit, r, peak):
    """`forces.softened` of four points."""
    a, b, c, d = parts(r)
    return together(
        softened(unit, a, peak), softened(unit, b, peak), softened(unit, c, peak), softened(unit, d, peak)
    )


def four_points(p, end, four, j, joints, memory, motion, n, eta, dt):
    """The points p, p + 1, ... of the joint j, no more than four and before `end`, number `four` of the fours, in a
    substep dt [s]: tractions and history.

    n: normal of the joint · eta [s] dashpot time
    →   whether they are done · growth of λ/δ_f · force [N] on block a, its moment about the centre, (t_n - k_t δ_n) δ_t
    [N], energy that dashpots take [J], each of the four points
    """
    a, b, law, peak, fours = joints.a, joints.b, joints.law, joints.peak, joints.fours
    largest, paid = memory.largest, memory.paid
    x, v, R = motion
    ra, rb, at = a[j], b[j], 28 * four
    unit, df, beta, k0, kc = law[j, UNIT], law[j, DF], law[j, BETA], law[j, K0], law[j, KC]
    q, r, s4 = min(p + 1, end - 1), min(p + 2, end - 1), min(p + 3, end - 1)
    pa = place(ra, R, x, (taken(fours, at), taken(fours, at + 4), taken(fours, at + 8)))
    pb = place(rb, R, x, (taken(fours, at + 12), taken(fours, at + 16), taken(fours, at + 20)))
    weight = taken(fours, at + 24)
    mid = (0.5 * (pa[0] + pb[0]), 0.5 * (pa[1] + pb[1]), 0.5 * (pa[2] + pb[2]))
    dn, s = split(pa, pb, n)
    ss = dot(s, s)
    before = together(largest[p], largest[q], largest[r], largest[s4])
    last = together(paid[p, LAST], paid[q, LAST], paid[r, LAST], paid[s4, LAST])
    now = measure(dn, ss, beta)
    after = larger(before, now)
    growth, nothing = 0.0, together(0.0, 0.0, 0.0, 0.0)
    lost, zero = nothing, (nothing, nothing, nothing)
    step = magnitude(dn - last)
    turns = any_not_less(where_more(step, magnitude(dn), step, 0.0), SLOW * df)
    if turns or (law[j, MU] > 0.0 and any_not_less(after, df)):
        return False, growth, zero, zero, zero, lost
    ks = softened_fours(unit, after / df, peak)
    grows, w = any_more(now, before), zero
    if grows or eta > 0.0:
        w = parting(ra, rb, x, v, mid)
    if grows:
        move = larger(dt * pace(dn, ss, dot(w, n), dot(w, s), beta), now - before)
        if any_not_less(where_more(now, before, where_more(df, before, move, 0.0), 0.0), SLOW * df):
            return False, growth, zero, zero, zero, lost
        ks = where_more(now, before, where_more(df, before, ks * now / now, ks), ks)
        g0, g1, g2, g3 = parts((after - before) / df)
        growth = max(g0, g1, g2, g3)
    tn, kn, kt = response(ks, dn, ss, after, k0, df, beta, kc)
    t = (tn * n[0] + kt * s[0], tn * n[1] + kt * s[1], tn * n[2] + kt * s[2])
    g = weight * (tn - kt * dn)
    if eta > 0.0:
        c, power = dashpot(eta, kn, kt, w, n)
        lost = weight * power * dt
        t = (t[0] + c[0], t[1] + c[1], t[2] + c[2])
    force = (weight * t[0], weight * t[1], weight * t[2])
    _remember(p, q, r, s4, after, last, dn, largest, paid)
    return True, growth, force, cross(arm(ra, x, mid), force), (g * s[0], g * s[1], g * s[2]), lost


@inlined
def _remember(p, q, r, s, after, last, dn, largest, paid):
    """Write the history of the points p, q, r, s."""
    largest[p], largest[q], largest[r], largest[s] = parts(after)
    paid[p, OLDER], paid[q, OLDER], paid[r, OLDER], paid[s, OLDER] = parts(last)
    paid[p, LAST], paid[q, LAST], paid[r, LAST], paid[s, LAST] = parts(dn)
    paid[p, PULL] = paid[q, PULL] = paid[r, PULL] = paid[s, PULL] = NOT_GROWING


@inlined
def summed(total, of_points, count):
    """A vector and those of the first `count` of four points, added to it one after the other."""
    return (
        added(total[0], of_points[0], count),
        added(total[1], of_points[1], count),
        added(total[2], of_points[2], count),
    )
