"""The water of a random scene: its initial fills, its inflows, and its wall conditions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from coupler.commands.stress.drawn.basin import SIDES, Basin
from coupler.commands.stress.drawn.dice import Dice, rounded

SHALLOWEST = 3.0
"""Depth in cells of the shallowest water that is drawn; `check` reports shallower water as not resolved."""


@dataclass
class Stream:
    """level [m]: highest water at the start, above the floor of the tank · fastest [m/s]: estimated largest speed ·
    still: it should stay at rest as long as no block moves it · table: [water] · files by name"""

    level: float
    fastest: float
    still: bool
    table: dict
    files: dict[str, object] = field(default_factory=dict)


def stream(dice: Dice, place: Basin, gravity: float) -> Stream:
    """Water in a basin; names the sides of its tank that are open."""
    table: dict = {}
    if dice.chance(0.2):
        table["density"] = dice.decades(800.0, 1100.0)
    found = Stream(0.0, 0.0, False, table)
    _fills(dice, place, found)
    speed = math.sqrt(2.0 * gravity * max(found.level, place.cell))
    found.fastest = speed
    _sides(dice, place, found, gravity)
    _walls(dice, place, found, speed)
    if dice.chance(0.15):
        table["theta"] = rounded(dice.between(0.5, 1.0), 3)
    if dice.chance(0.05):
        table["advection"] = "supg"
    if dice.chance(0.3):
        table["covers"] = "multiple"
        if dice.chance(0.3):
            table["openings"] = "wide"
    return found


def _box(place: Basin, low, high) -> dict:
    """A box of water by shares of the tank."""
    corners = [place.lower + np.multiply(share, place.size) for share in (low, high)]
    lower, upper = ([rounded(x, 8) for x in corner] for corner in corners)
    ends = place.lower.tolist(), place.upper.tolist()
    for axis in range(3):  # the ends exactly, which rounding would miss
        lower[axis] = ends[0][axis] if low[axis] == 0.0 else lower[axis]
        upper[axis] = ends[1][axis] if high[axis] == 1.0 else upper[axis]
    return {"lower": lower, "upper": upper}


def _fills(dice: Dice, place: Basin, found: Stream) -> None:
    """Still water, a dam, a drop, or a dam beside still water."""
    high = float(place.size[2])
    low = 0.0 if place.bed is None else float(place.bed[2].max())
    thin = SHALLOWEST * place.cell / high
    level = max(thin, dice.between(0.2, 0.7))
    kind = dice.one({"still": 3, "dam": 4, "dam into water": 3, "drop": 1, "drop into water": 1, "brim": 0.5})
    fills = []
    if kind == "brim":
        level = 1.0
    if kind in ("still", "brim"):
        fills.append(_box(place, (0, 0, 0), (1, 1, level)))
    if kind in ("dam", "dam into water"):
        axis = 0 if place.size[0] > place.size[1] else 1
        ends = [1.0, 1.0, min(0.95, max(level, low / high + thin))]
        ends[axis] = max(dice.between(0.15, 0.6), SHALLOWEST * place.cell / float(place.size[axis]))
        level = ends[2]
        fills.append(_box(place, (0, 0, 0), ends))
    if kind == "dam into water":
        fills.append(_box(place, (0, 0, 0), (1, 1, max(thin, level * dice.between(0.1, 0.7)))))
    if kind in ("drop", "drop into water"):
        widths = [min(0.9, max(3.0 * place.cell / float(s), dice.between(0.2, 0.6))) for s in place.size]
        start = [dice.between(0.0, 1.0 - w) for w in widths]
        fills.append(_box(place, start, np.add(start, widths).tolist()))
        if kind == "drop into water":
            fills.append(_box(place, (0, 0, 0), (1, 1, max(thin, dice.between(0.1, 0.4)))))
        level = start[2] + widths[2]
    found.level, found.still = level * high, kind == "still"
    found.table["fill"] = fills


def _sides(dice: Dice, place: Basin, found: Stream, gravity: float) -> None:
    """Open sides of the tank, and inflows or seas at others; an inflow always leaves a way out."""
    taken: dict[str, str] = {}
    still = found.still and found.level < 0.95 * place.size[2]
    if still and dice.chance(0.7):
        side = dice.one(["x-", "y-"])
        taken[side] = "inflow"
        _inflow(dice, place, found, side, gravity)
        found.still = False
    if dice.chance(0.25) and not place.meshed:
        side = dice.one([s for s in SIDES if s not in taken])
        taken[side] = "sea"
        level = found.level if still else place.size[2] * dice.between(0.3, 0.8)
        found.table["sea"] = [{"side": side, "level": rounded(place.lower[2] + level, 8)}]
        found.still = found.still and level == found.level
    top = ["z+"] if "inflow" in taken.values() or dice.chance(0.85) else []
    sides = [] if found.still else dice.some([s for s in SIDES if s not in taken], 0.12)
    if top + sides != ["z+"]:
        place.table["open"] = top + sides
    smooth = dice.some([s for s in (*SIDES, "z-") if s not in taken and s not in sides], 0.15)
    flat = place.bed is None or not place.meshed
    if smooth and flat:
        place.table["smooth"] = smooth


def _inflow(dice: Dice, place: Basin, found: Stream, side: str, gravity: float) -> None:
    """An inflow into still water of a known depth."""
    depth, z = found.level, float(place.lower[2])
    room = float(place.size[2]) - depth
    kind = dice.one(["bore", "solitary", "steady", "record"])
    spec: dict = {"kind": kind, "side": side}
    wave = math.sqrt(gravity * depth)
    if kind == "bore":
        spec |= {"ahead": z + depth, "level": z + depth + min(room, depth) * dice.between(0.1, 0.7)}
    elif kind == "solitary":
        height = min(room, depth) * dice.between(0.1, 0.6)
        kappa = math.sqrt(0.75 * height / depth**3) * math.sqrt(gravity * (depth + height))
        spec |= {"level": z + depth, "height": height, "crest": dice.between(2.5, 4.0) / kappa}
        if dice.chance(0.3):
            spec["theory"] = "goring"
    elif kind == "steady":
        spec |= {
            "level": z + depth + room * dice.between(0.0, 0.4),
            "velocity": wave * dice.between(0.1, 1.0),
        }
    else:
        spec["path"] = "inflow.csv"
        times = np.linspace(0.0, 12.0 * depth / wave, 7)
        rise = [0.0, *(room * dice.between(0.0, 0.5) for _ in times[1:])]
        rows = [f"{t:.6g},{z + depth + r:.8g},{wave * r / depth:.6g}" for t, r in zip(times, rise)]
        found.files["inflow.csv"] = "\n".join(["time,level,velocity", *rows]) + "\n"
    found.table["inflow"] = [{k: rounded(v, 8) if isinstance(v, float) else v for k, v in spec.items()}]
    found.fastest += wave


def _walls(dice: Dice, place: Basin, found: Stream, speed: float) -> None:
    """Reynolds numbers from 10 up; no-slip or rough walls."""
    length = float(place.size[2])
    if dice.chance(0.35):
        reynolds = dice.decades(10.0, 1e6)
        found.table["viscosity"] = rounded(1000.0 * speed * length / reynolds)
    walls = dice.one(["slip", "slip", "slip", "no-slip", "friction"])
    if walls == "no-slip" and "viscosity" in found.table:
        found.table["walls"] = "no-slip"
    elif walls == "friction":
        found.table["walls"] = "friction"
        if dice.chance(0.5):
            found.table["roughness"] = rounded(place.cell * dice.decades(1e-4, 0.1))
        else:
            found.table["manning"] = dice.decades(0.01, 0.1)
