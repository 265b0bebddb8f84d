"""Damping of motions of the velocity that the pressure does not see: divergence within wholly wet cells, and waves of
the length of a cell where a surface meets a solid."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Bools, Floats
from fluid.domain.cell_vectors import places_among
from fluid.pressure.projection import SMALLEST_WET_SHARE, WetCells
from kernels.decorators import ranged, released
from kernels.threads import found_over, over, owning, reach_of_cells

MOST_DAMPED = 2.0
"""Largest eigenvalue of the divergence damping of one cell, 4 c_L l_e² Σ_a |∇N_a|², and so a bound for that of all
cells together: up to 2 the energy of no motion grows. Bricks with equal edges have 1.2 with c_L = 0.05, but bricks
squeezed to a twenty-third in one direction 26: the sea beside them gained 8 % of the energy put in within one step."""


class Waterline(NamedTuple):
    """Where cells lie near it: level_set (N,) [m] · beside_solid (N,) bool · deep [m]: cells with φ < deep are not."""

    level_set: Floats
    beside_solid: Bools
    deep: float


def damp_divergence(wet, weight, line, u, fluid):
    """u_i -= Σ_e |e| c_e (div u)_e ∇N_i / m_i over wholly wet cells, in place on wet nodes (LSIC);
    c_e = c_L l_e², in flat cells as much less as `MOST_DAMPED` demands.

    With elements of equal order some divergence is invisible to the pressure; without this damping sloshing gains
    energy. Deep cells (φ < deep) beside solids are left out: there the subscale velocity of the cells, not that of the
    nodes, satisfies the mass balance, and damping would let the added mass of a body drift (26 % in 25 steps).

    wet: WetCells · weight: c_L · line: Waterline · u (N, 3) [m/s] · fluid: FluidCells"""
    n, steepness = len(u), np.empty(len(fluid.gradients))
    over(_steepness, len(steepness), fluid.gradients, steepness)
    mass, push = np.empty(n), np.empty((n, 3))
    reach = reach_of_cells(wet.rows, fluid.cells)
    owning(_push_of_divergence, n, reach, len(wet.rows), wet, weight, line, u, fluid, steepness, (mass, push))
    over(_pushed, n, line.level_set, mass, push, u)


@ranged
def _steepness(first, last, g, out):
    """Σ_a |∇N_a|² of gradients (S, 4, 3)."""
    for p in range(first, last):
        out[p] = 0.0
        for a in range(4):
            for k in range(3):
                out[p] += g[p, a, k] * g[p, a, k]


@ranged
def _push_of_divergence(first, last, runs, wet, weight, line, u, fluid, steepness, sums):
    cell_list, wet_share = wet
    phi, beside_solid, deep = line
    cells, parent, g, volume, size = fluid.cells, fluid.parent, fluid.gradients, fluid.volume, fluid.size
    mass, push = sums
    for j in range(first, last):
        i = np.uint64(j)
        mass[i], push[i, 0], push[i, 1], push[i, 2] = 0.0, 0.0, 0.0, 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[s])
            p = parent[e]
            highest, beside, divergence = -np.inf, False, 0.0
            for a in range(4):
                i = cells[e, a]
                if first <= i < last:
                    mass[i] += 0.25 * volume[e] * max(wet_share[s], 1e-6)
                highest = max(highest, phi[i])
                beside = beside or beside_solid[i]
                for k in range(3):
                    divergence += u[i, k] * g[p, a, k]
            if highest < 0.0 and not (beside and highest < deep):
                c = weight * volume[e] * size[e] * size[e] * divergence
                bound = 4.0 * weight * size[e] * size[e] * steepness[p]
                if bound > MOST_DAMPED:
                    c *= MOST_DAMPED / bound
                for a in range(4):
                    if first <= cells[e, a] < last:
                        for k in range(3):
                            push[cells[e, a], k] += c * g[p, a, k]


@ranged
def _pushed(first, last, phi, mass, push, u):
    for j in range(first, last):
        i = np.uint64(j)
        if phi[i] < 0.0 and mass[i] > 0.0:
            for k in range(3):
                u[i, k] -= push[i, k] / mass[i]


def damp_waterline(wet_cells, weight, line, wet, u, fluid, among=None):
    """u ← u - c (M⁻¹L)² u in place on wet nodes, over the cells beside solids that reach up to φ > deep:
    (L u)_i = Σ_e w_e (u_i - mean of u over the wet corners of e), w_e the water of the cell, M all water around a node.

    Where a surface meets a solid at an oblique angle, the surface and velocities with the wave length of a cell amplify
    each other (by 0.03 a step for still water on a slope of 1:20).  L is symmetric and positive and annihilates a
    uniform velocity, so its square takes energy but no momentum. It is squared because L alone acts as a viscosity that
    slows a thin tongue of run-up.

    wet_cells: WetCells · weight: c, one or (N, 1) · line: Waterline · wet (N,) bool · u (N, 3) [m/s] ·
    fluid: FluidCells · among (k,): the cells beside solids and all that touch them, in order, at least; None: all"""
    near = _around_waterline(wet_cells.rows, line, fluid.cells, among)
    if len(near) == 0:
        return
    around = WetCells(wet_cells.rows[near], wet_cells.share[near])
    once = _unlike_neighbours(around, line, wet, u, fluid)
    twice = _unlike_neighbours(around, line, wet, once, fluid)
    over(_evened, len(u), np.reshape(weight, -1), twice, u)


@ranged
def _evened(first, last, weight, twice, u):
    """u - weight · twice (N, 3) in place; weight (1,) or (N,)."""
    for i in range(first, last):
        w = weight[i] if weight.shape[0] > 1 else weight[0]
        for k in range(3):
            u[i, k] -= w * twice[i, k]


def _around_waterline(cell_list, line, cells, among=None):
    """Places in the list of the cells beside solids that reach up to φ > deep, and of all that touch them; among: as in
    `damp_waterline`."""
    if among is not None:
        places = places_among(among, cell_list)
        return places[_around_waterline(cell_list[places], line, cells)]
    reached = np.zeros(len(line.level_set), bool)
    over(_mark_waterline, len(cell_list), cell_list, line, cells, reached)
    return found_over(_places_beside, len(cell_list), cell_list, reached, cells)


@ranged
def _mark_waterline(first, last, cell_list, line, cells, reached):
    phi, beside_solid, deep = line
    for s in range(first, last):
        e = cell_list[s]
        beside, highest = False, -np.inf
        for a in range(4):
            beside = beside or beside_solid[cells[e, a]]
            highest = max(highest, phi[cells[e, a]])
        if beside and highest > deep:
            for a in range(4):
                reached[cells[e, a]] = True


@released
def _places_beside(first, last, cell_list, reached, cells):
    found, n = np.empty(last - first, np.int64), 0
    for s in range(first, last):
        e = cell_list[s]
        if reached[cells[e, 0]] or reached[cells[e, 1]] or reached[cells[e, 2]] or reached[cells[e, 3]]:
            found[n] = s
            n += 1
    return found[:n].copy()


def _unlike_neighbours(wet_cells, line, wet, u, fluid):
    """M⁻¹L u (N, 3), zero on dry nodes."""
    mass, out = np.empty(len(u)), np.empty(u.shape)
    reach = reach_of_cells(wet_cells.rows, fluid.cells)
    owning(_unlike, len(u), reach, len(wet_cells.rows), wet_cells, line, wet, u, fluid, mass, out)
    return out


@released
def _unlike(first, last, runs, wet_cells, line, wet, u, fluid, mass, out):
    cell_list, wet_share = wet_cells
    phi, beside_solid, deep = line
    cells, volume, mean = fluid.cells, fluid.volume, np.empty(3)
    mass[first:last], out[first:last] = 0.0, 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = cell_list[s]
            w = volume[e] * max(wet_share[s], SMALLEST_WET_SHARE)
            count, beside, highest = 0, False, -np.inf
            mean[:] = 0.0
            for a in range(4):
                i = cells[e, a]
                beside = beside or beside_solid[i]
                highest = max(highest, phi[i])
                if wet[i]:
                    count += 1
                    if first <= i < last:
                        mass[i] += w
                    for k in range(3):
                        mean[k] += u[i, k]
            if beside and highest > deep:
                for a in range(4):
                    i = cells[e, a]
                    if wet[i] and first <= i < last:
                        for k in range(3):
                            out[i, k] += w * (u[i, k] - mean[k] / count)
    for i in range(first, last):
        if mass[i] > 0.0:
            for k in range(3):
                out[i, k] /= mass[i]
