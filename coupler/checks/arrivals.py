"""Waves that come after the end of the run, do not reach the structure before it, or come back to their side."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.water import BoreInflow
from coupler.checks.bores import Bore, against_wall, at_side, bores, structure_of
from coupler.geometry.tank_mesh import floor_along
from coupler.geometry.terrain.bed_mesh import fitted_of

BLOCKS = 0.25
"""Share of the width of the tank from which a structure, or ground above the water, sends a bore back that is worth a
remark."""


def arrival_remarks(case: Case) -> Iterator[str]:
    """Solitary waves and N-waves by the time at their side and the speed of long waves over the deepest bed there, so
    that they come later rather than earlier; bores by theory on level ground, and over an uneven bed by the speed that
    their front has at their side."""
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
    if not case.tank.is_box:
        for spec in case.water.inflow:
            if spec.kind == "bore":
                yield from _over_uneven_bed(case, spec, found, end)
    for bore in bores(case):
        if bore.depth_there > 0.0 and bore.arrival > end:
            yield _too_early(end, f"the bore from {bore.side}", bore.at, bore.arrival)
        else:
            yield from _comes_back(case, bore, end)


def _comes_back(case: Case, bore: Bore, end: float) -> Iterator[str]:
    """A bore on level ground that the structure, or the step that it stands on, sends back to its side."""
    (spec,) = [s for s in case.water.inflow if s.side == bore.side]
    _, low, high = structure_of(case)
    if bore.step == 0.0 and _share(case, bore.side, low, high) < BLOCKS:
        return
    what = f"the step before {bore.at}" if bore.step > 0.0 else _quoted(bore.at)
    yield from _reflected(case, spec, what, bore.arrival, end)


def _over_uneven_bed(case: Case, spec: BoreInflow, found, end: float) -> Iterator[str]:
    """A bore over a terrain or a mesh from a file: what stops it first is the structure, or ground above its level. (A
    closed end of the tank is filled by then, which is refused.)"""
    axis, inward = "xyz".index(spec.side[0]), spec.side[1] == "-"
    front, stops = at_side(case, spec)[2], list(_rising_ground(case, spec))
    if found is not None:
        body, low, high = found
        way = float(low[axis] - case.tank.lower[axis] if inward else case.tank.upper[axis] - high[axis])
        if max(way, 0.0) / front > end:
            yield _too_early(end, f"the bore from {spec.side}", body, way / front)
        if _share(case, spec.side, low, high) >= BLOCKS:
            stops.append((max(way, 0.0), _quoted(body)))
    if stops:
        way, what = min(stops)
        yield from _reflected(case, spec, what, way / front, end)


def _rising_ground(case: Case, spec: BoreInflow) -> Iterator[tuple[float, str]]:
    """How far from its side [m] ground above the level of a bore first takes the way of a share of it."""
    if case.tank.ground is None:
        return
    fitted, axis = fitted_of(case.tank), "xyz".index(spec.side[0])
    bed = np.nan_to_num(fitted.bed if axis == 0 else fitted.bed.T, nan=np.inf)
    places = (fitted.column_x, fitted.column_y)[axis]
    if spec.side[1] == "+":
        bed, places = bed[::-1], places[::-1]
    enters = bed[0] < spec.level
    stopped = np.maximum.accumulate(bed[:, enters], axis=0) >= spec.level
    enough = np.flatnonzero(stopped.mean(axis=1) >= BLOCKS)
    if len(enough):
        yield abs(float(places[enough[0]] - places[0])), "the rising ground"


def _share(case: Case, side: str, low, high) -> float:
    """Share of the width of the tank that a box takes, seen from a side."""
    across = 1 - "xy".index(side[0])
    return float((high[across] - low[across]) / (case.tank.upper[across] - case.tank.lower[across]))


def _reflected(case: Case, spec: BoreInflow, what: str, arrival: float, end: float) -> Iterator[str]:
    """A bore that comes back to a side that reflects it once more. It runs back at u h/(h_w - h) where all is stopped,
    with h_w the depth at the wall, else slower."""
    if spec.absorbs:
        return
    depth, velocity, front = at_side(case, spec)
    back = velocity * depth / (against_wall(depth, velocity, case.case.gravity) - depth)
    there = arrival * (1.0 + front / back)
    if there < end:
        yield (
            f"what {what} sends back of the bore from {spec.side} may be at {spec.side} again from t = "
            f"{there:.3g} s on, and the run ends at {end:g} s: this side holds level and velocity, so that it reflects "
            "what comes back, as no sea does; absorbs = true of its inflow lets it leave, or take a longer tank"
        )


def _quoted(body: str) -> str:
    """The name of a part in quotes, or the structure as a whole."""
    return body if body == "the structure" else f"'{body}'"


def _too_early(end: float, wave: str, body: str, arrival: float) -> str:
    return (
        f"the run ends at {end:g} s, before {wave} can reach {_quoted(body)}, at t = {arrival:.3g} s or later: what "
        "stands then has not met it; raise time.end"
    )
