"""The momentum of the water, and its changes in a step by cause.

    P = ρ Σ W_i u_i,    L = ρ Σ W_i (x_i - x_0) × u_i         W_i: nodal volume, x_0: `Water.reference`

A vector of six holds both, [N s, N m s]; every line is what it adds to the water in the step.

Pressure.  A cell gets -|e| dt ∇p_e.  For every hat function ∫ ∇N_i dV = b_i - G_i over the physical domain, with b_i
= ∮ N_i n dA over the sides of the tank and G_i the coupling to the bodies, and the same with arms, since products of
linear functions are integrated exactly.  So

    -dt Σ_e |e| ∇p_e  =  -dt Σ_i p_i b_i  +  dt Σ_i p_i G_i                                               (1)
       the cells              the tank           the bodies, -Gᵀp on them

to round-off, whatever the pressure is: `pressure_closure` is what is missing.  b_i is summed over the cells around
nodes of the sides, so that (1) is a check of the cutting and not an identity.  Where thresholds of the covers close
narrow openings, water pushes on what closes them: the same sum over the cells around the nodes there, those with
several copies (of which one may have been dropped with the pocket behind the opening), is the line "openings", and (1)
stays a check at all other nodes.

What the nodes make of it differs from (1) where the surface cuts cells or leaves them void, and where the part of the
last pressure that is carried over acts on other nodes than it came from. These differences, and what transport,
volume correction, damping, limit and slip do, are lines of their own: the semi-Lagrangian transport does not conserve
momentum.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats
from fluid.numerics.sums import about, momenta_of_rows, momentum_of, momentum_of_rows
from kernels.decorators import inlined, plain, ranged, released
from kernels.threads import CHUNK, found_over, over, summed

EVERYWHERE = np.zeros(0, bool)
ZERO = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NUMERICAL = (
    "transport",
    "volume_correction",
    "carried",
    "surface",
    "damping",
    "limit",
    "slip",
    "shear_solve",
)
"""Lines of the scheme, in the order of the step."""
PHYSICAL = ("weight", "tank", "tank_shear", "sides", "openings", "air", "bodies")
"""Lines of what acts on the water."""


@dataclass(frozen=True, kw_only=True)
class MomentumChange:
    """before, after (6,) [N s, N m s]: momentum of the water at both ends of the step · lines: name → (6,), all of
    PHYSICAL and NUMERICAL · pressure_closure (6,): what (1) misses, the residual of the step."""

    before: Floats
    after: Floats
    lines: dict[str, Array]
    pressure_closure: Floats


@dataclass(frozen=True, kw_only=True)
class Stages:
    """Velocities (N, 3) [m/s] through the second half of the step, at the nodes that hold water: after the pressure,
    the speed limit, the damping, the slip along the sides, and at the end."""

    projected: Floats
    limited: Floats
    damped: Floats
    slipping: Floats
    end: Floats


def momentum(water) -> Array:
    """P, L (6,) of a Water now."""
    wet = np.flatnonzero(water.nodal_water > 0.0)
    state = (water.nodal_water, water.velocity, water.topology.nodes, water.reference)
    return momentum_of_rows(wet, water.parameters.density, *state)


def momentum_change(water, problem, unknown, pressure, rows, stages: Stages) -> MomentumChange:
    """The lines of a step that ends; `water` still holds the state at its beginning.

    unknown, pressure (N,) [Pa]: x and x + known on wet nodes and seas · rows: `holding_water`."""
    kept, dt = problem.predicted, problem.dt
    x, p = unknown, pressure
    if kept.held is not None or kept.cushions is not None:  # otherwise there is none outside the water
        x, p = np.empty(len(unknown)), np.empty(len(unknown))
        over(_in_water, len(x), kept.wet, unknown, pressure, x, p)
    at = _momenta(water, kept, dt, rows, stages)
    cells, tank, held = _reactions(water, kept, x, p, dt)
    openings = _at_closed_openings(water, kept, p, dt)
    on_bodies, shear_on_bodies, tank_shear = _loads(water, problem, p)
    of_air, air_on_bodies = _of_air(water, problem, unknown, pressure)
    through, side_pressure = _through(water, kept), -dt * _pressure_on_sides(water, p)
    weight = dt * at["weight"]
    lines = {
        "weight": weight,
        "tank": tank - side_pressure,
        "tank_shear": tank_shear,
        "sides": through + side_pressure,
        "openings": openings,
        "air": of_air[0] + of_air[1] + air_on_bodies,
        "bodies": -on_bodies - air_on_bodies,
        "transport": at["carried"] - at["kicked"] - through,
        "volume_correction": at["advected"] - at["carried"],
        "carried": at["kicked"] - at["before"] + at["star"] - at["sheared"] - weight - cells[1] - of_air[1],
        "surface": at["projected"]
        - at["star"]
        - cells[0]
        - of_air[0]
        + at["end"]
        - at["slipping"]
        + on_bodies
        + held
        - shear_on_bodies,
        "damping": at["damped"] - at["limited"],
        "limit": at["limited"] - at["projected"],
        "slip": at["slipping"] - at["damped"],
        "shear_solve": at["sheared"] - at["advected"] + shear_on_bodies - tank_shear,
    }
    return MomentumChange(
        before=at["before"],
        after=at["end"],
        lines=lines,
        pressure_closure=cells[0] + cells[1] - tank - held - openings,
    )


@ranged
def _in_water(first, last, wet, unknown, pressure, x, p):
    """x, p (N,): unknown and pressure (N,) at wet nodes, zero elsewhere."""
    for i in range(first, last):
        x[i] = unknown[i] if wet[i] else 0.0
        p[i] = pressure[i] if wet[i] else 0.0


def holding_water(water, kept) -> Array:
    """Numbers (n,) of the nodes that hold water before the step, after transport or after the volume correction."""
    W0 = water.nodal_water
    return found_over(_holding, len(W0), W0, kept.uncorrected_water, kept.nodal_water)


@released
def _holding(first, last, before, carried, corrected):
    found, n = np.empty(last - first, np.int64), 0
    for i in range(first, last):
        if before[i] > 0.0 or carried[i] > 0.0 or corrected[i] > 0.0:
            found[n] = i
            n += 1
    return found[:n].copy()


def _momenta(water, kept, dt, rows, stages: Stages) -> dict[str, Array]:
    """Momentum (6,) after every stage of the step; "weight" [N, N m]: that of the water. rows: `holding_water`."""
    W0, own, W1 = water.nodal_water, kept.uncorrected_water, kept.nodal_water
    nodes, parameters, u = water.topology.nodes, water.parameters, water.velocity
    kicked, weight = np.empty_like(u), np.empty_like(u)
    step, g = (1.0 - kept.theta) * dt, parameters.weight
    over(_kicked, len(rows), rows, u, water.acceleration, kept.kick, step, g, (kicked, weight))
    unsheared = kept.advected if kept.shear is None else kept.advected - kept.shear.change
    found = {
        "before": (W0, water.velocity),
        "kicked": (W0, kicked),
        "carried": (own, unsheared),
        "advected": (W1, unsheared),
        "sheared": (W1, kept.advected),
        "star": (W1, kept.u_star),
        "weight": (W1, weight),
    }
    found |= {name: (W1, u) for name, u in vars(stages).items()}
    # without shear, or where no node was limited, two stages are one
    alike = {name: (id(volume), id(velocity)) for name, (volume, velocity) in found.items()}
    each = dict(zip(alike.values(), found.values()))
    momenta = momenta_of_rows(rows, parameters.density, list(each.values()), nodes, water.reference)
    of_each = dict(zip(each, momenta))
    return {name: of_each[key] for name, key in alike.items()}


@ranged
def _kicked(first, last, rows, u, a, kick, dt, g, made):
    """made: u after dt [s] at the acceleration times kick (N,), and g (3,), both (N, 3) at the listed rows."""
    kicked, weight = made
    for s in range(first, last):
        i = rows[s]
        factor = dt * kick[i]
        for k in range(3):
            kicked[i, k], weight[i, k] = u[i, k] + factor * a[i, k], g[k]


def _all_cells(kept) -> Array:
    """Cells with water, and void ones (n,)."""
    return np.concatenate([kept.wet_cells, kept.void]) if len(kept.void) else kept.wet_cells


def _reactions(water, kept, x, p, dt):
    """Impulses on the water: by the cells, of x and of p - x; by the sides of the tank and by the bodies, of p."""
    t, at_side = water.topology, water.on_sides
    cells = _all_cells(kept)
    mesh = (t.nodes, t.fluid_cells)
    of_x, of_p, of_sides = hat_forces(cells, x, p, at_side, water.reference, *mesh)
    of_bodies = _on_bodies(water, p)
    of_sides += _on_bodies(water, p, at_side) if water.domain.n_bodies else of_bodies
    return (-dt * of_x, -dt * (of_p - of_x)), -dt * of_sides, dt * of_bodies


def _at_closed_openings(water, kept, p, dt):
    """Impulse (6,) on the water by what closes narrow openings; zero without thresholds of the covers."""
    t, connection = water.topology, water.domain.memory.connection
    if connection is None or connection.face == 0.0:
        return np.zeros(6)
    beside = water.domain.several & ~water.on_sides
    cells = _all_cells(kept)
    mesh = (t.nodes, t.fluid_cells)
    total = hat_forces(cells, p, p, beside, water.reference, *mesh)[2]
    return -dt * (total + _on_bodies(water, p, beside))


def _of_air(water, problem, unknown, pressure):
    """Impulses of trapped air: on the water, by x and by p - x of its nodes (2, 6), and on the bodies (6,).

    The sides of the tank carry what it does to both of them."""
    kept, dt, t = problem.predicted, problem.dt, water.topology
    if kept.cushions is None:
        return np.zeros((2, 6)), np.zeros(6)
    in_pocket = kept.cushions.air.label > 0
    x, p = np.where(in_pocket, unknown, 0.0), np.where(in_pocket, pressure, 0.0)
    cells = _all_cells(kept)
    mesh = (t.nodes, t.fluid_cells)
    of_x, of_p, _ = hat_forces(cells, x, p, np.zeros(len(x), bool), water.reference, *mesh)
    acting = problem.of_air(problem.coupling).T @ kept.cushions.air.at_pockets(pressure)
    on_bodies = -dt * about(water.reference, acting, water.domain.body_centre)
    return -dt * np.array([of_x, of_p - of_x]), on_bodies


def _on_bodies(water, p, where=None):
    """Gᵀ p about the reference (6,) [N, N m], of the nodes `where` (N,) bool only; None: of all."""
    loads = np.zeros((water.domain.n_bodies, 6))
    if len(loads) == 0:
        return np.zeros(6)
    beside, rows = water.beside_bodies
    where = EVERYWHERE if where is None else where
    every, matrix = np.arange(len(beside)), (rows.indptr, rows.indices, rows.data)
    _add_rows(every, beside, p, where, matrix, loads.reshape(-1))
    return about(water.reference, loads, water.domain.body_centre)


def _loads(water, problem, p):
    """Impulses: given to the bodies, of it the wall shear, and that of the sides of the tank on the water by shear."""
    centre, dt, shear = water.domain.body_centre, problem.dt, problem.predicted.shear
    coupling = problem.coupling
    # Few nodes have rows that are not empty; the product with the transpose would go through all. p is 0 in the air.
    if len(centre) == 0:
        on_bodies = np.zeros(6)
    else:
        rows = found_over(_not_empty, coupling.shape[0], coupling.indptr)
        of_pressure = np.zeros(coupling.shape[1])
        matrix = (coupling.indptr, coupling.indices, coupling.data)
        _add_rows(rows, problem.dofs, p, EVERYWHERE, matrix, of_pressure)
        on_bodies = problem.other_load - of_pressure.reshape(-1, 6)
        on_bodies = dt * about(water.reference, on_bodies, centre)
    if shear is None:
        return on_bodies, np.zeros(6), np.zeros(6)
    return on_bodies, dt * about(water.reference, shear.load, centre), dt * shear.tank


@plain
def _add_rows(rows, nodes, p, where, matrix, out):
    """out (m,) += p (N,) times the listed rows (k,) of a csr matrix (n, m), which belong to the nodes (n,); p counts
    `where` (N,) bool alone."""
    indptr, indices, data = matrix
    for r in rows:
        value = p[nodes[r]] if len(where) == 0 or where[nodes[r]] else 0.0
        for s in range(indptr[r], indptr[r + 1]):
            out[indices[s]] += data[s] * value


@released
def _not_empty(first, last, indptr):
    """Rows of a csr matrix that have entries, in order."""
    found, n = np.empty(last - first, np.int64), 0
    for i in range(first, last):
        if indptr[i] < indptr[i + 1]:
            found[n] = i
            n += 1
    return found[:n].copy()


def _through(water, kept):
    """Momentum (6,) that came in with the water through sides, less what left."""
    total = np.zeros(6)
    if kept.left is None and kept.through is None:
        return total
    arm = water.topology.nodes - water.reference
    density = water.parameters.density
    if kept.left is not None:
        total -= momentum_of(density * kept.left.volume, water.velocity, arm)
    if kept.through is not None:
        u = water.velocity.copy()
        water.hold(u, kept.end)
        total += momentum_of(density * kept.through, u, arm)
    return total


def _pressure_on_sides(water, p):
    """∮ p [n; r × n] dA (6,) over the open parts of inflows and seas, n outward."""
    total = np.zeros(6)
    for side in water.sides.now if water.sides is not None else ():
        place = np.einsum("fca,fak->fck", side.hats, water.topology.nodes[side.faces]) - water.reference
        value = np.einsum("fca,fa->fc", side.hats, p[side.faces])
        mean, middle = value.sum(axis=1) / 12.0, place.sum(axis=1)
        first = np.einsum("fa,fak->fk", value, place) / 12.0 + mean[:, None] * middle
        total[:3] += (value.mean(axis=1)[:, None] * side.area).sum(axis=0)
        total[3:] += np.cross(first, side.area).sum(axis=0)
    return total


def hat_forces(cell_list, x, p, at_side, reference, nodes, fluid):
    """Σ_e |e| [∇f; (c_e - x_0) × ∇f] (3, 6) over the listed cells for f = x, p, and p on the nodes at_side (N,) only.

    c_e: centroid of the fluid part; exact for linear f. reference x_0 (3,), nodes (N, 3) [m] · fluid: FluidCells"""
    state = ((x, p), at_side, reference, nodes, fluid)
    return summed(_hat_forces, len(cell_list), (3, 6), cell_list, *state)


@released
def _hat_forces(first, last, cell_list, fields, at_side, reference, nodes, fluid, partial):
    x, p = fields
    cells, parent, g = fluid.cells, fluid.parent, fluid.gradients
    volume, share, share_row = fluid.volume, fluid.share, fluid.share_row
    beside = np.empty(4, np.bool_)
    for c in range(first, last):
        total_x, total_p, total_side = ZERO, ZERO, partial[c, 2]
        for s in range(c * CHUNK, min((c + 1) * CHUNK, cell_list.shape[0])):
            e = np.uint64(cell_list[s])
            q, row = parent[e], share_row[e]
            arm0, arm1, arm2 = -reference[0], -reference[1], -reference[2]
            x0, x1, x2, p0, p1, p2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            at_any = False
            for a in range(4):
                i = cells[e, a]
                beside[a] = at_side[i]
                at_any = at_any or beside[a]
                part = share[row, a]
                arm0 += part * nodes[i, 0]
                arm1 += part * nodes[i, 1]
                arm2 += part * nodes[i, 2]
                x0 += x[i] * g[q, a, 0]
                x1 += x[i] * g[q, a, 1]
                x2 += x[i] * g[q, a, 2]
                p0 += p[i] * g[q, a, 0]
                p1 += p[i] * g[q, a, 1]
                p2 += p[i] * g[q, a, 2]
            arm = (arm0, arm1, arm2)
            total_x = _with_force(arm, volume[e], x0, x1, x2, total_x)
            total_p = _with_force(arm, volume[e], p0, p1, p2, total_p)
            if at_any:
                p0, p1, p2 = 0.0, 0.0, 0.0
                for a in range(4):
                    if beside[a]:
                        value = p[cells[e, a]]
                        p0 += value * g[q, a, 0]
                        p1 += value * g[q, a, 1]
                        p2 += value * g[q, a, 2]
                side = (
                    total_side[0], total_side[1], total_side[2], total_side[3], total_side[4], total_side[5]
                )  # fmt: skip
                side = _with_force(arm, volume[e], p0, p1, p2, side)
                for k in range(6):
                    total_side[k] = side[k]
        for k in range(6):
            partial[c, 0, k], partial[c, 1, k] = total_x[k], total_p[k]


@inlined
def _with_force(arm, volume, f0, f1, f2, total):
    """A total of six with the volume times f, and its moment with the arm. Six numbers in registers: added up in
    memory, each would wait for the one before to be stored."""
    f0, f1, f2 = volume * f0, volume * f1, volume * f2
    return (
        total[0] + f0,
        total[1] + f1,
        total[2] + f2,
        total[3] + (arm[1] * f2 - arm[2] * f1),
        total[4] + (arm[2] * f0 - arm[0] * f2),
        total[5] + (arm[0] * f1 - arm[1] * f0),
    )
