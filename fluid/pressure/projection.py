"""Pressure: the matrix, its right hand side, and the correction of the velocity.

Mass balance with moving walls, for every hat function of a wet node (n out of the bodies, into the water):

    ∫ u·∇N_i dV = -(G V)_i,    u = u* - (dt/ρ) ∇x     ⇒     (dt/ρ) K x = ∫ u*·∇N_i dV + G V.              (1)

Free surface: p = 0 at the crossing of each wet-dry edge, ϑ_ij = φ_i / (φ_i - φ_j) from its wet end, so that the
dry value is x_j = x_i (1 - 1/ϑ_ij) and the row of i becomes (Gibou, Fedkiw, Cheng, Kang, J. Comput. Phys. 176
(2002) 205, on the edges of a finite element matrix)

    Σ_{j wet} k_ij (x_i - x_j) + Σ_{j dry} k_ij x_i / ϑ_ij,       k_ij = -K_ij.                              (2)

Symmetric; exact for a pressure that is linear in space, so a tilted tank at rest stays at rest.  ϑ is kept above
1e-7 only: the usual 1e-2 breaks that balance (0.2 m/s).

Velocity: u_i = u*_i - (dt/ρ) Σ_e w_e ∇x_e / Σ_e w_e with w_e = ∫ N_i over e times its wet share: weight without
water in it must not push (growth of 0.1 a step otherwise).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from array_types import Array, Bools, Floats, Integers, Ints
from fluid.domain.layers import WORK
from fluid.numerics.fields import accumulate, less, places_of
from kernels.decorators import kernel, ranged
from kernels.threads import over, owning, reach_of_cells

if TYPE_CHECKING:
    from fluid.pressure.waterline import WaterlineLoad

SMALLEST_CUT = 1e-7
SMALLEST_WET_SHARE = 1e-6
LEAST_RESERVE = 0.05
"""Share of what the diagonal of a row may lose behind obtuse angles that is to be left."""


@dataclass(frozen=True, kw_only=True)
class PressureProblem:
    """(dt/ρ) K x = rhs + G V for the unknown part x of the pressure; p = x + known acts on the bodies, with the load
    -Gᵀp + other_load.

    matrix csr (n, n) [m³/(s Pa)], SPD · rhs (n,) [m³/s], without body velocities · coupling csr (n, 6 n_bodies)
    [m², m³] · known (n,) [Pa] · guess (n,) [Pa] · dofs (n,) node of each unknown · dt [s] · density [kg/m³] ·
    other_load (n_bodies, 6) [N, N m]: loads beside that of the pressure (wall shear) and its correction
    at_waterline (n_bodies, 6), that of `waterline` for the pressure of the last step or for the one found
    (`waterline.py`) · bound (n,) [Pa]: lower bound of p = x + known, or None · at_bound (n,) bool: unknowns that the
    iteration first assumes to be at the bound (`bounded.py`)."""

    matrix: sp.csr_array
    rhs: Floats
    coupling: sp.csr_array
    known: Floats
    guess: Floats
    dofs: Ints
    dt: float
    density: float
    other_load: Floats
    waterline: WaterlineLoad | None = None
    at_waterline: Floats | float = 0.0
    predicted: Any = None
    """What the water keeps between predict and correct."""
    bound: Floats | None = None
    at_bound: Bools | None = None
    of_open_air: float = 0.0
    """Bound [Pa] where air can reach: that of the air outside, or of trapped air that has less."""
    pockets: int = 0
    """How many of the last unknowns are those of trapped air (`fluid.air.cushions`)."""

    @property
    def lower(self) -> Array | None:
        """Bound of x (n,) [Pa]."""
        return None if self.bound is None else less(self.bound, self.known)

    @property
    def air(self) -> Array | None:
        """Bound of x (n,) [Pa] where air is; none for what is air itself."""
        if self.bound is None:
            return None
        air = self.of_open_air - self.known
        air[len(air) - self.pockets :] = -np.inf
        return air

    def with_waterline_of(self, x) -> PressureProblem:
        """The problem whose other_load is that of the pressure x + known (n,) [Pa] at the water line, too."""
        if self.waterline is None:
            return self
        pressure = x + self.known
        there = self.waterline.of(self.of_water(self.dofs), self.of_water(pressure), self.of_air(pressure))
        return replace(self, other_load=self.other_load + (there - self.at_waterline), at_waterline=there)

    def load(self, x) -> Array:
        """Force and moment (n_bodies, 6) [N, N m] of the water on the bodies under the pressure x + known: -Gᵀp +
        other_load, with x = 0 the part that is known."""
        return self.other_load - (self.coupling.T @ (x + self.known)).reshape(-1, 6)

    def of_water(self, values) -> Array:
        """values (n, ...) of the unknowns, without those of trapped air."""
        return values[: values.shape[0] - self.pockets]

    def of_air(self, values) -> Array:
        """values (n, ...) of the unknowns of trapped air."""
        return values[values.shape[0] - self.pockets :]


class Rows(NamedTuple):
    """The matrix that is filled, csr: indptr (n + 1,), indices, entries · anchored (n,) bool: next to p = 0 · turned
    (n,): added to the diagonal."""

    indptr: Integers
    indices: Integers
    entries: Floats
    anchored: Bools
    turned: Floats


class AtSurface(NamedTuple):
    """level_set (N,) [m] · open_node (N,) bool: nodes on open sides, p = 0."""

    level_set: Floats
    open_node: Bools


class Outside(NamedTuple):
    """Nodal fields (N,) from which pressure is continued: pressure, and that of the air [Pa] · wet, open_node bool ·
    level_set [m]."""

    pressure: Floats
    air: Floats
    wet: Bools
    open_node: Bools
    level_set: Floats


class WetCells(NamedTuple):
    """Cells with water: rows (n,) · share (n,) of them that is water."""

    rows: Ints
    share: Floats


@ranged
def _row_lengths(first, last, dofs, column, edges, length):
    graph_row, start, neighbour, stiffness = edges
    for r in range(first, last):
        row = np.uint64(graph_row[np.uint64(dofs[r])])
        count = 1
        for s in range(start[row], start[row + np.uint64(1)]):
            count += stiffness[s] != 0.0 and column[neighbour[s]] >= 0
        length[r] = count


@ranged
def _wet_rows(first, last, dofs, column, edges, surface, scale, reserve, made):
    graph_row, start, neighbour, stiffness = edges
    phi, open_node = surface
    indptr, indices, entries, anchored, turned = made
    for place in range(first, last):
        r = np.uint64(place)
        i = np.uint64(dofs[r])
        row = np.uint64(graph_row[i])
        at = np.uint64(indptr[r])
        diagonal, beyond = 0.0, 0.0
        for s in range(start[row], start[row + np.uint64(1)]):
            j = neighbour[s]
            if stiffness[s] == 0.0:  # along half of the edges of a split brick
                continue
            k = -scale * stiffness[s]
            if column[j] >= 0:
                diagonal += k
                at += np.uint64(1)
                indices[at] = column[j]
                entries[at] = -k
            elif open_node[j]:
                diagonal += k
                anchored[r] = True
            elif phi[j] >= 0.0:  # a node under water without an unknown shares void cells only
                cut = max(phi[i] / (phi[i] - phi[j]), SMALLEST_CUT)
                diagonal += k / cut
                beyond += k / cut - k
                anchored[r] = True
        if beyond < 0.0 and -beyond > (1.0 - LEAST_RESERVE) * scale * reserve[i]:
            turned[r] = -2.0 * beyond
            diagonal += turned[r]
        indices[indptr[r]] = r
        entries[indptr[r]] = diagonal


def pressure_matrix(graph, phi, dofs, open_node, scale: float, reserve):
    """Equation (2) times scale = dt/ρ for the wet nodes dofs (n,): csr (n, n), (n,) bool next to p = 0, and (n,) what
    was added to the diagonal to keep it definite; that times the pressure belongs on the right hand side
    (`indefinite_cells.py`).

    open_node (N,) bool: nodes on open sides, p = 0 · reserve (N,) [m] of `obtuse.reserve`, zeros without obtuse cells.
    """
    column = places_of(dofs, len(phi))
    n, edges = len(dofs), graph.edges
    indptr = np.zeros(n + 1, np.int32)
    over(_row_lengths, n, dofs, column, edges, indptr[1:])
    accumulate(indptr)
    indices, entries = np.empty(indptr[n], np.int32), np.empty(indptr[n])
    anchored, turned = np.zeros(n, bool), np.zeros(n)
    made = Rows(indptr, indices, entries, anchored, turned)
    over(_wet_rows, n, dofs, column, edges, AtSurface(phi, open_node), scale, reserve, made)
    matrix = sp.csr_array((entries, indices, indptr), shape=(n, n))
    return matrix, anchored, turned


def pull_of_held(graph, dofs, held, scale: float):
    """-Σ_j K_ij x_j scale (n,) for the wet nodes dofs (n,): what nodes with a given pressure held (N,) [Pa] add to the
    right hand side; zero on all others."""
    return _pull(dofs, graph.edges, held, scale)


@kernel
def _pull(dofs, edges, held, scale):
    graph_row, start, neighbour, stiffness = edges
    out = np.zeros(dofs.shape[0])
    for r in range(dofs.shape[0]):
        row = graph_row[dofs[r]]
        for s in range(start[row], start[row + 1]):
            out[r] -= scale * stiffness[s] * held[neighbour[s]]
    return out


def cut_off(matrix, anchored) -> Array:
    """Rows (n,) bool of the components of a symmetric matrix without an anchored row."""
    return ~_reached(matrix.indptr, matrix.indices, anchored)


def seal_pockets(matrix, floating, volume, compliance, pressure):
    """Give water that is cut off from every surface a compressibility, since its pressure level is undetermined.

    Adds V_i · compliance [1/(Pa s)] to the diagonal of the `floating` rows (n,) bool and the same times `pressure` (n,)
    [Pa] to the right hand side, so that a state at rest is unchanged.  volume (n,) [m³].
    Returns (matrix, addition to the right hand side (n,))."""
    added = np.where(floating, volume * compliance, 0.0)
    return sp.csr_array(matrix + sp.diags_array(added)), added * pressure


def _reached(indptr, indices, seed):
    """Rows (n,) bool that the entries of a symmetric matrix connect to a row of the seed (n,) bool.

    By sweeps to and fro: rows of nearby nodes have nearby numbers, so that two or three reach all. Threads see what
    others have reached sooner or later; which rows are reached in the end does not depend on it."""
    reached, left, before = seed.copy(), len(seed), len(seed) + 1
    while 0 < left < before:
        before = left
        left = sum(over(_reach_on, len(seed), indptr, indices, reached, weight=WORK))
    return reached


@ranged
def _reach_on(first, last, indptr, indices, reached):
    """Mark rows of a range from its end and from its beginning; → how many are not reached."""
    left = 0
    for way in range(2):
        left = 0
        for k in range(last - first):
            i = np.uint64(first + k if way else last - 1 - k)
            if reached[i]:
                continue
            for s in range(indptr[i], indptr[i + np.uint64(1)]):
                if reached[np.uint64(indices[s])]:
                    reached[i] = True
                    break
            left += not reached[i]
        if left == 0:
            break
    return left


def cell_velocity(cell_list, u, remainder, fluid):
    """u at the centroid of the fluid part of the listed cells plus the remainder of the cell, (n, 3).

    remainder (n, 3), or (0, 3) for none · fluid: FluidCells"""
    out = np.empty((len(cell_list), 3))
    over(_cell_velocity, len(cell_list), cell_list, u, remainder, fluid, out)
    return out


@ranged
def _cell_velocity(first, last, cell_list, u, remainder, fluid, out):
    cells, share, share_row = fluid.cells, fluid.share, fluid.share_row
    for s in range(first, last):
        e = np.uint64(cell_list[s])
        row = share_row[e]
        t = np.uint64(s)
        x, y, z = 0.0, 0.0, 0.0
        if remainder.shape[0] > 0:
            x, y, z = remainder[t, 0], remainder[t, 1], remainder[t, 2]
        for a in range(4):
            i = cells[e, a]
            x += share[row, a] * u[i, 0]
            y += share[row, a] * u[i, 1]
            z += share[row, a] * u[i, 2]
        out[t, 0], out[t, 1], out[t, 2] = x, y, z


def inflow(cell_list, u_cell, fluid, n_nodes):
    """∫ u·∇N_i dV (N,) [m³/s] over the listed cells, u_cell (n, 3) one velocity each: exact for P1 velocities.

    fluid: FluidCells"""
    out = np.empty(n_nodes)
    reach = reach_of_cells(cell_list, fluid.cells)
    owning(_inflow, n_nodes, reach, len(cell_list), cell_list, u_cell, fluid, out)
    return out


@ranged
def _inflow(first, last, runs, cell_list, u_cell, fluid, out):
    cells, parent, g, volume = fluid.cells, fluid.parent, fluid.gradients, fluid.volume
    for i in range(first, last):
        out[np.uint64(i)] = 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[s])
            p, t, size = parent[e], np.uint64(s), volume[e]
            x, y, z = u_cell[t, 0], u_cell[t, 1], u_cell[t, 2]
            for a in range(4):
                i = cells[e, a]
                if first <= i < last:
                    out[i] += size * (x * g[p, a, 0] + y * g[p, a, 1] + z * g[p, a, 2])


def with_ghosts(pressure, air, wet, open_node, phi, cell_list, cells, volume):
    """Pressure (N,) continued to the dry corners of the listed cells through that of the air (N,) at the surface:

    p_j = a_j + φ_j Σ_e |e| Σ_i (p_i - a_j) φ_i / Σ_e |e| Σ_i φ_i²,    over the wet corners i of the cells e at j.

    volume (M,) [m³]: |e| of the fluid part. With each cell counted alike, the water of a crack of a thousandth of the
    room, at 3 MPa as its sides met, pushed the surface beside the crack with that pressure: 12 J in one step."""
    n = len(pressure)
    out, up, down = np.empty(n), np.empty(n), np.empty(n)
    state = Outside(pressure, air, wet, open_node, phi)
    reach = reach_of_cells(cell_list, cells)
    owning(_with_ghosts, n, reach, len(cell_list), cell_list, state, cells, volume, (up, down), out)
    return out


@ranged
def _with_ghosts(first, last, runs, cell_list, state, cells, volume, sums, out):
    pressure, air, wet, open_node, phi = state
    up, down = sums
    for k in range(first, last):
        j = np.uint64(k)
        up[j], down[j] = 0.0, 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[np.uint64(s)])
            if wet[cells[e, 0]] and wet[cells[e, 1]] and wet[cells[e, 2]] and wet[cells[e, 3]]:
                continue
            for a in range(4):
                j = cells[e, a]
                if wet[j] or not first <= j < last:
                    continue
                above, below, outside, size = up[j], down[j], air[j], volume[e]
                for b in range(4):
                    i = cells[e, b]
                    if wet[i] and not open_node[i]:
                        above += size * (pressure[i] - outside) * phi[i]
                        below += size * phi[i] * phi[i]
                up[j], down[j] = above, below
    for k in range(first, last):
        j = np.uint64(k)
        out[j] = pressure[j]
        if not wet[j]:
            out[j] = air[j] + (phi[j] * up[j] / down[j] if down[j] > 0.0 else 0.0)


def cell_gradient(cell_list, f, cells, parent, g, scale: float = 1.0):
    """scale ∇f (n, 3) of nodal f (N,) in the listed cells."""
    out = np.empty((len(cell_list), 3))
    over(_cell_gradient, len(cell_list), cell_list, f, cells, parent, g, scale, out)
    return out


@ranged
def _cell_gradient(first, last, cell_list, f, cells, parent, g, scale, out):
    for place in range(first, last):
        s = np.uint64(place)
        e = np.uint64(cell_list[s])
        p, x, y, z = parent[e], 0.0, 0.0, 0.0
        for a in range(4):
            value = f[cells[e, a]]
            x += value * g[p, a, 0]
            y += value * g[p, a, 1]
            z += value * g[p, a, 2]
        out[s, 0], out[s, 1], out[s, 2] = x * scale, y * scale, z * scale


def nodal_mean(wet, value, fluid, n_nodes):
    """Σ_e w_e value_e / Σ_e w_e (N, 3), w_e = volume_e share_ea wet_e; value (n, 3) of the WetCells."""
    out, weight = np.empty((n_nodes, 3)), np.empty(n_nodes)
    reach = reach_of_cells(wet.rows, fluid.cells)
    owning(_nodal_mean, n_nodes, reach, len(wet.rows), wet, value, fluid, weight, out)
    return out


@ranged
def _nodal_mean(first, last, runs, wet, value, fluid, weight, out):
    cell_list, wet_share = wet
    cells, share, share_row, volume = fluid.cells, fluid.share, fluid.share_row, fluid.volume
    for j in range(first, last):
        i = np.uint64(j)
        weight[i], out[i, 0], out[i, 1], out[i, 2] = 0.0, 0.0, 0.0, 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e, t = np.uint64(cell_list[s]), np.uint64(s)
            w, row = volume[e] * max(wet_share[t], 1e-6), share_row[e]
            x, y, z = value[t, 0], value[t, 1], value[t, 2]
            for a in range(4):
                i = cells[e, a]
                if first <= i < last:
                    wa = w * max(share[row, a], 1e-9)
                    weight[i] += wa
                    out[i, 0], out[i, 1], out[i, 2] = (
                        out[i, 0] + wa * x,
                        out[i, 1] + wa * y,
                        out[i, 2] + wa * z,
                    )
    for j in range(first, last):
        i = np.uint64(j)
        if weight[i] > 0.0:
            for k in range(3):
                out[i, k] /= weight[i]
