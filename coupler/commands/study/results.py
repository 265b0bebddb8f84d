"""Errors of all runs of a study, each quantity relative to its one reference."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupler.case.study import Quantity
from coupler.commands.study.order import last_slope, slope, three_run_order
from coupler.commands.study.plan import Plan, Rung
from coupler.commands.study.reading import NotRecorded, curve, read
from coupler.commands.study.reference import Reading, against_curve, against_number, fixed_reference
from coupler.commands.study.runner import Measured, Runs
from coupler.program.errors import BadCase


@dataclass(frozen=True)
class Outcome:
    """One setting: its cheapest run, CPU seconds of all repeats, and what every quantity came to (empty: failed).

    same: whether all repeats gave the same numbers."""

    run: Measured
    repeats: tuple[float, ...]
    readings: dict[str, Reading]
    same: bool = True


@dataclass(frozen=True)
class Order:
    """Observed order of a quantity on one curve, from all its runs and from the finest ones, and the method."""

    quantity: str
    ladder: str
    curve: str
    overall: float
    finest: float
    how: str


def collect(plan: Plan, runs: Runs, repeat: int) -> dict[str, Outcome]:
    """Make all runs, cheapest settings first as the ladders list them, and read them. Raises BadCase.

    The names of columns and figures are known when the first run is done; a wrong one ends the study there.
    """
    found = {}
    needed = [setting for setting in plan.settings.values() if setting.id in plan.needed]
    for count, setting in enumerate(needed, start=1):
        made = [runs.measured(setting, number) for number in range(1, repeat + 1)]
        best = min(made, key=lambda m: (m.failed, m.cpu_seconds))
        readings = {} if best.failed else _readings(plan, runs, best)
        same = best.failed or all(_values(plan, runs, m) == _values(plan, runs, best) for m in made)
        found[setting.id] = Outcome(best, tuple(m.cpu_seconds for m in made), readings, same)
        what = best.reason or f"{best.steps} steps, {best.cpu_seconds:.3g} CPU s"
        what = "; ".join([what, *(f"{name}: {r.why}" for name, r in readings.items() if r.why)])
        runs.tell(f"{count}/{len(needed)}  {_named(plan, setting.id)}: {what}")
    return _against_finest(plan, found)


def _values(plan: Plan, runs: Runs, run: Measured) -> dict[str, float | None]:
    """Of every quantity of a run; None where there is none, which equals itself as NaN does not."""
    if run.failed:
        return {}
    return {
        name: None if np.isnan(reading.value) else reading.value
        for name, reading in _readings(plan, runs, run).items()
    }


def _named(plan: Plan, setting: str) -> str:
    rungs = [
        f"{r.ladder} {r.label}" + (f" ({r.curve})" if r.curve else "")
        for r in plan.rungs
        if r.setting == setting
    ]
    off = [f"without {name}" for name, id in plan.off.items() if id == setting]
    return ", ".join([*rungs, *off]) or "as it stands"


def _readings(plan: Plan, runs: Runs, run: Measured) -> dict[str, Reading]:
    """Every quantity of a run; those compared with the finest run have no error yet.

    A variant may lack the table or column of a quantity; elsewhere this is a mistake and is refused."""
    setting = plan.settings[run.setting]
    place = runs.place(run.setting, run.number)
    optional = run.setting in plan.off.values() and all(r.setting != run.setting for r in plan.rungs)
    found = {}
    for i, q in enumerate(plan.study.quantity):
        try:
            found[q.name] = _reading(q, place, setting.case, f"{plan.file.path}: study.quantity[{i}]")
        except NotRecorded as error:
            found[q.name] = Reading(np.nan, np.nan, np.nan, why=str(error))
        except BadCase:
            if not optional:
                raise
    return found


def _reading(q: Quantity, run, case: dict, place: str) -> Reading:
    if q.take == "curve":
        return against_curve(q, curve(run, q, place))
    value = read(run, q, place)
    if q.against == "finest":
        return Reading(value, float("nan"), float("nan"))
    return against_number(q, value, fixed_reference(q, case), place)


def finest(plan: Plan, q: Quantity) -> Rung | None:
    """The rung whose run is the reference: the last of its ladder; None where that ladder is not run."""
    name = q.ladder or next(ladder.name for ladder in plan.study.ladder if ladder.key)
    own = [rung for rung in plan.rungs if rung.ladder == name]
    return own[-1] if own else None


def _against_finest(plan: Plan, found: dict[str, Outcome]) -> dict[str, Outcome]:
    """Errors against the finest run; without them where it failed or was not asked for, never against another."""
    for i, q in enumerate(plan.study.quantity):
        rung = finest(plan, q) if q.against == "finest" else None
        if rung is None or q.name not in found[rung.setting].readings:
            continue
        finest_one = found[rung.setting].readings[q.name]
        place = f"{plan.file.path}: study.quantity[{i}]"
        for id, outcome in found.items():
            if id != rung.setting and q.name in outcome.readings:
                own = _against(q, outcome.readings[q.name], finest_one, place)
                found[id] = replace(outcome, readings=outcome.readings | {q.name: own})
    return found


def _against(q: Quantity, own: Reading, finest_one: Reading, place: str) -> Reading:
    """The reading of a run with its error against that of the finest run; without an error where one has no value."""
    if own.why:
        return own
    if finest_one.why:
        return replace(own, why=f"the finest run has no value: {finest_one.why}")
    return against_number(q, own.value, finest_one.value, place)


def orders(plan: Plan, found: dict[str, Outcome]) -> list[Order]:
    """Observed orders of every quantity on every curve whose runs have sizes."""
    curves = list(dict.fromkeys((rung.ladder, rung.curve) for rung in plan.rungs))
    observed = []
    for q in plan.study.quantity:
        for ladder, name in curves:
            rungs = [r for r in plan.rungs if (r.ladder, r.curve) == (ladder, name) and r.size is not None]
            rungs = [r for r in rungs if q.name in found[r.setting].readings]
            if len({r.size for r in rungs}) > 1:
                observed.append(_order(q, ladder, name, rungs, found))
    return observed


def _order(q: Quantity, ladder: str, name: str, rungs: list[Rung], found: dict[str, Outcome]) -> Order:
    sizes = [r.size for r in rungs]
    readings = [found[r.setting].readings[q.name] for r in rungs]
    if q.against == "exact":
        errors = [reading.error for reading in readings]
        return Order(
            q.name,
            ladder,
            name,
            slope(sizes, errors),
            last_slope(sizes, errors),
            "errors against the exact answer",
        )
    if q.take == "curve":
        return Order(q.name, ladder, name, np.nan, np.nan, "none: a distance from a measurement has no limit")
    values = [reading.value for reading in readings]
    return Order(
        q.name, ladder, name, np.nan, three_run_order(sizes, values), "differences of the three finest runs"
    )
