"""Which nodes and cells lie around which: tables of rows, one a node or a cell, for the topology and its graphs."""

from __future__ import annotations

import numpy as np

from fluid.domain.layers import WORK
from fluid.numerics.spans import spans
from kernels.decorators import inner, kernel, ranged, released
from kernels.threads import over


@kernel
def first_rows(parent, n):
    """First row (n + 1,) of each number below n in an ascending list (M,) of numbers; M at the end."""
    start = np.zeros(n + 1, np.int32)
    for e in range(len(parent)):
        start[parent[e] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    return start


@kernel
def cells_of_nodes(cells, n):
    """start (n + 1,), members (4M,): the cells around each of n nodes, in order."""
    start = np.zeros(n + 1, np.uint32)
    for e in range(cells.shape[0]):
        for a in range(4):
            start[cells[e, a] + 1] += 1
    for i in range(n):
        start[i + 1] += start[i]
    filled = start[:-1].copy()
    members = np.empty(4 * cells.shape[0], np.uint32)
    for e in range(cells.shape[0]):
        for a in range(4):
            i = cells[e, a]
            members[filled[i]] = e
            filled[i] += 1
    return start, members


def neighbours_in(mesh, divided, cells, parent):
    """neighbours (M, 4); where every node is its background node, those of the parents, renumbered. divided (N,) bool:
    copies of a node that has several."""
    if len(divided) > len(mesh.nodes):
        found = np.full(cells.shape, -1, np.int32)
        rows = first_rows(parent, len(mesh.cells))
        over(_neighbours, len(cells), mesh.neighbours, cells, parent, rows, divided, found, weight=WORK)
        return found
    if cells is mesh.cells:
        return mesh.neighbours
    row = np.full(len(mesh.cells) + 1, -1, np.int32)  # the last entry stands for "no neighbour", -1
    row[parent] = np.arange(len(parent), dtype=np.int32)
    found = np.empty((len(parent), 4), np.int32)
    for some in spans(len(parent)):
        found[some] = row[mesh.neighbours[parent[some]]]
    return found


@ranged
def _neighbours(first, last, parent_neighbours, cells, parent, start, divided, found):
    """found (M, 4) ← copies of the parents' neighbours that share the three nodes of the face, where there are any.
    Where no node of the cell has a further copy, the first copy of the neighbour is known to share them.

    start (parents + 1,): first cell of each parent."""
    for e in range(first, last):
        alone = True
        for a in range(4):
            alone = alone and not divided[cells[e, a]]
        for a in range(4):
            p = parent_neighbours[parent[e], a]
            if p < 0:
                continue
            if alone:
                if start[p] < start[p + 1]:
                    found[e, a] = start[p]
                continue
            for other in range(start[p], start[p + 1]):  # elements are in the order of their parents
                shared = 0
                for b in range(4):
                    for c in range(4):
                        if b != a and cells[other, c] == cells[e, b]:
                            shared += 1
                if shared == 3:
                    found[e, a] = other
                    break


def joined_rows(parts):
    """Concatenate rows that come in parts, each (start, values, values) → start (n + 1,) of all rows, and their
    values."""
    if len(parts) == 1:
        return parts[0]
    starts, first, second = zip(*parts)
    before = np.cumsum([0, *(start[-1] for start in starts)])
    start = np.concatenate([starts[0][:1], *(s[1:] + b for s, b in zip(starts, before))])
    return start.astype(np.uint32), np.concatenate(first), np.concatenate(second)


@released
def nodes_around(first, last, cells, node_start, node_cells):
    """start (n + 1,), neighbours: nodes that share a cell with each node, in the order of its cells, and the number of
    shared cells."""
    n = last - first
    start = np.zeros(n + 1, np.uint32)
    slot = np.full(node_start.shape[0] - 1, -1, np.int64)
    around, shared = np.empty(16 * n + 64, np.uint32), np.empty(16 * n + 64, np.uint8)
    row, count = _next_around(0, first, n, cells, node_start, node_cells, slot, start, around, shared)
    while row < n:  # not where rows are filled: numba would count references to both arrays in every turn
        more = around.shape[0] + most_around(first + row, node_start)
        around = np.concatenate((around, np.empty(more, np.uint32)))
        shared = np.concatenate((shared, np.empty(more, np.uint8)))
        row, count = _next_around(row, first, n, cells, node_start, node_cells, slot, start, around, shared)
    return start, around[:count].copy(), shared[:count].copy()


@inner
def most_around(i, node_start):
    """More neighbours than node i can have."""
    return 3 * (np.int64(node_start[i + 1]) - np.int64(node_start[i]))


@inner
def _next_around(row, first, n, cells, node_start, node_cells, slot, start, around, shared):
    """Fill rows of `nodes_around`, from one on, for as long as there is room; → the next row, and how many neighbours
    there are so far."""
    count = np.int64(start[row])
    for r in range(row, n):
        i, begun = np.uint64(first + r), count
        if count + most_around(first + r, node_start) > around.shape[0]:
            return r, count
        for t in range(node_start[i], node_start[i + np.uint64(1)]):
            for a in range(4):
                j = cells[node_cells[t], a]
                if j == i:
                    continue
                if slot[j] < begun:
                    slot[j], around[np.uint64(count)], shared[np.uint64(count)] = count, j, 1
                    count += 1
                else:
                    shared[np.uint64(slot[j])] += 1
        start[np.uint64(r + 1)] = count
    return n, count


@ranged
def touch(first, last, nodes, node_start, node_cells, touched):
    """touched (M,) bool ← also the cells around these nodes (N,) bool; several threads may mark one cell."""
    for k in range(first, last):
        i = np.uint64(k)
        if nodes[i]:
            for t in range(node_start[i], node_start[i + np.uint64(1)]):
                touched[node_cells[t]] = True
