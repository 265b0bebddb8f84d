"""The terrain of a case: its file, cropped, re-projected, moved, filled, smoothed and cut, kept beside the case.

    file → [re-project] → crop → units, datum → fill → smooth → limit of slope → height map at its place in the tank

The result is kept in `.terrain/` beside the file, under a checksum of the file and of the options: a large GeoTIFF
is read once.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.geometry.terrain.grid import Grid, Reach, TerrainError
from coupler.geometry.terrain.grids import MOST_POINTS, read_grid, without
from coupler.geometry.terrain.height_map import HeightMap

LONELY = 5000.0
"""Height [m] between the lowest or highest points of a file and all others from which they are no ground."""
KEPT = ".terrain"
"""Folder beside the file."""
FORMAT = 4
"""Version of the steps below; after a change, rasters kept before are made again."""
FEET = re.compile(r'UNIT\["[^"]*f(?:oo|ee)t', re.IGNORECASE)
MERCATOR = re.compile(r"(?:pseudo|web)[ _-]mercator|EPSG\W+(?:3857|3785|900913)\b", re.IGNORECASE)
"""Coordinate systems of web maps, by name or code."""
EARTH = 6378137.0
"""Radius [m] of the sphere of these systems."""
PLACED = ("origin", "turn", "offset", "land")
"""Options of the position or the land use alone, which do not change the kept raster."""


def terrain_of(spec) -> HeightMap:
    """The height map of a section [terrain]; read once unless the file changes. Raises TerrainError."""
    twice = scaled_twice(spec)
    if twice:
        raise TerrainError(f"{Path(spec.path).name}: terrain.scale: {twice}")
    there = os.stat(spec.path) if Path(spec.path).is_file() else None
    return _placed(spec, there and (there.st_mtime_ns, there.st_size))


def scaled_twice(spec) -> str:
    """Why the unit of a section [terrain] cannot be, beside a change of its coordinate system; empty if it can."""
    if spec.reproject is None or spec.scale == 1.0:
        return ""
    return (
        f"{spec.scale:g} m beside reproject = '{spec.reproject}', whose x and y are metres already, so that the site "
        "would change its size; leave scale out, and write height_scale where heights have another unit"
    )


@lru_cache(maxsize=2)
def _placed(spec, _stamp) -> HeightMap:
    x, y, z, reach = _kept(spec)
    pivot = spec.origin or (reach[0][0], reach[1][0])
    dx, dy, dz = spec.offset
    return HeightMap(x, y, z + dz, pivot, (dx, dy), spec.turn, reach)


def _kept(spec) -> tuple[Array, Array, Array, Reach]:
    """x, y, z of the edited raster and what it covers, from the folder if they are there."""
    path = Path(spec.path)
    if not path.is_file():
        read_grid(path)  # raises with the reason
    store = path.parent / KEPT / f"{path.stem}-{_checksum(spec)}.npz"
    if store.is_file():
        try:
            with np.load(store) as file:
                (west, east), (south, north) = file["reach"].tolist()
                return file["x"], file["y"], file["z"], ((west, east), (south, north))
        except (OSError, ValueError, KeyError, EOFError):
            store.unlink(missing_ok=True)  # incomplete after a kill
    x, y, z, reach = _edited(path.name, read_grid(path, spec.variable), spec)
    if path.suffix.lower() in SLOW:
        _keep(store, x=x, y=y, z=z, reach=np.array(reach))
    return x, y, z, reach


SLOW = (".tif", ".tiff", ".nc", ".grd", ".stl", ".ply", ".obj")
"""Endings of files whose reading takes longer than that of what is kept."""


def _keep(store: Path, **arrays: Array) -> None:
    """Keep the edited raster; the file is written completely or not at all. A folder that is not writable costs only
    time."""
    new = store.with_name(f"{store.stem}-{os.getpid()}.tmp.npz")
    try:
        store.parent.mkdir(exist_ok=True)
        np.savez(new, **arrays)
        new.replace(store)
    except OSError:
        new.unlink(missing_ok=True)


def _checksum(spec) -> str:
    options = {k: v for k, v in spec.model_dump(mode="json").items() if k not in (*PLACED, "path")}
    digest = hashlib.sha256(json.dumps([FORMAT, options], sort_keys=True).encode())
    for file in (Path(spec.path), Path(spec.path).with_suffix(".prj")):
        if file.is_file():
            digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()[:16]


def _edited(name: str, grid: Grid, spec) -> tuple[Array, Array, Array, Reach]:
    crs = spec.crs or grid.crs
    if spec.no_data is not None:
        grid = replace(grid, z=without(grid.z, spec.no_data))
    if spec.reproject is not None:
        if MERCATOR.search(spec.reproject):
            raise TerrainError(
                f"{name}: terrain.reproject = '{spec.reproject}' is a system of web maps, whose metres are longer than "
                "metres away from the equator; take another, UTM for instance"
            )
        # before they are blended with what lies beside them
        _refuse_marks(name, grid.z, spec.height_scale or 1.0)
        from coupler.geometry.terrain.raster import reprojected

        grid = reprojected(name, grid, crs, spec.reproject)
    else:
        _refuse_degrees(name, grid, crs, spec)
        _refuse_mercator(name, grid, crs, spec)
    unit, height_unit = spec.scale, spec.height_scale or spec.scale  # after reproject scale is 1
    if FEET.search(crs) and spec.scale == 1.0 and spec.reproject is None:
        raise TerrainError(
            f"{name}: its coordinate system counts in feet ({FEET.search(crs)[0][5:].strip(chr(34))}); write scale = "
            '"1 ft", and height_scale where heights have another unit'
        )
    x, y, z, ends = _cropped(name, grid, spec.crop)
    if z.size > MOST_POINTS:
        raise TerrainError(
            f"{name}: {z.size:.3g} points; crop it (terrain.crop) to fewer than {MOST_POINTS:.3g}"
        )
    _refuse_marks(name, z, height_unit)
    x, y = x * unit, y * unit
    (west, east), (south, north) = ends
    reach = (west * unit, east * unit), (south * unit, north * unit)
    z = (z if spec.positive == "up" else -z) * height_unit - spec.zero
    if spec.fill:
        z = filled(z, x, y)
    if spec.smooth:
        z = smoothed(z, x, y, spec.smooth)
    if spec.steepest is not None:
        z = flattened(z, x, y, float(np.tan(spec.steepest)))
    return x, y, z, reach


def _refuse_marks(name: str, z, unit: float) -> None:
    """Refuse numbers that stand for missing heights and are not declared as such: as ground -9999 is a pit, and 99999
    an island where there is water."""
    known = z[np.isfinite(z)]
    for worst, side in ((known.min(initial=np.inf), "lowest"), (known.max(initial=-np.inf), "highest")):
        others = known[known != worst]
        if len(others) and np.abs(others - worst).min() * unit > LONELY:
            mark = f"{worst:.7g}"
            raise TerrainError(
                f"{name}: its {side} points, {len(known) - len(others)} at {mark}, lie "
                f"{np.abs(others - worst).min() * unit:.3g} m from all others: a mark of missing heights, most likely, "
                f"that the file does not declare; write no_data = {mark}, and fill = true where they lie under the tank"
            )


def _refuse_degrees(name: str, grid: Grid, crs: str, spec) -> None:
    """Refuse coordinates in degrees, which are not lengths."""
    geographic = (
        crs.startswith("GEOGCS") or crs.startswith("GEOGCRS") or crs.upper() in ("EPSG:4326", "EPSG:4269")
    )
    if geographic and spec.scale == 1.0:
        raise TerrainError(
            f"{name}: its coordinates are degrees ({crs[:40]}); write reproject, the code of a metric system, for "
            f"instance {_utm(0.5 * (grid.x[0] + grid.x[-1]), 0.5 * (grid.y[0] + grid.y[-1]))!r} there"
        )


def _refuse_mercator(name: str, grid: Grid, crs: str, spec) -> None:
    """Refuse coordinates of web maps, whose metres are 1/cos(latitude) metres long."""
    if not MERCATOR.search(crs) or spec.scale != 1.0:
        return
    x, y = 0.5 * (grid.x[0] + grid.x[-1]), 0.5 * (grid.y[0] + grid.y[-1])
    latitude = float(np.arctan(np.sinh(y / EARTH)))
    longer, true = 1.0 / np.cos(latitude), _utm(float(np.degrees(x / EARTH)), float(np.degrees(latitude)))
    raise TerrainError(
        f"{name}: its coordinates are those of web maps (Mercator), which make the site {longer:.3g} times too long "
        f"and wide at its latitude of {np.degrees(latitude):.3g} degrees; write reproject = '{true}', or scale = "
        f"{1.0 / longer:.5g} with height_scale = 1"
    )


def _utm(longitude: float, latitude: float) -> str:
    zone = int((longitude + 180.0) // 6.0) % 60 + 1
    return f"EPSG:{32600 + zone if latitude >= 0.0 else 32700 + zone}"


def _cropped(name: str, grid: Grid, crop) -> tuple[Array, Array, Array, Reach]:
    """x, y, z of what is kept, and what it covers: up to the rim of the file, where nothing was cut off."""
    if crop is None:
        return grid.x, grid.y, grid.z, grid.reach
    found, ends = [], []
    for k, (letter, axis) in enumerate((("x", grid.x), ("y", grid.y))):
        low, high = crop[0][k], crop[1][k]
        step = axis[1] - axis[0]
        inside = np.flatnonzero((axis > low - step) & (axis < high + step))
        if low >= high or len(inside) < 2:
            raise TerrainError(
                f"{name}: terrain.crop keeps {letter} from {low:g} to {high:g}, but the file reaches from {axis[0]:g} "
                f"to {axis[-1]:g} (units of the file)"
            )
        first, last = inside[0], inside[-1]
        found.append(slice(first, last + 1))
        start, end = grid.reach[k]
        ends.append(
            (start if first == 0 else float(axis[first]), end if last == len(axis) - 1 else float(axis[last]))
        )
    return grid.x[found[0]], grid.y[found[1]], grid.z[found[0], found[1]], (ends[0], ends[1])


# ---------------------------------------------------------------- heights


def filled(z, x, y) -> Array:
    """Holes of z (nx, ny) [m] closed: inside them the height is harmonic, Σ (z_neighbour - z) / d² = 0, with the known
    points as its edge and no slope across the edge of the raster."""
    import scipy.sparse as sp
    from scipy.sparse.linalg import spsolve

    hole = ~np.isfinite(z)
    if not hole.any():
        return z
    number = np.full(z.shape, -1)
    number[hole] = np.arange(hole.sum())
    rows, columns, values, rhs = [], [], [], np.zeros(int(hole.sum()))
    for axis, points in enumerate((x, y)):
        weight = 1.0 / (points[1] - points[0]) ** 2
        first = [slice(None), slice(None)]
        second = [slice(None), slice(None)]
        first[axis], second[axis] = slice(None, -1), slice(1, None)
        for here, there in ((tuple(first), tuple(second)), (tuple(second), tuple(first))):
            at = hole[here]
            own, other, known = number[here][at], number[there][at], z[there][at]
            rows.append(own)
            columns.append(own)
            values.append(np.full(len(own), weight))
            inner = other >= 0
            rows.append(own[inner])
            columns.append(other[inner])
            values.append(np.full(int(inner.sum()), -weight))
            np.add.at(rhs, own[~inner], weight * known[~inner])
    matrix = sp.coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))))
    z = z.copy()
    z[hole] = spsolve(matrix.tocsc(), rhs)
    return z


def smoothed(z, x, y, length: float) -> Array:
    """Mean of z (nx, ny) [m] with the weight of a Gauss curve of this standard deviation [m]; holes stay."""
    from scipy.ndimage import gaussian_filter

    sigma = (length / (x[1] - x[0]), length / (y[1] - y[0]))
    known = np.isfinite(z)
    total = gaussian_filter(np.where(known, z, 0.0), sigma, mode="nearest")
    weight = gaussian_filter(known.astype(float), sigma, mode="nearest")
    return np.where(known, total / np.maximum(weight, 1e-12), np.nan)


def flattened(z, x, y, slope: float) -> Array:
    """Largest surface not above z (nx, ny) [m] that rises by at most `slope` between neighbours: cliffs are cut back
    from their foot. Holes stay."""
    steps = ((1, 0), (0, 1), (1, 1), (1, -1))
    d = [slope * float(np.hypot(i * (x[1] - x[0]), j * (y[1] - y[0]))) for i, j in steps]
    low = np.where(np.isfinite(z), z, np.inf)
    for _ in range(sum(z.shape)):
        before = low.copy()
        for (i, j), rise in zip(steps, d):
            here, there = _shifted(low, i, j)
            np.minimum(here, there + rise, out=here)
            np.minimum(there, here + rise, out=there)
        if np.array_equal(before, low):
            break
    return np.where(np.isfinite(z), low, np.nan)


def _shifted(a, i: int, j: int):
    """Views of a (nx, ny) and of its neighbours at (i, j), i ≥ 0."""
    nx, ny = a.shape
    rows = slice(0, nx - i), slice(i, nx)
    columns = (slice(0, ny - j), slice(j, ny)) if j >= 0 else (slice(-j, ny), slice(0, ny + j))
    return a[rows[0], columns[0]], a[rows[1], columns[1]]
