"""Pools: water that is connected. Walls, dams and dry ground keep them apart, and splashes are some of their own."""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import kernel


@kernel
def pools(phi, start, neighbours):
    """Number (N,) of the pool of every node with water, φ (N,) < 0, and of every dry one beside some, that of the first
    in its row; -1 elsewhere. And how many there are. start (N + 1,), neighbours: nodes that share a cell."""
    n, count = phi.shape[0], 0
    label, stack = np.full(n, -1, np.int32), np.empty(n, np.int32)
    for seed in range(n):
        if label[seed] >= 0 or not phi[seed] < 0.0:
            continue
        label[seed], stack[0], height = count, seed, 1
        while height > 0:
            height -= 1
            i = stack[height]
            for s in range(start[i], start[i + 1]):
                j = neighbours[s]
                if label[j] < 0 and phi[j] < 0.0:
                    label[j], stack[height] = count, j
                    height += 1
        count += 1
    for i in range(n):
        s = start[i]
        while not phi[i] < 0.0 and label[i] < 0 and s < start[i + 1]:
            if phi[neighbours[s]] < 0.0:
                label[i] = label[neighbours[s]]
            s += 1
    return label, count


def own_shift(label, count: int, lack, area, most: float) -> Array:
    """Length (N,) [m] by which the surface of each pool is to rise, or to sink, for what the pool itself lacks, or has
    too much: 0 in those that are off in the other way than the total, and where there is no surface.

    label (N,), count: of `pools` · lack (N,) [m³], area (N,) [m²]: of the nodes · most [m³]: of the total, whose sign
    counts."""
    there = label >= 0
    off, surface = (
        np.bincount(label[there], values[there], minlength=count) for values in (np.sign(most) * lack, area)
    )
    length = np.where(surface > 0.0, np.maximum(off, 0.0) / np.where(surface > 0.0, surface, 1.0), 0.0)
    return np.where(there, length[label], 0.0)
