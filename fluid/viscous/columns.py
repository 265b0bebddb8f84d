"""Columns of water over the bins of the plan, whose depth and mean velocity Manning's law goes by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Floats
from fluid.domain.moments import wet_fraction
from kernels.decorators import plain, ranged
from kernels.threads import over

OF_CELL = 5
"""Cost of a cell with its columns, in usual rows."""


@dataclass(frozen=True)
class Columns:
    """Columns of water over the bins of the plan: depth (c,) [m], volume over the area that solids leave open
    (`OpenColumns`) · velocity (c, 3) [m/s], mean over the water · left (c,): share of the velocity that friction leaves
    · centre (c, 2) [m] · of_water: the Water they belong to."""

    depth: Floats
    velocity: Floats
    left: Floats
    centre: Floats
    of_water: object

    @classmethod
    def of(cls, water, phi, u) -> Columns:
        """Surface phi (N,), velocity u (N, 3) [m/s]."""
        t, (x, y, _) = water.topology, water.mesh.axes
        wet = t.cells_around(phi < 0.0)
        area = np.outer(np.diff(x), np.diff(y)).ravel()
        held, moment = wet_fraction(wet, phi, t.parts), np.empty((len(wet), 3))
        over(_moment, len(wet), wet, t.cells, t.volume, u, held, moment)
        volume, total = np.zeros(len(area)), np.zeros((len(area), 3))
        _into_columns(wet, t.background, _rows(water), held, moment, volume, total)
        middle = np.meshgrid(0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1]), indexing="ij")
        centre = np.column_stack([a.ravel() for a in middle])
        mean = total / np.maximum(volume, 1e-300)[:, None]
        depth = water.domain.open_columns.depth(volume, area)
        return cls(depth, mean, np.ones(len(area)), centre, water)

    def over(self, cells):
        """Depth (n,) [m], velocity (n, 3) [m/s] and share left (n,) of the columns that cells (n,) of the domain stand
        in, means by `Background.plan`."""
        depth, velocity, left = np.empty(len(cells)), np.empty((len(cells), 3)), np.empty(len(cells))
        columns = (self.depth, self.velocity, self.left)
        found = (depth, velocity, left)
        rows = _rows(self.of_water)
        over(
            _means, len(cells), cells, self.of_water.topology.background, rows, columns, found, weight=OF_CELL
        )
        return found


def _rows(water):
    """`Background.plan` as start, column and share."""
    plan = water.mesh.plan
    return plan.indptr, plan.indices, plan.data


@ranged
def _moment(first, last, wet, cells, volume, u, held, moment):
    """held ← volume times what it holds, the share, and moment ← that times the mean velocity of the corners."""
    for s in range(first, last):
        e = np.uint64(wet[s])
        a, b = np.uint64(cells[e, 0]), np.uint64(cells[e, 1])
        c, d = np.uint64(cells[e, 2]), np.uint64(cells[e, 3])
        held[s] *= volume[e]
        for k in range(3):
            moment[s, k] = held[s] * (0.25 * (u[a, k] + u[b, k] + u[c, k] + u[d, k]))


@plain
def _into_columns(wet, background, rows, held, moment, volume, total):
    """Add the volumes (n,) and moments (n, 3) of the cells to their columns, in the order of the cells."""
    start, column, share = rows
    for s in range(wet.shape[0]):
        row = background[wet[s]]
        for t in range(start[row], start[row + 1]):
            c = column[t]
            volume[c] += share[t] * held[s]
            for k in range(3):
                total[c, k] += share[t] * moment[s, k]


@ranged
def _means(first, last, cells, background, rows, columns, found):
    start, column, share = rows
    depth, velocity, left = columns
    mean_depth, mean_velocity, mean_left = found
    for s in range(first, last):
        row = background[cells[s]]
        d, u0, u1, u2, rest = 0.0, 0.0, 0.0, 0.0, 0.0
        for t in range(start[row], start[row + 1]):
            c = column[t]
            d += share[t] * depth[c]
            u0 += share[t] * velocity[c, 0]
            u1 += share[t] * velocity[c, 1]
            u2 += share[t] * velocity[c, 2]
            rest += share[t] * left[c]
        mean_depth[s], mean_left[s] = d, rest
        mean_velocity[s, 0], mean_velocity[s, 1], mean_velocity[s, 2] = u0, u1, u2
