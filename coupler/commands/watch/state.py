"""The present state of a run, read from its directory, as plain data for the page."""

from __future__ import annotations

import json
import time as clock
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from coupler.case.paths import BadPath
from coupler.commands.report.tables import LIMITS
from coupler.program.errors import NoRun
from coupler.program.process import was_killed
from coupler.program.quantities import quantity
from coupler.results.history import BadTable, read_history
from coupler.run.progress import PROGRESS
from coupler.run.summary import FILE_NAME, read_summary
from coupler.verdict.words import sentences

POINTS = 240
"""Of a curve on the page."""
MOST_CURVES = 8
SHOWN = (
    ("gauges", None),
    ("structure", ("joints_broken",)),
    ("water", ("volume_error",)),
    ("energy", ("energy_error",)),
    ("coupling", ("dt",)),
)
"""Tables and columns that are drawn, all of them where None."""
RUNS_BELOW = ("*", "runs/*", "*/runs/*")
"""Where runs are looked for under a folder: of a case, of a sweep, of a folder of cases."""


def runs_in(places: list[Path]) -> list[Path]:
    """Run directories: the places themselves, or those under them, the newest first under each."""
    found: dict[Path, None] = {}
    for place in places:
        if (place / FILE_NAME).is_file():
            found[place] = None
            continue
        below = {p.parent for pattern in RUNS_BELOW for p in place.glob(f"{pattern}/{FILE_NAME}")}
        for run in sorted(below, key=lambda p: (p / FILE_NAME).stat().st_mtime, reverse=True):
            found[run] = None
    return list(found)


@dataclass
class Watched:
    """One run; its data are kept until its files change."""

    path: Path
    _curves: dict[Path, tuple[tuple, list]] = field(default_factory=dict)

    def state(self) -> dict:
        """Everything that the page shows of the run; the reason if the run cannot be read."""
        try:
            summary = read_summary(self.path)
        except (NoRun, OSError) as error:
            return {
                "path": str(self.path),
                "title": self.path.name,
                "status": "unreadable",
                "reason": str(error),
            }
        progress = self._progress()
        end = float(summary["case"].get("time", {}).get("end", 0.0)) or None
        time = max(progress.get("time") or 0.0, summary["figures"].get("time") or 0.0)
        killed = was_killed(summary)
        running = summary["status"] == "running" and not killed
        return {
            "path": str(self.path),
            "title": summary["case"]["case"]["title"],
            "status": "killed" if killed else summary["status"].replace("_", " "),
            "running": running,
            "reason": _reason(self.path, summary, killed),
            "stopping": running and (self.path / "stop").exists(),
            "time": time,
            "end": end,
            "share": min(1.0, time / end) if end else None,
            "left": progress.get("left") if running else None,
            "left_between": progress.get("left_between") if running else None,
            "quiet": clock.time() - progress["written"] if running and "written" in progress else None,
            "figures": progress.get("figures", {}),
            "resumed": len(summary.get("resumed", [])),
            "cpu": quantity(summary.get("cpu_seconds"), "s"),
            "verdict": _verdict(summary, running),
            "limits": _limits(summary),
            "curves": self._all_curves(),
            "picture": self._picture(),
        }

    def _progress(self) -> dict:
        try:
            return json.loads((self.path / PROGRESS).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}

    def _all_curves(self) -> list[dict]:
        found: list[dict] = []
        for table, columns in SHOWN:
            found += self._of_table(self.path / "history" / f"{table}.csv", columns)
        return found[:MOST_CURVES]

    def _of_table(self, path: Path, columns) -> list[dict]:
        try:
            there = path.stat()
            stamp = (there.st_mtime_ns, there.st_size)
            if path not in self._curves or self._curves[path][0] != stamp:
                self._curves[path] = stamp, _read_curves(path, columns)
        except (OSError, BadTable, BadPath):
            return []
        return self._curves[path][1]

    def _picture(self) -> float | None:
        """When the newest picture was made; None without one."""
        path = self.newest_picture()
        return path.stat().st_mtime if path else None

    def newest_picture(self) -> Path | None:
        """Made for this page, or by `surgebreak render`."""
        made = [*self.path.glob("watch/still_*.png"), *self.path.glob("pictures/still_*.png")]
        return max(made, key=lambda p: p.stat().st_mtime) if made else None


def _reason(path: Path, summary: dict, killed: bool) -> str:
    if killed:
        return f"its process is gone; `surgebreak resume {path}` goes on from its newest checkpoint"
    return summary["exit_reason"] or ""


def _verdict(summary: dict, running: bool) -> dict | None:
    judged = summary["figures"].get("verdict")
    if not judged:
        return None
    first, *rest = sentences(judged)
    return {"state": judged["state"], "headline": ("so far: " if running else "") + first, "lines": rest}


def _limits(summary: dict) -> list[dict]:
    """Largest of each controlled quantity over its limit."""
    wanted, figures = summary["case"].get("limits", {}), summary["figures"]
    return [
        {"what": what, "share": figures[figure] / wanted[name], "key": f"limits.{name}"}
        for name, figure, what in LIMITS
        if wanted.get(name) and figure in figures
    ]


def _read_curves(path: Path, columns) -> list[dict]:
    """Curves of a table, thinned to POINTS."""
    table = read_history(path)
    time = table["time"]
    if len(time) < 2:
        return []
    keep = np.unique(np.linspace(0, len(time) - 1, POINTS).astype(int))
    chosen = [
        c for c in table.columns if c.name != "time" and c.unit and (columns is None or c.name in columns)
    ]
    return [
        {
            "name": c.name.replace("_", " "),
            "unit": "" if c.unit == "1" else c.unit,
            "x": _plain(time[keep]),
            "y": _plain(table[c.name][keep]),
        }
        for c in chosen
        if np.isfinite(table[c.name]).any()
    ]


def _plain(values) -> list[float | None]:
    """A value with six digits, which are enough for a curve; null where there is none."""
    return [float(f"{v:.6g}") if np.isfinite(v) else None for v in values]
