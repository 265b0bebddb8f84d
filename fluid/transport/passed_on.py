"""Momentum that goes with the volumes which the correction of the level set moves between nodes.

In the equation of that correction (`volume.py`, 2), c ψ + κ K ψ = r, the volumes

    v_ij = -κ K_ij (ψ_i - ψ_j)                                                                              (1)

pass from node to node.  What the nodes of the corrected level set hold, less what the fluxes brought, is not quite what
these bring: that equation is linear, which a surface that is steep is not, the last shift moves volume everywhere, and
the surface sweeps what the fluxes along the edges do not carry (`swept_volume.py`).  Where water is fast, and around
jumps, this rest r' passes on along the edges, too,

    v'_ij = -h K'_ij (χ_i - χ_j),      Σ_j v'_ji = r'_i,                                                     (2)

K' between nodes that hold water.

Both run downhill on a potential, ψ and χ.  The nodes hand them on in order of falling potential, each with the mean
velocity of its own water and of all that has come to it before.  A node may so hand on more than it held, which the
nodes of a thin sheet and of its surface have to, and Σ W u stays to round-off.
"""

from __future__ import annotations

import numpy as np

from fluid.domain.topology import NO_WATER, Graph
from fluid.numerics.fields import places_of
from fluid.surface.shift import diffused_shift
from fluid.surface.volume import Shift
from kernels.decorators import kernel, ranged, released
from kernels.threads import over

CONDUCTING, ANCHOR = 0.05, 0.02
"""Of the matrix of (2): share of what a node can hold from which water passes through it as everywhere, so that nodes
that hold next to none take no part; and share of its edges that is added to the diagonal of a node, so that what comes
to all nodes of a region alike is not sought from far away."""
TOLERANCE, MOST_ITERATIONS = 1e-2, 100
"""Where the conjugate gradients of (2) end."""


def pass_on(graph: Graph, shift: Shift, gained, share, water, capacity, u) -> None:
    """Velocity u (N, 3) [m/s] carried along with the volumes (1) and (2), in place.

    gained (N,) [m³]: what the nodes hold in the end, what the fluxes brought, and what the surface swept beyond it, so
    that they gain the first less the second and more the third · share (N,) of its rest that is passed on · water,
    capacity (N,) [m³]: what the nodes hold before, and could hold."""
    n, edges, spacing, band = len(water), graph.edges, shift.spacing, shift.band
    held, place = np.empty(n), places_of(band, n)
    over(_at_least_none, n, water, held)
    _down(band, place, edges, shift.kappa * shift.value, spacing, capacity, held, u)
    sought = np.empty(len(band))
    if not sum(over(_sought, len(band), band, gained, share, (water, held), sought)):
        return
    stiffness, anchor = np.empty(len(edges.stiffness)), np.empty(len(band))
    over(_through_water, len(band), band, edges, spacing, (held, gained[0], capacity), (stiffness, anchor))
    edges = edges._replace(stiffness=stiffness)
    height = diffused_shift(band, place, edges, anchor, sought, 1.0, spacing, TOLERANCE, MOST_ITERATIONS)
    _down(band, place, edges, height, spacing, capacity, held, u)


@ranged
def _at_least_none(first, last, water, out):
    """max(W, 0)."""
    for j in range(first, last):
        i = np.uint64(j)
        out[i] = max(water[i], 0.0)


def _down(band, place, edges, height, spacing, capacity, held, u):
    """The volumes (1) of the potential `height` (n,) at the band (n,), handed on: held (N,) [m³] and u in place.

    place (N,): places of the nodes in the band, -1 elsewhere."""
    order = np.argsort(-height, kind="stable")
    _hand_on(order, band, place, edges, (height, spacing), capacity, held, np.zeros((len(band), 4)), u)


@kernel
def _hand_on(order, band, place, edges, state, capacity, held, came, u):
    """order (n,): places in the band by falling potential · state: potential (n,), size (N,) [m] of the cells · came
    (n, 4), zero at first: momentum and volume that has come."""
    (height, spacing), start, neighbour = state, edges.start, edges.neighbour
    stiffness = edges.stiffness
    for s in range(order.shape[0]):
        p = order[s]
        i = band[p]
        left = held[i] + came[p, 3]
        if left <= NO_WATER * capacity[i]:
            held[i] = left
            continue
        for k in range(3):
            u[i, k] = (held[i] * u[i, k] + came[p, k]) / left
        begin, end, total = start[edges.row[i]], start[edges.row[i] + 1], 0.0
        for t in range(begin, end):
            j = neighbour[t]
            q = place[j]
            if q >= 0 and height[q] < height[p]:
                down = 0.5 * (spacing[i] + spacing[j]) * (height[p] - height[q])
                total += down * max(-stiffness[t], 0.0)
        held[i] = left
        if total <= 0.0:
            continue
        share = min(1.0, left / total)
        held[i] = max(left - share * total, 0.0)
        for t in range(begin, end):
            j = neighbour[t]
            q = place[j]
            if q >= 0 and height[q] < height[p] and stiffness[t] < 0.0:
                down = 0.5 * (spacing[i] + spacing[j]) * (height[p] - height[q])
                moved = share * down * -stiffness[t]
                came[q, 3] += moved
                for k in range(3):
                    came[q, k] += moved * u[i, k]


@released
def _sought(first, last, band, gained, share, volumes, out):
    """What (2) is to take from the nodes of the band (n,) [m³], in `out`; at how many that is not zero.

    volumes (N,) [m³]: what they held, and hold after (1)."""
    (in_the_end, brought, swept), (before, held), count = gained, volumes, 0
    for s in range(first, last):
        i = band[s]
        out[s] = -share[i] * (in_the_end[i] - brought[i] + swept[i] - (held[i] - max(before[i], 0.0)))
        count += out[s] != 0.0
    return count


@ranged
def _through_water(first, last, band, edges, spacing, volumes, made):
    """made: K (edges,) times the least share of CONDUCTING that both ends hold of what they could; ANCHOR times the sum
    of it times h (n,). volumes (N,) [m³]: what nodes hold now and in the end, the more of which counts, and could
    hold."""
    (now, in_the_end, capacity), (stiffness, anchor) = volumes, made
    for r in range(first, last):
        i, total = band[r], 0.0
        # a body may have taken all room of a node that still holds water
        own = max(now[i], in_the_end[i]) / max(capacity[i], 1e-300)
        for s in range(edges.start[edges.row[i]], edges.start[edges.row[i] + 1]):
            j = edges.neighbour[s]
            least = min(own, max(max(now[j], in_the_end[j]), 0.0) / max(capacity[j], 1e-300))
            stiffness[s] = edges.stiffness[s] * min(least / CONDUCTING, 1.0)
            total -= 0.5 * (spacing[i] + spacing[j]) * min(stiffness[s], 0.0)
        anchor[r] = ANCHOR * total
