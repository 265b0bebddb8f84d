"""Cells of one shape share a row of gradients: the right one, and only where there are few shapes."""

import numpy as np

from fluid.mesh.background import Background, box_mesh
from fluid.mesh.shapes import MOST_SHAPES, SAME


def test_a_box_has_six_shapes_with_the_gradients_of_its_cells():
    """What a step reads for a cell is what the mesh has for it, to the round-off of its nodes."""
    mesh = box_mesh((-0.7, 0.1, 3.0), (2.52, 1.1, 4.0), 0.11)
    shapes = mesh.shapes
    assert len(shapes.gradients) == 6
    np.testing.assert_allclose(shapes.gradients[shapes.row], mesh.gradients, atol=SAME * 20.0)
    np.testing.assert_allclose(shapes.products[shapes.row], mesh.products, atol=SAME * 400.0)
    np.testing.assert_array_equal(shapes.along[shapes.row], mesh.along)


def test_bricks_of_two_sizes_are_distinguished():
    """A graded box: twelve shapes, and no cell gets the gradients of the other half."""
    x = np.concatenate([np.linspace(0.0, 1.0, 6), np.linspace(1.1, 2.0, 10)])
    mesh = box_mesh(None, None, axes=(x, np.linspace(0, 1, 6), np.linspace(0, 1, 6)))
    shapes = mesh.shapes
    assert len(shapes.gradients) == 12
    np.testing.assert_allclose(shapes.gradients[shapes.row], mesh.gradients, atol=SAME * 20.0)


def test_a_mesh_of_many_shapes_has_a_row_for_every_cell():
    """With jittered nodes no two cells are alike: nothing is shared, and nothing is lost."""
    mesh = box_mesh((0, 0, 0), (1, 1, 1), 0.25)
    rng = np.random.default_rng(3)
    jittered = Background.from_arrays(mesh.nodes + rng.uniform(-0.02, 0.02, mesh.nodes.shape), mesh.cells)
    assert len(jittered.cells) > MOST_SHAPES
    assert jittered.shapes.gradients is jittered.gradients
    np.testing.assert_array_equal(jittered.shapes.row, np.arange(len(jittered.cells)))
