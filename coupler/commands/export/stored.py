"""The stored steps of a run as plain arrays, in the world's own coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.results import vtkhdf

Cells = list[tuple[str, Array, Array]]
"""Kind as meshio names it, corners (m, k), and the numbers (m,) of these cells in the file."""


@dataclass(frozen=True)
class Stored:
    """path of a .vtkhdf file · times (s,) [s] of its steps · origin (3,) [m] of its coordinates · polygons: cells of a
    file of faces, None of one of tetrahedra"""

    path: Path
    times: Array
    origin: Array
    polygons: Cells | None

    def step(self, k: int) -> tuple[Array, Cells, dict[str, Array], dict[str, Array]]:
        """Points (n, 3) [m], cells, and arrays of points and of cells by name."""
        points, point_data, cell_data = vtkhdf.read_step(self.path, k)
        if self.polygons is None:
            rows = vtkhdf.read_tetrahedra(self.path, k)
            cells: Cells = [("tetra", rows, np.arange(len(rows)))]
        else:
            cells = self.polygons
        return _moved(points, self.origin), cells, point_data, cell_data


def stored(path: Path) -> Stored:
    """The steps that a file holds so far."""
    with vtkhdf.opened(path, "r") as file:
        faces = "Polygons" in file["VTKHDF"]
        origin = np.array(file["scene"].attrs["origin"])
    polygons = polygon_cells(*vtkhdf.read_polygons(path)) if faces and len(vtkhdf.read_times(path)) else None
    return Stored(path, vtkhdf.read_times(path), origin, polygons)


def _moved(points: Array, origin: Array) -> Array:
    """Points moved to world coordinates, in single precision where that is enough: near the origin of the map."""
    return points if not origin.any() else points.astype(float) + origin


def polygon_cells(rows: Array, ends: Array) -> Cells:
    """Polygons by the number of their corners. rows: of points, one polygon after the other · ends: of each."""
    size = np.diff(ends, prepend=0)
    cells: Cells = []
    for count in np.unique(size):
        which = np.flatnonzero(size == count)
        corners = rows[(ends[which] - count)[:, None] + np.arange(count)]
        cells.append(({3: "triangle", 4: "quad"}.get(int(count), "polygon"), corners, which))
    return cells
