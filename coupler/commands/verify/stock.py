"""YADE's own brittle laws, run by YADE from plain scripts: work of separation, speed of break-off, Lourenço's envelope.

A linear bond of stiffness K_0 = 27/4 T_max/δ_f that breaks at T_max takes T_max²/(2 K_0) = 2/27 T_max δ_f, 7.59 times
less than the polynomial law, and lets a block go at √(2/27 / (9/16)) = 0.363 of its speed. Envelope: Lourenço, TU Delft
report 03-21-22-0-01 (1994), as the documentation of Law2_ScGeom_MortarPhys_Lourenco gives it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from coupler.commands.verify.registry import Finding, check
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import touching_faces
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.stock.mortar import inside
from yade_scripts.stock.scene import described, timed
from yade_scripts.stock.script import StockRun, run_script, stock_law

BRITTLE = ("cohfrict", "jcfpm", "mortar")
LAW = JointParameters(1e6, 1e-3, damping=0.0)
APART = 3.0
"""Distance of pairs that do not meet [m]."""


def pairs(velocities, driven: bool) -> list[Block]:
    """Pairs of a fixed and a glued unit cube, far from one another; each upper cube has its velocity (3,) [m/s]."""
    blocks = []
    for number, velocity in enumerate(velocities):
        x = APART * number
        blocks.append(Block(f"held{number}", (x, 0, 0.5), size=1.0, fixed=True))
        blocks.append(Block(f"moved{number}", (x, 0, 1.5), size=1.0, driven=driven, velocity=velocity))
    return blocks


def ran(name: str, blocks, end: float, substep: float, records: int, joints=LAW, **mortar) -> StockRun:
    """Run one of YADE's own laws on weightless blocks; mortar: further parameters of its envelope."""
    scene = described(blocks, touching_faces(blocks), joints, 3, 0.5, (0, 0, 0))
    scene["joint"] |= mortar
    law = stock_law(name)
    with tempfile.TemporaryDirectory() as folder:
        return run_script(law, timed(scene, law.variant, end, substep, records), Path(folder))


@check("P27", "stock brittle laws at the same strength and stiffness", "linear bond: T_max²/(2 K_0)", "M")
def brittle_laws():
    speed = 0.01
    speeds = np.linspace(0.95, 1.05, 101)
    exact = np.sqrt(9.0 / 8.0 * LAW.strength * LAW.opening_at_failure / 2400.0)
    brittle = np.sqrt(2.0 / 27.0 * 16.0 / 9.0)
    for name in BRITTLE:
        pull = ran(name, pairs([(0, 0, speed)], True), 0.02, 1e-5, 2000)
        share = pull.table["work"][-1] / (LAW.strength * LAW.opening_at_failure)
        yield Finding(f"{name}: work / (T_max df)", share, 2.0 / 27.0, 0.02)
        yield Finding(f"{name}: peak force / (T_max A)", pull.table["force"].max() / LAW.strength, 1.0, 0.02)
        throw = ran(name, pairs([(0, 0, k * brittle * exact) for k in speeds], False), 0.01, 1e-5, 2)
        slowest = speeds[::-1][int(throw.table["joints_broken"][-1]) - 1] * brittle
        yield Finding(f"{name}: speed of break-off / that of the polynomial law", slowest, 0.363, 0.02)


TENSION, COHESION, FRICTION, COMPRESSION, ASPECT = 1e6, 1.5e6, 0.7, 6e6, 1.2
"""f_t, c, tan φ, f_c, A of the envelope that is probed [Pa]."""


@check(
    "P28", "Lourenço's envelope of YADE's mortar law", "tension cut-off, Coulomb line, compression cap", "M"
)
def lourenco_envelope():
    angles = np.radians([0, 20, 40, 60, 75, 90, 105, 120, 135, 145, 155, 165, 175, 180])
    joints = JointParameters(TENSION, 1e-5, shear_ratio=COHESION / TENSION, damping=0.0)
    K, beta, speed, records = joints.stiffness, joints.shear_ratio, 1e-3, 8000
    velocities = [(speed * np.sin(a) / beta**2, 0.0, speed * np.cos(a)) for a in angles]
    end = 1.1 * COMPRESSION / (K * speed)
    numbers = {"friction": FRICTION, "compression": COMPRESSION, "aspect": ASPECT}
    run = ran("mortar", pairs(velocities, True), end, end / records, records, joints, **numbers)
    for number, angle in enumerate(angles):
        found = K * speed * run.figures["failed_at"][str(number)]
        what = f"stress at failure [Pa], {np.degrees(angle):.0f} deg from tension to compression"
        yield Finding(what, found, _border(angle), 2e-3)


def _border(angle: float) -> float:
    """Magnitude s of the stress (σ, τ) = s (cos, sin) at which it leaves the envelope, by bisection."""
    low, high = 0.0, 2.0 * COMPRESSION
    while high - low > 1e-9 * high:
        s = 0.5 * (low + high)
        within = inside(
            s * np.cos(angle), s * np.sin(angle), TENSION, COHESION, FRICTION, COMPRESSION, ASPECT
        )
        low, high = (s, high) if within else (low, s)
    return 0.5 * (low + high)
