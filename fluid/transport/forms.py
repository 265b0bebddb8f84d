"""Stabilised transport (`supg.py`) as scikit-fem forms, one function a term, and the bases they are assembled on.

    basis = basis_of(domain)
    M = mass.assemble(basis)                               ∫ f v dV                        [m³]
    b = advection.assemble(basis, c=at_points(basis, u))

Integration over the fluid part of cut cells comes from `fluid.domain.quadrature`.  v: test function; every component of
the velocity obeys the same scalar equation.
"""

from __future__ import annotations

import numpy as np
from skfem import BilinearForm, CellBasis, ElementTetP1, MeshTet
from skfem.helpers import dot, grad

from fluid.domain.quadrature import cell_basis


@BilinearForm
def mass(f, v, w):
    """∫ f v dV [m³]: rate of a transported f, times dt."""
    return f * v


@BilinearForm
def advection(f, v, w):
    """∫ (c·∇f) v dV [m³/s], c = w["c"] [m/s] the velocity that carries: Galerkin's term."""
    return dot(w["c"], grad(f)) * v


@BilinearForm
def streamline_rate(f, v, w):
    """∫ τ (c·∇v) f dV [m³], τ = w["tau"] [s]: the SUPG weight on the rate (Brooks and Hughes, CMAME 32 (1982) 199)."""
    return w["tau"] * dot(w["c"], grad(v)) * f


@BilinearForm
def streamline_diffusion(f, v, w):
    """∫ τ (c·∇v)(c·∇f) dV [m³/s]: the SUPG weight on the advection, a diffusion τ c² along the stream only."""
    return w["tau"] * dot(w["c"], grad(v)) * dot(w["c"], grad(f))


@BilinearForm
def gradient_jump(f, v, w):
    """±∇f·∇v on `pair_bases`, the sign from the sides w.idx of f and v, so that the sum over both sides is s [∇f]·[∇v]
    with the weight s of the pair: the ghost penalty of P1, whose jump is normal to the face (Burman, C. R. Math. 348
    (2010) 1217)."""
    return (-1.0) ** (w.idx[0] + w.idx[1]) * dot(grad(f), grad(v))


def basis_of(domain) -> CellBasis:
    """P1 on the fluid part of every cell of a PhysicalDomain."""
    return cell_basis(domain)


def pair_bases(domain, one, other, weight):
    """Bases (one side, other side) on pairs of neighbouring cells, rows one (k,) and other (k,), for forms over both:
    a single point a cell, which counts weight (k,)."""
    return [_one_point_basis(domain.nodes, domain.cells[rows], weight) for rows in (one, other)]


def _one_point_basis(nodes, cells, weight):
    edges = nodes[cells[:, 1:]] - nodes[cells[:, :1]]
    W = (weight / np.abs(np.linalg.det(edges)))[:, None]
    return CellBasis(_mesh(nodes, cells), ElementTetP1(), quadrature=(np.full((3, len(cells), 1), 0.25), W))


def _mesh(nodes, cells) -> MeshTet:
    return MeshTet(nodes.T.copy(), cells.T.copy(), sort_t=False, validate=False)


def summed(basis, terms, **fields):
    """Sum of bilinear forms, assembled in one pass: csr (n, n)."""
    return BilinearForm(lambda f, v, w: sum(term.form(f, v, w) for term in terms)).assemble(basis, **fields)


def at_points(basis, u):
    """P1 velocity u (N, 3) at the points of a scalar basis (3, cells, points)."""
    return np.stack([np.asarray(basis.interpolate(u[:, k])) for k in range(3)])


def per_cell(basis, values):
    """Values (M,) of the cells at the points of the basis (M, points)."""
    return np.repeat(values[:, None], basis.X.shape[-1], axis=-1)
