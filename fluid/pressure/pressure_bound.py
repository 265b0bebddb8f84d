"""Lower bound of the pressure: that of the air where air can get to, the vapour pressure elsewhere.

Water in contact with air cannot pull on a wall: air enters, and the water separates from the wall.  Air reaches the
nodes that share a cell with a dry node or with an open side, and advances from there by one cell in a step through
water that has separated already; within a step it follows the separation (`bounded.py`).  Water that no air reaches
separates where its pressure falls to that of its vapour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Bools, Floats
from fluid.numerics.bounded import SLACK
from kernels.decorators import plain, ranged
from kernels.threads import over


def lowest_pressure(water, graph, dofs, phi, of_air: float = 0.0) -> Array | None:
    """Bound (n,) [Pa] of the pressure at the wet nodes dofs (n,) of the level set φ (N,) [m]; None: there is none.

    of_air [Pa]: lowest pressure of any air. Beside an air cushion that slows it down, water has less than the pressure
    of the cushion, and water drawn on by a pocket of low pressure has less than that of the open air; the bound is
    therefore the lowest pressure of all air."""
    p = water.parameters
    if p.suction != "bounded":
        return None
    bound, either = np.empty(len(dofs)), (p.vapour_pressure, max(of_air, p.vapour_pressure))
    state = (phi, water.open_to_air, water.ventilated)
    over(_bounds, len(dofs), dofs, graph.row, graph.start, graph.neighbour, *state, either, bound)
    return bound


@dataclass(frozen=True, kw_only=True)
class BoundMet:
    """Where the pressure of a step met its bound: at_bound (N,) bool, ventilated (N,) bool where the bound is that of
    air · rate (n,) [m³/s] at which water separates at the unknowns, a single number if it does so nowhere · volume [m³]
    that opened · work [J] done to separate water against its vapour pressure (that of the air is zero) · lowest [Pa]
    pressure of the water, but in films, where bodies feel that of the rim (`films.py`) · wall: share of the wetted
    walls, of tank and bodies, on which the pressure is at its bound."""

    at_bound: Bools
    ventilated: Bools
    rate: Floats | float
    volume: float
    work: float
    lowest: float
    wall: float

    @classmethod
    def of(cls, water, problem, x, parting) -> BoundMet:
        """After a step with x (n,) [Pa] and parting (n,) [m³/s] or None, as in `Water.correct`."""
        n_nodes, n = len(problem.predicted.wet), len(x)
        at_bound, ventilated = np.zeros(n_nodes, bool), np.zeros(n_nodes, bool)
        in_film = problem.predicted.in_film
        in_film = np.zeros(n, bool) if in_film is None else in_film
        least, largest = zip(*over(_extremes, n, x, problem.known, in_film))
        lowest = float(min(least))
        if problem.bound is None:
            return cls(
                at_bound=at_bound,
                ventilated=ventilated,
                rate=0.0,
                volume=0.0,
                work=0.0,
                lowest=lowest,
                wall=0.0,
            )
        vented, limits = np.empty(n, bool), (problem.known, problem.bound, problem.of_open_air)
        state = (problem.dofs, x, *limits, n - problem.pockets, SLACK * max(largest))
        met = sum(over(_met, n, *state, vented, at_bound, ventilated))
        rate = 0.0 if parting is None else parting
        opened = problem.dt * float(np.sum(rate))
        work = wall = 0.0
        if opened:
            parted_at = problem.of_water(np.where(vented, problem.of_open_air, problem.bound))
            work = -problem.dt * float(np.sum(problem.of_water(rate) * parted_at))
        if met:
            area = water.wall_area()
            wall = float(area[at_bound].sum()) / max(float(area[problem.dofs].sum()), 1e-300)
        return cls(
            at_bound=at_bound,
            ventilated=ventilated,
            rate=rate,
            volume=opened,
            work=work,
            lowest=lowest,
            wall=wall,
        )


@ranged
def _extremes(first, last, x, known, in_film):
    """Least x + known outside of films, 0 where none is below, and largest |x|."""
    least, largest = 0.0, 0.0
    for k in range(first, last):
        i = np.uint64(k)
        least = least if in_film[i] else min(least, x[i] + known[i])
        largest = max(largest, abs(x[i]))
    return least, largest


@ranged
def _met(first, last, dofs, x, known, bound, of_air, in_water, slack, vented, at_bound, ventilated):
    """vented (n,): unknowns with the pressure of the air, also where it came to within the step. Marks the nodes of
    those at their bound, and, within the slack, at that of the air; how many are at their bound. The unknowns from
    `in_water` on are those of air."""
    count = 0
    for k in range(first, last):
        i = np.uint64(k)
        air = of_air - known[i] if k < in_water else -np.inf
        vented[i] = x[i] == air
        if vented[i] or x[i] <= bound[i] - known[i]:
            at_bound[dofs[i]] = True
            count += 1
        if x[i] <= air + slack and (vented[i] or bound[i] == of_air):
            ventilated[dofs[i]] = True
    return count


def wall_area(mesh, domain) -> Array:
    """Area (N,) [m²] of the walls around each node: of the sides of the tank a third to each corner of a face, of
    bodies a quarter to each corner of the cell that a polygon lies in."""
    of_bodies = np.zeros(len(domain.nodes))
    _add_quarters(domain.face_cell, domain.face_area, domain.cells, of_bodies)
    return mesh.boundary_of_nodes[domain.parent_node] + of_bodies


@plain
def _add_quarters(face_cell, area, cells, of_nodes):
    for s in range(face_cell.shape[0]):
        for a in range(4):
            of_nodes[cells[face_cell[s], a]] += 0.25 * area[s]


@ranged
def _bounds(first, last, dofs, graph_row, start, neighbour, phi, open_to_air, ventilated, either, bound):
    """The first of two bounds (n,) [Pa], and the second at or next to dry nodes, open sides or water that has
    separated."""
    for r in range(first, last):
        i = np.uint64(dofs[r])
        vented = open_to_air[i] or ventilated[i]
        row = np.uint64(graph_row[i])
        for s in range(start[row], start[row + np.uint64(1)]):
            j = neighbour[s]
            vented = vented or phi[j] >= 0.0 or open_to_air[j] or ventilated[j]
        bound[r] = either[1] if vented else either[0]
