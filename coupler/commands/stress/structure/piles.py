"""Many blocks: a tower at rest and rubble that falls."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.registry import Measure, scene
from coupler.commands.stress.structure.watch import Watch, corners, lowest, speed
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.blocks.generators.rubble import rubble_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

G = 9.81
DENSITY = 2000.0


@scene("S50", "tower of 100 loose blocks at rest for 60 s", cost="M")
def tower() -> Iterator[Measure]:
    """Slabs of 5 x 5 x 0.25 m, so that the stacked springs do not buckle, K > ρ g n³ h². They start with overlaps
    at which the contacts carry the weight above."""
    count, edge, height, stiffness = 100, 5.0, 0.25, 3e9
    weight = DENSITY * edge**2 * height * G
    depth = weight * np.arange(count, 0, -1) / stiffness
    z = (np.arange(count) + 0.5) * height - np.cumsum(depth)
    blocks = [Block(f"b{i}", (0, 0, z[i]), size=(edge, edge, height), density=DENSITY) for i in range(count)]
    with Structure(blocks, ContactLaw(stiffness, 0.1), ground=0.0) as s:
        watch = Watch(s, 0.5 * weight * count * depth.sum() / 3.0)
        fastest = 0.0
        for _ in range(120):
            watch.advance(0.5, looks=1)
            fastest = max(fastest, speed(s))
        yield Measure(
            "creep of any block", float(np.abs(s.centre() - np.stack([0 * z, 0 * z, z], 1)).max()), 1e-7, "m"
        )
        yield Measure("largest speed", fastest, 1e-7, "m/s")
        yield Measure("turn of any block", float(np.abs(s.rotation() - np.eye(3)).max()), 1e-7, "rad")
    yield from watch.measures()


def heap(count: int, time: float) -> Iterator[Measure]:
    """Boxes and polyhedra fall into a pit of four walls and come to rest in it."""
    side = 0.8 * (count * 0.5**3 / 0.25) ** (1.0 / 3.0)
    blocks = rubble_blocks(
        "r", (0, 0, 0.2), (side, side, 2.0 * side), count, (0.4, 0.6), 1, "mixed", density=DENSITY
    )
    walls = [
        FixedPlane((0, 0, 0), (1, 0, 0), "x-"),
        FixedPlane((side, 0, 0), (-1, 0, 0), "x+"),
        FixedPlane((0, 0, 0), (0, 1, 0), "y-"),
        FixedPlane((0, side, 0), (0, -1, 0), "y+"),
    ]
    with Structure(blocks, ContactLaw(1e7, 0.3, 0.5), ground=0.0, planes=walls) as s:
        watch = Watch(s, float(sum(b.mass * G * b.centre[2] for b in blocks)))
        deepest = 0.0
        for _ in range(round(time / 0.05)):
            watch.advance(0.05, looks=1)
            x = corners(s)
            deepest = max(deepest, -lowest(s), -x[:, :2].min(), (x[:, :2] - side).max())
        early = s.centre().copy()
        watch.advance(0.5, looks=5)
        yield Measure("deepest into floor or walls, over the smallest block", deepest / 0.4, 0.1)
        yield Measure("speed at the end", speed(s), 1e-2, "m/s")
        yield Measure("way in the last half second", float(np.abs(s.centre() - early).max()), 1e-3, "m")
        yield Measure("contacts at the end", float(len(s.contacts())), None)
    yield from watch.measures()


@scene("S51", "60 blocks of rubble dropped into a pit")
def small_heap() -> Iterator[Measure]:
    yield from heap(60, 3.0)


@scene("S52", "200 blocks of rubble dropped into a pit", cost="M")
def large_heap() -> Iterator[Measure]:
    yield from heap(200, 4.0)
