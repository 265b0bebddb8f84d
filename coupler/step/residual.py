"""History of the steps in which the motion of the blocks differed from the one that the pressure solve assumed.

Such a step is halved and taken again; the steps after it stay short and grow back. If the motions keep differing, the
run ends.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from coupler.step.limits import check_misses

if TYPE_CHECKING:
    from coupler.step.record import StepRecord

DEFECT_STEPS = 20
"""Steps over which the defect is averaged: a breaking joint may spoil one of them."""
RETRIES = 5
"""Times that a step which failed is halved and taken again: light wedges under water that bounce on one another
needed four (three left 55 % of the energy out of balance)."""
SHORTEST = 0.5**RETRIES
"""Smallest share of the step asked for that a step begins with."""
RETRY_AT = 0.6
"""Share of the largest defect above which a step is halved: blocks that hit each other under water within one step miss
by 0.2 to 0.5, and left 2 % of the energy out of balance where only half of them were taken again."""
MISSES = 3
"""Steps in a row that may miss by more than the largest defect, shorter ones too, before the run stops."""
REGROWTH = 1.5
"""By which the share of the step grows again with every step that needs no retry."""


class Defects:
    """Defects of the last steps, and how long the next one may be.

    most: largest defect allowed · share (0, 1]: length of the next step over that allowed by water, blocks and case;
    it is never less than after RETRIES halvings, however many steps in a row are bad
    """

    def __init__(self, most: float) -> None:
        self.most = most
        self.share = 1.0
        self._last: deque[float] = deque(maxlen=DEFECT_STEPS)

    @property
    def mean(self) -> float:
        """Mean defect over the last DEFECT_STEPS steps; 0 before that many steps were taken."""
        return sum(self._last) / DEFECT_STEPS if len(self._last) == DEFECT_STEPS else 0.0

    @property
    def halvings(self) -> int:
        """Times that a step that breaks a limit may be halved: as many as leave the shortest share."""
        return int(math.log2(self.share / SHORTEST))

    def too_large(self, defect: float) -> bool:
        """Whether a step with this defect is halved and taken again."""
        return not defect <= RETRY_AT * self.most

    def note(self, time: float, record: StepRecord) -> None:
        """A step was taken, `StepRecord`, at `time` [s]. Raises Diverged where bad ones keep missing."""
        self._last.append(record.defect)
        if record.retries > 0:
            self.share = max(self.share / 2**record.retries, SHORTEST)
        else:
            self.share = min(self.share * REGROWTH, 1.0)
        if record.bad:
            check_misses(time, list(self._last)[-MISSES:], MISSES, self.most, record.dt)

    def save(self) -> dict[str, Array]:
        """Its memory, by name."""
        return {"defects": np.array(self._last, float), "share": np.array(self.share)}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        self._last = deque(saved["defects"].tolist(), maxlen=DEFECT_STEPS)
        self.share = float(saved["share"])
