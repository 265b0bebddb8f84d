"""Blocks of very different masses on and between each other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.registry import Measure, scene
from coupler.commands.stress.structure.watch import Watch, speed
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

G = 9.81
STIFF = 1e8


def pile(densities, stiffness: float = STIFF, time: float = 8.0) -> Iterator[Measure]:
    """Cubes of 1 m on one another come to rest: each interface carries what is above it.

    The dashpot of a pair follows from its effective mass; it hardly damps the heavy block, which vibrates for long."""
    blocks = [
        Block(f"b{i}", (0, 0, i + 0.5), size=1.0, density=density) for i, density in enumerate(densities)
    ]
    weights = np.array([b.mass for b in blocks])[::-1].cumsum()[::-1] * G
    with Structure(blocks, ContactLaw(stiffness, 0.1), ground=0.0) as s:
        watch = Watch(s, float(weights.sum() * 0.01 + weights[0] ** 2 / stiffness))
        watch.advance(time, looks=100)
        z = s.centre()[:, 2]
        depth = 1.0 - np.diff(np.append(-0.5, z))
        yield Measure(
            "depth of the contacts, off weight/K",
            float(np.abs(depth * stiffness / weights - 1.0).max()),
            0.02,
        )
        yield Measure("speed at the end", speed(s), 1e-3, "m/s")
        yield Measure("sideways drift", float(np.abs(s.centre()[:, :2]).max()), 1e-6, "m")
    yield from watch.measures()


@scene("S20", "heavy cube on a light one, masses 1000 to 1")
def heavy_on_light() -> Iterator[Measure]:
    yield from pile((20.0, 20000.0))


@scene("S21", "light cube between heavy ones, masses 1000 to 1")
def light_between() -> Iterator[Measure]:
    yield from pile((20000.0, 20.0, 20000.0))


@scene("S22", "masses 1000 to 1 thrown at each other")
def thrown() -> Iterator[Measure]:
    """Restitution with the effective mass; momentum to round-off."""
    for light, heavy in ((20.0, 20000.0), (20000.0, 20.0)):
        blocks = [
            Block("a", (0, 0, 0.5), size=1.0, density=light),
            Block("b", (0, 0, 1.5 + 1e-4), size=1.0, density=heavy, velocity=(0, 0, -1.0)),
        ]
        with Structure(blocks, ContactLaw(STIFF, 0.5), gravity=(0, 0, 0)) as s:
            mass = light * heavy / (light + heavy)
            watch = Watch(s, 0.5 * mass)
            watch.advance(6e-3, looks=50)
            v = s.velocity()[:, 2]
            yield Measure(f"restitution, off e, {heavy:g} on {light:g} kg", v[1] - v[0] - 0.5, 0.02)
            yield Measure("momentum, off the start", s.mass @ v / -heavy - 1.0, 1e-12)
        yield from watch.measures()
