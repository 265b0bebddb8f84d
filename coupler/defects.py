"""What a coupled run remembers of steps in which the blocks missed the motion that the water was told.

Such a step is halved and taken again; the steps after it stay short and grow back, and where the shortest ones keep
missing the run ends.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from coupler.limits import check_misses

DEFECT_STEPS = 20
"""Steps over which the defect is averaged: a breaking joint may spoil one of them."""
RETRIES = 3
"""Times that a step which failed is halved and taken again."""
RETRY_AT = 0.6
"""Share of the largest defect above which a step is halved: blocks that hit each other under water within one step miss
by 0.2 to 0.5, and left 2 % of the energy out of balance where only half of them were taken again."""
MISSES = 3
"""Steps in a row that may miss by more than the largest defect at their shortest before the run stops."""
REGROWTH = 1.5
"""By which the longest step grows again with every step that needs no retry."""


class Defects:
    """Defects of the last steps, and how long the next one may be.

    most: largest defect allowed · step_max [s] · longest: longest step [s] after one that was halved, else infinite
    """

    def __init__(self, most: float, step_max: float):
        self.most, self.step_max = most, step_max
        self.longest = math.inf
        self._last: deque[float] = deque(maxlen=DEFECT_STEPS)

    @property
    def mean(self) -> float:
        """Over the last DEFECT_STEPS steps; 0 before there are as many."""
        return sum(self._last) / DEFECT_STEPS if len(self._last) == DEFECT_STEPS else 0.0

    def too_large(self, defect: float) -> bool:
        """Whether a step with this defect is halved and taken again."""
        return not defect <= RETRY_AT * self.most

    def note(self, time: float, dt: float, defect: float, retries: int) -> None:
        """A step [s] was taken after so many retries. Raises Diverged where the shortest ones keep missing."""
        self._last.append(defect)
        if retries > 0:
            self.longest = dt
        else:
            self.longest = self.longest * REGROWTH if self.longest < self.step_max else math.inf
        if retries == RETRIES:
            check_misses(time, list(self._last)[-MISSES:], MISSES, self.most, dt)

    def save(self) -> dict[str, np.ndarray]:
        """Its memory, by name."""
        found = {"defects": np.array(self._last, float)}
        return found if math.isinf(self.longest) else found | {"longest": np.array(self.longest)}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Back to what was saved."""
        self._last = deque(saved["defects"].tolist(), maxlen=DEFECT_STEPS)
        self.longest = float(saved.get("longest", math.inf))
