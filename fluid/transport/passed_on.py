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

from typing import NamedTuple

import numpy as np

from fluid.domain.graph import Graph
from fluid.domain.topology import NO_WATER
from fluid.numerics.fields import PLAIN
from fluid.surface.shift import rows_of_shift
from fluid.surface.volume import Shift
from kernels.decorators import inlined, ranged, released
from kernels.team import counted
from kernels.threads import over

CONDUCTING, ANCHOR = 0.05, 2e-3
"""Of the matrix of (2): share of what a node can hold from which water passes through it as everywhere, so that nodes
that hold next to none take no part; and share of its edges that is added to the diagonal of a node, so that what comes
to all nodes of a region alike is not sought beyond 1/sqrt(2 ANCHOR) cells, 16. ψ spreads what thin sheets lack over
four cells and more; sought over five, a fortieth of the momentum of a jet of two cells was lost on its plate."""
TOLERANCE, MOST_ITERATIONS = 1e-2, 100
"""Where the conjugate gradients of (2) end."""
SLOPES = 4
"""Cost of looking at the edges of a node for those that the potential falls along, in usual rows."""


def pass_on(graph: Graph, shift: Shift, gained, share, water, capacity, u) -> None:
    """Velocity u (N, 3) [m/s] carried along with the volumes (1) and (2), in place.

    gained (N,) [m³]: what the nodes hold in the end, what the fluxes brought, and what the surface swept beyond it, so
    that they gain the first less the second and more the third · share (N,) of its rest that is passed on · water,
    capacity (N,) [m³]: what the nodes hold before, and could hold."""
    edges, spacing, band, place, held = (
        graph.edges,
        shift.spacing,
        shift.band,
        shift.place,
        np.empty(len(water)),
    )
    over(_at_least_none, len(water), water, held, weight=PLAIN)
    _down(band, place, edges, shift.kappa * shift.value, spacing, capacity, held, u)
    sought = np.empty(len(band))
    if not sum(over(_sought, len(band), band, gained, share, (water, held), sought)):
        return
    stiffness, anchor = np.empty(len(edges.stiffness)), np.empty(len(band))
    over(_through_water, len(band), band, edges, spacing, (held, gained[0], capacity), (stiffness, anchor))
    edges = edges._replace(stiffness=stiffness)
    rows = rows_of_shift(band, place, edges, anchor, 1.0, spacing)
    height = rows.shift(sought, TOLERANCE, MOST_ITERATIONS)
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
    n, most = len(band), len(edges.stiffness)
    numbers, volumes = np.empty((4, n), np.int64), np.empty((2, n))
    slopes = Slopes(*numbers, *volumes, np.empty(most, np.uint32), np.empty(most), np.empty(most))
    over(_find_slopes, n, band, place, edges, height, spacing, slopes, weight=SLOPES)
    over(_hand_on, n, band, edges, slopes, capacity, held, u, weight=SLOPES)


class Slopes(NamedTuple):
    """Edges of a band (n,) that a potential falls along.

    upper, lower (n,): end of those from above to a node, which begin where its edges do, and begin of those from it
    down, which end where its edges do · waits (n,): minus the number of nodes above that have not handed on · next
    (n,): work space · falls (n,) [m³]: Σ v_ij to the nodes below · share (n,): which share of these it hands on,
    negative: nothing · other (edges,): place in the band of the other node, those above from the highest down, which
    hand on in that order · fall, conducts (edges,): h_ij (ψ_i - ψ_j) and -K_ij from those above."""

    upper: np.ndarray
    lower: np.ndarray
    waits: np.ndarray
    next: np.ndarray
    falls: np.ndarray
    share: np.ndarray
    other: np.ndarray
    fall: np.ndarray
    conducts: np.ndarray


@ranged
def _find_slopes(first, last, band, place, edges, height, spacing, slopes):
    """Fill `slopes`, but for the shares."""
    start, neighbour, stiffness = edges.start, edges.neighbour, edges.stiffness
    other, fall, conducts = slopes.other, slopes.fall, slopes.conducts
    for s in range(first, last):
        p = np.uint64(s)
        i = np.uint64(band[p])
        row = np.uint64(edges.row[i])
        begin, end = np.int64(start[row]), np.int64(start[row + np.uint64(1)])
        own, size, total, upper, lower = height[p], spacing[i], 0.0, begin, end
        for k in range(begin, end):
            t = np.uint64(k)
            conduct = -stiffness[t]
            j = np.uint64(neighbour[t])
            q = place[j]
            if q < 0 or not conduct > 0.0:
                continue
            level = height[np.uint64(q)]
            if level < own:
                total += 0.5 * (size + spacing[j]) * (own - level) * conduct
                lower -= 1
                other[np.uint64(lower)] = q
            elif level > own:
                at = upper
                while at > begin:
                    to, before = np.uint64(at), np.uint64(at - 1)
                    above = height[other[before]]
                    if above > level or (above == level and other[before] < q):
                        break
                    other[to], fall[to], conducts[to] = other[before], fall[before], conducts[before]
                    at -= 1
                to = np.uint64(at)
                other[to], conducts[to], fall[to] = q, conduct, 0.5 * (size + spacing[j]) * (level - own)
                upper += 1
        slopes.upper[p], slopes.lower[p], slopes.waits[p], slopes.falls[p] = (
            upper,
            lower,
            begin - upper,
            total,
        )


@ranged
def _hand_on(first, last, band, edges, slopes, capacity, held, u):
    """Hand on from the highest nodes of a range, and from each one below them, of any range, as soon as all above it
    have: whoever is the last of those above hands on from there, too.

    What comes to a node is added up from the highest to the lowest of those above, so that the sum does not depend on
    which thread is ahead."""
    start, row, waits, after = edges.start, edges.row, slopes.waits, slopes.next
    place, whole = np.int64(waits.ctypes.data), first == 0 and last == band.shape[0]
    for s in range(first, last):
        if slopes.upper[s] > np.int64(start[row[band[s]]]):
            continue
        top = s
        after[s] = -1
        while top >= 0:
            p = np.uint64(top)
            top = after[p]
            _receive(p, band, edges, slopes, capacity, held, u)
            for k in range(
                slopes.lower[p], np.int64(start[np.uint64(row[np.uint64(band[p])]) + np.uint64(1)])
            ):
                q = slopes.other[np.uint64(k)]
                if whole:
                    before = waits[q]
                    waits[q] = before + 1
                else:
                    before = counted(place + 8 * np.int64(q))
                if before == -1:
                    after[q] = top
                    top = np.int64(q)


@inlined
def _receive(p, band, edges, slopes, capacity, held, u):
    """What the nodes above hand on to the node at place p of the band, and what it hands on itself."""
    i = np.uint64(band[p])
    x, y, z, volume = 0.0, 0.0, 0.0, 0.0
    for k in range(np.int64(edges.start[np.uint64(edges.row[i])]), slopes.upper[p]):
        t = np.uint64(k)
        q = np.uint64(slopes.other[t])
        share = slopes.share[q]
        if share >= 0.0:
            moved = share * slopes.fall[t] * slopes.conducts[t]
            j = np.uint64(band[q])
            volume += moved
            x += moved * u[j, 0]
            y += moved * u[j, 1]
            z += moved * u[j, 2]
    left, before = held[i] + volume, held[i]
    held[i], slopes.share[p] = left, -1.0
    if left <= NO_WATER * capacity[i]:
        return
    u[i, 0] = (before * u[i, 0] + x) / left
    u[i, 1] = (before * u[i, 1] + y) / left
    u[i, 2] = (before * u[i, 2] + z) / left
    total = slopes.falls[p]
    if total > 0.0:
        share = min(1.0, left / total)
        held[i] = max(left - share * total, 0.0)
        slopes.share[p] = share


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
    row, start, neighbour, given = edges.row, edges.start, edges.neighbour, edges.stiffness
    for place in range(first, last):
        i, total = np.uint64(band[np.uint64(place)]), 0.0
        r, size = np.uint64(row[i]), spacing[i]
        # a body may have taken all room of a node that still holds water
        own = max(now[i], in_the_end[i]) / max(capacity[i], 1e-300)
        for s in range(start[r], start[r + np.uint64(1)]):
            if given[s] == 0.0:  # half of the edges of a split brick
                stiffness[s] = given[s]
                continue
            j = neighbour[s]
            least = min(own, max(max(now[j], in_the_end[j]), 0.0) / max(capacity[j], 1e-300))
            conducts = given[s] * min(least / CONDUCTING, 1.0)
            stiffness[s] = conducts
            total -= 0.5 * (size + spacing[j]) * min(conducts, 0.0)
        anchor[np.uint64(place)] = ANCHOR * total
