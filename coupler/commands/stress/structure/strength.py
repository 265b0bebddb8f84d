"""Joints from weak to strong, brittle to soft, slow to fast: they absorb exactly their work of separation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.registry import Measure, scene
from coupler.commands.stress.structure.watch import Watch
from yade_scripts.blocks.block import Block
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

STILL = (0.0, 0.0, 0.0)
G = 9.81
LIGHT, HEAVY = 100.0, 20000.0
AREA, MASS = 1.0, 2000.0


def held_and_free(density: float = MASS, size=1.0, **more) -> list[Block]:
    """A block that is held and one bonded on top of it."""
    height = np.broadcast_to(size, (3,))[2]
    return [
        Block("held", (0, 0, 0.5 * height), size=size, density=density, fixed=True),
        Block("free", (0, 0, 1.5 * height), size=size, density=density, **more),
    ]


def torn(parameters: JointParameters, times: float, density: float = MASS, size=1.0) -> Watch:
    """The upper block leaves at `times` the speed that can just break the joint; watched until it is free."""
    edges = np.broadcast_to(np.asarray(size, float), (3,))
    energy = parameters.work_of_separation * edges[0] * edges[1]
    critical = np.sqrt(2.0 * energy / (density * edges.prod()))
    blocks = held_and_free(density, size, velocity=(0.0, 0.0, times * critical))
    with Structure(blocks, None, parameters, gravity=STILL) as s:
        watch = Watch(s, energy)
        way = 4.0 * parameters.opening_at_failure
        watch.advance(way / (critical * np.sqrt(times**2 - 1.0)), looks=20)
        if s.joint_table().alive.any():
            raise AssertionError("the joint has not failed")
        watch.taken = s.energies()["joint_dissipated"] / energy
        watch.lost = 0.5 * s.mass[1] * ((times * critical) ** 2 - s.velocity()[1, 2] ** 2) / energy
    return watch


def errors(cases) -> Iterator[Measure]:
    """Largest errors, relative to G_c A, of the joints' work and of the energy that the blocks lost; energy gained."""
    watches = [torn(*case) for case in cases]
    yield Measure("taken by the joint, off G_c", max(abs(w.taken - 1.0) for w in watches), 0.02)
    yield Measure("lost by the block, off G_c", max(abs(w.lost - 1.0) for w in watches), 0.03)
    yield Measure("energy gained", max(w.gain / w.scale for w in watches), 0.03)
    yield Measure("largest opening in a substep over δ_f", max(w.fastest_opening for w in watches), None)


@scene("S01", "strength 1 kPa to 100 MPa, each at openings of 1e-8 to 0.1 m")
def strengths() -> Iterator[Measure]:
    yield from errors(
        (JointParameters(strength, opening, damping=0.0), 3.0)
        for strength in (1e3, 1e5, 1e8)
        for opening in (1e-8, 1e-4, 0.1)
    )


@scene("S02", "density 100 to 20000 kg/m³, bonded")
def densities() -> Iterator[Measure]:
    yield from errors(
        (JointParameters(1e6, 1e-3, damping=0.0), 3.0, density) for density in (LIGHT, MASS, HEAVY)
    )


@scene("S03", "torn at 300 times the critical speed, brittle and soft")
def fast() -> Iterator[Measure]:
    yield from errors((JointParameters(1e6, opening, damping=0.0), 300.0) for opening in (1e-6, 1e-3))


@scene("S04", "rods and plates of aspect ratio 50, bonded at their ends and faces")
def slender() -> Iterator[Measure]:
    sizes = ((0.02, 0.02, 1.0), (1.0, 1.0, 0.02), (1.0, 0.02, 0.02))
    yield from errors((JointParameters(1e6, 1e-3, damping=0.0), 3.0, MASS, size) for size in sizes)


@scene("S05", "bonded rod of aspect ratio 50 held at one end, released under a quarter of its strength")
def cantilever() -> Iterator[Measure]:
    """The clamped joint bends. A suddenly applied weight has twice its static effect, here half of the strength, so the
    beam vibrates and holds."""
    length, width, opening = 1.0, 0.02, 1e-3
    weight = MASS * length * width**2 * G
    strength = 4.0 * (0.5 * weight * length) / (width**3 / 6.0)
    blocks = [
        Block("held", (-0.5 * width, 0, 0), size=width, density=MASS, fixed=True),
        Block("rod", (0.5 * length, 0, 0), size=(length, width, width), density=MASS),
    ]
    with Structure(blocks, None, JointParameters(strength, opening, damping=0.0)) as s:
        watch = Watch(s, weight * opening * length / width)
        watch.advance(0.6, looks=60)
        early = s.joint_table().damage[0]
        watch.advance(0.6, looks=60)
        yield Measure("broken", float(not s.joint_table().alive[0]), 0.0)
        yield Measure("growth of the damage in the second half", s.joint_table().damage[0] - early, 1e-4)
    yield from watch.measures()


@scene("S06", "pulled by 99.5, 100 and 100.5 % of the strength")
def at_strength() -> Iterator[Measure]:
    """The load grows over many periods. Below the strength the joint holds, above it fails; at it, only the energy is
    checked."""
    for share, holds in ((0.995, 1.0), (1.0, None), (1.005, 0.0)):
        alive, watch = pulled(share)
        setting = f"at {100 * share:g} % of the strength"
        if holds is None:
            yield Measure(f"holds, {setting}", alive, None)
        else:
            yield Measure(f"holds, off what it must, {setting}", alive - holds, 0.0)
        yield from watch.measures(setting)


def pulled(share: float) -> tuple[float, Watch]:
    """Whether a joint holds a load of `share` of its strength; the energy scale is G_c A or the work of the load."""
    parameters = JointParameters(1e6, 1e-3, damping=0.3)
    with Structure(held_and_free(), None, parameters, gravity=STILL) as s:
        watch = Watch(s, parameters.work_of_separation * AREA)
        for step in range(1, 201):
            pull = share * parameters.strength * AREA * min(1.0, step / 150)
            s.set_load(np.array([[0.0] * 6, [0.0, 0.0, pull, 0.0, 0.0, 0.0]]))
            watch.advance(1e-3, looks=1)
            watch.scale = max(watch.scale, s.energies()["load_work"])
        return float(s.joint_table().alive[0]), watch
