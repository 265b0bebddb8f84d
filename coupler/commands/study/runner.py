"""Runs the settings of a study one after the other, each in a separate process, and measures their cost.

    runs/ID-K/        run directory of the K-th run of a setting          runs/ID-K.json   its cost

The second file is written when the process has ended, so that a study that was stopped continues after the last
completed run. User and system time and peak memory are those of the process and its children (wait4).
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from coupler.case.schedule import first_part
from coupler.checks.read_case import load
from coupler.commands.study.plan import Plan, Setting
from coupler.program.errors import BadCase, ExitCode
from coupler.program.process import environment, trouble
from coupler.results.history import read_history
from coupler.run.directory import write_json
from coupler.run.fingerprint import differences, program
from coupler.run.summary import read_summary

COMPILED = 0.05
"""Share of the time of the steps from which a run that had to compile is made again: it compiled what the first step
does not need, and finds it the second time."""
ENDED = (ExitCode.DONE, ExitCode.BAD_CASE, ExitCode.DIVERGED, ExitCode.STOPPED)
"""Exit codes of runs that would end the same way again."""


@dataclass(frozen=True)
class Cost:
    """Cost of a process: CPU seconds (user + system), wall seconds, peak resident memory [bytes]; its exit code."""

    cpu_seconds: float
    wall_seconds: float
    peak_memory: int
    exit_code: int


@dataclass(frozen=True)
class FirstStep:
    """CPU seconds of a process that takes one step, those of them in the compiler, and wall seconds."""

    cpu_seconds: float
    compile_seconds: float
    wall_seconds: float


@dataclass(frozen=True)
class Measured:
    """One run. cpu_seconds: steps and output, without start_seconds (loading the program), set_up_seconds (of the
    scene, and loading YADE) and compile_seconds.

    reason: empty for a run that reached its end · size: see `observe.size` · passes: mean pressure solves in a step"""

    setting: str
    number: int
    exit_code: int
    reason: str
    cpu_seconds: float
    start_seconds: float
    set_up_seconds: float
    compile_seconds: float
    wall_seconds: float
    peak_memory: int
    steps: int
    substeps: int
    passes: float
    size: dict
    split: dict
    program: dict

    @property
    def failed(self) -> bool:
        """Whether the run ended with an error; `reason` says which."""
        return bool(self.reason)


class Runs:
    """The runs of a study in its directory."""

    def __init__(self, plan: Plan, folder: Path, any_version: bool, tell: Callable[[str], None]):
        self.plan, self.any_version, self.tell = plan, any_version, tell
        self.folder = folder / "runs"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.program = program()
        self.first_step = self._known_first_step()
        self._warm = False

    def place(self, setting: str, number: int) -> Path:
        """Run directory of a run."""
        return self.folder / f"{setting}-{number}"

    def measured(self, setting: Setting, number: int) -> Measured:
        """The run, which is made now unless it exists already."""
        known = self.known(setting, number)
        if known is not None:
            return known
        if not self._warm:
            self.first_step, self._warm = self._first_step(setting), True
        made = self._make(setting, number)
        if made.compile_seconds > COMPILED * made.cpu_seconds:
            self.tell(f"compiled for {made.compile_seconds:.1f} CPU s, made again")
            made = self._make(setting, number)
        return made

    def known(self, setting: Setting, number: int) -> Measured | None:
        """A finished run of this setting by this version of the program; None without."""
        path = self._figures(setting.id, number)
        if not path.exists():
            return None
        stored = json.loads(path.read_text(encoding="utf-8"))
        # of an older program, or crashed: memory, a full disk, a mistake that may be mended
        if stored.keys() != Measured.__dataclass_fields__.keys() or stored["exit_code"] not in ENDED:
            return None
        found = Measured(**stored)
        changed = differences(found.program, self.program)
        if changed and not self.any_version:
            self.tell(
                f"{path.name}: made by another version ({changed[0]}), made again; --any-version keeps it"
            )
            return None
        return found

    def _first_step(self, setting: Setting) -> FirstStep:
        """One step of a setting in a process of its own: it compiles what the case needs, once for all runs."""
        place, case = self.folder / "first_step", load(self.plan.file.path, setting.overrides).case
        shutil.rmtree(place, ignore_errors=True)
        short = first_part(case, min(case.time.end, case.time.step_max))
        cost, compiling = self._process((*setting.overrides, *short), place)
        shutil.rmtree(place, ignore_errors=True)
        self.tell(f"first step: {cost.cpu_seconds:.1f} CPU s, {compiling:.1f} of them to compile")
        found = FirstStep(cost.cpu_seconds, compiling, cost.wall_seconds)
        write_json(self.folder / "first_step.json", asdict(found))
        return found

    def _known_first_step(self) -> FirstStep | None:
        """The first step measured before the study was stopped; None without one."""
        path = self.folder / "first_step.json"
        return FirstStep(**json.loads(path.read_text(encoding="utf-8"))) if path.exists() else None

    def _process(self, overrides: tuple[str, ...], place: Path) -> tuple[Cost, float]:
        """Run the case into a directory; returns its cost, and the CPU seconds in the compiler."""
        compiled = place.with_suffix(".compiled")
        compiled.unlink(missing_ok=True)
        sets = [word for override in overrides for word in ("--set", override)]
        command = ["run", str(self.plan.file.path), *sets, "--output", str(place)]
        cost = measure(
            [sys.executable, "-m", "coupler.commands.study_run", str(compiled), *command], log_of(place)
        )
        compiling = (
            json.loads(compiled.read_text(encoding="utf-8"))["compile_seconds"] if compiled.exists() else 0.0
        )
        compiled.unlink(missing_ok=True)
        return cost, compiling

    def _figures(self, setting: str, number: int) -> Path:
        return self.folder / f"{setting}-{number}.json"

    def _make(self, setting: Setting, number: int) -> Measured:
        place = self.place(setting.id, number)
        figures = self._figures(setting.id, number)
        figures.unlink(missing_ok=True)
        if place.exists():
            shutil.rmtree(place)  # of a study that was stopped, or of another version
        cost, compiling = self._process(setting.overrides, place)
        found = _measured(setting, number, place, cost, compiling, self.program)
        write_json(figures, asdict(found))
        return found


def log_of(place: Path) -> Path:
    """Path of the file with the output of the process of a run."""
    return place.with_suffix(".log")


def measure(command: list[str], log: Path) -> Cost:
    """Run a process to its end with its output in a file, and measure its cost."""
    began = time.perf_counter()
    with log.open("w", encoding="utf-8") as stream:
        child = subprocess.Popen(command, stdout=stream, stderr=subprocess.STDOUT, env=environment())
        try:
            _, status, used = os.wait4(child.pid, 0)
        except BaseException:
            child.terminate()
            child.wait()
            raise
    child.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - began
    return Cost(used.ru_utime + used.ru_stime, wall, used.ru_maxrss * 1024, child.returncode)


def _measured(
    setting: Setting, number: int, place: Path, cost: Cost, compiling: float, program: dict
) -> Measured:
    summary = read_summary(place) if (place / "run.json").exists() else {}
    changed = differences(summary.get("case", setting.case), setting.case)
    if changed:
        raise BadCase([f"{place}: the case was changed while the study ran ({changed[0]}); start it again"])
    figures = summary.get("figures", {})
    split = figures.get("cpu_seconds", {})
    inside, set_up = sum(split.values()), split.get("set-up", 0.0)
    return Measured(
        setting=setting.id,
        number=number,
        exit_code=cost.exit_code,
        reason=_reason(summary, cost, log_of(place)),
        cpu_seconds=max(inside - set_up - compiling, 0.0),
        set_up_seconds=set_up,
        start_seconds=max(cost.cpu_seconds - max(inside, compiling), 0.0),
        compile_seconds=compiling,
        wall_seconds=cost.wall_seconds,
        peak_memory=cost.peak_memory,
        steps=figures.get("steps", 0),
        substeps=figures.get("substeps", 0),
        passes=_passes(place),
        size=figures.get("size", {}),
        split=split,
        program=program,
    )


def _reason(summary: dict, cost: Cost, log: Path) -> str:
    """Why the run did not reach its end; empty when it did."""
    if cost.exit_code == ExitCode.DONE and summary.get("status") == "done":
        return ""
    if summary.get("exit_reason"):
        return summary["exit_reason"]
    return trouble(cost.exit_code, log.read_text(encoding="utf-8", errors="replace"))


def _passes(place: Path) -> float:
    """Mean pressure solves in a step; 0 without steps or water."""
    path = place / "history" / "coupling.csv"
    passes = read_history(path)["passes"] if path.exists() else np.zeros(0)
    return float(passes.mean()) if len(passes) else 0.0
