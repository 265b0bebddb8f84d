"""Transport of the velocity by stabilised finite elements instead of along paths (`advection = "supg"`).

The change δ of each component f̂ over the step solves, by the Crank-Nicolson rule with the velocity c half a step
ahead,

    ∫ (v + τ c·∇v) [δ/dt + c·∇(f̂ + δ/2)] dV + j(δ, v)/dt + a(δ, v)/dt = 0     for every hat function v,       (1)
    τ = [(2/dt)² + (Σ_a |c·∇N_a|)²]^(-1/2)

over the fluid part of every cell of the band: the water and the layers around it where fields are continued.  The
terms are scikit-fem forms (`forms.py`) on the moment-matched rule of cut cells.  SUPG: Brooks and Hughes, Comput.
Methods Appl. Mech. Eng. 32 (1982) 199; τ: Tezduyar, Adv. Appl. Mech. 28 (1991) 1, with the element length along the
stream of Tezduyar and Park, CMAME 59 (1986) 307; τ ≤ dt/2, so that nothing in (1) grows on slivers.

c = u_m - dt/2 (u_m·∇)u_m: u_m, the velocity plus half a step of the acceleration, is that of the water which stands at
a node when the step begins; half a step later other water is there.  With u_m a dam break loses 3 % of its energy to
T = 3 at ten cells a column and Courant number 1, with c nothing.

j, the ghost penalty on the faces of cut cells (Burman, C. R. Math. 348 (2010) 1217), ties the change at a node that
owns next to no water to that of its neighbours; a leaves a sliver without neighbours as it was.  Both act on the change
only: what is steady stays.  δ = 0 where water enters the tank and at the rim of the band; where a side of the tank lies
along an axis, its normal component too.

New velocities are kept within the range of the old ones upstream, those of the node and of the cell from which its
water comes, as on paths: overshoots at an impact else add energy (7 % at six cells a column), and so does what lies
downstream (a sheet thinner than a cell that spreads over a bed doubled its kinetic energy in 40 steps).  Near the
surface, fast water and jumps follow the momentum of the volume (`surface_momentum.py`), as they do along paths: the
front of a dam break of three cells a column, a sheet of one cell, else gained 7 % of the energy.  The level set
stays on paths: it is a distance near the surface only and has a kink in every film, which (1) rounds off; a splash then
gains energy too (8 % at six cells a column), and the volume correction has more to do.  The pressure has its own
stabilisation (theory 2.6).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import LinearOperator, gmres, spilu
from skfem import asm

from fluid.numerics.solve import NotConverged
from fluid.transport import forms
from fluid.transport.advection import feet
from kernels.decorators import kernel

GHOST_PENALTY = 1e-4
"""Weight γ of the jumps across the faces of cut cells."""
ANCHOR = 1e-9
"""Mass that keeps a node where it was, as a share of that of its whole cells."""
SMALLEST_WEIGHT = 1e-9
"""Of a cell in the mean at a node, in h³."""
TOLERANCE = 1e-7
RESTART, MOST_RESTARTS = 40, 10
DROPPED, MOST_FILLED = 1e-3, 10
"""Of the incomplete factors: relative size of entries that are left out, most entries over those of the matrix."""
SWEEPS = 3
"""Fixed-point sweeps for the foot of a path."""
LEAST_WEIGHT = 1e-9
"""Of a corner in the foot of a path from which it counts as upstream."""


@dataclass(frozen=True)
class Band:
    """Cells of a physical domain whose corners are all listed, on their own nodes: what `forms.basis_of` needs.

    rows (m,) of the cells in the domain · members (n,), their nodes there · nodes (n, 3) [m] · cells (m, 4) · volume
    (m,) [m³], centroid (m, 3) [m], second (m, 6) [m⁵] of the fluid part · is_cut (m,)."""

    rows: np.ndarray
    members: np.ndarray
    nodes: np.ndarray
    cells: np.ndarray
    volume: np.ndarray
    centroid: np.ndarray
    second: np.ndarray
    is_cut: np.ndarray

    def centroid_of(self, rows) -> np.ndarray:
        """Centroids (k, 3) [m] of cells (k,)."""
        return self.centroid[rows]

    def second_of(self, rows) -> np.ndarray:
        """Second moments (k, 6) [m⁵] of cells (k,)."""
        return self.second[rows]

    @classmethod
    def of(cls, domain, listed) -> Band:
        """listed (n,): nodes of the domain."""
        is_listed = np.zeros(len(domain.nodes), bool)
        is_listed[listed] = True
        rows = np.flatnonzero(is_listed[domain.cells].all(axis=1))
        members, cells = np.unique(domain.cells[rows].astype(np.int64), return_inverse=True)
        d = domain
        of_cells = (d.volume[rows], d.centroid_of(rows), d.second_of(rows), d.is_cut[rows])
        return cls(rows, members, d.nodes[members], cells.reshape(-1, 4), *of_cells)


def midpoint_velocity(topology, band: Band, u_m, dt: float):
    """c (n, 3) [m/s] at the nodes of the band from u_m (n, 3) [m/s]."""
    t, rows = topology, band.rows
    weight = np.maximum(band.volume, SMALLEST_WEIGHT * t.size[rows] ** 3)
    share = t.share[t.share_row[rows]]
    return u_m - 0.5 * dt * _rate_along(band.cells, share, t.parent[rows], t.gradients, weight, u_m)


@kernel
def _rate_along(cells, share, parent, g, weight, u):
    """(u·∇)u (n, 3) at the nodes: mean over the cells around each by weight (m,), u (n, 3) at their centroids."""
    total, at_node = np.zeros_like(u), np.zeros(u.shape[0])
    mean, rate = np.empty(3), np.empty(3)
    for e in range(cells.shape[0]):
        mean[:] = 0.0
        for a in range(4):
            for k in range(3):
                mean[k] += share[e, a] * u[cells[e, a], k]
        rate[:] = 0.0
        for a in range(4):
            along = 0.0
            for k in range(3):
                along += mean[k] * g[parent[e], a, k]
            for k in range(3):
                rate[k] += along * u[cells[e, a], k]
        for a in range(4):
            at_node[cells[e, a]] += weight[e]
            for k in range(3):
                total[cells[e, a], k] += weight[e] * rate[k]
    for i in range(u.shape[0]):
        for k in range(3):
            total[i, k] /= at_node[i]
    return total


def stabilisation_time(c, gradients, dt: float):
    """τ (m,) [s] of cells from their mean velocity c (m, 3) [m/s] and gradients (m, 4, 3) [1/m]; at most dt/2."""
    crossed = np.abs(np.einsum("mk,mak->ma", c, gradients)).sum(axis=1)
    return 1.0 / np.hypot(2.0 / dt, crossed)


@dataclass(frozen=True)
class Transport:
    """Equation (1) times dt on the n nodes of a band: matrix δ = -dt advection f̂.

    matrix csr (n, n) [m³] · advection csr (n, n) [m³/s] · dt [s]."""

    matrix: sp.csr_array
    advection: sp.csr_array
    dt: float

    @classmethod
    def of(cls, topology, band: Band, c, dt: float) -> Transport:
        """c (n, 3) [m/s] at the nodes of the band."""
        gradients = topology.gradients[topology.parent[band.rows]]
        tau = stabilisation_time(c[band.cells].mean(axis=1), gradients, dt)
        basis = forms.basis_of(band)
        fields = {"c": forms.at_points(basis, c), "tau": forms.per_cell(basis, tau)}
        advection = forms.summed(basis, (forms.advection, forms.streamline_diffusion), **fields)
        rate = forms.summed(basis, (forms.mass, forms.streamline_rate), **fields)
        held = GHOST_PENALTY * ghost_penalty(topology, band) + anchor(topology, band)
        return cls(sp.csr_array(rate + 0.5 * dt * advection + held), sp.csr_array(advection), dt)

    def change(self, f, free):
        """δ (n, m) of f (n, m), zero where not free (n, m) bool. Raises NotConverged."""
        right = -self.dt * (self.advection @ f) * free
        inverse = 1.0 / self.matrix.diagonal()
        return np.column_stack([_solved(self.matrix, inverse, b, on) for b, on in zip(right.T, free.T)])


def _solved(matrix, inverse, right, free):
    """x (n,) with matrix x = right on the free rows, zero elsewhere; inverse (n,) of the diagonal scales the rows.

    GMRES with the diagonal. It stalls where nodes next to almost no water are tied to nothing but one another, by the
    ghost penalty: the sum of the two then hangs on the anchor alone. Incomplete factors contain such pairs.
    Raises NotConverged."""
    scaled = inverse * right
    size = np.linalg.norm(scaled)
    if size == 0.0:
        return np.zeros_like(right)
    apply = LinearOperator(matrix.shape, lambda v: free * inverse * (matrix @ (free * v)))
    x, info = gmres(apply, scaled, rtol=TOLERANCE, restart=RESTART, maxiter=MOST_RESTARTS)
    if info != 0:
        factors = _incomplete_factors(matrix, inverse, free)
        x, info = gmres(apply, scaled, rtol=TOLERANCE, restart=RESTART, maxiter=MOST_RESTARTS, M=factors)
    if info != 0:
        left = np.linalg.norm(scaled - apply @ x) / size
        raise NotConverged(
            f"the transport by stabilised elements stopped after {RESTART * MOST_RESTARTS} iterations at a residual of "
            f"{left:.3g}, wanted {TOLERANCE:.3g}, {len(x)} nodes; reduce time.cfl",
            np.array([left]),
        )
    return free * x


def _incomplete_factors(matrix, inverse, free):
    """Preconditioner (n, n) by incomplete factors of the free rows and columns, scaled by the diagonal."""
    rows = np.flatnonzero(free)
    factors = spilu(sp.csc_matrix((sp.diags_array(inverse) @ matrix)[rows][:, rows]), DROPPED, MOST_FILLED)

    def solve(v):
        out = np.zeros_like(v)
        out[rows] = factors.solve(v[rows])
        return out

    return LinearOperator(matrix.shape, solve)


def anchor(topology, band: Band):
    """a of (1): ANCHOR times the mass of the whole cells, lumped; diagonal (n, n) [m³]."""
    whole = band.volume / topology.fraction[band.rows]
    at_nodes = np.bincount(band.cells.ravel(), np.repeat(0.25 * whole, 4), minlength=len(band.nodes))
    return sp.diags_array(ANCHOR * at_nodes)


def ghost_penalty(topology, band: Band):
    """j of (1) without its weight: h⁵ [∇δ]·[∇v] over the faces that cut cells share with others, csr (n, n) [m³]."""
    one, other = _pairs_beside_cuts(topology, band)
    n = len(band.nodes)
    if len(one) == 0:
        return sp.csr_array((n, n))
    sides = forms.pair_bases(band, one, other, topology.size[band.rows[one]] ** 5)
    jumps = asm(forms.gradient_jump, sides, sides)
    jumps.resize((n, n))
    return sp.csr_array(jumps)


def _pairs_beside_cuts(topology, band):
    """Rows (k,), (k,) of the band's cells that share a face, the first one cut, each pair once."""
    place = np.full(len(topology.cells) + 1, -1)  # the last entry answers for "no neighbour", -1
    place[band.rows] = np.arange(len(band.rows))
    cut = np.flatnonzero(band.is_cut)
    other = place[topology.neighbours[band.rows[cut]]].ravel()
    one, other = np.repeat(cut, 4)[other >= 0], other[other >= 0]
    once = ~band.is_cut[other] | (one < other)
    return one[once], other[once]


def carried_velocity(water, dt: float, u_m, u_hat):
    """û (N, 3) [m/s] of a Water after dt [s] at its listed nodes, (n, 3); u_m (N, 3) [m/s] carries it."""
    t, band = water.topology, Band.of(water.domain, water.listed)
    members = band.members
    free = ~rim(water, u_m)[members, None] & _along_sides(water)[members]
    c = u_m.copy()
    c[members] = midpoint_velocity(t, band, u_m[members], dt)
    water.hold(c, water.time + 0.5 * dt, water.level_set < 0.0)
    old = u_hat[members]
    new = old + Transport.of(t, band, c[members], dt).change(old, free)
    moved = u_hat.copy()
    moved[members] = np.clip(new, *range_upstream(water, members, u_m, dt, u_hat))
    return moved[water.listed]


def range_upstream(water, members, u_m, dt: float, u):
    """Least and largest u (n, 3), (n, 3) [m/s] of each member (n,) among itself and the corners of the cell from which
    its water comes; u, u_m (N, 3) [m/s]: the field, and what carries it for dt [s]."""
    t = water.topology
    cell, weight = feet(members, -1.0, dt, SWEEPS, u_m, t.paths)
    there, counts = u[t.cells[cell]], (weight > LEAST_WEIGHT)[:, :, None]
    low, high = np.where(counts, there, np.inf).min(axis=1), np.where(counts, there, -np.inf).max(axis=1)
    return np.minimum(low, u[members]), np.maximum(high, u[members])


def rim(water, u_m):
    """(N,) bool: nodes at the rim of the band, and where the velocity u_m (N, 3) leads in from outside the tank."""
    sides, found = water.walls, np.zeros(len(u_m), bool)
    found[water.listed[water.layer_start[-2] :]] = True
    found[sides.flowing] = True
    inward = np.einsum("fak,fk->f", u_m[sides.open_faces], sides.open_area) < 0.0
    found[sides.open_faces[inward]] = True
    for sea in water.sides.now if water.sides is not None else ():
        across = np.einsum("nk,nk->n", u_m[sea.nodes], sea.normal)
        found[sea.nodes[across < 0.0]] = True
    return found


def _along_sides(water):
    """(N, 3) bool: components that closed sides of the tank leave free; of sides along no axis all."""
    free = np.ones((len(water.topology.nodes), 3), bool)
    diagonal = np.einsum("nkk->nk", water.walls.projector)
    free[water.walls.nodes] = diagonal > 1e-12
    return free
