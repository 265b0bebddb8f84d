"""Cells of one shape and place in the lattice share their gradients.

A box of equal bricks has six different cells, 48 if they are mirrored, whatever its size.  The loops of a step read
gradients cell by cell: these rows stay in the first-level cache of the processor.  With a row for every cell, gradients
would be three quarters of all data read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Floats, Integers
from fluid.mesh.gradients import gradients, products_of
from fluid.numerics.spans import spans
from kernels.decorators import inner, kernel, plain

MOST_SHAPES = 64
"""Shapes that are compared one by one, 6 kB of gradients: those of a box of bricks."""
MOST_KINDS = 4096
"""Shapes that are kept apart, 400 kB of gradients: those of bricks that were halved in parts. A mesh with more, or with
fewer than four cells of a shape, has a row for every cell."""
SAME = 1e-12
"""Difference of gradients over the largest of them up to which cells count as equal: round-off of their nodes."""


@dataclass(frozen=True)
class Shapes:
    """row (M,): shape of each cell of a mesh · gradients (S, 4, 3) [1/m], products (S, 6) [1/m²] and along (S,) uint8
    of the shapes, those of their first cells; names as in `mesh.Background`."""

    row: Integers
    gradients: Floats
    products: Floats
    along: Integers

    @property
    def is_of_each_cell(self) -> bool:
        """Whether every cell has its own row, since too few are alike."""
        return len(self.gradients) == len(self.row)

    @classmethod
    def of(cls, mesh) -> Shapes:
        """The shapes of a `mesh.Background`."""
        row, first = _few(mesh)
        if len(first):
            g = mesh.gradients_of(first)
            return cls(row, g, products_of(g), mesh.along[first])
        g = gradients(mesh.nodes, mesh.cells)[0]
        row, first = _kinds(g)
        if len(first):
            g = g[first]
            return cls(row, g, products_of(g), mesh.along[first])
        return cls(np.arange(len(g), dtype=np.uint32), g, products_of(g), mesh.along)


def _few(mesh):
    """Shape (M,) of each cell and first cell (S,) of each shape; no shapes if there are more than MOST_SHAPES."""
    row, first = np.empty(len(mesh.cells), np.uint32), np.empty(MOST_SHAPES, np.int64)
    table, n = np.empty((MOST_SHAPES, 4, 3)), 0
    for some in spans(len(row)):
        n = _shapes(mesh.gradients_of(some), SAME, some.start, row, first, table, n)
        if n < 0:
            return row, first[:0]
    return row, first[:n]


def _kinds(g):
    """The result of `_few` for many shapes: cells are sorted by their gradients in millionths of the largest of the
    cell."""
    largest = np.abs(g).max(axis=(1, 2))
    share, power = np.frexp(largest)
    whole = np.rint(g.reshape(len(g), 12) / largest[:, None] * 1e6)
    key = np.column_stack([whole, np.rint(share * 1e6), power]).astype(np.int64) @ _odd_numbers(14)
    _, first, row = np.unique(key, return_index=True, return_inverse=True)
    most = min(MOST_KINDS, len(g) // 4)
    if len(first) > most or not _all_alike(g, first, row, SAME):
        return row, first[:0]
    return row.astype(np.uint32), first


def _odd_numbers(n):
    """n fixed odd numbers of 62 bits: the wrapped products with them distinguish rows of whole numbers."""
    return np.random.default_rng(7).integers(2**61, 2**62, n) | 1


@kernel
def _all_alike(g, first, row, same):
    """Whether the gradients of every cell are those of the first of its shape."""
    found = True
    for e in range(g.shape[0]):
        found = found and _alike(g[e], g[first[row[e]]], same * _largest(g[e]))
    return found


@plain
def _shapes(g, same, before, row, first, table, n):
    """Write the shapes `row` of the cells `before` and following ones, with gradients g, and append new shapes to the
    n that are there, their first cell and gradients; the number of shapes, -1 if the table is too short for them."""
    for e in range(g.shape[0]):
        size = _largest(g[e])
        s = 0
        while s < n and not _alike(g[e], table[s], same * size):
            s += 1
        if s == table.shape[0]:
            return -1
        if s == n:
            first[n] = before + e
            for a in range(4):
                for k in range(3):
                    table[n, a, k] = g[e, a, k]
            n += 1
        row[before + e] = s
    return n


@inner
def _largest(g):
    """Largest absolute entry of g (4, 3)."""
    largest = 0.0
    for a in range(4):
        for k in range(3):
            largest = max(largest, abs(g[a, k]))
    return largest


@inner
def _alike(g, other, tolerance):
    for a in range(4):
        for k in range(3):
            if abs(g[a, k] - other[a, k]) > tolerance:
                return False
    return True
