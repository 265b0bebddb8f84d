"""How large the cells of a tank are at a place: bricks may be stretched along an axis, and halved in parts."""

from __future__ import annotations

import numpy as np

from array_types import Array
from coupler.case.case import Tank
from coupler.geometry.bodies import Body
from coupler.geometry.stretches import axes_of
from coupler.geometry.tank_mesh import mesh_of

FEW_CORNERS = 12
"""Corners of a body up to which places between each two of them are looked at: boxes may be much longer than cells."""
PARTS = 16
"""Parts into which the way between two corners is divided."""


def has_equal_cells(tank: Tank) -> bool:
    """Whether all cells of a tank count as of the size `tank.cell`."""
    return tank.regions is None and not tank.stretch


def cells_at(tank: Tank, points: Array) -> Array:
    """Sizes (m,) [m] of the cells at places (m, 3) [m]: edges of cubes of the same volume; outside the tank the
    smallest of all."""
    if has_equal_cells(tank):
        return np.full(len(points), tank.cell)
    return mesh_of(tank).size_at(points)


def edges_at(tank: Tank, points: Array) -> Array:
    """Edges (m, 3) [m] along the axes of the bricks at places (m, 3) [m]; of a mesh from a file those of cubes."""
    size = cells_at(tank, points)
    if has_equal_cells(tank) or tank.mesh is not None:
        return np.repeat(size[:, None], 3, axis=1)
    edges = np.column_stack(
        [
            np.diff(axis)[np.clip(np.searchsorted(axis, points[:, k], side="right") - 1, 0, len(axis) - 2)]
            for k, axis in enumerate(axes_of(tank))
        ]
    )
    halved = np.rint(np.log2(edges.prod(axis=1) / size**3) / 3.0)
    return edges / 2.0 ** np.maximum(halved, 0.0)[:, None]


def widest_cell(tank: Tank, points: Array, direction: Array) -> float:
    """Largest size [m] of the cells at places (m, 3) [m] across a body that is thin along a unit direction (3,)."""
    if has_equal_cells(tank):
        return tank.cell
    return float(np.sqrt(((edges_at(tank, points) * direction) ** 2).sum(axis=1).max()))


def places_in(body: Body) -> Array:
    """Places (m, 3) [m] all over a convex body: its corners, its middle and others between them."""
    corners = body.vertices
    middle = corners.mean(axis=0, keepdims=True)
    if len(corners) > FEW_CORNERS:
        return np.concatenate([corners, middle, 0.5 * (corners + middle)])
    first, second = np.triu_indices(len(corners), 1)
    share = (np.arange(1, PARTS) / PARTS)[:, None, None]
    between = (1.0 - share) * corners[first] + share * corners[second]
    return np.concatenate([corners, middle, between.reshape(-1, 3)])


def places_in_box(lower: Array, upper: Array) -> Array:
    """Places (m, 3) [m] all over a box along the axes, just inside of its sides."""
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    share = np.linspace(1e-6, 1.0 - 1e-6, PARTS + 1)
    grid = np.stack(np.meshgrid(share, share, share, indexing="ij"), axis=-1).reshape(-1, 3)
    return lower + grid * (upper - lower)
