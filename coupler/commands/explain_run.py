"""`surgebreak explain RUN`: what a run computed, what it skipped, and an estimate of the cost of the skipped work.

The estimate is the processor time per unit of work (a wet cell, a body cut, a spring, a pass), measured in the same
run, times the number of units that were skipped. Units are means over the steps, from figures.work of run.json.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from coupler.program.process import was_killed
from coupler.run.summary import read_summary

NEEDS = {
    "water": ("fluid",),
    "structure": ("yade_scripts", "yade"),
    "pictures": ("matplotlib", "pyvista", "vtkmodules"),
}
"""Modules that are loaded for one part only."""


@dataclass(frozen=True)
class Skipped:
    """One kind of work: what was done and what was not (means over the steps), and the seconds that this would have
    cost, None where the run holds no measure of it.  unit: one of them."""

    what: str
    done: float
    skipped: float
    unit: str
    seconds: float | None
    parts: tuple[str, ...]
    """The parts of the processor time that contain this work."""

    @property
    def share(self) -> float:
        """Share of the work that was done in all possible work; 1 if there was none."""
        whole = self.done + self.skipped
        return self.done / whole if whole > 0.0 else 1.0

    @property
    def how_sure(self) -> str:
        """Joints are charged with all that the substeps cost, also with what does not grow with their number."""
        return "at most" if self.unit == "joint" else "about"


def skipped(summary: dict) -> list[Skipped]:
    """The work that the run with this summary (run.json) skipped; empty for runs without figures.work."""
    work = summary["figures"].get("work", {})
    found = _in_water(summary, work) if "cells" in work else []
    return found + (_in_structure(summary, work) if "blocks" in work else [])


def _in_water(summary: dict, work: dict) -> list[Skipped]:
    wet, cells = work["wet_cells"], work["cells"]
    assembly = ("water", "pressure")
    rows = [
        _row(summary, "cells without water", wet, cells - wet, "cell", assembly),
        _row(summary, "cells inside solids", wet, max(0.0, work["mesh_cells"] - cells), "cell", assembly),
    ]
    if work["bodies"]:
        cut = work["bodies_cut"]
        rows.append(
            _row(summary, "bodies not cut again", cut, work["bodies"] - cut, "body", ("cut", "carry over"))
        )
    if summary["modules"]["coupling"]:
        allowed = summary["case"].get("coupling", {}).get("passes", 1)
        again = max(0.0, allowed - work["passes"])
        rows.append(
            _row(summary, "passes not needed", work["passes"], again, "pass", ("pressure", "structure"))
        )
    return rows


def _in_structure(summary: dict, work: dict) -> list[Skipped]:
    """Joints and contacts share the time of the structure: a broken joint costs at most what a live spring does."""
    live, springs = work["live_joints"], work["live_joints"] + work["contacts"]
    held = work["blocks"] - work["loose_blocks"]
    each = _per_unit(summary, springs, ("structure",))
    gone = work["joints"] - live
    steps = summary["figures"]["steps"]
    seconds = None if each is None else each * gone * steps
    return [
        Skipped("broken joints", live, gone, "joint", seconds, ("structure",)),
        Skipped(
            "blocks outside the search for contacts",
            work["loose_blocks"],
            held,
            "block",
            None,
            ("structure",),
        ),
    ]


def _row(summary, what, done, left, unit, parts) -> Skipped:
    each = _per_unit(summary, done, parts)
    seconds = None if each is None else each * left * summary["figures"]["steps"]
    return Skipped(what, done, left, unit, seconds, parts)


def _per_unit(summary: dict, done: float, parts: tuple[str, ...]) -> float | None:
    """Seconds of a unit in a step; None where none was done."""
    units = done * summary["figures"]["steps"]
    return seconds_of(summary, parts) / units if units > 0.0 else None


def seconds_of(summary: dict, parts: tuple[str, ...]) -> float:
    """Processor seconds [s] booked to parts."""
    split = summary["figures"].get("cpu_seconds", {})
    return sum(split.get(name, 0.0) for name in parts)


def not_loaded(summary: dict) -> dict[str, tuple[str, ...]]:
    """Parts that were not loaded, with the packages that they would load; empty if the run did not record it."""
    loaded = summary["figures"].get("imports", {})
    return {
        part: names
        for part, names in NEEDS.items()
        if loaded and not any(loaded.get(name, False) for name in names)
    }


def shares(summary: dict) -> list[tuple[str, float, float]]:
    """(part, seconds [s], share) of the processor time, largest first."""
    split = summary["figures"].get("cpu_seconds", {})
    whole = sum(split.values())
    return [(name, s, s / whole if whole > 0.0 else 0.0) for name, s in split.items()]


# ---------------------------------------------------------------- in words


def explanation_of_run(place: Path) -> str:
    """What `surgebreak explain RUN` prints.  Raises NoRun."""
    summary = read_summary(place)
    return "\n".join([*_opening(place, summary), *_work(summary), *_modules(summary)])


def _opening(place: Path, summary: dict) -> list[str]:
    figures = summary["figures"]
    time = ", ".join(f"{name} {s:.3g} s ({share:.0%})" for name, s, share in shares(summary))
    status = "killed (its process is gone)" if was_killed(summary) else summary["status"]
    steps = f"{figures['steps']} steps" if "steps" in figures else "steps not counted"
    return [
        f"{place}: {summary['case']['case']['title']}: {status}, {steps}",
        f"processor time: {time or 'not booked'}",
    ]


def _work(summary: dict) -> list[str]:
    rows = [in_words(row, seconds_of(summary, row.parts)) for row in skipped(summary) if row.skipped > 0.0]
    if "work" not in summary["figures"]:
        return ["skipped in the steps: not known, the run has no counts (figures.work of run.json)"]
    if not rows:
        return ["skipped in the steps: nothing that was counted"]
    note = (
        "skipped in the steps (costs are estimates: what a unit cost in this run, times the units skipped):"
    )
    return [note, *(f"  {row}" for row in rows)]


def in_words(row: Skipped, paid: float) -> str:
    """One line: how much was skipped, how much was not, and what the skipped part would have cost."""
    line = f"{row.what}: {_count(row.skipped)} of {_count(row.skipped + row.done)} a step"
    if row.what == "cells inside solids":
        line = f"{row.what}: {_count(row.skipped)} a step"
    if row.seconds is None:
        return line + "; no estimate, the run holds no measure of one"
    names = " and ".join(row.parts)
    return line + f"; {row.how_sure} {row.seconds:.2g} s more, beside {paid:.2g} s that {names} took"


def _count(value: float) -> str:
    return f"{value:.0f}" if value == round(value) or value >= 100.0 else f"{value:.2g}"


def _modules(summary: dict) -> list[str]:
    off = [name for name, on in summary["modules"].items() if not on]
    lines = []
    for part, names in not_loaded(summary).items():
        lines.append(f"not loaded, so neither time nor memory: {part} ({', '.join(names)})")
    if off:
        lines.append(
            f"off in this case: {', '.join(off)}. What they would cost is not in this run: `surgebreak study` "
            "measures it, a run with and one without"
        )
    return lines
