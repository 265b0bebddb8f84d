"""Viscous stress and wall stress of P1 velocities, without a matrix.

r = f - K u is the rate of momentum [N] that the stresses give to the nodes,

    r_i = - ∫ 2μ ε(u) ∇N_i dV  +  ∫_Γ N_i (t - λ (u - u_Γ)) dA  +  ∫_Γ (u - u_Γ)·t(N_i) dA  -  ∫_Γ N_i C (u - u_Γ)_t dA

Here ε is the strain rate, smoothed over edges (`strain`), t(v) = -2μ ε(v) n, n points out of the body into the water,
and u_Γ is the velocity of the body there.  The second and third terms hold u = u_Γ weakly (symmetric Nitsche), the last
is wall friction.  With λ = 4 μ A/V, where A is the wetted area and V the water volume of the cell, the form is positive
definite on every cut, since ε is constant in a cell (trace inequality ∫_Γ |ε n|² ≤ A/V ∫ |ε|²; De Prenter, Lehrenfeld,
Massing, Comput. Math. Appl. 75 (2018) 4322). The force on the body is the sum over the hat functions, -∫ (t - λ (u -
u_Γ) - C (u - u_Γ)_t) dA, so momentum is conserved to round-off. Nodes beyond the surface change with those in the water
(`beyond`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Bools, Floats, Ints
from fluid.mesh.arrays import Hats
from fluid.viscous.beyond import Beyond, follow, hand_on
from fluid.viscous.strain import (
    COLUMN,
    PER_NODE,
    ROW,
    NodeCorners,
    StrainEdges,
    add_to_edges,
    edge_strain,
    mean_strain,
    spread_stress,
)
from kernels.decorators import inner, kernel, plain, ranged
from kernels.threads import over


class Walls(NamedTuple):
    """Polygons that the water touches: cell (S,), row (S,) of the cell in the list of wet cells, -1 if it is not
    there · body (S,) · normal (S, 3) · hat (S, 3, 4), arm (S, 3, 3) [m] and area (S, 3) [m²] of each point ·
    nitsche (S,) λ and drag (S,) C [kg/(m² s)]."""

    cell: Ints
    row: Ints
    body: Ints
    normal: Floats
    hat: Floats
    arm: Floats
    area: Floats
    nitsche: Floats
    drag: Floats


class ViscousTerms(NamedTuple):
    """The data that K and f are assembled from: cells (n,) in the water where there is stress in it, weight (n,) 2μ
    times their water · walls · viscosity μ · node_drag (N,) [kg/s] of nodes on sides of the tank · held (k,) nodes on
    sides, each once, projector (k, 3, 3) onto the directions that are free there · idle (N,) bool: nodes that keep
    their velocity · hats · edges of the cells · corners: all nodes that stresses act on or that may change · beyond:
    nodes that change with those in the water."""

    cells: Ints
    weight: Floats
    walls: Walls
    viscosity: float
    node_drag: Floats
    held: Ints
    projector: Floats
    idle: Bools
    hats: Hats
    edges: StrainEdges
    corners: NodeCorners
    beyond: Beyond


@kernel
def wall_stress(walls, mu, u, body_velocity, edges, strains, cells, out, load):
    """Add the terms on Γ: those with the hat functions to out (N, 3) [N], the loads on bodies to load (n_bodies, 6) [N,
    N m], and those with t(N_i) to flux (n_edges, 6), from which `spread_stress` takes them to the nodes.

    walls: Walls · body_velocity (n_bodies, 6) · edges: StrainEdges · strains: the strain of u (n_edges, 6), and
    flux."""
    cell, row, body, normal, hat, arm, area, nitsche, drag = walls
    edge, edge_weight = edges.of_cell, edges.weight
    strain, flux = strains
    mean = np.empty((3, 3))
    t, v, f, pull, x = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(6)
    for s in range(cell.shape[0]):
        e, b = cell[s], body[s]
        held = nitsche[s] > 0.0 and row[s] >= 0
        t[:], pull[:] = 0.0, 0.0
        if held:
            mean_strain(strain, edge[row[s]], mean)
            for k in range(3):
                for m in range(3):
                    t[k] -= 2.0 * mu * mean[k, m] * normal[s, m]
        for q in range(3):
            w = area[s, q]
            if w == 0.0:
                continue
            _slip_velocity(walls, s, q, u, body_velocity, cells, v)
            into = v[0] * normal[s, 0] + v[1] * normal[s, 1] + v[2] * normal[s, 2]
            for k in range(3):
                f[k] = w * (t[k] - nitsche[s] * v[k] - drag[s] * (v[k] - into * normal[s, k]))
                pull[k] += 2.0 * mu * w * v[k]
            for a in range(4):
                for k in range(3):
                    out[cells[e, a], k] += hat[s, q, a] * f[k]
            for k in range(3):
                load[b, k] -= f[k]
            load[b, 3] -= arm[s, q, 1] * f[2] - arm[s, q, 2] * f[1]
            load[b, 4] -= arm[s, q, 2] * f[0] - arm[s, q, 0] * f[2]
            load[b, 5] -= arm[s, q, 0] * f[1] - arm[s, q, 1] * f[0]
        if held:
            for c in range(6):
                x[c] = 0.5 * (pull[ROW[c]] * normal[s, COLUMN[c]] + pull[COLUMN[c]] * normal[s, ROW[c]])
            add_to_edges(flux, edge[row[s]], edge_weight, x)


@inner
def _slip_velocity(walls, s, q, u, V, cells, v):
    """v = u - u_Γ at point q of polygon s, in place."""
    e, b, hat, arm = walls.cell[s], walls.body[s], walls.hat, walls.arm
    v[0] = -(V[b, 0] + V[b, 4] * arm[s, q, 2] - V[b, 5] * arm[s, q, 1])
    v[1] = -(V[b, 1] + V[b, 5] * arm[s, q, 0] - V[b, 3] * arm[s, q, 2])
    v[2] = -(V[b, 2] + V[b, 3] * arm[s, q, 1] - V[b, 4] * arm[s, q, 0])
    for a in range(4):
        for k in range(3):
            v[k] += hat[s, q, a] * u[cells[e, a], k]


def momentum_rate(terms, u, body_velocity):
    """r (N, 3) [N] and load (n_bodies, 6) [N, N m]: what acts on the nodes beyond the surface is handed on to those in
    the water.  terms: ViscousTerms."""
    r, load = unheld_rate(terms, u, body_velocity)
    hold_rate(terms, u, r)
    hand_in(terms, r)
    return r, load


def hold_rate(terms, u, r):
    """Add the drag of the sides of the tank to r (N, 3) [N], and set what they constrain to zero, in place."""
    over(_rub, len(terms.corners.nodes), terms.corners.nodes, terms.node_drag, u, r)
    restrict(terms, r)


@ranged
def _rub(first, last, nodes, node_drag, u, r):
    for s in range(first, last):
        i = np.uint64(nodes[s])
        for k in range(3):
            r[i, k] -= node_drag[i] * u[i, k]


def unheld_rate(terms, u, body_velocity):
    """r and load as of `momentum_rate`, where the stresses act, without the drag and the constraints of the sides of
    the tank."""
    cells, weight, hats, edges = terms.cells, terms.weight, terms.hats, terms.edges
    r = np.zeros_like(u)
    load = np.zeros_like(body_velocity)
    strain = edge_strain(cells, weight, edges, u, hats)
    flux = strain
    if len(terms.walls.cell) > 0:
        flux = strain.copy()
        wall_stress(
            terms.walls, terms.viscosity, u, body_velocity, edges, (strain, flux), hats.cells, r, load
        )
    spread_stress(cells, weight, edges, terms.corners, flux, hats, r)
    return r, load


def restrict(terms, r):
    """Set to zero the components that the sides of the tank constrain, and idle nodes, in place."""
    over(_project, len(terms.held), terms.held, terms.projector, r)
    over(_stop, len(terms.corners.nodes), terms.corners.nodes, terms.idle, r)


@ranged
def _project(first, last, node, projector, r):
    for s in range(first, last):
        i = np.uint64(node[s])
        x, y, z = r[i, 0], r[i, 1], r[i, 2]
        for k in range(3):
            r[i, k] = projector[s, k, 0] * x + projector[s, k, 1] * y + projector[s, k, 2] * z


@ranged
def _stop(first, last, nodes, idle, r):
    for s in range(first, last):
        i = np.uint64(nodes[s])
        if idle[i]:
            r[i, 0], r[i, 1], r[i, 2] = 0.0, 0.0, 0.0


def hand_in(terms, r):
    """Pass r (N, 3) of the nodes beyond the surface on to those in the water, as far as sides let these go, in
    place."""
    if len(terms.beyond.nodes) > 0:
        hand_on(terms.beyond, r)
        restrict(terms, r)


def follow_water(terms, d):
    """Give the nodes beyond the surface what (1) of `beyond.py` gives them, in place; d (N, 3)."""
    if len(terms.beyond.nodes) > 0:
        follow(terms.beyond, d)
        restrict(terms, d)


def preconditioner(terms, mass, tau):
    """1 / diagonal (N,) of M + τ K without the flux terms; 0 on idle nodes."""
    nodes, diagonal, inverse = terms.corners.nodes, np.zeros(len(mass)), np.zeros(len(mass))
    over(_diagonal, len(nodes), terms, mass, tau, diagonal, weight=PER_NODE)
    _add_walls(terms.walls, terms.beyond, mass, tau, terms.hats.cells, diagonal)
    over(_inverse, len(nodes), nodes, terms.idle, diagonal, inverse)
    return inverse


@ranged
def _diagonal(first, last, terms, mass, tau, diagonal):
    """Mass, drag and the stress in the cells of the nodes."""
    cell_list, weight, node_drag = terms.cells, terms.weight, terms.node_drag
    parent, g = terms.hats.parent, terms.hats.gradients
    nodes, start, corner = terms.corners
    for row in range(first, last):
        r = np.uint64(row)
        i = np.uint64(nodes[r])
        total = 0.0
        for t in range(np.uint64(start[r]), np.uint64(start[r + np.uint64(1)])):
            s, a = np.uint64(corner[t]) // np.uint64(4), np.uint64(corner[t]) % np.uint64(4)
            p = np.uint64(parent[np.uint64(cell_list[s])])
            total += weight[s] * (g[p, a, 0] ** 2 + g[p, a, 1] ** 2 + g[p, a, 2] ** 2)
        diagonal[i] = mass[i] + tau * (node_drag[i] + 2.0 / 3.0 * total)


@plain
def _add_walls(walls, beyond, mass, tau, cells, diagonal):
    """Add the walls, and the mass of the nodes beyond the surface to those that they change with, in place."""
    cell, hat, area, nitsche, drag = walls.cell, walls.hat, walls.area, walls.nitsche, walls.drag
    for s in range(len(beyond.nodes)):
        for t in range(beyond.start[s], beyond.start[s + 1]):
            diagonal[beyond.wet[t]] += beyond.share[t] * mass[beyond.nodes[s]]
    for s in range(cell.shape[0]):
        for q in range(3):
            for a in range(4):
                diagonal[cells[cell[s], a]] += tau * area[s, q] * (nitsche[s] + drag[s]) * hat[s, q, a] ** 2


@ranged
def _inverse(first, last, nodes, idle, diagonal, inverse):
    for s in range(first, last):
        i = np.uint64(nodes[s])
        inverse[i] = 0.0 if idle[i] or diagonal[i] <= 0.0 else 1.0 / diagonal[i]


@kernel
def body_preconditioner(terms, body_mass, moves, tau):
    """Inverse (n_bodies, 6, 6) of the diagonal blocks of the bodies without the flux terms; 0 where they are driven."""
    _cell, _row, body, normal, _hat, arm, area, nitsche, drag = terms.walls
    block, c = body_mass.copy(), np.zeros((3, 6))
    for s in range(body.shape[0]):
        b = body[s]
        if not moves[b]:
            continue
        for q in range(3):
            _slip_of_body(s, q, arm, c)
            for i in range(6):
                for j in range(6):
                    across_i, across_j, together = 0.0, 0.0, 0.0
                    for k in range(3):
                        across_i += normal[s, k] * c[k, i]
                        across_j += normal[s, k] * c[k, j]
                        together += c[k, i] * c[k, j]
                    along = together - across_i * across_j
                    block[b, i, j] += tau * area[s, q] * (nitsche[s] * together + drag[s] * along)
    inverse = np.zeros_like(block)
    for b in range(block.shape[0]):
        if moves[b]:
            inverse[b] = np.linalg.inv(block[b])
    return inverse


@inner
def _slip_of_body(s, q, arm, c):
    """Write c (3, 6), which takes the six velocities of a body to the velocity of a point of its polygon."""
    x, y, z = arm[s, q, 0], arm[s, q, 1], arm[s, q, 2]
    c[:] = 0.0
    for k in range(3):
        c[k, k] = 1.0
    c[0, 4], c[0, 5] = z, -y
    c[1, 3], c[1, 5] = -z, x
    c[2, 3], c[2, 4] = y, -x
