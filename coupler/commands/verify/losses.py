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
        self.history: list[tuple[float, float]] = []
        """(time [s], share moved so far) after each step."""

    def add(self) -> None:
        """Take the report of the step just made."""
        self.moved += abs(self.water.report.reinserted)
        self.history.append((self.water.time, self.share_moved))

    @property
    def share_moved(self) -> float:
        """Σ |re-inserted| over the water at the start."""
        return self.moved / self.water.initial_volume

    def findings(self, where: str = "") -> Iterator[Finding]:
        """Two quantities: the error of the volume at the end, and the share that was moved."""
        end = abs(self.water.volume_error())
        yield Finding(f"{where}error of the water volume at the end", end, 0.0, MOST_ERROR, False)
        yield Finding(f"{where}sum of |re-inserted volume| / water", self.share_moved, 0.0, MOST_MOVED, False)

    def panel(self, label: str) -> Panel:
        """The share moved so far over time, for a figure."""
        t, moved = np.array(self.history).T
        return Panel(
            "time [s]",
            "moved by the last shift so far [% of the water]",
            (Curve(label, "computed", t, 100 * moved),),
        )
