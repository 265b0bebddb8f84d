"""The depth of the water around a body: at the corners and sides of its footprint, just outside of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from coupler.verdict.divisions import Division

if TYPE_CHECKING:
    from fluid.mesh.background import Background
    from fluid.step.water import Water


OUTSIDE = 1.5
"""Cells between a body and where its depth is read: the cells that it cuts lie between."""
HEIGHTS = 5
"""Heights between the foot and the top of a body at which the size of the cells beside it is taken."""


def depths_around(water: Water, bodies: Division, lower: Array, upper: Array) -> tuple[Array, Array]:
    """The largest depth [m] beside each body now (k,), and where (k, 2) [m]; 0 and NaN where there is no room.

    lower, upper (n, 3) [m]: of the blocks at the start."""
    from fluid.readings.gauges import levels

    k = len(bodies.names)
    places = [
        _around(lower[rows], upper[rows], OUTSIDE * _cell_beside(water.mesh, lower[rows], upper[rows]))
        for rows in map(bodies.rows, range(k))
    ]
    low, high = water.mesh.bounds
    body = np.repeat(np.arange(k), [len(p) for p in places])
    place = np.concatenate(places)
    inside = ((place > low[:2]) & (place < high[:2])).all(axis=1)
    body, place = body[inside], place[inside]
    depth, at = np.zeros(k), np.full((k, 2), np.nan)
    if len(place):
        found = levels(water, place)
        order = np.argsort(found, kind="stable")  # of each body the deepest comes last and stays
        depth[body[order]], at[body[order]] = found[order], place[order]
    return depth, at


def _cell_beside(mesh: Background, lower: Array, upper: Array) -> float:
    """Size [m] of the largest cell at the sides of the box around the blocks, as far as it is in the tank."""
    low, high = np.clip((lower[:, 2].min(), upper[:, 2].max()), *mesh.bounds[:, 2])
    place, z = _around(lower, upper, 0.0), np.linspace(low, high, HEIGHTS)
    return float(
        mesh.size_at(np.column_stack([np.repeat(place, HEIGHTS, axis=0), np.tile(z, len(place))])).max()
    )


def _around(lower: Array, upper: Array, distance: float) -> Array:
    """(8, 2) [m] corners and middles of the sides of the rectangle around the blocks, `distance` outside."""
    low, high = lower.min(axis=0)[:2] - distance, upper.max(axis=0)[:2] + distance
    middle = 0.5 * (low + high)
    grid = np.array([[x, y] for x in (low[0], middle[0], high[0]) for y in (low[1], middle[1], high[1])])
    return np.delete(grid, 4, axis=0)
