"""Terrains that do not fit their tank. Every check yields (key path, message)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.types import Problem
from coupler.geometry.terrain.height_map import HeightMap

FINE = 200
"""Places along each side of the tank at which the ground is looked up."""


def terrain_problems(case, ground: HeightMap) -> Iterator[Problem]:
    """The faults of the ground below the box of a tank; case: with a tank that has lower, upper and cell."""
    lower, upper = case.tank.lower, case.tank.upper
    if any(low >= high for low, high in zip(lower, upper)):
        return  # reported with the tank
    x, y = (
        np.linspace(lower[k], upper[k], max(FINE, round((upper[k] - lower[k]) / case.tank.cell)) + 1)
        for k in (0, 1)
    )
    X, Y = (a.ravel() for a in np.meshgrid(x, y, indexing="ij"))
    z = ground(X, Y)
    wrong = list(_unknown(ground, X, Y, z))
    yield from wrong
    if not wrong:
        yield from _heights(case, X, Y, z)


def _unknown(ground: HeightMap, X, Y, z) -> Iterator[Problem]:
    """Places of the tank without a height: outside of the terrain, or in a hole of it."""
    unknown = ~np.isfinite(z)
    if not unknown.any():
        return
    low, high = ground.outline.min(axis=0), ground.outline.max(axis=0)
    beside = ~ground.covers(*ground.in_file(X, Y))
    out, hole = unknown & beside, unknown & ~beside
    if out.any():
        yield (
            ("terrain",),
            f"{out.mean():.1%} of the tank lies beside it, for instance ({X[out][0]:.6g}, {Y[out][0]:.6g}) m: it "
            f"covers x {low[0]:.6g} to {high[0]:.6g}, y {low[1]:.6g} to {high[1]:.6g} m of the tank's coordinates"
            f"{_by_cells(ground, X[out], Y[out])}; move it (terrain.origin, terrain.offset) or take a smaller tank",
        )
    if hole.any():
        yield (
            ("terrain",),
            f"it has holes (no data) under {hole.mean():.1%} of the tank, for instance at ({X[hole][0]:.6g}, "
            f"{Y[hole][0]:.6g}) m; fill = true closes them smoothly, crop or another tank avoids them",
        )


def _by_cells(ground: HeightMap, X, Y) -> str:
    """What to know of a file of points where only half a spacing is missing: those of a tile of cells are their
    middles, and a tank of ncols times cellsize does not fit between them."""
    (west, east), (south, north) = ground.covered
    u, v = ground.in_file(X, Y)
    dx, dy = (0.5 * (1.0 + 1e-6) * step for step in ground.spacing)
    if (
        min((u - west).min() + dx, (east - u).min() + dx, (v - south).min() + dy, (north - v).min() + dy)
        < 0.0
    ):
        return ""
    return (
        ", from its first to its last points, half a spacing short on each side; where these points are the middles of "
        "cells, give it as an ESRI grid with xllcorner and yllcorner (.asc) or as a GeoTIFF, which cover whole cells"
    )


def _heights(case, X, Y, z) -> Iterator[Problem]:
    lowest = int(z.argmin())
    floor, top = case.tank.lower[2], case.tank.upper[2]
    if z[lowest] >= top - case.tank.cell:
        yield (
            ("terrain",),
            f"the ground lies at {z.min():.4g} to {z.max():.4g} m, nowhere a cell below the top of the tank "
            f"({top:g} m): check datum and unit (terrain.zero, terrain.height_scale, terrain.positive) or raise "
            "tank.upper",
        )
    elif z[lowest] < floor - 1e-6 * case.tank.cell:
        yield (
            ("tank", "lower"),
            f"the ground falls to z = {z[lowest]:.4g} m at ({X[lowest]:.6g}, {Y[lowest]:.6g}) m, below the floor "
            f"of the tank ({floor:g} m); take lower[2] = {np.floor(z[lowest]):g}",
        )
