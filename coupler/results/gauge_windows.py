"""Quantities that a gauge derives from its values over time: impulse over a window, running mean, and the peak of that
mean.

Values v_n hold over the step that ends at t_n:

    impulse   I(t) = Σ v_n |[t_n - dt_n, t_n] ∩ [from, to]|
    mean      m(t) = 1/T ∫_{t-T}^{t} v dt,  T at most the time since the start
    peak      max over the time so far of |m|

A shorter mean gives a higher peak, so peaks of different runs can be compared only at the same `mean_over`. Steps
without a value (NaN: the place is inside a block) add nothing to I and are left out of m, which is NaN if none remains.
"""

from __future__ import annotations

from collections import deque

import numpy as np

from array_types import Array


class Windows:
    """The accumulated values of one gauge; impulse (from, to) [s] or None, mean_over [s] or None."""

    def __init__(self, impulse, mean_over: float | None):
        self.impulse, self.mean_over = impulse, mean_over
        self.total: Array = np.zeros(())
        self.peak = 0.0
        self._steps: deque = deque()

    def columns(self, name: str, unit: str, axes) -> tuple[tuple[str, str, str], ...]:
        """Columns that are added to those of a gauge `name`; axes: endings of its components, ("",) of a number."""
        found = []
        if self.impulse:
            window = ", within {:g} to {:g} s".format(*self.impulse) if np.isfinite(self.impulse[1]) else ""
            by_time = unit.removesuffix("/s") if unit.endswith("/s") else f"{unit} s"
            found += [(f"{name}_impulse{a}", by_time, f"value times step so far{window}") for a in axes]
        if self.mean_over:
            found += [(f"{name}_mean{a}", unit, f"mean over the last {self.mean_over:g} s") for a in axes]
            found.append((f"{name}_peak", unit, f"largest mean over {self.mean_over:g} s so far"))
        return tuple(found)

    def add(self, time: float, dt: float, value) -> list[float]:
        """Add the value(s) of the step that ends at `time`; return the values of `columns`, in that order."""
        value = np.atleast_1d(np.asarray(value, float))
        found: list[float] = []
        if self.impulse:
            within = min(time, self.impulse[1]) - max(time - dt, self.impulse[0])
            self.total = self.total + max(within, 0.0) * np.nan_to_num(value)
            found += list(self.total)
        if self.mean_over:
            mean = self._mean(time, dt, value, self.mean_over)
            self.peak = float(np.fmax(self.peak, np.linalg.norm(mean)))
            found += [*mean, self.peak]
        return found

    def save(self) -> dict[str, Array]:
        """What has been accumulated; steps (k, 2 + values): begin and end [s] of each, and its values."""
        steps = [np.r_[begin, end, value] for begin, end, value in self._steps]
        return {"total": np.array(self.total), "peak": np.array(self.peak), "steps": np.array(steps)}

    def restore(self, saved: dict[str, Array]) -> None:
        """Restore the state that `save` returned."""
        self.total, self.peak = saved["total"], float(saved["peak"])
        self._steps = deque((float(row[0]), float(row[1]), row[2:].copy()) for row in saved["steps"])

    def _mean(self, time: float, dt: float, value, over: float) -> Array:
        if np.isfinite(value).all():
            self._steps.append((time - dt, time, value))
        start = time - over
        while self._steps and self._steps[0][1] <= start:
            self._steps.popleft()
        spans = [(end - max(begin, start), v) for begin, end, v in self._steps]
        if not spans:
            return np.full_like(value, np.nan)
        return sum(span * v for span, v in spans) / sum(span for span, _ in spans)
