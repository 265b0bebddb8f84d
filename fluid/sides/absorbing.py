"""An absorbing side: the given flow enters, and waves that run against it leave.

Long waves over level ground, by their Riemann invariants (Stoker, Water Waves, 1957, 10.2): with h the depth and u the
velocity inwards, means over the side,

    R_in  = u + 2 sqrt(g h)   of the given flow              goes in
    R_out = -u + 2 sqrt(g h)  of the water a cell inside     goes out
    sqrt(g h_side) = (R_in + R_out) / 4,   u_side = (R_in - R_out) / 2                               (1)

This is exact for long waves of any height at normal incidence; dispersive or oblique waves are partly reflected.
Over a bed that varies along the side h is the wet area over the wet width.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from array_types import Array
from fluid.sides.inflow import Flow


@dataclass
class Absorber:
    """flow: the given flow · inward (3,) unit · places (k, 2) [m] a cell inside the side · bed (k,) [m] there · gravity

    height, speed: corrections by (1) to the level [m] and to the velocity inwards [m/s] of the given flow, kept until
    the next `update`."""

    flow: Flow
    inward: Array
    places: Array
    bed: Array
    gravity: float
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

    def update(self, depths, velocities, time: float) -> None:
        """Update height and speed by equation (1) from the depths (k,) [m] and velocities (k, 3) [m/s] at the
        places."""
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
        into = u_given + 2.0 * np.sqrt(self.gravity * h_given)
        out = -u_inside + 2.0 * np.sqrt(self.gravity * h_inside)
        depth = max(0.25 * (into + out), 0.0) ** 2 / self.gravity
        self.height, self.speed = float(depth - h_given), float(0.5 * (into - out) - u_given)
