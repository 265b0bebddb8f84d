"""The load on solids where the water surface passes through their cells.

The coupling G of the pressure solve takes the wetted polygons of a cell whole.  This is required: for every hat
function of a wet node, ∫ V·∇N_i dV + G V = 0 must hold for water and solid that move together, which determines G.  As
a load, -Gᵀp then includes the hat functions of wet corners over the dry part of a face, an error of up to (h/depth)²/2,
or even a load on a whole deck less than a cell above the water.  The pressure itself ends at the surface,

    F = -∫_{φ<0} p n dA,        p = Σ_wet p_i N_i + Σ_dry p_j N_j,                                        (1)

with the dry values p_j continued through the zero at the surface (`projection.with_ghosts`).  The difference

    R = F + Gᵀp = -∫_{φ<0} p n dA + ∫ Σ_wet p_i N_i n dA                                                  (2)

is added to the load as a known force, with the pressure of the last step.  It opposes a share of Gᵀp, which is part of
the solve, so the error of this delay cannot grow: with a share ε of the added mass m_a of a body of mass m, an error of
the acceleration is multiplied by ε m_a / (m + m_a) < 1 in every step."""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.domain.moments import cells_touching, marked_corners
from fluid.domain.physical_domain import hat_values
from fluid.pressure.projection import with_ghosts
from kernels.decorators import inner, kernel


def waterline_load(domain, faces, left_out, phi, wet, pressure, open_node, air=None) -> Array:
    """R of (2): force and moment on every body (n_bodies, 6) [N, N m].

    faces (k,) rows of the polygons of G · left_out (l,) rows of those not in G though their cells hold water ·
    phi (N,) [m] · wet (N,) bool · pressure (N,) [Pa], read on wet nodes · open_node (N,) bool: p = 0, no seas ·
    air (N,) [Pa]: pressure of trapped air at dry nodes, None: there is none. It acts on both sides of the surface, so
    that the correction is that of the pressure above it."""
    load = np.zeros((domain.n_bodies, 6))
    count = marked_corners(domain.face_cell[faces], wet, domain.cells)
    mixed = faces[(count > 0) & (count < 4)]
    at = np.concatenate([mixed, left_out])
    if len(at) == 0:
        return load
    corners = domain.cells[domain.face_cell[at]]
    p = np.where(wet & ~open_node, pressure, 0.0)
    reached = np.zeros(len(phi), bool)
    reached[corners] = True
    beside = cells_touching(reached, domain.cells)
    outside = np.zeros(len(phi)) if air is None else air
    ghosts = with_ghosts(p, outside, wet, open_node, phi, beside, domain.cells, domain.volume)
    hats = hat_values(domain.nodes[corners], domain.face_corners[at])
    full, acting = ghosts[corners], p[corners]
    if air is not None:
        above = outside[corners][np.arange(len(at)), np.abs(outside[corners]).argmax(axis=1)][:, None]
        full, acting = full - above, np.where(wet[corners] & ~open_node[corners], acting - above, 0.0)
    height, full, acting = (np.einsum("kqa,ka->kq", hats, f) for f in (phi[corners], full, acting))
    acting[len(mixed) :] = 0.0
    body = domain.face_body[at]
    arm = domain.face_corners[at] - domain.body_centre[body][:, None]
    force, first = differences(height, full, acting, arm, domain.face_area[at])
    normal = domain.face_normal[at]
    np.add.at(load[:, :3], body, force[:, None] * normal)
    np.add.at(load[:, 3:], body, np.cross(first, normal))
    return load


def hydrostatic_stiffness(water, phi, bodies) -> Array | None:
    """K (n_bodies, 3, 3) [N/m, N, N m]: how the load of still water on a body changes as it heaves, rolls and pitches
    about its centre in water that stays where it is,

        K = -ρ g ∮_{φ<0} [n_z; (r × n)_x; (r × n)_y] ⊗ [1, y, -x] dA,    d(F_z, M_x, M_y) = -K d(z, θ_x, θ_y),      (3)

    zero for a body wholly under water (Newman, Marine Hydrodynamics, 1977, chapter 6). None: the surface cuts no body.

    phi (N,) [m] of the surface · bodies (n_bodies,) bool: the others get zeros."""
    domain, weight = water.domain, water.parameters.density * water.parameters.gravity
    below = marked_corners(domain.face_cell, phi < 0.0, domain.cells)
    cut = np.zeros(domain.n_bodies, bool)
    cut[domain.face_body[(below > 0) & (below < 4)]] = True
    at = np.flatnonzero((cut & bodies)[domain.face_body] & (below > 0))
    if len(at) == 0:
        return None
    corners = domain.cells[domain.face_cell[at]]
    stiffness = np.zeros((domain.n_bodies, 3, 3))
    hats = hat_values(domain.nodes[corners], domain.face_corners[at])
    height = np.einsum("kqa,ka->kq", hats, phi[corners])
    body, normal, area = domain.face_body[at], domain.face_normal[at], domain.face_area[at]
    arm = domain.face_corners[at] - domain.body_centre[body][:, None]
    _add_stiffness(height, arm, area, normal, body, weight, stiffness)
    return stiffness


@kernel
def _add_stiffness(height, arm, area, normal, body, weight, stiffness):
    """Add (3) of triangles with corner values `height` (k, 3) and arms (k, 3, 3) to that of their bodies."""
    share, room, lift = np.empty((2, 3, 3)), np.empty((5, 3)), np.ones((3, 3))
    force, first = np.empty(3), np.empty((3, 3))
    for s in range(height.shape[0]):
        n, b = normal[s], body[s]
        for q in range(3):
            lift[1, q], lift[2, q] = arm[s, q, 1], -arm[s, q, 0]
        force[:], first[:] = 0.0, 0.0
        for t in range(wet_triangles(height[s], share)):
            wet = area[s] * relative_area(share[t])
            for k in range(3):
                _add(-1.0, wet, share[t], lift[k], arm[s], room, force, first, k)
        for k in range(3):
            stiffness[b, 0, k] += weight * (force[k] * n[2])
            stiffness[b, 1, k] += weight * (first[k, 1] * n[2] - first[k, 2] * n[1])
            stiffness[b, 2, k] += weight * (first[k, 2] * n[0] - first[k, 0] * n[2])


@kernel
def differences(height, full, acting, arm, area):
    """∫ p_acting - ∫_{height<0} p_full over triangles with corner values (k, 3): (k,), and times the arm: (k, 3)."""
    n = height.shape[0]
    force, first = np.zeros(n), np.zeros((n, 3))
    share, room = np.empty((2, 3, 3)), np.empty((5, 3))
    corner = np.eye(3)
    for s in range(n):
        if acting[s, 0] != 0.0 or acting[s, 1] != 0.0 or acting[s, 2] != 0.0:
            _add(1.0, area[s], corner, acting[s], arm[s], room, force, first, s)
        for k in range(wet_triangles(height[s], share)):
            part = share[k]
            _add(-1.0, area[s] * relative_area(part), part, full[s], arm[s], room, force, first, s)
    return force, first


@inner
def wet_triangles(height, share):
    """Barycentric corners (·, 3, 3) of the part with height < 0, as 0, 1 or 2 triangles → how many."""
    share[:] = 0.0
    n_wet = 0
    for k in range(3):
        n_wet += height[k] < 0.0
    if n_wet == 0:
        return 0
    if n_wet == 3:
        for k in range(3):
            share[0, k, k] = 1.0
        return 1
    a = 0  # the corner alone on its side
    while (height[a] < 0.0) != (n_wet == 1):
        a += 1
    b, c = (a + 1) % 3, (a + 2) % 3
    to_b, to_c = height[a] / (height[a] - height[b]), height[a] / (height[a] - height[c])
    if n_wet == 1:
        share[0, 0, a] = 1.0
        share[0, 1, a], share[0, 1, b] = 1.0 - to_b, to_b
        share[0, 2, a], share[0, 2, c] = 1.0 - to_c, to_c
        return 1
    share[0, 0, b], share[0, 1, c] = 1.0, 1.0
    share[0, 2, a], share[0, 2, b] = 1.0 - to_b, to_b
    share[1, 0, c] = 1.0
    share[1, 1, a], share[1, 1, b] = 1.0 - to_b, to_b
    share[1, 2, a], share[1, 2, c] = 1.0 - to_c, to_c
    return 2


@inner
def relative_area(part):
    """|det| of barycentric corners (3, 3): the area of the part over that of the triangle."""
    d = part[0, 0] * (part[1, 1] * part[2, 2] - part[1, 2] * part[2, 1])
    d -= part[0, 1] * (part[1, 0] * part[2, 2] - part[1, 2] * part[2, 0])
    d += part[0, 2] * (part[1, 0] * part[2, 1] - part[1, 1] * part[2, 0])
    return abs(d)


@inner
def _add(sign, area, part, p, arm, room, force, first, s):
    """force[s] += sign ∫ p dA, first[s] += sign ∫ p arm dA over the part with barycentric corners (3, 3).

    Products of linear functions f, g over a triangle: A/12 (Σ f_k g_k + Σ f_k Σ g_k) · room (5, 3): work space."""
    total = 0.0
    value, sum_place, place = room[0], room[1], room[2:]
    for c in range(3):
        sum_place[c] = 0.0
    for k in range(3):
        value[k] = part[k, 0] * p[0] + part[k, 1] * p[1] + part[k, 2] * p[2]
        total += value[k]
        for c in range(3):
            place[k, c] = 0.0
            for q in range(3):
                place[k, c] += part[k, q] * arm[q, c]
            sum_place[c] += place[k, c]
    force[s] += sign * area * total / 3.0
    for c in range(3):
        mixed = total * sum_place[c]
        for k in range(3):
            mixed += value[k] * place[k, c]
        first[s, c] += sign * area * mixed / 12.0
