"""Moment-matched rules: exact to degree 2 on every part, and scikit-fem's forms built on them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skfem import BilinearForm, LinearForm
from skfem.helpers import dot, grad

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain, wetted_coupling
from fluid.domain.quadrature import cell_basis, quadrature_rule
from fluid.mesh.background import box_mesh
from fluid.mesh.gradients import gradients
from tests.fluid import reference_forms

MESH = box_mesh((0, 0, 0), (1, 1, 1), 1 / 6)
BODIES = ConvexBodies.boxes(
    [[0.4, 0.45, 0.5], [0.62, 0.55, 0.4], [0.5, 0.5, 0.9]],
    [[0.3, 0.2, 0.4], [0.02, 0.5, 0.3], [2.0, 2.0, 0.1 + 2e-9]],
    Rotation.from_euler("xyz", [[0.3, 0.5, 0.7], [0.1, 0.0, 0.4], [0, 0, 0]]).as_matrix(),
)


@pytest.fixture(scope="module", params=["single", "multiple"])
def domain(request):
    """Rotated boxes, a plate thinner than a cell, and slivers of 1e-9 of a cell."""
    return cut_domain(MESH, BODIES, request.param)


def points_and_weights(domain):
    X, W = quadrature_rule(domain)
    corners = domain.nodes[domain.cells]
    edges = corners[:, 1:] - corners[:, :1]
    points = corners[:, None, 0] + np.einsum("cmq,mck->mqk", X, edges)
    return points, W * np.abs(np.linalg.det(edges))[:, None]


def test_rule_is_exact_to_degree_two(domain):
    points, weight = points_and_weights(domain)
    h = MESH.spacing
    assert weight.min() > 0
    np.testing.assert_allclose(weight.sum(axis=1), domain.volume, rtol=1e-13)
    centroid = (weight[:, :, None] * points).sum(axis=1) / domain.volume[:, None]
    np.testing.assert_allclose(centroid, domain.centroid, atol=1e-14)
    d = points - domain.centroid[:, None]
    for at, (i, j) in enumerate([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]):
        second = (weight * d[:, :, i] * d[:, :, j]).sum(axis=1) / domain.volume
        np.testing.assert_allclose(
            second,
            domain.second_of(np.arange(len(domain.cells)))[:, at] / domain.volume,
            atol=1e-14 + 1e-12 * h * h,
        )


def test_full_cells_have_the_usual_rule(domain):
    X, W = quadrature_rule(domain)
    full = ~domain.is_cut
    np.testing.assert_allclose(np.sort(X[:, full], axis=2)[:, :, -1], (5 + 3 * np.sqrt(5)) / 20)
    np.testing.assert_array_equal(W[full], 1 / 24)


def test_scikit_fem_laplacian_equals_own_assembly(domain):
    """The form on the moment-matched basis and sum_e V_e grad N_a . grad N_b: equal to round-off."""
    A = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(cell_basis(domain))
    g, _ = gradients(domain.nodes, domain.cells)
    own = np.einsum("e,eac,ebc->eab", domain.volume, g, g)
    x = np.random.default_rng(0).normal(size=len(domain.nodes))
    y = np.zeros(len(x))
    np.add.at(y, domain.cells.ravel(), np.einsum("eab,eb->ea", own, x[domain.cells]).ravel())
    np.testing.assert_allclose(A @ x, y, atol=1e-13 * abs(y).max())


def test_scikit_fem_mass_gives_the_moments_of_the_water(domain):
    """x_i^T M x_j = ∫ x_i x_j dV = sum of S + V c c^T."""
    M = BilinearForm(lambda u, v, w: u * v).assemble(cell_basis(domain))
    x = domain.nodes
    moments = np.einsum("m,mi,mj->ij", domain.volume, domain.centroid, domain.centroid)
    s = domain.second_of(np.arange(len(domain.cells))).sum(axis=0)
    moments += [[s[0], s[3], s[4]], [s[3], s[1], s[5]], [s[4], s[5], s[2]]]
    np.testing.assert_allclose(x.T @ (M @ x), moments, rtol=1e-13)
    assert np.ones(len(x)) @ (M @ np.ones(len(x))) == pytest.approx(domain.volume.sum(), rel=1e-13)


def test_scikit_fem_surface_form_equals_the_coupling(domain):
    """∫ N_i n_z dA over all wetted polygons is the sum of the third columns of G."""
    basis, normal = reference_forms.surface_basis(domain)
    force = LinearForm(lambda v, w: v * w["n"][2]).assemble(basis, n=normal)
    G = wetted_coupling(domain)
    np.testing.assert_allclose(force, np.asarray(G[:, 2::6].sum(axis=1)).ravel(), atol=1e-15)


def test_surface_rule_is_exact_for_the_second_moment():
    """∫ x^2 dA over the faces of a box, inside one cell and across many."""
    bodies = ConvexBodies.boxes([[0.5, 0.5, 0.5]], [[0.4, 0.3, 0.2]])
    for mesh in (MESH, box_mesh((-5, -5, -5), (5, 5, 5), 10.0)):
        domain = cut_domain(mesh, bodies)
        d = domain.face_points - 0.5
        second = np.einsum("s,sqi->i", domain.face_area / 3, d**2)
        a, b, c = 0.4, 0.3, 0.2
        exact = 2 * np.array([a * a / 4, b * b / 4, c * c / 4]) * [b * c, a * c, a * b]
        exact += 2 * np.array([a * a / 12, b * b / 12, c * c / 12]) * [a * (b + c), b * (a + c), c * (a + b)]
        np.testing.assert_allclose(second, exact, rtol=1e-12)
