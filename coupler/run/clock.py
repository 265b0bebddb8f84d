"""Processor time of a run by part: user and system time in seconds, assigned to named parts."""

from __future__ import annotations

import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager


class Clock:
    """Assigns processor time [s] to named parts, which do not nest.

    before: `split` of the processes that the run was in before this one.
    """

    def __init__(self, before: dict[str, float] | None = None):
        self._before = sum((before or {}).values())
        self.seconds: dict[str, float] = defaultdict(float, before or {})
        self.seconds.pop("other", None)
        self._start = time.process_time()

    @contextmanager
    def __call__(self, part: str) -> Iterator[None]:
        start = time.process_time()
        try:
            yield
        finally:
            self.seconds[part] += time.process_time() - start

    def total(self) -> float:
        """Processor seconds of the run, in all its processes."""
        return self._before + self.here()

    def here(self) -> float:
        """Processor seconds since the clock was made, in this process."""
        return time.process_time() - self._start

    def split(self) -> dict[str, float]:
        """Seconds of each part, largest first, and of all the rest as 'other'."""
        parts = dict(self.seconds)
        parts["other"] = max(0.0, self.total() - sum(parts.values()))
        return dict(sorted(parts.items(), key=lambda item: -item[1]))
