"""The operators of the step as scikit-fem forms, one function a term.

Used in set-up and verification: the kernels of the step work on the same arrays and equal these forms to
round-off.  Integration over the fluid part of cut cells comes from fluid.domain.quadrature_rule, so that

    basis = basis_of(domain)
    K = stiffness.assemble(basis)                          ∫ ∇p·∇q dV                      [m]
    b = inflow.assemble(basis, u=basis_vector.interpolate(u))
"""

from __future__ import annotations

import numpy as np
from skfem import BilinearForm, CellBasis, ElementTetP1, ElementVector, LinearForm, MeshTet
from skfem.helpers import div, dot, grad

from fluid.quadrature import quadrature_rule


@BilinearForm
def stiffness(p, q, w):
    """∫ ∇p·∇q dV: the pressure matrix without its factor dt/ρ."""
    return dot(grad(p), grad(q))


@LinearForm
def inflow(q, w):
    """∫ u·∇q dV of the velocity w["u"]: the right hand side of the pressure."""
    return dot(w["u"], grad(q))


@LinearForm
def lumped(q, w):
    """∫ q dV: volume of each node."""
    return q


@LinearForm
def pressure_gradient(v, w):
    """∫ ∇p·v dV of the pressure w["p"]: what the pressure takes off ρ u, weighted by the hats."""
    return dot(grad(w["p"]), v)


@LinearForm
def grad_div(v, w):
    """∫ l² (div u)(div v) dV of the velocity w["u"], l (cells, points) [m]: the divergence damping (LSIC)."""
    return w["l"] ** 2 * div(w["u"]) * div(v)


def basis_of(domain) -> CellBasis:
    """P1 on the fluid part of every cell of a PhysicalDomain."""
    return CellBasis(_mesh(domain), ElementTetP1(), quadrature=quadrature_rule(domain))


def vector_basis_of(domain) -> CellBasis:
    """The same for velocities: three P1 components."""
    return CellBasis(_mesh(domain), ElementVector(ElementTetP1()), quadrature=quadrature_rule(domain))


def _mesh(domain) -> MeshTet:
    return MeshTet(domain.nodes.T.copy(), domain.cells.T.copy(), sort_t=False, validate=False)


def by_component(values):
    """Node vectors (N, 3) in the order of scikit-fem's degrees of freedom (3N,)."""
    return np.ascontiguousarray(values).ravel()
