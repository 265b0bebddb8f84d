"""Waves that come after the end of the run, do not reach the structure before it, or come back to their side."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coupler.case.case import Case
from coupler.checks.bores import Bore, against_wall, bores, structure_of
from coupler.geometry.tank_mesh import floor_along

BLOCKS = 0.25
"""Share of the width of the tank from which a structure sends a bore back that is worth a remark."""


def arrival_remarks(case: Case) -> Iterator[str]:
    """Solitary waves and N-waves by the time at their side and the speed of long waves over the deepest bed there, so
    that they come later rather than earlier; bores by theory, on level ground alone."""
    if case.water is None or case.tank is None:
        return
    found, end = structure_of(case), case.time.end
    for spec in case.water.inflow:
        if spec.kind not in ("solitary", "n-wave"):
            continue
        name, key = ("solitary wave", "crest") if spec.kind == "solitary" else ("N-wave", "middle")
        at = getattr(spec, key)
        if at >= end:
            yield (
                f"the {key} of the {name} passes {spec.side} at t = {at:g} s, and the run ends at {end:g} s: most of "
                f"it never comes in; raise time.end, or let its {key} come earlier"
            )
        elif found is not None:
            body, low, high = found
            axis, inward = "xyz".index(spec.side[0]), spec.side[1] == "-"
            way = low[axis] - case.tank.lower[axis] if inward else case.tank.upper[axis] - high[axis]
            depth = spec.level + spec.height - floor_along(case.tank, spec.side)
            there = at + max(float(way), 0.0) / math.sqrt(case.case.gravity * depth)
            if there > end:
                yield _too_early(end, f"the {key} of the {name} from {spec.side}", body, there)
    for bore in bores(case):
        if bore.depth_there > 0.0 and bore.arrival > end:
            yield _too_early(end, f"the bore from {bore.side}", bore.at, bore.arrival)
        else:
            yield from _comes_back(case, bore, end)


def _comes_back(case: Case, bore: Bore, end: float) -> Iterator[str]:
    """A bore that the structure, or the step that it stands on, sends back to a side that reflects it once more. It
    runs back at u h/(h_w - h) where all is stopped, with h_w the depth at the wall, else slower."""
    (spec,) = [s for s in case.water.inflow if s.side == bore.side]
    if spec.absorbs:
        return
    across = 1 - "xy".index(bore.side[0])
    _, low, high = structure_of(case)
    share = (high[across] - low[across]) / (case.tank.upper[across] - case.tank.lower[across])
    if bore.step == 0.0 and share < BLOCKS:
        return
    at_wall = against_wall(bore.depth, bore.velocity, case.case.gravity)
    back = bore.velocity * bore.depth / (at_wall - bore.depth)
    there = bore.arrival * (1.0 + bore.front / back)
    if there < end:
        what = f"the step before {bore.at}" if bore.step > 0.0 else f"'{bore.at}'"
        yield (
            f"what {what} sends back of the bore from {bore.side} may be at {bore.side} again from t = "
            f"{there:.3g} s on, and the run ends at {end:g} s: this side holds level and velocity, so that it reflects "
            "what comes back, as no sea does; absorbs = true of its inflow lets it leave, or take a longer tank"
        )


def _too_early(end: float, wave: str, body: str, arrival: float) -> str:
    return (
        f"the run ends at {end:g} s, before {wave} can reach '{body}', at t = {arrival:.3g} s or later: what stands "
        "then has not met it; raise time.end"
    )
