"""Cohesive joints: laws, mixed mode, speed of separation.

References: closed forms of the laws (Needleman, J. Appl. Mech. 54 (1987) 525; Hillerborg, Cem. Concr. Res. 6 (1976)
773; Rose, Ferrante and Smith, Phys. Rev. Lett. 47 (1981) 675); each table says in its header how it was found.
"""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.figures import columns
from coupler.commands.verify.registry import Finding, check
from yade_scripts.blocks.block import Block
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

STILL = (0.0, 0.0, 0.0)
STRENGTH, FAILURE = 1e6, 1e-3
LAW = JointParameters(STRENGTH, FAILURE, damping=0.0)
LAWS = ("polynomial", "bilinear", "exponential")
ENERGY = {"polynomial": 9 / 16, "bilinear": 0.5, "exponential": np.e * 0.1 * (1 - 11 * np.exp(-10))}
"""G_c / (T_max δ_f) with the peaks that the laws have by default."""


def driven_pair(law: JointParameters, velocity=STILL, spin=STILL) -> Structure:
    """Two unit cubes glued face to face, the lower fixed, the upper moved; no weight."""
    blocks = [
        Block("held", (0, 0, 0.5), size=1.0, fixed=True),
        Block("moved", (0, 0, 1.5), size=1.0, driven=True, velocity=velocity, spin=spin),
    ]
    return Structure(blocks, None, law, gravity=STILL)


def exact_traction(law: str, r):
    """T/T_max at r = δ/δ_f, written independently of the package, whose laws must agree with it."""
    if law == "polynomial":
        T = 6.75 * r * (1.0 - 2.0 * r + r * r)
    elif law == "bilinear":
        T = np.minimum(10.0 * r, (1.0 - r) / 0.9)
    else:
        T = 10.0 * r * np.exp(1.0 - 10.0 * r)
    return np.where((r > 0.0) & (r < 1.0), T, 0.0)


@check("P20", "mode I law: traction, peak, work", "closed forms of the laws")
def mode_one():
    table = columns("coh_mode1_law")
    T = LAW.traction(table["r"] * FAILURE) / STRENGTH
    yield Finding(
        "law: largest |T - T_exact|/T_max", np.abs(T - table["T_over_Tmax"]).max(), 0.0, 1e-6, False
    )
    W = LAW.work_of_opening(table["r"] * FAILURE) / (STRENGTH * FAILURE)
    worst = np.abs(W - table["work_over_Tmax_df"]).max()
    yield Finding("law: largest |W - W_exact|/(T_max df)", worst, 0.0, 1e-6, False)
    for name in LAWS:
        yield from _pulled(name)


def _pulled(name: str):
    """A joint pulled apart slowly, its force recorded 400 times."""
    speed, law = 0.01, JointParameters(STRENGTH, FAILURE, law=name, damping=0.0)
    with driven_pair(law, velocity=(0, 0, speed)) as s:
        force = []
        for _ in range(400):
            s.advance(1.1 * FAILURE / speed / 400)
            force.append((s.time * speed / FAILURE, s.reaction()[1, 2] / STRENGTH))
        work = s.energies()["driving_work"] / (STRENGTH * FAILURE)
    r, T = np.array(force).T
    worst = np.abs(T - exact_traction(name, r)).max()
    yield Finding(f"{name}: largest |T - T_exact|/T_max of the run", worst, 0.0, 0.01, False)
    yield Finding(f"{name}: peak traction / T_max", T.max(), 1.0, 5e-3)
    yield Finding(f"{name}: opening at the peak / df", r[T.argmax()], law.peak_share, 6e-3, False)
    yield Finding(f"{name}: work / (T_max df)", work, ENERGY[name], 5e-3)


@check("P21", "mode II and mixed mode", "closed forms: effective opening, potential of 1987")
def mixed_mode():
    table = columns("coh_mixed_mode")
    needleman = JointParameters(STRENGTH, FAILURE, mixed_mode="needleman", damping=0.0)
    for law, column in ((LAW, "eff"), (needleman, "N87")):
        for u, v in ((0.0, 0.3), (0.1, 0.2), (0.3, 0.1)):
            row = np.flatnonzero(np.isclose(table["u"], u) & np.isclose(table["v"], v))[0]
            Tn, Tt = _pulled_along(law, u, v)
            at = f"T_max at u {u}, v {v}, {law.mixed_mode}"
            if table[f"{column}_Tn"][row] != 0.0:
                yield Finding(f"normal traction / {at}", Tn, table[f"{column}_Tn"][row], 0.01)
            yield Finding(f"shear traction / {at}", Tt, table[f"{column}_Tt"][row], 0.01)
    for name in LAWS:
        with driven_pair(
            JointParameters(STRENGTH, FAILURE, law=name, damping=0.0), velocity=(0.01, 0, 0)
        ) as s:
            s.advance(1.1 * FAILURE / 0.01)
            work = s.energies()["driving_work"] / (STRENGTH * FAILURE)
        yield Finding(f"{name}: work in pure shear / (T_max df)", work, ENERGY[name], 0.01)


def _pulled_along(law: JointParameters, u: float, v: float) -> tuple[float, float]:
    """Normal and shear traction over T_max of a joint moved in a straight line to opening u df, sliding v df."""
    speed = 0.01
    with driven_pair(law, velocity=(speed * v, 0, speed * u)) as s:
        s.advance(FAILURE / speed)
        force = s.reaction()[1] / STRENGTH
    return force[2], force[0]


@check("P26", "dynamic separation", "energy: leaves above vcrit = sqrt(2 G_c A/m)")
def dynamic_separation():
    table = columns("coh_dynamic_separation")
    for name in LAWS:
        vcrit = np.sqrt(2.0 * ENERGY[name] * STRENGTH * FAILURE / 2400.0)
        low, high = 0.9 * vcrit, 1.1 * vcrit
        while high - low > 1e-3 * vcrit:
            middle = 0.5 * (low + high)
            low, high = (low, middle) if _leaves(name, middle)[0] else (middle, high)
        yield Finding(f"{name}: critical speed [m/s]", 0.5 * (low + high), vcrit, 0.01)
        for k in (1.2, 1.5, 2.0, 3.0):
            exact = table["vend_energy"][np.isclose(table["k"], k)][0]
            value = _leaves(name, k * vcrit)[1] / vcrit
            yield Finding(f"{name}: |v|/vcrit after leaving at {k:g} vcrit", value, exact, 0.005)
        for k in (10.0, 100.0):  # 0.8 and 8 δ_f in a substep
            value = k**2 - (_leaves(name, k * vcrit)[1] / vcrit) ** 2
            yield Finding(f"{name}: energy taken / (G_c A), leaving at {k:g} vcrit", value, 1.0, 0.01)


def _leaves(law: str, speed: float) -> tuple[bool, float]:
    """Whether a glued cube that starts at `speed` breaks its joint, and its speed after 0.1 s."""
    blocks = [
        Block("wall", (0, 0, 0.5), size=1.0, fixed=True),
        Block("free", (0, 0, 1.5), size=1.0, velocity=(0, 0, speed)),
    ]
    with Structure(
        blocks, None, JointParameters(STRENGTH, FAILURE, law=law, damping=0.0), gravity=STILL
    ) as s:
        s.advance(0.1)
        return not s.joint_table().alive[0], float(s.velocity()[1, 2])
