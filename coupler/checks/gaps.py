"""Gaps beside and below thin walls that dam the tank, through which more water flows than does."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.checks.places import solid_bodies
from coupler.geometry.cell_sizes import widest_cell
from coupler.geometry.parts import parts_of

NARROW = 0.5
"""Cells from which a gap is told. Through one of a whole cell under a gate that is thinner than two cells flows 1.1 of
0.61 b sqrt(2 g h), the discharge under a sluice gate (Henderson, Open Channel Flow, 1966, 6.4), of half a cell 1.2, a
quarter 1.9, a tenth 4 times as much (1 m of water, cells of 0.2 m, all sets of unknowns)."""
THIN = 2.0
"""Cells from which a wall is cut as it is, and its gaps with it."""
EXCESS = ((0.5, 1.2), (0.25, 1.9), (0.1, 4.0))
"""Width of a gap in cells, and what flows through it over what does."""


def gap_remarks(case: Case) -> Iterator[str]:
    """The narrowest gap of each wall that reaches from side to side of the tank but for it, where faces of thin walls
    have unknowns of their own (a single set has a remark on thin walls themselves). Wide openings leave out such gaps.
    """
    tank, water = case.tank, case.water
    if (
        tank is None
        or water is None
        or not tank.is_box
        or water.covers != "multiple"
        or water.openings == "wide"
    ):
        return
    walls = list(_walls(case))
    for name, low, high, thickness in walls:
        others = [(low2, high2) for name2, low2, high2, _ in walls if name2 != name]
        found = min(_gaps(case, low, high, thickness, others), default=None)
        if found is not None:
            share, gap, where = found
            more = np.interp(np.log(share), *np.log(np.array(EXCESS[::-1]).T))
            yield (
                f"the gap of {gap:.3g} m between '{name}' and {where} is {share:.2g} cells wide: beside a wall thinner "
                f"than two cells it lets through about {np.exp(more):.2g} times the water that it should; close it, or "
                f"take cells of {gap:.2g} m there"
            )


def _gaps(case: Case, low: Array, high: Array, thickness: float, others: list) -> Iterator[tuple]:
    """Width in cells, width [m] and far end of each narrow gap of a wall with this box."""
    tank = case.tank
    for across in (0, 1):
        ends = ((low[across] - tank.lower[across], "-"), (tank.upper[across] - high[across], "+"))
        middle = 0.5 * (low + high)
        cell = widest_cell(tank, middle[None], np.eye(3)[across])
        thin = min(thickness, high[1 - across] - low[1 - across])
        if thin >= THIN * widest_cell(tank, middle[None], np.eye(3)[1 - across]) or any(
            gap >= NARROW * cell for gap, _ in ends
        ):
            continue
        for gap, sign in ends:
            room = low.copy(), high.copy()
            room[0][across], room[1][across] = (
                (tank.lower[across], low[across]) if sign == "-" else (high[across], tank.upper[across])
            )
            if gap > 1e-6 * cell and not _filled(room, others):
                yield gap / cell, gap, f"the side {'xy'[across]}{sign} of the tank"
        below, height = low[2] - tank.lower[2], widest_cell(tank, middle[None], np.eye(3)[2])
        under = np.array([*low[:2], tank.lower[2]]), np.array([*high[:2], low[2]])
        if 1e-6 * height < below < NARROW * height and not _filled(under, others):
            yield below / height, below, "the floor of the tank"


def _filled(room: tuple[Array, Array], others: list) -> bool:
    """Whether another wall reaches into a gap."""
    return any(((low < room[1]) & (high > room[0])).all() for low, high in others)


def _walls(case: Case) -> Iterator[tuple[str, Array, Array, float]]:
    """Name, corners (3,) [m] of the box around it and thickness [m] of each solid, wall and building."""
    for _, name, body in solid_bodies(case):
        low, high = body.bounds()
        yield name, np.array(low), np.array(high), np.inf
    for part in parts_of(case):
        if part.path[1] in ("wall", "building"):
            corners = np.concatenate([block.world_vertices() for block in part.blocks])
            spec = getattr(case.structure, str(part.path[1]))[part.path[2]]
            yield part.name, corners.min(axis=0), corners.max(axis=0), getattr(spec, "wall_thickness", np.inf)
