"""Pools: water that is connected. Walls, dams and dry ground keep them apart, and splashes are some of their own."""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import inner, kernel


@kernel
def pools(phi, start, neighbours):
    """Number (N,) of the pool of every node with water, φ (N,) < 0, and of every dry one beside some, that of the first
    in its row; -1 elsewhere. And how many there are. start (N + 1,), neighbours: nodes that share a cell.

    Trees of nodes are joined (Galler and Fisher, CACM 7 (1964) 301): every node is visited once, in order, and not all
    over the mesh as by flooding, which took twice as long."""
    n, count = phi.shape[0], 0
    label, before = np.full(n, -1, np.int32), np.empty(n, np.int32)
    for i in range(n):
        if not phi[i] < 0.0:
            continue
        before[i] = i
        root = np.int64(i)
        for s in range(start[i], start[i + 1]):
            j = np.int64(neighbours[s])
            if not phi[j] < 0.0:
                if label[j] < 0:
                    label[j] = i
            elif j < i:
                other = _root(before, j)
                before[max(root, other)] = min(root, other)
                root = min(root, other)
    for i in range(n):
        if phi[i] < 0.0:
            if before[i] == i:
                label[i] = count
                count += 1
            else:
                label[i] = label[before[i]]
    for i in range(n):
        if label[i] >= 0 and not phi[i] < 0.0:
            s = start[i]
            while not phi[neighbours[s]] < 0.0:
                s += 1
            label[i] = label[neighbours[s]]
    return label, count


@inner
def _root(before, i):
    """The first node of the tree of node i; ways to it get shorter."""
    while before[i] != i:
        before[i] = before[before[i]]
        i = np.int64(before[i])
    return i


def own_shift(label, count: int, lack, area, total: float) -> Array:
    """Length (N,) [m] by which the surface of each pool is to rise, or to sink, for what the pool itself lacks, or has
    too much: 0 in those that are off in the other way than the total, and where there is no surface.

    label (N,), count: of `pools` · lack (N,) [m³], area (N,) [m²]: of the nodes · total [m³]: what all water
    lacks, of which the sign counts."""
    there = label >= 0
    off, surface = (
        np.bincount(label[there], values[there], minlength=count) for values in (np.sign(total) * lack, area)
    )
    length = np.where(surface > 0.0, np.maximum(off, 0.0) / np.where(surface > 0.0, surface, 1.0), 0.0)
    return np.where(there, length[label], 0.0)
