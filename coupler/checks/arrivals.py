"""Waves that come after the end of the run, or do not reach the structure before it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coupler.case.case import Case
from coupler.checks.bores import bores, structure_of
from coupler.geometry.tank_mesh import floor_along


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


def _too_early(end: float, wave: str, body: str, arrival: float) -> str:
    return (
        f"the run ends at {end:g} s, before {wave} can reach '{body}', at t = {arrival:.3g} s or later: what stands "
        "then has not met it; raise time.end"
    )
