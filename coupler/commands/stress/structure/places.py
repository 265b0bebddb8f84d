"""Very small and very large blocks, and scenes far from the origin."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from coupler.commands.stress.registry import Measure, scene
from coupler.commands.stress.structure.watch import Watch, lowest
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

G = 9.81
DENSITY = 2000.0


def dropped(size: float) -> Iterator[Measure]:
    """A tilted cube falls by its edge and settles. The ratio of stiffness to weight is the same for all sizes."""
    weight = DENSITY * size**3 * G
    stiffness = 2000.0 * weight / size
    turn = Rotation.from_euler("xyz", (10.0, 20.0, 30.0), degrees=True).as_matrix()
    block = Block("b", (0, 0, 2.0 * size), size=size, rotation=turn, density=DENSITY)
    with Structure([block], ContactLaw(stiffness, 0.3, 0.5), ground=0.0) as s:
        watch = Watch(s, weight * size)
        watch.advance(12.0 * np.sqrt(size / G), looks=100)
        setting = f"{size:g} m"
        yield Measure(
            f"depth below the floor over weight/K, {setting}", max(0.0, -lowest(s)) * stiffness / weight, 1.1
        )
        yield Measure(
            f"speed at the end over √(g L), {setting}",
            np.abs(s.velocity()[0, :3]).max() / np.sqrt(G * size),
            1e-4,
        )
    yield from watch.measures(setting)


@scene("S30", "cubes of 1 mm and of 100 m dropped")
def sizes() -> Iterator[Measure]:
    yield from dropped(1e-3)
    yield from dropped(100.0)


@scene("S31", "a cube of 1 cm on one of 10 m")
def small_on_large() -> Iterator[Measure]:
    """Only the nodes of the small block carry load, yet the stiffness of the pair is K, so it sinks by W/K."""
    blocks = [
        Block("large", (0, 0, 5.0), size=10.0, density=DENSITY, fixed=True),
        Block("small", (3.0, 2.0, 10.01), size=0.01, density=DENSITY),
    ]
    with Structure(blocks, ContactLaw(1e5, 0.3), ground=0.0) as s:
        weight = blocks[1].mass * G
        watch = Watch(s, weight * 0.005)
        watch.advance(0.5, looks=50)
        depth = 10.0 + 0.005 - s.centre()[1, 2]
        yield Measure("depth of the contact, off weight/K", depth * 1e5 / weight - 1.0, 0.01)
    yield from watch.measures()


@scene("S32", "map coordinates: 500 km east, 4000 km north")
def far_away() -> Iterator[Measure]:
    """Two tilted blocks, one bonded, one dropped on it: the same motion as at the origin."""
    here, there = _path(np.zeros(3)), _path(np.array([500_000.0, 4_000_000.0, 1000.0]))
    yield Measure("places, off those at the origin", float(np.abs(there - here).max()), 1e-7, "m")


def _path(origin) -> np.ndarray:
    turn = Rotation.from_euler("xyz", (10.0, 20.0, 30.0), degrees=True).as_matrix()
    blocks = [
        Block("foot", np.add(origin, (0.0, 0.0, 0.5)), size=1.0, density=DENSITY),
        Block("high", np.add(origin, (0.1, 0.2, 2.2)), size=1.0, rotation=turn, density=DENSITY),
    ]
    joints = JointParameters(1e6, 1e-3, damping=0.0)
    with Structure(blocks, ContactLaw(1e8, 0.3), joints, ground=origin[2]) as s:
        s.advance(0.3)
        return s.centre() - origin
