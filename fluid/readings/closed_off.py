"""Water that no air reaches: parts of it that share no node with the rest and have no surface of their own.

The pressure in such a part follows from what moves its walls alone. It may be a chamber, or one that the thresholds of
the covers close (`covers.Connection`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from array_types import Array
from fluid.domain.covers import components

if TYPE_CHECKING:
    from fluid.step.water import Water

LEAST = 1.0
"""Volume from which a part counts, in cells of its place (h³): those between stacked blocks are many and small."""


class ClosedOff(NamedTuple):
    """volume [m³] · place (3,) [m]: its centre."""

    volume: float
    place: Array


def closed_off(water: Water) -> list[ClosedOff]:
    """The parts of the water without a surface, an open side or a sea, the largest first."""
    t = water.topology
    part = components(t.cells, len(t.nodes))
    count = int(part.max(initial=-1)) + 1
    breathes = (water.level_set >= 0.0) | water.lets_air_out
    has_air = np.zeros(count, bool)
    has_air[part[breathes[t.cells].any(axis=1)]] = True
    volume = np.bincount(part, t.volume, count)
    in_cells = np.bincount(part, t.volume / water.mesh.local_size[t.background] ** 3, count)
    found = []
    for k in np.flatnonzero(~has_air & (in_cells > LEAST)):
        own = part == k
        middle = t.nodes[t.cells[own]].mean(axis=1)
        found.append(ClosedOff(float(volume[k]), np.average(middle, axis=0, weights=t.volume[own])))
    return sorted(found, key=lambda one: -one.volume)
