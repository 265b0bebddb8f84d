"""Surfaces of the water at the start that are not level: planes by their slope, and heights from files."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import stamp
from coupler.case.water import Fill
from coupler.geometry.terrain.grid import TerrainError
from coupler.geometry.terrain.grids import read_grid
from coupler.geometry.terrain.height_map import HeightMap

FINE = 129
"""Places along each side of a box at which its surface is looked up."""


@dataclass(frozen=True, eq=False)
class StartSurface:
    """heights: (x (n,), y (n,)) [m] → z (n,) [m] in the tank, the same object for boxes under one file · lower, upper
    (3,) [m]: corners of its box. Outside of the box the surface has the height of the nearest place in it."""

    heights: Callable[[Array, Array], Array]
    lower: Array
    upper: Array

    def __call__(self, points: Array) -> Array:
        """z (n,) [m] of the surface over or under points (n, 3)."""
        return self._at(points[:, 0], points[:, 1])

    def distance(self, points: Array, step: float) -> Array:
        """Approximate distance (n,) [m] of points (n, 3) to the surface, negative in the water: (z - η)/sqrt(1 +
        |∇η|²), the gradient by differences over two steps [m]; of a plane exact."""
        slopes = []
        for k in range(2):
            ahead, behind = points[:, :2].copy(), points[:, :2].copy()
            ahead[:, k] += step
            behind[:, k] -= step
            width = np.clip(ahead[:, k], self.lower[k], self.upper[k]) - np.clip(
                behind[:, k], self.lower[k], self.upper[k]
            )
            rise = self._at(*ahead.T) - self._at(*behind.T)
            slopes.append(np.divide(rise, width, out=np.zeros(len(points)), where=width > 0.0))
        return (points[:, 2] - self(points)) / np.sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)

    def sampled(self) -> tuple[Array, Array, Array]:
        """x, y, z (n,) [m] of a raster of places over the box, its corners among them."""
        x, y = (np.linspace(self.lower[k], self.upper[k], FINE) for k in range(2))
        X, Y = (a.ravel() for a in np.meshgrid(x, y, indexing="ij"))
        return X, Y, self._at(X, Y)

    def highest(self) -> float:
        """Height z [m] of the highest sampled place."""
        return float(np.nanmax(self.sampled()[2]))

    def volume(self) -> float:
        """Approximate volume [m³] of the water below the surface in its box."""
        depth = np.nanmean(np.maximum(self.sampled()[2] - self.lower[2], 0.0))
        return float(depth * np.prod(self.upper[:2] - self.lower[:2]))

    def _at(self, x: Array, y: Array) -> Array:
        return self.heights(
            np.clip(x, self.lower[0], self.upper[0]), np.clip(y, self.lower[1], self.upper[1])
        )


def surface_of(fill: Fill) -> StartSurface | None:
    """The surface of a box of water; None where it is level. Raises TerrainError, BadPath."""
    lower, upper = np.array(fill.lower), np.array(fill.upper)
    if fill.surface is not None:
        there = stamp(fill.surface) if Path(fill.surface).is_file() else None
        return StartSurface(_map_of(fill.surface, there), lower, upper)
    if fill.slope is None:
        return None
    (x, y), (along_x, along_y), level = 0.5 * (lower + upper)[:2], fill.slope, upper[2]
    return StartSurface(lambda X, Y: level + along_x * (X - x) + along_y * (Y - y), lower, upper)


def highest(fill: Fill) -> float:
    """Height z [m] of the highest water of a box."""
    surface = surface_of(fill)
    return fill.upper[2] if surface is None else surface.highest()


def volume(fill: Fill) -> float:
    """Volume [m³] of a box of water."""
    surface = surface_of(fill)
    return float(np.prod(np.subtract(fill.upper, fill.lower))) if surface is None else surface.volume()


@lru_cache(maxsize=4)
def _map_of(path: str, _stamp) -> HeightMap:
    """The heights of a file, in coordinates of the tank. Raises TerrainError."""
    grid = read_grid(Path(path))
    if not (np.diff(grid.x) > 0.0).all() or not (np.diff(grid.y) > 0.0).all():
        raise TerrainError(f"{Path(path).name}: its places do not span a surface")
    return HeightMap(grid.x, grid.y, grid.z, (0.0, 0.0), reach=grid.reach)
