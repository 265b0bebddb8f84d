"""The times at which a run writes its output, evenly spaced within the run, and its checkpoints."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from coupler.case.case import Case

ROUNDING = 1e-9
"""Share of an interval within which a time counts as reached."""
OUTPUTS, CHECKPOINTS = 100, 10
"""Default numbers of outputs and checkpoints of a run."""
MOST_OUTPUTS = 100_000
"""More written states are a mistake of the unit: an hour of film has 90 000 pictures."""


@dataclass(frozen=True)
class Schedule:
    """Outputs at span k/count for k = 1, 2, ... before `end`, and at `end` [s].

    A run that goes on beyond its first end keeps the interval of its outputs.
    """

    span: float
    count: int
    end: float

    @classmethod
    def of(cls, case: Case) -> Schedule:
        """The schedule of a new run, with the interval of the case if it divides the end, else with a near one that
        does."""
        end, every = case.time.end, case.time.output_every
        count = max(1, round(end / every)) if every else OUTPUTS
        if every is not None and abs(every * count - end) < ROUNDING * every:
            return cls(every, 1, end)
        return cls(end, count, end)

    @property
    def interval(self) -> float:
        """Time between two outputs [s]: a step ends at each, so none is longer."""
        return self.span / self.count

    def until(self, end: float) -> Schedule:
        """The same outputs with another end [s]."""
        return replace(self, end=end)

    def next_output(self, time: float) -> float:
        """The first output after a time [s]. An end that is one of them but for rounding is that very number, 3 x 0.1 s
        and not 0.3 s, so that a run that goes on beyond it takes the steps of one with the later end."""
        whole, part = divmod(_intervals(time, self.interval) + 1, self.count)
        target = self.span * whole + self.span * part / self.count
        return target if target < self.end * (1.0 + ROUNDING) else self.end


def checkpoint_interval(case: Case) -> float:
    """Time between two checkpoints [s], 0 for none at all."""
    every = case.time.checkpoint_every
    return case.time.end / CHECKPOINTS if every is None else every


def first_part(case: Case, end: float) -> tuple[str, ...]:
    """Overrides KEY=VALUE with which a run of a case ends at `end` [s] after the first steps of the whole run: outputs
    and checkpoints, which are at hundredths and tenths of a run by default, keep their intervals."""
    return (
        f"time.end={end!r}",
        f"time.output_every={Schedule.of(case).interval!r}",
        f"time.checkpoint_every={checkpoint_interval(case)!r}",
    )


def next_multiple(time: float, every: float) -> float:
    """The first multiple of an interval [s] after a time [s]."""
    return every * (_intervals(time, every) + 1)


def _intervals(time: float, every: float) -> int:
    """Whole intervals up to a time, which counts as the next multiple if only rounding misses it."""
    return math.floor(time / every * (1.0 + 1e-12) + ROUNDING)
