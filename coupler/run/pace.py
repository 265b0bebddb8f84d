"""How long a run has still to go, from its own pace.

A run changes its pace: water that arrives takes shorter steps, blocks that break loose are cut and searched, and a hit
takes a few steps that cost ten times as much. The pace of the whole run so far lags behind the one, that of the last
steps overshoots at the other: the time to come is taken at the geometric mean of the paces of the last half and of the
last tenth. What has not begun yet no pace knows: runs in which water broke a structure were GROWTH times slower
afterwards. That is expected while nothing is broken and the water has not arrived, and for half as long again once it
has (`Calm`).
"""

from __future__ import annotations

import math
from collections import deque

WINDOWS = (0.5, 0.1)
"""Shares of the simulated time so far whose paces count."""
GROWTH = 2.0
AFTER_ARRIVAL = 1.5
"""Times the moment at which the water reached the structure: if nothing is broken by then, calm is over."""
MOST = 2000
"""Steps that are remembered; of longer runs every other one is dropped."""


class Pace:
    """end [s] of the simulated time; the first step is no measure, since it loads and compiles what it uses."""

    def __init__(self, end: float):
        self.end = end
        self._seen: deque[tuple[float, float]] = deque()
        self.calm = False
        """Whether worse is to come (`Calm`)."""

    def add(self, time: float, now: float) -> None:
        """A step has ended: time [s] simulated, now [s] on the clock."""
        self._seen.append((time, now))
        if len(self._seen) > MOST:
            self._seen = deque(list(self._seen)[::2])

    def left(self) -> float | None:
        """Time to go [s] on the clock; None before the second step."""
        if len(self._seen) < 2:
            return None
        paces = [self._pace(share) for share in WINDOWS]
        pace = math.prod(paces) ** (1.0 / len(paces)) * (GROWTH if self.calm else 1.0)
        return pace * max(self.end - self._seen[-1][0], 0.0)

    def _pace(self, share: float) -> float:
        """Time on the clock over simulated time, of the last `share` of the latter."""
        time, now = self._seen[-1]
        since = time - share * (time - self._seen[0][0])
        began, started = next(
            ((t, at) for t, at in reversed(self._seen) if t <= since and t < time), self._seen[0]
        )
        return (now - started) / (time - began) if time > began else 0.0


class Calm:
    """Whether a run is still before what it is made for: water on its way to a structure that may break."""

    def __init__(self):
        self._arrived: float | None = None

    def now(self, time: float, wet: bool, joints: int, broken: int) -> bool:
        """After a step to time [s]; wet: water touches a block · joints that hold · broken ones."""
        if wet and self._arrived is None:
            self._arrived = time
        if broken or not joints:
            return False
        return self._arrived is None or time < AFTER_ARRIVAL * self._arrived
