"""First half of the step, before the pressure is known.

û = uⁿ + (1-θ) dt âⁿ,   âⁿ = aⁿ f,  f = min(1, a_max/|aⁿ|)         part of the last acceleration, limited
φ̃, u_adv = transport of φ, û by uⁿ + dt/2 âⁿ     semi-Lagrangian, MacCormack; `surface_momentum.py`
φ = redistanced φ̃, corrected towards the conservative volume
u* = u_adv + θ dt g
(dt/ρ) K x = ∫ (u* + u')·∇N dV + G V
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from array_types import Bools, Floats, Ints
from fluid.domain.coupling_matrix import rows_of, wetted_coupling
from fluid.numerics.fields import added, copied, is_nothing, taken_at
from fluid.numerics.sums import total
from fluid.pressure.active_cells import WetPart
from fluid.pressure.indefinite_cells import about, reserve
from fluid.pressure.pressure_bound import lowest_pressure
from fluid.pressure.projection import (
    PressureProblem,
    cell_velocity,
    cut_off,
    inflow,
    pressure_matrix,
    pull_of_held,
    seal_pockets,
)
from fluid.pressure.waterline import WaterlineLoad
from fluid.sides.outflow import Outflow
from fluid.step import speeds
from fluid.step.carried import carried_by_fluxes
from fluid.step.kick import kicked
from fluid.step.remainders import carried_remainder
from fluid.surface.cavities import air_on_walls
from fluid.surface.level_set import redistance
from fluid.surface.volume import VolumeCorrection, correct_volume
from fluid.transport.advection import Fields, carried
from fluid.transport.paths_in_solids import levels_in_solids
from fluid.transport.surface_momentum import share_of_fast
from kernels.decorators import ranged, released
from kernels.threads import found_over, over, zeros

if TYPE_CHECKING:
    from fluid.viscous.viscosity import ViscousChange

TRANSPORT_WIDTH = 5.0
"""|φ| in cell sizes within which the level set moves; beyond, only its sign matters."""
RESCALE_EVERY = 5


@dataclass(frozen=True, kw_only=True)
class Predicted:
    """Between predict and correct: level_set (N,), nodal_water (N,) [m³], advected (N, 3) and u_star (N, 3) [m/s], kick
    (N,): `Water.kick_factor`, wet (N,) bool, wet_cells (n,), wet_share (n,) and void (k,) of WetPart, cell_star (n, 3)
    [m/s] velocity of the wet cells, remainder (n, 3) [m/s] of them, theta, conserved_volume and reinserted [m³],
    uncorrected_water (N,) [m³] before the volume correction, shear: by viscosity and friction, None
    without; end [s]: time at the end of the step; left: what leaves through open sides, None if nothing; through (N,)
    [m³] that enters through sides, None without any; held (N,) [Pa]: unknown part of the pressure on the nodes of seas,
    None without any side; displaced (N,) [m³]: part of nodal_water that the bodies take in this step; in_films: that in
    films, as `Water.in_films` gives it; crossing [m/s]: `Water.crossing`; given_by_films and in_film (n,) bool, the
    unknowns in films: see `films.py`; cushions: trapped air (`fluid.air.cushions`), None without any; on_walls
    (N,) bool: nodes with air on a wall (`cavities.py`), None without any; in_jumps (N,): share to which water at nodes
    above the surface keeps its own momentum (`surface_momentum.py`), None where it does nowhere."""

    level_set: Floats
    nodal_water: Floats
    advected: Floats
    u_star: Floats
    kick: Floats
    wet: Bools
    wet_cells: Ints
    wet_share: Floats
    void: Ints
    cell_star: Floats
    remainder: Floats
    theta: float
    conserved_volume: float
    reinserted: float
    uncorrected_water: Floats
    shear: ViscousChange | None
    end: float
    left: Outflow | None
    through: Floats | None
    held: Floats | None
    displaced: Floats
    in_films: tuple[float, float]
    crossing: float
    cushions: object | None = None
    given_by_films: object | None = None
    in_film: Bools | None = None
    on_walls: Bools | None = None
    in_jumps: Floats | None = None


@dataclass(frozen=True, kw_only=True)
class Moved:
    """What transport, sides, volume and shear of a step have found before its pressure problem is set up.

    surface: VolumeCorrection · conserved_volume [m³] · advected, u_star (N, 3) [m/s], shear, left, through, displaced,
    in_films, crossing, on_walls, in_jumps: as in `Predicted`."""

    surface: VolumeCorrection
    conserved_volume: float
    advected: Floats
    u_star: Floats
    shear: ViscousChange | None
    left: Outflow | None
    through: Floats | None
    displaced: Floats
    in_films: tuple[float, float]
    crossing: float
    on_walls: Bools | None
    in_jumps: Floats | None


def predicted(water, dt: float) -> PressureProblem:
    """Carry out the step up to the pressure solve; reads the state of `water`."""
    crossing, parameters = speeds.crossing(water), water.parameters
    theta, kick = speeds.theta(water, dt, crossing), water.kick_factor(crossing)
    u_adv, phi = _transported(water, dt, theta, kick, crossing)
    found = carried_by_fluxes(water, dt, theta, kick)
    carried = copied(found.water) if is_nothing(found.swept) else added(found.water, found.swept)
    conserved, left = water.conserved_volume, Outflow.of(water, dt, carried)
    if left is not None:
        carried -= left.volume
        conserved -= float(left.volume.sum())
    through = None
    if water.sides is not None:
        water.sides.surface(phi, water.time + dt)
        u_now = water.velocity.copy()
        water.hold(u_now, water.time + dt)
        through = water.sides.through(phi, u_now, dt, carried)
        carried += through
        conserved += float(through.sum())
    displaced = water.displacement(dt)
    phi = redistance(
        water.topology,
        phi,
        water.topology.node_size,
        rescale=(water.steps % RESCALE_EVERY == RESCALE_EVERY - 1),
        motion=(water.velocity, parameters.gravity),
    )
    if water.sides is not None:
        exchanged = water.sides.exchanged(water.topology, phi, carried + displaced)
        through += exchanged
        carried += exchanged
        conserved += float(exchanged.sum())
    in_films = water.in_films(water.level_set)
    phi, filled = water.in_thin_films(phi, water.listed[: water.layer_start[-2]])
    if len(filled):
        carried[filled] = water.topology.node_volume[filled]
        in_films = water.in_films(phi)
    beside = total(displaced) + in_films[0]
    calm = speeds.calm(water, dt, crossing)
    held = added(carried, displaced)
    phi, on_walls = air_on_walls(water.topology, phi, held, water.ventilated, water.on_one_side)
    surface = _new_surface(
        water, calm, share_of_fast(speeds.in_waves(water, crossing)), phi, held, conserved + beside
    )
    in_jumps = None
    if found.velocity is not None:
        graph = water.graph_for(water.listed)
        in_jumps = found.into(
            u_adv,
            water.listed,
            phi,
            graph,
            surface,
            held,
            water.topology,
            water.walls.open_node,
        )
        water.hold(u_adv, water.time + dt, water.walls.wet(surface.level_set))
    shear = None
    if water.viscous is not None:
        shear = _sheared(water, dt, theta, kick, surface, u_adv)
        u_adv = u_adv + shear.change
    u_star = np.empty_like(u_adv)
    over(_fallen, len(u_adv), u_adv, theta * dt * parameters.weight, water.topology.active, u_star)
    moved = Moved(
        surface=surface,
        conserved_volume=conserved,
        advected=u_adv,
        u_star=u_star,
        shear=shear,
        left=left,
        through=through,
        displaced=displaced,
        in_films=in_films,
        crossing=crossing,
        on_walls=on_walls,
        in_jumps=in_jumps,
    )
    return _problem(water, dt, theta, kick, moved)


def _sheared(water, dt, theta, kick, surface, u_adv):
    """Change by viscosity and walls over the step, relative to the motion under the last pressure: ViscousChange."""
    w = u_adv + theta * dt * kick[:, None] * water.acceleration
    water.hold(w, water.time + dt)
    return water.viscous.change(water, surface.level_set, surface.nodal_water, w, dt)


@ranged
def _fallen(first, last, u, gained, active, out):
    """u + gained (N, 3) at active nodes, zero elsewhere."""
    for j in range(first, last):
        i = np.uint64(j)
        for k in range(3):
            out[i, k] = u[i, k] + gained[k] if active[i] else 0.0


def _transported(water, dt, theta, kick, crossing):
    """u_adv (N, 3) and φ̃ (N,); nodes outside the list keep û and φ. crossing [m/s]: `speeds.crossing`."""
    to_middle = 0.5 * dt if water.parameters.theta < 1.0 else 0.0
    u_hat, u_m = kicked(water.velocity, water.acceleration, kick, 1.0, (1.0 - theta) * dt, to_middle)
    wet = water.walls.wet(water.level_set)
    for u in (u_hat, u_m):
        water.hold(u, water.time + dt, wet)
    fields = Fields.of(u_hat, water.level_set)
    moved = carried(water.topology, water.listed, dt, u_m, fields, water.walls.open_node)
    if water.parameters.advection == "supg":
        from fluid.transport.supg import carried_velocity

        moved[:, :3] = carried_velocity(water, dt, u_m, u_hat)
    u_adv, phi = u_hat, copied(water.level_set)
    if water.topology.is_obtuse:
        places, levels = levels_in_solids(
            water.topology, water.listed, dt, u_m, phi, water.topology.node_size
        )
        moved[places, 3] = levels
    if water.parameters.viscosity > 0.0 or share_of_fast(speeds.in_waves(water, crossing)) > 0.0:
        from fluid.transport.landing import gained

        fields.renew(water.listed)
        more, places = gained(water, dt, u_m, fields)
        moved[places, 3] += more
    width = TRANSPORT_WIDTH * water.mesh.spacing
    over(_taken_over, len(moved), water.listed, moved, water.topology.finer, width, u_adv, phi)
    water.walls.admit_air(phi, u_m, dt, water.topology.node_size, -np.asarray(water.parameters.down))
    water.hold(u_adv, water.time + dt, water.walls.wet(phi))
    return u_adv, phi


@ranged
def _taken_over(first, last, listed, moved, finer, width, u, phi):
    """What paths brought to the listed nodes: u, and φ where it is within the width [m] of the surface, in local
    cells."""
    for s in range(first, last):
        i = listed[s]
        for k in range(3):
            u[i, k] = moved[s, k]
        if abs(phi[i] * finer[i]) < width:
            phi[i] = moved[s, 3]


def _new_surface(water, calm, fast, phi, carried, conserved):
    """φ corrected: VolumeCorrection. calm: `Water.calm` · fast: `share_of_fast` of the fastest water."""
    p = water.parameters
    length = p.correction_length + (p.calm_correction_length - p.correction_length) * calm
    return correct_volume(
        water.topology,
        water.graph_for(water.listed),
        water.listed,
        phi,
        carried,
        conserved,
        length,
        water.topology.node_size,
        fast,
    )


def _problem(water, dt: float, theta: float, kick, moved: Moved) -> PressureProblem:
    """The pressure problem of a step of dt [s]; kick (N,): `kick_factor`."""
    t, density = water.topology, water.parameters.density
    phi, held = moved.surface.level_set, None
    part = WetPart.of(t, water.domain, phi, water.mesh.spacing)
    wet, cells = part.nodes, part.cells
    graph = water.graph_for(water.listed).without(t, part.void)
    remainder = carried_remainder(water, dt, theta, cells)
    star = cell_velocity(cells, moved.u_star, remainder, t.fluid_cells)
    rhs = inflow(cells, star, t.fluid_cells, len(phi))
    dofs = found_over(_unknowns, len(wet), wet, water.walls.open_node)
    matrix, anchored, held_back = _definite(water, graph, phi, cells, dofs, dt / density, theta)
    if held_back is not None:
        rhs[dofs] += held_back
    if water.sides is not None:
        rhs += water.sides.drive(moved.advected, part.void)
        gravity = water.parameters.gravity
        held = theta * water.sides.pressure(density, gravity, water.velocity, water.time + dt)
        # at the edge that a sea shares with an inflow the pressure is sought, not held
        held[~water.walls.open_node] = 0.0
        rhs[dofs] += pull_of_held(graph, dofs, held, dt / density)
    known, guess, at_bound = np.empty(len(dofs)), np.empty(len(dofs)), np.empty(len(dofs), bool)
    state = (water.end_pressure, water.at_bound)
    over(_of_last_step, len(dofs), dofs, theta, kick, *state, known, guess, at_bound)
    coupling, faces, left_out = _coupling(water, part.void)
    matrix, extra = _sealed(water, matrix, anchored, dofs, dt, guess)
    if water.slits is not None:
        lumped, drive = water.slits.pressure_terms(dofs, known, water.parameters.weight, dt, density)
        matrix, extra = matrix + lumped, drive if extra is None else extra + drive
    cushions = None
    if water.air is not None:
        from fluid.air.cushions import Cushions
        from fluid.air.leaks import Openings

        taken = water.coupling @ water.moved_on.ravel()
        moving = water.coupling @ water.pushed_by.ravel()
        cushions = Cushions.of(water.air, t, water.level_set, phi, water.lets_air_out, taken, moving, dt)
        cushions = cushions.leaking(Openings.of(water, cushions.air.label), dt)
        cushions = cushions.beside(graph, phi, dofs, theta, kick, dt / density)
    kept = Predicted(
        level_set=phi,
        nodal_water=moved.surface.nodal_water,
        advected=moved.advected,
        u_star=moved.u_star,
        kick=kick,
        wet=wet,
        wet_cells=cells,
        wet_share=part.share,
        void=part.void,
        cell_star=star,
        remainder=remainder,
        theta=theta,
        conserved_volume=moved.conserved_volume,
        reinserted=moved.surface.reinserted,
        uncorrected_water=moved.surface.uncorrected_water,
        shear=moved.shear,
        end=water.time + dt,
        left=moved.left,
        through=moved.through,
        held=held,
        displaced=moved.displaced,
        in_films=moved.in_films,
        crossing=moved.crossing,
        cushions=cushions,
        on_walls=moved.on_walls,
        in_jumps=moved.in_jumps,
    )
    acted, unheld = _known_pressure(water, water.pressure, phi), water.walls.open_node
    if held is not None:
        unheld = unheld & (held == 0.0)
        acted = np.where(held == 0.0, acted, held / theta)
    air, of_air = (None, ()) if cushions is None else (cushions.air.nodal, cushions.pressure)
    least = 0.0 if cushions is None else cushions.lowest(dt)
    waterline = WaterlineLoad(t, water.domain, faces, left_out, phi, wet, acted, unheld, air)
    other = at_waterline = waterline.before(of_air)
    if held is not None:
        beside = np.flatnonzero(wet & (held != 0.0))
        other = other - (coupling[beside].T @ acted[beside]).reshape(-1, 6)
    if moved.shear is not None:
        other = other + moved.shear.load
    problem = PressureProblem(
        matrix=matrix,
        rhs=taken_at(dofs, rhs) if extra is None else rhs[dofs] + extra,
        coupling=rows_of(coupling, dofs),
        known=known,
        guess=guess,
        dofs=dofs,
        dt=dt,
        density=density,
        other_load=other,
        waterline=waterline,
        at_waterline=at_waterline,
        predicted=kept,
        bound=lowest_pressure(water, graph, dofs, phi, least),
        at_bound=at_bound,
        of_open_air=least,
    )
    if water.films is not None:
        problem = water.films.handed_on(water, problem)
    if cushions is None:
        return problem
    if water.sides is not None:
        rhs = rhs - water.sides.drive_of_air(phi, moved.advected, part.void)
    return cushions.within(problem, rhs, coupling, part.void, water.domain)


@ranged
def _of_last_step(first, last, dofs, theta, kick, pressure, held, known, guess, at_bound):
    """What the pressure (N,) [Pa] at the end of the last step gives the nodes dofs (n,): its part that goes on, by
    kick (N,), a first guess of what is sought, and where it was at its bound, held (N,) bool."""
    for s in range(first, last):
        i = dofs[s]
        known[s] = (1.0 - theta) * kick[i] * pressure[i]
        guess[s], at_bound[s] = theta * pressure[i], held[i]


@released
def _unknowns(first, last, wet, open_node):
    """Wet nodes that are not on open sides, in order."""
    found, n = np.empty(last - first, np.int64), 0
    for i in range(first, last):
        if wet[i] and not open_node[i]:
            found[n] = i
            n += 1
    return found[:n].copy()


def _known_pressure(water, pressure, phi):
    """A pressure (N,) [Pa] of the last step; before the first step that of still water."""
    return pressure if water.steps else -water.parameters.density * water.parameters.gravity * phi


def _definite(water, graph, phi, cells, dofs, scale, theta):
    """The matrix, rows beside p = 0, and what rows behind obtuse angles at the surface add to the right hand side,
    None without obtuse angles."""
    open_node = water.held_open(phi)
    if not water.topology.is_obtuse:
        matrix, anchored, _ = pressure_matrix(graph, phi, dofs, open_node, scale, zeros((len(phi),)))
        return matrix, anchored, None
    unknown = np.zeros(len(phi), bool)
    unknown[dofs] = True
    spare = reserve(water.topology, cells, unknown)
    matrix, anchored, turned = pressure_matrix(graph, phi, dofs, open_node, scale, spare)
    rows, held_back, beside = np.flatnonzero(turned), np.zeros(len(dofs)), np.zeros(len(phi), bool)
    beside[dofs[anchored]] = True
    held_back[rows] = turned[rows] * about(
        graph, dofs[rows], beside, phi, theta * _known_pressure(water, water.end_pressure, phi)
    )
    return matrix, anchored, held_back


def _coupling(water, void):
    """G (N, 6 n_bodies) without the polygons of void cells, the rows of the polygons that count, and of those others
    whose cells may hold water (`indefinite_cells.py`)."""
    cell, none = water.domain.face_cell, np.zeros(0, np.int64)
    if len(void) == 0:
        return water.coupling, np.arange(len(cell)), none
    left_out = np.isin(cell, void)
    coupling = water.coupling - wetted_coupling(water.domain, left_out)
    return coupling, np.flatnonzero(~left_out), np.flatnonzero(left_out) if water.topology.is_obtuse else none


def _sealed(water, matrix, anchored, dofs, dt, pressure):
    """The matrix, and what is added to the right hand side, None: nothing.

    Closed pockets get a compliance far below that at which it affects their pressure differences, c ρ h²/dt ≪ (π h/L)²:
    real water is softer than that in short steps, and its waves would take part in the added mass of bodies."""
    floating = cut_off(matrix, anchored)
    if not floating.any():
        return matrix, None
    p = water.parameters
    compliance = (
        p.pocket_compliance * dt / (p.density * water.mesh.spacing**2) * water.topology.finer[dofs] ** 2
    )
    return seal_pockets(matrix, floating, water.topology.node_volume[dofs], compliance, pressure)
