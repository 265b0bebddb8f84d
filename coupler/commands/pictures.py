"""Pictures for a report, made from files in separate processes, because VTK and YADE cannot share one."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from coupler.program import extras
from coupler.program.process import run_module

STILL = "800x450"
"""Size [pixels] of a film; a still has twice as many each way."""
LETTERS = "1.7"
"""Factor of the letter size, since two stills stand side by side on a printed page."""


def missing() -> str:
    """Why no pictures can be made here; empty where they can."""
    return extras.missing("view")


def stills(run: Path, folder: Path, times: Sequence[float]) -> str:
    """A still of each time [s] into folder; the reason if they could not be made, else empty."""
    at = [word for time in times for word in ("--time", repr(time))]
    words = ("--still", *at, "--size", STILL, "--letters", LETTERS, "--to", folder)
    return _view("coupler.commands.view", run, *words)


def plots(run: Path, folder: Path) -> str:
    """Figures of the histories and curves over data into folder; the reason if they could not be made."""
    return _view("coupler.commands.view", run, "--plots", "--for-page", "--to", folder)


def flood_map(run: Path, folder: Path, title: str) -> str:
    """The maps of a flood over terrain as flood_map.png into folder; the reason if they could not be drawn."""
    return _view("coupler.commands.view.flood_map", run, folder / "flood_map.png", title)


def study_figures(study: Path) -> str:
    """Error against run time beside study.json; the reason if they could not be drawn."""
    return _view("coupler.commands.view.study", study)


def run_figures(folder: Path) -> str:
    """The histories of several runs over one another, beside diff.json; the reason if they could not be drawn."""
    return _view("coupler.commands.view.over_one_another", folder)


def draw(module: str, folder: Path) -> None:
    """Figures of a comparison or a study beside its tables; where there are none, a line says why."""
    reason = missing() or figures(module, folder)
    if reason:
        print(f"no figures: {reason}")


def figures(module: str, *words: object, **options: Any) -> str:
    """Figures by a process that prints what it draws; the reason if they could not be drawn. options: of
    `run_module`."""
    return _why_not(module, run_module(module, *words, stderr=subprocess.PIPE, text=True, **options))


def _view(module: str, *words: object) -> str:
    return _why_not(module, run_module(module, *words, capture_output=True, text=True))


def _why_not(module: str, done: subprocess.CompletedProcess) -> str:
    """The last words of a process that failed; empty of another one."""
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"{module} ended with {done.returncode}"
