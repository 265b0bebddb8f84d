"""What the step does to an impact: peak, mean over a tenth of a second and impulse at several Courant numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.verify.curves import Curve, Figure, Panel
from coupler.verify.registry import Finding

NUMBERS = (0.5, 1.0, 2.0, 4.0)
FROM, TO, WINDOW = 0.35, 1.0, 0.1
"""[s] of the impulse, and over which the mean is taken."""
WITHIN = 0.20
"""Tolerance of means and impulses; peaks are told, not judged."""


def findings(runs: dict[float, dict], time, measured) -> Iterator[Finding | Figure]:
    """Sensor P1 of `runs` (by Courant number: columns "t" [s] and "P1" [Pa]) against the record (time, measured)."""
    goal = figures(time, measured)
    found = {number: figures(run["t"], run["P1"]) for number, run in runs.items()}
    names = (
        "peak of P1 [Pa] (told, not judged)",
        "largest mean of P1 over 0.1 s [Pa]",
        "impulse of P1 [Pa s]",
    )
    for number, values in found.items():
        for name, value, expected, limit in zip(names, values, goal, (10.0, WITHIN, WITHIN)):
            yield Finding(f"CFL {number:g}: {name}", value, expected, limit)
    yield _figure(runs, found, goal, time, measured)


def figures(t, p) -> tuple[float, float, float]:
    """(peak [Pa], largest mean over WINDOW [Pa], impulse from FROM to TO [Pa s]) of a pressure p (n,) at t (n,)."""
    grid = np.arange(0.0, TO, 1e-3)
    v = np.interp(grid, t, p)
    until = t <= TO
    sums = np.concatenate([[0.0], np.cumsum(v) * 1e-3])
    width = round(WINDOW / 1e-3)
    within = grid >= FROM
    mean = ((sums[width:] - sums[:-width]) / WINDOW).max()
    return float(p[until].max()), float(mean), float(np.trapezoid(v[within], grid[within]))


def _figure(runs, found, goal, time, measured) -> Figure:
    numbers = np.array(list(found))
    ratios = np.array(list(found.values())) / goal
    names = ("peak", "mean over 0.1 s", "impulse, 0.35 to 1 s")
    shares = [Curve(name, "computed", numbers, ratios[:, k]) for k, name in enumerate(names)]
    shares.append(Curve("measured", "exact", numbers[[0, -1]], np.ones(2)))
    shown = (time > 0.3) & (time < 0.8)
    curves = [Curve("measured", "measured", time[shown], 1e-3 * measured[shown])]
    curves += [Curve(f"CFL {n:g}", "computed", run["t"], 1e-3 * run["P1"]) for n, run in runs.items()]
    panels = (
        Panel("time [s]", "pressure at P1 [kPa]", tuple(curves), (0.35, 0.75)),
        Panel("Courant number", "P1: computed over measured", tuple(shares), None, (0.0, 1.6)),
    )
    return Figure("P40_courant", panels, columns=2)
