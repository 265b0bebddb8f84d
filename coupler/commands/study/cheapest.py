"""Tables of a study: the cheapest setting for an error, and the cost of parts of the program."""

from __future__ import annotations

from dataclasses import dataclass

from coupler.commands.study.plan import Plan, Rung
from coupler.commands.study.results import Outcome

LEVELS = (0.01, 0.05, 0.10)
"""Errors for which a setting is looked for."""


@dataclass(frozen=True)
class Cheapest:
    """The cheapest setting of a quantity with an error of at most `level`, among the ladders run across `curve` (empty:
    the others); rung None: no run comes that near."""

    quantity: str
    curve: str
    level: float
    rung: Rung | None
    error: float
    cpu_seconds: float


def cheapest(plan: Plan, found: dict[str, Outcome]) -> list[Cheapest]:
    """For every quantity, curve and level. A rung counts when all finer ones of its curve are as near: a coarse run may
    hit the answer by chance."""
    curves = list(dict.fromkeys(rung.curve for rung in plan.rungs))
    return [
        _cheapest(plan, found, q.name, curve, level)
        for q in plan.study.quantity
        for curve in curves
        for level in LEVELS
    ]


def _cheapest(plan: Plan, found: dict[str, Outcome], name: str, curve: str, level: float) -> Cheapest:
    near = [r for r in plan.rungs if r.curve == curve and _stays(plan, found, name, level, r)]
    if not near:
        return Cheapest(name, curve, level, None, float("nan"), float("nan"))
    best = min(near, key=lambda rung: found[rung.setting].run.cpu_seconds)
    outcome = found[best.setting]
    return Cheapest(name, curve, level, best, outcome.readings[name].error, outcome.run.cpu_seconds)


def _stays(plan: Plan, found: dict[str, Outcome], name: str, level: float, rung: Rung) -> bool:
    """Whether a rung and every finer one of its curve have an error within the level; runs without one (the finest, a
    failed one) do not count."""
    if not _error(found, name, rung) <= level:
        return False
    finer = [
        other
        for other in plan.rungs
        if (other.ladder, other.curve) == (rung.ladder, rung.curve)
        and None not in (other.size, rung.size)
        and other.size < rung.size
    ]
    return all(not _error(found, name, other) > level for other in finer)


def _error(found: dict[str, Outcome], name: str, rung: Rung) -> float:
    reading = found[rung.setting].readings.get(name)
    return float("nan") if reading is None else reading.error


@dataclass(frozen=True)
class Part:
    """Cost of a part of the program: CPU seconds and memory [bytes] of the case less those without it.

    reason: why there is no such number, when a run failed."""

    name: str
    cpu_seconds: float
    share: float
    memory: int
    reason: str


def parts(plan: Plan, found: dict[str, Outcome]) -> list[Part]:
    """One for each variant of [study.off]."""
    return [_part(name, found[plan.base], found[id]) for name, id in plan.off.items()]


def _part(name: str, whole: Outcome, without: Outcome) -> Part:
    reason = whole.run.reason or without.run.reason
    if reason:
        return Part(name, float("nan"), float("nan"), 0, reason)
    cost = whole.run.cpu_seconds - without.run.cpu_seconds
    memory = whole.run.peak_memory - without.run.peak_memory
    return Part(name, cost, cost / whole.run.cpu_seconds, memory, "")
