"""Dam break against an isolated building in a channel (Soares-Frazao and Zech): depths at six gauges, reported only,
and when the front over shallow water arrives, against the shallow-water equations."""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.losses import Losses
from coupler.commands.verify.registry import TOLD, Finding, check
from coupler.commands.verify.scenes import G, box, column, tank
from coupler.commands.verify.shallow_water import depths
from fluid.readings import gauges

BEFORE, AFTER, WIDTH, TOP = 7.55, 6.0, 3.6, 0.5
"""Channel before and after the gate, where x = 0, its width and its height [m].

The flume itself goes on for 28 m, and its bed rises by 16 cm over the outer 34 cm; here it is flat."""
RESERVOIR, AHEAD = 0.40, 0.02
"""Water behind the gate and in the channel [m]."""
OPENING, THICK = 1.0, 0.8
"""Width of the opening [m] between two blocks as thick as this [m], at whose far side the gate is: the water stands up
to there."""
CELL, LAYER = 0.15, 0.05
"""Cells along the channel and across it, and their height [m]."""
LONG, SHORT = 0.8, 0.4
"""Sides of the building [m]."""
GAUGES = {
    "G1": (2.65, 1.15), "G2": (2.65, -0.60), "G3": (4.00, 1.15),
    "G4": (4.00, -0.80), "G5": (5.20, 0.30), "G6": (-1.87, 1.10),
}  # fmt: skip
DOWNSTREAM = ("G1", "G2", "G3", "G4", "G5")
UNTIL = 10.0
SQUARE, FRONT, ARRIVED = 0.05, 0.01, 5.0
"""Squares of the shallow-water equations [m], rise above the water ahead that counts as the front [m], and time until
which they are solved [s]."""
LATE = 0.4
"""[s] by which the front may differ from that of the shallow-water equations: a fifth of its way to the building."""
MANNING = 0.01


@check(
    "P43",
    "dam break against an isolated building",
    "Soares-Frazao and Zech, J. Hydraul. Res. 45 (2007) 27; shallow-water equations",
    "M",
)
def isolated_building():
    run, losses = _run()
    table, shallow = columns("soares_frazao_building_h"), _shallow()
    t, panels = table["t_s"], []
    shown = t <= UNTIL
    for name in GAUGES:
        own = np.interp(t[shown], run["t"], run[name])
        rms = float(np.sqrt(np.mean((own - table[name][shown]) ** 2)))
        yield Finding(f"rms difference of {name} to {UNTIL:g} s [m] {TOLD}", rms, 0.0, np.inf, False)
        curves = (
            Curve("measured", "measured", t[shown], 100 * table[name][shown]),
            Curve("shallow-water equations", "other", shallow["t"], 100 * shallow[name]),
            Curve("computed, cells 15 cm x 15 cm x 5 cm", "computed", run["t"], 100 * run[name]),
        )
        panels.append(Panel("time [s]", f"depth at {name} [cm]", curves, (0.0, UNTIL)))
    for name in DOWNSTREAM:
        theory = _arrival(shallow["t"], shallow[name])
        what = f"front at {name} [s], against the shallow-water equations"
        yield Finding(what, _arrival(run["t"], run[name]), theory, LATE, False)
    for name in DOWNSTREAM:
        measured = float(t[np.argmax(table[name] > AHEAD + FRONT)])
        theory = _arrival(shallow["t"], shallow[name])
        what = f"the same by these equations at {name}, against the record [s] {TOLD}"
        yield Finding(what, theory, measured, np.inf, False)
    yield from losses.findings()
    yield Figure("P43_building", tuple(panels), columns=2)


def _arrival(t, depth) -> float:
    """Time [s] at which the water is deeper than before the front; NaN if it never is."""
    there = depth > AHEAD + FRONT
    return float(t[np.argmax(there)]) if there.any() else float("nan")


def _shallow() -> dict[str, np.ndarray]:
    """Depths [m] at the gauges by the shallow-water equations, and "t" [s]."""
    rows, columns = round((BEFORE + AFTER) / SQUARE), round(WIDTH / SQUARE)
    x, y = (np.arange(rows) + 0.5) * SQUARE - BEFORE, (np.arange(columns) + 0.5) * SQUARE - 0.5 * WIDTH
    places = {
        name: (int((gx + BEFORE) / SQUARE), int((gy + 0.5 * WIDTH) / SQUARE))
        for name, (gx, gy) in GAUGES.items()
    }
    x, y = np.meshgrid(x, y, indexing="ij")
    centre, along, across = _place_of_building()
    arm = np.stack([x, y], axis=-1) - centre[:2]
    solid = (x > -THICK) & (x < 0.0) & (np.abs(y) > 0.5 * OPENING)
    solid |= (np.abs(arm @ along[:2]) < 0.5 * LONG) & (np.abs(arm @ across[:2]) < 0.5 * SHORT)
    depth = np.where(x < 0.0, RESERVOIR, AHEAD)
    return depths(depth, solid, SQUARE, ARRIVED, places, MANNING, G)


def _run() -> tuple[dict[str, np.ndarray], Losses]:
    origin = np.array([BEFORE, 0.5 * WIDTH, 0.0])
    size = np.array([BEFORE + AFTER, WIDTH, TOP])
    cells = np.round(size / [CELL, CELL, LAYER]).astype(int)
    dam = column(BEFORE, RESERVOIR)
    c = tank(
        size,
        cells,
        lambda x: np.minimum(dam(x), x[:, 2] - AHEAD),
        solids=[*_gate(origin), _building(origin)],
        rtol=1e-6,
        is_open=lambda normal, _: normal[:, 0] > 0.5,
        walls="friction",
        manning=MANNING,
    )
    losses, rows = Losses(c.water), []
    while c.time < UNTIL:
        c.step(c.water.stable_step())
        losses.add()
        rows.append([c.time, *(gauges.level(c.water, np.array(g) + origin[:2]) for g in GAUGES.values())])
    return dict(zip(("t", *GAUGES), np.array(rows).T)), losses


def _gate(origin):
    """The blocks beside the opening."""
    width = 0.5 * (WIDTH - OPENING)
    middle = 0.5 * (OPENING + width)
    size = (THICK, width, 2 * TOP)
    return [box(origin + np.array([-0.5 * THICK, side * middle, 0.0]), size) for side in (-1.0, 1.0)]


def _place_of_building():
    """Centre (3,) [m] and the directions (3,) of its long and its short side: the long one at 64 degrees to the
    channel, the nearest corner 3.44 m from the gate."""
    angle = np.deg2rad(64.0)
    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    across = np.array([np.sin(angle), -np.cos(angle), 0.0])
    return np.array([3.44, -0.05, 0.0]) + 0.5 * LONG * along + 0.5 * SHORT * across, along, across


def _building(origin):
    centre, along, across = _place_of_building()
    return box(origin + centre, (LONG, SHORT, 2 * TOP), np.column_stack([along, -across, [0.0, 0.0, 1.0]]))
