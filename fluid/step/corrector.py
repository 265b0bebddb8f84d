"""Second half of the step: the velocity after the pressure.

u_i = u*_i - (dt/ρ) Π(∇x)_i,   a_i = (u_i - u_adv_i) / (θ dt)                 on wet nodes, Π: weighted mean
p = x + known, mean over the step, acts on the bodies;  x/θ belongs to a_i and starts the next step
u'_e ← u'_e - (dt/ρ) (∇x_e - mean of Π(∇x) over the cell)                     on deep cells, see `remainders.py`
u_e = u*_e + u'_e - (dt/ρ) ∇x_e                                               balances exactly: carries volume
speed limit · divergence damping · continuation outside the water, whose momentum the water bears
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Bools, Floats, Ints
from fluid.domain.cell_vectors import CellVectors, first_from
from fluid.numerics.fields import copied_at, divided, less, marks_of, nothing
from fluid.numerics.multigrid import unsigned
from fluid.numerics.sums import dots, kinetic_energies, kinetic_energy, total
from fluid.pressure.damping import Waterline, damp_divergence, damp_waterline
from fluid.pressure.pressure_bound import BoundMet
from fluid.pressure.projection import (
    WetCells,
    cell_gradient,
    nodal_mean,
    with_ghosts,
)
from fluid.step import speeds
from fluid.step.momentum import Stages, holding_water, momentum_change
from fluid.step.remainders import LAYER, MEMORY_DEPTH, left_in_cells
from fluid.step.report import StepReport
from fluid.surface.borne_momentum import Borne
from fluid.surface.extrapolation import extend_velocity
from fluid.surface.gradient_jump_damping import damp_gradient_jumps
from fluid.surface.volume import FluxAhead
from fluid.transport.surface_momentum import by_speed
from kernels.decorators import ranged
from kernels.threads import CHUNK, over, summed, zeros

FLUX_LAYERS = 3
"""Layers of dry nodes that water may reach within the next step."""
HELD = 0.02
"""Share of what a node above the surface can hold from which water around jumps keeps its own momentum in full."""
WATERLINE_DAMPING, WATERLINE_DEPTH = 0.5, 1.0 - LAYER
"""c of `damp_waterline` in calm water, and how far below the surface it acts (in cell sizes). Noise on a slope of 1:20
grows by 0.03 a step without, and not with 0.5. Less in faster water, none where it crosses a cell in a step: there it
would take what is real."""
BED_DAMPING, BED_ROUNDS = 1.0, 3
"""c of `damp_waterline` along water lines on slanting sides of the mesh, the largest that turns no velocity round as
M⁻¹L lies between 0 and 1, and how often in a step. Where water is a tenth of a cell deep on a slope of one in two, a
motion over several cells grows by 0.034 a step without, by 0.008 with 0.5 once, by 0.004 with 1 once."""
AT_REST = (0.002, 0.01)
"""Speeds in √(g h) between which the damping along water lines on slanting sides of the mesh, a bed, ends: at full
strength it takes a tenth of the run-up of a wave (P42), and what is to be kept still is far slower."""
KINK_DAMPING, KINK_DEPTH, SURFACE_DAMPING = 1.0 / 8.0, 2.0 - LAYER, 0.025
"""On meshes with obtuse cells, in calm water: c of `damp_gradient_jumps` and how far below the surface it acts (cells
of the surface reach 1.6 cell sizes down), and c of `damp_waterline` along the whole surface, for partly wet cells."""


@dataclass(frozen=True, kw_only=True)
class Corrected:
    """The state at the end of the step; names as in Water."""

    velocity: Floats
    acceleration: Floats
    pressure: Floats
    end_pressure: Floats
    remainder: CellVectors
    kick_remainder: CellVectors
    cell_velocity: CellVectors
    nodal_water: Floats
    flux: FluxAhead
    listed: Ints
    layer_start: Ints
    at_bound: Bools
    ventilated: Bools
    given_by_films: Floats
    report: StepReport


def corrected(water, problem, x, parting) -> Corrected:
    """End the step with the pressure x (n,) [Pa]; parting (n,) [m³/s] or None, as in `Water.correct`."""
    t, kept, dt = water.topology, problem.predicted, problem.dt
    unknown, pressure = zeros((len(kept.wet),)), zeros((len(kept.wet),))
    over(_placed, len(problem.dofs), problem.dofs, x, problem.known, unknown, pressure)
    if kept.held is not None:
        unknown += kept.held
        pressure += kept.held / kept.theta
    if kept.cushions is not None:
        in_pocket = kept.cushions.air.label > 0
        unknown[in_pocket] = kept.cushions.air.nodal(problem.of_air(x))[in_pocket]
        pressure[in_pocket] = kept.cushions.air.nodal(problem.of_air(x + problem.known))[in_pocket]
    gradient = _pressure_gradient(water, kept, unknown, dt / problem.density)
    if water.films is not None:
        still = np.isin(kept.wet_cells, water.films.thin.cell, assume_unique=True)
        gradient[still] = kept.cell_star[still]
    u, a, forced, mean = _projected(t, kept, gradient, dt)
    remainder, kick_remainder = left_in_cells(water, kept, gradient, mean, u, dt)
    held, projected_energy = holding_water(water, kept), kinetic_energy(problem.density, kept.nodal_water, u)
    projected, calm = copied_at(held, u), speeds.calm(water, kept.end - water.time, kept.crossing)
    clipped, limited, damped = _limit_and_damp(water, kept, u, a, held, projected, calm)
    slipping = copied_at(held, u)
    listed, start = water.layers(kept.wet)
    _continue(water, kept, listed, start, u, a, forced, dt, calm)
    cell_field, flux = _flux(water, kept, listed, start, u, gradient, dt)
    momentum = momentum_change(
        water,
        problem,
        unknown,
        pressure,
        held,
        Stages(projected=projected, limited=limited, damped=damped, slipping=slipping, end=u),
    )
    bound = BoundMet.of(water, problem, x, parting)
    report = _report(water, problem, x, projected_energy, u, clipped, momentum, bound)
    return Corrected(
        velocity=u,
        acceleration=a,
        pressure=pressure,
        end_pressure=divided(unknown, kept.theta),
        remainder=remainder,
        kick_remainder=kick_remainder,
        cell_velocity=cell_field,
        nodal_water=kept.nodal_water,
        flux=flux,
        listed=listed,
        layer_start=start,
        at_bound=bound.at_bound,
        ventilated=bound.ventilated if kept.on_walls is None else bound.ventilated | kept.on_walls,
        given_by_films=_given_by_films(water, problem),
        report=report,
    )


@ranged
def _placed(first, last, dofs, x, known, unknown, pressure):
    """x and x + known (n,) at the nodes dofs (n,) of two fields (N,)."""
    for s in range(first, last):
        i = dofs[s]
        unknown[i], pressure[i] = x[s], x[s] + known[s]


def _given_by_films(water, problem):
    """Rate (N,) [m³/s] at which films take water from their rims as the bodies move; `nothing` without films."""
    n, given = len(problem.predicted.wet), problem.predicted.given_by_films
    if given is None:
        return nothing(n)
    found = np.zeros(n)
    found[problem.of_water(problem.dofs)] = given @ water.pushed_by.ravel()
    return found


def _pressure_gradient(water, kept, pressure, scale):
    """(dt/ρ) ∇x (n, 3) [m/s] of the wet cells."""
    t = water.topology
    unheld = water.walls.open_node if kept.held is None else water.walls.open_node & (kept.held == 0.0)
    air = zeros((len(pressure),))
    if kept.cushions is not None:  # dry nodes of a sea have its pressure below zero, not that of air
        in_pocket = kept.cushions.air.label > 0
        air[in_pocket] = pressure[in_pocket]
    phi, cells = kept.level_set, (t.cells, t.volume)
    full = with_ghosts(pressure, air, kept.wet, unheld, phi, kept.wet_cells, *cells)
    return cell_gradient(kept.wet_cells, full, t.cells, t.parent, t.gradients, scale)


def _projected(t, kept, gradient, dt):
    """u (N, 3) after the pressure, its acceleration a (N, 3), what the forces alone make of it (N, 3), and Π of the
    gradient (N, 3)."""
    n = len(kept.wet)
    mean = nodal_mean(WetCells(kept.wet_cells, kept.wet_share), gradient, t.fluid_cells, n)
    u, a, forced = np.empty((n, 3)), np.empty((n, 3)), np.empty((n, 3))
    over(_after_pressure, n, kept.wet, kept.u_star, mean, kept.advected, kept.theta * dt, (u, a, forced))
    return u, a, forced, mean


@ranged
def _after_pressure(first, last, wet, u_star, mean, advected, time, made):
    """made: u and a of wet nodes, u* and zero of the others; u* - Π∇x of all."""
    u, a, forced = made
    for j in range(first, last):
        i = np.uint64(j)
        for k in range(3):
            pushed = u_star[i, k] - mean[i, k]
            forced[i, k] = pushed
            u[i, k], a[i, k] = u_star[i, k], 0.0
            if wet[i]:
                u[i, k] = pushed
                a[i, k] = (pushed - advected[i, k]) / time


def _limit_and_damp(water, kept, u, a, held, projected, calm):
    """Speed limit, damping of divergence and along water lines, slip, in place; the number of clipped nodes, and the
    velocity (N, 3) at the nodes `held` (n,) after the first and after the second.

    projected (N, 3): u before, at these nodes · calm: `Water.calm`"""
    t, parameters = water.topology, water.parameters
    clipped = _limit_speed(water, u, a)
    limited = copied_at(held, u) if clipped else projected
    line = Waterline(t.in_cells(kept.level_set), t.beside_solid, -MEMORY_DEPTH * water.mesh.spacing)
    wet = WetCells(kept.wet_cells, kept.wet_share)
    damp_divergence(wet, parameters.divergence_damping, line, u, t.fluid_cells)
    _damp_surface(water, kept, u, calm)
    damped = copied_at(held, u)
    water.hold(u, kept.end, kept.wet)
    return clipped, limited, damped


def _damp_surface(water, kept, u, calm) -> None:
    """`damp_waterline`, and `damp_gradient_jumps` where there are obtuse cells, in calm water, in place."""
    t, h = water.topology, water.mesh.spacing
    phi, wet = t.in_cells(kept.level_set), WetCells(kept.wet_cells, kept.wet_share)

    def even_out(weight, where, among=None):
        line = Waterline(phi, where, -WATERLINE_DEPTH * h)
        damp_waterline(wet, weight * calm, line, kept.wet, u, t.fluid_cells, among)

    even_out(WATERLINE_DAMPING, t.beside_solid, t.cells_near_solids)
    if t.slanting.any():
        slow = _share_at_rest(water, u)[:, None]
        for _ in range(BED_ROUNDS):
            even_out(BED_DAMPING * slow, t.slanting)
    if t.is_obtuse:
        beside = np.where(t.near_obtuse, phi, -np.inf)
        weight, deep = KINK_DAMPING * calm, -KINK_DEPTH * h
        damp_gradient_jumps(wet.rows, beside, kept.wet, weight, deep, u, t.fluid_cells, t.neighbours)
        even_out(SURFACE_DAMPING, t.near_obtuse)


def _share_at_rest(water, u):
    """(N,): 1 where the velocity u (N, 3) [m/s] is next to nothing beside the shallow wave of one cell, 0 where it is
    more than that."""
    celerity = np.sqrt(water.parameters.gravity * water.topology.node_size)
    share = np.sqrt((u * u).sum(axis=1)) / np.maximum(celerity, 1e-300)
    low, high = AT_REST
    return np.clip((high - share) / (high - low), 0.0, 1.0)


def _limit_speed(water, u, a) -> int:
    """Limit |u| to `speeds.speed_cap`, in place; clipped nodes continue in free fall."""
    return sum(over(_clip, len(u), u, a, speeds.speed_cap(water), water.parameters.weight))


@ranged
def _clip(first, last, u, a, limit, weight):
    count = 0
    for j in range(first, last):
        i = np.uint64(j)
        speed = np.sqrt(u[i, 0] * u[i, 0] + u[i, 1] * u[i, 1] + u[i, 2] * u[i, 2])
        if speed > limit:
            count += 1
            for k in range(3):
                u[i, k] *= limit / speed
                a[i, k] = weight[k]
    return count


def _continue(water, kept, listed, start, u, a, forced, dt, calm) -> None:
    """Velocity and acceleration outside the water, in place; limited again, slipping again.

    forced: see `extend_velocity` · dt [s]: of the step · calm: `Water.calm`"""
    rubbed = water.nodes_at_rough_walls()
    t = water.topology
    extend_velocity(t, (listed, start), kept.wet, kept.wet_cells, u, a, calm, forced, rubbed)
    outside = listed[start[1] : start[2]]
    p = water.parameters
    fast = np.empty(len(u))
    if by_speed(outside, forced, p.gravity, p.viscosity / p.density, t.node_size, fast):
        borne = Borne(t, outside, kept.wet, kept.nodal_water, fast, kept.in_jumps)
        borne.give(forced, u)
        own = np.empty(a.shape)
        over(_own_acceleration, len(outside), outside, forced, kept.advected, kept.theta * dt, own)
        borne.give(own, a)
    if kept.in_jumps is not None:
        over(_keep_momentum, len(u), kept.in_jumps, kept.wet, kept.nodal_water, t.node_volume, forced, u)
    _limit_speed(water, u, a)
    water.hold(u, kept.end, kept.wet)


@ranged
def _own_acceleration(first, last, nodes, forced, advected, time, own):
    """What the forces alone change in a `time` [s], (N, 3) [m/s²], at the listed nodes."""
    for s in range(first, last):
        i = nodes[s]
        for k in range(3):
            own[i, k] = (forced[i, k] - advected[i, k]) / time


@ranged
def _keep_momentum(first, last, share, wet, water, capacity, forced, u):
    """u (N, 3) goes over to `forced` in place by the share (N,) at nodes above the surface, as far as they hold HELD of
    what they could."""
    for j in range(first, last):
        i = np.uint64(j)
        if share[i] > 0.0 and water[i] > 0.0 and not wet[i]:
            weight = share[i] * min(water[i] / (HELD * capacity[i]), 1.0)
            for k in range(3):
                u[i, k] += weight * (forced[i, k] - u[i, k])


def _flux(water, kept, listed, start, u, gradient, dt):
    """Velocity of the cells, CellVectors, and what the flux of the next step is made of; gradient: (dt/ρ) ∇x (n, 3)
    [m/s] of the wet cells, dt [s] of this step."""
    t = water.topology
    reached = listed[: start[FLUX_LAYERS + 1]]
    around = t.cells_around(marks_of(reached, len(u)))
    now, before = np.empty((len(around), 3)), np.empty((len(around), 3))
    wet = (kept.wet_cells, kept.cell_star, gradient)
    over(
        _cells_of_flux,
        len(around),
        around,
        u,
        wet,
        tuple(water.cell_velocity),
        t.fluid_cells,
        now,
        before,
    )
    field = CellVectors(around, now)
    ahead = FluxAhead(
        nodes=reached,
        graph=water.graph_for(reached),
        now=field,
        before=before,
        # with implicit Euler the velocity at the end of the step is the stable choice
        dt=dt if water.parameters.theta < 1.0 else 0.0,
        water=less(kept.nodal_water, kept.displaced),
        capacity=t.node_volume,
    )
    return field, ahead


@ranged
def _cells_of_flux(first, last, cell_list, u, wet, known, fluid, now, before):
    """Velocity (n, 3) of the listed cells: that of the projection in wet ones, elsewhere u (N, 3) at the centroid; and
    (n, 3) at the beginning of the step, the same where there was none.

    wet: cells (k,), their u* (k, 3) and what the pressure takes from it (k, 3) · known: cells (l,) and their values
    (l, 3) at the beginning. All lists ascend."""
    (wet_cells, star, taken), (cells_before, u_before) = wet, known
    cells, share, share_row = fluid.cells, fluid.share, fluid.share_row
    begin = cell_list[first] if first < last else 0
    w, w_end = first_from(wet_cells, begin), np.uint64(wet_cells.shape[0])
    b, b_end = first_from(cells_before, begin), np.uint64(cells_before.shape[0])
    for s in range(first, last):
        e = np.uint64(cell_list[s])
        row = share_row[e]
        while w < w_end and wet_cells[w] < cell_list[s]:
            w += np.uint64(1)
        while b < b_end and cells_before[b] < cell_list[s]:
            b += np.uint64(1)
        is_wet = w < w_end and wet_cells[w] == cell_list[s]
        t = np.uint64(s)
        x, y, z = 0.0, 0.0, 0.0
        if is_wet:
            x, y, z = star[w, 0] - taken[w, 0], star[w, 1] - taken[w, 1], star[w, 2] - taken[w, 2]
        else:
            for a in range(4):
                i = cells[e, a]
                x += share[row, a] * u[i, 0]
                y += share[row, a] * u[i, 1]
                z += share[row, a] * u[i, 2]
        now[t, 0], now[t, 1], now[t, 2] = x, y, z
        moved = b < b_end and cells_before[b] == cell_list[s]
        moved = moved and (u_before[b, 0] != 0.0 or u_before[b, 1] != 0.0 or u_before[b, 2] != 0.0)
        for k in range(3):
            before[t, k] = u_before[b, k] if moved else now[t, k]


def _report(water, problem, x, projected_energy, u, clipped, momentum, bound):
    kept, p = problem.predicted, water.parameters
    before, carried, W = water.nodal_water, kept.uncorrected_water, kept.nodal_water
    states = [(before, water.velocity), (carried, kept.u_star), (W, kept.u_star), (W, u)]
    moments = dots((before, carried, W), water.nodes_below_floor)
    kinetic, (at_start, of_carried, of_water) = (
        kinetic_energies(p.density, states),
        -p.density * moments[:, 0],
    )
    stages = [
        kinetic[0] + at_start,
        kinetic[1] + of_carried,
        kinetic[2] + of_water,
        projected_energy + of_water,
        kinetic[3] + of_water,
    ]
    names = ("transport and gravity", "volume correction", "pressure", "damping and limit")
    change = dict(zip(names, np.diff(stages)))
    if water.viscous is not None:
        change["transport and gravity"] -= kept.shear.energy
        change["viscosity and friction"] = kept.shear.energy
    volume = float(moments[2, 1]) - total(kept.displaced) - kept.in_films[0]
    left = kept.left
    return StepReport(
        dt=problem.dt,
        volume=volume,
        volume_error=(volume - kept.conserved_volume) / max(water.handled_volume, 1e-300),
        reinserted=kept.reinserted,
        clipped=clipped,
        unknowns=len(x),
        wet_cells=len(kept.wet_cells) + len(kept.void),
        work_on_bodies=-problem.dt * _power_on_bodies(problem, x, bound.rate),
        energy_change=change,
        momentum=momentum,
        left=0.0 if left is None else float(left.volume.sum()),
        left_energy=0.0 if left is None else left.energy,
        bound=bound,
    )


def _power_on_bodies(problem, x, rate) -> float:
    """(x + known)·(A x - b - rate) [W], what bodies move times the pressure; rate (n,) [m³/s], or zero for all."""
    A, rate = problem.matrix, np.zeros(0) if np.ndim(rate) == 0 else rate
    rows = (*unsigned(A), A.data)
    return float(summed(_powers, len(x), (1,), *rows, x, problem.known, problem.rhs, rate)[0])


@ranged
def _powers(first, last, indptr, indices, data, x, known, rhs, rate, partial):
    for c in range(first, last):
        for k in range(c * CHUNK, min((c + 1) * CHUNK, x.shape[0])):
            i = np.uint64(k)
            moved = -rhs[i] if rate.shape[0] == 0 else -rhs[i] - rate[i]
            for s in range(indptr[i], indptr[i + np.uint64(1)]):
                moved += data[s] * x[indices[s]]
            partial[c, 0] += (x[i] + known[i]) * moved
