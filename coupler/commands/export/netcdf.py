"""Histories as NetCDF by the CF conventions: `xarray.open_dataset` gives gauges with their units and meanings.

Classic NetCDF (64-bit offsets), which scipy writes and everything reads.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from coupler.results.history import History, read_history

CONVENTIONS = "CF-1.10"


def write_netcdf(run: Path, to: Path, title: str) -> Iterator[Path]:
    """One file for each table of `history/`."""
    for source in sorted((run / "history").glob("*.csv")):
        table = read_history(source)
        if len(table["time"]):
            path = to / f"{source.stem}.nc"
            beside = path.with_name(f".{path.name}.part")
            _write(beside, table, title)
            os.replace(beside, path)
            yield path


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
