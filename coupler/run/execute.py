"""Executes a run from its case to its end for the commands `run` and `resume`: reports, comparison, exit code."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from coupler.case.case import Case, modules
from coupler.checks.bores import bores, in_words
from coupler.checks.read_case import CaseFile
from coupler.checks.remarks import remarks
from coupler.geometry.parts import parts_of
from coupler.program import arithmetic
from coupler.program.errors import ExitCode
from coupler.program.quantities import counted
from coupler.results.expected import verdicts
from coupler.run.compile_ahead import compile_ahead
from coupler.run.directory import RunDirectory


def execute_case(
    file: CaseFile,
    directory: RunDirectory,
    checkpoint=None,
    each: Callable | None = None,
    stop_reason: Callable[[], str | None] | None = None,
    quiet: bool = False,
) -> ExitCode:
    """Run a case in its directory to the end, from a checkpoint or from the start, and return how it ended.

    each: see `run` · stop_reason: called after every step, returns why the run is to end or None · quiet: report to
    the log only."""
    # here, because `check` describes a case without what a run loads
    from coupler.run.progress import ProgressFile, reporter
    from coupler.run.run import run
    from coupler.run.stop import StopRequest

    with directory, StopRequest(directory.path) as stop:
        asked = stop.requested if stop_reason is None else lambda: stop.requested() or stop_reason()
        with reporter(file.case.time.end, directory.log, asked, quiet) as tell:
            describe(file, tell.message)
            report_laws(file, directory, tell.message)
            compile_ahead(file.case, tell.message)
            on_file = ProgressFile(tell, directory.path)
            code = ExitCode(run(file.case, directory, on_file, checkpoint, each))
            compare(file, directory, tell.message)
        directory.finish(code, "reached the end" if code == ExitCode.DONE else "see log.txt")
    if not quiet:
        print(f"results in {directory.path}")
    return code


def describe(file: CaseFile, tell: Callable[[str], object]) -> None:
    """Report which parts are on and off, with remarks that matter before the run."""
    parts = modules(file.case)
    tell(f"{file.path}: {file.case.case.title}")
    tell("on:  " + (", ".join(name for name, on in parts.items() if on) or "nothing"))
    tell("off: " + (", ".join(name for name, on in parts.items() if not on) or "nothing"))
    for line in [*drawn(file.case), *map(in_words, bores(file.case))]:
        tell(line)
    for remark in [*remarks(file.case), *filter(None, [arithmetic.remark()])]:
        tell(f"note: {remark}")


def drawn(case: Case) -> Iterator[str]:
    """The extent of bodies from files, so that a wrong unit is noticed."""
    if case.terrain is not None and case.tank is not None and case.tank.ground is not None:
        yield _ground(case)
    for part in parts_of(case):
        if part.path[1] in ("drawing", "file") and part.blocks:
            corners = np.concatenate([block.world_vertices() for block in part.blocks])
            lengths = " x ".join(f"{length:.4g}" for length in np.ptp(corners, axis=0))
            number = counted(len(part.blocks), "block")
            yield f"structure.{part.path[1]} '{part.name}': {lengths} m along x, y and z, {number}"


def _ground(case: Case) -> str:
    """Extent and heights of the terrain, and that its unit was guessed where the file names none."""
    ground, path = case.tank.ground, Path(case.terrain.path)
    named = case.terrain.crs or case.terrain.reproject or case.terrain.scale != 1.0
    named = named or path.suffix.lower() in NAMES_ITS_UNIT or path.with_suffix(".prj").is_file()
    covered = " x ".join(f"{high - low:.4g}" for low, high in ground.covered)
    guessed = "" if named else "; the file names no unit and is taken to be in metres (terrain.scale)"
    return (
        f"terrain {path.name}: {covered} m, heights from "
        f"{np.nanmin(ground.z):.4g} to {np.nanmax(ground.z):.4g} m{guessed}"
    )


NAMES_ITS_UNIT = (".tif", ".tiff", ".nc", ".grd")
"""Endings of terrain files that may say their coordinate system themselves."""


def report_laws(file: CaseFile, directory: RunDirectory, tell: Callable[[str], object]) -> None:
    """Report laws that did not come with the program, and record their origin and checksum in run.json."""
    if file.case.joints is None:
        return
    from yade_scripts.joints import laws

    own = laws.shipped()
    used = {file.case.joints.law, *(pair.law for pair in file.case.joints.pair if pair.law)}
    found = {name: laws.identity(name) for name in sorted(used) if name not in own}
    for name, law in found.items():
        tell(f"law '{name}': {law['from']}")
    directory.summary["laws"] = found


def compare(file: CaseFile, directory: RunDirectory, tell: Callable[[str], object]) -> None:
    """Report whether a run of the unchanged case meets its expected.toml, if there is one."""
    promises = file.directory / "expected.toml"
    if file.overrides or not file.path.is_file() or not promises.exists():
        return
    found = verdicts(directory.path, promises)
    for verdict in found:
        tell(f"{'as expected' if verdict.kept else 'UNEXPECTED'}: {verdict}")
    directory.record(expected={verdict.what: verdict.kept for verdict in found})
