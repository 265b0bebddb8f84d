"""Water at rest around fixed bodies that cut the mesh anywhere: p = ρ g (h - z), no motion, Archimedes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.spatial.transform import Rotation

from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import DENSITY, G, box, level_at, tank
from fluid.mesh.refinement import InBox

WEIGHT = DENSITY * G
STEPS, STEP = 1000, 0.01
LARGEST = 1e-7
"""Speed [m/s] that counts as rest."""
SEEDS = (1, 2)
AROUND = InBox((0.3, 0.3, 0.3), (0.6, 0.6, 1.0), 1)
FINER = "cells halved across the block"
"""Half of the block and of the surface lie in finer cells."""


@check("P30", "water at rest in a tank with fixed cut blocks", "Archimedes; p = rho g (h - z)")
def at_rest():
    size, level = np.array([0.3, 0.25, 0.2]), 0.78
    for name, turn in (
        ("straight", np.eye(3)),
        ("turned", Rotation.from_rotvec([0.2, 0.4, 0.5]).as_matrix()),
    ):
        c, record = _rest([box((0.5, 0.45, 0.4), size, turn)], level, "single", cells=8)
        buoyancy = WEIGHT * size.prod()
        yield Finding(f"{name}: lift / buoyancy", record.load[0, 2] / buoyancy, 1.0, 1e-6)
        sideways = np.abs(record.load[0, [0, 1, 3, 4, 5]]).max() / buoyancy
        yield Finding(f"{name}: other forces and moments / buoyancy", sideways, 0.0, 1e-6, False)
        yield from _stillness(name, c, level)
        c, record = _rest([box((0.5, 0.45, 0.4), size, turn)], level, "single", 4, [AROUND])
        yield Finding(f"{name}, {FINER}: lift / buoyancy", record.load[0, 2] / buoyancy, 1.0, 1e-6)
        yield from _stillness(f"{name}, {FINER}", c, level)
    for covers in ("single", "multiple"):
        for kind in SCENES:
            yield from _anywhere(kind, covers)


def _rest(solids, level: float, covers: str, cells: int = 6, refined=()):
    """A tank of 1 m, `cells` along each edge, after STEPS steps; and the record of the last one."""
    c = tank((1, 1, 1), (cells,) * 3, level_at(level), solids=solids, covers=covers, refined=refined)
    for _ in range(STEPS):
        record = c.step(STEP)
    return c, record


def _stillness(name: str, c, level: float) -> Iterator[Finding]:
    yield Finding(f"{name}: largest speed after {STEPS} steps [m/s]", _speed(c.water), 0.0, LARGEST, False)
    error = _pressure_error(c.water, level)
    yield Finding(f"{name}: largest error of p / (rho g h)", error, 0.0, 1e-6, False)


def _anywhere(kind: str, covers: str) -> Iterator[Finding]:
    """Worst error over several random positions and tilts of one kind of scene."""
    speeds, errors = [], []
    for seed in SEEDS:
        random = np.random.default_rng(seed)
        level = random.uniform(0.70, 0.85)
        c, _ = _rest(SCENES[kind](random), level, covers)
        speeds.append(_speed(c.water))
        errors.append(_pressure_error(c.water, level))
    where = f"{kind}, {len(SEEDS)} random places, {covers} covers"
    yield Finding(f"{where}: largest speed [m/s]", max(speeds), 0.0, LARGEST, False)
    yield Finding(f"{where}: error of p / (rho g h)", max(errors), 0.0, 1e-6, False)


def _speed(water) -> float:
    return float(np.abs(water.velocity[_wet(water)]).max())


def _pressure_error(water, level: float) -> float:
    wet = _wet(water)
    exact = WEIGHT * (level - water.topology.nodes[wet, 2])
    return float(np.abs(water.pressure[wet] - exact).max() / (WEIGHT * level))


def _wet(water):
    return (water.level_set < 0.0) & water.topology.active


def _turn(random, most: float = np.pi):
    axis = random.normal(size=3)
    return Rotation.from_rotvec(random.uniform(0.0, most) * axis / np.linalg.norm(axis)).as_matrix()


def _through_the_surface(random):
    """A block that pierces the water surface."""
    centre = [*random.uniform(0.35, 0.65, 2), random.uniform(0.65, 0.85)]
    return [box(centre, random.uniform(0.15, 0.4, 3), _turn(random))]


def _thin_plate(random):
    """A plate of 0.08 to 0.6 cells with all its edges in the water."""
    size = (0.5, 0.4, random.uniform(0.0125, 0.1))
    return [box([*random.uniform(0.4, 0.6, 2), 0.4], size, _turn(random))]


def _thin_wall(random):
    """A wall of 0.08 to 0.6 cells, tilted, that reaches from deep water into the air; its sides end in the water."""
    size = (random.uniform(0.0125, 0.1), 0.5, 0.7)
    return [box([*random.uniform(0.4, 0.6, 2), 0.55], size, _turn(random, 0.6))]


def _through_the_floor(random):
    """A tilted block that goes through the floor of the tank."""
    return [box([*random.uniform(0.35, 0.65, 2), 0.1], (0.3, 0.25, 0.4), _turn(random, 0.6))]


def _two(random):
    """Two rotated blocks, side by side or overlapping."""
    return [
        box((0.35, 0.5, 0.4), (0.3, 0.25, 0.2), _turn(random)),
        box((0.65, 0.45, 0.45), (0.2, 0.3, 0.5), _turn(random)),
    ]


SCENES = {
    "block through the surface": _through_the_surface,
    "thin plate, free edges": _thin_plate,
    "thin wall through the surface, free edges": _thin_wall,
    "block through the floor": _through_the_floor,
    "two blocks": _two,
}
