"""Flows through a side: steady streams, records, bores and solitary waves, as `Flow`s.

Directions: `inward` (3,), unit, level above z = 0 of the tank's coordinates, bed at z = `bed`.
"""

from __future__ import annotations

import numpy as np

from fluid.sides.inflow import Flow


def steady(inward, level: float, speed: float) -> Flow:
    """A constant level [m] and a constant uniform velocity [m/s]."""
    return record(inward, [0.0], [level], [speed])


def record(inward, times, levels, speeds) -> Flow:
    """Levels [m] and speeds [m/s] at times [s], linear in between, with the first and last values kept before and
    after."""
    inward, times = np.asarray(inward, float), np.asarray(times, float)

    def velocity(points, time):
        return np.broadcast_to(inward * np.interp(time, times, speeds), (len(points), 3))

    return Flow(lambda time: float(np.interp(time, times, levels)), velocity)


def record_along(inward, times, places, levels, speeds, sideways) -> Flow:
    """A record that differs along its side: levels [m], speeds inwards and sideways [m/s] (t, k) at times (t,) [s] and
    places (k,) [m] along the side, linear between both, with the end values kept beyond."""
    inward, times = np.asarray(inward, float), np.asarray(times, float)
    axis = 1 if abs(inward[0]) > 0.5 else 0
    along = np.zeros(3)
    along[axis] = 1.0

    def at(table, points, time):
        now = np.array([np.interp(time, times, column) for column in np.asarray(table, float).T])
        return np.interp(points[:, axis], places, now)

    def level(time: float) -> float:
        return float(np.mean([np.interp(time, times, column) for column in np.asarray(levels, float).T]))

    def velocity(points, time):
        across = at(speeds, points, time)[:, None] * inward
        return across + at(sideways, points, time)[:, None] * along

    return Flow(level, velocity, varying=lambda points, time: at(levels, points, time))


def tide(inward, level) -> Flow:
    """A still sea whose level(time) [m] changes slowly; the velocity comes from the absorbing side alone."""
    still = np.zeros_like(np.asarray(inward, float))
    return Flow(level, lambda points, time: np.broadcast_to(still, (len(points), 3)))


def bore_speed(ahead: float, behind: float, gravity: float) -> tuple[float, float]:
    """Speeds (front, water behind it) [m/s] of a bore from depth `behind` into still water of depth `ahead`:

    c² = g h₂ (h₁ + h₂) / (2 h₁),  u = c (1 - h₁/h₂)    (mass and momentum across the jump; Stoker 1957, 10.6)"""
    front = np.sqrt(gravity * behind * (ahead + behind) / (2.0 * ahead))
    return float(front), float(front * (1.0 - ahead / behind))


def dry_bore_speed(depth: float, gravity: float) -> float:
    """Speed [m/s] of a surge of this depth [m] at the side onto dry level ground: u = sqrt(g h).

    Where a dam of depth H was removed at once, h = 4/9 H and u = 2/3 sqrt(g H) at all later times (Ritter, Z. VDI 36
    (1892) 947); without friction the tip advances at 2 sqrt(g H) = 3 sqrt(g h)."""
    return float(np.sqrt(gravity * depth))


def n_wave(
    inward, bed: float, depth: float, height: float, gravity: float, middle: float, sign: float = 1.0
) -> Flow:
    """An N-wave with trough and crest of equal height over a depth [m]; its middle passes the side at time `middle`
    [s].

    η = 3 sqrt(3)/2 H sech²θ tanh θ,  θ = γ c (t - middle),  γ d = 3/2 sqrt(sqrt(3/4) H/d),  c = sqrt(g d)
    (Tadepalli and Synolakis, Proc. R. Soc. Lond. A 445 (1994) 99), u = c η/(d + η), which conserves volume. sign: 1
    trough first, -1 crest first."""
    inward, c = np.asarray(inward, float), np.sqrt(gravity * depth)
    rate = 1.5 * np.sqrt(np.sqrt(0.75) * height / depth) * c / depth

    def elevation(time: float) -> float:
        phase = np.clip(rate * (time - middle), -300.0, 300.0)
        return float(sign * 1.5 * np.sqrt(3.0) * height * np.tanh(phase) / np.cosh(phase) ** 2)

    def velocity(points, time):
        eta = elevation(time)
        return np.broadcast_to(inward * c * eta / (depth + eta), (len(points), 3))

    return Flow(lambda time: bed + depth + elevation(time), velocity)


class SolitaryWave:
    """A solitary wave of height H on depth d; crest at the side at time `crest` [s].

    order 1: η = H sech²[κ(ct - ..)], κ = sqrt(3H/4d³), c = sqrt(g(d + H)), u = c η/(d + η), uniform over the depth
    (Goring, Caltech report KH-R-38, 1978: the mean velocity that carries the wave's volume).
    order 3: η, c and u(z) of Grimshaw, J. Fluid Mech. 46 (1971) 611, as in Lee, Skjelbreia, Raichlen,
    J. Waterw. Port Coast. Ocean Div. 108 (1982) 200."""

    def __init__(self, depth: float, height: float, gravity: float, crest: float, order: int = 3):
        self.depth, self.height, self.gravity, self.crest, self.order = depth, height, gravity, crest, order
        e = height / depth
        if order == 1:
            self.speed = float(np.sqrt(gravity * (depth + height)))
            self.rate = np.sqrt(0.75 * e) / depth
        else:
            self.speed = float(np.sqrt(gravity * depth * (1.0 + e - e**2 / 20.0 - 3.0 * e**3 / 70.0)))
            self.rate = np.sqrt(0.75 * e) * (1.0 - 0.625 * e + 71.0 / 128.0 * e**2) / depth

    def _sech2(self, time):
        return 1.0 / np.cosh(self.rate * self.speed * (time - self.crest)) ** 2

    def elevation(self, time):
        """η [m] at the side."""
        e, s = self.height / self.depth, self._sech2(time)
        if self.order == 1:
            return self.height * s
        t = 1.0 - s
        return self.depth * (e * s - 0.75 * e**2 * s * t + e**3 * (0.625 * s * t - 101.0 / 80.0 * s**2 * t))

    def speed_at(self, above_bed, time):
        """Horizontal velocity [m/s] at heights (n,) above the bed."""
        e, s = self.height / self.depth, self._sech2(time)
        if self.order == 1:
            eta = self.elevation(time)
            return np.full(np.shape(above_bed), self.speed * eta / (self.depth + eta))
        Z = (np.clip(above_bed, 0.0, self.depth + self.height) / self.depth) ** 2
        second = -0.25 * s + s**2 + Z * (1.5 * s - 2.25 * s**2)
        third = (
            0.475 * s
            + 0.2 * s**2
            - 1.2 * s**3
            + Z * (-1.5 * s - 3.75 * s**2 + 7.5 * s**3)
            + Z**2 * (-0.375 * s + 45.0 / 16.0 * s**2 - 45.0 / 16.0 * s**3)
        )
        return np.sqrt(self.gravity * self.depth) * (e * s - e**2 * second - e**3 * third)

    def flow(self, inward, bed: float) -> Flow:
        """The wave through a side over the bed at z = `bed` [m]."""
        inward = np.asarray(inward, float)

        def velocity(points, time):
            return self.speed_at(points[:, 2] - bed, time)[:, None] * inward

        return Flow(lambda time: bed + self.depth + float(self.elevation(time)), velocity)
