"""Faces between which only a share of the pressure of the water around acts, and that share from place to place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from array_types import Array, Floats, Ints


class PartlyWet(NamedTuple):
    """plane (m,) of the bodies · place (m, 3) [m] of a point on it · share (m,) of the pressure, 0 to 1, at all places
    of the plane that are nearest to that point. On planes that are not listed the whole pressure acts."""

    plane: Ints
    place: Floats
    share: Floats

    @classmethod
    def nowhere(cls) -> PartlyWet:
        """The whole pressure acts on all faces."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0))

    def at(self, plane: Array, place: Array) -> Array:
        """Share (k,) of the pressure at places (k, 3) [m] on planes (k,)."""
        found = np.ones(len(plane))
        for own in np.unique(self.plane[np.isin(self.plane, plane)]):
            points, there = self.plane == own, plane == own
            nearest = cKDTree(self.place[points]).query(place[there])[1]
            found[there] = self.share[points][nearest]
        return found
