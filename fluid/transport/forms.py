"""The operators of the step as scikit-fem forms, one function a term.

Transport by stabilised elements (`supg.py`) is assembled from them in the loop.  The others are the reference: the
kernels of the step work on the same arrays and equal these forms to round-off.  Integration over the fluid part of cut
cells comes from fluid.domain.quadrature, so that

    basis = basis_of(domain)
    K = stiffness.assemble(basis)                          ∫ ∇p·∇q dV                      [m]
    b = inflow.assemble(basis, u=at_points(basis, u))

Test functions are q (scalar) and v (vector; scalar in transport, where every component obeys the same equation).
"""

from __future__ import annotations

import numpy as np
from skfem import BilinearForm, CellBasis, ElementTetP1, ElementVector, LinearForm, MeshTet
from skfem.helpers import ddot, div, dot, grad, sym_grad

from fluid.domain.quadrature import cell_basis, quadrature_rule, surface_basis

# ---- pressure


@BilinearForm
def stiffness(p, q, w):
    """∫ ∇p·∇q dV [m]: the pressure matrix without its factor dt/ρ."""
    return dot(grad(p), grad(q))


@LinearForm
def inflow(q, w):
    """∫ u·∇q dV [m³/s] of the velocity w["u"]: the right hand side of the pressure."""
    return dot(w["u"], grad(q))


@LinearForm
def lumped(q, w):
    """∫ q dV [m³]: volume of each node."""
    return q


@LinearForm
def pressure_gradient(v, w):
    """∫ ∇p·v dV [N] of the pressure w["p"]: what the pressure takes off ρ u, weighted by the hats."""
    return dot(grad(w["p"]), v)


@LinearForm
def pspg(q, w):
    """-∫ τ R·∇q dV [m³/s], R = w["R"] [m/s²] the momentum that the nodes leave unbalanced, τ = w["tau"] [s]: pressure
    stabilising term of the mass balance (Hughes, Franca and Balestra, Comput. Methods Appl. Mech. Eng. 59 (1986) 85;
    Tezduyar, Mittal, Ray and Shih, CMAME 95 (1992) 221).

    The projection holds it: with R = (∇x - Π∇x)/ρ and τ = dt it is what tells the balance of the cells,
    ∫ (u* - dt/ρ ∇x)·∇q = 0, from that of the nodal velocity u* - dt/ρ Π∇x."""
    return -w["tau"] * dot(w["R"], grad(q))


@LinearForm
def grad_div(v, w):
    """∫ l² (div u)(div v) dV [m³/s] of the velocity w["u"], l = w["l"] (cells, points) [m]: the divergence damping
    (LSIC with ν = c l²/dt; Tezduyar and Osawa, CMAME 190 (2000) 411)."""
    return w["l"] ** 2 * div(w["u"]) * div(v)


# ---- transport


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


# ---- viscosity


@BilinearForm
def viscous(u, v, w):
    """∫ 2μ ε(u):ε(v) dV [N s/m], μ = w["mu"] [Pa s]."""
    return 2.0 * w["mu"] * ddot(sym_grad(u), sym_grad(v))


@BilinearForm
def nitsche(u, v, w):
    """∫ [-t(u)·v - u·t(v) + λ u·v] dA over the wetted faces of bodies at rest, t(u) = -2μ ε(u) n: holds u = 0 there.

    n = w["n"] (3, faces, points) out of the body, λ = w["penalty"] (faces, points) [kg/(m² s)] (Nitsche 1971)."""
    t_u, t_v = (-2.0 * w["mu"] * np.einsum("ij...,j...->i...", sym_grad(f), w["n"]) for f in (u, v))
    return -dot(t_u, v) - dot(u, t_v) + w["penalty"] * dot(u, v)


# ---- wetted faces


@LinearForm
def push(q, w):
    """∫ q m·n dA [m²], m = w["m"] a direction (three numbers): how a body that moves along m pushes the water."""
    return q * sum(m * n for m, n in zip(w["m"], w["n"]))


@LinearForm
def twist(q, w):
    """∫ q m·((x - x_b) × n) dA [m³], x_b = w["centre"] (three numbers) [m]: how a body that turns about m does."""
    arm = w.x - np.reshape(w["centre"], (3, 1, 1))
    return q * sum(m * part for m, part in zip(w["m"], np.cross(arm, w["n"], axis=0)))


# ---- bases and fields


def basis_of(domain) -> CellBasis:
    """P1 on the fluid part of every cell of a PhysicalDomain."""
    return cell_basis(domain)


def vector_basis_of(domain) -> CellBasis:
    """The same for velocities: three P1 components."""
    return CellBasis(
        _mesh(domain.nodes, domain.cells), ElementVector(ElementTetP1()), quadrature=quadrature_rule(domain)
    )


def vector_surface_basis_of(domain):
    """Velocities on the wetted polygons, one "cell" a polygon, and their normals (3, S, points) out of the bodies."""
    scalar, normal = surface_basis(domain)
    quadrature = (scalar.X, scalar.W)
    return CellBasis(scalar.mesh, ElementVector(ElementTetP1()), quadrature=quadrature), normal


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


def by_component(values):
    """Node vectors (N, 3) in the order of scikit-fem's degrees of freedom (3N,)."""
    return np.ascontiguousarray(values).ravel()
