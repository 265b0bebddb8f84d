"""Requests to stop and time budgets are also honoured within a step, which may take minutes with fine cells and many
substeps.

A step that is abandoned leaves no state: the state before it was kept, and is saved.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from coupler.step.limits import LimitReached

LONG = 0.5
"""Duration [s] of a step from which the next one may be abandoned; after a shorter step no state is kept."""
PATIENCE = 2.0
"""Time [s] that the present step is given to end by itself."""
INTERVAL = 0.2
"""Time [s] between two checks for a request to stop."""


class StepLeft(LimitReached):
    """The present step was abandoned; the state before it is valid."""


class LongSteps:
    """Called repeatedly within a step, between solves and substeps; `around` makes one step under this watch.

    stop_reason: why the run is to end now, or None · hold: keeps the state before a step; `held` is what it returned
    """

    def __init__(self, stop_reason: Callable[[], str | None], hold: Callable[[], object]):
        self._stop_reason, self._hold = stop_reason, hold
        self._last = math.inf  # the first step loads and compiles what it uses
        self._may_leave, self._began, self._ask = False, 0.0, 0.0
        self.held: object = None

    def around(self, step: Callable[[], object]):
        """Return the result of the step. Raises StepLeft, and the exceptions of the step."""
        self._may_leave = self._last >= LONG
        self.held = self._hold() if self._may_leave else None
        self._began = time.monotonic()
        self._ask = self._began + PATIENCE
        found = step()
        self._last = time.monotonic() - self._began
        self.held = None
        return found

    def __call__(self) -> None:
        """Raises StepLeft if the run is to end now and the step has taken longer than the time allowed for it."""
        now = time.monotonic()
        if not self._may_leave or now < self._ask:
            return
        self._ask = now + INTERVAL
        reason = self._stop_reason()
        if reason:
            raise StepLeft(f"{reason}. The step under way was left")
