"""Pressure read in cells that the surface cuts.

The pressure of the nodes ends at the surface, and dry nodes have that of the air. Interpolated between the two, it does
not reach the pressure of the air before the dry node: up to a quarter of a cell of still water too much. Here it
goes on to dry corners through the air's at the surface, as it does for the gradient that moves the water and for the
loads on solids (`projection.with_ghosts`), which is exact for still water at any level. So does it to corners under
water that took no part in the solve, since the fluid parts of all cells around them lie above the surface
(`active_cells.py`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from array_types import Array, Bools, Floats, Integers
from kernels.decorators import inner, kernel

if TYPE_CHECKING:
    from fluid.domain.point_location import Places


class Found(NamedTuple):
    """Nodal fields (N,): pressure, and that of the air at dry nodes [Pa] · level_set [m] · at_bound, open_node bool."""

    pressure: Floats
    air: Floats
    level_set: Floats
    at_bound: Bools
    open_node: Bools


class Around(NamedTuple):
    """Cells around node i: node_cells[start[i]:start[i + 1]]; their nodes (M, 4) and fluid volumes (M,) [m³]."""

    start: Integers
    node_cells: Integers
    cells: Integers
    volume: Floats


def pressure_below_surface(water, places: Places, air) -> Array:
    """Pressure (m,) [Pa] at places under water; beside the air at least the lowest of that and of the wet corners.

    air (N,) [Pa]: at the nodes of trapped air, zero elsewhere"""
    t = water.topology
    found = Found(water.pressure, air, water.level_set, water.at_bound, water.walls.open_node)
    around = Around(t.node_start, t.node_cells, t.cells, t.volume)
    return _read(places.corners, places.weight, found, around)


@kernel
def _read(corners, weight, found, around):
    out = np.empty(len(corners))
    for m in range(len(corners)):
        value, lowest, cut = 0.0, np.inf, False
        for a in range(4):
            i = corners[m, a]
            taken = _solved(i, found)
            p = found.pressure[i] if taken else _continued(i, found, around)
            value += weight[m, a] * p
            lowest = min(lowest, found.pressure[i] if taken else found.air[i])
            cut = cut or not taken
        out[m] = max(value, lowest) if cut else value
    return out


@inner
def _solved(i, found):
    """Whether node i is under water and has a pressure of its own, or lies on an open side. A node without an unknown
    has exactly zero; an unknown has it at its bound alone."""
    return found.level_set[i] < 0.0 and (found.pressure[i] != 0.0 or found.at_bound[i] or found.open_node[i])


@inner
def _continued(j, found, around):
    """As in `projection.with_ghosts`."""
    up, down, air = 0.0, 0.0, found.air[j]
    for s in range(around.start[j], around.start[j + 1]):
        e = around.node_cells[s]
        for b in range(4):
            i = around.cells[e, b]
            if _solved(i, found) and not (found.open_node[i] and found.pressure[i] == 0.0):
                phi = found.level_set[i]
                up += around.volume[e] * (found.pressure[i] - air) * phi
                down += around.volume[e] * phi * phi
    return air + (found.level_set[j] * up / down if down > 0.0 else 0.0)
