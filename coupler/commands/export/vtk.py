"""`water.pvd` and `blocks.pvd`: a .vtu file for each stored time and one that names them all, for ParaView by a double
click, 5.11 included, which knows no .vtkhdf.

Each file is written beside its place and then renamed, the .pvd last, so that what a .pvd names is whole even where the
export was killed. Files that are there are kept: exporting again while a run goes on adds what is new.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from coupler.commands.export.stored import Stored, stored
from coupler.results import vtkhdf


def write_vtk(run: Path, to: Path, chosen: Callable[[float], bool]) -> Iterator[Path]:
    """Write the files of a run and yield each one when it is complete. chosen: whether a time [s] is wanted."""
    for name, kind in (("water", "fields.vtkhdf"), ("blocks", "blocks.vtkhdf")):
        if (run / kind).exists():
            yield from _series(to, name, stored(run / kind), chosen)
    if (run / "solids.vtkhdf").exists():
        yield from _solids(run / "solids.vtkhdf", to / "solids.vtu")


def _series(to: Path, name: str, series: Stored, chosen: Callable[[float], bool]) -> Iterator[Path]:
    made = []
    for k, time in enumerate(series.times):
        if not chosen(float(time)):
            continue
        path = to / f"{name}_{k:05d}.vtu"
        if not path.exists():
            _whole(path, lambda beside, k=k: _write_step(beside, series, k))
            yield path
        made.append((float(time), path.name))
        if path.exists() and len(made) % 20 == 0:
            _whole(to / f"{name}.pvd", lambda beside: beside.write_text(_collection(made), encoding="utf-8"))
    _whole(to / f"{name}.pvd", lambda beside: beside.write_text(_collection(made), encoding="utf-8"))
    yield to / f"{name}.pvd"


def _collection(made: list[tuple[float, str]]) -> str:
    """The text of a .pvd file: one file for each time."""
    files = "\n".join(
        f'    <DataSet timestep="{time!r}" group="" part="0" file="{name}"/>' for time, name in made
    )
    return (
        '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">\n'
        f"  <Collection>\n{files}\n  </Collection>\n</VTKFile>\n"
    )


def _write_step(path: Path, series: Stored, k: int) -> None:
    import meshio

    points, cells, point_data, cell_data = series.step(k)
    rows = [order for _, _, order in cells]
    data = {name: [np.asarray(values)[order] for order in rows] for name, values in cell_data.items()}
    meshio.Mesh(
        points, [(kind, ends) for kind, ends, _ in cells], point_data=point_data, cell_data=data
    ).write(path, file_format="vtu")


def _solids(source: Path, path: Path) -> Iterator[Path]:
    """Write the fixed solids once; nothing for a tank without solids."""
    import meshio

    with vtkhdf.opened(source, "r") as file:
        points = file["VTKHDF/Points"][:] + file["scene"].attrs["origin"]
    if not len(points) or path.exists():
        return
    from coupler.commands.export.stored import polygon_cells

    cells = polygon_cells(*vtkhdf.read_polygons(source))
    _whole(path, lambda beside: meshio.Mesh(points, [c[:2] for c in cells]).write(beside, file_format="vtu"))
    yield path


def _whole(path: Path, write: Callable[[Path], object]) -> None:
    """Write to a temporary file beside `path`, then rename it."""
    beside = path.with_name(f".{path.name}.part")
    write(beside)
    os.replace(beside, path)
