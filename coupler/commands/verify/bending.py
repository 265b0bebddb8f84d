"""Bent joints: hinge, moment under axial load, chains of six blocks.

References: the law integrated over the face; each table says in its header how it was found. For the laws without a
table the same integral is taken here with 400 points.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from coupler.commands.verify.figures import columns
from coupler.commands.verify.joints import (
    ENERGY,
    FAILURE,
    LAW,
    LAWS,
    STILL,
    STRENGTH,
    driven_pair,
    exact_traction,
)
from coupler.commands.verify.registry import Finding, check
from yade_scripts.blocks.block import Block
from yade_scripts.dynamics.equilibrium import CannotStand, settle
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters


@check("P22", "hinge moment of a joint about its compressed edge", "integral of the law over the face")
def hinge():
    table = columns("coh_hinge_moment")
    stops = np.append(
        np.arange(0.02, 1.01, 0.02), np.geomspace(1.1, 60.0, 60)
    )  # 60: the point next to the edge
    r, m, work = _hinge_curve(LAW, stops)
    yield Finding("polynomial: peak moment / (T_max b h²)", m.max(), 0.452254, 0.01)
    yield Finding("polynomial: r at the peak", r[m.argmax()], 0.460655, 0.021, False)
    inside = r <= 1.0
    exact = np.interp(r[inside], table["r"], table["m_exact"])
    yield Finding(
        "polynomial: largest |m - m_exact| to r = 1", np.abs(m[inside] - exact).max(), 0.0, 0.01, False
    )
    yield Finding("polynomial: work / (T_max df h b)", work, ENERGY["polynomial"], 0.01)
    r, m, _ = _hinge_curve(
        JointParameters(STRENGTH, FAILURE, points=8, damping=0.0), np.array([1.0, 1.5, 2.0])
    )
    for at in (1.5, 2.0):
        exact = 9.0 / (40.0 * at**2)
        yield Finding(f"polynomial, 8 x 8 points: tail at r = {at}", float(np.interp(at, r, m)), exact, 0.01)
    y = (np.arange(4000) + 0.5) / 4000
    for name in LAWS[1:]:
        exact = max((exact_traction(name, at * y) * y).mean() for at in stops)
        r, m, work = _hinge_curve(JointParameters(STRENGTH, FAILURE, law=name, damping=0.0), stops)
        yield Finding(f"{name}: peak moment / (T_max b h²)", m.max(), exact, 0.02)
        yield Finding(f"{name}: work / (T_max df h b)", work, ENERGY[name], 0.01)


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


@check(
    "P23", "moment that a joint carries under axial load", "400- to 800-point integration of the face", "M"
)
def joint_under_axial_load():
    table = columns("coh_joint_Mmax_vs_N")
    for ratio in (1, 10, 100, 10000):
        for n in (0.0, 0.2, 0.5):
            row = np.flatnonzero((table["kc_over_K0"] == ratio) & (table["n"] == n))[0]
            yield _moment(
                JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, damping=0.0), n, table["mmax"][row]
            )
    for name in LAWS[1:]:
        for ratio, n in ((1, 0.2), (100, 0.2)):
            law = JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, law=name, damping=0.0)
            yield _moment(law, n, _exact_moment(name, ratio * law.stiffness * FAILURE / STRENGTH, n))


def _moment(law: JointParameters, n: float, exact: float) -> Finding:
    def load(M):
        return np.array([[0.0] * 6, [0, 0, -n * STRENGTH, 0, M * STRENGTH, 0]])

    found = _largest_carried(lambda: _glued_pair(law), load, 2.0 * exact)
    what = f"{law.law}: M_max/(T_max b h²), kc/K0 {law.closing_ratio:g}, n {n:g}"
    return Finding(what, found, exact, 0.02)


def _exact_moment(law: str, closing: float, n: float) -> float:
    """Largest moment over T_max b h² of a joint under the axial load n T_max b h: T of the law where it is open, the
    stiffness closing T_max/df where it is closed, 400 Gauss points over the height."""
    y, w = np.polynomial.legendre.leggauss(400)
    y, w = 0.5 * y, 0.5 * w

    def pressed(middle, turn):
        r = middle + turn * y
        return w * np.where(r > 0.0, exact_traction(law, r), closing * r)

    best = 0.0
    for turn in np.concatenate([np.linspace(0.005, 0.1, 20), np.linspace(0.11, 2.0, 190)]):
        trials = np.linspace(-0.5 * turn - 3.0 * n / closing - 1e-9, 0.5 * turn, 400)
        load = np.array([pressed(t, turn).sum() for t in trials]) + n
        first = np.flatnonzero((load[:-1] < 0.0) & (load[1:] >= 0.0))
        if len(first):  # no equilibrium exists beyond the tension that the joint carries
            middle = brentq(lambda t, turn=turn: pressed(t, turn).sum() + n, *trials[first[0] : first[0] + 2])
            best = max(best, float((pressed(middle, turn) * y).sum()))
    return best


def _glued_pair(law: JointParameters) -> Structure:
    blocks = [Block("held", (0, 0, 0.5), size=1.0, fixed=True), Block("free", (0, 0, 1.5), size=1.0)]
    return Structure(blocks, None, law, gravity=STILL)


def _largest_carried(
    build: Callable[[], Structure], load: Callable[[float], np.ndarray], high: float, share: float = 1e-3
) -> float:
    """Largest load factor at which the structure finds equilibrium, by bisection to the relative error `share`."""
    low = 0.0
    while high - low > share * high:
        middle = 0.5 * (low + high)
        with build() as s:
            try:
                settle(s, load(middle))
                low = middle
            except CannotStand:
                high = middle
    return 0.5 * (low + high)


EDGE, LENGTH = 0.2, 1.2
CHAINS = ((1, 0.286073), (10, 0.380194), (100, 0.426346))
"""kc/K0, peak moment / (T_max b h²) of a joint without axial load (coh_joint_Mmax_vs_N.csv)."""
RIGID = 1e4
RIGID_ACROSS = 10.0
"""kc/K0 and β of joints beside the tables of deflection, which have rigid edges and only bend."""


def _chain(law: JointParameters, held: int) -> Structure:
    """Six cubes in a row along x; the block `held` is fixed (-1: a wall at the left end holds the row)."""
    blocks = [Block(f"b{i}", (EDGE * (i + 0.5), 0, 0), size=EDGE, fixed=i == held) for i in range(6)]
    if held < 0:
        blocks.append(Block("wall", (-0.5 * EDGE, 0, 0), size=EDGE, fixed=True))
    return Structure(blocks, None, law, gravity=STILL)


def _end_load(P: float, n: int, left: bool = False) -> np.ndarray:
    """The load P, acting downwards on the right end face of the row, or on both end faces."""
    F = np.zeros((n, 6))
    F[5, 2], F[5, 4] = -P, 0.5 * EDGE * P
    if left:
        F[0, 2], F[0, 4] = -P, -0.5 * EDGE * P
    return F


@check("P24", "cantilever of six blocks", "statically determinate chain; joints with closing stiffness", "M")
def cantilever():
    for ratio, m in CHAINS:
        law = JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, damping=0.0)
        found = _largest_carried(lambda law=law: _chain(law, -1), lambda P: _end_load(P, 7), 5000.0)
        yield Finding(f"P_max [N], kc/K0 {ratio}", found, m * STRENGTH * EDGE**3 / LENGTH, 0.03)
    table = columns("coh_cantilever_6blocks")
    yield from _deflection(table, -1, lambda P: _end_load(P, 7), lambda s: -_face(s, 5, 0.5)[2])


@check("P25", "three-point bend of six blocks", "statically determinate chain; joints with closing stiffness")
def three_point_bend():
    # Held at the block left of the middle joint with P/2 at both ends: the moments of the supported row, upside down.
    for ratio, m in CHAINS:
        law = JointParameters(STRENGTH, FAILURE, closing_ratio=ratio, damping=0.0)
        found = _largest_carried(
            lambda law=law: _chain(law, 2), lambda P: _end_load(0.5 * P, 6, left=True), 20000.0
        )
        yield Finding(f"P_max [N], kc/K0 {ratio}", found, 4.0 * m * STRENGTH * EDGE**3 / LENGTH, 0.03)
    table = columns("coh_three_point_6blocks")
    yield from _deflection(table, 2, lambda P: _end_load(0.5 * P, 6, left=True), _sag)


def _deflection(table, held: int, load, deflection):
    """Findings for deflections below and at the peak load, with joints that are nearly rigid in closing."""
    law = JointParameters(STRENGTH, FAILURE, closing_ratio=RIGID, shear_ratio=RIGID_ACROSS, damping=0.0)
    peak, last = table["P_N"][-1], table["u_m"][-1]
    for share in (0.5, 0.9):
        with _chain(law, held) as s:
            settle(s, load(share * peak))
            exact = float(np.interp(share * peak, table["P_N"], table["u_m"]))
            yield Finding(
                f"deflection at {share:g} P_max [mm], rigid edges", 1e3 * deflection(s), 1e3 * exact, 0.03
            )
    found = _largest_carried(lambda: _chain(law, held), load, 1.5 * peak, 1e-6)
    with _chain(law, held) as s:
        settle(s, load(found * (1.0 - 2e-6)))
        yield Finding("P_max [N], rigid edges", found, peak, 0.02)
        yield Finding("deflection at the peak [mm], rigid edges", 1e3 * deflection(s), 1e3 * last, 0.03)


def _face(structure: Structure, row: int, side: float) -> np.ndarray:
    """Displacement (3,) [m] of the centre of a block's face at x = ±EDGE/2 since the start."""
    local = np.array([side * EDGE, 0.0, 0.0])
    return structure.centre()[row] + structure.rotation()[row] @ local - [EDGE * (row + 0.5 + side), 0.0, 0.0]


def _sag(structure: Structure) -> float:
    """Deflection of the middle joint from the line of the supports [m].

    The held block stays level; the supported row turns it so that both supports are level."""
    left, right = _face(structure, 0, -0.5)[2], _face(structure, 5, 0.5)[2]
    return -0.5 * (left + right)
