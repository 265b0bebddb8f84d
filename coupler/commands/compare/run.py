"""Runs all laws of a plan, each in a separate process, and keeps the files that they write."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

from coupler.commands.compare.outcome import Outcome
from coupler.commands.compare.own import TOO_LONG, Request
from coupler.commands.compare.plan import OwnLaw, Plan
from coupler.program.errors import SurgebreakError
from coupler.program.process import run_module, trouble
from yade_scripts.stock.scene import timed
from yade_scripts.stock.script import StockLaw, read_table, run_script


class LawFailed(SurgebreakError):
    """The process of one of our laws ended with an error, or the reference cannot run at its shortest substep."""


class Unstable(Exception):
    """The motion under a law would be unstable at a substep; the message is the reason."""


def run_plan(plan: Plan, folder: Path, tell: Callable[[str], None]) -> list[Outcome]:
    """Outcomes of all laws at all substeps, the reference first. Files go to folder/laws, of other substeps than the
    case's own to folder/substeps-N; the stock laws take blocks, joints and substep from the reference. Where
    the motion under a law of ours would be unstable, its run is left out, and that is told. Raises LawFailed."""
    found: list[Outcome] = []
    for multiple in plan.substeps:
        place = folder / ("laws" if multiple == 1 else f"substeps-{multiple}")
        place.mkdir()
        for law in plan.laws:
            try:
                outcome = (
                    _run_own(law, plan, multiple, place, folder / "scene.json" if not found else None)
                    if isinstance(law, OwnLaw)
                    else _run_stock(law, plan, multiple * found[0].figures["own_substep"], multiple, place)
                )
            except Unstable as error:
                if not found:
                    raise LawFailed(f"{law.name}: {multiple} x the substep: {error}") from error
                tell(f"{law.name}, {multiple} x the substep: left out, {error}")
                continue
            found.append(outcome)
            tell(
                f"{law.name}, {multiple} x the substep: largest force {outcome.peak_force:.5g} N, dissipated "
                f"{outcome.dissipated:.5g} J, {outcome.broken} joints broken, {outcome.cpu_seconds:.3g} CPU s"
            )
    return found


def _run_own(law: OwnLaw, plan: Plan, multiple: int, place: Path, scene: Path | None) -> Outcome:
    request = place / f"{law.stem}.request.json"
    Request(
        str(plan.file.path), law.overrides, multiple, plan.records, str(place), law.stem, str(scene or "")
    ).write(request)
    done = run_module("coupler.commands.compare.own", request, capture_output=True, text=True)
    if done.returncode != 0:
        raise LawFailed(f"{law.name}: {trouble(done.returncode, done.stderr)}")
    figures = json.loads((place / f"{law.stem}.json").read_text(encoding="utf-8"))
    if TOO_LONG in figures:
        raise Unstable(figures[TOO_LONG])
    return Outcome(law, multiple, read_table(place / f"{law.stem}.csv"), figures)


def _run_stock(law: StockLaw, plan: Plan, substep: float, multiple: int, place: Path) -> Outcome:
    scene = json.loads((place.parent / "scene.json").read_text(encoding="utf-8"))
    end = plan.file.case.time.end
    ran = run_script(law, timed(scene, law.variant, end, substep, plan.records), place)
    return Outcome(law, multiple, ran.table, ran.figures)
