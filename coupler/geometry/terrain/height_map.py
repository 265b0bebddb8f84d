"""Heights on a raster in the coordinates of the tank: the ground of the water and of the houses.

    (x, y) = origin + R(turn) [(X, Y) - pivot]          X, Y: coordinates of the file [m], z: heights after the datum

Between the points of the raster heights are bilinear.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from array_types import Array

BESIDE = 1e-6
"""Share of a spacing by which a place may lie beside the raster and count as on its edge."""


@dataclass(frozen=True, eq=False)
class HeightMap:
    """x (nx,), y (ny,) [m], evenly spaced coordinates of the points in the file · z (nx, ny) [m], NaN where unknown ·
    pivot, origin (2,) [m], turn [rad]: its place in the tank."""

    x: Array
    y: Array
    z: Array
    pivot: tuple[float, float] = (0.0, 0.0)
    origin: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0

    @cached_property
    def spacing(self) -> tuple[float, float]:
        """Distance [m] of two points along each direction of the raster."""
        return float(np.ptp(self.x)) / (len(self.x) - 1), float(np.ptp(self.y)) / (len(self.y) - 1)

    def __call__(self, x, y) -> Array:
        """z (n,) [m] at places x, y (n,) [m] of the tank; NaN beside the raster and in its holes."""
        X, Y = self.in_file(np.asarray(x, float), np.asarray(y, float))
        dx, dy = self.spacing
        i, s, in_x = _cell((X - self.x[0]) / dx, len(self.x))
        j, t, in_y = _cell((Y - self.y[0]) / dy, len(self.y))
        z = self.z
        # a corner without weight must not spoil a place on the edge of a hole
        parts = (
            ((1 - s) * (1 - t), z[i, j]),
            (s * (1 - t), z[i + 1, j]),
            ((1 - s) * t, z[i, j + 1]),
            (s * t, z[i + 1, j + 1]),
        )
        height = sum(np.where(w > 0.0, w * corner, 0.0) for w, corner in parts)
        return np.where(in_x & in_y, height, np.nan)

    def in_file(self, x, y) -> tuple[Array, Array]:
        """Coordinates [m] in the file of places of the tank."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        u, v = x - self.origin[0], y - self.origin[1]
        return self.pivot[0] + c * u + s * v, self.pivot[1] - s * u + c * v

    def in_tank(self, X, Y) -> tuple[Array, Array]:
        """Places [m] in the tank of coordinates of the file [m]."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        u, v = np.asarray(X, float) - self.pivot[0], np.asarray(Y, float) - self.pivot[1]
        return self.origin[0] + c * u - s * v, self.origin[1] + s * u + c * v

    @cached_property
    def outline(self) -> Array:
        """Corners (4, 2) [m] of the raster in the tank, counter-clockwise."""
        X = np.array([self.x[0], self.x[-1], self.x[-1], self.x[0]])
        Y = np.array([self.y[0], self.y[0], self.y[-1], self.y[-1]])
        return np.column_stack(self.in_tank(X, Y))

    @cached_property
    def slopes(self) -> Array:
        """|grad z| (nx - 1, ny - 1) of the cells of the raster, NaN beside holes."""
        dx, dy = self.spacing
        z = self.z
        along = (np.diff(z, axis=0)[:, 1:] + np.diff(z, axis=0)[:, :-1]) / (2.0 * dx)
        across = (np.diff(z, axis=1)[1:] + np.diff(z, axis=1)[:-1]) / (2.0 * dy)
        return np.hypot(along, across)


def _cell(place, points: int):
    """Interval, share of it and whether on the raster, of places in spacings from the first of so many points."""
    inside = (place >= -BESIDE) & (place <= points - 1 + BESIDE)
    place = np.clip(np.where(inside, place, 0.0), 0.0, points - 1)
    i = np.minimum(place.astype(np.int64), points - 2)
    return i, place - i, inside
