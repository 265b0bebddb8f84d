"""Whether the load of the water still grows when a run ends, so that its largest value may be yet to come.

Two running means of a load are compared, over windows that grow with the time of the run, so that a run that is
continued says the same as one that was longer from the start. Their weights need no power or exponential, whose last
digits differ between processors.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats

RECENT, LONG = 0.05, 0.2
"""Windows of the two means, as shares of the time of the run so far."""
GROWS = 0.1
"""Share by which the recent mean of a load that grows lies above the long one. It is 0.14 for a load in proportion to
the time, and 0.07 for one in proportion to its square root."""
AT_ITS_TOP = 0.98
"""Least share of its largest value so far at which the recent mean of a load is at its largest."""
NOTHING = 1e-6
"""Share of the weight up to which a load is none: a film of water on the foot of a house of 90 t exerted 6 mN."""
LOADS = ("horizontal", "force")
"""The loads that are followed: the horizontal part of the force of the water, and the whole of it."""


@dataclass
class Trend:
    """Of each of LOADS (2,) [N]: recent and long mean, and the largest recent mean so far."""

    recent: Floats
    long: Floats
    largest: Floats

    @classmethod
    def none(cls) -> Trend:
        """No load yet."""
        return cls(*(np.zeros(len(LOADS)) for _ in range(3)))

    def take(self, value: Array, time: float, dt: float) -> None:
        """Add the loads (2,) [N] of a step of length dt [s] that ends at time [s]."""
        before = max(time - dt, 0.0)
        self.recent = self.recent + (value - self.recent) * (dt / (RECENT * before + dt))
        self.long = self.long + (value - self.long) * (dt / (LONG * before + dt))
        self.largest = np.maximum(self.largest, self.recent)

    def rising(self, weight: float) -> dict | None:
        """The first of LOADS that still grows and is at its largest: its name, and its recent and its long mean [N];
        None where none does, or where it is nothing beside the weight [N] of what it acts on."""
        grows = (self.recent > (1.0 + GROWS) * self.long) & (self.recent >= AT_ITS_TOP * self.largest)
        grows &= self.recent > NOTHING * weight
        if not grows.any():
            return None
        k = int(grows.argmax())
        return {"load": LOADS[k], "recent": float(self.recent[k]), "long": float(self.long[k])}

    def array(self) -> Array:
        """(3, 2) recent, long, largest."""
        return np.array([self.recent, self.long, self.largest])

    @classmethod
    def of(cls, array: Array) -> Trend:
        """The trend of what `array` returned."""
        return cls(*array.copy())
