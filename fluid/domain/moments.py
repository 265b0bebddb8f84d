"""Volume of water in cells that the surface φ = 0 (linear in the cell, φ < 0 water) passes through.

With one corner a on one side, the corner tetrahedron has the relative volume v = t_b t_c t_d, where
t_b = φ_a / (φ_a - φ_b) is the position of the crossing on the edge ab, and ∫ N_k over it is v times the mean of
N_k at its four corners.  With two corners on each side the water is a prism, split in three.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Integers
from kernels.decorators import inner, kernel, plain, released
from kernels.threads import found_over, over, owning, owns_any, reach_of_cells


@inner
def corner_moments(phi, a, out):
    """∫ N_k / |e| over the part of the cell on the side of corner a, the only one there. phi (4,), out (4,)."""
    v = 1.0
    for b in range(4):
        if b != a:
            v *= phi[a] / (phi[a] - phi[b])
    out[a] = 0.25 * v
    for b in range(4):
        if b != a:
            t = phi[a] / (phi[a] - phi[b])
            out[b] = 0.25 * v * t
            out[a] += 0.25 * v * (1.0 - t)


@inner
def _prism_moments(phi, a, b, c, d, out):
    """∫ N_k / |e| over the wet side when a, b are wet and c, d dry.

    The crossings ac, ad, bc, bd divide the prism into the tetrahedra a ac ad bd, a ac bc bd and a b bc bd."""
    ac, ad = phi[a] / (phi[a] - phi[c]), phi[a] / (phi[a] - phi[d])
    bc, bd = phi[b] / (phi[b] - phi[c]), phi[b] / (phi[b] - phi[d])
    first, second, third = 0.25 * ac * ad * (1.0 - bd), 0.25 * ac * (1.0 - bc) * bd, 0.25 * bc * bd
    out[a] = first * (3.0 - ac - ad) + second * (2.0 - ac) + third
    out[b] = first * (1.0 - bd) + second * (2.0 - bc - bd) + third * (3.0 - bc - bd)
    out[c] = first * ac + second * (ac + bc) + third * bc
    out[d] = first * (ad + bd) + second * bd + third * bd


@plain
def wet_moments(phi, out):
    """∫_{φ<0} N_k / |e| (4,) of a cell with corner values phi (4,)."""
    n_wet = 0
    for k in range(4):
        if phi[k] < 0.0:
            n_wet += 1
    if n_wet == 0 or n_wet == 4:
        for k in range(4):
            out[k] = 0.0 if n_wet == 0 else 0.25
    elif n_wet == 2:
        a, b, c, d = -1, -1, -1, -1
        for k in range(4):
            if phi[k] < 0.0:
                a, b = (k, b) if a < 0 else (a, k)
            else:
                c, d = (k, d) if c < 0 else (c, k)
        _prism_moments(phi, a, b, c, d, out)
    else:
        single = 0
        while (phi[single] < 0.0) != (n_wet == 1):
            single += 1
        corner_moments(phi, single, out)
        if n_wet == 3:
            for k in range(4):
                out[k] = 0.25 - out[k]


class FluidParts(NamedTuple):
    """The fluid parts of the cells: cells (M, 4) · volume (M,) [m³] of their fluid part · share (K + 1, 4), share_row
    (M,): mean of N_a over it, see `FluidCells` · start (M + 1,), fan_volume (T,) [m³], corners (T, 4, 4): fans of the
    cut cells (`fans.py`)."""

    cells: Integers
    volume: Floats
    share: Floats
    share_row: Integers
    start: Integers
    fan_volume: Floats
    corners: Floats


@inner
def part_moments(e, phi, parts, total, local, out):
    """total (4,) <- ∫_{φ<0} N_a dV [m³] over the fluid part of cell e; phi (4,) at its corners; other arguments: work
    space.

    Exact: a whole cell by its corners, a cut one by the tetrahedra that fill it."""
    n_wet = 0
    for a in range(4):
        n_wet += phi[a] < 0.0
        total[a] = 0.0
    if n_wet == 0:
        return
    if n_wet == 4:
        for a in range(4):
            total[a] = parts.volume[e] * parts.share[parts.share_row[e], a]
        return
    if parts.start[e] == parts.start[e + 1]:
        wet_moments(phi, out)
        for a in range(4):
            total[a] = parts.volume[e] * out[a]
        return
    for t in range(parts.start[e], parts.start[e + 1]):
        for q in range(4):
            local[q] = 0.0
            for a in range(4):
                local[q] += parts.corners[t, q, a] * phi[a]
        wet_moments(local, out)
        for q in range(4):
            weight = parts.fan_volume[t] * out[q]
            for a in range(4):
                total[a] += weight * parts.corners[t, q, a]


def nodal_water(cell_list, shift, phi, parts, n_nodes):
    """∫_{φ+shift<0} N_i dV (N,) [m³] over the listed cells of the FluidParts; phi (N,) [m]."""
    water = np.empty(n_nodes)
    reach = reach_of_cells(cell_list, parts.cells)
    owning(_nodal_water, n_nodes, reach, len(cell_list), cell_list, shift, phi, parts, water)
    return water


@released
def _nodal_water(first, last, runs, cell_list, shift, phi, parts, water):
    at, total, local, out = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    cells, volume, share, share_row = parts.cells, parts.volume, parts.share, parts.share_row
    water[first:last] = 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[s])
            n_wet = 0
            for a in range(4):
                at[a] = phi[cells[e, a]] + shift
                n_wet += at[a] < 0.0
            if n_wet == 4:  # most cells: not worth a call
                for a in range(4):
                    if first <= cells[e, a] < last:
                        water[cells[e, a]] += volume[e] * share[share_row[e], a]
            elif n_wet > 0 and owns_any(first, last, cells, e):
                part_moments(e, at, parts, total, local, out)
                for a in range(4):
                    if first <= cells[e, a] < last:
                        water[cells[e, a]] += total[a]


def wet_fraction(cell_list, phi, parts):
    """Share of the fluid part of each listed cell with φ < 0, (n,)."""
    share = np.empty(len(cell_list))
    over(_wet_fraction, len(cell_list), cell_list, phi, parts, share)
    return share


@released
def _wet_fraction(first, last, cell_list, phi, parts, share):
    at, total, local, out = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    cells, start = parts.cells, parts.start
    for place in range(first, last):
        s = np.uint64(place)
        e = np.uint64(cell_list[s])
        a, b, c, d = phi[cells[e, 0]], phi[cells[e, 1]], phi[cells[e, 2]], phi[cells[e, 3]]
        if a < 0.0 and b < 0.0 and c < 0.0 and d < 0.0 and start[e] == start[e + np.uint64(1)]:
            share[s] = 1.0  # most cells: not worth a call
            continue
        at[0], at[1], at[2], at[3] = a, b, c, d
        part_moments(e, at, parts, total, local, out)
        share[s] = min((total[0] + total[1] + total[2] + total[3]) / parts.volume[e], 1.0)


@kernel
def cells_touching(marked, cells):
    """Numbers of the cells with at least one marked corner; marked (N,) bool."""
    found = np.empty(cells.shape[0], np.int64)
    n = 0
    for e in range(cells.shape[0]):
        if marked[cells[e, 0]] or marked[cells[e, 1]] or marked[cells[e, 2]] or marked[cells[e, 3]]:
            found[n] = e
            n += 1
    return found[:n].copy()


@kernel
def marked_corners(cell_list, marked, cells):
    """How many corners of each of the listed cells (k,) are marked; marked (N,) bool."""
    found = np.zeros(len(cell_list), np.uint8)
    for k in range(len(cell_list)):
        for a in range(4):
            found[k] += marked[cells[cell_list[k], a]]
    return found


def touching_among(cell_list, marked, cells):
    """Those of the listed cells (k,) with at least one marked corner, in their order; marked (N,) bool."""
    return found_over(_touching_among, len(cell_list), cell_list, marked, cells)


@released
def _touching_among(first, last, cell_list, marked, cells):
    found = np.empty(last - first, np.int64)
    n = 0
    for s in range(first, last):
        e = np.uint64(cell_list[s])
        if marked[cells[e, 0]] or marked[cells[e, 1]] or marked[cells[e, 2]] or marked[cells[e, 3]]:
            found[n] = e
            n += 1
    return found[:n].copy()
