"""Nodes beyond the surface in the viscous stage.

A cell that the surface cuts has dry corners, and its stress acts on these, too; in a liquid that is drawn out a half
and more of it does. But what a dry node becomes of its own is lost: its velocity is continued from the water at the end
of the step. So these nodes i change with the wet ones j around them in the stage itself,

    d_i = P_i Σ_j s_ij d_j,        r_j ← r_j + Σ_i s_ij P_i r_i,        m_j ← m_j + Σ_i s_ij m_i               (1)

with the projector P_i of the sides of the tank and shares s_ij that go by the number of cells that i and j share, over
the square of their distance (as in `extrapolation.py`), and have the sum 1: momentum is handed on, the form stays
symmetric and positive.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Ints
from kernels.decorators import kernel


class Beyond(NamedTuple):
    """nodes (k,) beyond the surface · start (k + 1,) of their rows in wet (n,), the nodes that they change with, and
    share (n,) of each."""

    nodes: Ints
    start: Ints
    wet: Ints
    share: Floats

    @classmethod
    def none(cls) -> Beyond:
        """No nodes."""
        return cls(np.zeros(0, np.int64), np.zeros(1, np.int64), np.zeros(0, np.int64), np.zeros(0))


def beyond_surface(topology, dry, wet) -> Beyond:
    """The nodes dry (n,) that have neighbours among the nodes wet (N,) bool."""
    return Beyond(*_rows(dry, wet, topology.around_by_cells, topology.nodes))


@kernel
def _rows(dry, wet, around_by_cells, place):
    start, around, shared = around_by_cells
    most = 0
    for i in dry:
        most += start[i + 1] - start[i]
    nodes, first = np.empty(len(dry), np.int64), np.zeros(len(dry) + 1, np.int64)
    neighbour, share = np.empty(most, np.int64), np.empty(most)
    n, end = 0, 0
    for i in dry:
        total, begin = 0.0, end
        for s in range(start[i], start[i + 1]):
            j = around[s]
            if wet[j]:
                square = 0.0
                for k in range(3):
                    square += (place[i, k] - place[j, k]) ** 2
                neighbour[end], share[end] = j, shared[s] / square
                total += share[end]
                end += 1
        if end > begin:
            share[begin:end] /= total
            nodes[n], first[n + 1] = i, end
            n += 1
    return nodes[:n].copy(), first[: n + 1].copy(), neighbour[:end].copy(), share[:end].copy()


@kernel
def hand_on(beyond, r):
    """Pass r (N, m) of the nodes beyond the surface on to those that they change with, in place."""
    nodes, start, wet, share = beyond
    for s in range(len(nodes)):
        for t in range(start[s], start[s + 1]):
            for k in range(r.shape[1]):
                r[wet[t], k] += share[t] * r[nodes[s], k]
        r[nodes[s]] = 0.0


@kernel
def follow(beyond, d):
    """Give the nodes beyond the surface the mean d (N, 3) of those that they change with, in place."""
    nodes, start, wet, share = beyond
    for s in range(len(nodes)):
        d[nodes[s]] = 0.0
        for t in range(start[s], start[s + 1]):
            for k in range(3):
                d[nodes[s], k] += share[t] * d[wet[t], k]
