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
from fluid.domain.moments import marked_corners
from fluid.domain.physical_domain import hat_values
from fluid.pressure.waterline import differences


def film_volume(domain, drawn_in: Array, phi: Array, potential: Array) -> tuple[float, float]:
    """V [m³] of (1), and ∫ g·x dV [m⁵/s²] over it.

    domain: PhysicalDomain · drawn_in (S,) [m] of its wetted polygons · phi (N,) [m] · potential (N,) [m²/s²]: g·x of
    the nodes, from the floor."""
    at = np.flatnonzero(drawn_in)
    at = at[marked_corners(domain.face_cell[at], phi < 0.0, domain.cells) > 0]
    if len(at) == 0:
        return 0.0, 0.0
    corners = domain.cells[domain.face_cell[at]]
    hats = hat_values(domain.nodes[corners], domain.face_corners[at])
    height, weight = (np.einsum("kqa,ka->kq", hats, f[corners]) for f in (phi, potential))
    depth = np.repeat(drawn_in[at, None], 3, axis=1)
    weights = np.zeros((len(at), 3, 3))
    weights[:, :, 0] = weight
    volume, first = differences(height, depth, np.zeros_like(depth), weights, domain.face_area[at])
    return -float(volume.sum()), -float(first[:, 0].sum())
