"""Pools: water that is connected. Walls, dams and dry ground keep them apart, and splashes are some of their own."""

from __future__ import annotations

import numpy as np

from array_types import Array
from kernels.decorators import inner, kernel, plain, ranged, released
from kernels.threads import found_over, over

WORK = 3
"""Cost of a node, in usual rows."""
BESIDE = -2
"""Mark of a dry node beside water until it has its number."""


def pools(phi, start, neighbours) -> tuple[Array, int]:
    """Number (N,) of the pool of every node with water, φ (N,) < 0, and of every dry one beside some, that of the first
    in its row; -1 elsewhere. And how many there are. start (N + 1,), neighbours: nodes that share a cell.

    Trees of nodes are joined (Galler and Fisher, CACM 7 (1964) 301), in ranges of nodes and then along their borders.
    The root of a tree is its lowest node, so that numbers do not depend on the ranges."""
    n = len(phi)
    label, before = np.empty(n, np.int32), np.empty(n, np.uint32)
    pairs = found_over(_trees, n, phi, start, neighbours, label, before, weight=WORK, pieces=1)
    _join(phi, pairs, label, before)
    roots = found_over(_roots, n, phi, before)
    label[roots] = np.arange(len(roots), dtype=np.int32)
    over(_numbers, n, phi, start, neighbours, before, label)
    return label, len(roots)


@released
def _trees(first, last, phi, start, neighbours, label, before):
    """Trees of the water of a range: the node before (N,) each one, a root before itself; marks of the range, BESIDE or
    -1, in label (N,). → pairs (k, 2) of a node with water and one beyond the range that is to be joined to it."""
    for k in range(first, last):
        i = np.uint64(k)
        label[i], before[i] = -1, i
    low, high = np.uint64(first), np.uint64(last)
    pairs, count = np.empty((_leaving(first, last, phi, start, neighbours), 2), np.uint32), np.uint64(0)
    for k in range(first, last):
        i = np.uint64(k)
        if not phi[i] < 0.0:
            continue
        root = i
        for s in range(start[i], start[i + np.uint64(1)]):
            j = np.uint64(neighbours[s])
            if phi[j] < 0.0:
                if j > i:
                    continue
                if j >= low:
                    if before[j] != root:
                        root = _joined(before, root, _root(before, j))
                    continue
            elif low <= j < high:
                label[j] = BESIDE
                continue
            pairs[count, 0], pairs[count, 1] = i, j
            count += np.uint64(1)
    return pairs[: np.int64(count)].copy()


@inner
def _leaving(first, last, phi, start, neighbours):
    """How many neighbours beyond a range the nodes with water in it have. Were `pairs` made longer where it is filled,
    numba would count references to it in every turn of the loop, which takes four times as long."""
    if first == 0 and last == phi.shape[0]:
        return 0
    low, high, count = np.uint64(first), np.uint64(last), 0
    for k in range(first, last):
        i = np.uint64(k)
        if phi[i] < 0.0:
            for s in range(start[i], start[i + np.uint64(1)]):
                count += not low <= neighbours[s] < high
    return count


@kernel
def _join(phi, pairs, label, before):
    """Join the trees of different ranges at pairs of nodes, and mark dry nodes of the pairs."""
    for k in range(pairs.shape[0]):
        i, j = np.uint64(pairs[k, 0]), np.uint64(pairs[k, 1])
        if phi[j] < 0.0:
            _joined(before, _root(before, i), _root(before, j))
        else:
            label[j] = BESIDE


@released
def _roots(first, last, phi, before):
    """The roots of the range, in order."""
    found, count = np.empty(last - first, np.int32), 0
    for i in range(first, last):
        if phi[i] < 0.0 and before[i] == i:
            found[count] = i
            count += 1
    return found[:count].copy()


@ranged
def _numbers(first, last, phi, start, neighbours, before, label):
    """Numbers of the range, from those of the roots."""
    for k in range(first, last):
        i = np.uint64(k)
        at = i
        if not phi[i] < 0.0:
            if label[i] != BESIDE:
                continue
            s = start[i]
            while not phi[neighbours[s]] < 0.0:
                s += 1
            at = np.uint64(neighbours[s])
        while before[at] != at:
            at = np.uint64(before[at])
        if at != i:
            label[i] = label[at]


@inner
def _root(before, i):
    """The root of the tree of node i; ways to it get shorter."""
    while before[i] != i:
        before[i] = before[np.uint64(before[i])]
        i = np.uint64(before[i])
    return i


@inner
def _joined(before, root, other):
    """The lower of two roots, now before the other."""
    low = min(root, other)
    before[max(root, other)] = low
    return low


def own_shift(label, count: int, band, water, area, total: float) -> Array:
    """Length (n,) [m] by which the surface at the nodes of the band (n,) is to rise, or to sink, for what its pool
    lacks, or has too much: 0 in those that are off in the other way than the total, and where there is no surface.

    label (N,), count: of `pools` · water: W, and what is inside and near the surface of it (N,) [m³] · area (N,) [m²] ·
    total [m³]: what all water lacks, of which the sign counts."""
    off, surface = np.zeros((2, count))
    _of_pools(label, water, np.sign(total), area, off, surface)
    length = np.where(surface > 0.0, np.maximum(off, 0.0) / np.where(surface > 0.0, surface, 1.0), 0.0)
    pool = label[band]
    return np.where(pool >= 0, length[pool], 0.0)


@plain
def _of_pools(label, water, sign, area, off, surface):
    """What each pool lacks, times the sign, and its area (count,), both zero at first."""
    carried, inner, near = water
    for k in range(label.shape[0]):
        i = np.uint64(k)
        if label[i] >= 0:
            pool = np.uint64(label[i])
            off[pool] += sign * (carried[i] - inner[i] - near[i])
            surface[pool] += area[i]
