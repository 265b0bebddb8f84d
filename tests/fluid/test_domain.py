"""The physical domain: ownership of wetted faces, contact, growth, loads, and cutting again in part."""

import dataclasses

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.coupling_matrix import rows_of
from fluid.domain.hats import hat_values
from fluid.domain.physical_domain import cut_domain, wetted_coupling
from fluid.mesh.arrays import Hats
from fluid.mesh.background import box_mesh
from fluid.mesh.gradients import gradients

MESH = box_mesh((0, 0, 0), (4, 4, 4), 1.0)
EMPTY = ConvexBodies.empty()


def same(a, b):
    for f in dataclasses.fields(a):
        if f.name != "memory":
            np.testing.assert_array_equal(getattr(a, f.name), getattr(b, f.name), err_msg=f.name)


def area_of(domain, body):
    return domain.face_area[domain.face_body == body].sum()


def test_no_bodies():
    domain = cut_domain(MESH, EMPTY)
    assert len(domain.cells) == len(MESH.cells)
    np.testing.assert_array_equal(domain.volume, MESH.cell_volume)
    assert not domain.is_cut.any()
    assert wetted_coupling(domain).shape == (len(MESH.nodes), 0)


def test_wall_on_mesh_planes_is_exact():
    """Cells inside have no water, those beside it are whole and get each wetted face once."""
    domain = cut_domain(MESH, ConvexBodies.boxes([[1.5, 2, 2]], [[1, 4, 4]]))
    assert len(domain.cells) == len(MESH.cells) * 3 // 4
    assert not domain.is_cut.any()
    np.testing.assert_array_equal(domain.volume, MESH.cell_volume[domain.parent_cell])
    assert area_of(domain, 0) == pytest.approx(32, rel=1e-14)
    assert set(np.round(domain.face_normal[:, 0])) == {-1.0, 1.0}


def test_block_on_the_floor_has_no_wetted_underside():
    domain = cut_domain(MESH, ConvexBodies.boxes([[2.2, 1.9, 0.4]], [[1.1, 0.9, 0.8]]))
    assert area_of(domain, 0) == pytest.approx(2 * (1.1 + 0.9) * 0.8 + 1.1 * 0.9, rel=1e-13)
    assert domain.face_normal[:, 2].min() > -1e-12


@pytest.mark.parametrize("x", [2.0, 2.13])
def test_touching_blocks_share_no_wetted_face(x):
    """Two cubes face to face, on a mesh plane and off it."""
    bodies = ConvexBodies.boxes([[x - 0.5, 2, 2], [x + 0.5, 2, 2]], np.ones((2, 3)))
    domain = cut_domain(MESH, bodies)
    assert area_of(domain, 0) == pytest.approx(5, rel=1e-13)
    assert area_of(domain, 1) == pytest.approx(5, rel=1e-13)


@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_growth_closes_the_gap_of_a_joint(gap):
    """The faces of a joint grow by gap/2 + eps: no water and no wetted face between the blocks, and the
    flush faces next to the joint are counted once although the grown bodies overlap there."""
    bodies = ConvexBodies.boxes([[1.6 - gap / 2, 2, 2], [2.6 + gap / 2, 2, 2]], np.ones((2, 3)))
    growth = np.zeros(12)
    growth[[3, 6]] = gap / 2 + 1e-7
    domain = cut_domain(MESH, bodies.grown(growth))
    assert domain.volume.sum() == pytest.approx(64 - 2 - gap, rel=1e-13)
    assert domain.face_area.sum() == pytest.approx(10 + 4 * gap, rel=1e-13)
    across = np.abs(domain.face_normal[:, 0]) > 0.5
    assert np.abs(domain.face_centroid[across, 0] - 2.1).min() > 0.9


def test_open_contact_keeps_its_film():
    """Without growth a gap of 1e-6 m is water, wetted on both sides: the choice is the caller's."""
    gap = 1e-6
    bodies = ConvexBodies.boxes([[1.6 - gap / 2, 2, 2], [2.6 + gap / 2, 2, 2]], np.ones((2, 3)))
    domain = cut_domain(MESH, bodies)
    assert domain.face_area.sum() == pytest.approx(12, rel=1e-12)
    assert domain.volume.sum() == pytest.approx(62, rel=1e-12)


def test_archimedes():
    """Hydrostatic pressure on immersed rotated boxes: force rho g V upward and no torque, to round-off."""
    rotation = Rotation.random(2, rng=3).as_matrix()
    size = np.array([[0.7, 0.9, 1.1], [1.3, 0.2, 0.5]])
    bodies = ConvexBodies.boxes([[1.2, 1.3, 1.4], [2.6, 2.5, 2.7]], size, rotation)
    domain = cut_domain(MESH, bodies)
    load = -wetted_coupling(domain).T @ (1000 * 9.81 * (10 - MESH.nodes[:, 2]))
    expected = np.zeros((2, 6))
    expected[:, 2] = 1000 * 9.81 * size.prod(axis=1)
    np.testing.assert_allclose(load.reshape(2, 6), expected, atol=1e-9)


def test_cutting_again_near_moved_bodies_equals_a_full_cut():
    """Bit for bit, over several steps, with bodies passing each other, the floor and the end of the mesh."""
    rng = np.random.default_rng(1)
    n = 25
    centre, size = rng.uniform(0, 4, (n, 3)), rng.uniform(0.2, 0.9, (n, 3))
    reference = ConvexBodies.boxes(centre, size)
    rotation = Rotation.random(n, rng=2).as_matrix()
    domain = cut_domain(MESH, reference.moved(centre, rotation))
    for step in range(6):
        moved = rng.random(n) < (0.3 if step else 0.0)
        centre = centre + moved[:, None] * rng.normal(0, 0.4, (n, 3))
        bodies = reference.moved(centre, rotation)
        domain = cut_domain(MESH, bodies, previous=domain)
        same(domain, cut_domain(MESH, bodies))


def test_a_joint_that_opens_is_cut_again():
    """A change of growth alone counts as a change of the body; cells away from it are left alone."""
    bodies = ConvexBodies.boxes([[1.6, 2, 2], [2.602, 2, 2]], np.ones((2, 3)))
    growth = np.zeros(12)
    growth[[3, 6]] = 2e-3
    closed = cut_domain(MESH, bodies.grown(growth))
    opened = cut_domain(MESH, bodies, previous=closed)
    same(opened, cut_domain(MESH, bodies))
    assert opened.face_area.sum() == pytest.approx(12, rel=1e-12)
    assert closed.face_area.sum() == pytest.approx(10.008, rel=1e-12)


def test_a_foreign_previous_domain_is_refused():
    two = ConvexBodies.boxes([[1, 1, 1], [2.5, 2.5, 2.5]], np.ones((2, 3)))
    domain = cut_domain(MESH, two)
    with pytest.raises(ValueError, match="previous=None"):
        cut_domain(MESH, EMPTY, previous=domain)
    with pytest.raises(ValueError, match="previous=None"):
        cut_domain(MESH, two, "multiple", previous=domain)
    with pytest.raises(ValueError, match="choose 'single' or 'multiple'"):
        cut_domain(MESH, two, "double")


def test_values_of_hat_functions_are_those_of_scikit_fem():
    """The last three hats of a tetrahedron are the coordinates of its reference cell."""
    random = np.random.default_rng(5)
    corners, points = random.normal(size=(30, 4, 3)), random.normal(size=(30, 7, 3))
    nodes, cells = corners.reshape(-1, 3), np.arange(120).reshape(30, 4)
    mesh = skfem.MeshTet(nodes.T.copy(), cells.T.copy(), sort_t=False)
    reference = mesh.mapping().invF(points.transpose(2, 0, 1), tind=np.arange(30)).transpose(1, 2, 0)
    hats = Hats(cells, np.arange(30), gradients(nodes, cells)[0])
    found = hat_values(np.arange(30), points, hats, nodes)
    np.testing.assert_allclose(found[:, :, 1:], reference, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found.sum(axis=2), 1.0, atol=1e-9)


def test_rows_of_a_coupling_are_those_of_scipy():
    """In the order asked for, empty and repeated ones too."""
    random = np.random.default_rng(6)
    coupling = sp.random_array((50, 12), density=0.1, format="csr", rng=random)
    rows = random.integers(0, 50, 40)
    found, expected = rows_of(coupling, rows), sp.csr_matrix(coupling)[rows]
    for name in ("indptr", "indices", "data"):
        np.testing.assert_array_equal(getattr(found, name), getattr(expected, name))
    assert found.shape == expected.shape
    assert rows_of(coupling, rows[:0]).shape == (0, 12)
