"""Influence of the time step on an impact: peak, mean over a window and impulse at several Courant numbers."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.verify.curves import Curve, Figure, Panel
from coupler.commands.verify.registry import TOLD, Finding

NUMBERS = (0.5, 1.0, 2.0, 4.0)
"""Courant numbers; the first is the reference of the others."""
WITHIN = 0.20
"""Tolerance of means and impulses for loads; peaks are reported, not judged."""
WHAT = (f"peak {TOLD}", "largest mean over {:g}", "impulse")


def findings(runs: dict[float, tuple], window: float, end: float) -> Iterator[Finding]:
    """Compare each of `runs` with the first. They are keyed by Courant number; each holds times (n,) and pressures (n,)
    from 0 to `end`."""
    first, *others = {number: figures(*run, window, end) for number, run in runs.items()}.items()
    for number, values in others:
        for what, value, goal, limit in zip(WHAT, values, first[1], (np.inf, WITHIN, WITHIN)):
            name = f"CFL {number:g} over CFL {first[0]:g}: {what.format(window)}"
            yield Finding(name, value / goal, 1.0, limit)


def figures(t, p, window: float, end: float) -> tuple[float, float, float]:
    """(peak, largest mean over `window`, impulse to `end`) of a pressure p (n,) at times t (n,)."""
    dt = window / 100.0
    grid = np.arange(0.0, end, dt)
    v = np.interp(grid, t, p)
    sums = np.concatenate([[0.0], np.cumsum(v) * dt])
    mean = ((sums[100:] - sums[:-100]) / window).max()
    return float(p[t <= end].max()), float(mean), float(np.trapezoid(v, grid))


def figure(name: str, runs: dict[float, tuple], window: float, end: float, axes, x_range) -> Figure:
    """Figure of the pressures, and of the three values relative to those of the first run."""
    numbers = np.array(list(runs))
    found = np.array([figures(*run, window, end) for run in runs.values()])
    lines = tuple(Curve(f"CFL {n:g}", "computed", *run) for n, run in runs.items())
    labels = ("peak", f"mean over {window:g}", "impulse")
    shares = tuple(
        Curve(label, "computed", numbers, column) for label, column in zip(labels, (found / found[0]).T)
    )
    panels = (
        Panel(*axes, lines, x_range),
        Panel("Courant number", f"value over that of CFL {numbers[0]:g}", shares, None, (0.0, 1.2), log="x"),
    )
    return Figure(name, panels, columns=2)
