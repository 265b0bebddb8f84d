"""Checks of inflows and seas: their levels, waves and records, and the water that they meet at the start. Every check
yields (key path, message)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np

from coupler.case.case import Case
from coupler.case.inflow_records import RecordError, record_of
from coupler.case.types import KeyPath, Problem
from coupler.checks.inflow_volumes import depth_behind, opposite
from coupler.checks.records import STILL, record_remarks, step_at_start
from coupler.geometry.cell_sizes import edges_at, has_equal_cells, places_in_box
from coupler.geometry.stretches import axes_of
from coupler.geometry.tank_mesh import floor_along, mean_bed
from coupler.program.quantities import counted
from coupler.scene.build_water import (
    SLACK,
    fills_beside,
    follows_inside,
    keeps_discharge,
    level_at_start,
    sea_level,
)

HIGHEST_WAVE = 0.78
"""Height of a solitary wave over the depth beyond which it breaks."""

EARLY = 0.05
"""Share of its height that a solitary wave or an N-wave may have at the start without a remark."""

WHOLE_DEPTH = 0.9
"""Share of the depth of still water from which an inflow pushes all of it."""

LEAST_ACROSS = 3
"""Cells between a sea, or a side that absorbs, and the side opposite to it. With two, a sea before a tank that was
partly dry filled all of its width at once, and the volume was off by 3 % after some steps."""

RISES = 0.1
"""Share of a cell by which a stream may raise the level of a sea that absorbs, without a remark."""


def side_problems(case: Case) -> Iterator[Problem]:
    """Sides that are given twice, levels beside the tank, and sides that are too near to the opposite one."""
    taken = {side: "tank.open" for side in case.tank.open}
    for kind in ("inflow", "sea"):
        for i, spec in enumerate(getattr(case.water, kind)):
            path = ("water", kind, i)
            if spec.side in taken:
                yield (
                    (*path, "side"),
                    f"{spec.side} is given to {taken[spec.side]} already; take it out of one of them",
                )
            taken[spec.side] = f"water.{kind}[{i}]"
            wrong = list(_levels(case, path, spec))
            yield from wrong
            if kind == "inflow" and keeps_discharge(spec):
                yield from _discharge(path, spec)
            if wrong or not case.tank.is_box:
                continue
            if follows_inside(spec) or (kind == "sea" and not _stands_beside(case, spec)):
                yield from _across(case.tank, path, spec)


def _discharge(path: KeyPath, spec) -> Iterator[Problem]:
    """An inflow that keeps its discharge brings water, all of it."""
    if spec.absorbs:
        yield (
            (*path, "keeps"),
            '"discharge", but absorbs = true takes a part of the discharge back; leave one of them out',
        )
    if spec.velocity <= 0.0:
        yield (
            (*path, "keeps"),
            f'"discharge" is for water that enters, but velocity is {spec.velocity:g} m/s: take a positive velocity, '
            'or keeps = "level"',
        )


def _across(tank, path: KeyPath, spec) -> Iterator[Problem]:
    """A side that absorbs or keeps its discharge reads the water a cell inside, and a sea pushes water into dry cells
    beside it: the side opposite to them must not be the next but one."""
    axis = "xyz".index(spec.side[0])
    cells = _cells_across(tank, axis)
    if cells >= LEAST_ACROSS:
        return
    where = f"the side opposite to {spec.side} is only {counted(cells, 'cell')} away"
    wider = f"at least {LEAST_ACROSS} are needed; take a tank that is wider in {spec.side[0]}, or finer cells"
    if follows_inside(spec):
        key, value = ("keeps", '"discharge"') if keeps_discharge(spec) else ("absorbs", "true")
        reads = "the side reads the water a cell inside"
        yield (*path, key), f"{value}, but {where}: {reads}, and {wider}, or no {key}"
    else:
        yield (*path, "side"), f"{where}: the water of a sea would reach it at once, and {wider}"


def _cells_across(tank, axis: int) -> int:
    """The least number of cells from one side of a box to the opposite one."""
    if has_equal_cells(tank):
        return round((tank.upper[axis] - tank.lower[axis]) / tank.cell)
    walls = axes_of(tank)[axis]
    if len(walls) > LEAST_ACROSS:  # halved ones are more
        return len(walls) - 1
    count = 0.0
    for low, high in pairwise(walls):
        lower, upper = np.array(tank.lower), np.array(tank.upper)
        lower[axis], upper[axis] = low, high
        count += (high - low) / edges_at(tank, places_in_box(lower, upper))[:, axis].max()
    return round(count)


def _stands_beside(case: Case, sea) -> bool:
    """Whether one box of the initial water stands as high as a sea, but for a cell, along all of its side."""
    tank, along = case.tank, 1 - "xy".index(sea.side[0])
    level, slack = level_at_start(sea) - tank.cell, SLACK * tank.cell
    return any(
        fill.upper[2] >= level
        and fill.lower[2] <= tank.lower[2] + slack
        and fill.lower[along] <= tank.lower[along] + slack
        and fill.upper[along] >= tank.upper[along] - slack
        for fill in fills_beside(case, sea.side)
    )


def _levels(case: Case, path: KeyPath, spec) -> Iterator[Problem]:
    bed, top = floor_along(case.tank, spec.side), case.tank.upper[2]
    if _kind(spec) == "record":
        yield from _record(case, path, spec, bed, top)
        return
    if getattr(spec, "tide", None) is not None:
        yield from _tide(case, path, spec, bed, top)
        return
    if not bed < spec.level <= top:
        yield (
            (*path, "level"),
            f"z = {spec.level:g} m is not between the floor ({bed:g} m) and the top ({top:g} m)",
        )
    elif _kind(spec) == "bore" and spec.ahead is None and fills_beside(case, spec.side):
        yield (
            path,
            "ahead: missing, which means dry ground, but a [[water.fill]] reaches this side; write its level",
        )
    elif _kind(spec) == "bore" and spec.ahead is not None and not bed < spec.ahead < spec.level:
        yield (
            (*path, "ahead"),
            f"z = {spec.ahead:g} m must lie above the floor ({bed:g} m) and below the level behind ({spec.level:g} m); "
            "onto dry ground leave it out",
        )
    elif _kind(spec) in ("solitary", "n-wave") and spec.height > HIGHEST_WAVE * _depth(case, spec):
        yield (
            (*path, "height"),
            f"{spec.height:g} m breaks at once on a depth of {_depth(case, spec):.4g} m; "
            f"at most {HIGHEST_WAVE:g} of it",
        )
    elif _kind(spec) in ("solitary", "n-wave") and spec.level + spec.height > top:
        yield (
            (*path, "height"),
            f"its crest reaches z = {spec.level + spec.height:g} m, above the top of the tank ({top:g} m) and "
            f"of its sides: take tank.upper[2] = {np.ceil(spec.level + 1.5 * spec.height):g}, or a lower wave",
        )


def _record(case: Case, path: KeyPath, spec, bed: float, top: float) -> Iterator[Problem]:
    end = case.time.end
    try:
        found = record_of(spec)
    except RecordError as error:
        yield (*path, "path"), str(error)
        return
    time, level = found.time, found.level
    if spec.still is not None and spec.velocity == "given":
        yield (*path, "still"), 'is for velocity = "long-wave"; leave it out'
    if time[0] >= end or time[-1] < 0.0:
        yield (
            (*path, "path"),
            f"its times go from {time[0]:g} to {time[-1]:g} s, all {'after' if time[0] >= end else 'before'} the run "
            f"(0 to {end:g} s); move them by start",
        )
    axis = 1 - "xy".index(spec.side[0])
    low, high = case.tank.lower[axis], case.tank.upper[axis]
    if found.varies and (found.along[0] > high or found.along[-1] < low):
        yield (
            (*path, "path"),
            f"its places along the side go from {found.along[0]:g} to {found.along[-1]:g} m, all beside it "
            f"({low:g} to {high:g} m)",
        )
    if level.min() < bed:
        yield (
            (*path, "path"),
            f"its level falls to z = {level.min():g} m, below the floor of the tank ({bed:g} m)",
        )
    if level.max() > top:
        yield (
            (*path, "path"),
            f"its level rises to z = {level.max():g} m, above the top of the tank ({top:g} m)",
        )


def _tide(case: Case, path: KeyPath, sea, bed: float, top: float) -> Iterator[Problem]:
    """A tide that is neither a harmonic nor a table, and levels beside the tank."""
    tide, place = sea.tide, (*path, "tide")
    harmonic = [name for name in ("amplitude", "period") if getattr(tide, name) is not None]
    if (tide.path is None) != (len(harmonic) == 2) or (tide.path is not None and harmonic):
        yield place, "write amplitude and period, or path, a table of levels; not both"
        return
    try:
        level = sea_level(sea)
    except RecordError as error:
        yield (*place, "path"), str(error)
        return
    found = np.array([level(time) for time in np.linspace(0.0, case.time.end, 201)])
    if tide.path is not None and abs(level(0.0) - sea.level) > STILL * case.tank.cell:
        yield (
            (*path, "level"),
            f"z = {sea.level:g} m, but its tide begins at z = {level(0.0):g} m: write that level",
        )
    if found.min() <= bed or found.max() > top:
        yield (
            place,
            f"its level varies from z = {found.min():.4g} to {found.max():.4g} m in the run, which is not between the "
            f"floor ({bed:g} m) and the top ({top:g} m)",
        )


def _kind(spec) -> str:
    return getattr(spec, "kind", "sea")


def struck(case: Case) -> Iterator[Problem]:
    """Streams that set still water beside them in motion at once and have no room for the bore that this makes."""
    top = case.tank.upper[2]
    for i, spec in enumerate(case.water.inflow):
        bed = floor_along(case.tank, spec.side)
        still = max([fill.upper[2] for fill in fills_beside(case, spec.side)], default=bed) - bed
        if spec.kind != "steady" or still <= 0.0 or spec.level - bed < WHOLE_DEPTH * still:
            continue
        behind = depth_behind(still, spec.velocity, case.case.gravity)
        if bed + behind > top:
            yield (
                ("water", "inflow", i, "velocity"),
                f"{spec.velocity:g} m/s strike still water {still:g} m deep: as a bore it would rise to "
                f"z = {bed + behind:.3g} m at once, above the top of the tank ({top:g} m); take a lower velocity, less "
                'still water, a higher tank, or a velocity that grows with time (kind = "record")',
            )


def inflow_remarks(case: Case) -> Iterator[str]:
    """Streams that raise the level of a sea, waves that are under way at the start, waves without the still water that
    they run into, and records that end before the run."""
    yield from _streams_into_absorbing_seas(case)
    for spec in case.water.inflow if case.water and case.tank else ():
        if spec.kind in ("solitary", "n-wave") or getattr(spec, "ahead", None) is not None:
            yield from _still_water(case, spec)
        if spec.kind == "record":
            yield from record_remarks(case, spec)
        if spec.kind in ("solitary", "n-wave"):
            yield from _begun(spec, _depth(case, spec), case.case.gravity)
    for sea in case.water.sea if case.water and case.tank else ():
        yield from step_at_start(case, sea.side, "the sea stands", level_at_start(sea))


def _streams_into_absorbing_seas(case: Case) -> Iterator[str]:
    """Steady inflows opposite to a sea that absorbs. What runs out there counts as a wave into still water, with
    sqrt(g h) = sqrt(g h_sea) + u/2 (Stoker 1957, 10.2), so that the water stands higher than the sea for good."""
    if case.tank is None or case.water is None or not case.tank.is_box:
        return
    gravity = case.case.gravity
    for spec in case.water.inflow:
        if spec.kind != "steady" or spec.velocity <= 0.0 or spec.absorbs:
            continue
        for i, sea in enumerate(case.water.sea):
            if not sea.absorbs or sea.side != opposite(spec.side):
                continue
            still = _depth(case, sea)
            rise = _level_of_stream(still, spec.velocity * _depth(case, spec), gravity) - still
            if rise > RISES * case.tank.cell:
                beside = (
                    ""
                    if keeps_discharge(spec)
                    else f", and the water stands above its level at {spec.side}, which keeps it and so gives the "
                    'water energy; let the inflow follow the water with keeps = "discharge"'
                )
                yield (
                    f"the steady stream from {spec.side} leaves by the sea at {sea.side} as an outgoing wave into "
                    f"still water would, since water.sea[{i}].absorbs = true: the level there rises by about "
                    f"{rise:.2g} m above that of the sea and stays there (with absorbs = false it keeps its level)"
                    f"{beside}"
                )


def _level_of_stream(still: float, discharge: float, gravity: float) -> float:
    """Depth [m] at which a discharge per width [m²/s] is that of an outgoing wave into still water of a depth [m]."""
    low, high = still, still + discharge / math.sqrt(gravity * still)
    for _ in range(60):
        depth = 0.5 * (low + high)
        taken = 2.0 * (math.sqrt(gravity * depth) - math.sqrt(gravity * still)) * depth
        low, high = (depth, high) if taken < discharge else (low, depth)
    return high


def _still_water(case: Case, spec) -> Iterator[str]:
    wanted = level_at_start(spec)
    there = max([fill.upper[2] for fill in fills_beside(case, spec.side)], default=case.tank.lower[2])
    if abs(there - wanted) > STILL * case.tank.cell:
        yield (
            f"the {spec.kind.replace('solitary', 'solitary wave')} at {spec.side} runs into still water up to "
            f"z = {wanted:g} m, but [[water.fill]] reaches z = {there:g} m beside it: this step would collapse at once"
        )


def _depth(case: Case, spec) -> float:
    """Mean depth [m] of the still water along a side."""
    return spec.level - mean_bed(case.tank, spec.side, spec.level)


def _begun(spec, depth: float, gravity: float) -> Iterator[str]:
    """A wave of which more than EARLY is at its side when the run begins, and from which time on it is not."""
    name, key, shape, rate = _wave(spec, depth, gravity)
    share, low, high = shape(rate * getattr(spec, key)), 0.0, 1.0
    if share <= EARLY:
        return
    while shape(high) > EARLY:
        high *= 2.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if shape(middle) > EARLY else (low, middle)
    needed = math.ceil(100.0 * high / rate) / 100.0
    yield (
        f"the {name} at {spec.side} starts at {100 * share:.0f} % of its height: a jump that strikes; let its {key} "
        f"come at {needed:g} s or later, not at {getattr(spec, key):g} s"
    )


def _wave(spec, depth: float, gravity: float) -> tuple[str, str, Callable[[float], float], float]:
    """A wave in words, the key of its time, the largest share of its height up to a phase before that time, and the
    phase of a second: sech² of the first-order solitary wave, 3 sqrt(3)/2 sech² tanh of the N-wave."""
    if spec.kind == "solitary":
        rate = math.sqrt(0.75 * spec.height / depth**3) * math.sqrt(gravity * (depth + spec.height))
        return "solitary wave", "crest", lambda phase: 1.0 / math.cosh(min(phase, 100.0)) ** 2, rate
    rate = 1.5 * math.sqrt(math.sqrt(0.75) * spec.height / depth) * math.sqrt(gravity / depth)
    return "N-wave", "middle", _share_of_n_wave, rate


def _share_of_n_wave(phase: float) -> float:
    phase = min(max(phase, math.atanh(math.sqrt(1.0 / 3.0))), 100.0)
    return 1.5 * math.sqrt(3.0) * math.tanh(phase) / math.cosh(phase) ** 2
