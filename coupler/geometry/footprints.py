"""Footprints of buildings from a file: polygons with attributes, and the rectangle that fits each best.

GeoJSON is read here; what else pyogrio reads (Shapefile, GeoPackage) in a process of its own, as rasters are:

    python -m coupler.geometry.footprints IN OUT.geojson [FROM TO]
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, read_text
from coupler.program.errors import ExitCode, SurgebreakError, briefly

SAME = 1e-6
"""Share of its extent within which two corners of a footprint are one."""
STRAIGHT = 1e-3
"""Sine of the turn at a corner below which the corner is dropped."""
BY_PYOGRIO = (".shp", ".gpkg", ".fgb")


class FootprintError(SurgebreakError):
    """A file of footprints that cannot be used; the message names it, the place and the remedy."""

    exit_code = ExitCode.BAD_CASE


@dataclass(frozen=True)
class Footprint:
    """corners (k, 2), counter-clockwise, each once, in units of the file · attributes · number of its feature in the
    file · system: coordinate system that the file names, "" for none · part: which polygon of its feature it is."""

    corners: Array
    attributes: dict
    number: int
    system: str = ""
    part: int = 0

    @property
    def area(self) -> float:
        """In units of the file, squared."""
        return area_of(self.corners)


def area_of(corners: Array) -> float:
    """Area of a polygon (k, 2), positive counter-clockwise."""
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def read_footprints(path: Path, change: tuple[str, str] | None = None) -> list[Footprint]:
    """All polygons of a file, those of a multipolygon one by one, without their holes.

    change: coordinate systems (from, to); needs the extra terrain, as all but GeoJSON do. Raises FootprintError."""
    kind = path.suffix.lower()
    if kind not in (".geojson", ".json", *BY_PYOGRIO):
        known = ", ".join((".geojson", ".json", *BY_PYOGRIO))
        raise FootprintError(
            f"{path.name}: no footprints are read from {kind or 'a file without ending'}; known are {known}"
        )
    if kind in BY_PYOGRIO or change is not None:
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "footprints.geojson"
            _in_own_process(path, out, change)
            return _geojson(path.name, out)
    return _geojson(path.name, path)


def _geojson(name: str, path: Path) -> list[Footprint]:
    try:
        data = json.loads(read_text(path))
    except (BadPath, json.JSONDecodeError, RecursionError) as error:
        raise FootprintError(f"{name}: cannot be read as GeoJSON ({briefly(str(error))})") from error
    features = data.get("features") if isinstance(data, dict) else None
    if not isinstance(features, list):
        raise FootprintError(f"{name}: no list `features`; a FeatureCollection of polygons is needed")
    found, system = [], _named_system(data)
    for number, feature in enumerate(features):
        geometry = (feature.get("geometry") if isinstance(feature, dict) else None) or {}
        kind, rings = geometry.get("type"), geometry.get("coordinates")
        if kind not in ("Polygon", "MultiPolygon"):
            raise FootprintError(
                f"{name}: feature {number} is a {kind or 'nothing'}; footprints are polygons"
            )
        for part, polygon in enumerate([rings] if kind == "Polygon" else rings):
            attributes = feature.get("properties") or {}
            found.append(Footprint(_corners(name, number, polygon), attributes, number, system, part))
    if not found:
        raise FootprintError(f"{name}: no polygons in it")
    return found


def _named_system(data: dict) -> str:
    """The member `crs` of GeoJSON, which most programs still write: the name of a coordinate system, "" without one."""
    crs = data.get("crs")
    properties = crs.get("properties") if isinstance(crs, dict) else None
    name = properties.get("name") if isinstance(properties, dict) else None
    return name if isinstance(name, str) else ""


def epsg_code(system: str) -> str | None:
    """The EPSG code of a coordinate system given as a name or as WKT; None where it has none."""
    if system.endswith("CRS84"):
        return "4326"
    found = re.findall(r'EPSG(?:::?|",\s*"?)(\d+)', system)
    return found[-1] if found else None  # of WKT the outermost, which comes last


def _corners(name: str, number: int, polygon) -> Array:
    """The outer ring of a polygon, cleaned of double and straight corners."""
    try:
        corners = np.array([point[:2] for point in polygon[0]], float)
    except (TypeError, ValueError, IndexError, KeyError) as error:
        raise FootprintError(f"{name}: feature {number} has no ring of x, y") from error
    if len(corners) < 4 or corners.shape[1:] != (2,) or not np.isfinite(corners).all():
        raise FootprintError(
            f"{name}: the ring of feature {number} has {len(corners)} points; at least four are needed"
        )
    extent = np.ptp(corners, axis=0).max()
    corners = corners[np.linalg.norm(corners - np.roll(corners, -1, axis=0), axis=1) > SAME * extent]
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    turns = np.abs(cross) > STRAIGHT * np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    corners = corners[turns]
    if len(corners) < 3 or abs(area_of(corners)) <= SAME * extent**2:
        raise FootprintError(f"{name}: feature {number} has no area")
    place = _crossing(corners)
    if place is not None:
        raise FootprintError(
            f"{name}: the outline of feature {number} crosses itself at ({place[0]:.9g}, {place[1]:.9g}); put its "
            "corners in order"
        )
    return corners if area_of(corners) > 0.0 else corners[::-1]


def _crossing(corners: Array) -> Array | None:
    """A place (2,) where two edges of a polygon (k, 2) that are not neighbours cross; None for a simple one."""
    k, middle = len(corners), corners.mean(axis=0)
    start = corners - middle
    along = np.roll(start, -1, axis=0) - start
    i, j = np.triu_indices(k, 2)
    i, j = i[(i > 0) | (j < k - 1)], j[(i > 0) | (j < k - 1)]
    gap = start[j] - start[i]
    cross = along[i, 0] * along[j, 1] - along[i, 1] * along[j, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (gap[:, 0] * along[j, 1] - gap[:, 1] * along[j, 0]) / cross
        t = (gap[:, 0] * along[i, 1] - gap[:, 1] * along[i, 0]) / cross
    meet = np.flatnonzero((s > SAME) & (s < 1.0 - SAME) & (t > SAME) & (t < 1.0 - SAME))
    return middle + start[i[meet[0]]] + s[meet[0]] * along[i[meet[0]]] if len(meet) else None


def best_rectangle(corners: Array) -> tuple[Array, Array, float, float]:
    """The smallest rectangle around a polygon (k, 2): its middle (2,), edges (2,), turn [rad] in -pi/4 .. pi/4, and the
    share of it that the polygon fills. One of its edges lies along one of the hull (Freeman and Shapira 1975)."""
    from scipy.spatial import ConvexHull

    hull = corners[ConvexHull(corners).vertices]
    along = np.roll(hull, -1, axis=0) - hull
    best = None
    for angle in np.unique(np.round(np.arctan2(along[:, 1], along[:, 0]) % (0.5 * np.pi), 12)):
        c, s = np.cos(angle), np.sin(angle)
        turned = hull @ np.array([[c, -s], [s, c]])
        low, high = turned.min(axis=0), turned.max(axis=0)
        size = high - low
        if best is None or np.prod(size) < best[0] * (1.0 - 1e-9):
            middle = np.array([[c, -s], [s, c]]) @ (0.5 * (low + high))
            best = float(np.prod(size)), middle, size, float(angle)
    area, middle, size, angle = best
    if angle > 0.25 * np.pi:
        angle, size = angle - 0.5 * np.pi, size[::-1]
    return middle, size, angle, abs(area_of(corners)) / area


def _in_own_process(path: Path, out: Path, change) -> None:
    from coupler.program.extras import missing
    from coupler.program.process import run_module, trouble

    absent = missing("terrain")
    if absent:
        raise FootprintError(f"{path.name}: {absent}")
    done = run_module(
        "coupler.geometry.footprints", path, out, *(change or ()), capture_output=True, text=True
    )
    if done.returncode != 0:
        raise FootprintError(f"{path.name}: {trouble(done.returncode, done.stderr)}")


def _convert(path: str, out: str, source: str = "", target: str = "") -> None:
    """Any vector file as GeoJSON, its coordinates changed from one system to another."""
    import pyogrio.raw
    import shapely
    from pyproj import Transformer

    meta, _, shapes, columns = pyogrio.raw.read(path)
    shapes = shapely.from_wkb(shapes)
    if target:
        change = Transformer.from_crs(source or meta["crs"], target, always_xy=True)
        shapes = shapely.transform(shapes, lambda p: np.column_stack(change.transform(p[:, 0], p[:, 1])))
    features = []
    for row, shape in enumerate(shapes):
        own = {str(name): _plain(column[row]) for name, column in zip(meta["fields"], columns)}
        features.append(
            {"type": "Feature", "properties": own, "geometry": json.loads(shapely.to_geojson(shape))}
        )
    system = {"type": "name", "properties": {"name": target or meta["crs"] or ""}}
    text = json.dumps({"type": "FeatureCollection", "crs": system, "features": features})
    Path(out).write_text(text, encoding="utf-8")


def _plain(value):
    """The value of an attribute as plain data for JSON."""
    return (
        value.item()
        if isinstance(value, np.generic)
        else value
        if value is None or isinstance(value, int | float | str)
        else str(value)
    )


if __name__ == "__main__":
    _convert(*sys.argv[1:])
