"""Operators of the step as scikit-fem forms, one function a term: what the kernels must equal to round-off.

Those that the step itself assembles (stabilised transport) are in `fluid.transport.forms`.
"""

from __future__ import annotations

import numpy as np
from skfem import BilinearForm, CellBasis, ElementTetP1, ElementVector, LinearForm, MeshTet
from skfem.helpers import ddot, div, dot, grad, sym_grad

from fluid.domain.quadrature import quadrature_rule
from fluid.transport.forms import _mesh


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


@LinearForm
def push(q, w):
    """∫ q m·n dA [m²], m = w["m"] a direction (three numbers): how a body that moves along m pushes the water."""
    return q * sum(m * n for m, n in zip(w["m"], w["n"]))


@LinearForm
def twist(q, w):
    """∫ q m·((x - x_b) × n) dA [m³], x_b = w["centre"] (three numbers) [m]: how a body that turns about m does."""
    arm = w.x - np.reshape(w["centre"], (3, 1, 1))
    return q * sum(m * part for m, part in zip(w["m"], np.cross(arm, w["n"], axis=0)))


def vector_basis_of(domain) -> CellBasis:
    """The same for velocities: three P1 components."""
    return CellBasis(
        _mesh(domain.nodes, domain.cells), ElementVector(ElementTetP1()), quadrature=quadrature_rule(domain)
    )


def surface_basis(domain):
    """scikit-fem basis on the wetted polygons (one "cell" per polygon, three points) and the normals
    (3, S, 3) out of the bodies, to be passed to a form by keyword."""
    cells = domain.cells[domain.face_cell]
    corners = domain.nodes[cells]
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    offset = np.swapaxes(domain.face_points - corners[:, :1], 1, 2)
    X = np.moveaxis(np.linalg.solve(edges, offset), 1, 0)
    W = np.repeat((domain.face_area / 3 / np.abs(np.linalg.det(edges)))[:, None], 3, axis=1)
    mesh = MeshTet(domain.nodes.T.copy(), cells.T.astype(np.int64, order="C"), sort_t=False, validate=False)
    basis = CellBasis(mesh, ElementTetP1(), quadrature=(np.ascontiguousarray(X), W))
    return basis, np.repeat(domain.face_normal.T[:, :, None], 3, axis=2)


def vector_surface_basis_of(domain):
    """Velocities on the wetted polygons, one "cell" a polygon, and their normals (3, S, points) out of the bodies."""
    scalar, normal = surface_basis(domain)
    quadrature = (scalar.X, scalar.W)
    return CellBasis(scalar.mesh, ElementVector(ElementTetP1()), quadrature=quadrature), normal


def by_component(values):
    """Node vectors (N, 3) in the order of scikit-fem's degrees of freedom (3N,)."""
    return np.ascontiguousarray(values).ravel()
