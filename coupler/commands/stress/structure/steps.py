"""Substeps near and beyond the limit of the explicit scheme."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.registry import Measure, scene
from coupler.commands.stress.structure.watch import Watch
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

STILL = (0.0, 0.0, 0.0)
DENSITY = 2000.0


def bonded_column(**more) -> list[Block]:
    """Five bonded cubes, the lowest held, the highest moving."""
    cubes = [Block(f"c{i}", (0, 0, i + 0.5), size=1.0, density=DENSITY, fixed=i == 0) for i in range(4)]
    return [*cubes, Block("c4", (0, 0, 4.5), size=1.0, density=DENSITY, **more)]


@scene("S40", "bonded column swings at 0.9 of the explicit limit")
def at_the_limit() -> Iterator[Measure]:
    """Far below damage nothing may grow. Near failure the kink of the law creates energy, which is reported."""
    for velocity, limit in ((1e-5, 1e-3), (0.3, None)):
        joints = JointParameters(1e6, 1e-3, damping=0.0)
        with Structure(bonded_column(velocity=(velocity, 0.0, velocity)), None, joints, gravity=STILL) as s:
            watch = Watch(s, 0.5 * DENSITY * 2.0 * velocity**2)
            step = 0.9 * s.substep_limit().stable
            watch.advance(2000 * step, looks=100, substep=step)
            setting = f"{velocity:g} m/s, damage {s.joint_table().damage.max():.2g}"
        yield Measure(f"energy gained, {setting}", watch.gain / watch.scale, limit)
        yield Measure(f"balance of energy, {setting}", watch.drift / watch.scale, 0.03 if limit else None)


@scene("S41", "bounces at 0.9 of the explicit limit of the contact")
def bounces() -> Iterator[Measure]:
    """Flat bounces in a shaft: the effect of a coarse substep on e is reported; no energy may be created."""
    floor = Block("floor", (0, 0, -0.5), size=1.0, density=DENSITY, fixed=True)
    roof = Block("roof", (0, 0, 1.51), size=1.0, density=DENSITY, fixed=True)
    ball = Block("ball", (0, 0, 0.503), size=1.0, density=DENSITY, velocity=(0, 0, 1.0))
    with Structure([floor, roof, ball], ContactLaw(1e8, 0.8), gravity=STILL) as s:
        watch = Watch(s, 0.5 * DENSITY)
        watch.advance(0.1, looks=100, substep=0.9 * s.substep_limit().stable)
        yield Measure("speed left", float(np.abs(s.velocity()[2, 2])), 1.0, "m/s")
    yield Measure("energy gained", watch.gain / watch.scale, 1e-3)
    yield Measure("balance of energy", watch.drift / watch.scale, None)


@scene("S42", "a substep of 1.1 explicit limits is asked for", refusal="must")
def beyond() -> Iterator[Measure]:
    with Structure(bonded_column(), None, JointParameters(1e6, 1e-3, damping=0.0), gravity=STILL) as s:
        s.advance(1.0, substep=1.1 * s.substep_limit().stable)
        yield Measure("time that was run", s.time, 0.0, "s")


@scene("S43", "a contact stiffness that is no number", refusal="must")
def no_stiffness() -> Iterator[Measure]:
    yield Measure("stiffness that was taken", ContactLaw(np.nan).stiffness, 0.0, "N/m")
