"""One scene of a seed: basin, stream, bodies, contact, joints, gauges, times and limits, sized for seconds."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from coupler.commands.stress.drawn.basin import Basin, basin, terrain_solids
from coupler.commands.stress.drawn.bodies import Bodies, bodies, slots
from coupler.commands.stress.drawn.dice import Dice, rounded
from coupler.commands.stress.drawn.options import add_options
from coupler.commands.stress.drawn.stream import Stream, stream
from coupler.commands.stress.registry import GROUPS

CPU_SECONDS = 10.0
"""Processor time [s] after which a scene ends by itself, with valid results up to then."""
SHARES = {"structure": 0.25, "water": 0.3, "coupling": 0.45}
BRICK_STEP = 4e-6
"""Approximate processor time [s] per step of a brick (six cells) of water; with blocks it is half as much again."""
SUBSTEP = 4e-6
"""Approximate processor time [s] per substep of a block with its contacts and joints."""
TOUCHING = ("wall", "building", "column", "arch")
"""Kinds of parts in which faces touch for sure: from their joints [contact] can take its stiffness."""
WIDE, WIDE_KINDS = 2.3, ("block", "stack", "wall", "column")
"""Cells that the joined faces of such parts are wide in a fifth of the scenes with water, blocks and a flat bed in a
roomy tank: water between narrower ones is refused."""
WANTED = 4.0
"""Processor time [s] that a scene is sized for."""


@dataclass
class Drawn:
    """id R<seed>-<number> · group · title · table: the case as plain data · files: text, or (points, kind, cells) of a
    mesh, by name · still: its water should stay at rest"""

    id: str
    group: str
    title: str
    table: dict
    files: dict[str, object] = field(default_factory=dict)
    still: bool = False


def draw(seed: int, number: int, seconds: float = WANTED) -> Drawn:
    """Scene `number` of `seed`; the same two give the same scene. seconds [CPU s]: about what it is sized for; a
    shorter scene is the beginning of a longer one, except for events that are placed by the length of the run."""
    dice = Dice(seed, number)
    group = group_of(dice)
    gravity = 9.81 if dice.chance(0.8) else dice.decades(0.5, 30.0)
    terrain = "flat"
    if group != "structure" and dice.chance(0.25):
        terrain = dice.one({"solids": 1.0, "mesh": 1.0 if group == "water" else 0.0})
    place = basin(dice, terrain)
    flow = stream(dice, place, gravity) if group != "structure" else None
    beside = Dice(seed, number, 1)
    roomy = group == "coupling" and terrain == "flat" and float(place.size.min()) > 2.0 * WIDE * place.cell
    least = WIDE * place.cell if roomy and beside.chance(0.2) else 0.0
    found = _bodies(dice, place, group, least)
    title = _title(place, flow, found)
    about = {"title": f"random scene {number} of seed {seed}: {title}"}
    if gravity != 9.81:
        about["gravity"] = gravity
    table = {"case": about, **_tables(dice, place, flow, found, gravity, seconds)}
    if flow is not None:
        _air(dice, place, flow, found, table)
    add_options(dice, place, table)
    if found.wide:
        table["joints"]["uplift"] = beside.one({"none": 1.0, "damage": 2.0, "full": 2.0})
    still = flow is not None and flow.still and not found.tables
    files = place.files | found.files | (flow.files if flow else {})
    return Drawn(f"R{seed}-{number}", group, title, table, files, still)


def _air(dice: Dice, place: Basin, flow: Stream, found: Bodies, table: dict) -> None:
    """Trapped air in some scenes, most of them below a closed lid; drawn late, so that all else stays the same."""
    if not dice.chance(0.15):
        return
    water = table["water"]
    water["air"] = air = {"model": "trapped"}
    if found.solids or found.tables:
        water["covers"] = "multiple"
    if dice.chance(0.3):
        air["gamma"] = dice.one([1.0, 1.2])
    room = flow.level < 0.95 * place.size[2]
    if "inflow" not in water and dice.chance(0.7) and room:
        place.table["open"] = [side for side in place.table.get("open", ["z+"]) if side != "z+"]
    if dice.chance(0.4):
        at = [
            rounded(float(place.lower[k] + share * place.size[k]), 8)
            for k, share in enumerate((0.5, 0.5, 0.9))
        ]
        air["vent"] = [{"at": at, "area": rounded(place.cell**2 * dice.decades(1e-4, 0.1))}]
    if dice.chance(0.5):
        at = [rounded(float(place.lower[k] + dice.between(0.2, 0.8) * place.size[k]), 8) for k in range(2)]
        at.append(rounded(float(place.lower[2] + 0.9 * place.size[2]), 8))
        table.setdefault("gauge", []).append({"kind": "air", "name": "air", "at": at})


def group_of(dice: Dice) -> str:
    """The group of a scene, from the first draw of its dice."""
    assert set(SHARES) == set(GROUPS)
    return dice.one(SHARES)


def _bodies(dice: Dice, place: Basin, group: str, least: float) -> Bodies:
    """Solids and blocks; a terrain of wedges counts as solids. least [m]: as in `Slot`."""
    count = {"water": dice.whole(0, 2), "structure": dice.whole(1, 3), "coupling": dice.whole(1, 3)}[group]
    if group == "water" and place.meshed:
        count = 0
    gap = 0.02 * place.cell
    rooms = slots(
        dice,
        place.lower + np.array([gap, gap, 0.0]),
        place.upper - gap,
        place.cell,
        place.floor,
        max(count, 1),
        least,
    )[:count]
    found = bodies(dice, rooms, group != "water", WIDE_KINDS if least > 0.0 else None)
    found.least = least
    if group != "water" and not found.tables:
        high = slots(dice, place.lower + gap, place.upper - gap, place.cell, place.floor, 1)
        low = place.lower + np.array([gap, gap, 0.6 * place.size[2]])
        rooms = high or slots(dice, low, place.upper - gap, 0.1 * place.cell, lambda a, b: low[2], 1)
        found.tables |= (more := bodies(dice, rooms, True, ("block",))).tables
        found.singles, found.groups, found.count = more.singles, more.groups, found.count + more.count
        found.smallest, found.largest, found.narrowest = more.smallest, more.largest, more.narrowest
        found.tallest, found.solids = more.tallest, [] if high else found.solids
    if place.bed is not None and not place.meshed:
        found.solids = [*terrain_solids(place), *found.solids]
    return found


def _tables(
    dice: Dice, place: Basin, flow: Stream | None, found: Bodies, gravity: float, seconds: float
) -> dict:
    """Every section of the case but its title."""
    tables: dict = {}
    if flow is not None or dice.chance(0.4):
        tables["tank"] = place.table
    if flow is not None:
        tables["water"] = flow.table
    if found.solids:
        tables["solid"] = found.solids
    rate = 0.0
    speed = _speed(dice, place, flow, gravity)
    if found.tables:
        rate = _structure(dice, place, flow, found, gravity, speed, tables)
    end, step = _times(dice, place, flow, found, gravity, speed, rate, seconds)
    tables["time"] = {
        "end": end,
        "output_every": rounded(end / dice.whole(3, 8)),
        "checkpoint_every": 0 if dice.chance(0.8) else rounded(0.4 * end),
    }
    if step is not None:
        tables["time"]["step_max"] = step
    if dice.chance(0.2):
        tables["time"]["cfl"] = rounded(dice.between(0.3, 1.5), 3)
    if found.singles and dice.chance(0.15):
        _motion(dice, found, end, tables)
    _velocities(dice, tables, speed)
    gauges = _gauges(dice, place, flow, found, tables)
    if gauges:
        tables["gauge"] = gauges
    if flow is not None and found.tables and dice.chance(0.3):
        tables["coupling"] = {"passes": dice.whole(1, 4)}
    tables["limits"] = {"cpu_seconds": CPU_SECONDS}
    return tables


def _speed(dice: Dice, place: Basin, flow: Stream | None, gravity: float) -> float:
    """About the fastest of water and blocks [m/s]: a fall over the height of the tank."""
    fall = math.sqrt(2.0 * gravity * float(place.size[2]))
    return max(fall, flow.fastest if flow else 0.0)


def _structure(dice: Dice, place: Basin, flow: Stream | None, found: Bodies, gravity, speed, tables) -> float:
    """Sections structure, contact and joints; the frequency [rad/s] of the stiffest contact or joint."""
    density = dice.decades(20.0, 20_000.0)
    if dice.chance(0.6):
        density = dice.decades(300.0, 3000.0)
    structure: dict = {"density": density, **found.tables}
    heaviest = density
    for rows in found.tables.values():
        for row in rows:
            if dice.chance(0.15):
                row["density"] = rounded(min(20_000.0, max(20.0, density * dice.decades(0.3, 3.0))))
                heaviest = max(heaviest, row["density"])
    if "tank" not in tables or dice.chance(0.3):
        structure["ground"] = {"level": float(place.lower[2])}
    if dice.chance(0.2):
        structure["start"] = "sudden"
    tables["structure"] = structure
    mass = heaviest * found.largest**3
    load = mass * gravity * max(1.0, found.tallest / found.smallest)
    if flow is not None:
        load += tables["water"].get("density", 1000.0) * gravity * place.size[2] * found.largest**2
    stiffness = max(mass * (speed / (0.03 * found.smallest)) ** 2, load / (0.01 * found.smallest))
    stiffness *= dice.decades(1.0, 10.0)
    contact: dict = {
        "restitution": rounded(dice.between(0.05, 1.0), 3),
        "friction": rounded(dice.between(0.0, 1.0), 3),
    }
    if dice.chance(0.2):
        contact["shear_ratio"] = rounded(dice.between(0.2, 1.5), 3)
    if dice.chance(0.2):
        contact["nodes_per_edge"] = dice.whole(3, 6)
    if dice.chance(0.1):
        contact["tangential_restitution"] = rounded(dice.between(0.1, 1.0), 3)
    if dice.chance(0.1):
        contact["rule"] = "paper"
    if dice.chance(0.15):
        other = dice.one(["block", "tank" if "tank" in tables else "block"])
        pair = {"materials": ["block", other], "friction": rounded(dice.between(0.0, 1.5), 3)}
        contact["pair"] = [pair]
    glued = dice.chance(0.7 if found.count > 3 else 0.15) or found.wide
    if glued:
        tables["joints"] = _joints(dice, place, found, density, gravity)
        if flow is not None and dice.chance(0.3):
            tables["water"]["cracks"] = dice.one(["closed", "slit"])
    if not glued or dice.chance(0.5) or not any(kind in found.tables for kind in TOUCHING):
        contact["stiffness"] = rounded(stiffness)
    tables["contact"] = contact
    return math.sqrt(stiffness / (density * found.smallest**3))


def _joints(dice: Dice, place: Basin, found: Bodies, density: float, gravity: float) -> dict:
    """Joints with strengths of a few to a thousand times the stress from the weight of the pile, and small openings."""
    strength = max(density, 1000.0) * gravity * float(place.size[2]) * dice.decades(3.0, 1000.0)
    joints: dict = {
        "strength": rounded(strength),
        "opening_at_failure": rounded(found.smallest * dice.decades(1e-3, 2e-2)),
    }
    if dice.chance(0.3):
        joints["law"] = dice.one(["bilinear", "exponential"])
    elif dice.chance(0.2):
        joints["mixed_mode"] = "needleman"
    if dice.chance(0.3):
        joints["shear_ratio"] = rounded(dice.between(0.5, 2.0), 3)
    if dice.chance(0.3):
        joints["closing_ratio"] = rounded(dice.decades(1.0, 10.0), 3)
    if dice.chance(0.3):
        joints["damping"] = rounded(dice.between(0.0, 0.2), 3)
    if dice.chance(0.2):
        joints["points"] = dice.whole(2, 4)
    if dice.chance(0.3):
        joints["ground"] = False
    return joints


def _times(
    dice: Dice, place: Basin, flow, found: Bodies, gravity, speed, rate, seconds
) -> tuple[float, float | None]:
    """End of the run and longest step [s]. The run lasts for a few falls over the height of the tank, or for less where
    that costs too much."""
    wanted = dice.between(3.0, 8.0) * math.sqrt(float(place.size[2]) / gravity)
    if flow is not None:
        bricks = float(np.prod(place.size)) / place.cell**3
        step = min(0.7 * place.cell / speed, 0.3 * math.sqrt(place.cell / gravity))
        each = bricks * BRICK_STEP * (1.5 if found.tables else 1.0) + 0.01
        wanted = min(wanted, seconds / each * step)
    if found.tables:
        wanted = min(wanted, seconds / (SUBSTEP * (found.count + 20)) * 0.1 / rate)
    step = None
    if flow is None or dice.chance(0.3):
        step = rounded(wanted / dice.whole(40, 150))
    return rounded(wanted), step


def _motion(dice: Dice, found: Bodies, end: float, tables: dict) -> None:
    """A single block is driven upwards or sideways, no farther than there is room above it."""
    name, room = dice.one(found.singles)
    block = next(row for row in tables["structure"]["block"] if row["name"] == name)
    if room <= 0.0 or block.get("fixed"):
        return
    tables["motion"] = [{"block": name, "velocity": [0.0, 0.0, rounded(0.8 * room / end)]}]


def _velocities(dice: Dice, tables: dict, speed: float) -> None:
    """Some of the single blocks in the air start with a speed and a spin."""
    driven = {row["block"] for row in tables.get("motion", ())}
    for block in tables.get("structure", {}).get("block", ()):
        if block.get("fixed") or block["name"] in driven or "group" in block or not dice.chance(0.15):
            continue
        block["velocity"] = [rounded(0.3 * speed * x) for x in dice.direction()]
        size = min(block["size"] if "size" in block else np.ptp(block["vertices"], axis=0))
        if dice.chance(0.5):
            block["spin"] = [rounded(0.1 * speed / size * x) for x in dice.direction()]


def _gauges(dice: Dice, place: Basin, flow, found: Bodies, tables: dict) -> list[dict]:
    """A few gauges of each kind that applies to the scene."""
    gauges: list[dict] = []
    moving = [name for name, _ in found.singles]
    bodies = [*found.groups, *(s["name"] for s in found.solids)]
    if flow is not None and dice.chance(0.4):
        at = [rounded(float(place.lower[k] + dice.between(0.1, 0.9) * place.size[k]), 8) for k in range(2)]
        gauges.append({"kind": "level", "name": "level", "at": at})
    if flow is not None and dice.chance(0.2):
        box = {
            "lower": place.lower.tolist(),
            "upper": [rounded(float(x), 8) for x in place.lower + place.size / 2],
        }
        gauges.append({"kind": "volume", "name": "part", **box})
    if flow is not None and dice.chance(0.2):
        edges = [[0.0, rounded(float(place.size[1]) / 2), 0.0], [0.0, 0.0, rounded(float(place.size[2]) / 2)]]
        centre = [rounded(float(x), 8) for x in place.lower + place.size / 2]
        gauges.append({"kind": "flux", "name": "flux", "at": centre, "edges": edges})
    if moving and dice.chance(0.4):
        gauges.append({"kind": "motion", "name": "motion", "of": dice.one(moving)})
    if bodies and flow is not None and dice.chance(0.4):
        gauges.append({"kind": "force", "name": "force", "on": dice.one(bodies), "parts": dice.chance(0.5)})
    if bodies and found.tables and dice.chance(0.3):
        gauges.append(
            {"kind": "loads", "name": "loads", "on": dice.one(bodies), "each_block": dice.chance(0.3)}
        )
    if gauges and "on" in gauges[-1] and dice.chance(0.2):
        gauges[-1]["mean_over"] = rounded(0.05 * tables["time"]["end"])
    return gauges


def _title(place: Basin, flow: Stream | None, found: Bodies) -> str:
    """A title that lists the content of the scene."""
    parts = []
    if flow is not None:
        bed = (
            "" if place.bed is None else (" over a terrain mesh" if place.meshed else " over a bed of wedges")
        )
        mesh = " in a mesh file" if place.meshed and place.bed is None else ""
        sides = [spec.get("kind", "sea") for kind in ("inflow", "sea") for spec in flow.table.get(kind, ())]
        parts.append(f"water{bed}{mesh}{', ' + ' and '.join(sides) if sides else ''}")
    parts += [f"{len(rows)} {kind}" for kind, rows in found.tables.items()]
    solids = len([s for s in found.solids if not s["name"].startswith("bed")])
    parts += [f"{solids} solid"] if solids else []
    return ", ".join(parts)
