"""Histories and maps of a flood as NetCDF by the CF conventions: `xarray.open_dataset` gives them with their units and
meanings.

Classic NetCDF (64-bit offsets), which scipy writes and everything reads.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from coupler.results.history import History, by_block, read_history
from coupler.results.maps import Map, read_map

CONVENTIONS = "CF-1.10"


FILL = 9.969209968386869e36
"""Value at places without data: the default of NetCDF for doubles."""
UNITS = {"bed": "m", "depth": "m", "speed": "m s-1", "flux": "m3 s-2", "arrival": "s"}
"""Units of the maps in the CF notation."""


def write_netcdf(run: Path, to: Path, title: str) -> Iterator[Path]:
    """Write one file for each table of `history/`, and `maps.nc` if the run has maps."""
    for source in sorted((run / "history").glob("*.csv")):
        table = read_history(source)
        if len(table["time"]):
            path = to / f"{source.stem}.nc"
            beside = path.with_name(f".{path.name}.part")
            _write(beside, table, title)
            os.replace(beside, path)
            yield path
    maps = {name: run / "maps" / f"{name}.asc" for name in UNITS}
    if all(path.is_file() for path in maps.values()):
        beside = to / ".maps.nc.part"
        _write_maps(beside, {name: read_map(path) for name, path in maps.items()}, title)
        os.replace(beside, to / "maps.nc")
        yield to / "maps.nc"


def _write_maps(path: Path, maps: dict[str, Map], title: str) -> None:
    """All maps of a run over (y, x), from south to north."""
    from scipy.io import netcdf_file

    bed = maps["bed"]
    with netcdf_file(path, "w", version=2) as file:
        file.Conventions = CONVENTIONS
        file.title = f"{title}: maps of the flood".encode()
        file.source = b"surgebreak"
        file.comment = f"coordinates of {bed.frame}".encode()
        for name, values in (("y", bed.y), ("x", bed.x)):
            file.createDimension(name, len(values))
            made = file.createVariable(name, "f8", (name,))
            made[:] = values
            made.units, made.axis = b"m", name.upper().encode()
            made.long_name = f"{name} of {bed.frame}".encode()
        for name, one in maps.items():
            made = file.createVariable(name, "f8", ("y", "x"))
            made._FillValue = FILL
            made[:] = np.where(np.isfinite(one.z), one.z, FILL)
            made.units, made.long_name = UNITS[name].encode(), one.what.encode()


def _write(path: Path, table: History, title: str) -> None:
    from scipy.io import netcdf_file

    with netcdf_file(path, "w", version=2) as file:
        file.Conventions = CONVENTIONS
        file.title = f"{title}: {table.title}".encode()
        file.source = b"surgebreak"
        blocks = by_block(table)
        values = table.values if blocks is None else blocks.values | {"time": blocks.times}
        file.createDimension("time", len(values["time"]))
        if blocks is not None:
            _write_names(file, blocks.label, blocks.names)
        for column in table.columns:
            if column.unit == "":
                continue
            along = ("time",) if blocks is None or column.name == "time" else ("time", blocks.label)
            made = file.createVariable(column.name, "f8", along)
            missing = np.isnan(values[column.name])
            if len(along) > 1 and missing.any():
                made._FillValue = FILL
            made[:] = np.where(missing, FILL, values[column.name]) if len(along) > 1 else values[column.name]
            made.units = column.unit.encode()
            made.long_name = column.meaning.encode("ascii", "replace")
            if column.name == "time":
                made.axis = b"T"  # seconds since the start: a number, no date


def _write_names(file, label: str, names: list[str]) -> None:
    """The names of blocks as a coordinate: rows of characters, which classic NetCDF has in place of text."""
    texts = [name.encode() for name in names]
    longest = max(map(len, texts), default=1) or 1
    file.createDimension(label, len(names))
    file.createDimension(f"{label}_characters", longest)
    made = file.createVariable(label, "c", (label, f"{label}_characters"))
    made[:] = np.array([list(text.ljust(longest, b"\0")) for text in texts], np.uint8).view("S1")
    made._Encoding, made.long_name = b"utf-8", b"name of the block"
