"""Histories and maps of a flood as NetCDF by the CF conventions: `xarray.open_dataset` gives them with their units and
meanings.

Classic NetCDF (64-bit offsets), which scipy writes and everything reads.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from coupler.results.history import History, read_history
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
        file.createDimension("time", len(table["time"]))
        for column in table.columns:
            if column.unit == "":
                continue
            made = file.createVariable(column.name, "f8", ("time",))
            made[:] = table[column.name]
            made.units = column.unit.encode()
            made.long_name = column.meaning.encode("ascii", "replace")
            if column.name == "time":
                made.axis = b"T"  # seconds since the start: a number, no date
