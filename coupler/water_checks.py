"""What is wrong with the water of a case: walls, friction, inflows and seas. Every check yields (key path, message)."""

from __future__ import annotations

import math
from collections.abc import Iterator

from coupler.build_water import RecordError, fills_beside, level_at_start, record_columns
from coupler.case import Case
from coupler.tank_mesh import is_measured

KeyPath = tuple[str | int, ...]
Problem = tuple[KeyPath, str]

HIGHEST_WAVE = 0.78
"""Height of a solitary wave over the depth beyond which it breaks."""

EARLY = 0.05
"""Share of its height that a solitary wave may have at the start without a remark."""

STILL = 0.1
"""Share of a cell by which the still water may miss the level that a wave is made for, without a remark."""


def water_problems(case: Case) -> Iterator[Problem]:
    """Everything about [water] that needs more than one of its names."""
    if case.water is None:
        return
    w = case.water
    if case.case.gravity == 0.0:
        yield (
            ("case", "gravity"),
            "0: water needs a weight, by which its step, its spray and its pressure at the start go; give a small one, "
            "for instance 0.01 m/s2, or leave [water] out",
        )
    if not (w.fill or w.inflow or w.sea):
        yield (
            ("water",),
            "no water: write at least one [[water.fill]] with lower and upper, or an inflow or a sea",
        )
    yield from _walls(w)
    if case.tank is not None and is_measured(case.tank):
        yield from _sides(case)


def water_remarks(case: Case) -> Iterator[str]:
    """Waves that are under way at the start, and waves without the still water that they run into."""
    for spec in case.water.inflow if case.water and case.tank else ():
        if spec.kind in ("bore", "solitary"):
            yield from _still_water(case, spec)
        if spec.kind == "solitary":
            share = _share_at_start(spec, spec.level - case.tank.lower[2], case.case.gravity)
            if share > EARLY:
                yield (
                    f"the solitary wave at {spec.side} starts at {100 * share:.0f} % of its height: a jump that "
                    f"strikes; let its crest come later than {spec.crest:g} s"
                )


def _still_water(case: Case, spec) -> Iterator[str]:
    wanted = level_at_start(spec)
    there = max([fill.upper[2] for fill in fills_beside(case, spec.side)], default=case.tank.lower[2])
    if abs(there - wanted) > STILL * case.tank.cell:
        yield (
            f"the {'bore' if spec.kind == 'bore' else 'solitary wave'} at {spec.side} runs into still water up to "
            f"z = {wanted:g} m, but [[water.fill]] reaches z = {there:g} m beside it: that difference falls at once"
        )


def _share_at_start(spec, depth: float, gravity: float) -> float:
    """sech²(κ c t_crest), the first-order wave."""
    phase = math.sqrt(0.75 * spec.height / depth**3) * math.sqrt(gravity * (depth + spec.height)) * spec.crest
    return 1.0 / math.cosh(min(phase, 100.0)) ** 2


def _walls(w) -> Iterator[Problem]:
    if w.walls == "no-slip" and w.viscosity == 0.0:
        yield ("water", "walls"), "walls that hold the water need water.viscosity"
    laws = [name for name in ("roughness", "manning") if getattr(w, name) is not None]
    if w.walls == "friction" and len(laws) != 1:
        yield (
            ("water", "walls"),
            f"friction needs water.roughness or water.manning, one of them; there are {len(laws)}",
        )
    if w.walls != "friction" and laws:
        yield ("water", laws[0]), f'is for walls = "friction"; they are "{w.walls}"'


def _sides(case: Case) -> Iterator[Problem]:
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
            yield from _levels(case, path, spec)


def _levels(case: Case, path: KeyPath, spec) -> Iterator[Problem]:
    bed, top = case.tank.lower[2], case.tank.upper[2]
    if _kind(spec) == "record":
        yield from _record(path, spec, bed, top, case.time.end)
        return
    if not bed < spec.level <= top:
        yield (
            (*path, "level"),
            f"z = {spec.level:g} m is not between the floor ({bed:g} m) and the top ({top:g} m)",
        )
    elif _kind(spec) == "bore" and not bed < spec.ahead < spec.level:
        yield (
            (*path, "ahead"),
            f"z = {spec.ahead:g} m must lie above the floor ({bed:g} m) and below the level behind ({spec.level:g} m); "
            'over a dry bed write kind = "steady"',
        )
    elif _kind(spec) == "solitary" and spec.height > HIGHEST_WAVE * (spec.level - bed):
        yield (
            (*path, "height"),
            f"{spec.height:g} m breaks at once on a depth of {spec.level - bed:g} m; at most {HIGHEST_WAVE:g} of it",
        )


def _record(path: KeyPath, spec, bed: float, top: float, end: float) -> Iterator[Problem]:
    try:
        time, level, _ = record_columns(spec.path)
    except RecordError as error:
        yield (*path, "path"), str(error)
        return
    if time[0] >= end or time[-1] < 0.0:
        yield (
            (*path, "path"),
            f"its times go from {time[0]:g} to {time[-1]:g} s, all {'after' if time[0] >= end else 'before'} the run "
            f"(0 to {end:g} s); shift them",
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


def _kind(spec) -> str:
    return getattr(spec, "kind", "sea")
