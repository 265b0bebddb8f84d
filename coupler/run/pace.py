"""Estimate of the time left of a run, from its own pace.

The pace of a run changes: arriving water needs shorter steps, loose blocks have to be cut and searched, and an impact
takes a few steps that cost ten times as much. The estimate is based on the ratio of processor time to simulated time
over the last quarter of the run so far, with a part of its trend since the quarter before (`TREND`). It is converted to
wall time by their recent ratio, since other programs come and go. The past pace says nothing about what has not begun
yet: runs in which water reached blocks were GROWTH times slower afterwards. This factor is applied until the water
arrives and, as long as nothing breaks, for half that time again (`Calm`); the pace before that is then dropped. Whether
anything will break is not known then, and what breaks decides: the same house costs 1.2 times as much where it stands
and 3 to 6 times where it falls. So long, `between` gives both ends, and after the first break until the new pace has
shown itself. The same holds for loose blocks that fall, until they have hit one another (`Fall`). TREND, MOST_TREND and
the factors were chosen on shipped cases (docs/speed.md)."""

from __future__ import annotations

import time as clock
from bisect import bisect
from operator import itemgetter

WINDOW = 0.5
"""Share of the simulated time so far that counts: its later half for the pace, both for the trend."""
TREND, MOST_TREND = 0.3, 1.3
"""Share of the trend that is assumed to continue, and the largest factor by which it may change the pace."""
GROWTH, MOST_GROWTH = 2.2, 6.0
"""Factors on the pace before the water arrives: the likely one, and that of runs in which everything broke."""
SETTLED = 0.1
"""Share of the whole run after the first break in which its own pace replaces the expected one."""
LANDED = 0.5
"""Share of the largest kinetic energy so far below which blocks that fell have hit something."""
AFTER_ARRIVAL = 1.5
"""Multiple of the time of the water's arrival at the structure after which, if nothing has broken, calm is over; and of
the time at which falling blocks were fastest, after which they have landed."""
BUSY = 60.0
"""Wall time [s] over which the run's share of a core is measured."""
MOST = 2000
"""Largest number of stored steps; in longer runs every other one is dropped."""

Step = tuple[float, float, float]
"""Time [s] simulated, on the clock, and of the processor."""


class Pace:
    """end [s] of the simulated time; the first step is ignored, since it loads and compiles code."""

    def __init__(self, end: float):
        self.end = end
        self._seen: list[Step] = []
        self._calm = self._broken = False
        self._began = 0.0
        self._before: float | None = None

    @property
    def calm(self) -> bool:
        """Whether the run is expected to become slower."""
        return self._calm

    def expect(self, calm: bool, broken: bool) -> None:
        """Set whether the run is expected to become slower (`Calm`, `Fall`) · broken: whether a joint has broken, or
        what fell has hit something. A first break after the calm counts as one that ends it."""
        breaks = broken and not self._broken
        if self._seen and ((self._calm and not calm) or breaks):
            if breaks:
                self._before = self._own()
            self._began = self._seen[-1][0]
        self._calm, self._broken = calm, broken

    def add(self, time: float, now: float, used: float | None = None) -> None:
        """Record the end of a step: simulated time [s], wall clock `now` [s], and processor time `used` [s] (default:
        of this process)."""
        self._seen.append((time, now, clock.process_time() if used is None else used))
        if len(self._seen) > MOST:
            self._seen = self._seen[::2]

    def left(self) -> float | None:
        """Wall time left [s]; None before the second step."""
        if len(self._seen) < 2:
            return None
        return self._wall(self._ahead()[1])

    def between(self) -> tuple[float, float] | None:
        """Least and most wall time left [s] while it is not known whether and how much breaks; None else."""
        if len(self._seen) < 2:
            return None
        least, _, most = self._ahead()
        return (self._wall(least), self._wall(most)) if most > least else None

    def _wall(self, pace: float) -> float:
        """Wall time [s] of the rest of the run at a pace."""
        return pace * max(self.end - self._seen[-1][0], 0.0) * self._busy()

    def _ahead(self) -> tuple[float, float, float]:
        """Least, likely and largest pace of the rest of the run."""
        own = self._own()
        if self._calm:
            return own, GROWTH * own, MOST_GROWTH * own
        share = (self._seen[-1][0] - self._began) / (SETTLED * self.end)
        if self._before is None or share >= 1.0:
            return own, own, own
        likely = share * own + (1.0 - share) * max(GROWTH * self._before, own)
        return own, likely, max(likely, MOST_GROWTH * self._before)

    def _own(self) -> float:
        """Pace of the run by what it has shown."""
        if len(self._seen) < 2:
            return 0.0
        time, first = self._seen[-1][0], self._seen[0][0]
        window = min(WINDOW * (time - first), time - max(self._began, first))
        to_go = max(self.end - time, 0.0)
        newer, older = self._pace(time - 0.5 * window, time), self._pace(time - window, time - 0.5 * window)
        pace = newer
        if newer and older and window > 0.0:
            ahead = 0.25 * window + 0.5 * min(to_go, 0.5 * window)
            pace += TREND * (newer - older) / (0.5 * window) * ahead
            pace = min(max(pace, newer / MOST_TREND), newer * MOST_TREND)
        return pace

    def _pace(self, begin: float, end: float) -> float:
        """Processor time over simulated time between two times [s]; of the last step where they are one."""
        if end > begin:
            return (self._used(end) - self._used(begin)) / (end - begin)
        (before, _, earlier), (after, _, later) = self._seen[-2:]
        return (later - earlier) / (after - before) if after > before else 0.0

    def _used(self, time: float) -> float:
        """Processor time at a simulated time [s], linear within a step."""
        k = min(max(bisect(self._seen, time, key=itemgetter(0)), 1), len(self._seen) - 1)
        (before, _, earlier), (after, _, later) = self._seen[k - 1 : k + 1]
        share = (time - before) / (after - before) if after > before else 1.0
        return earlier + share * (later - earlier)

    def _busy(self) -> float:
        """Recent ratio of wall time to processor time."""
        _, now, used = self._seen[-1]
        k = min(bisect(self._seen, now - BUSY, key=itemgetter(1)), len(self._seen) - 2)
        _, then, before = self._seen[k]
        return (now - then) / (used - before) if used > before else 1.0


class Calm:
    """Whether the main event of a run is still to come: water is on its way to blocks that may break or drift."""

    def __init__(self):
        self._arrived: float | None = None

    def now(self, time: float, wet: bool, joints: int, broken: int) -> bool:
        """After a step to time [s]; wet: the water has arrived at blocks that can move · joints that hold ·
        broken ones."""
        if wet and self._arrived is None:
            self._arrived = time
        if broken:
            return False
        return self._arrived is None or (joints > 0 and time < AFTER_ARRIVAL * self._arrived)


class Fall:
    """Whether loose blocks still fall: the pairs that will touch, which a structure costs most for, are to come."""

    def __init__(self):
        self._most = self._when = 0.0

    def now(self, time: float, kinetic: float) -> bool:
        """After a step to time [s] · kinetic: energy [J] of the blocks."""
        if kinetic > self._most:
            self._most, self._when = kinetic, time
        return self._most > 0.0 and kinetic >= LANDED * self._most and time < AFTER_ARRIVAL * self._when

    @property
    def ended(self) -> bool:
        """Whether anything fell at all; with `now` false: whether it has landed."""
        return self._most > 0.0
