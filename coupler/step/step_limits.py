"""Decides whether a step is taken again, and which of its attempts is kept, from the limits that a completed step
breaks.

A step is bad if the motion of the blocks differs too much from the one that the water assumed, if its momentum or
volume breaks the limit at which a run stops, or if its energy error alone exceeds a share of the limit for the whole
run: a falling wall once used up the whole limit in one step in which the motions differed by less than their own limit.
Errors that have built up over many steps, or grow as fast in a shorter step, are not cured by taking a shorter one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from coupler.step.limits import Diverged, Limits, check_balance, check_momentum

if TYPE_CHECKING:
    from coupler.step.record import StepRecord
    from coupler.step.sides import CoupledSides

STEP_SHARE = 0.25
"""Share of `limits.energy_error` that a single step may put out of balance."""
HELPS = 0.5 ** (1.0 / 3.0)
"""Share to which every halving must bring what the longest attempt broke, over the same time, so that three of them
bring it to a half: an error of the first order in the step falls to an eighth in them, one that the step has no part
in stays."""
A_PART = 0.01
"""Share of the energy [J] that a step puts out of balance from which a block's missing work is named as its place."""
ONE_PASS = "which had a single pass: raise coupling.passes"
"""Part of a message about a step with coupling.passes = 1."""


@dataclass(frozen=True)
class Attempt:
    """A step that has a solution.

    retries: times that it was halved · measures: what each limit looks at, energy and volume by the second, defect and
    momentum as shares of what moved · broken: names of those for which the step is bad · ends: whether the run ends
    with it.
    """

    retries: int
    measures: dict[str, float]
    broken: frozenset[str]
    ends: bool


def attempt_of(
    coupling: CoupledSides, record: StepRecord, limits: Limits | None, volume_before: float
) -> Attempt:
    """The step that was just taken; volume_before: error of the volume at its start. Without limits only the defect
    counts."""
    measures, broken = {"defect": record.defect}, set()
    if record.wetted and coupling.defects.too_large(record.defect):
        broken.add("defect")
    if limits is None:
        return Attempt(record.retries, measures, frozenset(broken), False)
    volume = volume_error(coupling)
    measures["volume"] = abs(volume - volume_before) / record.dt
    measures["energy"] = record.balance.step_error / record.dt
    measures["momentum"] = 0.0 if record.momentum is None else record.momentum.error
    kept = {
        "volume": abs(volume) <= limits.volume_error,
        "energy": record.balance.step_error <= STEP_SHARE * limits.energy_error,
        "momentum": measures["momentum"] <= limits.momentum_error,
    }
    broken.update(name for name, good in kept.items() if not good)
    return Attempt(record.retries, measures, frozenset(broken), _ends(coupling, record, limits))


def _ends(coupling: CoupledSides, record: StepRecord, limits: Limits) -> bool:
    try:
        check_step(coupling, record, limits)
    except Diverged:
        return True
    return False


def attempt_to_keep(attempts: list[Attempt]) -> Attempt:
    """Which of the bad attempts, longest first, is kept: the shortest if it is better in one of the limits that the
    longest breaks, or if only the longest ends the run; otherwise the longest."""
    longest, shortest = attempts[0], attempts[-1]
    share = HELPS ** (shortest.retries - longest.retries)
    helped = any(shortest.measures[name] < share * longest.measures[name] for name in longest.broken)
    return shortest if helped or (longest.ends and not shortest.ends) else longest


def volume_error(coupling: CoupledSides) -> float:
    """Relative error of the volume of the water; 0 without water."""
    return 0.0 if coupling.water is None else coupling.water.volume_error()


def check_step(coupling: CoupledSides, record: StepRecord, limits: Limits) -> None:
    """Raises Diverged with the limit that the step broke, or the run with it."""
    error = record.balance.energy_error
    check_balance(record.time, volume_error(coupling), error, limits, lambda: energy_advice(coupling, record))
    if record.momentum is not None:
        check_momentum(record.time, record.momentum.error, limits.momentum_error)


def energy_advice(coupling: CoupledSides, record: StepRecord) -> str:
    """Sentences for a run whose energy is out of balance: which side has most of it, where to look, what to try."""
    balance = record.balance
    gained = max(0.0, -balance.numerical_dissipation - balance.left)
    structure, between = abs(balance.structure_residual), abs(balance.interface_residual)
    if gained > max(structure, between):
        part = f"The water has gained {gained:.3g} J"
        remedy = "Take a smaller tank.cell where the water is thin, or reduce time.step_max or time.cfl."
    else:
        part = (
            f"The blocks with their joints and contacts are off by {structure:.3g} J"
            if structure >= between
            else f"The work that the water gave and that the blocks received differ by {between:.3g} J"
        )
        remedy = "Reduce time.step_max, or raise joints.damping."
    place = worst_place(coupling, record)
    said = [f"{part}, of {balance.input_energy:.3g} J put in."]
    said += [f"{place[0].upper()}{place[1:]}."] if place else []
    return " ".join([*said, remedy])


def worst_place(coupling: CoupledSides, record: StepRecord) -> str:
    """Where to look if the energy does not balance: the block with the largest missing work in the last step, where
    that is a part of the step's error, and the place where the water is fastest; "" if there is neither."""
    parts = []
    off = record.balance.step_error * record.balance.input_energy
    if len(record.missed_work) and abs(record.missed_work).max() > A_PART * off:
        worst = int(abs(record.missed_work).argmax())
        name = coupling.structure.names[worst]
        single = record.passes == 1 and coupling.defects.too_large(record.defect)
        parts.append(
            f"block '{name}' missed {abs(record.missed_work[worst]):.3g} J of the water's work in this step"
            + (f", {ONE_PASS}" if single else "")
        )
    if coupling.water is not None:
        speed, place = coupling.water.fastest_place()
        at = ", ".join(f"{x:.3g}" for x in place)
        parts.append(f"the water is fastest, {speed:.3g} m/s, at ({at}) m")
    return "; ".join(parts)
