"""Terrain files → (x, y, z) of a raster, in the units of the file: ESRI grids, points and STL.

NetCDF: `netcdf.py`. GeoTIFF and whatever else GDAL reads: `raster.py`, in a process of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, check_file, read_text
from coupler.geometry.terrain.grid import Grid, TerrainError
from coupler.geometry.terrain.netcdf import read_netcdf
from coupler.program.errors import briefly

EVEN = 1e-3
"""Share of a spacing by which the points of a raster may be off."""
SINGLE = 2e-6
"""Share by which a number that was written with six digits differs from itself."""
MOST_BYTES = 512_000_000
"""Largest size [B] of a terrain file that is read as text."""
MOST_POINTS = 40_000_000
"""Largest number of points of a raster: a site of 6 km with points every metre."""


def read_grid(path: Path, variable: str | None = None) -> Grid:
    """The raster of a file by its ending. Raises TerrainError."""
    try:
        check_file(path)
    except BadPath as error:
        raise TerrainError(f"{path}: {error}") from error
    kind = path.suffix.lower()
    if kind not in READERS:
        raise TerrainError(
            f"{path.name}: no terrain is read from {kind or 'a file without ending'}; known are "
            f"{', '.join(sorted(READERS))}, and .tif and .tiff with the extra `terrain`"
        )
    grid = READERS[kind](path, variable)
    if variable is not None and kind not in (".nc", ".grd"):
        raise TerrainError(f"{path.name}: `variable` is for NetCDF; leave it out")
    if grid.z.shape[0] < 2 or grid.z.shape[1] < 2:
        raise TerrainError(f"{path.name}: {grid.z.shape[0]} x {grid.z.shape[1]} points are no surface")
    if not np.isfinite(grid.z).any():
        raise TerrainError(f"{path.name}: no point of it has a height")
    return grid


def without(z: Array, mark: float) -> Array:
    """Heights with NaN in place of a mark of missing ones, which may be written with the digits of single precision."""
    return np.where(np.isclose(z, mark, rtol=SINGLE, atol=0.0), np.nan, z)


# ---------------------------------------------------------------- ESRI ASCII grid


def _esri(path: Path, _variable) -> Grid:
    """The ASCII grid of ESRI (ArcInfo): six lines of head, rows from north to south. One that names the corner of its
    cells covers all of them; one that names the middle of the first covers what lies between the middles, as grids
    whose heights belong to points are written so too."""
    head, rest = _esri_head(path)
    if "dx" in head and "dy" in head:
        head.setdefault("cellsize", head["dx"])
    for name in ("ncols", "nrows", "cellsize"):
        if name not in head:
            raise TerrainError(f"{path.name}: its head has no {name}; an ESRI ASCII grid begins with one")
    nx, ny = int(head["ncols"]), int(head["nrows"])
    size = {"x": head.get("dx", head["cellsize"]), "y": head.get("dy", head["cellsize"])}
    if nx < 1 or ny < 1 or not min(size.values()) > 0.0:
        raise TerrainError(f"{path.name}: ncols {nx}, nrows {ny} and cellsize {size['x']:g} must be positive")
    values = np.array(_floats(path, rest))
    if len(values) != nx * ny:
        raise TerrainError(
            f"{path.name}: {len(values)} heights, but its head says {nx} x {ny} = {nx * ny}; the file is torn"
        )
    z = values.reshape(ny, nx)[::-1].T.copy()
    z = without(z, head.get("nodata_value", -9999.0))
    half = {name: 0.5 * size[name] if f"{name}llcorner" in head else 0.0 for name in "xy"}
    x0 = head.get("xllcorner", head.get("xllcenter", 0.0)) + half["x"]
    y0 = head.get("yllcorner", head.get("yllcenter", 0.0)) + half["y"]
    x, y = x0 + size["x"] * np.arange(nx), y0 + size["y"] * np.arange(ny)
    return Grid(x, y, z, crs=sidecar(path), rim=(half["x"], half["y"]))


def _esri_head(path: Path) -> tuple[dict[str, float], str]:
    text = _text(path)
    head: dict[str, float] = {}
    while True:
        line, _, rest = text.partition("\n")
        words = line.split()
        if line.startswith("#") or not words:
            if not rest:
                return head, rest
        elif len(words) == 2 and words[0][0].isalpha():
            try:
                head[words[0].lower()] = float(words[1])
            except ValueError:
                raise TerrainError(f"{path.name}: {briefly(line)} is no line of a head") from None
        else:
            return head, text
        text = rest


def sidecar(path: Path) -> str:
    """The coordinate system from a .prj beside a file."""
    beside = path.with_suffix(".prj")
    try:
        return read_text(beside).strip() if beside.is_file() else ""
    except BadPath:
        return ""


# ---------------------------------------------------------------- points


def _points(path: Path, _variable) -> Grid:
    """Rows of x, y, z, with a head or without, in any order: a raster as it is, other points with straight triangles
    between them."""
    lines = [line for line in _text(path).split("\n") if line.strip() and not line.startswith("#")]
    columns, first = [0, 1, 2], 0
    if lines and any(c.isalpha() for c in lines[0].replace("e", "").replace("E", "").replace("nan", "")):
        names = [name.strip().strip('"').lower() for name in _split(lines[0])]
        columns, first = _named(path, names), 1
    table = _table(path, lines[first:], columns)
    if len(table) < 4:
        raise TerrainError(f"{path.name}: {len(table)} points; a terrain needs at least 2 x 2")
    return _raster(table) or _triangulated(path, table)


NAMES = (
    ("x", "east", "easting", "lon", "longitude"),
    ("y", "north", "northing", "lat", "latitude"),
    ("z", "height", "elevation", "level"),
)


def _named(path: Path, names: list[str]) -> list[int]:
    found = [next((names.index(n) for n in known if n in names), None) for known in NAMES]
    if None in found:
        missing = NAMES[found.index(None)][0]
        raise TerrainError(f"{path.name}: no column '{missing}' among {', '.join(names)}; call them x, y, z")
    return found


def _split(line: str) -> list[str]:
    for mark in (";", ","):
        if mark in line:
            return line.split(mark)
    return line.split()


def _table(path: Path, lines: list[str], columns: list[int]) -> Array:
    """(n, 3); the quick way for a plain table, row by row for the message where it is none."""
    mark = next((m for m in (";", ",") if lines and m in lines[0]), None)
    try:
        return np.loadtxt(lines, delimiter=mark, usecols=columns, ndmin=2)
    except ValueError:
        pass
    for n, line in enumerate(lines):
        words = _split(line)
        try:
            [float(words[c]) for c in columns]
        except (ValueError, IndexError):
            raise TerrainError(
                f"{path.name}: row {n + 1}, {briefly(line.strip())}: no three numbers x, y, z"
            ) from None
    return np.array([[float(_split(line)[c]) for c in columns] for line in lines])


def _raster(table: Array) -> Grid | None:
    """Points that lie on an even raster, or None."""
    axes, places = [], []
    for k in range(2):
        values = np.unique(table[:, k])
        if len(values) < 2 or len(values) > len(table) / 2:
            return None
        step = np.median(np.diff(values))
        place = np.rint((table[:, k] - values[0]) / step).astype(np.int64)
        if np.abs(table[:, k] - values[0] - step * place).max() > 10 * EVEN * step:
            return None
        axes.append(values[0] + step * np.arange(place.max() + 1))
        places.append(place)
    if len(axes[0]) * len(axes[1]) > max(4 * len(table), 16):
        return None
    z = np.full((len(axes[0]), len(axes[1])), np.nan)
    z[places[0], places[1]] = table[:, 2]
    return Grid(axes[0], axes[1], z)


def _triangulated(path: Path, table: Array) -> Grid:
    """Scattered points: Delaunay's triangles, read on a raster of their mean distance."""
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    table = table[np.isfinite(table).all(axis=1)]
    low, high = table[:, :2].min(axis=0), table[:, :2].max(axis=0)
    step = float(np.sqrt(np.prod(high - low) / len(table)))
    if not step > 0.0:
        raise TerrainError(f"{path.name}: all its points lie on one line")
    axes = [
        low[k] + (high[k] - low[k]) * np.linspace(0, 1, max(2, round((high[k] - low[k]) / step) + 1))
        for k in (0, 1)
    ]
    middle = 0.5 * (low + high)
    try:
        surface = LinearNDInterpolator(table[:, :2] - middle, table[:, 2])
    except QhullError as error:
        raise TerrainError(f"{path.name}: its points span no surface") from error
    X, Y = np.meshgrid(axes[0] - middle[0], axes[1] - middle[1], indexing="ij")
    note = f"{len(table)} scattered points, read every {step:.3g} units on straight triangles between them"
    return Grid(axes[0], axes[1], surface(X, Y), notes=(note,))


# ---------------------------------------------------------------- STL


def _surface(path: Path, _variable) -> Grid:
    """The upper side of triangles, open or closed, on a raster of half their usual edge."""
    from coupler.geometry.mesh_files import MeshFileError, read_mesh

    try:
        points, kinds, _ = read_mesh(path)
    except MeshFileError as error:
        raise TerrainError(str(error)) from error
    if "triangle" not in kinds:
        raise TerrainError(f"{path.name}: no triangles among its cells ({', '.join(kinds)})")
    corners = points[kinds["triangle"].astype(np.int64)]
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    step = 0.5 * float(np.median(edges))
    low, high = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    count = [max(2, round((high[k] - low[k]) / step) + 1) for k in (0, 1)]
    if np.prod(count, dtype=float) > MOST_POINTS:
        raise TerrainError(
            f"{path.name}: a raster of half its edges ({step:.2g}) has {np.prod(count, dtype=float):.3g} points"
        )
    axes = [np.linspace(low[k], high[k], count[k]) for k in (0, 1)]
    z = _highest(np.asarray(corners, float), *axes)
    return Grid(
        axes[0],
        axes[1],
        z,
        notes=(f"{len(corners)} triangles, their upper side read every {step:.3g} units",),
    )


def _highest(corners, x, y) -> Array:
    """Highest of the triangles (n, 3, 3) over each point of the raster (nx, ny), NaN where there is none."""
    z = np.full((len(x), len(y)), -np.inf)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = _cross(b - a, c - a)
    low, high = corners.min(axis=1), corners.max(axis=1)
    first, count = [], []
    for k, axis in enumerate((x, y)):
        step = axis[1] - axis[0]
        start = np.clip(np.floor((low[:, k] - axis[0]) / step - EVEN), 0, len(axis) - 1).astype(np.int64)
        end = np.clip(np.ceil((high[:, k] - axis[0]) / step + EVEN), 0, len(axis) - 1).astype(np.int64)
        first.append(start)
        count.append(end - start + 1)
    under = np.where(area != 0.0, count[0] * count[1], 0)
    t = np.repeat(np.arange(len(corners)), under)
    rank = np.arange(len(t)) - np.repeat(np.cumsum(under) - under, under)
    i, j = first[0][t] + rank // count[1][t], first[1][t] + rank % count[1][t]
    p = np.column_stack([x[i], y[j]])
    of_a = _cross(b[t, :2] - p, c[t, :2] - p) / area[t]
    of_b = _cross(c[t, :2] - p, a[t, :2] - p) / area[t]
    of_c = 1.0 - of_a - of_b
    inside = np.minimum(np.minimum(of_a, of_b), of_c) >= -1e-9
    height = of_a * a[t, 2] + of_b * b[t, 2] + of_c * c[t, 2]
    np.maximum.at(z, (i[inside], j[inside]), height[inside])
    z[np.isinf(z)] = np.nan
    return z


def _cross(u, v) -> Array:
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


# ---------------------------------------------------------------- text


def _text(path: Path) -> str:
    try:
        return read_text(path, most=MOST_BYTES)
    except BadPath as error:
        raise TerrainError(f"{path.name}: {error}") from error


def _floats(path: Path, text: str) -> list[float]:
    try:
        return [float(word) for word in text.split()]
    except ValueError as error:
        raise TerrainError(f"{path.name}: {briefly(str(error))} among its heights") from error


def _other(path: Path, _variable) -> Grid:
    from coupler.geometry.terrain.raster import read_in_own_process

    return read_in_own_process(path)


READERS: dict[str, Callable[[Path, str | None], Grid]] = {
    ".asc": _esri,
    ".csv": _points,
    ".txt": _points,
    ".xyz": _points,
    ".nc": read_netcdf,
    ".grd": read_netcdf,
    ".stl": _surface,
    ".ply": _surface,
    ".obj": _surface,
    ".tif": _other,
    ".tiff": _other,
}
