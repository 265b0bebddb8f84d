"""Heights on a raster in the coordinates of the tank: the ground of the water and of the houses.

    (x, y) = origin + R(turn) [(X, Y) - pivot]          X, Y: coordinates of the file [m], z: heights after the datum

Between the points of the raster heights are bilinear. Where the points are the middles of cells, the height of the
outermost ones holds up to the rim of their cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from array_types import Array
from coupler.geometry.terrain.grid import Reach

BESIDE = 1e-6
"""Share of a spacing by which a place may lie beside the raster and count as on its edge."""


@dataclass(frozen=True, eq=False)
class HeightMap:
    """x (nx,), y (ny,) [m], evenly spaced coordinates of the points in the file · z (nx, ny) [m], NaN where unknown ·
    pivot, origin (2,) [m], turn [rad]: its place in the tank · reach: what it covers in the file [m]; absent: from its
    first to its last points."""

    x: Array
    y: Array
    z: Array
    pivot: tuple[float, float] = (0.0, 0.0)
    origin: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    reach: Reach | None = None

    @cached_property
    def spacing(self) -> tuple[float, float]:
        """Distance [m] of two points along each direction of the raster."""
        return float(np.ptp(self.x)) / (len(self.x) - 1), float(np.ptp(self.y)) / (len(self.y) - 1)

    def __call__(self, x, y) -> Array:
        """z (n,) [m] at places x, y (n,) [m] of the tank; NaN beside the raster and in its holes."""
        X, Y = self.in_file(np.asarray(x, float), np.asarray(y, float))
        dx, dy = self.spacing
        known = self.covers(X, Y)
        i, s = _cell(np.where(known, X - self.x[0], 0.0) / dx, len(self.x))
        j, t = _cell(np.where(known, Y - self.y[0], 0.0) / dy, len(self.y))
        z = self.z
        # a corner without weight must not spoil a place on the edge of a hole
        parts = (
            ((1 - s) * (1 - t), z[i, j]),
            (s * (1 - t), z[i + 1, j]),
            ((1 - s) * t, z[i, j + 1]),
            (s * t, z[i + 1, j + 1]),
        )
        height = sum(np.where(w > 0.0, w * corner, 0.0) for w, corner in parts)
        return np.where(known, height, np.nan)

    @cached_property
    def covered(self) -> Reach:
        """Lowest and highest x and y [m] of the file that heights hold for."""
        if self.reach is not None:
            return self.reach
        return (float(self.x[0]), float(self.x[-1])), (float(self.y[0]), float(self.y[-1]))

    def covers(self, X, Y) -> Array:
        """Whether (n,) coordinates [m] of the file lie on it, holes included."""
        (west, east), (south, north) = self.covered
        dx, dy = (BESIDE * step for step in self.spacing)
        in_x, in_y = (west - dx <= X) & (east + dx >= X), (south - dy <= Y) & (north + dy >= Y)
        return in_x & in_y

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
        """Corners (4, 2) [m] of what it covers in the tank, counter-clockwise."""
        (west, east), (south, north) = self.covered
        X, Y = np.array([west, east, east, west]), np.array([south, south, north, north])
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
    """Interval and share of it, of places in spacings from the first of so many points; beside them that at the end."""
    place = np.clip(place, 0.0, points - 1)
    i = np.minimum(place.astype(np.int64), points - 2)
    return i, place - i
