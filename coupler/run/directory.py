"""The directory of one run: made once, never overwritten, readable at any moment.

    case.toml       copy of the case        run.json    summary for machines, replaced as a whole
    effective.json  every value, in SI      log.txt     messages and tracebacks
    history/*.csv  fields.vtkhdf  blocks.vtkhdf  solids.vtkhdf  cracks.csv  checkpoints/  pictures/

`run.json` says "running" until the run ends; after a kill it still does, with the process number that it had.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import sys
import time
from collections.abc import Mapping
from datetime import UTC, datetime
from json.encoder import encode_basestring
from pathlib import Path
from types import TracebackType

from coupler.case.case import effective, modules
from coupler.checks.read_case import CaseFile
from coupler.program import provenance
from coupler.program.errors import FULL, CannotWrite, ExitCode, RunDirectoryExists
from coupler.program.failures import Failure
from coupler.run.fingerprint import ALL_FILE_KEYS, file_digests
from coupler.run.lock import RunLock
from coupler.run.summary import read_summary

RESERVE = 256 * 1024
"""Bytes kept aside so that the reason can still be written when the disk is full."""


class RunDirectory:
    """A context: leaving it writes how the run ended, whatever the reason."""

    def __init__(self, path: Path, summary: dict, lock: RunLock):
        self.path, self.summary, self.lock = path, summary, lock
        self.finished = False
        self._clock = (time.monotonic(), time.process_time())
        self._before = (0.0, 0.0)
        """Wall and processor seconds of the processes that the run was in before."""

    @classmethod
    def create(cls, file: CaseFile, output: Path | None = None) -> RunDirectory:
        """Make the directory with case, effective case, log and a first run.json.

        output: a new or empty directory; None: runs/<UTC stamp>-<hash of the effective case> beside the case.
        Raises RunDirectoryExists or CannotWrite.
        """
        content = effective(file.case)
        path = _make(output, file.directory / "runs", content)
        _claim(path)
        run = cls(path, _summary(file, content), RunLock(path))
        (path / ".reserve").write_bytes(bytes(RESERVE))
        (path / "case.toml").write_text(file.text, encoding="utf-8")
        write_json(path / "effective.json", content)
        run.begin()
        return run

    @classmethod
    def reopen(cls, path: Path, file: CaseFile, again: dict, lock: RunLock) -> RunDirectory:
        """Reopen the directory of a run that continues and mark it as running; `again` describes from where and how.

        lock: of that directory, taken before anything in it was read or changed."""
        before = read_summary(path)
        content = effective(file.case)
        now = _summary(file, content)
        now |= {name: before[name] for name in ("started", "case_file", "figures")}
        now["resumed"] = [*before.get("resumed", []), {"at": now_text(), "command": sys.argv, **again}]
        run = cls(path, now, lock)
        run._before = (before.get("wall_seconds", 0.0), before.get("cpu_seconds", 0.0))
        (path / ".reserve").write_bytes(bytes(RESERVE))
        write_json(path / "effective.json", content)
        run.begin()
        return run

    def begin(self) -> None:
        """Write the first lines of this process: the command, and the summary of a running run."""
        self.log(f"surgebreak {provenance.version()}: {' '.join(sys.argv)}")
        if not self.lock.known:
            self.log(
                "note: this file system has no locks; nothing keeps a second process out of the directory"
            )
        self.save()

    @property
    def log_path(self) -> Path:
        """File of the messages."""
        return self.path / "log.txt"

    @property
    def history(self) -> Path:
        """Directory of the history tables."""
        return self.path / "history"

    def log(self, text: str) -> None:
        """Append a line with its time to log.txt."""
        stamp = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        with self.log_path.open("a", encoding="utf-8", errors="backslashreplace") as stream:
            stream.write(f"{stamp}  {text}\n")

    def record(self, **figures: object) -> None:
        """Set figures of the summary (numbers, texts, lists or tables of them) and write it."""
        self.summary["figures"].update(figures)
        self.save()

    def save(self) -> None:
        """Replace run.json as a whole, so that a reader never sees half of it."""
        wall, cpu = self._before
        self.summary["wall_seconds"] = round(wall + time.monotonic() - self._clock[0], 3)
        self.summary["cpu_seconds"] = round(cpu + time.process_time() - self._clock[1], 3)
        write_json(self.path / "run.json", self.summary)

    def finish(self, code: ExitCode, reason: str) -> None:
        """Write how the run ended; the first reason stays."""
        if self.finished:
            return
        self.finished = True
        (self.path / ".reserve").unlink(missing_ok=True)
        self.summary |= {
            "status": code.name.lower(),
            "exit_code": int(code),
            "exit_reason": reason,
            "ended": now_text(),
        }
        self.save()
        self.log(f"{code.name.lower().replace('_', ' ')}: {reason}")
        self.lock.release()

    def __enter__(self) -> RunDirectory:
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, _: TracebackType | None) -> None:
        if error is None:
            self.finish(ExitCode.DONE, "reached the end")
            return
        error.log_path = self.log_path
        failure = Failure.of(error)
        self.summary["error"] = type(error).__name__
        try:
            self.finish(failure.exit_code, failure.message)
            if failure.traceback:
                self.log(failure.traceback)
        except OSError as second:
            if second.errno not in FULL:
                raise
        finally:
            self.lock.release()


def write_json(path: Path, content: object) -> None:
    """Write to a temporary file beside `path` and rename it, which happens completely or not at all."""
    part = path.with_name(f".{path.name}.part")
    with part.open("w", encoding="utf-8", errors="backslashreplace") as stream:
        stream.write(as_json(content) + "\n")
        stream.flush()
        os.fsync(stream.fileno())
    os.replace(part, path)


def as_json(value: object, margin: str = "\n") -> str:
    """JSON as `json.dumps(value, indent=1, ensure_ascii=False)` writes it, in a tenth of its time, of numbers, texts,
    lists and tables; numpy numbers and arrays become numbers and lists, NaN and infinities null, paths text.

    margin: what a new line begins with. Raises TypeError for anything else."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, str | Path):
        return encode_basestring(str(value))
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int):
        return int.__repr__(value)
    if isinstance(value, float):
        return float.__repr__(value) if math.isfinite(value) else "null"
    below = margin + " "
    if isinstance(value, Mapping):
        parts = [f"{encode_basestring(str(key))}: {as_json(inner, below)}" for key, inner in value.items()]
        return "{" + below + f",{below}".join(parts) + margin + "}" if parts else "{}"
    if isinstance(value, list | tuple):
        parts = [as_json(inner, below) for inner in value]
        return "[" + below + f",{below}".join(parts) + margin + "]" if parts else "[]"
    raise TypeError(f"{type(value).__name__} has no form in JSON")


def _make(output: Path | None, runs: Path, content: dict) -> Path:
    try:
        return _make_named(output) if output is not None else _make_stamped(runs, content)
    except OSError as error:
        raise CannotWrite(
            f"{output or runs}: cannot make the directory for the results ({error.strerror}); "
            "give --output a place that you may write to"
        ) from error


def _make_named(output: Path) -> Path:
    if output.exists() and not (output.is_dir() and not any(output.iterdir())):
        raise RunDirectoryExists(
            f"{output}: exists and is not an empty directory; results are never overwritten; "
            "name another with --output, or leave it out for runs/<time>-<hash>"
        )
    output.mkdir(parents=True, exist_ok=True)
    return output


def _claim(path: Path) -> None:
    """Claim a directory: only one of two runs that begin there at the same moment can make the folder of histories."""
    try:
        (path / "history").mkdir()
    except FileExistsError as error:
        raise RunDirectoryExists(
            f"{path}: another run has just begun there; name another with --output"
        ) from error


def _make_stamped(runs: Path, content: dict) -> Path:
    digest = hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:8]
    name = f"{_now():%Y%m%dT%H%M%SZ}-{digest}"
    runs.mkdir(parents=True, exist_ok=True)
    for attempt in range(1, 1000):
        path = runs / (name if attempt == 1 else f"{name}-{attempt}")
        try:
            path.mkdir()
            return path
        except FileExistsError:
            continue  # another run of the same case began within this second
    raise RunDirectoryExists(f"{runs / name}: exists a thousand times; remove old runs")


def _summary(file: CaseFile, content: dict) -> dict:
    return {
        "program": "surgebreak",
        "status": "running",
        "exit_code": None,
        "exit_reason": None,
        "started": now_text(),
        "ended": None,
        "process": os.getpid(),
        "command": sys.argv,
        "case_file": str(file.path.resolve()),
        "overrides": list(file.overrides),
        "modules": modules(file.case),
        "versions": provenance.versions(),
        "machine": provenance.machine(),
        "git": provenance.git_state(),
        "figures": {},
        "case": content,
        "files": file_digests(content, ALL_FILE_KEYS),
    }


def now_text() -> str:
    """The time now in UTC, ISO 8601 to the second."""
    return _now().isoformat(timespec="seconds")


def _now() -> datetime:
    return datetime.now(UTC)
