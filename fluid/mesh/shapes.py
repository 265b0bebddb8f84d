"""Cells of one shape and place in the lattice share their gradients.

A box of equal bricks has six different cells, 48 if they are mirrored, whatever its size.  The loops of a step read
gradients cell by cell: these rows stay in the first-level cache of the processor.  With a row for every cell, gradients
would be three quarters of all data read.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Bools, Floats, Integers
from kernel_decorators import inner, kernel

MOST_SHAPES = 64
"""Shapes that are compared one by one, 6 kB of gradients: those of a box of bricks."""
MOST_KINDS = 4096
"""Shapes that are kept apart, 400 kB of gradients: those of bricks that were halved in parts. A mesh with more, or with
fewer than four cells of a shape, has a row for every cell."""
SAME = 1e-12
"""Difference of gradients over the largest of them up to which cells count as equal: round-off of their nodes."""


@dataclass(frozen=True)
class Shapes:
    """row (M,): shape of each cell of a mesh · gradients (S, 4, 3) [1/m], products (S, 6) [1/m²] and upright (S,) bool
    of the shapes, those of their first cells; names as in `mesh.Background`."""

    row: Integers
    gradients: Floats
    products: Floats
    upright: Bools

    @classmethod
    def of(cls, mesh) -> Shapes:
        """The shapes of a `mesh.Background`."""
        row, first = _shapes(mesh.gradients, MOST_SHAPES, SAME)
        if len(first) == 0:
            row, first = _kinds(mesh.gradients)
        if len(first) == 0:
            return cls(
                np.arange(len(mesh.gradients), dtype=np.uint32), mesh.gradients, mesh.products, mesh.upright
            )
        return cls(row, mesh.gradients[first], mesh.products[first], mesh.upright[first])


def _kinds(g):
    """The result of `_shapes` for many shapes: cells are sorted by their gradients in millionths of the largest of the
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


@kernel
def _shapes(g, most, same):
    """Shape (M,) of each cell and first cell (S,) of each shape; no shapes if there are more than `most`."""
    row, first, n = np.empty(g.shape[0], np.uint32), np.empty(most, np.int64), 0
    for e in range(g.shape[0]):
        size = _largest(g[e])
        s = 0
        while s < n and not _alike(g[e], g[first[s]], same * size):
            s += 1
        if s == most:
            return row, first[:0].copy()
        if s == n:
            first[n] = e
            n += 1
        row[e] = s
    return row, first[:n].copy()


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
