"""The water in films that loose bodies are drawn in by: room that the bodies themselves take.

Where loose bodies touch, their faces are cut drawn in, by more than they overlap, so that water reaches them
(`films.py` for the pressure there).  A body moves with its whole volume all the same, and the work that the water does
on it is that of its whole surface.  The film below the surface,

    V = ∫_{φ<0} d dA,        d: depth by which a face is drawn in,                                        (1)

is therefore no water of the scene: neither its volume nor its weight counts.  Else a film that grows as bodies press on
each other would draw its volume from the surface and give it back as they part, and the potential energy of the water
would go to and fro without work (0.2 J in a pool of 0.8 m as a block of 160 kg rings by 0.3 mm on another one).
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.domain.hats import POLYGON, hats_at, value_at
from fluid.domain.moments import marked_corners
from fluid.pressure.waterline import add_over_wet
from kernels.decorators import released
from kernels.threads import over


def film_volume(domain, drawn_in: Array, phi: Array, potential: Array) -> tuple[float, float]:
    """V [m³] of (1), and ∫ g·x dV [m⁵/s²] over it.

    domain: PhysicalDomain · drawn_in (S,) [m] of its wetted polygons · phi (N,) [m] · potential (N,) [m²/s²]: g·x of
    the nodes, from the floor."""
    at = np.flatnonzero(drawn_in)
    at = at[marked_corners(domain.face_cell[at], phi < 0.0, domain.cells) > 0]
    if len(at) == 0:
        return 0.0, 0.0
    faces, found = (domain.polygons(), domain.face_corners), np.empty((len(at), 2))
    over(
        _films, len(at), at, faces, domain.hats, domain.nodes, drawn_in, phi, potential, found, weight=POLYGON
    )
    volume, weighted = found.sum(axis=0).tolist()
    return volume, weighted


@released
def _films(first, last, at, faces, hats, nodes, drawn_in, phi, potential, found):
    """found (k, 2): ∫_{φ<0} d dA [m³] and ∫_{φ<0} d g·x dA [m⁵/s²] of the listed triangles."""
    polygons, corners = faces
    hat, height, depth, arm = np.empty(4), np.empty(3), np.empty(3), np.zeros((3, 3))
    room, sums = (np.empty((2, 3, 3)), np.empty((4, 3))), np.empty(4)
    for s in range(first, last):
        row = at[s]
        e = polygons.cell[row]
        for q in range(3):
            hats_at(e, corners[row, q], hats, nodes, hat)
            height[q] = value_at(e, hat, phi, hats.cells)
            arm[q, 0] = value_at(e, hat, potential, hats.cells)
            depth[q] = drawn_in[row]
        sums[:] = 0.0
        add_over_wet(1.0, polygons.area[row], height, depth, arm, room, sums)
        found[s, 0], found[s, 1] = sums[0], sums[1]
