"""Viscosity and no-slip walls: the stage of a step between transport and pressure.

    M du/dt = r(u) + M (w - uⁿ)/dt,   u(0) = uⁿ         r = f - K u: `kernels.py`, symmetric gradient, walls

w = u_adv + θ dt âⁿ is the velocity that transport and the last pressure would lead to without viscosity. Its rate is
the source, so that a steady state is steady for any dt (transport followed by diffusion is 5 % off in a channel), and
walls act on the velocity that remains after the projection.  The change δ = u - w is added to u_adv.  Time integration
is by the two-stage L-stable method of order two (Alexander, SIAM J. Numer. Anal. 14 (1977) 1006), γ = 1 - 1/√2:

    u₁ = uⁿ + γ (w - uⁿ) + γ dt M⁻¹ r(u₁)
    u = w + dt M⁻¹ [(1-γ) r(u₁) + γ r(u)],        impulse on bodies  dt [(1-γ) F(u₁) + γ F(u)].

Bodies that move freely are part of the stage, with their own mass and the motion that the other forces of the last
step would give them (`FreeBodies`): so the momentum that a light body and the water that sticks to it exchange does not
depend on dt.

M: the water at each node, ∫_{φ<0} ρ N_i dV; cells count by their water.  No traction on the free surface (natural);
dry nodes of cells that the surface cuts change with those in the water (`beyond`).
Sides of the tank: no-slip holds u = 0 on their nodes; friction acts on their nodes.  On open sides only the normal
velocity changes: the tangential one is left unchanged, since otherwise the missing ∇uᵀ n would bend a parallel stream.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Bools, Floats
from fluid.domain.hats import hat_values
from fluid.domain.moments import wet_fraction
from fluid.numerics.solve import NotConverged
from fluid.numerics.sums import momentum_of_rows
from fluid.viscous.beyond import Beyond, beyond_surface, hand_on
from fluid.viscous.kernels import (
    ViscousTerms,
    Walls,
    hand_in,
    hold_rate,
    restrict,
    unheld_rate,
)
from fluid.viscous.solve import Implicit, product_of
from fluid.viscous.strain import NodeCorners, StrainEdges, edges_of
from kernels.threads import marked

GAMMA = 1.0 - np.sqrt(0.5)
TOLERANCE = 1e-7
MOST_ITERATIONS = 1000
STEEPEST = 1e6
"""Largest A/V of a cell [1/h]; slivers would exceed it."""


@dataclass(frozen=True, kw_only=True)
class ViscousChange:
    """velocity change δ (N, 3) [m/s] · load (n_bodies, 6) [N, N m], mean over the step · energy [J]: work of the
    stresses on the water, their impulse where they act times the mean of the velocities at both ends of the step (at
    the velocities of the two stages it is not what the water gains: a cube that is spun in a thick liquid gained 3 % of
    its energy so)
    · iterations · tank (6,) [N, N m] of the sides of the tank on the water,
    mean over the step."""

    change: Floats
    load: Floats
    energy: float
    iterations: int
    tank: Floats


@dataclass(frozen=True)
class FreeBodies:
    """The response of bodies to shear within a step: mass (n_bodies, 6, 6) [kg, kg m²] about their centres, world axes
    · moves (n_bodies,) bool: the others keep their velocity · acceleration (n_bodies, 6) [m/s², rad/s²] by all forces
    but shear."""

    mass: Floats
    moves: Bools
    acceleration: Floats

    @classmethod
    def none(cls, n: int) -> FreeBodies:
        """n bodies that keep their velocity."""
        return cls(np.zeros((n, 6, 6)), np.zeros(n, bool), np.zeros((n, 6)))


class WettedWalls:
    """Polygons of a domain with water in their cells, and the values of the hats at their points.

    cell, body (S,) · normal (S, 3) · hat (S, 3, 4) · arm (S, 3, 3) [m] from the centre of the body · area (S,) [m²] ·
    per_volume (S,) [1/m] wetted area of the cell over the volume left of it."""

    def __init__(self, domain, phi):
        d = self.domain = domain
        rows = marked((phi < 0.0)[d.cells[d.face_cell]].any(axis=1))
        self.cell, self.body = d.face_cell[rows].astype(np.int64), d.face_body[rows].astype(np.int64)
        self.normal, self.points = d.face_normal[rows], d.face_points[rows]
        self.hat = hat_values(self.cell, self.points, d.hats, d.nodes)
        self.arm = self.points - d.body_centre[self.body][:, None]
        self.area = d.face_area[rows]
        wetted = np.bincount(self.cell, self.area, minlength=len(d.cells))[self.cell]
        size = d.memory.mesh.local_size[d.parent_cell[self.cell]]
        self.per_volume = wetted / np.maximum(d.volume[self.cell], wetted * size / STEEPEST)

    def centre(self):
        """Middles (S, 3) [m] of the polygons."""
        return self.points.mean(axis=1)

    def rubbing(self, phi):
        """hat (S, 3, 4) and arm (S, 3, 3) [m] of the points with the hats of the wet corners alone, φ (N,) < 0, scaled
        to a sum of one, and moved to the place that these stand for, so that a rigid motion does not slip and angular
        momentum is kept.

        A dry corner may hold next to no water. Its hat at a wet point is small, and the friction would give it the
        velocity, without bound, that makes the slip at the point vanish: 16 km/s where the water ran at 10 m/s."""
        corner = self.domain.cells[self.cell]
        some = (phi[corner] >= 0.0).any(axis=1)
        hat, arm = self.hat.copy(), self.arm.copy()
        corner, kept = corner[some], self.hat[some] * (phi[corner[some]] < 0.0)[:, None, :]
        total = kept.sum(axis=2, keepdims=True)
        hat[some] = np.where(total > 0.0, kept / np.where(total > 0.0, total, 1.0), hat[some])
        place = np.einsum("sqa,sak->sqk", hat[some], self.domain.nodes[corner])
        arm[some] = place - self.domain.body_centre[self.body[some]][:, None]
        return hat, arm

    def at_points(self, f, cells):
        """P1 values (S, 3) or (S, 3, k) of nodal f (N,) or (N, k) at the points of the polygons."""
        return np.einsum("sqa,sa...->sq...", self.hat, f[cells[self.cell]])


class Viscosity:
    """The stage for a Water with viscosity or walls that are not smooth."""

    def __init__(self, parameters):
        self.parameters = parameters
        self.friction = None
        if parameters.walls == "friction":
            from fluid.viscous.wall_friction import WallFriction

            self.friction = WallFriction.of(parameters)

    def change(self, water, phi, nodal_water, w, dt: float) -> ViscousChange:
        """The change over dt [s], for water that would reach w (N, 3) [m/s] without viscosity; phi (N,) [m] is the
        level set, nodal_water (N,) [m³] the water at the nodes.

        Raises NotConverged."""
        mass = self.parameters.density * nodal_water
        terms = self._terms(water, phi, mass, w, dt)
        V, bodies = water.body_velocity, water.free_bodies or FreeBodies.none(len(water.body_velocity))
        moved, lead = dt * bodies.acceleration, (1.0 - GAMMA) / GAMMA
        half_way, V_half_way = water.velocity + GAMMA * (w - water.velocity), V + GAMMA * moved
        matrix = Implicit(terms, mass, GAMMA * dt, (bodies.mass, bodies.moves))
        first, rate1, load1, tank1 = _stage(water, matrix, half_way, V_half_way)
        start, V_start = w + lead * first.d, V + moved + lead * first.D
        second, rate2, load2, tank2 = _stage(water, matrix, start, V_start)
        both = (rate1, rate2), (load1, load2), (tank1, tank2)
        rate, load, tank = ((1.0 - GAMMA) * one + GAMMA * two for one, two in both)
        change = lead * first.d + second.d
        nodes = terms.corners.nodes
        energy = 0.5 * dt * product_of(nodes, rate, water.velocity + (w + change))
        tank += _held_back(water, terms, mass[:, None] * change / dt - rate)
        iterations = first.iterations + second.iterations
        return ViscousChange(change=change, load=load, energy=energy, iterations=iterations, tank=tank)

    def _terms(self, water, phi, mass, w, dt):
        t, p = water.topology, self.parameters
        wet = (phi < 0.0) & t.active
        cells = t.cells_around(wet)
        share = wet_fraction(cells, phi, t.parts)
        cells, share = cells[share > 0.0], share[share > 0.0]
        idle = mass <= 0.0
        drag, columns, viscosity = np.zeros(len(phi)), None, p.viscosity
        if self.friction is not None:
            columns = self.friction.columns(water, phi, w, p.theta * dt)
            drag = self.friction.of_nodes(water, phi, columns, w)
            if columns is not None:
                viscosity = p.viscosity + p.density * self.friction.mixing(water, columns, cells)
        walls = self._wall_terms(water, phi, columns, w, cells, share)
        if np.ndim(viscosity) == 0 and viscosity == 0.0:
            cells, share = cells[:0], share[:0]  # the walls rub, and the water flows without stress
        weight = 2.0 * viscosity * share * t.volume[cells]
        held, projector = water.held_by_sides()
        moving = ~idle | (drag != 0.0)
        moving[t.cells[cells]] = True
        moving[t.cells[walls.cell]] = True
        touched = moving[held]
        return ViscousTerms(
            cells=cells,
            weight=weight,
            walls=walls,
            viscosity=p.viscosity,
            node_drag=drag,
            held=held[touched],
            projector=projector[touched],
            idle=idle,
            hats=t.hats,
            edges=StrainEdges.of(*edges_of(cells, weight, t.cells, len(phi))),
            corners=NodeCorners.of(cells, t.cells, marked(moving), len(phi)),
            beyond=self._beyond(t, phi, wet, idle),
        )

    def _beyond(self, t, phi, wet, idle) -> Beyond:
        """The nodes that change with the water. Friction alone acts on wet nodes."""
        if self.parameters.viscosity == 0.0:
            return Beyond.none()
        return beyond_surface(t, np.flatnonzero((phi >= 0.0) & ~idle), wet & ~idle)

    def _wall_terms(self, water, phi, columns, w, wet_cells, share):
        """The polygons that the water touches, with λ and C; λ is larger where the free surface leaves less water in a
        cell. Friction acts on wet nodes alone, as it does on the sides of the tank."""
        p, k, cells = self.parameters, WettedWalls(water.domain, phi), water.topology.cells
        water_share = np.ones(len(cells))
        water_share[wet_cells] = np.maximum(share, 1.0 / STEEPEST)
        wet = k.at_points(phi, cells) < 0.0
        area = np.where(wet, k.area[:, None] / 3.0, 0.0)
        nothing = np.zeros(len(k.cell))
        nitsche = 4.0 * p.viscosity * k.per_volume / water_share[k.cell] if p.walls == "no-slip" else nothing
        drag = nothing if self.friction is None else self.friction.of_faces(water, k, columns, w)
        row = np.full(len(cells), -1, np.int64)
        row[wet_cells] = np.arange(len(wet_cells))
        use = (area > 0.0).any(axis=1) & ((nitsche > 0.0) | (drag > 0.0))
        hat, arm = (k.hat, k.arm) if self.friction is None else k.rubbing(phi)
        found = Walls(
            cell=k.cell,
            row=row[k.cell],
            body=k.body,
            normal=k.normal,
            hat=hat,
            arm=arm,
            area=area,
            nitsche=nitsche,
            drag=drag,
        )
        return Walls(*(np.ascontiguousarray(a[use]) for a in found))


def _stage(water, matrix, u, V):
    """Change (d, D) of the velocity u (N, 3) of the water and V (n_bodies, 6) of the bodies, (M + γ dt K) (d, D) =
    γ dt r(u, V); and what acts at its end on the nodes (N, 3) [N], as far as sides let them go, on the bodies
    (n_bodies, 6), and from the sides of the tank on the water (6,).

    Raises NotConverged."""
    terms, tau = matrix.terms, matrix.tau
    free, load = unheld_rate(terms, u, V)
    rate = free.copy()
    hold_rate(terms, u, rate)
    hand_in(terms, rate)
    found = matrix.solve(tau * rate, tau * load, TOLERANCE, MOST_ITERATIONS)
    if not found.left <= TOLERANCE:
        raise NotConverged(
            f"the viscous step stopped after {found.iterations} iterations at a residual of {found.left:.3g}, "
            f"wanted {TOLERANCE:.3g}; reduce time.step_max or time.cfl",
            np.array([found.left]),
        )
    free += found.rate
    held = free.copy()
    hold_rate(terms, u + found.d, held)
    return found, held, load + found.load, _moments(water, terms, held - free)


def _held_back(water, terms, missing):
    """The force and moment (6,) of the sides of the tank on nodes that those beyond the surface have handed on to what
    they miss (N, 3) [N] of their change."""
    if len(terms.beyond.nodes) == 0:
        return np.zeros(6)
    hand_on(terms.beyond, missing)
    left = missing.copy()
    restrict(terms, left)
    return _moments(water, terms, missing - left)


def _moments(water, terms, force):
    nodes = terms.corners.nodes
    return momentum_of_rows(nodes, 1.0, np.ones(len(force)), force, water.topology.nodes, water.reference)
