"""What solids take of upright lines: from where to where each line runs inside of one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Ints
from fluid.domain.point_location import SKIN
from kernels.decorators import inner, kernel

UPRIGHT = 0.1
"""Size of the upward part of a unit normal up to which a face stands upright: a line along it may run in its skin."""


class Spans(NamedTuple):
    """Parts of upright lines inside solids: line (k,) number of the line · low, high (k,) [m] heights z of the ends.
    Those of several solids on one line may overlap."""

    line: Ints
    low: Floats
    high: Floats


def solid_spans(water, places) -> Spans:
    """What the bodies that cut the water take of the upright lines through places (m, 2) [m], within the heights of the
    mesh: exact, since bodies are half spaces in common.

    A line that is nowhere deeper behind the upright faces of a body than their skin (`point_location.py`) runs beside
    it."""
    low, high = water.mesh.bounds[:, 2]
    planes = water.domain.memory.bodies.planes()
    return Spans(*_spans(np.asarray(places, float), planes, SKIN * water.mesh.finest, low, high))


@kernel
def _spans(places, planes, skin, lowest, highest):
    """`Spans` of lines through places (m, 2) [m], from lowest to highest [m]."""
    normal, offset, start = planes.normal, planes.offset, planes.start
    line, low, high = np.empty(16, np.int64), np.empty(16), np.empty(16)
    n = 0
    for i in range(len(places)):
        for body in range(len(start) - 1):
            first, last = start[body], start[body + 1]
            bottom, top = _span(normal, offset, first, last, places[i, 0], places[i, 1], skin)
            bottom, top = max(bottom, lowest), min(top, highest)
            if bottom >= top:
                continue
            if n == len(line):
                line = np.concatenate((line, np.empty(n, np.int64)))
                low, high = np.concatenate((low, np.empty(n))), np.concatenate((high, np.empty(n)))
            line[n], low[n], high[n] = i, bottom, top
            n += 1
    return line[:n].copy(), low[:n].copy(), high[:n].copy()


@inner
def _span(normal, offset, first, last, x, y, skin):
    """Ends [m] of what the body with the planes first ... last - 1 has of the upright line through (x, y); the upper
    end is the lower one where it has nothing."""
    low, high, low_behind, high_behind = -np.inf, np.inf, -np.inf, np.inf
    for p in range(first, last):
        up = normal[p, 2]
        left = offset[p] - normal[p, 0] * x - normal[p, 1] * y
        behind = left - skin if abs(up) <= UPRIGHT else left
        if up == 0.0:
            if behind <= 0.0:
                return 0.0, 0.0
        elif up > 0.0:
            high, high_behind = min(high, left / up), min(high_behind, behind / up)
        else:
            low, low_behind = max(low, left / up), max(low_behind, behind / up)
        if low_behind >= high_behind:
            return 0.0, 0.0
    return low, high
