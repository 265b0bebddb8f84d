"""Motions that a block is told: its velocity over time, linear between given times, or its displacement, a smooth curve
through given ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from array_types import Array, Floats


@dataclass(frozen=True, eq=False)
class Prescribed:
    """times (k,) [s], increasing, the first at 0 · velocities (k, 3) [m/s] at these times; the last one goes on."""

    times: Floats
    velocities: Floats

    def velocity(self, time: float) -> Array:
        """Velocity (3,) [m/s] at a time [s]."""
        return np.array([np.interp(time, self.times, column) for column in self.velocities.T])

    def way(self, time: float) -> Array:
        """Displacement (3,) [m] since the start: the integral of the velocity."""
        k = max(int(np.searchsorted(self.times, time, side="right")) - 1, 0)
        t, v = self.times[: k + 1], self.velocities[: k + 1]
        until = 0.5 * (np.diff(t)[:, None] * (v[1:] + v[:-1])).sum(axis=0)
        return until + 0.5 * (time - t[-1]) * (v[-1] + self.velocity(time))

    def mean_velocity(self, time: float, dt: float) -> Array:
        """Mean velocity (3,) [m/s] from a time [s] on, over dt [s]."""
        inner = self.times[(self.times > time) & (self.times < time + dt)]
        at = np.concatenate([[time], inner, [time + dt]])
        v = np.array([self.velocity(t) for t in at])
        return 0.5 * (np.diff(at)[:, None] * (v[1:] + v[:-1])).sum(axis=0) / dt

    def fastest(self, start: float = 0.0, end: float = np.inf) -> float:
        """Largest speed [m/s] from a time to another [s]."""
        inside = self.velocities[(self.times > start) & (self.times < end)]
        ends = [self.velocity(time) for time in (start, end)]
        return float(np.linalg.norm([*inside, *ends], axis=1).max())

    def turning_times(self, axis: int, end: float) -> Array:
        """Times (m,) [s] up to the end at which the displacement along an axis may be largest or smallest: those at
        which the velocity vanishes, and the end."""
        t, v = self.times, self.velocities[:, axis]
        turns = np.flatnonzero(v[1:] * v[:-1] < 0.0)
        zeros = t[turns] + v[turns] / (v[turns] - v[turns + 1]) * (t[turns + 1] - t[turns])
        found = np.concatenate([zeros, t[v == 0.0], [end]])
        return np.unique(found[found <= end])


@dataclass(frozen=True, eq=False)
class PrescribedWay(Prescribed):
    """times (k,) [s], increasing, the first at 0 · ways (k, 3) [m] displacements at these times, the first one zero;
    between them a cubic spline, which starts and ends at rest and stays at its end. velocities (k, 3) [m/s]: its
    slopes."""

    ways: Floats

    @classmethod
    def through(cls, times: Array, ways: Array) -> PrescribedWay:
        """The motion through displacements (k, 3) [m] at times (k,) [s]."""
        from scipy.interpolate import CubicSpline

        slopes = CubicSpline(times, ways, bc_type="clamped")(times, 1)
        slopes[[0, -1]] = 0.0  # but for rounding
        return cls(times, slopes, ways)

    @cached_property
    def _curve(self):
        from scipy.interpolate import CubicHermiteSpline

        return CubicHermiteSpline(self.times, self.ways, self.velocities)

    @cached_property
    def _bends(self) -> list[Array]:
        """Times [s] at which each component of the velocity is largest or smallest between given times."""
        return list(self._curve.derivative(2).roots(extrapolate=False))

    def velocity(self, time: float) -> Array:
        """Velocity (3,) [m/s] at a time [s]."""
        return np.zeros(3) if time >= self.times[-1] else np.asarray(self._curve(time, 1))

    def way(self, time: float) -> Array:
        """Displacement (3,) [m] since the start."""
        return self.ways[-1].copy() if time >= self.times[-1] else np.asarray(self._curve(time))

    def mean_velocity(self, time: float, dt: float) -> Array:
        """Mean velocity (3,) [m/s] from a time [s] on, over dt [s]."""
        return (self.way(time + dt) - self.way(time)) / dt

    def fastest(self, start: float = 0.0, end: float = np.inf) -> float:
        """Largest speed [m/s] from a time to another [s], or a little more: of the largest components."""
        last = min(end, self.times[-1])
        if start >= last:
            return 0.0
        most = np.zeros(3)
        for k, bends in enumerate(self._bends):
            inside = self.times[(self.times > start) & (self.times < last)]
            at = np.concatenate([[start, last], inside, bends[(bends > start) & (bends < last)]])
            most[k] = np.abs(self._curve(at, 1)[:, k]).max()
        return float(np.linalg.norm(most))

    def turning_times(self, axis: int, end: float) -> Array:
        """Times (m,) [s] up to the end at which the displacement along an axis may be largest or smallest."""
        found = np.concatenate([self._curve.derivative().roots(extrapolate=False)[axis], self.times, [end]])
        return np.unique(found[np.isfinite(found) & (found <= end)])
