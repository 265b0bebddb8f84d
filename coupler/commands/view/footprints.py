"""Footprints of blocks and fixed solids: the outline of each in plan, from the files of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from array_types import Array
from coupler.results import vtkhdf


def of_blocks(run: Path) -> list[Array]:
    """Corners (k, 2) [m] of the outline of each block at the first stored time; none without blocks."""
    path = run / "blocks.vtkhdf"
    if not path.is_file() or not len(vtkhdf.read_times(path)):
        return []
    points, _, values = vtkhdf.read_step(path, 0)
    return _outlines(path, points, values["block"])


def of_solids(run: Path) -> list[Array]:
    """Corners (k, 2) [m] of the outline of each fixed solid; none without solids."""
    path = run / "solids.vtkhdf"
    if not path.is_file():
        return []
    with vtkhdf.opened(path, "r") as file:
        points, solid = file["VTKHDF/Points"][:], file["VTKHDF/CellData/solid"][:]
    return _outlines(path, points, solid)


def _outlines(path: Path, points: Array, owner: Array) -> list[Array]:
    """Hulls in plan of the bodies whose faces have these owners (f,), from points (n, 3) relative to the origin."""
    rows, ends = vtkhdf.read_polygons(path)
    with vtkhdf.opened(path, "r") as file:
        origin = np.asarray(file["scene"].attrs["origin"], float)[:2]
    faces = np.split(rows, ends[:-1])
    found = []
    for body in np.unique(owner):
        corners = np.unique(np.concatenate([faces[k] for k in np.flatnonzero(owner == body)]))
        plan = points[corners, :2].astype(float) + origin
        try:
            found.append(plan[ConvexHull(plan).vertices])
        except QhullError:
            continue  # a body without a width in plan has no outline
    return found
