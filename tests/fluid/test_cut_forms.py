"""All forms of linear functions on cut cells, assembled by scikit-fem, against integrals over the modeller's solids."""

import numpy as np
import pytest
from skfem import BilinearForm, LinearForm
from skfem.helpers import dot, grad

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.quadrature import cell_basis
from fluid.mesh.background import Background
from fluid.mesh.gradients import gradients
from tests.fluid import reference_forms, solid_modeller
from tests.fluid.test_cut_cells import anywhere, cell, in_special_place

MIXED = [(i, j) for i in range(3) for j in range(3)]


def single_cell(seed, family):
    """Corners (4, 3), domain with one set of unknowns, and the water as a solid of the modeller."""
    rng = np.random.default_rng(seed)
    x = cell(rng)
    hulls = [family(rng, x) for _ in range(rng.integers(1, 5))]
    mesh = Background.from_arrays(x, [[0, 1, 2, 3]])
    domain = cut_domain(mesh, ConvexBodies.from_polyhedra([(p, None) for p in hulls]))
    union = solid_modeller.union([solid_modeller.hull(p) for p in hulls])
    return domain, solid_modeller.hull(x) - union


def affine(domain):
    """N_a(x) = c_a + g_a · x of the only cell: c (4,) by node, g (4, 3)."""
    c, g = np.zeros(4), np.zeros((4, 3))
    local, _ = gradients(domain.nodes, domain.cells)
    corners = domain.cells[0]
    g[corners] = local[0]
    c[corners] = 1 - np.einsum("ak,ak->a", local[0], domain.nodes[corners])
    return c, g


def volume_forms(domain):
    """Mass, Laplace, the nine ∂_i u ∂_j v and the three u ∂_j v by scikit-fem, each (4, 4)."""
    basis = cell_basis(domain)
    yield BilinearForm(lambda u, v, w: u * v).assemble(basis)
    yield BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis)
    for i, j in MIXED:
        yield BilinearForm(lambda u, v, w, i=i, j=j: grad(u)[i] * grad(v)[j]).assemble(basis)
    for j in range(3):
        yield BilinearForm(lambda u, v, w, j=j: u * grad(v)[j]).assemble(basis)


def exact_volume_forms(domain, water):
    """The same from the moments of the solid; scikit-fem's rows are the test functions v."""
    c, g = affine(domain)
    V, F, S = solid_modeller.moments(water)
    first = c * V + g @ F
    yield V * np.outer(c, c) + np.outer(c, g @ F) + np.outer(g @ F, c) + g @ S @ g.T
    yield V * g @ g.T
    for i, j in MIXED:
        yield V * np.outer(g[:, j], g[:, i])
    for j in range(3):
        yield np.outer(g[:, j], first)


@pytest.mark.parametrize("family", [anywhere, in_special_place])
def test_volume_forms(family):
    """Exact to round-off of the whole cell for bodies anywhere; in special places to the snapping of the nodes."""
    tolerance = 1e-13 if family is anywhere else 1e-9
    cells = 0
    for seed in range(40):
        domain, water = single_cell(seed, family)
        if len(domain.cells) == 0:
            continue
        cells += 1
        for ours, exact in zip(volume_forms(domain), exact_volume_forms(domain, water)):
            np.testing.assert_allclose(ours.toarray(), exact, atol=tolerance * max(1.0, abs(exact).max()))
    assert cells > 20


def exact_surface(domain, water):
    """∫ N_a N_b dA (4, 4) and ∫ N_a n dA (4, 3), n out of the bodies, over the surface that is not the cell's."""
    c, g = affine(domain)
    corners, _ = solid_modeller.triangles(water)
    on_cell = (np.abs(c + corners @ g.T) < 1e-12).all(axis=1).any(axis=1)
    corners = corners[~on_cell]
    vector = -solid_modeller.vector_area(corners)
    area = np.linalg.norm(vector, axis=1)
    N = c + corners @ g.T
    total = N.sum(axis=1)
    mass = np.einsum("t,ta,tb->ab", area / 12, total, total) + np.einsum("t,tka,tkb->ab", area / 12, N, N)
    return mass, np.einsum("ta,ti->ai", total / 3, vector)


def test_surface_forms():
    """Mass and flux over the wetted faces in a cell: the three-point rule is exact to degree two."""
    for seed in range(40):
        domain, water = single_cell(seed, anywhere)
        if len(domain.face_cell) == 0:
            continue
        basis, normal = reference_forms.surface_basis(domain)
        mass, flux = exact_surface(domain, water)
        ours = BilinearForm(lambda u, v, w: u * v).assemble(basis).toarray()
        np.testing.assert_allclose(ours, mass, atol=1e-13)
        for i in range(3):
            row = LinearForm(lambda v, w, i=i: v * w["n"][i]).assemble(basis, n=normal)
            np.testing.assert_allclose(row, flux[:, i], atol=1e-13)


@pytest.mark.parametrize("exponent", range(1, 6))
def test_forms_of_a_corner_sliver(exponent):
    """A corner of size d left of a cell of size 1, a share of d³ down to 1e-15: mass and Laplace keep their relative
    accuracy but for the round-off in the place of the plane, 4e-15 of its distance from the centre of the body, over
    d.  ∫ x² = d⁵/60, ∫ x y = d⁵/120, V = d³/6."""
    d = 10.0**-exponent
    mesh = Background.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]], [[0, 1, 2, 3]])
    n = -np.ones(3) / np.sqrt(3)
    turn = np.column_stack([n, [0, 1, -1] / np.sqrt(2), np.cross(n, [0, 1, -1] / np.sqrt(2))])
    bodies = ConvexBodies.boxes([np.full(3, d / 3) - 5 * n], [[10, 99, 99]], turn[None])
    basis = cell_basis(cut_domain(mesh, bodies))
    mass = BilinearForm(lambda u, v, w: u * v).assemble(basis).toarray()
    second = d**5 / 120 * (1 + np.eye(3))
    np.testing.assert_allclose(mass[1:, 1:], second, rtol=2e-14 / d)
    laplace = BilinearForm(lambda u, v, w: dot(grad(u), grad(v))).assemble(basis).toarray()
    np.testing.assert_allclose(laplace[1:, 1:], d**3 / 6 * np.eye(3), rtol=2e-14 / d, atol=1e-13 * d**3)
