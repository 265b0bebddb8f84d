"""Films of water under blocks: they transmit the pressure at their rim and exert no other force.

A block that lies on the bed or on another block leaves a film of almost no volume.  Resolved as cells of the mesh, such
a film is correct at rest, where it transmits the pressure at its rim whatever its thickness. But the water that a
lifted block has to draw in has no room to flow through it, so that the film holds the block down (or stops a falling
one) by

    G_f V_n · A_ff⁻¹ G_f V_n                                                                              (1)

(f: nodes whose cells lie in films but for slivers of water on other faces, A: the pressure matrix), the inertia of a
sheet of no thickness.  The
behaviour of a real film depends on the roughness of both faces and not on the cells.  So (1) is left out: in films
narrower than NARROW h the pressure follows from that of the water around, r, and from the weight of the film,

    p_f = R p_r + c,     R = -A_ff⁻¹ A_fr,     c = A_ff⁻¹ ∫ dt g·∇N_f dV                                   (2)

and the volume that a moving block sets free is drawn in at the rim, Ĝ_r = G_r + Rᵀ G_f, Ĝ_f = 0, the exact adjoint:
with Ĝ instead of G and the load -G_fᵀ c besides, the system with the structure inside stays symmetric and positive
definite, and the power that leaves the water is that given to the blocks.  Matrix and right hand side stay as they are:
the water of the film keeps the balance of its mass beside bodies at rest.  With (2) in the rows of the film in place of
that, what its cells brought to the rim or took there had no source: twelve light blocks that came apart under water
gained as much energy as they had set free.  The volume that the rim loses goes to the film,

    dW_r/dt = (Rᵀ G_f V)_r,     dW_f/dt = -(R 1)_f (G_f V)_f.                                             (3)

A film that touches no other water keeps its own balance.  A face may receive only a share of the
pressure (uplift of contacts and joints that keep part of the water out): its polygons in films then count in G with
that share.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from array_types import Bools, Floats, Ints
from fluid.cut.facing import facing
from fluid.domain.coupling_matrix import wetted_coupling
from fluid.pressure.projection import inflow
from fluid.surface.level_set import FAR
from kernels.decorators import kernel

NARROW = 0.25
"""Widest film, in cells: narrower ones are no channels that the mesh could see."""
SLIVER = 0.5
"""Thickest water, in cells, on faces that lie in no film, that leaves a node to the film."""
SHEET = 1e-3
"""Thickness of water, in cells, up to which it is a film whatever lies before it: more than drawn in faces leave."""
THIN = 0.01
"""Room of a film, in cells, besides that by which bodies are drawn in, up to which it fills with water at once."""


@dataclass(frozen=True)
class Films:
    """Films of a domain. node (N,) bool: all cells around it lie in films, or hold
    but slivers of other water (SLIVER) · thinned csr (N, 6 n_bodies): reduction of
    G by shares below 1 · drawn_in (S,) [m]: how far the plane of each wetted polygon is cut within its body ·
    thin: the parts of films without room for water."""

    node: Bools
    thinned: sp.csr_array
    drawn_in: Floats
    thin: ThinFilms

    @classmethod
    def of(cls, domain, topology, loose, share) -> Films:
        """The films between loose bodies (n_bodies,) bool and whatever lies opposite to their faces: other bodies, or
        the sides of the box around the mesh.

        share: PartlyWet, of the pressure that acts on the planes of the bodies where they face a film."""
        bodies, mesh = domain.memory.bodies, domain.memory.mesh
        reach = NARROW * mesh.local_size[domain.parent_cell]
        polygons = (domain.face_body, domain.face_centroid, domain.face_normal)
        in_film, plane = facing(bodies, polygons, reach[domain.face_cell], mesh.bounds, loose)
        films, thin = _film_cells(
            domain.face_cell, domain.face_area, in_film, domain.volume, reach, SLIVER / NARROW, SHEET / NARROW
        )
        node = _in_films(topology.node_start, topology.node_cells, films, thin)
        partly = np.flatnonzero(in_film & np.isin(plane, share.plane))
        kept_out = 1.0 - share.at(plane[partly], domain.face_centroid[partly])
        thinned = sp.csr_array(wetted_coupling(domain, partly, kept_out))
        drawn_in = np.maximum(-bodies.growth[plane], 0.0)
        return cls(node, thinned, drawn_in, ThinFilms.of(domain, topology, in_film, drawn_in, films))

    def handed_on(self, water, problem):
        """The PressureProblem in which films transmit the pressure at their rim; the same one if no film takes part."""
        p, dofs = problem, problem.dofs
        coupling = p.coupling if self.thinned.nnz == 0 else sp.csr_array(p.coupling - self.thinned[dofs])
        film = _with_a_rim(p.matrix, self.node[dofs])
        if not film.any():
            return replace(p, coupling=coupling)
        f = np.flatnonzero(film)
        rows, weight = p.matrix[f], self._weight(water, p)[dofs[f]]
        beside = np.zeros(len(film), bool)
        beside[rows.indices] = True
        r = np.flatnonzero(beside & ~film)
        rim, moved = sp.csr_array(rows[:, r]), sp.csr_array(coupling[f])
        columns = np.unique(moved.indices)
        moved = moved[:, columns]
        solved = _solved(
            sp.csr_array(rows[:, f]), np.column_stack([moved.toarray(), weight, -rim.sum(axis=1)])
        )
        shape = coupling.shape
        to_rim = _placed(-(rim.T @ solved[:, :-2]), r, columns, shape)
        offset, whole = solved[:, -2], solved[:, -1]
        load = np.zeros(shape[1])
        load[columns] = -(moved.T @ offset)
        bound, at_bound = p.bound, p.at_bound
        if bound is not None:
            bound, at_bound = bound.copy(), at_bound.copy()
            bound[f], at_bound[f] = water.parameters.vapour_pressure, False
        return replace(
            p,
            coupling=sp.csr_array(coupling - _placed(moved, f, columns, shape) + to_rim),
            other_load=p.other_load + load.reshape(-1, 6),
            bound=bound,
            at_bound=at_bound,
            predicted=replace(
                p.predicted,
                given_by_films=to_rim - _placed(sp.diags_array(whole) @ moved, f, columns, shape),
                in_film=film,
            ),
        )

    def _weight(self, water, problem):
        """∫ dt g·∇N dV (N,) [m³/s] at the nodes in films."""
        t, kept = water.topology, problem.predicted
        cells = t.cells_around(self.node)
        if len(kept.void):
            cells = np.setdiff1d(cells, kept.void, assume_unique=True)
        g = np.broadcast_to(problem.dt * water.parameters.weight, (len(cells), 3))
        return inflow(cells, g, t.fluid_cells, len(self.node))


@dataclass(frozen=True)
class ThinFilms:
    """Films without room for water of their own: wet at once wherever water stands higher at their rim.

    node (n,) · part (n,) of it, of the connected ones · rim (m,): nodes beside, beside (m,): the part each touches ·
    cell (k,): their cells, in order. Their water hands on the pressure and stands still: moved by it, it squirted out
    of the film at the dry foot of a dam with all of the head, and carried the surface, which cannot be as thin as the
    jet, along with it.

    Else they fill as the level set runs along them: a dam of 1 m with water on one side had a third of its uplift
    after 0.3 s, and as long as the film was dry, the surface of this water lay at the heel of the dam."""

    node: Ints
    part: Ints
    rim: Ints
    beside: Ints
    cell: Ints

    @classmethod
    def of(cls, domain, topology, in_film, drawn_in, films) -> ThinFilms:
        """films (M,) bool: cells in films · in_film (S,) bool, drawn_in (S,) [m] of the wetted polygons."""
        area = domain.face_area * in_film
        covered = np.bincount(domain.face_cell, area, len(films))
        room = domain.volume - np.bincount(domain.face_cell, domain.face_area * drawn_in, len(films))
        thin = films & (room <= THIN * topology.size * covered)
        found = _all_around(topology.node_start, topology.node_cells, thin)
        node = np.flatnonzero(found)
        if len(node) == 0:
            return cls(node, node, node, node, np.flatnonzero(thin))
        start, around = topology.around
        first, last = (start[at].astype(np.int64) for at in (node, node + 1))
        row = np.repeat(np.arange(len(node)), last - first)
        other = np.concatenate([around[a:b] for a, b in zip(first, last)]).astype(np.int64)
        place = np.full(len(found), -1)
        place[node] = np.arange(len(node))
        inner = found[other]
        links = sp.csr_array(
            (np.ones(inner.sum()), (row[inner], place[other[inner]])), (len(node), len(node))
        )
        part = connected_components(links, directed=False)[1]
        pairs = np.unique(np.column_stack([other[~inner], part[row[~inner]]]), axis=0)
        return cls(node, part, pairs[:, 0], pairs[:, 1], np.flatnonzero(thin))

    def filled(self, phi, height, size, among=None) -> tuple[Floats, Ints]:
        """φ (N,) [m] with water wherever the rim of a film holds some to a higher level, and the nodes that this made
        wet; the same φ if there are none. height (N,) [m] above any level · size (N,) [m] of the cells · among (k,):
        nodes that may be filled, None: all."""
        wet = phi[self.rim] < 0.0
        if not wet.any():
            return phi, np.zeros(0, np.int64)
        rim, level = self.rim[wet], np.full(self.part.max() + 1, -np.inf)
        np.maximum.at(level, self.beside[wet], height[rim] - phi[rim])
        depth = level[self.part] - height[self.node]
        found = (depth > 0.0) & (phi[self.node] >= 0.0)
        if among is not None and found.any():
            may = np.zeros(len(phi), bool)
            may[among] = True
            found &= may[self.node]
        node = self.node[found]
        if len(node) == 0:
            return phi, node
        phi = phi.copy()
        phi[node] = -np.clip(depth[found], LEAST_DEPTH * size[node], FAR * size[node])
        return phi, node


LEAST_DEPTH = 1e-3
"""Least -φ in cells of nodes of films that have filled."""


def _placed(block, rows, columns, shape):
    """A block (k, c) as the listed rows (k,) and columns (c,) of a larger sparse matrix."""
    b = sp.coo_array(block)
    return sp.csr_array((b.data, (rows[b.row], columns[b.col])), shape=shape)


def _with_a_rim(matrix, film):
    """(n,) bool: nodes in films, without the parts that touch no other unknown."""
    f = np.flatnonzero(film)
    if len(f) == 0:
        return film
    rows = matrix[f]
    _, part = connected_components(rows[:, f], directed=False)
    beside = np.asarray(abs(rows) @ (~film).astype(float)) > 0.0
    rimmed = np.zeros(part.max() + 1, bool)
    rimmed[part[beside]] = True
    found = np.zeros(len(film), bool)
    found[f[rimmed[part]]] = True
    return found


def _solved(own, right):
    """own⁻¹ right (k, m) for the sparse positive definite matrix of the film nodes (k, k), film by film."""
    count, part = connected_components(own, directed=False)
    order = np.argsort(part, kind="stable")
    start = np.searchsorted(part[order], np.arange(count + 1))
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order)) - start[part[order]]
    out = np.zeros(right.shape)
    for p in range(count):
        rows = order[start[p] : start[p + 1]]
        used = np.flatnonzero(right[rows].any(axis=0))
        chosen = np.ix_(rows, used)
        if len(rows) <= LARGE:
            block = _block(own.indptr, own.indices, own.data, rows, part, place)
            out[chosen] = np.linalg.solve(block, right[chosen])
        else:
            out[chosen] = sp.linalg.splu(sp.csc_array(own[rows][:, rows])).solve(right[chosen])
    return out


LARGE = 300
"""Unknowns of a film from which it is solved as a sparse matrix."""


@kernel
def _block(indptr, indices, data, rows, part, place):
    """Rows (k,) of a csr matrix that are one part, and its columns, as a full matrix (k, k); place: of each row among
    those of its part."""
    block = np.zeros((len(rows), len(rows)))
    for i in range(len(rows)):
        for s in range(indptr[rows[i]], indptr[rows[i] + 1]):
            if part[indices[s]] == part[rows[i]]:
                block[i, place[indices[s]]] += data[s]
    return block


@kernel
def _film_cells(face_cell, area, in_film, volume, reach, beside, sheet):
    """films (M,) bool: cells whose polygons all lie in films, and whose water lies within reach (M,) [m] of them, and
    those whose water is a sheet on any faces (SHEET); thin (M,) bool: cells whose water is a sliver on any faces
    (SLIVER)."""
    n_cells = len(volume)
    covered, other = np.zeros(n_cells), np.zeros(n_cells)
    for s in range(face_cell.shape[0]):
        if in_film[s]:
            covered[face_cell[s]] += area[s]
        else:
            other[face_cell[s]] += area[s]
    films, thin = np.zeros(n_cells, np.bool_), np.zeros(n_cells, np.bool_)
    for e in range(n_cells):
        films[e] = covered[e] > 0.0 and other[e] == 0.0 and volume[e] <= reach[e] * covered[e]
        films[e] = films[e] or volume[e] <= sheet * reach[e] * (covered[e] + other[e])
        thin[e] = volume[e] <= reach[e] * (covered[e] + beside * other[e])
    return films, thin


@kernel
def _in_films(node_start, node_cells, films, thin):
    """(N,) bool: nodes with cells in films, films (M,) bool, and else only slivers, thin (M,) bool."""
    found = np.zeros(node_start.shape[0] - 1, np.bool_)
    for i in range(found.shape[0]):
        every, some = True, False
        for t in range(node_start[i], node_start[i + 1]):
            every = every and (films[node_cells[t]] or thin[node_cells[t]])
            some = some or films[node_cells[t]]
        found[i] = every and some
    return found


@kernel
def _all_around(node_start, node_cells, chosen):
    """(N,) bool: nodes with cells, all of them chosen (M,) bool."""
    found = np.zeros(node_start.shape[0] - 1, np.bool_)
    for i in range(found.shape[0]):
        every = node_start[i + 1] > node_start[i]
        for t in range(node_start[i], node_start[i + 1]):
            every = every and chosen[node_cells[t]]
        found[i] = every
    return found
