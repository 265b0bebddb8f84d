"""Cohesive joints: law, mixed mode, bending, axial load, chains of blocks, fast opening.

References: closed forms of the polynomial law (Needleman, J. Appl. Mech. 54 (1987) 525), integrated over the face of
a joint; each table says in its header how it was found.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupler.verify.figures import columns
from coupler.verify.registry import Finding, check
from yade_scripts.blocks import Block
from yade_scripts.cohesion import JointParameters
from yade_scripts.equilibrium import CannotStand, settle
from yade_scripts.structure import Structure

STILL = (0.0, 0.0, 0.0)
STRENGTH, FAILURE = 1e6, 1e-3
LAW = JointParameters(STRENGTH, FAILURE)
WORK = 9.0 / 16.0
"""G_c / (T_max δ_f)."""


def driven_pair(law: JointParameters, velocity=STILL, spin=STILL) -> Structure:
    """Two unit cubes glued face to face, the lower fixed, the upper moved; no weight."""
    blocks = [
        Block("held", (0, 0, 0.5), size=1.0, fixed=True),
        Block("moved", (0, 0, 1.5), size=1.0, driven=True, velocity=velocity, spin=spin),
    ]
    return Structure(blocks, None, law, gravity=STILL)


@check("P20", "mode I law: traction, peak, work", "closed form of the polynomial law")
def mode_one():
    table = columns("coh_mode1_law")
    T = LAW.traction(table["r"] * FAILURE) / STRENGTH
    yield Finding(
        "law: largest |T - T_exact|/T_max", np.abs(T - table["T_over_Tmax"]).max(), 0.0, 1e-6, False
    )
    W = LAW.work_of_opening(table["r"] * FAILURE) / (STRENGTH * FAILURE)
    worst = np.abs(W - table["work_over_Tmax_df"]).max()
    yield Finding("law: largest |W - W_exact|/(T_max df)", worst, 0.0, 1e-6, False)
    speed = 0.01
    with driven_pair(LAW, velocity=(0, 0, speed)) as s:
        force = []
        for _ in range(200):
            s.advance(1.1 * FAILURE / speed / 200)
            force.append((s.time * speed / FAILURE, s.reaction()[1, 2] / STRENGTH))
        r, T = np.array(force).T
        yield Finding("run: peak traction / T_max", T.max(), 1.0, 5e-3)
        yield Finding("run: opening at the peak / df", r[T.argmax()], 1.0 / 3.0, 6e-3, False)
        yield Finding(
            "run: work / (T_max df)", s.energies()["driving_work"] / (STRENGTH * FAILURE), WORK, 5e-3
        )


@check("P21", "mode II and mixed mode (effective opening)", "closed form of the effective-opening rule")
def mixed_mode():
    table = columns("coh_mixed_mode")
    for u, v in ((0.0, 0.3), (0.1, 0.2), (0.3, 0.1)):
        row = np.flatnonzero(np.isclose(table["u"], u) & np.isclose(table["v"], v))[0]
        Tn, Tt = _pulled_along(u, v)
        if u > 0.0:
            yield Finding(f"normal traction / T_max at u {u}, v {v}", Tn, table["eff_Tn"][row], 0.01)
        yield Finding(f"shear traction / T_max at u {u}, v {v}", Tt, table["eff_Tt"][row], 0.01)
    with driven_pair(LAW, velocity=(0.01, 0, 0)) as s:
        s.advance(1.1 * FAILURE / 0.01)
        yield Finding("work in pure shear / (T_max df)", s.energies()["driving_work"] / 1e3, WORK, 0.01)


def _pulled_along(u: float, v: float) -> tuple[float, float]:
    """Normal and shear traction over T_max of a joint moved in a straight line to opening u df, sliding v df."""
    speed = 0.01
    with driven_pair(LAW, velocity=(speed * v, 0, speed * u)) as s:
        s.advance(FAILURE / speed)
        force = s.reaction()[1] / STRENGTH
    return force[2], force[0]


@check("P22", "hinge moment of a joint about its compressed edge", "integral of the law over the face")
def hinge():
    table = columns("coh_hinge_moment")
    r, m, work = _hinge_curve(LAW, np.append(np.arange(0.02, 1.01, 0.02), 9.0))
    yield Finding("3 x 3 points: peak moment / (T_max b h²)", m.max(), 0.452254, 0.01)
    yield Finding("3 x 3 points: r at the peak", r[m.argmax()], 0.460655, 0.021, False)
    inside = r <= 1.0
    exact = np.interp(r[inside], table["r"], table["m_exact"])
    yield Finding(
        "3 x 3 points: largest |m - m_exact| to r = 1", np.abs(m[inside] - exact).max(), 0.0, 0.01, False
    )
    yield Finding("3 x 3 points: work / (T_max df h b)", work, WORK, 0.01)
    r, m, _ = _hinge_curve(JointParameters(STRENGTH, FAILURE, points=8), np.array([1.0, 1.5, 2.0]))
    for at in (1.5, 2.0):
        exact = 9.0 / (40.0 * at**2)
        yield Finding(f"8 x 8 points: tail at r = {at}", float(np.interp(at, r, m)), exact, 0.01)


def _hinge_curve(law: JointParameters, stops) -> tuple[np.ndarray, np.ndarray, float]:
    """(r, m, work) of a joint turned about its edge to each r = θ h/df: m = M/(T_max b h²), work over T_max df h b."""
    spin = np.array([0.0, -0.01, 0.0])
    edge = np.array([-0.5, 0.0, 1.0])
    with driven_pair(law, velocity=np.cross(spin, np.array([0, 0, 1.5]) - edge), spin=spin) as s:
        moment = []
        for r in stops:
            # the centre of a turning block moves on a circle: its straight velocity is corrected at every stop
            s.drive("moved", np.cross(spin, s.centre()[1] - edge), spin)
            s.advance(r * FAILURE / 0.01 - s.time)
            f = s.reaction()[1]
            moment.append(abs((f[3:] + np.cross(s.centre()[1] - edge, f[:3]))[1]) / STRENGTH)
        work = s.energies()["driving_work"] / (STRENGTH * FAILURE)
    return np.asarray(stops), np.array(moment), work


@check("P23", "moment that a joint carries under axial load", "800-point integration of the face")
def joint_under_axial_load():
    table = columns("coh_joint_Mmax_vs_N")
    for ratio, n, points in (
        (1, 0.0, 3),
        (1, 0.2, 3),
        (10, 0.2, 3),
        (10, 0.2, 8),
        (100, 0.5, 3),
        (100, 0.5, 8),
    ):
        row = np.flatnonzero((table["kc_over_K0"] == ratio) & (table["n"] == n))[0]
        law = JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, points=points)

        def load(M, n=n):
            return np.array([[0.0] * 6, [0, 0, -n * STRENGTH, 0, M * STRENGTH, 0]])

        found = _largest_carried(lambda law=law: _glued_pair(law), load, 2.0 * table["mmax"][row])
        what = f"M_max/(T_max b h²), kc/K0 {ratio}, n {n:g}, {points} x {points} points"
        yield Finding(what, found, table["mmax"][row], 0.02)


def _glued_pair(law: JointParameters) -> Structure:
    blocks = [Block("held", (0, 0, 0.5), size=1.0, fixed=True), Block("free", (0, 0, 1.5), size=1.0)]
    return Structure(blocks, None, law, gravity=STILL)


def _largest_carried(build: Callable[[], Structure], load: Callable[[float], np.ndarray], high: float):
    """The largest factor of a load under which the structure finds equilibrium, to 0.1 %, by bisection."""
    low = 0.0
    while high - low > 1e-3 * high:
        middle = 0.5 * (low + high)
        with build() as s:
            try:
                settle(s, load(middle))
                low = middle
            except CannotStand:
                high = middle
    return 0.5 * (low + high)


EDGE, LENGTH = 0.2, 1.2
CHAINS = ((1, 3, 0.286073), (100, 3, 0.426346), (100, 8, 0.426346))
"""kc/K0, Gauss points an edge, peak moment / (T_max b h²) of a joint without axial load (coh_joint_Mmax_vs_N.csv)."""


def _chain(law: JointParameters, held: int) -> Structure:
    """Six cubes in a row along x; block `held` fixed, -1: a wall at the left end holds the row."""
    blocks = [Block(f"b{i}", (EDGE * (i + 0.5), 0, 0), size=EDGE, fixed=i == held) for i in range(6)]
    if held < 0:
        blocks.append(Block("wall", (-0.5 * EDGE, 0, 0), size=EDGE, fixed=True))
    return Structure(blocks, None, law, gravity=STILL)


def _end_load(P: float, n: int, left: bool = False) -> np.ndarray:
    """P downwards at the free end face of the row, or of both its ends."""
    F = np.zeros((n, 6))
    F[5, 2], F[5, 4] = -P, 0.5 * EDGE * P
    if left:
        F[0, 2], F[0, 4] = -P, -0.5 * EDGE * P
    return F


@check("P24", "cantilever of six blocks", "statically determinate chain; joints with closing stiffness")
def cantilever():
    for ratio, points, m in CHAINS:
        law = JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, points=points)
        found = _largest_carried(lambda law=law: _chain(law, -1), lambda P: _end_load(P, 7), 5000.0)
        what = f"P_max [N], kc/K0 {ratio}, {points} x {points} points"
        yield Finding(what, found, m * STRENGTH * EDGE**3 / LENGTH, 0.03)


@check("P25", "three-point bend of six blocks", "statically determinate chain; joints with closing stiffness")
def three_point_bend():
    # Held at the block left of the middle joint with P/2 at both ends: the moments of the supported row, upside down.
    for ratio, points, m in CHAINS:
        law = JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, points=points)
        found = _largest_carried(
            lambda law=law: _chain(law, 2), lambda P: _end_load(0.5 * P, 6, left=True), 20000.0
        )
        what = f"P_max [N], kc/K0 {ratio}, {points} x {points} points"
        yield Finding(what, found, 4.0 * m * STRENGTH * EDGE**3 / LENGTH, 0.03)


@check("P26", "dynamic separation", "energy: leaves above vcrit = sqrt(9/8 T_max df A/m)")
def dynamic_separation():
    vcrit = np.sqrt(9.0 / 8.0 * STRENGTH * FAILURE / 2400.0)
    low, high = 0.9 * vcrit, 1.1 * vcrit
    while high - low > 1e-3 * vcrit:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if _leaves(middle)[0] else (middle, high)
    yield Finding("critical speed [m/s]", 0.5 * (low + high), vcrit, 0.01)
    table = columns("coh_dynamic_separation")
    for k in (1.2, 1.5, 2.0, 3.0):
        exact = table["vend_energy"][np.isclose(table["k"], k)][0]
        yield Finding(f"|v|/vcrit after leaving at {k:g} vcrit", _leaves(k * vcrit)[1] / vcrit, exact, 0.03)


def _leaves(speed: float) -> tuple[bool, float]:
    """Whether a glued cube that starts at `speed` breaks its joint, and its speed after 0.1 s."""
    blocks = [
        Block("wall", (0, 0, 0.5), size=1.0, fixed=True),
        Block("free", (0, 0, 1.5), size=1.0, velocity=(0, 0, speed)),
    ]
    with Structure(blocks, None, LAW, gravity=STILL) as s:
        s.advance(0.1)
        return not s.joint_table().alive[0], float(s.velocity()[1, 2])
