"""The speed that determines the length of a step: that of the water without spray.

A splash throws single nodes of water at two and three times the speed of all the rest; a step in which these cross one
cell takes 1.5 times as many steps through a dam break, for a thousandth of the water.  The scheme needs no such step:
paths of transport may cross any number of cells, and the volume is carried in substeps of its own.  So

    v = min(v_1, max(SPRAY_SPEED v_s, v_1 / SPRAY_COURANT))                                                (1)

with v_1 the largest |u_ik| of all nodes that count, and v_s the least speed that at most the share SPRAY of the volume
of their water exceeds.  Where no water is far faster than the rest, v = v_1: fronts and first impacts keep the step of
their fastest node, and with it their loads.  The last limit binds where so little water may be all that matters: a thin
front at the end of a long tank.

Nodes do not count where the water is drops and trickles of less than a cell: where a node and those beside it hold less
than LEAST_GATHERED h³ of it together.  Such water flies and runs down walls as fast as the limit of the speed allows,
long after everything else is calm; its paths may be as long as they like, and its volume is carried and kept like that
of all water.
"""

from __future__ import annotations

import numpy as np

from kernels.decorators import ranged, released
from kernels.threads import CHUNK, joined, over, summed

SPRAY = 0.01
"""Largest share of the volume of water that is spray, ..."""
SPRAY_SPEED = 1.35
"""... the least speed of spray over that of the rest, ..."""
SPRAY_COURANT = 2.0
"""... and how many times `WaterParameters.courant` cells it may cross in a step."""
SORTED, MORE = 200, 1.001
"""Number of nodes that are sorted at once; and how much more than the spray, as round-off may be less, has to be among
those that are sorted alone."""
LEAST_COUNTED = 0.05
"""Nodes with less fluid volume around them (in h³) do not set the step: films beside solids, which paths of any
length cross safely."""
LEAST_GATHERED = 1.0
"""Water at a node and its neighbours (in h³) below which they do not set the step. On a lattice they have room for 15,
and a sheet counts if it is thicker than an eighth of a cell."""


def pace(u, water, counted) -> float:
    """Equation (1) [m/s]; u (N, 3) [m/s], water (N,) [m³] at the nodes, counted (N,) bool: nodes to look at."""
    fastest = largest_component(u, counted)
    bulk = _bulk(fastest / (SPRAY_SPEED * SPRAY_COURANT), u, water, counted)
    return min(fastest, max(SPRAY_SPEED * bulk, fastest / SPRAY_COURANT))


def _bulk(least, u, water, counted) -> float:
    """v_s of (1) [m/s], or `least` if that is larger."""
    speed, volume = joined(over(_faster_than, len(u), least, u, water, counted))
    most = SPRAY * float(summed(_counted_water, len(u), (1,), water, counted)[0])
    speed, volume = _fastest(speed, volume, most)
    order = np.argsort(speed)[::-1]
    rest = np.searchsorted(np.cumsum(volume[order]), most, side="right")
    return float(speed[order[rest]]) if rest < len(order) else least


def _fastest(speed, volume, most: float):
    """Speeds and volumes (n,) of the fastest nodes that hold more than `most` together, an eighth of all if that is
    enough: not all need be sorted."""
    if len(speed) < SORTED:
        return speed, volume
    rank = len(speed) - len(speed) // 8
    top = speed >= np.partition(speed, rank)[rank]
    return (speed[top], volume[top]) if volume[top].sum() > MORE * most else (speed, volume)


def gathered(counted, water, least, start, around):
    """The counted nodes (N,) bool that hold at least so much water together with their neighbours; all of them where
    none does.

    water (N,) [m³] at the nodes · least [m³] · start (N + 1,), around: `Topology.around`."""
    found = np.zeros(len(counted), bool)
    n = sum(over(_gathered, len(counted), counted, water, least, start, around, found))
    return found if n > 0 else counted


@ranged
def _gathered(first, last, counted, water, least, start, around, found):
    n = 0
    for i in range(first, last):
        if counted[i]:
            held = water[i]
            for t in range(start[i], start[i + 1]):
                held += water[around[t]]
            found[i] = held >= least
            n += found[i]
    return n


def largest_component(u, counted) -> float:
    """max |u_ik| over the counted rows of u (N, 3), 0 without any."""
    return max(over(_largest_component, len(u), u, counted))


@ranged
def _largest_component(first, last, u, counted):
    largest = 0.0
    for i in range(first, last):
        if counted[i]:
            for k in range(3):
                largest = max(largest, abs(u[i, k]))
    return largest


def fastest_wet(u, phi, roomy) -> float:
    """max |u_ik| over the rows of u (N, 3) below the surface, φ (N,) < 0, that are roomy (N,) bool; 0 without any."""
    return max(over(_fastest_wet, len(u), u, phi, roomy))


@ranged
def _fastest_wet(first, last, u, phi, roomy):
    largest = 0.0
    for k in range(first, last):
        i = np.uint64(k)
        if phi[i] < 0.0 and roomy[i]:
            largest = max(largest, abs(u[i, 0]), abs(u[i, 1]), abs(u[i, 2]))
    return largest


@released
def _faster_than(first, last, least, u, water, counted):
    """Largest component (n,) and volume (n,) of the counted nodes faster than `least`."""
    speed, volume, n = np.empty(last - first), np.empty(last - first), 0
    for k in range(first, last):
        i = np.uint64(k)
        if counted[i]:
            largest = max(max(abs(u[i, 0]), abs(u[i, 1])), abs(u[i, 2]))
            if largest > least:
                speed[n], volume[n] = largest, water[i]
                n += 1
    return speed[:n].copy(), volume[:n].copy()


@ranged
def _counted_water(first, last, water, counted, partial):
    for c in range(first, last):
        for k in range(c * CHUNK, min((c + 1) * CHUNK, water.shape[0])):
            i = np.uint64(k)
            if counted[i]:
                partial[c, 0] += water[i]
