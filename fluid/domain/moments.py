"""Volume of water in cells that the surface φ = 0 (linear in the cell, φ < 0 water) passes through.

With one corner a on one side, the corner tetrahedron has the relative volume v = t_b t_c t_d, where
t_b = φ_a / (φ_a - φ_b) is the position of the crossing on the edge ab, and ∫ N_k over it is v times the mean of
N_k at its four corners.  With two corners on each side the water is a prism, split in three.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Floats, Integers
from kernels.decorators import inlined, inner, kernel, plain, released
from kernels.threads import found_over, over, owning, owns_any, reach_of_cells


@inlined
def _corner(p, q, r, s):
    """∫ N / |e| over the part of the cell on the side of the first corner, the only one there, of all four corners."""
    t, u, v = p / (p - q), p / (p - r), p / (p - s)
    quarter = 0.25 * (t * u * v)
    own = quarter + quarter * (1.0 - t) + quarter * (1.0 - u) + quarter * (1.0 - v)
    return own, quarter * t, quarter * u, quarter * v


@inlined
def _prism(a, b, c, d):
    """∫ N / |e| over the wet side when the first two corners are wet and the other two dry, of all four corners.

    The crossings ac, ad, bc, bd divide the prism into the tetrahedra a ac ad bd, a ac bc bd and a b bc bd."""
    ac, ad, bc, bd = a / (a - c), a / (a - d), b / (b - c), b / (b - d)
    first, second, third = 0.25 * ac * ad * (1.0 - bd), 0.25 * ac * (1.0 - bc) * bd, 0.25 * bc * bd
    of_a = first * (3.0 - ac - ad) + second * (2.0 - ac) + third
    of_b = first * (1.0 - bd) + second * (2.0 - bc - bd) + third * (3.0 - bc - bd)
    return (
        of_a,
        of_b,
        first * ac + second * (ac + bc) + third * bc,
        first * (ad + bd) + second * bd + third * bd,
    )


@inner
def moments_below(a, b, c, d):
    """∫_{φ<0} N_k / |e| of the four corners of a cell with these values of φ, all in registers."""
    wet = np.int64(a < 0.0) + np.int64(b < 0.0) + np.int64(c < 0.0) + np.int64(d < 0.0)
    if wet == 0:
        return 0.0, 0.0, 0.0, 0.0
    if wet == 4:
        return 0.25, 0.25, 0.25, 0.25
    if wet == 2:
        if (a < 0.0) == (b < 0.0):
            if a < 0.0:
                return _prism(a, b, c, d)
            x, y, z, w = _prism(c, d, a, b)
            return z, w, x, y
        if (a < 0.0) == (c < 0.0):
            if a < 0.0:
                x, y, z, w = _prism(a, c, b, d)
                return x, z, y, w
            x, y, z, w = _prism(b, d, a, c)
            return z, x, w, y
        if a < 0.0:
            x, y, z, w = _prism(a, d, b, c)
            return x, z, w, y
        x, y, z, w = _prism(b, c, a, d)
        return z, x, y, w
    alone = wet == 1
    if (a < 0.0) == alone:
        x, y, z, w = _corner(a, b, c, d)
    elif (b < 0.0) == alone:
        y, x, z, w = _corner(b, a, c, d)
    elif (c < 0.0) == alone:
        z, x, y, w = _corner(c, a, b, d)
    else:
        w, x, y, z = _corner(d, a, b, c)
    if alone:
        return x, y, z, w
    return 0.25 - x, 0.25 - y, 0.25 - z, 0.25 - w


@plain
def wet_moments(phi, out):
    """∫_{φ<0} N_k / |e| (4,) of a cell with corner values phi (4,)."""
    out[0], out[1], out[2], out[3] = moments_below(phi[0], phi[1], phi[2], phi[3])


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
def part_moments(e, phi, parts, local, out):
    """∫_{φ<0} N_a dV [m³] of the four corners over the fluid part of cell e; phi: the four values there · local, out
    (4,): work space.

    Exact: a whole cell by its corners, a cut one by the tetrahedra that fill it."""
    a, b, c, d = phi
    if not (a < 0.0 or b < 0.0 or c < 0.0 or d < 0.0):
        return 0.0, 0.0, 0.0, 0.0
    volume = parts.volume[e]
    if a < 0.0 and b < 0.0 and c < 0.0 and d < 0.0:
        share = parts.share[parts.share_row[e]]
        return volume * share[0], volume * share[1], volume * share[2], volume * share[3]
    begin, end = parts.start[e], parts.start[e + np.uint64(1)]
    if begin == end:
        x, y, z, w = moments_below(a, b, c, d)
        return volume * x, volume * y, volume * z, volume * w
    x, y, z, w = 0.0, 0.0, 0.0, 0.0
    for t in range(begin, end):
        corners = parts.corners[t]
        for q in range(4):
            local[q] = 0.0 + corners[q, 0] * a + corners[q, 1] * b + corners[q, 2] * c + corners[q, 3] * d
        wet_moments(local, out)
        for q in range(4):
            weight = parts.fan_volume[t] * out[q]
            x += weight * corners[q, 0]
            y += weight * corners[q, 1]
            z += weight * corners[q, 2]
            w += weight * corners[q, 3]
    return x, y, z, w


def nodal_water(cell_list, shift, phi, parts, n_nodes):
    """∫_{φ+shift<0} N_i dV (N,) [m³] over the listed cells of the FluidParts; phi (N,) [m]."""
    water = np.empty(n_nodes)
    reach = reach_of_cells(cell_list, parts.cells)
    owning(_nodal_water, n_nodes, reach, len(cell_list), cell_list, shift, phi, parts, water)
    return water


@released
def _nodal_water(first, last, runs, cell_list, shift, phi, parts, water):
    local, out = np.empty(4), np.empty(4)
    cells, volume, share, share_row = parts.cells, parts.volume, parts.share, parts.share_row
    water[first:last] = 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[np.uint64(s)])
            i, j, k, m = cells[e, 0], cells[e, 1], cells[e, 2], cells[e, 3]
            at = (phi[i] + shift, phi[j] + shift, phi[k] + shift, phi[m] + shift)
            if at[0] < 0.0 and at[1] < 0.0 and at[2] < 0.0 and at[3] < 0.0:  # most cells: not worth a call
                row, size = share_row[e], volume[e]
                held = (
                    size * share[row, 0],
                    size * share[row, 1],
                    size * share[row, 2],
                    size * share[row, 3],
                )
            elif at[0] < 0.0 or at[1] < 0.0 or at[2] < 0.0 or at[3] < 0.0:
                if not owns_any(first, last, cells, e):
                    continue
                held = part_moments(e, at, parts, local, out)
            else:
                continue
            if first <= i < last:
                water[i] += held[0]
            if first <= j < last:
                water[j] += held[1]
            if first <= k < last:
                water[k] += held[2]
            if first <= m < last:
                water[m] += held[3]


def wet_fraction(cell_list, phi, parts):
    """Share of the fluid part of each listed cell with φ < 0, (n,)."""
    share = np.empty(len(cell_list))
    over(_wet_fraction, len(cell_list), cell_list, phi, parts, share)
    return share


@released
def _wet_fraction(first, last, cell_list, phi, parts, share):
    local, out = np.empty(4), np.empty(4)
    cells, start = parts.cells, parts.start
    for place in range(first, last):
        s = np.uint64(place)
        e = np.uint64(cell_list[s])
        a, b, c, d = phi[cells[e, 0]], phi[cells[e, 1]], phi[cells[e, 2]], phi[cells[e, 3]]
        if a < 0.0 and b < 0.0 and c < 0.0 and d < 0.0 and start[e] == start[e + np.uint64(1)]:
            share[s] = 1.0  # most cells: not worth a call
            continue
        x, y, z, w = part_moments(e, (a, b, c, d), parts, local, out)
        share[s] = min((x + y + z + w) / parts.volume[e], 1.0)


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
