"""The volume of the nodes beside the surface, by what the surface sweeps.

A velocity u, the same in all of a cell, that carries water and surface changes W_i = ∫_{φ<0} N_i dV at the rate

    dW_i/dt = ∫_{φ<0} u·∇N_i dV = -Σ_j q_ij,      q_ij = -Σ_e w_e |e| (∇N_i·∇N_j) (x_j - x_i)·u_e,          (1)

w_e the share of the fluid part of a cell below the surface: the flux of `volume.py` (1), as far as a cell has water.
It is conservative along edges, and exact for a plane surface that moves on as it is.  `volume_transport.py` fills the
edges by the shares of the nodes instead, which are not those of a plane: hats on split bricks have other profiles at
each corner of a brick.  Within the tank these add up to one profile for all nodes, on its sides they do not, and the
correction of the level set tilted every surface that moved by 2 % of its way there, up and down in the same direction:
a column that bounced on air lost 7 % of its energy in ten periods, and sloshing a quarter more of its height.

Mean over the step by Simpson's rule, with φ carried on by its mean slope at the nodes, which is good for a part of a
cell: in water that crosses half of one in a step the shares count alone (fronts of dam breaks came 0.2 % later and the
wave that comes back in P39 8 ms).  The fluxes stay what they are around solids, whose faces cut the profiles anyhow, on
meshes with obtuse cells, and deeper than the surface gets.
"""

from __future__ import annotations

import numpy as np

from fluid.domain.moments import wet_fraction
from fluid.numerics.threads import over
from fluid.surface.volume import Flux, edge_rates
from kernel_decorators import kernel, ranged

NEAR = 3.0
"""|φ| in cell sizes beyond which no surface arrives in a step."""
SLOW = (0.25, 0.5)
"""Cells crossed in a step between which the fluxes by shares take over again."""


def swept(topology, flux: Flux, phi, u, moved, dt: float) -> np.ndarray:
    """Volume (N,) [m³] that the nodes get by (1) in dt [s] beyond what they got by the fluxes along the edges.

    All of the domain of the flux: φ (N,) [m] at the beginning · u (N, 3) [m/s] at mid-step · moved (edges,) [m³] what
    went out along each edge."""
    t, g = topology, flux.graph
    band = flux.nodes[np.abs(phi[flux.nodes]) < NEAR * t.node_size[flux.nodes]]
    mesh = (t.cells, t.parent, t.gradients, t.volume, t.node_start, t.node_cells)
    after, growth = phi.copy(), np.zeros(len(band))
    over(_growth, len(band), band, phi, u, *mesh, growth)
    after[band] -= dt * growth
    near = np.zeros(len(phi), bool)
    near[band] = True
    cells = t.cells_around(near)
    stages = [wet_fraction(cells, level, t.parts) for level in (phi, 0.5 * (phi + after), after)]
    share = (stages[0] + 4.0 * stages[1] + stages[2]) / 6.0
    cut = (share > 0.0) & (share < 1.0)
    if not cut.any():
        return np.zeros(len(phi))
    beside = np.zeros(len(phi), bool)
    beside[t.cells[cells[cut]]] = True
    nodes = flux.nodes[beside[flux.nodes]]
    reached = np.zeros(len(phi), bool)
    reached[nodes] = True
    around = t.cells_around(reached)
    velocity = np.zeros(flux.velocity.shape)
    over(_where_all_wet, len(around), around, phi, t.cells, flux.velocity, velocity)
    over(_by_share, len(cells), cells, share, flux.velocity, velocity)
    rate = edge_rates(t, g, nodes, velocity)
    crossed = dt * np.sqrt((u * u).sum(axis=1)) / t.node_size
    weight = np.clip((SLOW[1] - crossed) / (SLOW[1] - SLOW[0]), 0.0, 1.0)
    weight[t.near_solids] = 0.0
    return _difference(nodes, reached, weight, g.row, g.start, g.neighbour, dt * rate, moved)


@ranged
def _growth(first, last, nodes, phi, u, cells, parent, g, volume, node_start, node_cells, out):
    """u·∇φ (n,) [m/s] at the listed nodes, with the mean of ∇φ over the cells around each."""
    for s in range(first, last):
        i, weight = nodes[s], 0.0
        for c in range(node_start[i], node_start[i + 1]):
            e = node_cells[c]
            p = parent[e]
            weight += volume[e]
            for a in range(4):
                for k in range(3):
                    out[s] += volume[e] * phi[cells[e, a]] * g[p, a, k] * u[i, k]
        out[s] /= max(weight, 1e-300)


@ranged
def _where_all_wet(first, last, cell_list, phi, cells, u, out):
    """u (M, 3) in the listed cells with φ < 0 at all corners."""
    for s in range(first, last):
        e = cell_list[s]
        if max(max(phi[cells[e, 0]], phi[cells[e, 1]]), max(phi[cells[e, 2]], phi[cells[e, 3]])) < 0.0:
            for k in range(3):
                out[e, k] = u[e, k]


@ranged
def _by_share(first, last, cell_list, share, u, out):
    """u (M, 3) times the share (n,) of the listed cells."""
    for s in range(first, last):
        e = cell_list[s]
        for k in range(3):
            out[e, k] = share[s] * u[e, k]


@kernel
def _difference(nodes, reached, weight, graph_row, start, neighbour, swept, moved):
    """Volume (N,) [m³] that the listed nodes and their neighbours get if `swept` (edges,) [m³] leaves along the edges
    instead of `moved`, by the lesser weight (N,) of both ends."""
    out = np.zeros(reached.shape[0])
    for i in nodes:
        if weight[i] == 0.0:
            continue
        r = graph_row[i]
        for s in range(start[r], start[r + 1]):
            j = neighbour[s]
            back = graph_row[j]
            if weight[j] == 0.0 or back < 0:
                continue
            came = 0.0
            for b in range(start[back], start[back + 1]):
                if neighbour[b] == i:
                    came = moved[b]
            more = min(weight[i], weight[j]) * (swept[s] - (moved[s] - came))
            out[i] -= more
            if not reached[j]:
                out[j] += more
    return out
