"""Sides that follow the water a cell inside: absorbing ones, and inflows that keep their discharge.

Absorbing: the given flow enters, and waves that run against it leave.  Long waves over level ground, by their
Riemann invariants (Stoker, Water Waves, 1957, 10.2): with h the depth and u the velocity inwards, means over the side,

    R_in  = u + 2 sqrt(g h)   of the given flow              goes in
    R_out = -u + 2 sqrt(g h)  of the water a cell inside     goes out
    sqrt(g h_side) = (R_in + R_out) / 4,   u_side = (R_in - R_out) / 2                               (1)

This is exact for long waves of any height at normal incidence; dispersive or oblique waves are partly reflected.
Over a bed that varies along the side h is the wet area over the wet width.

A side that draws water speeds up by at most a quarter of gravity, unless the water inside runs out faster already,

    u_side >= min(0, u_side before - dt g / 4, u),  sqrt(g h_side) = (R_out + u_side) / 2              (1a)

with the depth at which the outgoing wave passes a side of that velocity.  A wall that leaves water of depth h with the
acceleration a lowers its pressure at the depth d by 7/8 rho a sqrt(h d) (Westergaard, Trans. ASCE 98, 1933), which is
more than rho g d down to d = 0.77 (a/g)^2 h.  As water does not pull, it comes off the wall there: in the upper
twentieth with a quarter of gravity, everywhere where the velocity of the side jumps, as (1) has it beside a step.

Discharge: q = u h of the given flow is kept, and the water inside sets the depth, as at the upstream end of every
subcritical stream (Cunge, Holly and Verwey, Practical Aspects of Computational River Hydraulics, 1980, 2.5),

    u_side = 2 sqrt(g h_side) - R_out,   u_side h_side = q                                           (2)

with the larger root; water that falls away from the side passes it at the critical depth h³ = q²/g.  A given flow
faster than sqrt(g h) brings its own depth, until a hydraulic jump reaches the side: water inside that is deeper than

    ½ h (sqrt(1 + 8 u²/(g h)) - 1)                                                                    (3)

(Henderson, Open Channel Flow, 1966, 3.3).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from array_types import Array
from fluid.numerics.cube_root import cube_root
from fluid.sides.inflow import Flow


def outgoing_wave(
    h: float, u: float, h_inside: float, u_inside: float, gravity: float
) -> tuple[float, float]:
    """Depth [m] and velocity inwards [m/s] at the side by equation (1); h, u: of the given flow."""
    into = u + 2.0 * np.sqrt(gravity * h)
    out = -u_inside + 2.0 * np.sqrt(gravity * h_inside)
    return max(0.25 * (into + out), 0.0) ** 2 / gravity, 0.5 * (into - out)


def kept_discharge(
    h: float, u: float, h_inside: float, u_inside: float, gravity: float
) -> tuple[float, float]:
    """Depth [m] and velocity inwards [m/s] at the side by equation (2); h, u: of the given flow, which enters."""
    if h <= 0.0 or u <= 0.0:
        return h, u
    fast = u**2 >= gravity * h
    if fast and h_inside <= 0.5 * h * (np.sqrt(1.0 + 8.0 * u**2 / (gravity * h)) - 1.0):
        return h, u
    out, q = -u_inside + 2.0 * np.sqrt(gravity * h_inside), u * h
    # 2 s³ - R_out s² = g q for s = sqrt(g h_side): convex from the start of Newton's method on, beyond the root
    s = abs(out) + float(cube_root(gravity * q))
    for _ in range(MOST_STEPS):
        step = (s * s * (2.0 * s - out) - gravity * q) / (s * (6.0 * s - 2.0 * out))
        s -= step
        if step <= 1e-14 * s:
            break
    depth = max(s * s / gravity, float(cube_root(q * q / gravity)))
    return depth, q / depth


DRAWING = 0.25
"""Largest acceleration outwards of a side that draws water, over that of gravity: equation (1a)."""
MOST_STEPS = 60
"""Steps of Newton's method for equation (2), which begins at most three times as far as the root."""


@dataclass
class Absorber:
    """flow: the given flow · inward (3,) unit · places (k, 2) [m] a cell inside the side · bed (k,) [m] there · gravity
    · law: `outgoing_wave` or `kept_discharge`

    height, speed: corrections by the law to the level [m] and to the velocity inwards [m/s] of the given flow, kept
    until the next `update`."""

    flow: Flow
    inward: Array
    places: Array
    bed: Array
    gravity: float
    law: Callable = outgoing_wave
    height: float = field(default=0.0, init=False)
    speed: float = field(default=0.0, init=False)

    def as_flow(self) -> Flow:
        """The `Flow` at the side: its level and velocity."""

        def velocity(points, time):
            return self.flow.velocity(points, time) + self.speed * self.inward

        def varying(points, time):
            return self.flow.level_at(points, time) + self.height

        along = None if self.flow.varying is None else varying
        return Flow(lambda time: self.flow.level(time) + self.height, velocity, self, along)

    def points(self, depths) -> Array:
        """Points (k, 3) [m] at which `update` needs the velocity: at half the depths (k,) [m]."""
        return np.column_stack([self.places, self.bed + 0.5 * depths])

    def update(self, depths, velocities, time: float, dt: float) -> None:
        """Update height and speed by the law from the depths (k,) [m] and velocities (k, 3) [m/s] at the places; the
        side holds them for a step of dt [s], 0 at the start, where still water has not been drawn yet."""
        level = self.flow.level_at(np.column_stack([self.places, self.bed]), time)
        given = np.maximum(level - self.bed, 0.0)
        wet = (given > 0.0) | (depths > 0.0)
        if not wet.any():
            self.height = self.speed = 0.0
            return
        h_given, h_inside = given[wet].mean(), depths[wet].mean()
        share = depths[wet] / max(depths[wet].sum(), 1e-300)
        u_inside = float(share @ (np.nan_to_num(velocities[wet]) @ self.inward))
        along = self.flow.velocity(self.points(given), time) @ self.inward
        u_given = float((given / max(given.sum(), 1e-300)) @ along)
        depth, speed = self.law(h_given, u_given, h_inside, u_inside, self.gravity)
        slowest = min(0.0, u_given + self.speed - DRAWING * self.gravity * dt, u_inside)
        if speed < slowest:
            out = -u_inside + 2.0 * np.sqrt(self.gravity * h_inside)
            depth, speed = max(0.5 * (out + slowest), 0.0) ** 2 / self.gravity, slowest
        self.height, self.speed = float(depth - h_given), float(speed - u_given)
