"""The stored steps of a run as plain arrays, in the world's own coordinates."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.results import vtkhdf
from coupler.run.directory import write_json

MADE_OF = ".made_of.json"
"""Name of the file that says in a directory what those beside it were made of."""
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


def made_of(folder: Path) -> dict:
    """What the files in a directory were made of, by name; empty where none were."""
    try:
        return json.loads((folder / MADE_OF).read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return {}


def keep_if(folder: Path, what: str, value: object, names: tuple[str, ...]) -> None:
    """Remove the files with these names (patterns) from a directory unless `what` they were made of has this value, and
    record it for those to come."""
    known = made_of(folder)
    if known.get(what) == value:
        return
    for path in (path for name in names for path in folder.glob(name)):
        path.unlink()
    write_json(folder / MADE_OF, known | {what: value})


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
