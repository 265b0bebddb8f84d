"""The volume of nodes near the surface, from the volume that the surface sweeps.

A velocity u, the same in all of a cell, that carries water and surface changes W_i = ∫_{φ<0} N_i dV at the rate

    dW_i/dt = ∫_{φ<0} u·∇N_i dV = -Σ_j q_ij,      q_ij = -Σ_e w_e |e| (∇N_i·∇N_j) (x_j - x_i)·u_e,          (1)

w_e the share of the fluid part of a cell below the surface: the flux of `volume.py` (1), as far as a cell has water.
It is conservative along edges, and exact for a plane surface that moves without changing shape.  `volume_transport.py`
fills the edges by the shares of the nodes instead, which are not those of a plane: hats on split bricks have other
profiles at each corner of a brick.  Within the tank these add up to one profile for all nodes, on its sides they do
not, and the correction of the level set tilted every surface that moved by 2 % of its way there, up and down in the
same direction: a column that bounced on air lost 7 % of its energy in ten periods, and sloshing a quarter more of its
height.

Mean over the step by Simpson's rule, with φ carried on by its mean slope at the nodes, which is good for a part of a
cell: in water that crosses half of one in a step the shares count alone (fronts of dam breaks came 0.2 % later and the
wave that comes back in P39 8 ms).  The fluxes stay what they are deeper than the surface gets.  In cells that solids
cut, w_e is the share of their fluid part, to round-off (`fans.py`): there the shares of nodes miss most, as hats that
begin inside a solid have the least of their profile where the water is.  Over a bed of 1:20 through the cells they
moved water a seventh faster than its velocity.
"""

from __future__ import annotations

import numpy as np

from fluid.domain.layers import WORK
from fluid.domain.moments import part_moments
from fluid.numerics.fields import copied, nothing
from fluid.surface.volume import Flux, edge_rates
from kernels.decorators import inner, ranged, released
from kernels.threads import found_over, over, owning, reach_of_rows, taken, zeros

NEAR = 3.0
"""|φ| in cell sizes beyond which no node has a hat that the surface gets to in a step."""
STEP = 0.75
"""... and no cell is cut: in water that crosses half of one."""
SLOW = (0.25, 0.5)
"""Cells crossed in a step between which the fluxes by shares take over again."""
WHOLE = 1.0 - 1e-12
"""Share from which a cell counts as wet: those beside solids are filled to round-off only."""


def swept(topology, flux: Flux, phi, u, moved, dt: float) -> np.ndarray:
    """Volume (N,) [m³] that the nodes get by (1) in dt [s] beyond what they got by the fluxes along the edges.

    All of the domain of the flux: φ (N,) [m] at the beginning · u (N, 3) [m/s] at mid-step · moved (edges,) [m³] what
    went out along each edge. Where no surface is slow enough, only the nodes are visited."""
    t, g = topology, flux.graph
    weight, counted = zeros((len(phi),)), np.zeros(len(phi), bool)
    some = any(over(_weights, len(flux.nodes), flux.nodes, phi, u, t.node_size, dt, weight, counted))
    if not some:
        return nothing(len(phi))
    around = t.cells_around(counted)
    velocity, beside = np.empty(flux.velocity.shape), np.zeros(len(phi), bool)
    reached = found_over(
        _in_reach, len(around), around, phi, t.node_size, t.cells, flux.velocity, velocity, beside
    )
    after, near = copied(phi), taken(beside)
    before = ((counted, flux.velocity, velocity), phi, u, dt, t.paths, t.volume)
    over(_after, len(near), near, *before, after, weight=WORK)
    over(_by_share, len(reached), reached, phi, after, t.parts, flux.velocity, velocity, beside)
    nodes = found_over(_those_in, len(flux.nodes), flux.nodes, beside)
    rate = edge_rates(t, g, nodes, velocity)
    out, reach = zeros((len(phi),)), reach_of_rows(nodes, g.row, g.start, g.neighbour)
    state = (nodes, beside, weight, g.edges, (dt, rate), moved)
    owning(_difference, len(phi), reach, len(nodes), *state, out, weight=WORK)
    return out


@ranged
def _weights(first, last, nodes, phi, u, size, dt, weight, counted):
    """Weight (N,) of what the surface sweeps at the listed nodes; counted (N,) bool: those of some near the surface;
    → whether there are any."""
    some = False
    for s in range(first, last):
        i = nodes[s]
        speed = np.sqrt(u[i, 0] * u[i, 0] + u[i, 1] * u[i, 1] + u[i, 2] * u[i, 2])
        weight[i] = min(1.0, max(0.0, (SLOW[1] - dt * speed / size[i]) / (SLOW[1] - SLOW[0])))
        counted[i] = weight[i] > 0.0 and abs(phi[i]) < NEAR * size[i]
        some = some or counted[i]
    return some


@released
def _those_in(first, last, nodes, some):
    """Those of the listed nodes that are in a set (N,) bool, in order."""
    found, n = np.empty(last - first, np.int64), 0
    for s in range(first, last):
        if some[nodes[s]]:
            found[n] = nodes[s]
            n += 1
    return found[:n].copy()


@released
def _in_reach(first, last, cell_list, phi, size, cells, u, velocity, beside):
    """The listed cells that the surface may cut within the step, whose corners are marked (N,) bool; the others take
    the velocity u (M, 3) if they are wet, and zero if they are dry."""
    found, n = np.empty(last - first, np.int64), 0
    for s in range(first, last):
        e = cell_list[s]
        wet, dry = True, True
        for a in range(4):
            i = cells[e, a]
            wet = wet and phi[i] < -STEP * size[i]
            dry = dry and phi[i] > STEP * size[i]
        if wet:
            for k in range(3):
                velocity[e, k] = u[e, k]
        elif dry:
            for k in range(3):
                velocity[e, k] = 0.0
        else:
            found[n] = e
            n += 1
            for a in range(4):
                beside[cells[e, a]] = True
    return found[:n].copy()


@ranged
def _after(first, last, nodes, beyond, phi, u, dt, mesh, volume, out):
    """φ (N,) [m] that u has carried on for dt at the listed nodes, with the mean of ∇φ over the cells around each.

    beyond: nodes (N,) bool, and velocities (M, 3) of which the second becomes the first in wet cells around listed
    nodes that have none of these among their corners, and zero in other such cells."""
    cells, parent, g = mesh.cells, mesh.parent, mesh.gradients
    counted, whole, velocity = beyond
    for s in range(first, last):
        i, weight, rate = np.uint64(nodes[s]), 0.0, 0.0
        if not counted[i]:
            for c in range(mesh.node_start[i], mesh.node_start[i + np.uint64(1)]):
                e = mesh.node_cells[c]
                n_counted, n_wet = 0, 0
                for a in range(4):
                    n_counted += counted[cells[e, a]]
                    n_wet += phi[cells[e, a]] < 0.0
                if n_counted == 0:
                    for k in range(3):
                        velocity[e, k] = whole[e, k] if n_wet == 4 else 0.0
        for c in range(mesh.node_start[i], mesh.node_start[i + np.uint64(1)]):
            e = mesh.node_cells[c]
            p = parent[e]
            weight += volume[e]
            for a in range(4):
                for k in range(3):
                    rate += volume[e] * phi[cells[e, a]] * g[p, a, k] * u[i, k]
        out[i] = phi[i] - dt * (rate / max(weight, 1e-300))


@released
def _by_share(first, last, cell_list, phi, after, parts, u, velocity, beside):
    """u (M, 3) times the wet share of the fluid part of the listed cells, mean over the step by Simpson's rule; the
    corners of those that are cut are marked (N,) bool."""
    local, out = np.empty(4), np.empty(4)
    for s in range(first, last):
        e, share = np.uint64(cell_list[np.uint64(s)]), 0.0
        i, j, k, m = parts.cells[e, 0], parts.cells[e, 1], parts.cells[e, 2], parts.cells[e, 3]
        a, b, c, d, p, q, r, t = phi[i], phi[j], phi[k], phi[m], after[i], after[j], after[k], after[m]
        wet = a < 0.0 and b < 0.0 and c < 0.0 and d < 0.0 and p < 0.0 and q < 0.0 and r < 0.0 and t < 0.0
        some = a < 0.0 or b < 0.0 or c < 0.0 or d < 0.0 or p < 0.0 or q < 0.0 or r < 0.0 or t < 0.0
        if wet and parts.start[e] == parts.start[e + np.uint64(1)]:
            share = 1.0
        elif some:
            middle = (0.5 * (a + p), 0.5 * (b + q), 0.5 * (c + r), 0.5 * (d + t))
            before = _wet_share(e, (a, b, c, d), parts, local, out)
            share = before + 4.0 * _wet_share(e, middle, parts, local, out)
            share = (share + _wet_share(e, (p, q, r, t), parts, local, out)) / 6.0
        velocity[e, 0], velocity[e, 1], velocity[e, 2] = share * u[e, 0], share * u[e, 1], share * u[e, 2]
        if 0.0 < share < WHOLE:
            beside[i], beside[j], beside[k], beside[m] = True, True, True, True


@inner
def _wet_share(e, phi, parts, local, out):
    """Share of the fluid part of cell e that is water with the four values φ at its corners."""
    x, y, z, w = part_moments(e, phi, parts, local, out)
    return min((x + y + z + w) / parts.volume[e], 1.0)


@ranged
def _difference(first, last, runs, nodes, reached, weight, edges, swept, moved, out):
    """Volume (N,) [m³] that the listed nodes and their neighbours get if in dt [s], by rates (edges,) [m³/s], both
    `swept`, leaves along the edges instead of `moved` (edges,) [m³], by the lesser weight (N,) of both ends."""
    graph_row, start, neighbour = edges.row, edges.start, edges.neighbour
    dt, rate = swept
    for run in range(runs.shape[0]):
        for place in range(runs[run, 0], runs[run, 1]):
            i = np.uint64(nodes[np.uint64(place)])
            own, share = first <= np.int64(i) < last, weight[i]
            if share == 0.0:
                continue
            r = np.uint64(graph_row[i])
            for s in range(start[r], start[r + np.uint64(1)]):
                j = neighbour[s]
                theirs = not reached[j] and first <= j < last
                if weight[j] == 0.0 or graph_row[j] < 0 or not (own or theirs):
                    continue
                came, back = 0.0, np.uint64(graph_row[j])
                for b in range(start[back], start[back + np.uint64(1)]):
                    if neighbour[b] == i:
                        came = moved[b]
                        break
                more = min(share, weight[j]) * (dt * rate[s] - (moved[s] - came))
                if own:
                    out[i] -= more
                if theirs:
                    out[j] += more
