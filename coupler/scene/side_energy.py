"""The energy that inflows and seas can bring into a tank, by which errors are measured before it has come in."""

from __future__ import annotations

import numpy as np

from coupler.case.case import Case
from coupler.geometry.tank_mesh import floor_along
from coupler.scene.build_water import fills_beside, flow_of, sea_level

TIMES = 101
"""Instants of a run at which an inflow is looked at."""


def side_energy(case: Case) -> float:
    """Σ ½ ρ b h (g Δz² + h v²) [J] over the sides: what a step Δz in the level and a stream of speed v hold over a
    stretch of the tank as long as the water is deep.

    b [m] width of the side, h [m] largest depth there, Δz [m] largest difference from the water at the start, v [m/s]
    largest speed, each over the whole run."""
    times = np.linspace(0.0, case.time.end, TIMES)
    found = 0.0
    for sea in case.water.sea:
        level = sea_level(sea)
        found += _energy(case, sea.side, np.array([level(time) for time in times]), 0.0)
    for spec in case.water.inflow:
        flow = flow_of(case, spec)
        level = np.array([flow.level(time) for time in times])
        floor = floor_along(case.tank, spec.side)
        speed = max(_speed(flow, floor, time, z) for time, z in zip(times, level))
        found += _energy(case, spec.side, level, speed)
    return float(found)


def _speed(flow, floor: float, time: float, level: float) -> float:
    """Largest speed [m/s] of a flow between the bed and its surface."""
    points = np.zeros((2, 3))
    points[:, 2] = floor, level
    return float(np.linalg.norm(flow.velocity(points, time), axis=1).max())


def _energy(case: Case, side: str, level, speed: float) -> float:
    """The energy [J] of one side with the levels (k,) [m] that it has in the run."""
    size = np.subtract(case.tank.upper, case.tank.lower)
    width = size[1] if side[0] == "x" else size[0]
    depth = max(level.max() - floor_along(case.tank, side), 0.0)
    step = np.abs(level - _level_at(case, side)).max()
    return 0.5 * case.water.density * width * depth * (case.case.gravity * step**2 + depth * speed**2)


def _level_at(case: Case, side: str) -> float:
    """Height z [m] of the water beside a side at the start: of the highest box that reaches it, else the floor."""
    return max([fill.upper[2] for fill in fills_beside(case, side)] + [case.tank.lower[2]])
