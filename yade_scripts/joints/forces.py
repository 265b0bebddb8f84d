"""Joints with their law: forces, damage, energies and stiffness, compiled for each law and mixed mode.

Law and mixed mode are compiled into the kernels that need them (`kernels_of`). Work of separation at any speed: the
force F_n of a leapfrog substep does the work F_n·(δ_{n+1} - δ_{n-1})/2, half over the move before it, half over the
move after it. While λ grows, every point keeps the work W* that it has taken, and its traction is

    τ_n = [W(λ_n + Δ/2) - W*]/Δ,   Δ = λ_n - λ_{n-1},      W* ← W* + τ_{n-1} Δ/2 before,  W* + τ_n Δ/2 after

so that a joint torn in a few substeps, or in one, takes G_c. For Δ << δ_f that is T(λ_n); there T itself is used, with
the weight 1 - min(1, (8 Δ/δ_f)²), since the account would amplify what a vibrating joint gains from round to round.

The normal traction is that of a spring through δ_n = 0 and of one, k, on the stiffer side alone. The second holds
k δ_n δ_{n+1}/2 half a substep after n while both are on its side, and nothing otherwise. Its force that gives this
difference is k δ_n times (1 + |δ_n|/Δ)/2 where the point came to this side within the last substep or leaves it within
the next, |δ_n| < Δ. What a closed point gives beyond δ_n = 0 as it opens, W* takes back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from kernels.decorators import plain
from kernels.lanes import LANES, added
from yade_scripts.blocks.kinematics import arm, cross, dot, parting, place, turned
from yade_scripts.joints import laws, mixed_modes
from yade_scripts.joints.arrays import (
    BETA,
    DF,
    K0,
    KC,
    LAST,
    MU,
    NOT_GROWING,
    OLDER,
    PULL,
    SLOW,
    UNIT,
    WORK,
)
from yade_scripts.joints.fours import four_points, softened_fours, summed
from yade_scripts.joints.kernel import dashpot, facing, facing_and_lean, split
from yade_scripts.joints.law import CohesiveLaw
from yade_scripts.joints.specialise import source_checksum, specialised

STICKS = 1.0 - 1e-9
"""Share of μ |t_n| below which a failed point sticks."""
SHARP = 8.0
"""The mean traction has its full weight from Δ = δ_f/SHARP on."""

secant = work = measure = pace = response = stored = None  # given by `kernels_of`


@plain
def fast(move, df):
    """Weight of what belongs to the moves of a substep, here of `move` [m], instead of to its time alone."""
    return min(1.0, (SHARP * move / df) ** 2) if abs(move) >= SLOW * df else 0.0


@plain
def beyond_the_kink(dn, move, df):
    """Part [m] of δ_n that does not count for a spring on one side of δ_n = 0, as the point is on the other side half a
    substep before or after: moves of `move` [m] a substep."""
    size, way = abs(move), abs(dn)
    return 0.5 * dn * (1.0 - way / size) * fast(size, df) if size > way else 0.0


@plain
def given_beyond(dn, last, older, ks, kc, df):
    """Energy [J/m²] that a point closed in the last substep, δ_n = `last`, and open now, dn, has taken since δ_n = 0:
    what its spring held half a substep before `last`, less the work of its force then."""
    held = (kc if older < 0.0 else min(ks, kc)) * last * older
    traction = kc * last - max(kc - ks, 0.0) * beyond_the_kink(last, last - older, df)
    return 0.5 * (held + traction * (dn - older))


@plain
def rubbing(s, s0, k, limit, move):
    """Friction of a failed point that is pressed: a spring of k [Pa/m] from where it last stuck, s0, to the sliding s
    now [m], at most `limit` [Pa]; move (3,) [m]: sliding over the last substep.

    → traction on a as a tuple, and what friction took [J/m²]: the slip times the mean traction before and after"""
    S = (k * (s[0] - s0[0]), k * (s[1] - s0[1]), k * (s[2] - s0[2]))
    size = np.sqrt(dot(S, S))
    if size <= limit:
        return S, 0.0
    share = limit / size
    before = size - k * dot(S, move) / size
    return (share * S[0], share * S[1], share * S[2]), 0.5 * (limit + before) * (size - limit) / k


@plain
def stuck_at(s, S, k, row, R, out):
    """Where a point sticks, s - S/k [m], in the frame of a block."""
    a0, a1, a2 = s[0] - S[0] / k, s[1] - S[1] / k, s[2] - S[2] / k
    for c in range(3):
        out[c] = R[row, 0, c] * a0 + R[row, 1, c] * a1 + R[row, 2, c] * a2


# ---- with a law: `secant` and `work` are its functions, the others those of the mixed mode ----------------------


def softened(unit, r, peak):
    """k_s [Pa/m] at λ/δ_f = r, zero beyond failure."""
    return unit * secant(r, peak) if r < 1.0 else 0.0


def separation_work(unit, df, r, peak):
    """W [J/m²] at λ/δ_f = r, G_c beyond failure."""
    return unit * df * df * work(min(r, 1.0), peak)


def torn_traction(before, now, move, ks, dn, kc, unit, df, peak, paid):
    """Traction [Pa] of a substep in which λ grows from `before` to `now`, the measure by `move`; paid (4,) changes."""
    move = max(move, now - before)
    if move < SLOW * df:
        paid[PULL] = NOT_GROWING
        return ks * now
    if paid[PULL] == NOT_GROWING:
        was = max(now - move, 0.0)
        k = softened(unit, before / df, peak)
        paid[PULL] = k * was
        paid[WORK] = separation_work(unit, df, before / df, peak) - 0.5 * k * (before * before - was * was)
    if paid[LAST] < 0.0 < dn:
        k = softened(unit, before / df, peak)
        paid[WORK] += given_beyond(dn, paid[LAST], paid[OLDER], k, kc, df)
    paid[WORK] += 0.5 * paid[PULL] * move
    mean = max(separation_work(unit, df, (now + 0.5 * move) / df, peak) - paid[WORK], 0.0) / move
    share = fast(move, df)
    pull = (1.0 - share) * ks * now + share * mean
    paid[WORK] += 0.5 * pull * move
    paid[PULL] = pull
    return pull


def joint_forces(begin, end, live, joints, memory, motion, eta, dt, advance, given, taken_by):
    """Forces of a range of the live joints on their blocks; with `advance` also their history and what their dashpots
    take.

    live (l,) joints to visit · joints: JointPoints · memory: PointMemory · motion: Motion · eta [s] dashpot time ·
    dt [s] · given (l, 6): force and moment on block a about its centre, filled · taken_by: Taken, is added to
    →   largest growth of λ/δ_f in this call
    """
    a, b, start, xi_a, xi_b, weight, normal, law, peak, _, first_four = joints
    largest, paid, rub = memory
    x, v, R = motion
    damped, rubbed = taken_by
    fastest = 0.0
    for i in range(begin, end):
        j = live[i]
        ra, rb = a[j], b[j]
        unit, df, beta, k0 = law[j, UNIT], law[j, DF], law[j, BETA], law[j, K0]
        kc = law[j, KC]
        n, lean = facing_and_lean(ra, rb, R, normal[j])
        f0 = f1 = f2 = m0 = m1 = m2 = g0 = g1 = g2 = 0.0
        last = start[j + 1]
        for four, first in enumerate(range(start[j], last, LANES)):
            if advance and dt > 0.0:
                done, growth, force, moment, side, lost = four_points(
                    first, last, first_four[j] + four, j, joints, memory, motion, n, eta, dt
                )
                if done:
                    count = min(LANES, last - first)
                    fastest = max(fastest, growth)
                    f0, f1, f2 = summed((f0, f1, f2), force, count)
                    m0, m1, m2 = summed((m0, m1, m2), moment, count)
                    g0, g1, g2 = summed((g0, g1, g2), side, count)
                    if eta > 0.0:
                        damped[j] = added(damped[j], lost, count)
                    continue
            for p in range(first, min(first + LANES, last)):
                pa, pb = place(ra, R, x, xi_a[p]), place(rb, R, x, xi_b[p])
                mid = (0.5 * (pa[0] + pb[0]), 0.5 * (pa[1] + pb[1]), 0.5 * (pa[2] + pb[2]))
                dn, s = split(pa, pb, n)
                ss = dot(s, s)
                before, now = largest[p], measure(dn, ss, beta)
                after = max(before, now)
                ks = softened(unit, after / df, peak)
                if advance:
                    largest[p] = after
                    fastest = max(fastest, (after - before) / df)
                    if before < now and before < df and dt > 0.0:
                        w = parting(ra, rb, x, v, mid)
                        move = dt * pace(dn, ss, dot(w, n), dot(w, s), beta)
                        ks = torn_traction(before, now, move, ks, dn, kc, unit, df, peak, paid[p]) / now
                    else:
                        paid[p, PULL] = NOT_GROWING
                tn, kn, kt = response(ks, dn, ss, after, k0, df, beta, kc)
                if advance:
                    one_sided = kc - ks if dn < 0.0 else ks - kc
                    if one_sided > 0.0 and dt > 0.0 and (dn < 0.0 or paid[p, PULL] == NOT_GROWING):
                        tn -= one_sided * beyond_the_kink(dn, dn - paid[p, LAST], df)
                    paid[p, OLDER] = paid[p, LAST]
                    paid[p, LAST] = dn
                t0, t1, t2 = tn * n[0] + kt * s[0], tn * n[1] + kt * s[1], tn * n[2] + kt * s[2]
                g = weight[p] * (tn - kt * dn)
                g0, g1, g2 = g0 + g * s[0], g1 + g * s[1], g2 + g * s[2]
                if eta > 0.0:
                    c, power = dashpot(eta, kn, kt, parting(ra, rb, x, v, mid), n)
                    t0, t1, t2 = t0 + c[0], t1 + c[1], t2 + c[2]
                    if advance:
                        damped[j] += weight[p] * power * dt
                if after >= df and law[j, MU] > 0.0:
                    taken, S, k = 0.0, (0.0, 0.0, 0.0), beta**2 * k0
                    if dn < 0.0 and before >= df:
                        w = parting(ra, rb, x, v, mid)
                        wn = dt * dot(w, n)
                        move = (dt * w[0] - wn * n[0], dt * w[1] - wn * n[1], dt * w[2] - wn * n[2])
                        S, taken = rubbing(s, turned(ra, R, rub[p]), k, -law[j, MU] * tn, move)
                    if advance:
                        rubbed[j] += weight[p] * taken
                        stuck_at(s, S, k, ra, R, rub[p])
                    t0, t1, t2 = t0 + S[0], t1 + S[1], t2 + S[2]
                t = (weight[p] * t0, weight[p] * t1, weight[p] * t2)
                c0, c1, c2 = cross(arm(ra, x, mid), t)
                f0, f1, f2, m0, m1, m2 = f0 + t[0], f1 + t[1], f2 + t[2], m0 + c0, m1 + c1, m2 + c2
        c0, c1, c2 = cross(lean, (g0, g1, g2))
        m0, m1, m2 = m0 - 0.5 * c0, m1 - 0.5 * c1, m2 - 0.5 * c2
        given[i, 0], given[i, 1], given[i, 2] = f0, f1, f2
        given[i, 3], given[i, 4], given[i, 5] = m0, m1, m2
    return fastest


def stored_between(live, joints, memory, now, before, out):
    """Elastic energy out (J,) [J] of the live joints between the places (x, R) half a substep `before` and `now`.

    Leapfrog conserves kinetic(t + dt/2) + 1/2 k δ(t)·δ(t + dt) exactly, so the product of the two openings is used.
    """
    a, b, start, xi_a, xi_b, weight, normal, law, peak, _, _ = joints
    largest, rub = memory.largest, memory.rub
    x, R = now
    x0, R0 = before
    for j in live:
        kc = law[j, KC]
        n, n0 = facing(a[j], b[j], R, normal[j]), facing(a[j], b[j], R0, normal[j])
        out[j] = 0.0
        for p in range(start[j], start[j + 1]):
            dn, d = split(place(a[j], R, x, xi_a[p]), place(b[j], R, x, xi_b[p]), n)
            en, e = split(place(a[j], R0, x0, xi_a[p]), place(b[j], R0, x0, xi_b[p]), n0)
            df = law[j, DF]
            ks = softened(law[j, UNIT], largest[p] / df, peak)
            out[j] += weight[p] * stored(ks, dn, en, dot(d, e), largest[p], law[j, K0], df, law[j, BETA], kc)
            if largest[p] >= df and law[j, MU] > 0.0 and dn < 0.0:
                at, k = turned(a[j], R, rub[p]), law[j, BETA] ** 2 * law[j, K0]
                for c in range(3):
                    out[j] += 0.5 * weight[p] * k * (d[c] - at[c]) * (e[c] - at[c])


def lost(joints, largest, out):
    """Energy out (J,) [J] dissipated by the damage of every joint, Σ weight (W(λ) - k_s λ²/2)."""
    start, weight, law, peak = joints.start, joints.weight, joints.law, joints.peak
    for j in range(len(out)):
        out[j] = 0.0
        unit, df = law[j, UNIT], law[j, DF]
        for p in range(start[j], start[j + 1]):
            r = largest[p] / df
            back = 0.5 * softened(unit, r, peak) * largest[p] ** 2
            out[j] += weight[p] * (separation_work(unit, df, r, peak) - back)


def point_springs(index, joint_of, joints, memory, place_now, out):
    """Of the points `index` (s,), where the blocks are, (x, R): fills `out`; joint_of (P,).

    out: arms (2, s, 3) [m] from both centres, normals (s, 3), k_n and k_t (2, s) [Pa/m]."""
    a, b, xi_a, xi_b = joints.a, joints.b, joints.xi_a, joints.xi_b
    normal, law, peak = joints.normal, joints.law, joints.peak
    largest, rub = memory.largest, memory.rub
    x, R = place_now
    arms, normals, k = out
    for i in range(len(index)):
        p = index[i]
        j = joint_of[p]
        pa, pb = place(a[j], R, x, xi_a[p]), place(b[j], R, x, xi_b[p])
        mid = (0.5 * (pa[0] + pb[0]), 0.5 * (pa[1] + pb[1]), 0.5 * (pa[2] + pb[2]))
        n = facing(a[j], b[j], R, normal[j])
        dn, s = split(pa, pb, n)
        to_a, to_b = arm(a[j], x, mid), arm(b[j], x, mid)
        for c in range(3):
            arms[0, i, c], arms[1, i, c], normals[i, c] = to_a[c], to_b[c], n[c]
        df = law[j, DF]
        ks = softened(law[j, UNIT], largest[p] / df, peak)
        kc = law[j, KC]
        tn, k[0, i], k[1, i] = response(ks, dn, dot(s, s), largest[p], law[j, K0], df, law[j, BETA], kc)
        if largest[p] >= df and law[j, MU] > 0.0:
            stick, limit = law[j, BETA] ** 2 * law[j, K0], -law[j, MU] * min(tn, 0.0)
            S, _ = rubbing(s, turned(a[j], R, rub[p]), stick, limit, n)
            k[1, i] = stick if dot(S, S) < (STICKS * limit) ** 2 else 0.0


def point_tangents(index, joint_of, joints, memory, place_now, out):
    """out (s, 3, 3) [Pa/m]: ∂t/∂δ of the points `index` while λ may grow, by central differences over 1e-7 δ_f.

    A point closer than that to where opening turns into closing is moved that far to its own side: the mean of both
    stiffnesses is neither, and with it a search for rest goes back and forth between them."""
    a, b, xi_a, xi_b = joints.a, joints.b, joints.xi_a, joints.xi_b
    normal, law, peak = joints.normal, joints.law, joints.peak
    largest = memory.largest
    x, R = place_now
    d = np.empty(3)
    for i in range(len(index)):
        p = index[i]
        j = joint_of[p]
        pa, pb = place(a[j], R, x, xi_a[p]), place(b[j], R, x, xi_b[p])
        n = facing(a[j], b[j], R, normal[j])
        unit, df, beta, k0 = law[j, UNIT], law[j, DF], law[j, BETA], law[j, K0]
        kc = law[j, KC]
        h = 1e-7 * df
        own, _ = split(pa, pb, n)
        aside = 0.0
        if kc != k0 and abs(own) < 2.0 * h:
            aside = 2.0 * h if own > 0.0 else -2.0 * h
        for c in range(3):
            for side in (1.0, -1.0):
                for k in range(3):
                    d[k] = pb[k] + aside * n[k]
                d[c] += side * h
                dn, s = split(pa, d, n)
                after = max(largest[p], measure(dn, dot(s, s), beta))
                ks = softened(unit, after / df, peak)
                tn, _, kt = response(ks, dn, dot(s, s), after, k0, df, beta, kc)
                for k in range(3):
                    change = side * (tn * n[k] + kt * s[k]) / (2.0 * h)
                    out[i, k, c] = change if side > 0.0 else out[i, k, c] + change


# ---- kernels of a law -------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class JointKernels:
    """The functions above of the same names, compiled for a law and a mixed mode."""

    joint_forces: Callable
    stored_between: Callable
    lost: Callable
    point_springs: Callable
    point_tangents: Callable


def kernels_of(law: str, mixed_mode: str) -> JointKernels:
    """Compiled at the first call of each; kept on disk under a checksum of the law, so a changed one is noticed."""
    return _kernels(law, laws.find(law), mixed_mode)


@cache
def _kernels(law: str, chosen: CohesiveLaw, mixed_mode: str) -> JointKernels:
    name, names = functions_of(law, chosen, mixed_mode)
    parts = (stored_between, lost, point_springs, point_tangents)
    return JointKernels(
        specialised(joint_forces, name, names, ranged=True),
        *(specialised(part, name, names) for part in parts),
    )


def functions_of(law: str, chosen: CohesiveLaw, mixed_mode: str) -> tuple[str, dict[str, Callable]]:
    """Of the law `chosen`, called `law`, and a mixed mode: a name of both, and what stands for the functions by these
    names in the kernels."""
    mode = mixed_modes.find(mixed_mode)
    name = f"{law}_{mixed_mode}_{source_checksum(chosen.secant, chosen.work):08x}"
    names: dict[str, Callable] = {"secant": chosen.secant, "work": chosen.work}
    for function in (softened, separation_work, torn_traction, softened_fours):
        names[function.__name__] = specialised(function, name, names, cache=False)
    names |= {part: getattr(mode, part) for part in ("measure", "pace", "response", "stored")}
    names["four_points"] = specialised(four_points, name, names, inlined=True)
    return name, names
