"""Velocity carried along with volumes of water that move from node to node, so that momentum is conserved.

The volume w_ij that leaves i for j carries momentum with it, component by component (mass and momentum by the same
fluxes: Rudman, Int. J. Numer. Methods Fluids 28 (1998) 357),

    u_ij = u_i + ½ (1 - C_i) B(u_j - u_i, u_i - u_up),    C_i = Σ_j w_ij / W_i                              (1)

with the mean velocity u_up of what flows into i and B the limiter of van Leer (J. Comput. Phys. 14 (1974) 361),
2ab/(a + b) where both differences have the same sign and 0 elsewhere. Σ W u is kept to round-off, and no u leaves the
range around it. Nodes that hold next to nothing afterwards keep the u they had: of a volume that is round-off, so is u.
"""

from __future__ import annotations

import numpy as np

from fluid.domain.topology import NO_WATER
from fluid.mesh.arrays import Edges
from kernels.decorators import inner, ranged
from kernels.threads import over, owning, reach_of_rows

NONE = np.empty(0)
"""No field (N,)."""


def carry_velocity(nodes, edges: Edges, moved, volumes, u, gain=NONE):
    """Equation (1): u (N, 3) [m/s] after the volumes moved (edges,) [m³] left the listed nodes, in place.

    volumes (N,) [m³]: what nodes hold before it is moved, no node giving more, and what they could hold · gain (N,)
    [m³], if given: what came to each node less what left it is added, in place."""
    water = volumes[0]
    size, reach = len(water), reach_of_rows(nodes, edges.row, edges.start, edges.neighbour)
    up, came, change, volume = (np.empty(shape) for shape in (u.shape, size, u.shape, size))
    over(_begin, len(nodes), nodes, up, came, change, volume)  # what others get is not read
    owning(_incoming, size, reach, len(nodes), nodes, edges, moved, u, up, came)
    over(_mean_incoming, len(nodes), nodes, came, u, up)
    owning(_exchange, size, reach, len(nodes), nodes, edges, moved, water, u, up, change, volume, gain)
    over(_new_velocity, len(nodes), nodes, volumes, change, volume, u)


@ranged
def _begin(first, last, nodes, up, came, change, volume):
    """Zeros at the listed nodes."""
    for s in range(first, last):
        i = nodes[s]
        came[i], volume[i] = 0.0, 0.0
        for k in range(3):
            up[i, k], change[i, k] = 0.0, 0.0


@ranged
def _new_velocity(first, last, nodes, volumes, change, volume, u):
    water, capacity = volumes
    for s in range(first, last):
        i = nodes[s]
        if volume[i] > NO_WATER * max(water[i], capacity[i]):
            for k in range(3):
                u[i, k] = (max(water[i], 0.0) * u[i, k] + change[i, k]) / volume[i]


@ranged
def _incoming(first, last, runs, nodes, edges, moved, u, up, came):
    """Σ w u (N, 3) [m⁴/s] and Σ w (N,) [m³] of what flows into a node."""
    row, start, neighbour = edges.row, edges.start, edges.neighbour
    for run in range(runs.shape[0]):
        for place in range(runs[run, 0], runs[run, 1]):
            i = np.uint64(nodes[place])
            r = np.uint64(row[i])
            for s in range(start[r], start[r + np.uint64(1)]):
                j = neighbour[s]
                if moved[s] > 0.0 and first <= j < last:
                    came[j] += moved[s]
                    for k in range(3):
                        up[j, k] += moved[s] * u[i, k]


@ranged
def _mean_incoming(first, last, nodes, came, u, up):
    """u_up (N, 3) [m/s]: mean velocity of what flows into a node; its own where nothing does."""
    for s in range(first, last):
        i = nodes[s]
        for k in range(3):
            up[i, k] = up[i, k] / came[i] if came[i] > 0.0 else u[i, k]


@ranged
def _exchange(first, last, runs, nodes, edges, moved, water, u, up, change, volume, gain):
    """Change of Σ W u (N, 3) [m⁴/s], the volume afterwards (N,) [m³] and, unless it is empty, `gain` (N,) [m³]."""
    start, neighbour = edges.start, edges.neighbour
    counted = gain.shape[0] > 0
    for run in range(runs.shape[0]):
        for place in range(runs[run, 0], runs[run, 1]):
            i = np.uint64(nodes[place])
            r = np.uint64(edges.row[i])
            end = r + np.uint64(1)
            out = 0.0
            for s in range(start[r], start[end]):
                out += moved[s]
            own = first <= i < last
            if own:
                volume[i] += max(water[i], 0.0) - out
            if out <= 0.0:
                continue
            second = 0.5 * max(1.0 - out / water[i], 0.0)
            for s in range(start[r], start[end]):
                j = neighbour[s]
                theirs = first <= j < last
                if moved[s] > 0.0 and (own or theirs):
                    if theirs:
                        volume[j] += moved[s]
                    if counted and own:
                        gain[i] -= moved[s]
                    if counted and theirs:
                        gain[j] += moved[s]
                    for k in range(3):
                        limited = _van_leer(u[j, k] - u[i, k], u[i, k] - up[i, k])
                        momentum = moved[s] * (u[i, k] + second * limited)
                        if own:
                            change[i, k] -= momentum
                        if theirs:
                            change[j, k] += momentum


@inner
def _van_leer(a, b):
    return 2.0 * a * b / (a + b) if a * b > 0.0 else 0.0
