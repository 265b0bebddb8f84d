"""Options of a random scene that most cases leave at their defaults: finer cells, stretched bricks,
absorbing sides, N-waves, openings beside edges only, films under blocks, random strengths, gradual weight, sleep.
They are drawn last, so that all else stays the same."""

from __future__ import annotations

import numpy as np

from coupler.commands.stress.drawn.basin import Basin
from coupler.commands.stress.drawn.dice import Dice, rounded

FINER_STEPS = 0.3
"""Share of the time that is run with finer cells, which cost more and take shorter steps."""


def add_options(dice: Dice, place: Basin, table: dict) -> None:
    """Change the tables of a scene that is otherwise complete."""
    if "tank" in table and "water" in table:
        _cells(dice, place, table)
        _sides(dice, table["water"])
        water = table["water"]
        if water.get("covers") == "multiple" and "openings" not in water and dice.chance(0.3):
            water["openings"] = "edges"
    if "structure" in table:
        _structure(dice, table)


def _cells(dice: Dice, place: Basin, table: dict) -> None:
    """Use cells of half the size in a box or around the solids, or bricks of another length along part of an axis."""
    tank = table["tank"]
    if dice.chance(0.1):
        part: dict = {}
        names = [row["name"] for row in table.get("solid", ()) if not row["name"].startswith("bed")]
        if names and dice.chance(0.4):
            part["around"] = [dice.one(names)]
            part["margin"] = rounded(place.cell * dice.between(0.5, 1.5))
        else:
            share = [dice.between(0.25, 0.5) for _ in range(3)]
            start = [dice.between(0.0, 1.0 - s) for s in share]
            for name, at in (("lower", start), ("upper", np.add(start, share))):
                part[name] = [rounded(float(x), 8) for x in place.lower + place.size * at]
        tank["refine"] = [part]
    elif "mesh" not in tank and dice.chance(0.1):
        axis = dice.whole(0, 2)
        share = dice.between(0.2, 0.6)
        start = dice.between(0.0, 1.0 - share)
        ends = [rounded(float(place.lower[axis] + place.size[axis] * s), 8) for s in (start, start + share)]
        cell = rounded(place.cell * dice.decades(0.6, 1.7))
        tank["stretch"] = [{"along": "xyz"[axis], "lower": ends[0], "upper": ends[1], "cell": cell}]
    if "refine" in tank or "stretch" in tank:
        for name in ("end", "output_every", "checkpoint_every", "step_max"):
            if name in table["time"]:
                table["time"][name] = rounded(FINER_STEPS * table["time"][name])


def _sides(dice: Dice, water: dict) -> None:
    """Use N-waves in place of solitary ones, and inflows and seas that absorb reflected waves."""
    for spec in water.get("inflow", ()):
        if spec["kind"] == "solitary" and dice.chance(0.3):
            spec["kind"], spec["middle"] = "n-wave", spec.pop("crest")
            spec["height"] = rounded(0.5 * spec["height"])
            spec["leading"] = dice.one(["depression", "elevation"])
            spec.pop("theory", None)
    for spec in (*water.get("inflow", ()), *water.get("sea", ())):
        if dice.chance(0.2):
            spec["absorbs"] = True


def _structure(dice: Dice, table: dict) -> None:
    """Films under blocks; joints of random strength; weight that comes on gradually; islands that sleep."""
    structure, contact = table["structure"], table["contact"]
    if "water" in table and dice.chance(0.2):
        contact["uplift"] = dice.one(["none", "share"])
        if contact["uplift"] == "share":
            contact["uplift_share"] = rounded(dice.between(0.0, 1.0), 3)
    if "joints" in table and dice.chance(0.2):
        table["joints"]["distribution"] = dice.one(["weibull", "lognormal"])
        table["joints"]["variation"] = rounded(dice.between(0.05, 0.6), 3)
    if "start" not in structure and dice.chance(0.1):
        structure["start"] = "ramp"
        structure["ramp"] = rounded(dice.between(0.2, 0.8) * table["time"]["end"])
    if "joints" in table and dice.chance(0.15):
        structure["sleep"] = {"share": rounded(dice.between(0.005, 0.1), 3)}
