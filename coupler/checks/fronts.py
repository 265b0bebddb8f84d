"""Fronts on dry beds with friction: remarks on cells that are too high for the slow water below the front."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.checks.places import solid_bodies
from coupler.geometry.bodies import Body
from coupler.geometry.cell_sizes import edges_at
from coupler.geometry.parts import parts_of
from coupler.scene.build_water import SLACK

FEWEST = 48
"""Cells on the bed over the depth of the water before the release from which the pressure at the foot of a wall is
within the measured band for more than four fifths of the time (P38; docs/water.md has the shares for other cells)."""
ENOUGH = 64
"""The number that is advised."""
FLATTEST = 4.0
"""Length of a brick over its height beyond which none are advised: longer ones lack pressure in the corner."""
PART = 8
"""Depth over the height up to which the cells have to be flat."""
PLACES = 32
"""Places along each axis at which cells on the bed, and what stands beside the water, are looked at."""


def front_remarks(case: Case) -> Iterator[str]:
    """Water that runs out over a dry level bed with friction, towards something that its load is sought on, over cells
    that are neither flat nor halved there.

    Friction leaves slow water on the bed, a few hundredths of the depth before the release, which does not rise to the
    stagnation pressure at the foot of a wall. Cubes of a 16th to a 32nd of that depth mix it with the stream above, and
    the mean pressure there is 17 to 30 % too high; only the height of the cells on the bed counts."""
    w, tank = case.water, case.tank
    if w is None or tank is None or not tank.is_box or tank.regions is not None or tank.refine:
        return
    if w.walls != "friction" or w.viscosity > 0.0 or w.inflow or w.sea or not _loads_are_sought(case):
        return
    bodies = [body for _, _, body in solid_bodies(case)]
    bodies += [Body.of_block(block) for part in parts_of(case) for block in part.blocks]
    free = [i for i, fill in enumerate(w.fill) if _runs_out(case, fill, bodies)]
    if not free:
        return
    i = max(free, key=lambda i: w.fill[i].upper[2])
    depth, floor = w.fill[i].upper[2] - tank.lower[2], tank.lower[2]
    height = _height_on_bed(tank)
    if height * FEWEST <= depth * (1.0 + SLACK) or height < tank.cell * (1.0 - SLACK):
        return
    flat = max(depth / ENOUGH, tank.cell / FLATTEST)
    yield (
        f"water.fill[{i}], {depth:.3g} m deep, runs out over a dry bed with friction, on cells {height:.3g} m high "
        f"(1/{depth / height:.3g} of the depth): they do not resolve the slow water that friction leaves on the bed, "
        "and the pressure at the foot of a wall that the front meets may be a fifth too high; flat cells on the bed "
        f'alone cure that at little cost: [[tank.stretch]] along = "z", upper = {floor + depth / PART:.3g}, '
        f"cell = {flat:.2g}"
    )


def _loads_are_sought(case: Case) -> bool:
    """Whether the case has blocks, or gauges of pressures or forces."""
    kinds = {gauge.kind for gauge in case.gauge}
    return case.structure is not None or bool(kinds & {"pressure", "patch", "force", "loads"})


def _runs_out(case: Case, fill, bodies) -> bool:
    """Whether a box of water on the floor has a side with air beyond it and a dry bed: no wall of the tank, no other
    water on the floor, and no bodies along most of that side."""
    tank, slack = case.tank, SLACK * case.tank.cell
    lower, upper = np.maximum(fill.lower, tank.lower), np.minimum(fill.upper, tank.upper)
    if fill.lower[2] > tank.lower[2] + slack or (upper <= lower).any() or fill.surface is not None:
        return False
    others = [other for other in case.water.fill if other is not fill]
    for axis in (0, 1):
        for end, way in ((lower, -1.0), (upper, 1.0)):
            if way < 0.0 and end[axis] <= tank.lower[axis] + slack:
                continue
            if way > 0.0 and end[axis] >= tank.upper[axis] - slack:
                continue
            at = _grid(lower, upper, axis, end[axis] + way * 0.5 * tank.cell)
            held = np.zeros(len(at), bool)
            for body in bodies:
                held |= body.depth(at) > 0.0
            lowest = at[at[:, 2] == at[:, 2].min()]
            wet = np.zeros(len(lowest), bool)
            for other in others:
                wet |= ((lowest >= other.lower) & (lowest <= other.upper)).all(axis=1)
            if held.mean() < 0.5 and wet.mean() < 0.5:
                return True
    return False


def _grid(lower, upper, axis: int, at: float):
    """Places (m, 3) [m] all over a box, drawn together in a plane across one of the axes at a coordinate [m]."""
    share = (np.arange(PLACES) + 0.5) / PLACES
    ways = [np.array([at]) if k == axis else lower[k] + share * (upper[k] - lower[k]) for k in range(3)]
    return np.stack(np.meshgrid(*ways, indexing="ij"), axis=-1).reshape(-1, 3)


def _height_on_bed(tank) -> float:
    """Height [m] of the lowest cells of a tank without regions of finer cells."""
    middle = 0.5 * np.add(tank.lower, tank.upper)
    at = np.array([[middle[0], middle[1], tank.lower[2] + SLACK * SLACK * tank.cell]])
    return float(edges_at(tank, at)[0, 2])
