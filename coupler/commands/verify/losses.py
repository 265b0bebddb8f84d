"""Numerical losses of the water volume in a run, which are reported with every dam break."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.verify.curves import Curve, Panel
from coupler.commands.verify.registry import Finding

MOST_ERROR = 1e-3
MOST_MOVED = 0.05


class Losses:
    """Sums over the steps of a CoupledStepper with water: call `add` after each."""

    def __init__(self, water):
        self.water = water
        self.moved = 0.0
        """Σ |volume moved by the last shift| [m³]: lost with its surface in one place, back in another."""
        self.clipped = 0
        """Node-steps at the speed limit."""
        self.history: list[tuple[float, float, int]] = []
        """(time [s], share moved so far, clipped so far) after each step."""

    def add(self) -> None:
        """Take the report of the step just made."""
        self.moved += abs(self.water.report.reinserted)
        self.clipped += self.water.report.clipped
        self.history.append((self.water.time, self.share_moved, self.clipped))

    @property
    def share_moved(self) -> float:
        """Σ |re-inserted| over the water at the start."""
        return self.moved / self.water.initial_volume

    def findings(self, where: str = "") -> Iterator[Finding]:
        """Two quantities: the error of the volume at the end, and the share that was moved."""
        end = abs(self.water.volume_error())
        yield Finding(f"{where}error of the water volume at the end", end, 0.0, MOST_ERROR, False)
        yield Finding(f"{where}sum of |re-inserted volume| / water", self.share_moved, 0.0, MOST_MOVED, False)

    def panels(self, label: str) -> tuple[Panel, Panel]:
        """Both sums over time, for a figure."""
        t, moved, clipped = np.array(self.history).T
        volume = Curve(label, "computed", t, 100 * moved)
        return (
            Panel("time [s]", "re-inserted so far [% of the water]", (volume,)),
            Panel("time [s]", "node-steps at the speed limit", (Curve(label, "computed", t, clipped),)),
        )
