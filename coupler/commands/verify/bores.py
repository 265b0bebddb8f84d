"""A bore into still water: Stoker's wave."""

from __future__ import annotations

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.figures import named_values
from coupler.commands.verify.losses import Losses
from coupler.commands.verify.registry import Finding, check
from coupler.commands.verify.scenes import tank
from fluid.readings import gauges

UPPER, CELLS, LENGTH = 0.15, 16, 4.5
"""Water behind the gate [m], cells over it, length of the tank [m]."""
GATE = 0.4 * LENGTH
WAY = np.arange(5.0, 16.1, 0.5)
"""Places where the bore is timed, in depths from the gate: many and far apart, as splashes make it arrive up to a third
of a depth early or late."""


@check("P41", "bore into still water (Stoker)", "shallow water theory", "M")
def bore():
    known, curves = named_values("wave_closed_forms"), []
    for lower in (0.018, 0.038):
        places, arrival, losses = _arrivals(lower)
        speed = float(np.polyfit(arrival, places, 1)[0])
        exact = known[f"stoker_h0={UPPER}_h1={lower}_bore_speed"]
        yield Finding(f"speed of the bore [m/s], {UPPER} m into {lower} m", speed, exact, 0.05)
        yield from losses.findings(f"into {lower} m: ")
        x = (places - GATE) / UPPER
        curves.append(Curve(f"computed, into {1e3 * lower:.0f} mm", "computed", arrival, x, points=True))
        curves.append(Curve(f"Stoker, into {1e3 * lower:.0f} mm", "exact", x * UPPER / exact, x))
    axes = ("time [s]", "distance of the bore from the gate, $x/h_0$ [–]")
    yield Figure("P41_bore", (Panel(*axes, tuple(curves)),))


def _arrivals(lower: float):
    """Distances (n,) [m] downstream of the gate, arrival times (n,) [s] of the bore there, losses of the run."""
    cell = UPPER / CELLS
    size = np.round(np.array([LENGTH, 2 * cell, 1.5 * UPPER]) / cell) * cell
    level = lambda x: np.minimum(np.maximum(x[:, 0] - GATE, x[:, 2] - UPPER), x[:, 2] - lower)  # noqa: E731
    c = tank(size, np.round(size / cell).astype(int), level, rtol=1e-7)
    losses = Losses(c.water)
    places = GATE + UPPER * WAY
    arrival = np.full(len(places), np.nan)
    while np.isnan(arrival[-1]) and c.time < 5.0:
        c.step(c.water.stable_step())
        losses.add()
        now = np.array([_depth(c.water, x, cell, size[2]) for x in places])
        arrival[np.isnan(arrival) & (now > lower + 0.25 * (UPPER - lower))] = c.time
    return places, arrival, losses


def _depth(water, x: float, cell: float, height: float) -> float:
    """Depth [m] of the water, averaged over four cells along x so that a splash ahead of the front hardly counts."""
    volume = gauges.volume_in_box(water, (x - 2 * cell, 0.0, 0.0), (x + 2 * cell, 2 * cell, height))
    return volume / (8 * cell**2)
