"""Continuing a stopped run: the choice of the checkpoint, and the check that it belongs to the case and the program.

The newest complete checkpoint up to which the result files are complete is used; newer ones are reported and
removed. The case is the run's own copy; only keys that do not change the scene may be changed (`fingerprint.FREE`).
"""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from coupler.case.case import effective
from coupler.checks.read_case import CaseFile, changed, load
from coupler.program.errors import FULL, ExitCode, SurgebreakError
from coupler.results import vtkhdf
from coupler.run.array_file import Damaged
from coupler.run.checkpoint import FOLDER, LAYOUT, Checkpoint, listed
from coupler.run.directory import RunDirectory
from coupler.run.fingerprint import FREE, case_differences, differences, file_digests, is_free, program
from coupler.run.lock import RunLock
from coupler.run.stop import FILE_NAME
from coupler.run.summary import read_summary


class CannotResume(SurgebreakError):
    """The run cannot be continued; the message gives the reason and the remedy."""

    exit_code = ExitCode.BAD_CASE


@dataclass(frozen=True)
class Resumption:
    """The arguments with which `run` continues."""

    file: CaseFile
    directory: RunDirectory
    checkpoint: Checkpoint


def prepare(
    path: Path, overrides: Iterable[str] = (), any_version: bool = False, tell: Callable[[str], None] = print
) -> Resumption:
    """Find the checkpoint from which the run in the directory `path` can continue, and reopen the directory.

    overrides: KEY=VALUE, of names in `FREE` only · any_version: also continue with another version of the program.
    Raises NoRun, Busy, CannotResume, BadCase; in these cases nothing is changed.
    """
    summary = read_summary(path)
    _check_idle(path, summary)
    overrides = tuple(overrides)
    _check_free(overrides, summary.get("case") or {})
    lock = _locked(path)
    summary = read_summary(path)  # of the process that held it until now
    checkpoint, unusable = _newest(path)
    for line in unusable:
        tell(f"note: {line}")
    _check_laws(path, summary.get("laws", {}), any_version)
    file = load(
        path / "case.toml", [*summary["overrides"], *overrides], files=Path(summary["case_file"]).parent
    )
    file = replace(file, path=Path(summary["case_file"]))  # what else lies beside the case is found there
    _check_case(path, checkpoint, file)
    _check_program(checkpoint, any_version, tell)
    _check_end(path, checkpoint, file)
    _clear(path, checkpoint)
    again = {"from": checkpoint.path.name, "time": checkpoint.time, "changed": list(overrides)}
    tell(
        f"going on from {checkpoint.path}, t = {checkpoint.time:.6g} s, step {checkpoint.about['figures']['steps']}"
    )
    try:
        return Resumption(file, RunDirectory.reopen(path, file, again, lock), checkpoint)
    except OSError as error:
        if error.errno in FULL:
            raise
        raise CannotResume(f"{path}: a file of the run cannot be written: {error}") from error


def _locked(path: Path) -> RunLock:
    """The lock of the directory. Raises Busy, and CannotResume where nothing may be written."""
    try:
        return RunLock(path)
    except OSError as error:
        raise CannotResume(
            f"{path}: a run goes on in its own directory, and here nothing can be written ({error.strerror})"
        ) from error


def _clear(path: Path, checkpoint: Checkpoint) -> None:
    """Remove files that the run would mistake for its own: newer or incomplete checkpoints, and the last request to
    stop."""
    for newer in listed(path / FOLDER):
        if newer.name > checkpoint.path.name:
            newer.unlink()
    for part in (path / FOLDER).glob(".*.part"):
        part.unlink()
    (path / FILE_NAME).unlink(missing_ok=True)


def _check_idle(path: Path, summary: dict) -> None:
    process = summary["process"]
    here = summary["machine"].get("host") == platform.node()
    if summary["status"] == "running" and here and process != os.getpid() and _is_ours(process):
        raise CannotResume(
            f"{path} is still running (process {process}); end it with Ctrl-C or `touch {path / FILE_NAME}` first"
        )


def _is_ours(process: int) -> bool:
    """Whether the number belongs to a process of this program, and not to a later one that got the same."""
    try:
        words = Path(f"/proc/{process}/cmdline").read_text(encoding="utf-8", errors="replace").split("\0")
    except OSError:
        return False
    return any(Path(word).name == "surgebreak" or word.startswith("coupler.") for word in words[1:])


def _check_free(overrides: tuple[str, ...], case: dict) -> None:
    """Check that nothing else is changed than a run may change as it continues. Raises BadCase for a name that no case
    has, CannotResume for one that must stay, with the reason. case: effective"""
    for override in overrides:
        key = override.partition("=")[0].strip()
        if any(is_free(key, name) for name in FREE):
            continue
        changed(case, override)  # refuses what is no name of a case
        raise CannotResume(
            f"--set {override}: {_why_kept(key)}. What may change as a run continues: "
            f"{', '.join(name + '*' if name.endswith('.') else name for name in FREE)}"
        )


def _why_kept(key: str) -> str:
    """Why the value of this key is the same during a whole run."""
    section = re.split(r"[.\[]", key, maxsplit=1)[0]
    if section in ("study", "sweep"):
        return f"a run does not read [{section}], so that this would change nothing"
    if section == "gauge":
        return (
            "the tables of the gauges keep the columns with which they began; a further gauge needs a new run"
        )
    if section == "verdict":
        return "the run has followed its blocks by this rule from the start, and cannot judge the past by another"
    return (
        "this belongs to what the run computes, and its first part was computed with another value; for the answer "
        "with this one, run the case anew"
    )


def _newest(path: Path) -> tuple[Checkpoint, list[str]]:
    """The newest checkpoint that can be used, and the faults of newer ones."""
    unusable: list[str] = []
    for place in listed(path / FOLDER):
        try:
            checkpoint = Checkpoint.read(place)
        except Damaged as error:
            unusable.append(f"{error}; left out")
            continue
        wrong = _wrong_with(path, checkpoint)
        if not wrong:
            return checkpoint, unusable
        unusable.append(f"{place}: {wrong}; left out")
    if unusable:
        raise CannotResume(
            f"{path}: no checkpoint can be used:\n" + "\n".join(unusable) + "\nRun the case again."
        )
    raise CannotResume(
        f"{path} has no checkpoint to go on from (it ended before the first one, or time.checkpoint_every is 0); "
        "run the case again"
    )


def _wrong_with(path: Path, checkpoint: Checkpoint) -> str:
    """Why a complete checkpoint cannot be used: its layout, or result files that end before it."""
    if checkpoint.about["layout"] != LAYOUT:
        return f"written in layout {checkpoint.about['layout']}, this program reads {LAYOUT}"
    kept = checkpoint.part("recorder")
    for name, place in kept.items():
        if name.startswith("table_"):
            table = path / "history" / f"{name.removeprefix('table_')}.csv"
            if not table.is_file() or table.stat().st_size < place[1]:
                return f"{table} ends before it"
    for part, name in (("water", "fields.vtkhdf"), ("structure", "blocks.vtkhdf")):
        if checkpoint.part(part):
            steps = _steps_in(path / name)
            if steps < int(kept["outputs"]):
                return f"{path / name} holds {steps} states, it needs {int(kept['outputs'])}"
    return ""


def _steps_in(path: Path) -> int:
    try:
        return len(vtkhdf.read_times(path))
    except vtkhdf.UNREADABLE:
        return 0


def _check_case(path: Path, checkpoint: Checkpoint, file: CaseFile) -> None:
    found = case_differences(checkpoint.about["case"], effective(file.case))
    if found:
        raise CannotResume(
            f"{path / 'case.toml'} is not the case that the run began with: {'; '.join(found)}. "
            "Undo that, or run it as a new case."
        )
    files = differences(checkpoint.about["files"], file_digests(effective(file.case)))
    if files:
        raise CannotResume(
            f"files that {path / 'case.toml'} names have changed since the run began: {'; '.join(files)} (checksums). "
            "Put them back, or run it as a new case."
        )


def _check_program(checkpoint: Checkpoint, any_version: bool, tell) -> None:
    found = differences(checkpoint.about["program"], program())
    if not found:
        return
    if not any_version:
        raise CannotResume(
            f"another program wrote {checkpoint.path}: {'; '.join(found)}. Go back to it, or give --any-version: "
            "then the rest of the run need not be what it would have been to the last digit."
        )
    tell(f"note: the checkpoint was written by another program: {'; '.join(found)}")


def _check_laws(path: Path, laws: dict, any_version: bool) -> None:
    """Check that laws from outside the program are given again and have not changed. Raises CannotResume."""
    if not laws:
        return
    from yade_scripts.joints.laws import identity, names

    for name, then in laws.items():
        if name not in names():
            raise CannotResume(
                f"{path}: its joints go by the law '{name}' of {then.get('from')}, which is not known here; name its "
                "file again with --law FILE, register it again in the script, or install its package"
            )
        if identity(name)["checksum"] != then.get("checksum") and not any_version:
            raise CannotResume(
                f"{path}: the law '{name}' of {then.get('from')} is not what it was when the run began. Undo that, "
                "or give --any-version"
            )


def _check_end(path: Path, checkpoint: Checkpoint, file: CaseFile) -> None:
    end = file.case.time.end
    if checkpoint.time < end * (1.0 - 1e-9):
        return
    raise CannotResume(
        f"{path} has reached t = {checkpoint.time:.6g} s, its end is {end:.6g} s; "
        "give a later one with --end to go on"
    )
