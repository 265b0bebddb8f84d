"""Contacts that are stiff, slender, cornered, wedged, or hit hard."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from coupler.commands.stress.registry import Measure, scene
from coupler.commands.stress.structure.watch import Watch, corners, lowest, speed
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

G = 9.81
STILL = (0.0, 0.0, 0.0)
DENSITY = 2000.0
LIGHT, HEAVY = 100.0, 20000.0


def rebound(stiffness: float, e: float, size=1.0, density: float = DENSITY, fall: float = 1.0) -> Watch:
    """A block lands flat with the speed `fall`; its `returned` is the speed after over that before."""
    edges = np.broadcast_to(np.asarray(size, float), (3,))
    mass = density * edges.prod()
    gap = 1e-4 * edges[2]
    block = Block("b", (0, 0, 0.5 * edges[2] + gap), size=size, density=density, velocity=(0, 0, -fall))
    with Structure([block], ContactLaw(stiffness, e), ground=0.0, gravity=STILL) as s:
        watch = Watch(s, 0.5 * mass * fall**2)
        watch.advance(gap / fall + 6.0 * np.sqrt(mass / stiffness), looks=30)
        watch.returned = s.velocity()[0, 2] / fall
    return watch


ELASTIC_GAIN = 0.005
"""Energy gained at the accurate substep without a dashpot, which would absorb the errors at both ends of a contact."""


def rebounds(cases) -> Iterator[Measure]:
    """Worst error of e and worst energy of `rebound`s; each case begins with (stiffness, e)."""
    found = [(rebound(*case), case[1]) for case in cases]
    yield Measure("restitution, off e", max(abs(w.returned - e) for w, e in found), 0.003)
    for what, elastic, limit in (("e < 1", False, 1e-3), ("e = 1", True, ELASTIC_GAIN)):
        gains = [w.gain / w.scale for w, e in found if (e == 1.0) == elastic]
        if gains:
            yield Measure(f"energy gained, {what}", max(gains), limit)
    yield Measure("balance of energy", max(w.drift / w.scale for w, _ in found), 0.005)


@scene("S10", "contact 1e4 times stiffer and softer than usual, e 0.05 to 1")
def stiff() -> Iterator[Measure]:
    yield from rebounds((K, e) for K in (1e5, 1e9, 1e13) for e in (0.05, 0.5, 1.0))


@scene("S11", "density 100 to 20000 kg/m³, landing")
def densities() -> Iterator[Measure]:
    yield from rebounds((1e8, 0.5, 1.0, density) for density in (LIGHT, DENSITY, HEAVY))


@scene("S12", "rods and plates of aspect ratio 50 that land flat and on an edge")
def slender() -> Iterator[Measure]:
    sizes = ((2.0, 0.04, 0.04), (0.04, 0.04, 2.0), (2.0, 2.0, 0.04))
    yield from rebounds((1e7, 0.5, size) for size in sizes)
    for size in sizes:
        turn = Rotation.from_euler("xy", (20.0, 35.0), degrees=True).as_matrix()
        block = Block("b", (0, 0, 1.5), size=size, rotation=turn, density=DENSITY)
        with Structure([block], ContactLaw(1e7, 0.5, 0.5), ground=0.0) as s:
            watch = Watch(s, block.mass * G * 1.5)
            watch.advance(2.0, looks=100)
            depth = -lowest(s)
            name = " x ".join(f"{edge:g}" for edge in size)
            yield Measure(f"depth below the floor, {name}", depth, 0.005, "m")
        yield from watch.measures(name)


@scene("S13", "block slides into a corner of three planes")
def corner() -> Iterator[Measure]:
    planes = [FixedPlane((0, 0, 0), (1, 0, 0), "x"), FixedPlane((0, 0, 0), (0, 1, 0), "y")]
    block = Block("b", (1.2, 1.5, 0.5), size=1.0, density=DENSITY, velocity=(-3.0, -3.0, 0.0))
    with Structure([block], ContactLaw(1e8, 0.3, 0.2), ground=0.0, planes=planes) as s:
        watch = Watch(s, 0.5 * block.mass * 18.0)
        watch.advance(3.0, looks=100)
        yield Measure("deepest corner", max(0.0, -corners(s).min()), 1.1 * block.mass * G / 1e8, "m")
        yield Measure("speed at the end", speed(s), 1e-4, "m/s")
    yield from watch.measures()


@scene("S14", "prism wedged between two fixed slopes, without and with friction")
def wedge() -> Iterator[Measure]:
    """Both slopes together carry the weight, W = 2 N sin(half the angle between them) without friction."""
    for half, friction in ((45.0, 0.0), (15.0, 0.4)):
        a = np.radians(half)
        tip = np.array([[0, 0], [np.sin(a), np.cos(a)], [-np.sin(a), np.cos(a)]])
        outline = [(x, y, z) for y in (-0.5, 0.5) for x, z in tip]
        block = Block.standing("wedge", np.array(outline), density=DENSITY)
        planes = [
            FixedPlane((0, 0, 0), (sign * np.cos(a), 0, np.sin(a)), name)
            for sign, name in ((-1, "right"), (1, "left"))
        ]
        with Structure([block], ContactLaw(1e8, 0.2, friction), planes=planes) as s:
            watch = Watch(s, block.mass * G * 0.1)
            start = s.centre()[0].copy()
            watch.advance(2.0, looks=100)
            early = s.centre()[0].copy()
            watch.advance(1.0, looks=50)
            c = s.contacts()
            setting = f"half angle {half:g} degrees, friction {friction:g}"
            lift = -(c.normal_force + c.shear_force)[:, 2].sum() / (block.mass * G)
            yield Measure(f"carried, off its weight, {setting}", lift - 1.0, 1e-4)
            if friction == 0.0:
                normal = np.linalg.norm(c.normal_force, axis=1).sum() * np.sin(a) / (block.mass * G)
                yield Measure(f"normal forces, off W/sin, {setting}", normal - 1.0, 1e-4)
            yield Measure(
                f"creep in the last second, {setting}", np.linalg.norm(s.centre()[0] - early), 1e-8, "m"
            )
            yield Measure(
                f"moved from its place, {setting}", np.linalg.norm(s.centre()[0] - start), 0.01, "m"
            )
        yield from watch.measures(setting)


@scene("S15", "thin plate (aspect ratio 50) spins on the floor")
def spinning_plate() -> Iterator[Measure]:
    """The plate stays flat and stops after the time ω I/(0.3826 a μ m g), which follows from a uniform pressure."""
    plate = Block("p", (0, 0, 0.01), size=(1.0, 1.0, 0.02), density=DENSITY, spin=(0, 0, 20.0))
    torque = 0.3826 * 0.3 * plate.mass * G
    even = 20.0 * plate.mass / 6.0 / torque
    with Structure([plate], ContactLaw(1e7, 0.3, 0.3), ground=0.0) as s:
        watch = Watch(s, 0.5 * plate.mass / 6.0 * 400.0)
        tilt, stopped = 0.0, np.inf
        for _ in range(100):
            watch.advance(0.04, looks=1)
            tilt = max(tilt, float(np.arccos(min(1.0, s.rotation()[0, 2, 2]))))
            if stopped == np.inf and abs(s.velocity()[0, 5]) < 0.01:
                stopped = s.time
        yield Measure("largest tilt", tilt, 1e-3, "rad")
        yield Measure("spin at the end", abs(s.velocity()[0, 5]), 1e-3, "rad/s")
        yield Measure("way of its centre", float(np.hypot(*s.centre()[0, :2])), 1e-3, "m")
        yield Measure("time to stop, off that of an even pressure", stopped / even - 1.0, 0.03)
    yield from watch.measures()


@scene("S16", "hit as hard as the contact can take: sinks by half of the thinner block")
def hard_hit() -> Iterator[Measure]:
    """The overlap of an impact is v √(m/K). Where it is half the plate, the blocks must rebound with e, not tunnel."""
    stiffness, thickness = 1e9, 0.2
    plate = Block("plate", (0, 0, 0.1), size=(1.0, 1.0, thickness), density=DENSITY, fixed=True)
    mass = DENSITY
    fall = 0.5 * thickness * np.sqrt(stiffness / mass)
    block = Block("b", (0, 0, 0.75), size=1.0, density=DENSITY, velocity=(0, 0, -fall))
    with Structure([plate, block], ContactLaw(stiffness, 0.5), gravity=STILL) as s:
        watch = Watch(s, 0.5 * mass * fall**2)
        watch.advance(0.1 / fall + 12.0 * np.sqrt(mass / stiffness), looks=50)
        yield Measure("speed before", fall, None, "m/s")
        yield Measure("restitution, off e", s.velocity()[1, 2] / fall - 0.5, 0.02)
    yield from watch.measures()
