"""Air on walls that the water has left: the level set follows the volume there.

Where air reaches a wall and the pressure is at its bound, water leaves the wall (`pressure_bound.py`), and the volume W
of the nodes of the wall falls below that of the level set. Carried along paths, φ finds no air there: a path that comes
out of the wall begins in a cell that the water before the edge fills. Nor does the correction of φ towards W
(`volume.py`) open a cavity: far below the surface φ has no slope of volume, and what the node lacks is taken from the
nearest surface. So a jet went on along the sides of a plate behind its edges, up to a sixth of its volume came out
of these sides, and as much was taken from its surface.

There φ is therefore that of a layer of air on the wall, as thick as the volume says,

    φ_i = (1 - √s) h,    s = W_i/V_i,

since a layer of the thickness d leaves the share (1 - d/h)² of the hat function of a node on a plane wall. Such nodes
count as reached by air in the next step, also while they are dry.

A node whose hat function reaches both sides of a wall thinner than a cell has one φ and one volume for both (single
covers): where one side is dry, the volume falls short of φ without any air on the other. Such nodes are left out."""

from __future__ import annotations

import numpy as np

from array_types import Array, Bools
from fluid.domain.hats import hats_at
from fluid.domain.moments import nodal_water
from fluid.numerics.fields import copied
from kernels.decorators import plain

LEAST_LACKING = 0.05
"""Share of what a node can hold by which its volume must fall short of that of φ: a layer of a fortieth of a cell.
Volume and level set differ by some per cent wherever the surface moves fast."""

ONE_SIDED = 0.5
"""Length of the mean normal of the walls that a hat function reaches from which these count as one side: 1 on a plane
wall, 0.7 at a square edge, 0 on both sides of a thin plate."""


def on_one_side(domain, nodes) -> Array:
    """Those of the nodes (n,) whose hat functions reach walls of solids from one side: where |∫ N_i n dA| is at least
    ONE_SIDED ∫ N_i dA [m²] over the wetted polygons, by the values at their centroids. domain: PhysicalDomain."""
    sums = np.zeros((len(domain.nodes), 4))
    _add_walls(domain.polygons(), domain.face_centroid, domain.hats, domain.nodes, np.empty(4), sums)
    area, along = sums[nodes, 0], sums[nodes, 1:]
    return nodes[np.linalg.norm(along, axis=1) >= ONE_SIDED * area]


@plain
def _add_walls(polygons, centroid, hats, nodes, hat, sums):
    """sums (N, 4) += ∫ N_i dA and ∫ N_i n dA of every polygon · hat (4,): work space."""
    for s in range(centroid.shape[0]):
        e = polygons.cell[s]
        hats_at(e, centroid[s], hats, nodes, hat)
        for a in range(4):
            i = np.uint64(hats.cells[e, a])
            weight = polygons.area[s] * hat[a]
            sums[i, 0] += weight
            for c in range(3):
                sums[i, 1 + c] += weight * polygons.normal[s, c]


def air_on_walls(topology, phi, water, reached, walls) -> tuple[Array, Bools | None]:
    """φ (N,) [m] with layers of air on the walls of solids that the water has left, and the nodes (N,) bool that have
    one; φ itself and None where there is none.

    water (N,) [m³]: volume of the nodes · reached (N,) bool: nodes with the pressure of the air in the last step, or
    with a layer of air · walls (n,): nodes whose hat functions reach walls of solids from one side."""
    t = topology
    near = walls[reached[walls] & t.active[walls] & (phi[walls] < t.node_size[walls])]
    if len(near) == 0:
        return phi, None
    found = np.zeros(len(phi), bool)
    found[near] = True
    lacking = nodal_water(t.cells_around(found), 0.0, phi, t.parts, len(phi)) - water
    found &= lacking > LEAST_LACKING * t.node_volume
    nodes = np.flatnonzero(found)
    if len(nodes) == 0:
        return phi, None
    share = np.clip(water[nodes] / t.node_volume[nodes], 0.0, 1.0)
    phi = copied(phi)
    phi[nodes] = np.maximum(phi[nodes], (1.0 - np.sqrt(share)) * t.node_size[nodes])
    return phi, found
