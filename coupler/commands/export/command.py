"""`surgebreak export RUN`: the results of a run for ParaView, xarray and Blender, beside it under `export/`."""

from __future__ import annotations

import json
import time as clock
import zlib
from collections.abc import Callable, Iterable
from pathlib import Path

from coupler.commands.export.stored import keep_if, made_of
from coupler.program.errors import ExitCode, SurgebreakError
from coupler.program.quantities import quantity
from coupler.results.vtkhdf import UNREADABLE, read_times
from coupler.run.summary import read_summary

FORMATS = ("vtk", "netcdf", "gltf")
STEPS = ("water_[0-9]*.vtu", "blocks_[0-9]*.vtu", "solids.vtu", "scene_[0-9]*.glb")
"""Files that a repeated export keeps."""


class CannotExport(SurgebreakError):
    """The run holds nothing to export, or nothing that this format can hold."""

    exit_code = ExitCode.BAD_CASE


def export(run: Path, formats: list[str], to: Path | None, begin: float, end: float, tell=print) -> None:
    """Write the formats for stored times from begin to end [s].  Raises NoRun, CannotExport, NotInstalled."""
    wrong = [name for name in formats if name not in FORMATS]
    if wrong:
        raise CannotExport(f"--format {wrong[0]}: no such format; there are {', '.join(FORMATS)}")
    summary = read_summary(run)
    if set(formats) - {"netcdf"}:
        _check_window(run, begin, end)
    title = summary["case"]["case"]["title"]
    folder = to or run / "export"
    folder.mkdir(parents=True, exist_ok=True)
    _begin(folder, summary)
    for name in formats:
        _reported(name, _writer(name, run, folder, title, lambda t: begin <= t <= end), folder, tell)


def _check_window(run: Path, begin: float, end: float) -> None:
    """Raises CannotExport where the run has stored states, and none from begin to end [s]."""
    for path in filter(Path.exists, (run / "fields.vtkhdf", run / "blocks.vtkhdf")):
        try:
            times = read_times(path)
        except UNREADABLE:
            return  # the writers say what is wrong with the file
        if len(times) and not ((times >= begin) & (times <= end)).any():
            raise CannotExport(
                f"--from {begin:g} --until {end:g}: no state in between; there are {len(times)}, from {times[0]:g} to "
                f"{times[-1]:g} s"
            )


def _begin(folder: Path, summary: dict) -> None:
    """Make sure that the files in a directory, which are not written again, are those of this run, and of its states
    since it was last resumed.  Raises CannotExport."""
    case = {
        name: part for name, part in summary["case"].items() if name not in ("time", "coupling", "limits")
    }
    run = [summary["started"], zlib.crc32(json.dumps(case, sort_keys=True).encode())]
    if made_of(folder).get("run", run) != run:
        raise CannotExport(
            f"{folder} holds the files of another run; give --to another directory, or remove it"
        )
    keep_if(folder, "run", run, STEPS)
    keep_if(folder, "resumed", len(summary.get("resumed", [])), STEPS)


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
