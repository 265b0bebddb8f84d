"""Layers of nodes around others, in an order that does not depend on the threads.

Layer k + 1 holds the nodes that share a cell with layer k and are in no layer before it, in the order in which a walk
through layer k and the neighbours of its nodes comes to them. Each thread walks through a part of layer k and lists
what it finds; the lists are then gone through one after the other, and of a node that several of them hold the first
one counts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Ints
from kernels.decorators import plain, ranged, released
from kernels.threads import found_over, marked, over

WORK = 10
"""Cost of going through the neighbours of a node, or the cells around it, in visits of a node."""


BARRED = np.int32(np.iinfo(np.int32).max)
"""Place of nodes that layers may not hold."""


class Layers(NamedTuple):
    """order (n,): nodes, layer by layer · start (depth + 2,): layer k is order[start[k] : start[k + 1]] · place (N,)
    int32: where each node stands in `order`, -1 if it does not, BARRED if it may not."""

    order: Ints
    start: Ints
    place: Array


_ANY = np.zeros(0, bool)


def layers_around(seed, depth: int, start, around, among=None) -> Layers:
    """The seed nodes (N,) bool that have neighbours, in their order, as layer 0, and `depth` layers around them.

    start, around: `Topology.around` · among (N,) bool: the nodes that layers may hold, None: all."""
    place, layer_start = np.empty(len(seed), np.int32), np.zeros(depth + 2, np.int64)
    over(_nowhere, len(seed), _ANY if among is None else among, place)
    seeds, order = marked(seed), np.empty(len(seed), np.int64)
    seeds = found_over(_with_neighbours, len(seeds), seeds, start, place)
    layer_start[1] = count = len(seeds)
    over(_put_first, count, seeds, order, place)
    for layer in range(1, depth + 1):
        before = order[layer_start[layer - 1] : count]
        rows = (layer_start[layer - 1], before, place, start, around)
        found = found_over(_beyond, len(before), *rows, weight=WORK, pieces=1)
        count = _append(found, start, count, order, place)
        layer_start[layer + 1] = count
    return Layers(order[:count].copy(), layer_start, place)


@ranged
def _nowhere(first, last, among, place):
    for j in range(first, last):
        i = np.uint64(j)
        place[i] = -1 if among.shape[0] == 0 or among[i] else BARRED


@released
def _with_neighbours(first, last, seeds, start, place):
    """Those of the listed nodes that have neighbours and may stand in layers, in order."""
    found, n = np.empty(last - first, np.int64), 0
    for s in range(first, last):
        i = np.uint64(seeds[s])
        if place[i] < 0 and start[i + np.uint64(1)] > start[i]:
            found[n] = seeds[s]
            n += 1
    return found[:n].copy()


@ranged
def _put_first(first, last, seeds, order, place):
    for s in range(first, last):
        order[s], place[seeds[s]] = seeds[s], s


@plain
def _append(found, start, count, order, place):
    """Number of nodes in `order` (n,) after those of the list that have neighbours and stand nowhere yet."""
    for s in range(found.shape[0]):
        i = np.uint64(found[s])
        if place[i] < 0 and start[i + np.uint64(1)] > start[i]:
            order[count], place[i] = found[s], count
            count += 1
    return count


@released
def _beyond(first, last, begun, layer, place, start, around):
    """Neighbours of the nodes of a layer that stand nowhere yet. `begun`: place of the first node of the layer.

    What a range has listed it marks as its own in `place`. Another thread may write over the mark; the node is then
    listed twice, which `_append` sees. There is room for all neighbours from the start: where a loop may change to a
    longer array, numba counts references to it in every turn."""
    own, most = np.int32(-2 - begun - first), 0
    for s in range(first, last):
        i = np.uint64(layer[np.uint64(s)])
        most += np.int64(start[i + np.uint64(1)]) - np.int64(start[i])
    found, n = np.empty(most, np.int64), np.uint64(0)
    for s in range(first, last):
        i = np.uint64(layer[np.uint64(s)])
        for t in range(start[i], start[i + np.uint64(1)]):
            j = around[t]
            if place[j] < 0 and place[j] != own:
                place[j] = own
                found[n] = j
                n += np.uint64(1)
    return found[: np.int64(n)]
