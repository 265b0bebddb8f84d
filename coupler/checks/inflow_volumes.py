"""Checks of the volume that inflows bring or take against the room of the tank.

The surface at the side of an inflow is given, and so is the velocity: neither yields to what stands in the tank. Water
that is thrown back, or that the tank lacks, makes a step of the surface at the side, down or up which it falls in every
time step. A side that absorbs, or a sea, takes what returns."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.case.types import Problem
from coupler.geometry.tank_mesh import bed_along, floor_along, room_beside, room_under, water_above
from coupler.scene.build_water import flow_of

SPRAY = 1.1
"""What an inflow may bring into a tank with an open top, over the room above its water: a tank of 2 m that filled by
0.5 m a second lost a tenth of that by its top before it stood full and broke the limit on the volume."""

LEFT_TO_RUN_ON = 0.25
"""Share of its still water that a wave may not fall below while the rest runs out by open sides. In a tank shorter
than deep the volume was off from 0.23 on by this count (4 % at 0.20): the water stood as a sheet of one cell
along the side of the wave, where the surface is given, and the rest of the tank was dry."""

BROUGHT_AT, LAYERS = 401, 8
"""Instants and layers of water at which what an inflow brings is summed up."""

WEIR = (2.0 / 3.0) ** 1.5
"""Discharge over an edge from water at rest, over sqrt(g d³) of its depth d over the edge: critical flow (Henderson,
Open Channel Flow, 1966, 2.5)."""

WAVES = ("solitary", "n-wave", "bore", "record")
"""Inflows whose surface belongs to a wave, which a wall throws back."""


def inflow_volume_problems(case: Case) -> Iterator[Problem]:
    """Inflows that the tank has no room or no water for."""
    yield from _filled_up(case)
    if not case.water.sea and not any(spec.absorbs for spec in case.water.inflow):
        for i, spec in enumerate(case.water.inflow):
            if spec.kind in WAVES:
                entered = _Entered.of(case, spec)
                yield from _over_its_crest(case, i, spec, entered)
                yield from _under_its_trough(case, i, spec, entered)
    yield from _run_out(case)


def _filled_up(case: Case) -> Iterator[Problem]:
    """Inflows into a tank that they fill before the end, although sides beside their way let out what a full tank
    presses over their edge, and only spray leaves by the top: their discharge is given."""
    tank = case.tank
    seas = [spec.side for spec in case.water.sea]
    room = room_beside(tank, case.water.fill)
    for i, spec in enumerate(case.water.inflow):
        ways = [side for side in (*tank.open, *seas) if side[0] in "xy"]
        if spec.absorbs or "z-" in tank.open or opposite(spec.side) in ways:
            continue
        entered = _Entered.of(case, spec)
        rate = sum(_over_the_edge(case, side, max(tank.upper[2], entered.highest)) for side in ways)
        share = SPRAY if "z+" in tank.open else 1.0
        held = entered.volume - rate * entered.time
        if float(held.max()) > share * room:
            exits = [*(["its open top"] if "z+" in tank.open else []), *ways]
            way_out = f"no way out but {' and '.join(exits)}" if exits else "no way out"
            taken = f" ({' and '.join(ways)} let out at most {rate:.3g} m3/s)" if ways else ""
            yield (
                ("water", "inflow", i),
                f"brings {entered.largest:.3g} m3 until the end of the run ({case.time.end:g} s) into a tank that has "
                f"room for {room:.3g} m3 and {way_out}{taken}: name open sides (tank.open), let it take back what "
                "returns (absorbs = true), or end before the tank is full",
            )


def _over_its_crest(case: Case, i: int, spec, entered: _Entered) -> Iterator[Problem]:
    """A wave into a tank that it fills to above its own crest, or to above the bore that the far side throws back,
    although open sides beside its way let out what runs over an edge: the surface at its side is given, and the water
    of the tank would fall into the trough there."""
    tank = case.tank
    if opposite(spec.side) in tank.open or (spec.kind == "bore" and spec.ahead is None):
        return
    highest, name = entered.highest, "what the far side throws back"
    if spec.kind == "bore":
        bed = floor_along(tank, spec.side)
        speed = bore_speed(spec.ahead - bed, spec.level - bed, case.case.gravity)
        highest = bed + depth_behind(spec.level - bed, speed, case.case.gravity)
    elif spec.kind != "record":
        highest, name = spec.level + abs(spec.height), "the crest"
    highest = min(highest, tank.upper[2])
    ways = [side for side in tank.open if side[0] in "xy"]
    rate = sum(_over_the_edge(case, side, highest) for side in ways)
    brought, room = (
        float((entered.volume - rate * entered.time).max()),
        room_under(tank, case.water.fill, highest),
    )
    if room < 0.0 and spec.kind != "bore":
        stands = max(fill.upper[2] for fill in case.water.fill)
        yield (
            ("water", "inflow", i),
            f"comes in with {name} at z = {highest:.3g} m, but the water of the tank stands above that from the start "
            f"(water.fill up to z = {stands:g} m): it would fall into the wave; give both the same still water"
            + (f" (level = {spec.level:g} m)" if spec.kind != "record" else ""),
        )
    elif brought > room:
        way_out = (
            f"more than {' and '.join(ways)} can let out" if ways else "without another side to leave by"
        )
        yield (
            ("water", "inflow", i),
            f"brings {brought:.3g} m3 until the end of the run ({case.time.end:g} s) into a tank {way_out}, which "
            f"has room for {room:.3g} m3 under {name} (z = {highest:.3g} m): the water would stand above the "
            f"surface that is given at {spec.side}; let it take back what returns (absorbs = true), name open "
            "sides or a sea, take a longer tank, or end earlier",
        )


def _under_its_trough(case: Case, i: int, spec, entered: _Entered) -> Iterator[Problem]:
    """A wave that draws the water of its tank down to below the trough that the far side throws back: the surface at
    its side is given, and would stand as a sheet above the water of the tank."""
    drawn, lowest = -float(entered.volume.min()), entered.lowest
    held = water_above(case.tank, case.water.fill, lowest)
    if case.water.fill and drawn > held:
        yield (
            ("water", "inflow", i),
            f"draws {drawn:.3g} m3 out of the tank until the end of the run ({case.time.end:g} s), which holds "
            f"{held:.3g} m3 above the trough that the far side throws back (z = {lowest:.3g} m): the surface that is "
            f"given at {spec.side} would stand above the water; let it follow what returns (absorbs = true), name a "
            "sea, take a longer tank, or end earlier",
        )


def _run_out(case: Case) -> Iterator[Problem]:
    """Waves on still water that has run out by open sides before the end: the surface at their side is given, and would
    stand alone in front of an empty tank.

    An open side lets out q = 8/27 sqrt(g d³) of a depth d over each metre of it (Ritter's wave behind a dam that is
    gone): the depth of a tank of area A with open sides of width B falls as d = d₀ (1 + 4/27 sqrt(g d₀) B t/A)⁻² within
    each of the intervals between which the wave brings or takes water. An N-wave that came with its crest first took
    its trough out of a tank whose water had run out meanwhile (3.7 % of the volume)."""
    tank = case.tank
    if not tank.is_box or case.water.sea:
        return
    size = np.subtract(tank.upper, tank.lower)
    area, open_sides = float(size[0] * size[1]), [side for side in tank.open if side[0] in "xy"]
    width = sum(float(size[1 - "xy".index(side[0])]) for side in open_sides)
    if width == 0.0:
        return
    for i, spec in enumerate(case.water.inflow):
        depth = spec.level - tank.lower[2] if spec.kind in ("solitary", "n-wave") else 0.0
        if depth <= 0.0 or spec.absorbs:
            continue
        times, depths = _depths_left(depth, _Entered.of(case, spec), area, width, case.case.gravity)
        if depths.min() < LEFT_TO_RUN_ON * depth:
            end, left = times[depths < LEFT_TO_RUN_ON * depth][0], depths.min()
            yield (
                ("water", "inflow", i),
                f"is a wave on still water {depth:.3g} m deep, which runs out by {' and '.join(open_sides)} "
                f"(tank.open): about {left:.3g} m are left before the end of the run ({case.time.end:g} s), while the "
                f"surface that is given at {spec.side} stands; give {open_sides[0]} to a sea of that level "
                f"(water.sea) or close it, or end before {end:.2g} s",
            )


def _depths_left(
    depth: float, entered: _Entered, area: float, width: float, gravity: float
) -> tuple[Array, Array]:
    """Times [s] and mean depths [m] of a tank of this area [m²] that begins with a depth [m] and runs out by open sides
    of this width [m], while a wave brings and takes water."""
    rate = 4.0 / 27.0 * math.sqrt(gravity) * width / area
    depths = [depth]
    for step, brought in zip(np.diff(entered.time), np.diff(entered.volume)):
        left = depths[-1] / (1.0 + rate * math.sqrt(depths[-1]) * step) ** 2
        depths.append(max(left + brought / area, 0.0))
    return entered.time, np.array(depths)


def bore_speed(ahead: float, behind: float, gravity: float) -> float:
    """Speed [m/s] of the water behind a bore between two depths [m] (Stoker 1957, 10.6)."""
    return (behind - ahead) * math.sqrt(0.5 * gravity * (ahead + behind) / (ahead * behind))


def depth_behind(ahead: float, speed: float, gravity: float) -> float:
    """Depth [m] behind the bore that a piston of this speed [m/s] pushes into still water of depth `ahead` [m]:
    u = (h₂ - h₁) sqrt(g (h₁ + h₂) / (2 h₁ h₂))    (Stoker 1957, 10.6)."""
    low, high = ahead, ahead + max(speed, 0.0) * math.sqrt(2.0 * ahead / gravity)
    for _ in range(60):
        middle = 0.5 * (low + high)
        reached = bore_speed(ahead, middle, gravity)
        low, high = (middle, high) if reached < speed else (low, middle)
    return high


@dataclass(frozen=True)
class _Entered:
    """time (t,) [s] from 0 to the end of the run · volume (t,) [m³] that an inflow has brought until then · highest,
    lowest level z [m] that a wall throws back of it until the end: behind a bore, or a wave of sinking level,
    sqrt(g h) = sqrt(g d) - u/2 (Stoker 1957, 10.6)"""

    time: Array
    volume: Array
    highest: float
    lowest: float

    @property
    def largest(self) -> float:
        """Largest volume [m³] that it has brought at any time."""
        return float(self.volume.max())

    @classmethod
    def of(cls, case: Case, spec) -> _Entered:
        """What an inflow of the case brings."""
        along, gravity = bed_along(case.tank, spec.side), case.case.gravity
        middle, bed = 0.5 * (along[1:] + along[:-1]).T
        axis, sign = "xyz".index(spec.side[0]), 1.0 if spec.side[1] == "-" else -1.0
        width, layer = np.diff(along[:, 0]), (np.arange(LAYERS) + 0.5) / LAYERS
        flow, rates, levels = flow_of(case, spec), [], []
        times = np.linspace(0.0, case.time.end, BROUGHT_AT)
        for time in times:
            places = np.zeros((len(middle), LAYERS, 3))
            places[:, :, axis] = (case.tank.lower if sign > 0.0 else case.tank.upper)[axis]
            places[:, :, 1 - axis] = middle[:, None]
            level = np.broadcast_to(flow.level_at(places[:, 0], time), middle.shape)
            depth = np.maximum(level - bed, 0.0)
            places[:, :, 2] = bed[:, None] + depth[:, None] * layer
            speed = sign * flow.velocity(places.reshape(-1, 3), time)[:, axis].reshape(len(middle), LAYERS)
            rates.append(float((width * depth * speed.mean(axis=1)).sum()))
            if (depth > 0.0).any():
                mean = float((width * depth).sum() / width[depth > 0.0].sum())
                behind = _thrown_back(mean, rates[-1] / float((width * depth).sum()), gravity)
                levels.append(float(level.max()) - mean + behind)
        steps = 0.5 * np.diff(times) * np.add(rates[1:], rates[:-1])
        highest, lowest = max(levels, default=-math.inf), min(levels, default=math.inf)
        return cls(times, np.append(0.0, np.cumsum(steps)), highest, lowest)


def _thrown_back(depth: float, speed: float, gravity: float) -> float:
    """Depth [m] before a wall that stops a stream of a depth [m] and a speed [m/s] towards it, or away from it."""
    if speed >= 0.0:
        return depth_behind(depth, speed, gravity)
    return max(math.sqrt(depth) + 0.5 * speed / math.sqrt(gravity), 0.0) ** 2


def opposite(side: str) -> str:
    """The side of the tank across from one: x- for x+."""
    return side[0] + ("+" if side[1] == "-" else "-")


def _over_the_edge(case: Case, side: str, level: float) -> float:
    """Discharge [m³/s] of an open side from water at rest at a level z [m]."""
    along = bed_along(case.tank, side)
    depth = np.maximum(level - 0.5 * (along[1:, 1] + along[:-1, 1]), 0.0)
    return WEIR * math.sqrt(case.case.gravity) * float((depth**1.5 * np.diff(along[:, 0])).sum())
