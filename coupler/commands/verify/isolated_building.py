"""Dam break against an isolated building in a channel (Soares-Frazao and Zech): depths at six gauges, reported only."""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import columns
from coupler.commands.verify.losses import Losses
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import box, column, tank
from fluid.readings import gauges

BEFORE, AFTER, WIDTH, TOP = 7.55, 6.0, 3.6, 0.5
"""Channel before and after the far side of the gate, where x = 0, its width and its height [m].

The flume itself goes on for 28 m, and its bed rises by 16 cm over the outer 34 cm; here it is flat."""
RESERVOIR, AHEAD = 0.40, 0.02
"""Water behind the gate and in the channel [m]."""
GATE = -0.8
"""Its near side [m]: the water stands up to there, between two blocks that leave 1 m."""
CELL, LAYER = 0.15, 0.05
"""Cells along the channel and across it, and their height [m]."""
GAUGES = {
    "G1": (2.65, 1.15), "G2": (2.65, -0.60), "G3": (4.00, 1.15),
    "G4": (4.00, -0.80), "G5": (5.20, 0.30), "G6": (-1.87, 1.10),
}  # fmt: skip
UNTIL = 10.0
FOUND = 0.10
"""[m] given with each gauge; the case is not judged."""


@check(
    "P43",
    "dam break against an isolated building",
    "Soares-Frazao and Zech, J. Hydraul. Res. 45 (2007) 27",
    "M",
)
def isolated_building():
    run, losses = _run()
    table = columns("soares_frazao_building_h")
    t, panels = table["t_s"], []
    shown = t <= UNTIL
    for name in GAUGES:
        own = np.interp(t[shown], run["t"], run[name])
        rms = float(np.sqrt(np.mean((own - table[name][shown]) ** 2)))
        yield Finding(
            f"rms difference of {name} to {UNTIL:g} s [m] (reported, not judged)", rms, 0.0, FOUND, False
        )
        curves = (
            Curve("measured", "measured", t[shown], 100 * table[name][shown]),
            Curve("computed, cells 15 cm x 15 cm x 5 cm", "computed", run["t"], 100 * run[name]),
        )
        panels.append(Panel("time [s]", f"depth at {name} [cm]", curves, (0.0, UNTIL)))
    yield from losses.findings()
    yield Figure("P43_building", tuple(panels), columns=2)


def _run() -> tuple[dict[str, np.ndarray], Losses]:
    origin = np.array([BEFORE, 0.5 * WIDTH, 0.0])
    size = np.array([BEFORE + AFTER, WIDTH, TOP])
    cells = np.round(size / [CELL, CELL, LAYER]).astype(int)
    dam = column(BEFORE + GATE, RESERVOIR)
    c = tank(
        size,
        cells,
        lambda x: np.minimum(dam(x), x[:, 2] - AHEAD),
        solids=[*_gate(origin), _building(origin)],
        rtol=1e-6,
        is_open=lambda normal, _: normal[:, 0] > 0.5,
        walls="friction",
        manning=0.01,
    )
    losses, rows = Losses(c.water), []
    while c.time < UNTIL:
        c.step(c.water.stable_step())
        losses.add()
        rows.append([c.time, *(gauges.level(c.water, np.array(g) + origin[:2]) for g in GAUGES.values())])
    return dict(zip(("t", *GAUGES), np.array(rows).T)), losses


def _gate(origin):
    """The blocks beside the opening of 1 m, 0.8 m thick."""
    middle = 0.5 * (0.5 + 0.5 * WIDTH)
    size = (0.8, 0.5 * WIDTH - 0.5, 2 * TOP)
    return [box(origin + np.array([0.5 * GATE, side * middle, 0.0]), size) for side in (-1.0, 1.0)]


def _building(origin):
    """0.8 m x 0.4 m, its long side at 64 degrees to the channel, the nearest corner 3.44 m from the gate."""
    angle = np.deg2rad(64.0)
    along, across = (
        np.array([np.cos(angle), np.sin(angle), 0.0]),
        np.array([np.sin(angle), -np.cos(angle), 0.0]),
    )
    centre = np.array([3.44, -0.05, 0.0]) + 0.4 * along + 0.2 * across
    return box(origin + centre, (0.8, 0.4, 2 * TOP), np.column_stack([along, -across, [0.0, 0.0, 1.0]]))
