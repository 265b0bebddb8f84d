"""Vectors of those cells that have one: a field of the mesh, most of whose cells are dry, as a list.

Held by all cells, three such fields take 72 bytes a cell, and a step writes zeros to as many again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Floats, Ints
from kernels.decorators import ranged
from kernels.threads import over


class CellVectors(NamedTuple):
    """cells (n,) in ascending order · values (n, 3) of them; all other cells have zero."""

    cells: Ints
    values: Floats

    @classmethod
    def none(cls) -> CellVectors:
        """Zero everywhere."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)))

    @classmethod
    def of(cls, field) -> CellVectors:
        """Those of a field (M, 3) of all cells."""
        cells = np.flatnonzero((field != 0.0).any(axis=1))
        return cls(cells, field[cells])

    def field(self, count: int) -> Array:
        """(count, 3) of all `count` cells."""
        out = np.zeros((count, 3))
        out[self.cells] = self.values
        return out

    def carried(self, source, count: int) -> CellVectors:
        """The same with another numbering of the cells.

        source (M,): old number of each cell, of `count`; -1 for none, which has zero."""
        place = np.full(count + 1, -1, np.int64)  # the last entry stands for "none"
        place[self.cells] = np.arange(len(self.cells))
        row = place[source]
        cells = np.flatnonzero(row >= 0)
        return CellVectors(cells, self.values[row[cells]])

    def joined(self, cells, values) -> CellVectors:
        """With the values (k, 3) of further cells (k,), none of which is in the list."""
        every = np.concatenate([self.cells, cells])
        order = np.argsort(every, kind="stable")
        return CellVectors(every[order], np.concatenate([self.values, values])[order])


def places_of(wanted, cells) -> Array:
    """Place (k,) of each wanted cell (k,) in a list of cells (n,), -1 where it is not there; both ascend."""
    place = np.empty(len(wanted), np.int64)
    over(_places, len(wanted), wanted, cells, place)
    return place


@ranged
def _places(first, last, wanted, cells, place):
    low, high = 0, cells.shape[0]
    while low < high:  # the first one that is not below the first wanted one
        middle = (low + high) // 2
        if cells[middle] < wanted[first]:
            low = middle + 1
        else:
            high = middle
    at, end = np.uint64(low), np.uint64(cells.shape[0])
    for k in range(first, last):
        s = np.uint64(k)
        while at < end and cells[at] < wanted[s]:
            at += np.uint64(1)
        place[s] = np.int64(at) if at < end and cells[at] == wanted[s] else -1
