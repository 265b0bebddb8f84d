"""Transport of the level set at nodes inside solids, beyond the last cell of their water.

A path that leaves the covers of the water through a solid ends on the face of its last cell (`advection.walk`): the
foot is moved along the normal m of that face, and φ changes by dt (u - (u·m) m)·∇φ instead of dt u·∇φ.  At a water line
on a solid, where such a node carries the surface of cut cells, a velocity *along* the surface then lifts it wherever
that face is inclined; the slope of the surface drives the velocity further, which grows in still water by up to 0.05 a
step.  Therefore φ is extrapolated beyond the face with the gradient of the last cell,

    φ̃_i = φ(x_d) + r·∇φ,      r = x_i - dt u_m(x_d) - x_d,                                                    (1)

without the MacCormack correction, because the path forward ends at such a face as well.
"""

from __future__ import annotations

import numpy as np

from fluid.transport.advection import feet
from kernels.decorators import kernel

FARTHEST = 0.1
"""Cell sizes that φ is continued by: enough for calm water; a slope says nothing about what is farther."""


def levels_in_solids(topology, listed, dt: float, u_m, phi, spacing):
    """Equation (1) at those of the listed nodes (n,) that lie inside solids: their places in the list (k,), φ̃ (k,)
    [m].

    u_m (N, 3) [m/s], phi (N,) [m], spacing [m]: size of the cells at each node (N,), or one for all."""
    t = topology
    places = np.flatnonzero(t.covered[listed])
    inside = listed[places]
    cell, weight = feet(inside, -1.0, dt, 3, u_m, t.paths)
    farthest = np.broadcast_to(FARTHEST * np.asarray(spacing), phi.shape)[inside]
    return places, _continued(inside, cell, weight, dt, farthest, u_m, phi, t.nodes, t.hats)


@kernel
def _continued(inside, cell, weight, dt, farthest, u_m, phi, nodes, hats):
    cells, parent, g = hats.cells, hats.parent, hats.gradients
    out, missing, slope = np.zeros(inside.shape[0]), np.empty(3), np.empty(3)
    for s in range(inside.shape[0]):
        e, length = cell[s], 0.0
        for k in range(3):
            missing[k], slope[k] = nodes[inside[s], k], 0.0
            for a in range(4):
                j = cells[e, a]
                missing[k] -= weight[s, a] * (nodes[j, k] + dt * u_m[j, k])
                slope[k] += g[parent[e], a, k] * phi[j]
            length += missing[k] * missing[k]
        for a in range(4):
            out[s] += weight[s, a] * phi[cells[e, a]]
        share = min(1.0, farthest[s] / max(np.sqrt(length), 1e-300))
        for k in range(3):
            out[s] += share * missing[k] * slope[k]
    return out
