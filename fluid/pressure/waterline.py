"""The load on solids where the water surface passes through their cells.

The coupling G of the pressure solve takes the wetted polygons of a cell whole.  This is required: for every hat
function of a wet node, ∫ V·∇N_i dV + G V = 0 must hold for water and solid that move together, which determines G.  As
a load, -Gᵀp then includes the hat functions of wet corners over the dry part of a face, an error of up to (h/depth)²/2,
or even a load on a whole deck less than a cell above the water.  The pressure itself ends at the surface,

    F = -∫_{φ<0} p n dA,        p = Σ_wet p_i N_i + Σ_dry p_j N_j,                                        (1)

with the dry values p_j continued through the zero at the surface (`projection.with_ghosts`).  The difference

    R = F + Gᵀp = -∫_{φ<0} p n dA + ∫ Σ_wet p_i N_i n dA                                                  (2)

is added to the load, of bodies that are held with the pressure found in the step.  G V drives the water with the dry
part of the faces, too, so a body that moves has to keep what this takes: its R is that of the pressure of the last
step, which is known to the solve.  It opposes a share of Gᵀp, which is part of the solve, so the error of this delay
cannot grow: with a share ε of the added mass m_a of a body of mass m, an error of the acceleration is multiplied by
ε m_a / (m + m_a) < 1 in every step."""

from __future__ import annotations

import numpy as np

from array_types import Array
from fluid.domain.hats import POLYGON, hats_at, value_at
from fluid.domain.moments import marked_corners
from fluid.pressure.projection import with_ghosts
from kernels.decorators import inner, kernel, released
from kernels.threads import over


class WaterlineLoad:
    """R of (2) over the bodies of a domain with its topology, of any pressure.

    faces (k,) rows of the polygons of G · left_out (l,) rows of those not in G though their cells hold water ·
    phi (N,) [m] · wet (N,) bool · before (N,) [Pa]: pressure of the last step, read on wet nodes · open_node (N,) bool:
    p = 0, no seas · air: pressures (K,) [Pa] of trapped air → (N,) [Pa] at dry nodes, None: there is none. It acts on
    both sides of the surface, so that R is that of the pressure above it."""

    def __init__(self, topology, domain, faces, left_out, phi, wet, before, open_node, air=None):
        self._topology, self._domain, self._phi, self._wet = topology, domain, phi, wet
        self._before, self._air = before, air
        mixed = _partly_wet(faces, domain.face_cell, domain.cells, wet)
        self._rows, self._mixed = np.concatenate([mixed, left_out]), len(mixed)
        self._open, self._beside = open_node, None

    def before(self, of_air=()) -> Array:
        """R (n_bodies, 6) [N, N m] of the pressure of the last step, with pockets at of_air (K,) [Pa]."""
        return self._of(self._before, of_air)

    def of(self, nodes, values, of_air=()) -> Array:
        """R (n_bodies, 6) [N, N m] of the pressures values (n,) [Pa] at wet nodes (n,), elsewhere that of the last
        step, with pockets at of_air (K,) [Pa]."""
        if len(self._rows) == 0:
            return np.zeros((self._domain.n_bodies, 6))
        pressure = self._before.copy()
        pressure[nodes] = values
        return self._of(pressure, of_air)

    def _of(self, pressure, of_air) -> Array:
        domain, load = self._domain, np.zeros((self._domain.n_bodies, 6))
        if len(self._rows) == 0:
            return load
        if self._beside is None:
            reached = np.zeros(len(self._phi), bool)
            reached[domain.cells[domain.face_cell[self._rows]]] = True
            self._beside = self._topology.cells_around(reached)
        solved = self._wet & ~self._open
        p = np.where(solved, pressure, 0.0)
        outside = np.zeros(len(p)) if self._air is None else self._air(of_air)
        mesh = (self._beside, domain.cells, domain.volume)
        ghosts = with_ghosts(p, outside, self._wet, self._open, self._phi, *mesh)
        found = np.empty((len(self._rows), 6))
        fields = (self._phi, ghosts, p, outside, solved)
        over(
            _differences,
            len(found),
            self._rows,
            self._mixed,
            _surface_of(domain),
            fields,
            found,
            weight=POLYGON,
        )
        _sum_on_bodies(self._rows, domain.face_body, found, load)
        return load


@kernel
def _partly_wet(faces, face_cell, cells, wet):
    """Those of the listed polygons (k,) whose cell has wet corners and dry ones, in order; wet (N,) bool."""
    found, n = np.empty(len(faces), np.int64), 0
    for s in range(len(faces)):
        count = 0
        for a in range(4):
            count += wet[cells[face_cell[faces[s]], a]]
        if 0 < count < 4:
            found[n] = faces[s]
            n += 1
    return found[:n].copy()


def _surface_of(domain):
    """Wetted polygons with their corners, hats and nodes, and the centres of the bodies, as the loops here take
    them."""
    return (domain.polygons(), domain.face_corners), domain.hats, domain.nodes, domain.body_centre


@released
def _differences(first, last, at, in_coupling, surface, fields, found):
    """found (k, 6): force and moment of (2) on the listed triangles, of which the first `in_coupling` are in G."""
    (polygons, corners), hats, nodes, centre = surface
    cell, body, areas, normal, cells = (
        polygons.cell,
        polygons.body,
        polygons.area,
        polygons.normal,
        hats.cells,
    )
    phi, ghosts, p, outside, solved = fields
    hat, arm = np.empty(4), np.empty((3, 3))
    height, full, acting = np.empty(3), np.empty(3), np.empty(3)
    work, mean = (np.empty((2, 3, 3)), np.empty((4, 3))), np.empty(4)
    for s in range(first, last):
        row = at[s]
        e, b, area = cell[row], body[row], areas[row]
        above = 0.0  # the pressure of the air, if there is any
        for a in range(4):
            there = outside[cells[e, a]]
            if abs(there) > abs(above):
                above = there
        for q in range(3):
            hats_at(e, corners[row, q], hats, nodes, hat)
            height[q] = full[q] = acting[q] = 0.0
            for a in range(4):
                i = cells[e, a]
                height[q] += hat[a] * phi[i]
                full[q] += hat[a] * (ghosts[i] - above)
                if solved[i] and s < in_coupling:
                    acting[q] += hat[a] * (p[i] - above)
            for c in range(3):
                arm[q, c] = corners[row, q, c] - centre[b, c]
        for c in range(4):
            mean[c] = 0.0
        if acting[0] != 0.0 or acting[1] != 0.0 or acting[2] != 0.0:
            add_over_whole(1.0, area, acting, arm, mean)
        add_over_wet(-1.0, area, height, full, arm, work, mean)
        for c in range(3):
            found[s, c] = mean[0] * normal[row, c]
        found[s, 3] = mean[2] * normal[row, 2] - mean[3] * normal[row, 1]
        found[s, 4] = mean[3] * normal[row, 0] - mean[1] * normal[row, 2]
        found[s, 5] = mean[1] * normal[row, 1] - mean[2] * normal[row, 0]


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
    found, stiffness = np.empty((len(at), 9)), np.zeros((domain.n_bodies, 9))
    over(_stiffnesses, len(at), at, _surface_of(domain), phi, weight, found, weight=POLYGON)
    _sum_on_bodies(at, domain.face_body, found, stiffness)
    return stiffness.reshape(-1, 3, 3)


@released
def _stiffnesses(first, last, at, surface, phi, weight, found):
    """found (k, 9): (3) of the listed triangles."""
    (polygons, corners), hats, nodes, centre = surface
    hat, height, arm = np.empty(4), np.empty(3), np.empty((3, 3))
    share, room, lift, sums = np.empty((2, 3, 3)), np.empty((4, 3)), np.ones((3, 3)), np.empty((3, 4))
    for s in range(first, last):
        row = at[s]
        e, b, n = polygons.cell[row], polygons.body[row], polygons.normal[row]
        for q in range(3):
            hats_at(e, corners[row, q], hats, nodes, hat)
            height[q] = value_at(e, hat, phi, hats.cells)
            for c in range(3):
                arm[q, c] = corners[row, q, c] - centre[b, c]
            lift[1, q], lift[2, q] = arm[q, 1], -arm[q, 0]
        sums[:] = 0.0
        for k in range(3):
            add_over_wet(-1.0, polygons.area[row], height, lift[k], arm, (share, room), sums[k])
        for k in range(3):
            found[s, k] = weight * (sums[k, 0] * n[2])
            found[s, 3 + k] = weight * (sums[k, 2] * n[2] - sums[k, 3] * n[1])
            found[s, 6 + k] = weight * (sums[k, 3] * n[0] - sums[k, 1] * n[2])


@kernel
def _sum_on_bodies(at, face_body, found, out):
    """out (n_bodies, m) += found (k, m) of the listed triangles, in their order."""
    for s in range(at.shape[0]):
        b = face_body[at[s]]
        for c in range(found.shape[1]):
            out[b, c] += found[s, c]


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
def add_over_wet(sign, area, height, p, arm, room, sums):
    """sums (4,) += sign (∫ p dA, ∫ p arm dA) over the part of a triangle with height < 0.

    height, p (3,), arm (3, 3): at its corners · room (2, 3, 3), (4, 3): work space"""
    wet = (height[0] < 0.0) + (height[1] < 0.0) + (height[2] < 0.0)
    if wet == 3:
        add_over_whole(sign, area, p, arm, sums)
    elif wet:
        share, (value, place) = room[0], (room[1][0], room[1][1:])
        for t in range(wet_triangles(height, share)):
            part = share[t]
            for k in range(3):
                value[k] = part[k, 0] * p[0] + part[k, 1] * p[1] + part[k, 2] * p[2]
                for c in range(3):
                    place[k, c] = part[k, 0] * arm[0, c] + part[k, 1] * arm[1, c] + part[k, 2] * arm[2, c]
            add_over_whole(sign, area * relative_area(part), value, place, sums)


@inner
def add_over_whole(sign, area, p, arm, sums):
    """`add_over_wet` over a whole triangle.

    Products of linear functions f, g over a triangle: A/12 (Σ f_k g_k + Σ f_k Σ g_k)."""
    total = p[0] + p[1] + p[2]
    sums[0] += sign * area * total / 3.0
    for c in range(3):
        mixed = total * (arm[0, c] + arm[1, c] + arm[2, c])
        for k in range(3):
            mixed += p[k] * arm[k, c]
        sums[1 + c] += sign * area * mixed / 12.0
