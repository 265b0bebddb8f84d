"""The level set at the start: the fill of a case made fit for the steps.

A fill ends where it was drawn, often inside a wall.  There it is continued from outside the solids, where it means
something: what it is inside decides how much of the cut cells is wet.  A plane is continued exactly, so that water at
rest beside a solid of any slope rests from the first step on.
"""

from __future__ import annotations

import numpy as np

from fluid.extension import continue_outward, mean_gradients
from fluid.level_set import redistance, without_films
from fluid.moments import cells_touching
from fluid.topology import layers_around
from fluid.volume import nodal_volume

COVERED_LAYERS = 3
"""Layers of nodes inside solids that the fill is continued over."""


def first_surface(topology, phi, listed, spacing: float):
    """Level set (N,) [m] from a fill phi (N,) [m]; listed (n,): nodes around the water; spacing [m] of the mesh."""
    fill = phi
    for _ in range(3):  # the first continuation still sees a surface bent inside the solids
        # below a surface a fill may count from its other sides; above it, a distance would bend at the surface's end
        phi = np.where(
            (phi < 0.0) | topology.covered, redistance(topology, phi, spacing, rescale=False), fill
        )
        held = nodal_volume(topology, phi)
        _continue_into_solids(topology, phi, listed)
        _keep_dry(topology, phi, held)
    return without_films(redistance(topology, phi, spacing, rescale=False), spacing)


def _continue_into_solids(topology, phi, listed) -> None:
    """Continue φ (N,) linearly from outside the solids into the covered nodes among `listed`, in place.

    What the surface does inside a solid means nothing, but its place there decides how much of the cut cells
    is wet; a plane is continued exactly, so that water at rest beside a solid stays at rest."""
    t = topology
    covered = np.zeros(len(phi), bool)
    covered[listed] = t.covered[listed]
    if not covered.any():
        return
    beside = cells_touching(covered, t.cells)
    seed = np.zeros(len(phi), bool)
    seed[t.cells[beside]] = True
    seed &= ~t.covered
    order, start = layers_around(seed, COVERED_LAYERS, *t.around)
    order, start = _only(t.covered, order, start)
    around = cells_touching(seed, t.cells)
    f = phi[:, None].copy()
    gradient = mean_gradients(around, ~t.covered, f, t.cells, t.parent, t.gradients, t.volume, len(phi))
    continue_outward(
        order, start, COVERED_LAYERS, f, gradient, t.nodes, t.cells, t.node_start, t.node_cells, ~t.covered
    )
    phi[covered] = f[covered, 0]


def _only(marked, order, start):
    """Layers 1.. of `order` reduced to the marked nodes; layer 0 is left as it is."""
    layer = np.repeat(np.arange(len(start) - 1), np.diff(start))
    keep = marked[order] | (layer == 0)
    count = np.bincount(layer[keep], minlength=len(start) - 1)
    return order[keep], np.concatenate([[0], np.cumsum(count)])


def _keep_dry(topology, phi, carried) -> None:
    """No water where none was carried, in place: φ (N,) of covered nodes that neither hold nor touch water is kept
    positive.  A level surface continued around the edge of a wall would put water on its dry side."""
    t = topology
    doubtful = t.covered & (phi < 0.0)
    if not doubtful.any():
        return
    near_water = np.zeros(len(phi), bool)
    near_water[t.cells[cells_touching(carried > 0.0, t.cells)]] = True
    doubtful &= ~near_water
    phi[doubtful] = -phi[doubtful]
