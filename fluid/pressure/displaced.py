"""The volume of water that bodies take from the nodes as they move on.

On a short way w over its wetted surface a body takes ∫_{φ<0} N_i w·n dA from the water at node i. G w is the integral
over the polygons of wet cells whole, so that of what lies above the surface is taken off.  (The share of water at a
node in place of this took water from nodes just below a block that flew above a pool, and moved its surface: 0.3 mJ in
the first steps of a block of 35 g.)
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.pressure.waterline import relative_area, wet_triangles
from kernels.decorators import inner, kernel


def taken_from_nodes(domain, coupling, phi: Array, way: Array) -> Array:
    """Volume (N,) [m³], negative where the body leaves room.

    domain: PhysicalDomain · coupling: its G · phi (N,) [m] · way (n_bodies, 6) [m, rad]."""
    taken = coupling @ way.ravel()
    if len(domain.face_cell):
        faces = (domain.polygons(), domain.face_corners)
        _take_off_dry(faces, domain.hats, domain.nodes, domain.body_centre, phi, way, taken)
    return taken


@kernel
def _take_off_dry(faces, hats, nodes, centre, phi, way, taken):
    """Take ∫_{φ≥0} N_i w·n dA off what was taken (N,), exactly: φ and N_i are linear in a cell, w over a polygon."""
    (face_cell, face_body, area, normal, _), corners = faces
    cells, parent, g = hats
    hat, flux, height = np.empty((3, 4)), np.empty(3), np.empty(3)
    share, whole = np.empty((2, 3, 3)), np.eye(3)
    for s in range(len(face_cell)):
        e, b = face_cell[s], face_body[s]
        dry = 0
        for a in range(4):
            dry += phi[cells[e, a]] >= 0.0
        if dry == 0:
            continue
        p, o = parent[e], cells[e, 0]
        for q in range(3):
            hat[q, 0] = 1.0
            for a in range(1, 4):
                hat[q, a] = 0.0
                for c in range(3):
                    hat[q, a] += g[p, a, c] * (corners[s, q, c] - nodes[o, c])
                hat[q, 0] -= hat[q, a]
            height[q] = 0.0
            for a in range(4):
                height[q] += hat[q, a] * phi[cells[e, a]]
            x0, x1, x2 = (
                corners[s, q, 0] - centre[b, 0],
                corners[s, q, 1] - centre[b, 1],
                corners[s, q, 2] - centre[b, 2],
            )
            flux[q] = (
                (way[b, 0] + way[b, 4] * x2 - way[b, 5] * x1) * normal[s, 0]
                + (way[b, 1] + way[b, 5] * x0 - way[b, 3] * x2) * normal[s, 1]
                + (way[b, 2] + way[b, 3] * x1 - way[b, 4] * x0) * normal[s, 2]
            )
        triangles = wet_triangles(height, share)
        for a in range(4):
            found = -_product(area[s], whole, hat, a, flux)
            for k in range(triangles):
                found += _product(area[s] * relative_area(share[k]), share[k], hat, a, flux)
            taken[cells[e, a]] += found


@inner
def _product(area, part, hat, a, flux):
    """∫ N_a f dA over a part with barycentric corners (3, 3), from the values at the corners of the whole."""
    both = sum_hat = sum_flux = 0.0
    for k in range(3):
        h = part[k, 0] * hat[0, a] + part[k, 1] * hat[1, a] + part[k, 2] * hat[2, a]
        f = part[k, 0] * flux[0] + part[k, 1] * flux[1] + part[k, 2] * flux[2]
        both, sum_hat, sum_flux = both + h * f, sum_hat + h, sum_flux + f
    return area / 12.0 * (both + sum_hat * sum_flux)
