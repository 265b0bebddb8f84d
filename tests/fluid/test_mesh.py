"""The background mesh: exact gradients, closed boundary, every point found in the cell that holds it."""

import numpy as np
import pytest

from fluid.mesh.background import Background, MeshError, box_mesh
from fluid.mesh.brick_sides import ALL, NONE


@pytest.fixture(scope="module")
def graded():
    return box_mesh(
        None, None, axes=(np.array([0, 0.3, 0.5, 1.0]), np.linspace(0, 1, 4), np.linspace(-1, 1, 5))
    )


@pytest.fixture(scope="module")
def jittered():
    """A mesh without lattice: inner nodes moved at random, so that only the general search applies."""
    box = box_mesh([0, 0, 0], [1, 1, 1], 0.2)
    x = box.nodes.copy()
    inside = np.all((x > 1e-9) & (x < 1 - 1e-9), axis=1)
    x[inside] += np.random.default_rng(1).uniform(-0.04, 0.04, (inside.sum(), 3))
    return Background.from_arrays(x, box.cells[:, [1, 0, 2, 3]])  # the other orientation must be mended


@pytest.mark.parametrize("name", ["graded", "jittered"])
def test_cells_fill_the_box_and_gradients_are_exact(name, request):
    mesh = request.getfixturevalue(name)
    extent = np.prod(np.diff(mesh.bounds, axis=0))
    np.testing.assert_allclose(mesh.cell_volume.sum(), extent, rtol=1e-13)
    linear = mesh.nodes @ np.array([1.0, -2.0, 0.5]) + 3
    gradient = np.einsum("eak,ea->ek", mesh.gradients, linear[mesh.cells])
    np.testing.assert_allclose(gradient, np.broadcast_to([1.0, -2.0, 0.5], gradient.shape), atol=1e-11)


def test_volume_passes_along_the_sides_of_bricks_of_any_shape():
    """Split bricks have no obtuse cells, however flat or tall: what passes between layers does not mix them."""
    for sides in ([0.25, 0.25, 0.25], [0.25, 0.25, 2.5], [0.25, 0.25, 0.025]):
        assert (box_mesh([0, 0, 0], [1, 1, 2.5], sides).along == ALL).all()


def test_obtuse_cells_of_no_bricks_pass_it_through_their_medians(jittered):
    assert jittered.is_obtuse
    np.testing.assert_array_equal(jittered.along, np.where(jittered.obtuse, NONE, ALL))


@pytest.mark.parametrize("name", ["graded", "jittered"])
def test_boundary_is_closed_and_outward(name, request):
    """Σ area n = 0 and Σ area n·x = 3 V: the divergence theorem on the faces of the mesh."""
    mesh = request.getfixturevalue(name)
    x = mesh.nodes[mesh.boundary_faces]
    area = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
    flux = area[:, None] * mesh.boundary_normal
    np.testing.assert_allclose(flux.sum(axis=0), 0, atol=1e-13)
    np.testing.assert_allclose((flux * x.mean(axis=1)).sum(), 3 * mesh.cell_volume.sum(), rtol=1e-13)


@pytest.mark.parametrize("name", ["graded", "jittered"])
def test_locate_returns_the_cell_that_holds_the_point(name, request):
    mesh = request.getfixturevalue(name)
    rng = np.random.default_rng(0)
    low, high = mesh.bounds
    points = rng.uniform(low, high, (500, 3))
    cell = mesh.locate(points)
    assert cell.min() >= 0
    weights = np.einsum("eak,ek->ea", mesh.gradients[cell], points - mesh.nodes[mesh.cells[cell, 0]])
    weights[:, 0] += 1
    assert weights.min() > -1e-9
    assert np.all(mesh.locate(mesh.nodes) >= 0)
    assert np.all(mesh.locate([high + 0.1, low - 0.1]) == -1)


def test_neighbours_are_mutual_and_share_three_nodes(graded):
    """Every face that is not on the boundary has two cells, so none is left out."""
    within = np.count_nonzero(graded.neighbours >= 0)
    assert within == 4 * len(graded.cells) - len(graded.boundary_faces)
    for e in range(0, len(graded.cells), 7):
        for a, other in enumerate(graded.neighbours[e]):
            if other >= 0:
                assert e in graded.neighbours[other]
                assert set(np.delete(graded.cells[e], a)) <= set(graded.cells[other])


def test_flat_cell_is_refused_by_number():
    nodes = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0]])
    with pytest.raises(MeshError, match=r"cell 1 .*no volume"):
        Background.from_arrays(nodes, [[0, 1, 2, 3], [0, 1, 2, 4]])
