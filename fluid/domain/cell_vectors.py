"""Vectors of those cells that have one: a field of the mesh, most of whose cells are dry, as a list.

Held by all cells, three such fields take 72 bytes a cell, and a step writes zeros to as many again."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Floats, Ints
from kernels.decorators import inner, kernel, released
from kernels.threads import found_over


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
        return CellVectors(*_carried(self.cells, self.values, source, count))

    def joined(self, cells, values) -> CellVectors:
        """With the values (k, 3) of further cells (k,), none of which is in the list."""
        every = np.concatenate([self.cells, cells])
        order = np.argsort(every, kind="stable")
        return CellVectors(every[order], np.concatenate([self.values, values])[order])


@kernel
def _carried(cells, values, source, count):
    """`CellVectors.carried`: the cells (k,) that continue one of the listed `cells` (n,), and the values (k, 3)."""
    place, k = np.full(count, -1, np.int32), 0
    for s in range(len(cells)):
        place[cells[s]] = s
    for e in range(len(source)):
        k += source[e] >= 0 and place[source[e]] >= 0
    found, taken, k = np.empty(k, np.int64), np.empty((k, 3)), 0
    for e in range(len(source)):
        if source[e] >= 0 and place[source[e]] >= 0:
            found[k] = e
            for c in range(3):
                taken[k, c] = values[place[source[e]], c]
            k += 1
    return found, taken


def places_among(wanted, cells) -> Array:
    """Places in a list of cells (n,) of those of the wanted ones (k,) that it holds; both ascend."""
    return found_over(_places_among, len(wanted), wanted, cells)


@released
def _places_among(first, last, wanted, cells):
    found, n = np.empty(last - first, np.int64), np.uint64(0)
    row, end, one = (
        first_from(cells, wanted[first] if first < last else 0),
        np.uint64(cells.shape[0]),
        np.uint64(1),
    )
    for s in range(first, last):
        cell, beyond, step = wanted[np.uint64(s)], row, one
        while beyond < end and cells[beyond] < cell:  # farther and farther on, then back
            row = beyond + one
            beyond, step = beyond + step, step + step
        beyond = min(beyond, end)
        while row < beyond:
            middle = (row + beyond) >> one
            if cells[middle] < cell:
                row = middle + one
            else:
                beyond = middle
        if row < end and cells[row] == cell:
            found[n] = row
            n += one
    return found[: np.int64(n)].copy()


@inner
def first_from(cells, wanted):
    """Place (np.uint64) of the first cell of an ascending list (n,) that is not below the wanted one, n for none.

    Loops over another ascending list start from there in each range, and go on along both."""
    low, high = np.uint64(0), np.uint64(cells.shape[0])
    while low < high:
        middle = (low + high) >> np.uint64(1)
        if cells[middle] < wanted:
            low = middle + np.uint64(1)
        else:
            high = middle
    return low
