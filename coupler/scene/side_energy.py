"""The energy that inflows and seas can bring into a tank, the scale of errors before it has entered."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from coupler.case.case import Case
from coupler.geometry.tank_mesh import floor_along
from coupler.scene.build_water import fills_beside, flow_of, instants_of, sea_level

TIMES = 101
"""Number of instants at the start at which the energy of a sea is evaluated."""


@dataclass(frozen=True)
class SideEnergy:
    """½ ρ b h (g Δz² + h v²) [J] of one side at an instant: the energy of a step Δz in the level and of a stream of
    speed v over a length of the tank equal to the depth of the water.

    level(time) z [m], speed(time) the largest v [m/s] there · width b [m] · floor, start: heights z [m] of the bed and
    of the water at the start, Δz is the difference from it · density ρ [kg/m³] · gravity g [m/s²]
    crossing [s]: time of a long wave through the tank.
    """

    level: Callable[[float], float]
    speed: Callable[[float], float]
    width: float
    floor: float
    start: float
    density: float
    gravity: float
    crossing: float

    def at(self, time: float) -> float:
        """[J]"""
        level = self.level(time)
        depth = max(level - self.floor, 0.0)
        held = self.gravity * (level - self.start) ** 2 + depth * self.speed(time) ** 2
        return 0.5 * self.density * self.width * depth * held


def coming_energy(case: Case) -> Callable[[float], float]:
    """Energy [J] that all sides can bring as a function of the time [s].

    For an inflow this is the largest energy over its whole record. For a sea, whose tide takes hours, it is the energy
    after the time in which a wave crosses the tank; at time 0, the largest until then. The end of the run has no
    influence, so that a run with another end has the same figures until then."""
    seas = [_of_sea(case, sea) for sea in case.water.sea]
    inflows = sum(max(map(_of_inflow(case, s).at, instants_of(case, s))) for s in case.water.inflow)

    def coming(time: float) -> float:
        if time > 0.0:
            return inflows + sum(side.at(time + side.crossing) for side in seas)
        return float(
            inflows + sum(max(map(side.at, np.linspace(0.0, side.crossing, TIMES))) for side in seas)
        )

    return coming


def _of_sea(case: Case, sea) -> SideEnergy:
    return _side(case, sea.side, sea_level(sea), lambda time: 0.0)


def _of_inflow(case: Case, spec) -> SideEnergy:
    flow, floor = flow_of(case, spec), floor_along(case.tank, spec.side)

    def speed(time: float) -> float:
        """Largest speed [m/s] between the bed and the surface."""
        points = np.zeros((2, 3))
        points[:, 2] = floor, flow.level(time)
        return float(np.linalg.norm(flow.velocity(points, time), axis=1).max())

    return _side(case, spec.side, flow.level, speed)


def _side(case: Case, side: str, level, speed) -> SideEnergy:
    size = np.subtract(case.tank.upper, case.tank.lower)
    along, across = (0, 1) if side[0] == "x" else (1, 0)
    gravity = case.case.gravity
    return SideEnergy(
        level=level,
        speed=speed,
        width=float(size[across]),
        floor=floor_along(case.tank, side),
        start=_level_at(case, side),
        density=case.water.density,
        gravity=gravity,
        crossing=float(size[along]) / math.sqrt(gravity * size[2]) if gravity > 0.0 else 0.0,
    )


def _level_at(case: Case, side: str) -> float:
    """Initial height z [m] of the water beside a side: that of the highest box that reaches it, else of the floor."""
    return max([fill.upper[2] for fill in fills_beside(case, side)] + [case.tank.lower[2]])
