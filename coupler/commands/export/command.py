"""`surgebreak export RUN`: the results of a run for ParaView, xarray and Blender, beside it under `export/`."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterable
from pathlib import Path

from coupler.program.errors import ExitCode, SurgebreakError
from coupler.program.quantities import quantity
from coupler.results.vtkhdf import UNREADABLE
from coupler.run.summary import read_summary

FORMATS = ("vtk", "netcdf", "gltf")


class CannotExport(SurgebreakError):
    """The run holds nothing to export, or nothing that this format can hold."""

    exit_code = ExitCode.BAD_CASE


def export(run: Path, formats: list[str], to: Path | None, begin: float, end: float, tell=print) -> None:
    """Write the formats for stored times from begin to end [s].  Raises NoRun, CannotExport, NotInstalled."""
    wrong = [name for name in formats if name not in FORMATS]
    if wrong:
        raise CannotExport(f"--format {wrong[0]}: no such format; there are {', '.join(FORMATS)}")
    title = read_summary(run)["case"]["case"]["title"]
    folder = to or run / "export"
    folder.mkdir(parents=True, exist_ok=True)
    for name in formats:
        _reported(name, _writer(name, run, folder, title, lambda t: begin <= t <= end), folder, tell)


def _writer(name: str, run: Path, to: Path, title: str, chosen: Callable[[float], bool]) -> Iterable[Path]:
    if name == "vtk":
        from coupler.commands.export.vtk import write_vtk

        return write_vtk(run, to, chosen)
    if name == "netcdf":
        from coupler.commands.export.netcdf import write_netcdf

        return write_netcdf(run, to, title)
    from coupler.commands.export.gltf import write_gltf

    return write_gltf(run, to, chosen)


def _reported(name: str, made: Iterable[Path], folder: Path, tell) -> None:
    """Export, and print the number and size of the files and the time taken."""
    start, written = clock.process_time(), []
    try:
        written.extend(made)
    except UNREADABLE as error:
        raise CannotExport(f"{name}: a file of the run is not what a run writes: {error}") from error
    size = sum(path.stat().st_size for path in written)
    seconds = clock.process_time() - start
    if not written:
        tell(f"{name}: nothing new")
        return
    tell(f"{name}: {len(written)} files in {folder}, {quantity(float(size), 'B')}, {seconds:.1f} CPU s")
    tell(f"  {written[-1] if name != 'vtk' else ', '.join(str(p) for p in written if p.suffix == '.pvd')}")
