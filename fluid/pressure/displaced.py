"""The volume of water that bodies take from the nodes as they move on.

On a short way w over its wetted surface a body takes ∫_{φ<0} N_i w·n dA from the water at node i. G w is the integral
over the polygons of wet cells whole, so that of what lies above the surface is taken off.  (The share of water at a
node in place of this took water from nodes just below a block that flew above a pool, and moved its surface: 0.3 mJ in
the first steps of a block of 35 g.)  Only what lies above the surface in cells around nodes that wet cells of the wall
touch, too, is looked at: from the others nothing is taken, exactly.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.domain.hats import POLYGON, hats_at, value_at
from fluid.pressure.waterline import relative_area, wet_triangles
from kernels.decorators import inner, kernel, released
from kernels.threads import over


def taken_from_nodes(domain, coupling, phi: Array, way: Array) -> Array:
    """Volume (N,) [m³], negative where the body leaves room.

    domain: PhysicalDomain · coupling: its G · phi (N,) [m] · way (n_bodies, 6) [m, rad]."""
    at, reached = _above_water(domain.face_cell, phi, domain.cells)
    taken = coupling @ way.ravel()
    if len(at):
        faces, found = (domain.polygons(), domain.face_corners), np.empty((len(at), 4))
        over(
            _dry,
            len(at),
            at,
            faces,
            domain.hats,
            domain.nodes,
            domain.body_centre,
            phi,
            way,
            found,
            weight=POLYGON,
        )
        _take_off(at, domain.face_cell, domain.cells, found, taken)
    return np.where(reached, taken, 0.0)


@kernel
def _above_water(face_cell, phi, cells):
    """Polygons (k,) whose cells are not wholly wet and have a node of which water can be taken; reached (N,) bool:
    these nodes, those of polygons whose cells have a wet node."""
    wet, reached = np.zeros(face_cell.shape[0], np.uint8), np.zeros(phi.shape[0], np.bool_)
    for s in range(face_cell.shape[0]):
        e = np.uint64(face_cell[s])
        for a in range(4):
            wet[s] += phi[np.uint64(cells[e, a])] < 0.0
        if wet[s] > 0:
            for a in range(4):
                reached[np.uint64(cells[e, a])] = True
    found, n = np.empty(face_cell.shape[0], np.int64), 0
    for s in range(face_cell.shape[0]):
        e = np.uint64(face_cell[s])
        some = False
        for a in range(4):
            some = some or reached[np.uint64(cells[e, a])]
        if some and wet[s] < 4:
            found[n] = s
            n += 1
    return found[:n].copy(), reached


@released
def _dry(first, last, at, faces, hats, nodes, centre, phi, way, found):
    """found (k, 4): -∫_{φ≥0} N_a w·n dA of the corners a of the cells of the listed triangles, exactly: φ and N_a are
    linear in a cell, w over a triangle."""
    polygons, corners = faces
    hat, x, flux, height = np.empty((3, 4)), np.empty(3), np.empty(3), np.empty(3)
    share, part_hat, part_flux = np.empty((2, 3, 3)), np.empty((3, 4)), np.empty(3)
    for s in range(first, last):
        row = at[s]
        e, b, area, n = polygons.cell[row], polygons.body[row], polygons.area[row], polygons.normal[row]
        for q in range(3):
            hats_at(e, corners[row, q], hats, nodes, hat[q])
            height[q] = value_at(e, hat[q], phi, hats.cells)
            for c in range(3):
                x[c] = corners[row, q, c] - centre[b, c]
            flux[q] = (
                (way[b, 0] + way[b, 4] * x[2] - way[b, 5] * x[1]) * n[0]
                + (way[b, 1] + way[b, 5] * x[0] - way[b, 3] * x[2]) * n[1]
                + (way[b, 2] + way[b, 3] * x[1] - way[b, 4] * x[0]) * n[2]
            )
        wet = (height[0] < 0.0) + (height[1] < 0.0) + (height[2] < 0.0)
        for a in range(4):
            found[s, a] = 0.0 if wet == 3 else -_product(area, hat, a, flux)
        if wet == 1 or wet == 2:
            for t in range(wet_triangles(height, share)):
                part = share[t]
                for k in range(3):
                    part_flux[k] = part[k, 0] * flux[0] + part[k, 1] * flux[1] + part[k, 2] * flux[2]
                    for a in range(4):
                        h = part[k, 0] * hat[0, a] + part[k, 1] * hat[1, a] + part[k, 2] * hat[2, a]
                        part_hat[k, a] = h
                for a in range(4):
                    found[s, a] += _product(area * relative_area(part), part_hat, a, part_flux)


@kernel
def _take_off(at, face_cell, cells, found, taken):
    """taken (N,) += found (k, 4) at the corners of the cells of the listed triangles, in their order."""
    for s in range(at.shape[0]):
        e = face_cell[at[s]]
        for a in range(4):
            taken[cells[e, a]] += found[s, a]


@inner
def _product(area, hat, a, flux):
    """∫ N_a f dA over a triangle, from the values at its corners."""
    both = hat[0, a] * flux[0] + hat[1, a] * flux[1] + hat[2, a] * flux[2]
    sum_hat, sum_flux = hat[0, a] + hat[1, a] + hat[2, a], flux[0] + flux[1] + flux[2]
    return area / 12.0 * (both + sum_hat * sum_flux)
