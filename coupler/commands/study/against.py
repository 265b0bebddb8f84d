"""`surgebreak study compare A B`: the results that are worse in study B than in study A of the same case."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

from coupler.program.errors import BadCase, ExitCode
from coupler.program.quantities import counted

NEGLIGIBLE = 1e-9
"""Errors below this are round-off; they do not get worse."""


@dataclass(frozen=True)
class Worse:
    """One value that got worse: its name, the value before and now, and the largest ratio allowed; reason: why there is
    no value now."""

    what: str
    before: float
    now: float
    limit: float
    reason: str = ""

    def __str__(self) -> str:
        if self.reason:
            return f"{self.what}: {self.reason}"
        ratio = self.now / self.before
        return f"{self.what}: {self.before:.4g} -> {self.now:.4g}, {ratio:.3g} times; limit {self.limit:g}"


def compare(first: Path, second: Path, error: float, cpu: float) -> ExitCode:
    """Print what got worse; exits with DIVERGED if anything did. Raises BadCase for studies that do not compare."""
    before, now = read_study(first), read_study(second)
    refuse(before, now)
    if before["machine"]["processor"] != now["machine"]["processor"]:
        print(
            f"note: other processors, CPU times are not like for like: {before['machine']['processor']}, "
            f"{now['machine']['processor']}"
        )
    found = worse(before, now, error, cpu)
    for line in found:
        print(f"WORSE  {line}")
    common = len(_points(before).keys() & _points(now).keys())
    print(
        f"{counted(common, 'run')} compared, {counted(len(found), 'figure')} worse (error x {error:g}, CPU x {cpu:g})"
    )
    return ExitCode.DIVERGED if found else ExitCode.DONE


def read_study(folder: Path) -> dict:
    """The content of study.json. Raises BadCase."""
    path = folder / "study.json" if folder.is_dir() else folder
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BadCase([f"{path}: not the result of a study: {error}"]) from error


def refuse(before: dict, now: dict) -> None:
    """Raise BadCase where a quantity has references of two kinds, and where the studies have nothing in common."""
    kinds = [{q["name"]: (q["against"], q["finest"]) for q in study["quantities"]} for study in (before, now)]
    wrong = [
        f"{name}: errors against {kinds[0][name][0]} and against {kinds[1][name][0]}"
        + (" (other finest runs)" if kinds[0][name][0] == kinds[1][name][0] else "")
        + " do not compare"
        for name in kinds[0]
        if name in kinds[1] and kinds[0][name] != kinds[1][name]
    ]
    if not _points(before).keys() & _points(now).keys():
        wrong.append("the two studies have no run in common: are they of the same case?")
    if wrong:
        raise BadCase(wrong)


def worse(before: dict, now: dict, error: float, cpu: float) -> list[Worse]:
    """Everything that grew by more than its limit, and runs and errors that are not there now."""
    then, found = _points(before), []
    for name, point in _points(now).items():
        if name not in then or then[name]["reason"]:
            continue
        what = " ".join(part for part in name if part)
        if point["reason"]:
            found.append(Worse(what, 0.0, 0.0, 0.0, f"fails now: {point['reason']}"))
            continue
        if point["cpu_seconds"] > cpu * then[name]["cpu_seconds"]:
            found.append(Worse(f"{what}: CPU s", then[name]["cpu_seconds"], point["cpu_seconds"], cpu))
        found += _errors(what, then[name]["readings"], point["readings"], error)
    return found


def _errors(what: str, before: dict, now: dict, limit: float):
    for name in (name for name in before if name in now):
        old, new = before[name]["error"], now[name]["error"]
        if old is None or not math.isfinite(old):
            continue
        if new is None or not math.isfinite(new):
            why = now[name].get("why")
            yield Worse(
                f"{what}: error of {name}", old, math.nan, 0.0, f"none now{f': {why}' if why else ''}"
            )
        elif new > limit * max(old, NEGLIGIBLE):
            yield Worse(f"{what}: error of {name}", max(old, NEGLIGIBLE), new, limit)


def _points(study: dict) -> dict[tuple[str, str, str], dict]:
    return {(p["ladder"], p["curve"], p["label"]): p for p in study["points"]}
