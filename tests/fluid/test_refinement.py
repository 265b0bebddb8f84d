"""Finer cells in parts of a mesh: conforming, of bounded shape, the same every time, and as good as the fine mesh."""

import numpy as np
import pytest
from skfem import MeshTet

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import MeshError, box_mesh
from fluid.mesh.bisection import Tetrahedra, refined
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.mesh.refinement import InBox, NearBodies, OnBed, refined_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.general import unstructured
from tests.fluid.scenes import advance, load, rotation

MIDDLE = InBox((0.6, 0.2, 0.2), (1.0, 0.6, 0.6), 1)


def angles(mesh):
    """Smallest and largest dihedral angle [degrees] of all cells."""
    n = -mesh.gradients / np.linalg.norm(mesh.gradients, axis=2, keepdims=True)
    pairs = np.triu_indices(4, 1)
    found = np.degrees(np.arccos(np.clip(-np.einsum("eak,ebk->eab", n, n)[:, pairs[0], pairs[1]], -1, 1)))
    return found.min(), found.max()


def assert_whole(mesh, volume, surface):
    """Cells fill the space, share whole faces, and are known to scikit-fem as a valid mesh."""
    assert mesh.cell_volume.sum() == pytest.approx(volume, rel=1e-12)
    assert mesh.boundary_area.sum() == pytest.approx(surface, rel=1e-12)
    assert MeshTet(mesh.nodes.T.copy(), mesh.cells.T.copy()).is_valid()


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
@pytest.mark.parametrize("levels", [1, 2, 3])
def test_bricks_are_halved_and_again(split, levels):
    """Angles stay between 45 and 120 degrees; in the box the cells are bricks of 1/2, 1/4, 1/8, none of them obtuse."""
    coarse = box_mesh((0, 0, 0), (1.6, 0.8, 0.8), 0.1, split=split)
    mesh = refined_mesh(coarse, [InBox(MIDDLE.lower, MIDDLE.upper, levels)])
    assert_whole(mesh, 1.024, 6.4)
    assert angles(mesh) == pytest.approx((45.0, 120.0))
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    inside = ((centre > MIDDLE.lower) & (centre < MIDDLE.upper)).all(axis=1)
    np.testing.assert_allclose(mesh.cell_size[inside], 0.1 / 2**levels)
    assert not mesh.obtuse[inside].any()
    far = (centre[:, 0] < 0.3) | (centre[:, 0] > 1.3)
    np.testing.assert_allclose(mesh.cell_size[far], 0.1)
    again = refined_mesh(coarse, [InBox(MIDDLE.lower, MIDDLE.upper, levels)])
    np.testing.assert_array_equal(mesh.nodes, again.nodes)
    np.testing.assert_array_equal(mesh.cells, again.cells)


def test_cells_of_one_shape_share_their_gradients():
    """The loops of a step read a table that stays in cache, as in a box of bricks."""
    mesh = refined_mesh(
        box_mesh((0, 0, 0), (1.6, 0.8, 0.8), 0.1), [InBox((0.6, 0.2, 0.2), (1.0, 0.6, 0.6), 2)]
    )
    s = mesh.shapes
    assert 64 < len(s.gradients) < 400
    np.testing.assert_allclose(s.gradients[s.row], mesh.gradients, atol=1e-11 * np.abs(mesh.gradients).max())


def test_points_and_bodies_are_found_across_levels():
    mesh = refined_mesh(
        box_mesh((0, 0, 0), (1.6, 0.8, 0.8), 0.1), [InBox((0.6, 0.2, 0.2), (1.0, 0.6, 0.6), 3)]
    )
    points = np.random.default_rng(1).uniform((0, 0, 0), (1.6, 0.8, 0.8), (500, 3))
    for some in (points, mesh.nodes, mesh.nodes[mesh.cells].mean(axis=1)[::7]):
        cell = mesh.locate(some)
        x = mesh.nodes[mesh.cells[cell]]
        weight = np.einsum("mak,mk->ma", mesh.gradients[cell], some - x[:, 0])
        weight[:, 0] += 1.0
        assert (cell >= 0).all()
        assert weight.min() > -1e-9
    bodies = ConvexBodies.boxes([[0.55, 0.4, 0.4], [0.9, 0.3, 0.3]], [[0.4, 0.3, 0.2], [0.1, 0.1, 0.3]])
    domain = cut_domain(mesh, bodies, "multiple")
    assert domain.volume.sum() == pytest.approx(1.024 - 0.4 * 0.3 * 0.2 - 0.1 * 0.1 * 0.3, abs=1e-12)
    surface = 2 * (0.12 + 0.08 + 0.06) + 2 * (0.01 + 0.03 + 0.03)
    assert domain.face_area.sum() == pytest.approx(surface, abs=1e-12)


def test_cells_near_bodies_become_finer_step_by_step():
    """Within the margin all levels, within twice the margin one less."""
    body = ConvexBodies.boxes([[0.8, 0.4, 0.4]], [[0.2, 0.2, 0.2]], [rotation((0, 0, 1), 0.5)])
    low, high = np.array([[0.64, 0.24, 0.3]]), np.array([[0.96, 0.56, 0.5]])
    around = NearBodies(body.normals, body.offsets, body.plane_start, low, high, 0.06, 2)
    mesh = refined_mesh(box_mesh((0, 0, 0), (1.6, 0.8, 0.8), 0.1), [around])
    x = mesh.nodes[mesh.cells]
    beyond = (np.einsum("pk,eak->epa", body.normals, x) - body.offsets[:, None]).min(axis=2).max(axis=1)
    assert mesh.cell_size[beyond < 0.05].max() < 0.026
    assert mesh.cell_size[beyond < 0.11].max() < 0.051
    assert mesh.cell_size.max() == pytest.approx(0.1)


def test_any_mesh_can_be_refined(tmp_path):
    """Unstructured cells, and those over a bed: whole faces everywhere, no worse than a third of the least angle."""
    coarse = unstructured(4, tmp_path / "mesh.vtu")
    mesh = refined_mesh(coarse, [InBox((0.2, 0.2, 0.2), (0.6, 0.6, 0.6), 2)])
    assert_whole(mesh, 1.0, 6.0)
    assert angles(mesh)[0] > angles(coarse)[0] / 3

    def bed(x, y):
        return 0.1 * x + 0.05 * np.sin(3 * y)

    fitted = fitted_mesh((0, 0, 0), (4, 2, 1.2), 0.2, bed)
    shore = refined_mesh(fitted.mesh, [OnBed(bed, 0.15, 0.25, 0.2, 1)], fitted.lattice)
    m = fitted.mesh
    assert_whole(shore, m.cell_volume.sum(), m.boundary_area.sum())
    assert angles(shore)[0] > angles(m)[0] / 2
    assert shore.finest < 0.6 * 0.2


@pytest.mark.parametrize("strip", [(0.05, 0.2), (0.1, 0.101), (-0.05, 0.05)])
def test_a_strip_of_bed_between_two_columns_is_refined(strip):
    """A shore may lie between two columns of nodes, 0.25 m apart in height here: nothing was refined there."""

    def bed(x, y):
        return -2.0 + 0.5 * x + 0.0 * y

    fitted = fitted_mesh((0, 0, -2), (8, 2, 2), 0.5, bed)
    strip_of_bed = OnBed(bed, *strip, 0.5, 2)
    mesh = refined_mesh(fitted.mesh, [strip_of_bed], fitted.lattice)
    z = np.linspace(*strip, 50)
    x = 2.0 * (z + 2.0)
    for height in (0.02, 0.45):
        size = mesh.size_at(np.column_stack([x, np.full_like(x, 1.01), z + height]))
        assert size.max() < 0.5 / 3.0
    assert mesh.local_size.max() > 0.45
    exact = 0.5 * 2.0 * 2.0 * (strip[1] - strip[0])  # as forecast from samples 4 cm apart
    assert exact <= strip_of_bed.volume_in((0, 0, -2), (8, 2, 2)) <= exact + 0.5 * 2.0 * 2.5 * 8.0 / 199


def test_places_without_ground_do_not_count_as_bed():
    def bed(x, y):
        return np.where(x < 4.1, -1.0 + 0.25 * x + 0.0 * y, np.nan)

    coarse = box_mesh((0, 0, -1), (8, 1, 1), 0.5)
    mesh = refined_mesh(coarse, [OnBed(bed, -0.2, 5.0, 0.5, 1)])
    middle = mesh.nodes[mesh.cells].mean(axis=1)
    fine = mesh.local_size < 0.3
    assert middle[fine, 0].min() > 2.5
    assert middle[fine, 0].max() < 5.0
    assert OnBed(bed, -0.2, 5.0, 0.5, 1).volume_in((0, 0, -1), (8, 1, 1)) == pytest.approx(0.45, rel=0.1)


def test_levels_that_cannot_be_are_refused():
    coarse = box_mesh((0, 0, 0), (1, 1, 1), 0.5)
    with pytest.raises(MeshError, match="from 1 to 8"):
        refined_mesh(coarse, [InBox((0, 0, 0), (1, 1, 1), 9)])
    with pytest.raises(ValueError, match="from 0 to 8"):
        refined(Tetrahedra.coarse(coarse.nodes, coarse.cells, None), lambda mesh, level: [], -1)


def half_full(mesh, bodies, covers, **more):
    domain = cut_domain(mesh, bodies, covers)
    return Water(mesh, domain, lambda x: x[:, 2] - 0.43, WaterParameters(**more))


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_water_at_rest_stays_so_across_levels(covers):
    """A tilted block and a thin plate cross from coarse to fine cells, through the surface: nothing moves, and the
    load is the weight of the water in their place."""
    mesh = refined_mesh(
        box_mesh((0, 0, 0), (1.6, 0.8, 0.8), 0.1), [InBox((0.6, 0.2, 0.3), (1.0, 0.6, 0.6), 2)]
    )
    turns = [rotation((1, 2, 0), 0.4), np.eye(3)]
    bodies = ConvexBodies.boxes(
        [[0.6, 0.4, 0.2], [0.9, 0.4, 0.4]], [[0.3, 0.3, 0.2], [0.03, 0.5, 0.5]], turns
    )
    water = half_full(mesh, bodies, covers)
    for _ in range(150):
        problem, x = advance(water)
    assert water.fastest() < 1e-7
    force = load(problem, x)
    assert force[0, 2] == pytest.approx(9810.0 * 0.3 * 0.3 * 0.2, rel=1e-6)
    assert force[1, 2] == pytest.approx(9810.0 * 0.03 * 0.5 * (0.43 - 0.15), rel=1e-6)
    assert np.abs(force[:, :2]).max() < 1e-3


def test_island_that_rises_through_the_lid_may_have_a_finer_shore():
    """Columns of land at its rim have nodes and no cells: bisection once took them for nodes of some."""

    def bed(x, y):
        return 3.0 - np.hypot(x - 6.3, y - 6.1)

    fitted = fitted_mesh((0, 0, 0), (12, 12, 1.5), 1.0, bed)
    lone = np.setdiff1d(np.arange(len(fitted.mesh.nodes)), fitted.mesh.cells)
    assert len(lone) > 0, "the test is about nodes without cells"
    mesh = refined_mesh(fitted.mesh, [OnBed(bed, -0.5, 1.0, 1.0, 1)], fitted.lattice)
    assert len(mesh.cells) > len(fitted.mesh.cells)
    assert mesh.cell_volume.sum() == pytest.approx(fitted.mesh.cell_volume.sum())
