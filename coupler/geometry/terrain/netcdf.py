"""NetCDF files, classic and version 4 → (x, y, z) of a raster: by the CF conventions and those of GMT."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from array_types import Array
from coupler.geometry.terrain.grid import Grid, TerrainError
from coupler.program.errors import briefly, did_you_mean

EVEN = 1e-3
"""Share of a spacing by which the points of a raster, and the rims of their cells, may be off."""


@dataclass(frozen=True)
class _Contents:
    """What a file holds. values: arrays by name · dims: names of their dimensions · attributes: of every variable, also
    of those that hold no numbers · overall: of the file."""

    values: dict[str, Array]
    dims: dict[str, tuple[str, ...]]
    attributes: dict[str, dict[str, Any]]
    overall: dict[str, Any]


def read_netcdf(path: Path, variable: str | None) -> Grid:
    """A variable of two coordinates. Heights that belong to cells hold up to their rims. Raises TerrainError."""
    file = _contents(path)
    rims = {_text(of, "bounds") for of in file.attributes.values()}
    planes = {name: file.dims[name] for name, a in file.values.items() if a.ndim == 2 and name not in rims}
    if variable is not None and variable not in planes:
        raise TerrainError(
            f"{path.name}: no variable '{variable}' of two coordinates{did_you_mean(variable, planes)}"
        )
    if variable is None:
        if len(planes) != 1:
            raise TerrainError(
                f"{path.name}: variables of two coordinates: {', '.join(planes) or 'none'}; name one as `variable`"
            )
        variable = next(iter(planes))
    along, across = file.dims[variable]
    for name in (along, across):
        if name not in file.values:
            raise TerrainError(f"{path.name}: no coordinates for '{name}' of '{variable}'")
    eastward, northward = _directions(path, variable, (across, along), file.attributes)
    x, y = (_unpacked(path, name, file.values[name], file.attributes[name]) for name in (eastward, northward))
    z = _unpacked(path, variable, file.values[variable], file.attributes[variable])
    mapping = file.attributes.get(_text(file.attributes[variable], "grid_mapping"), {})
    degrees = "degree" in _said(file.attributes[eastward], "units")
    crs = _system(mapping) or ("EPSG:4326" if degrees else "")
    return _even(
        path, x, y, z.T if eastward == across else z, crs, _of_cells(file, mapping, (eastward, northward))
    )


def _system(mapping: dict[str, Any]) -> str:
    """The coordinate system of a grid mapping as text (CF calls it crs_wkt, GDAL also spatial_ref); "" without one."""
    return _text(mapping, "crs_wkt") or _text(mapping, "spatial_ref")


def _of_cells(file: _Contents, mapping: dict[str, Any], names: tuple[str, str]) -> bool:
    """Whether the heights belong to the middles of cells: GMT says so by node_offset = 1, CF by the bounds of both
    coordinates, GDAL by the corner of the first cell in GeoTransform, and others by a range of the coordinates that
    reaches half a cell beyond the first and the last."""
    said = np.ravel(file.overall.get("node_offset", ()))
    if len(said):
        return bool(said[0] == 1)
    ends = [file.values[name][[0, -1]].astype(float) for name in names]
    half = [0.5 * abs(b - a) / max(len(file.values[name]) - 1, 1) for name, (a, b) in zip(names, ends)]
    reach = [_reach(file, name) for name in names]
    try:
        corner = [float(word) for word in _text(mapping, "GeoTransform").split()]
    except ValueError:
        corner = []
    if len(corner) == 6:
        reach = [r or (first, first) for r, first in zip(reach, (corner[0], corner[3]))]
    return all(
        r is not None and min(abs(abs(end - place) - h) for place in r for end in e) <= EVEN * h
        for r, e, h in zip(reach, ends, half)
    )


def _reach(file: _Contents, name: str) -> tuple[float, float] | None:
    """Lowest and highest value that a coordinate says to cover, by the bounds of its cells or by its range."""
    of = file.attributes[name]
    bounds = file.values.get(_text(of, "bounds"), of.get("actual_range", ()))
    try:
        values = np.ravel(np.asarray(bounds, float))
    except (TypeError, ValueError):
        return None
    return (float(values.min()), float(values.max())) if len(values) > 1 else None


BEGINNINGS = {"x": ("x", "lon", "east", "projection_x"), "y": ("y", "lat", "north", "projection_y")}
"""Beginnings of the names of the coordinates that count along x and along y."""
COMPASS = {"x": re.compile(r"degrees?_?e(ast)?"), "y": re.compile(r"degrees?_?n(orth)?")}
"""Units that say a direction, in the spellings of the CF conventions."""


def _directions(path: Path, variable: str, names: tuple[str, str], attributes: dict) -> tuple[str, str]:
    """The names of the two coordinates that count along x and along y, by their attributes or else by their names."""
    found = {_direction(name, attributes[name]): name for name in names}
    if set(found) != {"x", "y"}:
        raise TerrainError(
            f"{path.name}: of the coordinates '{names[0]}' and '{names[1]}' of '{variable}' one must be known as x, "
            "the other as y: by names that begin with x, lon or east and with y, lat or north, or by the attribute "
            "axis, X or Y"
        )
    return found["x"], found["y"]


def _direction(name: str, attributes: dict) -> str | None:
    """x or y, where a coordinate says which of the two it is."""
    axis, known, unit = (_said(attributes, key) for key in ("axis", "standard_name", "units"))
    for letter, beginnings in BEGINNINGS.items():
        if axis == letter or known.startswith(beginnings) or COMPASS[letter].fullmatch(unit):
            return letter
    return next((k for k, beginnings in BEGINNINGS.items() if name.lower().startswith(beginnings)), None)


def _said(attributes: dict, key: str) -> str:
    """The text of an attribute in small letters; empty where there is none."""
    return _text(attributes, key).lower()


def _text(attributes: dict, key: str) -> str:
    """The text of an attribute; empty where there is none."""
    return str(_plain([*np.ravel(attributes.get(key, "")), ""][0])).strip()


def _unpacked(path: Path, name: str, packed: Array, attributes: dict) -> Array:
    """Values of a variable by the CF conventions: NaN where there is none, else packed * scale_factor + add_offset. The
    marks of missing values are packed numbers."""
    values = np.array(packed, float)
    missing = [m for key in ("_FillValue", "missing_value") for m in _numbers(path, name, key, attributes)]
    values[np.isin(values, missing)] = np.nan
    scale = [*_numbers(path, name, "scale_factor", attributes), 1.0][0]
    if scale == 0.0:
        raise TerrainError(f"{path.name}: scale_factor = 0 of '{name}' leaves nothing of its values")
    return values * scale + [*_numbers(path, name, "add_offset", attributes), 0.0][0]


def _numbers(path: Path, name: str, key: str, attributes: dict) -> list[float]:
    """The numbers of an attribute; none where it is absent."""
    try:
        return [float(value) for value in np.ravel(attributes.get(key, ()))]
    except (TypeError, ValueError) as error:
        raise TerrainError(f"{path.name}: {key} of '{name}' is no number ({briefly(str(error))})") from error


READING = (
    OSError,
    ValueError,
    TypeError,
    LookupError,
    ArithmeticError,
    AttributeError,
    RuntimeError,
    MemoryError,
)
"""What scipy and h5py raise on damaged files."""


def _contents(path: Path) -> _Contents:
    with open(path, "rb") as stream:
        start = stream.read(4)
    try:
        return _classic(path) if start[:3] == b"CDF" else _version_4(path)
    except READING as error:
        raise TerrainError(f"{path.name}: cannot be read as NetCDF ({briefly(str(error))})") from error


def _classic(path: Path) -> _Contents:
    from scipy.io import netcdf_file

    with netcdf_file(path, mmap=False) as file:
        variables = file.variables
        return _Contents(
            {n: np.array(v.data) for n, v in variables.items() if v.data.dtype.kind in "fiu"},
            {n: tuple(v.dimensions) for n, v in variables.items()},
            {n: {k: _plain(a) for k, a in v._attributes.items()} for n, v in variables.items()},
            {k: _plain(a) for k, a in file._attributes.items()},
        )


def _version_4(path: Path) -> _Contents:
    import h5py

    found = _Contents({}, {}, {}, {})
    with h5py.File(path) as file:
        found.overall.update(_read_attributes(file))
        for name, data in file.items():
            if not isinstance(data, h5py.Dataset):
                continue
            found.attributes[name] = _read_attributes(data)
            if data.dtype.kind in "fiu":
                found.values[name] = data[...]
                found.dims[name] = tuple(_scale_name(d, name) for d in data.dims)
    return found


def _read_attributes(data: Any) -> dict[str, Any]:
    """Attributes of a dataset or a file of HDF5, without the lists by which dimensions refer to one another."""
    return {k: _plain(data.attrs[k]) for k in data.attrs if k not in ("DIMENSION_LIST", "REFERENCE_LIST")}


def _scale_name(dimension, own: str) -> str:
    return dimension[0].name.lstrip("/") if len(dimension) else own


def _plain(value):
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


def _even(path: Path, x: Array, y: Array, z: Array, crs: str, cells: bool) -> Grid:
    """A raster whose coordinates increase; uneven ones are refused."""
    if x[-1] < x[0]:
        x, z = x[::-1], z[::-1]
    if y[-1] < y[0]:
        y, z = y[::-1], z[:, ::-1]
    for name, a in (("x", x), ("y", y)):
        step = np.diff(a)
        if not (step > 0).all() or np.ptp(step) > 2 * EVEN * step.mean():
            raise TerrainError(f"{path.name}: its {name} are not evenly spaced; resample it (gdalwarp)")
    x, y = np.linspace(x[0], x[-1], len(x)), np.linspace(y[0], y[-1], len(y))
    half = (0.5 * float(x[1] - x[0]), 0.5 * float(y[1] - y[0])) if len(x) > 1 and len(y) > 1 else (0.0, 0.0)
    return Grid(x, y, np.ascontiguousarray(z), crs, rim=half if cells else (0.0, 0.0))
