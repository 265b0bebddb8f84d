"""The surface of fast water, and of viscous liquids, where it comes to dry sides of the tank.

The level set of a node is carried along the path of its velocity.  At a node on a closed side the velocity has no part
into the side, as long as the node is dry, too: a surface that falls on a floor would come to a stop before it, as

    d' = -u d/h,      d: what is left of its way, u: velocity of the water a cell above,                    (1)

however fast the water comes.  The volume does come, since its fluxes are those of the water (`volume.py`).  What the
two differ by, up to a tenth of a drop of three cells in a step, is what the correction of the level set would have to
bring to the floor; it spreads over some cells, and the drop lies too high: potential energy that its fall has spent
already.  A liquid whose viscosity keeps the drop together dissipates next to nothing else, and gained up to a quarter
of what it released.  The front of a dam break on cells of H/16 lost 0.08 √(H/g) in the last cell before a wall.

At a dry node of a side φ is therefore carried by the velocity of the water continued to there as if the side were not
(`free_velocity`), by the part of it into the side as much as viscosity diffuses momentum within a cell, or momentum
governs the motion within one, with the weight w of fast water (`surface_momentum.by_speed`):

    u = P u_c + max(1 - R(|u_c| h/ν; 10, 100), w) (I - P) u_c                                               (2)

with the projector P onto the directions along the side, R(x; b, c) = (x - b)/(c - b) within 0 and 1.  A side that is
wet to beside the node has no velocity into it, and neither has u_c.
"""

from __future__ import annotations

import numpy as np

from fluid.numerics.fields import marks_of
from fluid.surface.extrapolation import continued
from fluid.transport.advection import Fields, carried
from fluid.transport.surface_momentum import by_speed

RESOLVED = (10.0, 100.0)
"""|u| h/ν between which this ends where the water is slower than the shallow-water wave of a cell."""


def gained(water, dt: float, u, fields: Fields):
    """What φ (n,) [m] of dry nodes on closed sides gains over dt [s] by (2) against the velocity u (N, 3) [m/s] at
    mid-step, which the sides hold, and their places (n,) in `Water.listed`; fields: φ before, with any velocity."""
    places, projector = _dry_on_sides(water)
    t, p, nodes = water.topology, water.parameters, water.listed[places]
    if len(nodes) == 0:
        return np.zeros(0), places
    free, size, viscosity = free_velocity(water, u, nodes), t.node_size, p.viscosity / p.density
    fast = np.empty(len(u))
    by_speed(nodes, free, p.gravity, viscosity, size, fast)
    free = free[nodes]
    share = np.maximum(_share(np.linalg.norm(free, axis=1), viscosity, size[nodes]), fast[nodes])
    chosen = share > 0.0
    places, nodes = places[chosen], nodes[chosen]
    if len(nodes) == 0:
        return np.zeros(0), places
    into = free - np.einsum("nij,nj->ni", projector, free)
    # the way back ends at the side: MacCormack would take half of the change away
    one_way = marks_of(nodes, len(u))
    held = carried(t, nodes, dt, u, fields, one_way)[:, 3]
    fields.renew(nodes)
    kept = u[nodes]
    u[nodes] = kept + share[chosen, None] * into[chosen]
    free = carried(t, nodes, dt, u, fields, one_way)[:, 3]
    u[nodes] = kept
    return free - held, places


def free_velocity(water, u, nodes):
    """u (N, 3) [m/s] of these nodes (n,) in the layer around the water, continued from it as if there were no sides;
    anything at others."""
    return continued(water.topology, (water.listed, water.layer_start[:3]), u, nodes)


def _dry_on_sides(water):
    """Places (n,) in `Water.listed` of the nodes in the layer around the water that are on closed sides that none flows
    through, and projectors (n, 3, 3) onto the directions along these."""
    w, start = water.walls, water.layer_start
    found = w.closed_row[water.listed[start[1] : start[2]]]
    return start[1] + np.flatnonzero(found >= 0), w.when_dry[found[found >= 0]]


def _share(speed, viscosity, size):
    """1 - R(|u| h/ν; RESOLVED) (n,) of speeds (n,) [m/s], a kinematic viscosity [m²/s] and sizes (n,) [m]."""
    low, high = RESOLVED
    if viscosity == 0.0:
        return np.zeros(len(speed))
    return np.clip((high - speed * size / viscosity) / (high - low), 0.0, 1.0)
