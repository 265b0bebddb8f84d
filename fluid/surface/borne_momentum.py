"""Momentum of fast water at nodes above the surface, borne by the nodes that their velocity is continued from.

Nodes above the surface hold the water of cells that it cuts, a quarter of all in a sheet of a cell.  Their velocity is
continued from nodes j in the water, u_i = Σ_j e_ij u_j + slopes (`extrapolation.py`): their water moves with that of
the nodes j, and these bear it.  W_i û_i is what the pressure, and the water that has come to node i, made of its
momentum; what that is more than it has with the continued velocity goes to them with the weights of the continuation,

    u_j += d_j,   u_i += s_i Σ_j e_ij d_j,   d_j = Σ_i e_ij s_i W_i (û_i - u_i) / (W_j + Σ_i e_ij s_i W_i)           (1)

which keeps Σ W u to round-off; the same for accelerations.  A continued velocity alone took what water had brought to
the surface of a sheet, and the pressure did not act on it there: 0.1 ρ U² D of a jet of two cells on a plate.

s_i is the share to which the velocity follows the momentum of the volume in fast water
(`transport/surface_momentum.py`): slower water keeps its head.  Around jumps nodes above the surface keep their
momentum themselves (`corrector.py`).
"""

from __future__ import annotations

import numpy as np

from fluid.domain.layers import WORK
from fluid.domain.topology import NO_WATER
from kernels.decorators import inner, ranged
from kernels.threads import over, taken


class Borne:
    """The nodes above the surface whose water others bear, and these, in a step.

    outside (n,): nodes above the surface that share cells with nodes in the water · wet (N,) bool: those in the water ·
    water (N,) [m³] · fast (N,): s, read at the nodes outside · in_jumps (N,): share of its momentum that a node keeps
    itself, of which s is left out, or None"""

    def __init__(self, topology, outside, wet, water, fast, in_jumps) -> None:
        self._outside, self._wet, self._water = outside, wet, water
        self._nodes, self._around = topology.nodes, topology.around_by_cells
        self._borne, self._total = np.empty(len(wet)), np.empty(len(wet))
        state = (water, topology.node_volume, fast, np.zeros(0) if in_jumps is None else in_jumps)
        made = (self._borne, self._total, np.zeros(len(wet), bool))
        over(_to_be_borne, len(outside), *self._rows(), state, made, weight=WORK)
        self._bearing = taken(made[2])

    def _rows(self):
        return self._outside, self._wet, self._nodes, self._around

    def give(self, own, field) -> None:
        """field (N, 3), continued, in place: Σ W field as with `own` (N, 3) at the nodes outside."""
        gained = np.empty(field.shape)
        held = (self._water, self._borne, self._total)
        rows = (self._bearing, self._wet, self._nodes, self._around)
        over(_gained, len(self._bearing), *rows, held, own, gained, field, weight=WORK)
        over(_followed, len(self._outside), *self._rows(), held, gained, field, weight=WORK)


@inner
def _weight(i, j, shared, nodes):
    """Weight of node j in what is continued to node i: `extrapolation.py`."""
    x, y, z = nodes[i, 0] - nodes[j, 0], nodes[i, 1] - nodes[j, 1], nodes[i, 2] - nodes[j, 2]
    return shared / (x * x + y * y + z * z)


@ranged
def _to_be_borne(first, last, outside, wet, nodes, around_by_cells, state, made):
    """made, at the nodes outside: s W (N,) [m³], and the sum of the weights of the nodes in the water around (N,); and
    these nodes (N,) bool, where there is something to bear."""
    (water, capacity, fast, in_jumps), (borne, total, bearing) = state, made
    start, around, shared = around_by_cells
    for s in range(first, last):
        i = np.uint64(outside[np.uint64(s)])
        borne[i], total[i] = 0.0, 0.0
        if water[i] <= NO_WATER * capacity[i] or fast[i] <= 0.0:
            continue
        for t in range(start[i], start[i + np.uint64(1)]):
            if wet[around[t]]:
                total[i] += _weight(i, around[t], shared[t], nodes)
        share = fast[i] * (1.0 - in_jumps[i] if in_jumps.shape[0] > 0 else 1.0)
        borne[i] = share * water[i] if total[i] > 0.0 else 0.0
        if borne[i] > 0.0:
            for t in range(start[i], start[i + np.uint64(1)]):
                if wet[around[t]]:
                    bearing[around[t]] = True


@ranged
def _gained(first, last, bearing, wet, nodes, around_by_cells, held, own, gained, field):
    """d (N, 3) of (1) at the bearing nodes, which is added to the field there."""
    (water, borne, total), (start, around, shared) = held, around_by_cells
    for s in range(first, last):
        j = np.uint64(bearing[np.uint64(s)])
        mass = max(water[j], 0.0)
        for k in range(3):
            gained[j, k] = 0.0
        for t in range(start[j], start[j + np.uint64(1)]):
            i = around[t]
            if not wet[i] and borne[i] > 0.0:
                part = borne[i] * _weight(i, j, shared[t], nodes) / total[i]
                mass += part
                for k in range(3):
                    gained[j, k] += part * (own[i, k] - field[i, k])
        for k in range(3):
            gained[j, k] /= mass
            field[j, k] += gained[j, k]


@ranged
def _followed(first, last, outside, wet, nodes, around_by_cells, held, gained, field):
    """Add s Σ e d of (1) at the nodes outside."""
    (water, borne, total), (start, around, shared) = held, around_by_cells
    for s in range(first, last):
        i = np.uint64(outside[np.uint64(s)])
        if borne[i] <= 0.0:
            continue
        part = borne[i] / (water[i] * total[i])
        for t in range(start[i], start[i + np.uint64(1)]):
            j = around[t]
            if wet[j]:
                w = part * _weight(i, j, shared[t], nodes)
                for k in range(3):
                    field[i, k] += w * gained[j, k]
