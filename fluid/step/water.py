"""The water: its state on a physical domain, and one step split around the pressure solve.

    problem = water.predict(dt)        advect, correct the volume, assemble the pressure
    x = ...                            solved by the caller, with the structure inside if there is one
    water.correct(problem, x)          velocity, divergence damping, extension

`predict` changes nothing but what absorbing sides have read; a caller may drop its problem and ask again with another
dt.  Scheme: theory 2.2.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array, Floats, Ints
from fluid.domain.cell_vectors import CellVectors
from fluid.domain.graph import Graph
from fluid.domain.layers import layers_around
from fluid.domain.physical_domain import wetted_coupling
from fluid.domain.topology import Topology
from fluid.mesh.background import Background
from fluid.numerics.fields import nothing
from fluid.pressure.projection import PressureProblem
from fluid.sides.walls import Walls
from fluid.step.corrector import Corrected, corrected
from fluid.step.kick import kick_factor
from fluid.step.moved_solids import carry_to
from fluid.step.parameters import WaterParameters
from fluid.step.predictor import predicted
from fluid.step.report import StepReport
from fluid.step.speeds import START_STEPS, calm, crossing, fastest_place, stable_step
from fluid.step.start import flux_at_start, start_beside_sides, start_moving, surface_of
from fluid.step.time_step import LEAST_COUNTED, fastest_wet
from fluid.step.water_readings import WaterReadings
from fluid.surface.cavities import on_one_side
from fluid.surface.extrapolation import BAND, fill_missing
from fluid.surface.level_set import FAR, drain_films
from fluid.surface.volume import nodal_volume

if TYPE_CHECKING:
    import scipy.sparse as sp

    from fluid.pressure.films import Films
    from fluid.pressure.slits import Slits
    from fluid.viscous.viscosity import FreeBodies


class Water(WaterReadings):
    """Water with a free surface in a tank.

    mesh: Background · domain: PhysicalDomain of it · fill: points (n, 3) [m] → signed distance (n,) [m], negative
    in the water, or the level set (N,) itself · is_open: (normals (B, 3), centres (B, 3)) → bool (B,), sides of
    the tank that let water out; None: all closed · is_smooth: the same, sides that stay smooth whatever
    `parameters.walls` says · sides: `inflow.Sides`, inflows and seas; None: nowhere ·
    velocity (N, 3) [m/s] at the nodes of the domain at the start; None: at rest · gas: `fluid.air.gas.Gas` of the air
    that cannot leave; None: the air is open everywhere · vents: `fluid.air.leaks.Vent` of its pockets.

    State at the nodes of the domain: level_set (N,) [m], velocity (N, 3) [m/s], acceleration (N, 3) [m/s²],
    pressure (N,) [Pa] that acted over the last step, end_pressure (N,) [Pa] that goes with the acceleration at its end
    (the two differ by up to 1/θ in an impact), nodal_water (N,) [m³], at_bound and ventilated (N,) bool: where the
    pressure was at its bound, and where that is the pressure of the air; at its cells (`CellVectors`): remainder
    [m/s], the part of the velocity correction that nodal values cannot represent, and cell_velocity [m/s].  Velocity is
    extrapolated to some layers outside the water.

    body_velocity (n_bodies, 6) [m/s, rad/s] about the centres: set it before `predict` where solids that move drag the
    water along (viscosity, friction); it is not used otherwise.
    """

    def __init__(
        self,
        mesh: Background,
        domain,
        fill: Callable | np.ndarray,
        parameters: WaterParameters | None = None,
        is_open: Callable | None = None,
        is_smooth: Callable | None = None,
        sides=None,
        velocity=None,
        gas=None,
        vents=(),
    ):
        self.mesh, self.parameters = mesh, parameters or WaterParameters()
        self.time, self.steps = 0.0, 0
        self._late_energy = 0.0
        self._summed: tuple[tuple, float] = (None, None, None), 0.0
        """The volume, and the arrays that it was summed from: a step replaces them by new ones."""
        self.report: StepReport | None = None
        self.sides = sides
        self.slits: Slits | None = None
        self.films: Films | None = None
        self._film_rules: tuple | None = None
        self.reference = mesh.bounds.mean(axis=0)
        """Point (3,) [m] that angular momentum is taken about."""
        self._lowest = float((mesh.bounds * self.parameters.weight).max(axis=0).sum())
        """g·x at the floor [m²/s²]."""
        walls = self.parameters.walls
        self._sides = Walls.of(
            mesh, is_open, _everywhere if walls == "slip" else is_smooth, walls == "no-slip", sides
        )
        self._on_sides = np.zeros(len(mesh.nodes), bool)
        self._on_sides[mesh.boundary_faces] = True
        self.viscous = _viscosity(self.parameters)
        self.body_velocity = np.zeros((domain.n_bodies, 6))
        self.pushed_by = np.zeros((domain.n_bodies, 6))
        """Velocities (n_bodies, 6) [m/s, rad/s] of the bodies in the last pressure solve: set before `correct`."""
        self.moved_on = np.zeros((domain.n_bodies, 6))
        """Displacement (n_bodies, 6) [m, rad] of the bodies since the cells were cut: set before `predict`."""
        self.farther = np.zeros((domain.n_bodies, 6))
        """How much farther (n_bodies, 6) [m, rad] they moved in the last step than `displacement` took for granted: the
        water that this takes has yet to rise to the surface. Set after a step, for the potential energy."""
        self.moved_by_end = np.zeros((domain.n_bodies, 6))
        """Displacement (n_bodies, 6) [m, rad] of the bodies at the end of the step since the cells were cut: set before
        `correct`, for the volume of trapped air."""
        self.free_bodies: FreeBodies | None = None
        """`viscosity.FreeBodies` that answer to shear within the step; None: all keep their velocity."""
        self.set_domain(domain)
        n = len(self.topology.nodes)
        level = fill(self.topology.nodes) if callable(fill) else np.asarray(fill, float)
        given = np.zeros(n, bool)
        if sides is None:
            self.level_set = surface_of(self, level, given)
        else:
            given[sides.nodes()] = True
            start_beside_sides(self, level, given, velocity)
        drain_films(self.level_set, self.topology.node_size)
        self.velocity, self.acceleration = np.zeros((n, 3)), np.zeros((n, 3))
        self.air, self.vents = None, tuple(vents)
        if gas is not None:
            from fluid.air.cushions import Air

            self.air = Air.at_start(gas, self.topology, self.level_set, self.lets_air_out)
        self.pressure = self._pressure_at_rest()
        self.end_pressure = self.pressure.copy()
        self.at_bound, self.ventilated = np.zeros(n, bool), np.zeros(n, bool)
        self.cell_velocity = self.remainder = self.kick_remainder = CellVectors.none()
        self.nodal_water = nodal_volume(self.topology, self.level_set)
        self.displaced = nothing(n)
        """(N,) [m³], part of `nodal_water`: what the bodies take of it as they move on to where the surface is."""
        self.film_volume = self.film_potential = 0.0
        """Part of `nodal_water` [m³] in films between bodies, and its ∫ g·x dV [m⁵/s²]."""
        self.conserved_volume = float(self.nodal_water.sum())
        self.initial_volume = self.conserved_volume
        self.given_by_films = nothing(n)
        """(N,) [m³/s] that films and their rims gave each other over the last step (`films.py`)."""
        self.find_band()
        self.start_speed = 0.0
        if velocity is not None:
            start_moving(self, velocity)
        self.renumbered: sp.csr_array | None = None
        self.left_behind: tuple[Floats, Floats, Floats, Topology] | None = None
        self.flux = flux_at_start(self)

    def set_cell_velocity(self, velocity) -> None:
        """Velocity (M, 3) [m/s] of the cells before the first step, from which its fluxes are extrapolated."""
        self.cell_velocity = CellVectors.of(velocity)

    # ---- the step

    def stable_step(self) -> float:
        """dt [s]: `speeds.stable_step`."""
        return stable_step(self)

    def fastest(self) -> float:
        """Largest component of the velocity of the water [m/s], films beside solids left out."""
        return fastest_wet(self.velocity, self.level_set, self.roomy)

    def fastest_place(self) -> tuple[float, Array]:
        """Speed [m/s] and place (3,) [m] of the fastest water: `speeds.fastest_place`."""
        return fastest_place(self)

    def kick_factor(self, crossing: float | None = None) -> Array:
        """Share (N,) of the acceleration that is carried over to the next step, no more than kick_limit g, or what
        turns the fastest stream aside within two cells, v²/(2 h). More would throw spray on by the acceleration of an
        impact. crossing: `speeds.crossing`, None: it is found where needed.

        The pressure that acts again has the same share at each node, and pushes bodies as it pushes the water only
        where neighbours have the same. Where bodies were cut again, nodes inside them therefore have that of the water
        beside them: their own acceleration, of what little water their cells hold, is many times that of the water,
        with another sign in every step, and so was the force on a body that slides through deep water."""
        t = self.topology
        fastest = self.fastest() if crossing is None or not t.is_uniform else crossing
        factor = self.kick_factor_of(self.acceleration, t.node_size, fastest)
        if self._domain_is_new:
            fill_missing(t, t.active & ~t.covered, factor[:, None])
        return factor

    def kick_factor_of(self, acceleration, size, fastest):
        """`kick_factor` (N,) of an acceleration (N, 3) [m/s²] on cells of these sizes (N,) [m], under water whose
        largest velocity is `fastest` [m/s]."""
        p = self.parameters
        return kick_factor(acceleration, p.kick_limit * p.gravity, 0.5 * fastest**2, size)

    def predict(self, dt: float) -> PressureProblem:
        """Advection, volume and gravity over dt [s], and the system for the pressure. Nothing of the state changes but
        what absorbing sides have read."""
        self.read_absorbing_sides(dt)
        return predicted(self, dt)

    def read_absorbing_sides(self, dt: float) -> None:
        """Read depth and velocity beside the absorbing sides before a step of dt [s], 0 at the start; they keep what
        they read, so that a restart has it."""
        for absorber in () if self.sides is None else self.sides.absorbers():
            from fluid.readings.gauges import levels, velocity

            depths = levels(self, absorber.places, absorber.bed)
            wet, velocities = depths > 0.0, np.zeros((len(depths), 3))
            if wet.any():
                velocities[wet] = velocity(self, absorber.points(depths)[wet])
            absorber.update(depths, velocities, self.time, dt)

    def correct(self, problem: PressureProblem, x, parting=None) -> None:
        """Take over the pressure x (n,) [Pa] of the problem and end the step; parting (n,) [m³/s]: rate at which the
        water parts where x is at its bound, None: nowhere (`bounded.py`)."""
        new: Corrected = corrected(self, problem, np.asarray(x), parting)
        late = self._late(problem.dt)
        before, held = (self._rates(), self.kinetic_energy()) if late > 0.0 else (None, 0.0)
        given = 0.0
        if self.sides is not None:
            given = self.sides.given(
                problem.predicted.level_set,
                (self.velocity, new.velocity),
                problem.density * new.nodal_water,
                problem.dt * new.pressure,
            )
        self.level_set, self.nodal_water = problem.predicted.level_set, new.nodal_water
        self.displaced = problem.predicted.displaced
        self.film_volume, self.film_potential = problem.predicted.in_films
        self.velocity, self.acceleration = new.velocity, new.acceleration
        self.pressure, self.end_pressure = new.pressure, new.end_pressure
        self.remainder, self.kick_remainder = new.remainder, new.kick_remainder
        self.cell_velocity, self.flux = new.cell_velocity, new.flux
        self.listed, self.layer_start = new.listed, new.layer_start
        self.at_bound, self.ventilated = new.at_bound, new.ventilated
        self.given_by_films = new.given_by_films
        if self.air is not None:
            kept = problem.predicted
            self.air = kept.cushions.after(problem.of_air(x), kept.theta, problem.dt)
            self.air = kept.cushions.leaked(self.air, self.pocket_volumes(), problem.dt)
        self.conserved_volume = problem.predicted.conserved_volume
        if self.slits is not None:
            p = self.parameters
            pressure, dofs = problem.of_water(x + problem.known), problem.of_water(problem.dofs)
            self.slits = self.slits.advanced(dofs, pressure, p.weight, problem.dt, p.density)
        self.report = new.report
        ahead = 0.0
        if before is not None:
            power, through = self._rates()
            # calm water that bodies push moves with what they displace
            pushed = calm(self, problem.dt, crossing(self)) * self._pushed(
                problem, self.kinetic_energy() - held
            )
            self._late_energy += (1.0 - pushed) * late * (power - before[0])
            if self.sides is not None:
                ahead = late * float((through - before[1]) @ self.pressure)
        if self.sides is not None:
            weight = self.parameters.density * self.parameters.gravity
            through = problem.predicted.through
            self.sides.add_step(through, self.head(), self.level_set, weight, ahead + given)
        self.time += problem.dt
        self.steps += 1
        self._domain_is_new, self.renumbered, self.left_behind = False, None, None

    def _late(self, dt: float) -> float:
        """By how much [s] the velocity that a step of dt [s] adds is ahead of the surface.

        The surface moves with the velocity half a step ahead, which leaves nothing. In the steps of the start it moves
        with that at the beginning of the step, and keeps what it lacks; with implicit Euler in every step."""
        return 0.0 if self.steps >= START_STEPS and self.parameters.theta < 1.0 else 0.5 * dt

    def _rates(self) -> tuple[float, Array | float]:
        """Power of gravity [W], and what the velocity drives through seas (N,) [m³/s]."""
        through = 0.0 if self.sides is None else self.sides.sea_rate(self.level_set, self.velocity)
        return float(self.momentum() @ self.parameters.weight), through

    def _pushed(self, problem: PressureProblem, gained: float) -> float:
        """Share of the energy gained [J] in a step, at most 1, that bodies have given: the work of the pressure on
        them."""
        if problem.coupling.nnz == 0 or not self.pushed_by.any():
            return 0.0
        given = problem.dt * abs(float(self.pressure @ (self.coupling @ self.pushed_by.ravel())))
        return min(1.0, given / max(abs(gained), 1e-300))

    def snapshot(self) -> dict:
        """The present state, for `restore`: references, since a step replaces the arrays that it changes."""
        sides = None if self.sides is None else dict(vars(self.sides)) | {"absorbed": self.sides.absorbed}
        return vars(self) | {"sides": sides}

    def restore(self, remembered: dict) -> None:
        """Back to what `snapshot` gave, bit for bit."""
        sides = self.sides
        vars(self).update(remembered)
        self.sides = sides
        if sides is not None:
            kept = dict(remembered["sides"])
            sides.absorbed = kept.pop("absorbed")
            vars(sides).update(kept)

    # ---- solids

    def move_solids(self, domain) -> None:
        """Change to the present domain outside of the solids (`moved_solids.py`)."""
        carry_to(domain, self)

    def set_cracks(self, cracks) -> None:
        """Lump the flow through these `slits.Cracks`; to be called after every change of the domain or of the
        cracks."""
        from fluid.pressure.slits import Slits

        self.slits = Slits.of(self.domain, cracks, self.mesh.size_at(cracks.middle()), self.slits)

    def set_films(self, loose, share) -> None:
        """Let films of water between loose bodies (n_bodies,) bool and their supports transmit the pressure of their
        rim (`films.py`), where `share`, PartlyWet, says so a share of it: anew after every change of the domain."""
        from fluid.pressure.films import Films

        rules = (self.domain, np.array(loose), *share)
        known = self._film_rules
        same = known is not None and (
            known[0] is self.domain and all(np.array_equal(a, b) for a, b in zip(known[1:], rules[1:]))
        )
        if not same:
            self.films = Films.of(self.domain, self.topology, rules[1], share)
            self._film_rules = rules

    def leave_films_out(self, loose, share) -> None:
        """`set_films` before the first step: what the films at the start hold is no water of the scene."""
        self.set_films(loose, share)
        self.level_set, filled = self.in_thin_films(self.level_set)
        if len(filled):
            self.pressure = self._pressure_at_rest()
            self.end_pressure = self.pressure.copy()
            self.nodal_water = nodal_volume(self.topology, self.level_set)
            self.find_band()
            self.flux = flux_at_start(self)
        self.film_volume, self.film_potential = self.in_films(self.level_set)
        self.conserved_volume = float(self.nodal_water.sum()) - self.film_volume
        self.initial_volume = self.conserved_volume

    def in_thin_films(self, phi, among=None) -> tuple[Floats, Ints]:
        """φ (N,) [m] with the water that films without room take in at once, and their newly wet nodes (n,), of those
        `among` (.., ) them, None: all."""
        if self.films is None or len(self.films.thin.node) == 0:
            return phi, np.zeros(0, np.int64)
        height = -self.nodes_below_floor / self.parameters.gravity
        return self.films.thin.filled(phi, height, self.topology.node_size, among)

    def in_films(self, phi) -> tuple[float, float]:
        """Volume [m³] of the films below the surface φ (N,) [m], and ∫ g·x dV [m⁵/s²] over it (`film_volume.py`)."""
        if self.films is None or not self.films.drawn_in.any():
            return 0.0, 0.0
        from fluid.pressure.film_volume import film_volume

        return film_volume(self.domain, self.films.drawn_in, phi, self.nodes_below_floor)

    # ---- layout

    def set_domain(self, domain) -> None:
        self.domain = domain
        self.topology = t = Topology.of(self.mesh, domain)
        self.roomy = t.room > LEAST_COUNTED * self.mesh.spacing**3
        """(N,) bool: nodes that set the step where they are wet."""
        self.nodes_below_floor = self.below_floor(t.nodes)
        """g·x (N,) [m²/s²] of the nodes."""
        self.coupling = wetted_coupling(domain).tocsr()
        beside = np.flatnonzero(np.diff(self.coupling.indptr))
        self.beside_bodies = beside, self.coupling[beside]
        """Nodes (n,) with an entry in the coupling, and their rows of it."""
        self.on_one_side = on_one_side(domain, beside)
        """Those of them (n,) that reach walls from one side alone."""
        self.walls = self._sides.on_domain(domain, self.mesh)
        self.on_sides = self._on_sides[domain.parent_node]
        """(N,) bool: nodes on the sides of the tank."""
        self.open_to_air = np.zeros(len(domain.nodes), bool)
        """(N,) bool: nodes on open sides."""
        self.open_to_air[self.walls.open_faces] = True
        self.lets_air_out = self.open_to_air | self.walls.open_node
        """(N,) bool: nodes on open sides and on those with a sea, which is open above its level."""
        if self.sides is not None:
            self.sides.place(domain, self.topology.active)
        self._domain_is_new = True
        self._wall_area: Array | None = None
        self.graph: Graph | None = None

    def find_band(self) -> None:
        """The nodes that the step works on: the water and the layers around it."""
        self.listed, self.layer_start = self.layers((self.level_set < 0.0) & self.topology.active)

    def layers(self, wet):
        """The wet nodes, then BAND layers around them: (list, layer_start)."""
        t = self.topology
        order, start, _ = layers_around(wet, BAND, *t.around)
        if self.sides is None:
            return order, start
        # sides count with the last layer wherever they are: water may come in far from all water
        missing = np.setdiff1d(self.sides.nodes(), order)
        start[-1] += len(missing)
        return np.concatenate([order, missing]), start

    def graph_for(self, nodes) -> Graph:
        """A graph that lists these nodes: the present one if it does; a graph of all nodes, made once, when the
        solids have been at rest for a step."""
        if self.graph is None or not self.graph.covers(nodes):
            whole = not self._domain_is_new
            every = np.flatnonzero(self.topology.active) if whole else nodes
            self.graph = replace(Graph.of(self.topology, every), whole=whole)
        return self.graph

    def _pressure_at_rest(self):
        """ρ g times the depth (N,) [Pa] below the highest water: a first guess, and the level of closed pockets."""
        wet = (self.level_set < 0.0) & self.topology.active
        below = self.topology.nodes @ self.parameters.weight
        top = below[wet].min() if wet.any() else 0.0
        return np.where(wet, self.parameters.density * (below - top), 0.0)

    def dry_if_inactive(self, level):
        """The level set (N,) [m], far above the water at nodes that take no part."""
        return np.where(self.topology.active, level, FAR * self.topology.node_size)

    # ---- sides of the tank

    def hold(self, u, time: float, wet=None) -> None:
        """Impose the conditions of the sides of the tank on u (N, 3) [m/s] at a time [s], in place.

        wet (N,) bool: nodes where a side without slip holds it, None: all."""
        self.walls.slip(u, wet)
        if self.sides is not None:
            self.sides.hold(u, time, self.parameters.gravity)

    def held_open(self, phi):
        """Nodes (N,) bool on open sides that have the pressure of the side: wet ones, φ (N,) < 0, and all of seas.

        At a dry node of an open side the surface lies below it; the weight beyond a sea acts above its level, too."""
        if len(self.walls.open_nodes) == 0:
            return self.walls.open_node
        held = self.walls.open_node & (phi < 0.0)
        for side in self.sides.now if self.sides is not None else ():
            if side.is_sea:
                held[side.nodes] = self.walls.open_node[side.nodes]
        return held

    def held_by_sides(self):
        """Nodes (n,) on the sides of the tank and projectors (n, 3, 3) onto what friction and viscosity may change."""
        return self.walls.restriction()

    def nodes_at_rough_walls(self):
        """Nodes (N,) bool on sides of the tank and beside solids that rub or hold the water; None if all are smooth."""
        if self.parameters.walls == "slip":
            return None
        rubbed = self.topology.beside_solid.copy()
        rubbed[self.walls.rough_faces] = True
        return rubbed


def _viscosity(parameters: WaterParameters):
    """The viscous stage, or None where the case has neither viscosity nor rough walls."""
    if not parameters.shear:
        return None
    from fluid.viscous.viscosity import Viscosity

    return Viscosity(parameters)


def _everywhere(normal: Array, centre: Array) -> Array:
    """(B,) bool: all of the faces, with normals and centres (B, 3)."""
    return np.ones(len(centre), bool)
