"""Volume of water in cells that the surface φ = 0 (linear in the cell, φ < 0 water) passes through.

With one corner a on one side, the corner tetrahedron has the relative volume v = t_b t_c t_d, where
t_b = φ_a / (φ_a - φ_b) is the place of the crossing on the edge ab, and ∫ N_k over it is v times the mean of
N_k at its four corners.  With two corners on each side the water is a prism, split in three.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit

from fluid.jit import inner, plain


@plain
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


@plain
def _prism_moments(phi, a, b, c, d, out, corner):
    """∫ N_k / |e| over the wet side when a, b are wet and c, d dry. corner (6, 4): work space."""
    for q in range(6):
        for k in range(4):
            corner[q, k] = 0.0
    corner[0, a] = 1.0
    corner[3, b] = 1.0
    for side in range(2):
        wet = a if side == 0 else b
        for k in range(2):
            dry = c if k == 0 else d
            t = phi[wet] / (phi[wet] - phi[dry])
            corner[3 * side + 1 + k, wet] = 1.0 - t
            corner[3 * side + 1 + k, dry] = t
    for k in range(4):
        out[k] = 0.0
    for piece in range(3):
        v = abs(_volume4(corner, piece))
        for k in range(4):
            total = 0.0
            for q in range(4):
                total += corner[_PRISM[piece, q], k]
            out[k] += 0.25 * v * total


_PRISM = np.array([[0, 1, 2, 5], [0, 1, 4, 5], [0, 3, 4, 5]])


@plain
def _volume4(corner, piece):
    """Relative volume of the tetrahedron of four barycentric points, one piece of the prism."""
    p0, p1, p2, p3 = _PRISM[piece, 0], _PRISM[piece, 1], _PRISM[piece, 2], _PRISM[piece, 3]
    ax, ay, az = corner[p1, 1] - corner[p0, 1], corner[p1, 2] - corner[p0, 2], corner[p1, 3] - corner[p0, 3]
    bx, by, bz = corner[p2, 1] - corner[p0, 1], corner[p2, 2] - corner[p0, 2], corner[p2, 3] - corner[p0, 3]
    cx, cy, cz = corner[p3, 1] - corner[p0, 1], corner[p3, 2] - corner[p0, 2], corner[p3, 3] - corner[p0, 3]
    return ax * (by * cz - bz * cy) - ay * (bx * cz - bz * cx) + az * (bx * cy - by * cx)


@plain
def wet_moments(phi, out, corner):
    """∫_{φ<0} N_k / |e| (4,) of a cell with corner values phi (4,). corner (6, 4): work space."""
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
        _prism_moments(phi, a, b, c, d, out, corner)
    else:
        single = 0
        while (phi[single] < 0.0) != (n_wet == 1):
            single += 1
        corner_moments(phi, single, out)
        if n_wet == 3:
            for k in range(4):
                out[k] = 0.25 - out[k]


class FluidParts(NamedTuple):
    """Where water can be: cells (M, 4) · volume (M,) [m³] of their fluid part · share (M, 4), mean of N_a over it ·
    start (M + 1,), fan_volume (T,) [m³], corners (T, 4, 4): fans of the cut cells (`fans.py`)."""

    cells: np.ndarray
    volume: np.ndarray
    share: np.ndarray
    start: np.ndarray
    fan_volume: np.ndarray
    corners: np.ndarray


@inner
def part_moments(e, phi, parts, total, local, out, corner):
    """total (4,) <- ∫_{φ<0} N_a dV [m³] over the fluid part of cell e; phi (4,) at its corners; rest: work space.

    Exact: a whole cell by its corners, a cut one by the tetrahedra that fill it."""
    n_wet = 0
    for a in range(4):
        n_wet += phi[a] < 0.0
        total[a] = 0.0
    if n_wet == 0:
        return
    if n_wet == 4:
        for a in range(4):
            total[a] = parts.volume[e] * parts.share[e, a]
        return
    if parts.start[e] == parts.start[e + 1]:
        wet_moments(phi, out, corner)
        for a in range(4):
            total[a] = parts.volume[e] * out[a]
        return
    for t in range(parts.start[e], parts.start[e + 1]):
        for q in range(4):
            local[q] = 0.0
            for a in range(4):
                local[q] += parts.corners[t, q, a] * phi[a]
        wet_moments(local, out, corner)
        for q in range(4):
            weight = parts.fan_volume[t] * out[q]
            for a in range(4):
                total[a] += weight * parts.corners[t, q, a]


@njit(cache=True)
def nodal_water(cell_list, shift, phi, parts, n_nodes):
    """∫_{φ+shift<0} N_i dV (N,) [m³] over the listed cells of the FluidParts; phi (N,) [m]."""
    water = np.zeros(n_nodes)
    at, total, local, out, corner = np.empty(4), np.empty(4), np.empty(4), np.empty(4), np.empty((6, 4))
    cells, volume, share = parts.cells, parts.volume, parts.share
    for s in range(cell_list.shape[0]):
        e = cell_list[s]
        n_wet = 0
        for a in range(4):
            at[a] = phi[cells[e, a]] + shift
            n_wet += at[a] < 0.0
        if n_wet == 4:  # most cells: not worth a call
            for a in range(4):
                water[cells[e, a]] += volume[e] * share[e, a]
        elif n_wet > 0:
            part_moments(e, at, parts, total, local, out, corner)
            for a in range(4):
                water[cells[e, a]] += total[a]
    return water


@njit(cache=True)
def wet_fraction(cell_list, phi, parts):
    """Share of the fluid part of each listed cell with φ < 0, (n,)."""
    share = np.empty(cell_list.shape[0])
    at, total, local, out, corner = np.empty(4), np.empty(4), np.empty(4), np.empty(4), np.empty((6, 4))
    cells, start = parts.cells, parts.start
    for s in range(cell_list.shape[0]):
        e = cell_list[s]
        n_wet = 0
        for a in range(4):
            at[a] = phi[cells[e, a]]
            n_wet += at[a] < 0.0
        if n_wet == 4 and start[e] == start[e + 1]:
            share[s] = 1.0  # most cells: not worth a call
            continue
        part_moments(e, at, parts, total, local, out, corner)
        share[s] = min((total[0] + total[1] + total[2] + total[3]) / parts.volume[e], 1.0)
    return share


@njit(cache=True)
def cells_touching(marked, cells):
    """Numbers of the cells with at least one marked corner; marked (N,) bool."""
    found = np.empty(cells.shape[0], np.int64)
    n = 0
    for e in range(cells.shape[0]):
        if marked[cells[e, 0]] or marked[cells[e, 1]] or marked[cells[e, 2]] or marked[cells[e, 3]]:
            found[n] = e
            n += 1
    return found[:n].copy()


@njit(cache=True)
def touching_among(cell_list, marked, cells):
    """Those of the listed cells (k,) with at least one marked corner, in their order; marked (N,) bool."""
    found = np.empty(cell_list.shape[0], np.int64)
    n = 0
    for e in cell_list:
        if marked[cells[e, 0]] or marked[cells[e, 1]] or marked[cells[e, 2]] or marked[cells[e, 3]]:
            found[n] = e
            n += 1
    return found[:n].copy()
