"""Checks of the trapped air of a case: errors, and remarks."""

from __future__ import annotations

from collections.abc import Iterator

from coupler.case.case import Case
from coupler.case.types import KeyPath, Problem
from coupler.program.errors import did_you_mean

OF_POCKETS = ("gamma", "atmospheric", "smallest")
"""Keys of [water.air] that only pockets of trapped air have."""


def air_problems(case: Case, blocks: list[str]) -> Iterator[Problem]:
    """Everything about [water.air] and gauges of air; blocks: names of the blocks of the structure."""
    if case.water is None:
        return
    air, path = case.water.air, ("water", "air")
    trapped = air.model == "trapped"
    if not trapped and air.vent:
        yield (*path, "vent"), 'open air needs no orifices: write model = "trapped", or leave them out'
    if not trapped:
        for key in OF_POCKETS:
            if getattr(air, key) != type(air).model_fields[key].default:
                yield (
                    (*path, key),
                    'is for trapped air, of which open air has none: write model = "trapped", or leave it out',
                )
        for i, gauge in enumerate(case.gauge):
            if gauge.kind == "air":
                yield (
                    ("gauge", i, "kind"),
                    'an air gauge measures trapped air; write [water.air] model = "trapped"',
                )
        return
    if case.water.covers == "single" and (case.solid or case.structure is not None):
        yield (
            (*path, "model"),
            'trapped air needs walls that part it, also those thinner than two cells: write water.covers = "multiple"',
        )
    for i, vent in enumerate(air.vent):
        yield from _place((*path, "vent", i, "at"), vent.at, case)
        if vent.block is not None and vent.block not in blocks:
            hint = did_you_mean(vent.block, blocks)
            yield (*path, "vent", i, "block"), f"there is no block '{vent.block}'{hint}"


def _place(path: KeyPath, at, case: Case) -> Iterator[Problem]:
    if case.tank is None or not case.tank.is_box:
        return
    for axis, (x, low, high) in enumerate(zip(at, case.tank.lower, case.tank.upper)):
        if not low <= x <= high:
            yield (*path, axis), f"{'xyz'[axis]} = {x:g} m lies outside of the tank ({low:g} to {high:g} m)"
