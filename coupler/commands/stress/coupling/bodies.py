"""Single blocks in water: much lighter or heavier than it, entering, leaving, colliding, resting, sliding."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.flow import Flow, speed
from coupler.commands.stress.registry import Measure, scene
from coupler.commands.verify.scenes import DENSITY, G, level_at, tank
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

EDGE = 0.3
CELLS = (10, 10, 12)
SIZE = (1.0, 1.0, 1.2)
LEVEL = 0.8
WALLS = [
    FixedPlane(point, normal, name)
    for point, normal, name in (
        ((0, 0, 0), (1, 0, 0), "x-"),
        ((1, 0, 0), (-1, 0, 0), "x+"),
        ((0, 0, 0), (0, 1, 0), "y-"),
        ((0, 1, 0), (0, -1, 0), "y+"),
    )
]


def pool(structure, **more):
    """A tank of 1 m with water 0.8 m deep and cells of 0.1 m; two passes, the default of a case."""
    c = tank(SIZE, CELLS, level_at(LEVEL), structure, rtol=1e-9, **more)
    c.passes = 2
    return c


def cube(name: str, centre, density: float, **more) -> Block:
    """A cube with an edge of three cells."""
    return Block(name, centre, size=EDGE, density=density, **more)


@scene("C01", "cube of a hundredth of the density of water let go under it")
def light_released() -> Iterator[Measure]:
    """The added mass is 50 times the block's own: a staggered scheme would diverge in two steps. It must not rise
    faster than buoyancy can drive it, and it ends afloat."""
    with Structure([cube("c", (0.52, 0.47, 0.3), 10.0)], ContactLaw(1e5), ground=0.0, planes=WALLS) as s:
        flow = Flow(pool(s))
        fastest = [0.0]
        flow.run(1.0, each=lambda r: fastest.append(speed(s)))
        rise = np.sqrt(2.0 * G * SIZE[2] * 0.99 / 0.3)
        yield Measure("largest speed over that of a rise without drag", max(fastest) / rise, 1.0)
        yield Measure("height of its centre over the level", s.centre()[0, 2] - LEVEL, 0.4, "m")
    yield from flow.measures()


@scene("C02", "block falls into the water at 5 m/s, dives and comes up")
def falls_in() -> Iterator[Measure]:
    with Structure(
        [cube("c", (0.52, 0.47, 1.0), 500.0, velocity=(0.0, 0.0, -5.0))],
        ContactLaw(1e6),
        ground=0.0,
        planes=WALLS,
    ) as s:
        flow = Flow(pool(s, is_open=None))
        heights = []
        flow.run(1.0, each=lambda r: heights.append(s.centre()[0, 2]))
        yield Measure("lowest centre", min(heights), None, "m")
        yield Measure("speed at the end", speed(s), 2.0, "m/s")
    yield from flow.measures()


@scene("C03", "block pulled out of the water at 2 m/s")
def pulled_out() -> Iterator[Measure]:
    block = cube("c", (0.52, 0.47, 0.4), 500.0, driven=True, velocity=(0.0, 0.0, 2.0))
    with Structure([block]) as s:
        flow = Flow(pool(s)).run(0.3)
        yield Measure("force on it once it is out", float(np.abs(flow.record.load).max()), None, "N")
    yield from flow.measures()


@scene("C04", "block rests on the bed, two more on it, all under water")
def stack_at_rest() -> Iterator[Measure]:
    """Each contact carries what is above it less buoyancy: water acts on every face that is not glued."""
    density, stiffness = 2000.0, 1e7
    edge = 0.2
    sunk = (density - DENSITY) * edge**3 * G / stiffness * np.cumsum([3.0, 2.0, 1.0])
    blocks = [
        Block(f"c{k}", (0.52, 0.47, (k + 0.5) * edge - sunk[k]), size=edge, density=density) for k in range(3)
    ]
    with Structure(blocks, ContactLaw(stiffness, 0.1), ground=0.0) as s:
        start = s.centre()
        flow = Flow(pool(s)).run(1.0)
        c = s.contacts()
        on_ground = c.b < 0
        carried = np.abs(c.normal_force[on_ground, 2].sum())
        weight = 3 * (density - DENSITY) * edge**3 * G
        yield Measure("bed carries, off weight less buoyancy", carried / weight - 1.0, 0.01)
        yield Measure("moved", float(np.abs(s.centre() - start).max()), 1e-4, "m")
        yield Measure("speed at the end", speed(s), 1e-3, "m/s")
    yield Measure("fastest water", flow.fastest, 0.01, "m/s")
    yield Measure("error of the volume", flow.volume, 1e-3)


@scene("C05", "block slides over the bed under water until friction stops it")
def slides() -> Iterator[Measure]:
    """Friction follows from the weight less buoyancy, and the block must set the water in motion. It slides no farther
    than without drag, which is (1 + a/s) times the dry distance with the added mass a < 0.8."""
    density, fast, mu = 2500.0, 1.0, 0.5
    block = cube("c", (0.3, 0.5, 0.5 * EDGE), density, velocity=(fast, 0.0, 0.0))
    with Structure([block], ContactLaw(1e7, 0.1, mu), ground=0.0, planes=WALLS) as s:
        flow = Flow(pool(s)).run(1.0)
        pull = mu * (1.0 - DENSITY / density) * G / (1.0 + 0.8 * DENSITY / density)
        yield Measure(
            "way over the longest that friction allows",
            (s.centre()[0, 0] - 0.3) / (0.5 * fast**2 / pull),
            1.0,
        )
        yield Measure("speed at the end", speed(s), 0.02, "m/s")
        yield Measure("lift off the bed", s.centre()[0, 2] - 0.5 * EDGE, 0.005, "m")
    yield from flow.measures()


@scene("C06", "block sinks onto another one under water and hits it")
def collide() -> Iterator[Measure]:
    """The overlap does not exceed v √(m/K) with the added mass included, and the blocks come to rest on one another."""
    stiffness, edge = 1e6, 0.25
    blocks = [
        Block("below", (0.5, 0.5, 0.5 * edge), size=edge, density=2000.0),
        Block("above", (0.5, 0.5, 1.5 * edge + 0.15), size=edge, density=4000.0),
    ]
    mass = blocks[1].mass + DENSITY * edge**3
    with Structure(blocks, ContactLaw(stiffness, 0.3), ground=0.0, planes=WALLS) as s:
        flow = Flow(pool(s))
        deepest, fastest = [0.0], [0.0]

        def look(record):
            z = s.centre()[:, 2]
            deepest.append(edge - (z[1] - z[0]))
            fastest.append(speed(s))

        flow.run(1.0, each=look)
        depth = max(fastest) * np.sqrt(mass / (0.5 * stiffness)) + 2.0 * mass * G / stiffness
        yield Measure("speed before it hits", max(fastest), None, "m/s")
        yield Measure("deepest over that of the impact", max(deepest) / depth, 1.0)
        yield Measure("speed at the end", speed(s), 0.05, "m/s")
    yield from flow.measures()


@scene("C07", "heavy on light under water, masses 1000 to 1")
def masses() -> Iterator[Measure]:
    """The net buoyancy of the light block is 9.7 times smaller than the submerged weight of the heavy one. The dashpots
    depend on the effective mass of a pair, that of the light block, so that the heavy one oscillates: by 12 % of its
    weight after 0.5 s and by 1 % after 1 s, in air with its buoyancy held as well."""
    edge, stiffness = 0.2, 1e7
    blocks = [
        Block("light", (0.52, 0.47, 0.5 * edge), size=edge, density=20.0),
        Block("heavy", (0.52, 0.47, 1.5 * edge), size=edge, density=20000.0),
    ]
    with Structure(blocks, ContactLaw(stiffness, 0.1), ground=0.0, planes=WALLS) as s:
        flow = Flow(pool(s)).run(1.0)
        c = s.contacts()
        carried = np.abs(c.normal_force[c.b < 0, 2].sum())
        weight = (20020.0 - 2 * DENSITY) * edge**3 * G
        yield Measure("bed carries, off weight less buoyancy", carried / weight - 1.0, 0.02)
        yield Measure("speed at the end", speed(s), 0.02, "m/s")
    yield Measure("error of the volume", flow.volume, 1e-3)
    yield Measure("largest defect", flow.defect, None)
