"""The load where the surface passes through the cells of a solid: exact for still water, whatever is wet."""

import manifold3d
import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import box_mesh
from fluid.pressure.waterline import WaterlineLoad
from tests.fluid.scenes import advance, load, rotation, tank

SIZE = np.array([0.3, 0.25, 0.2])
WEIGHT = 9810.0


def boxes(centre, turn=None, size=SIZE):
    return ConvexBodies.boxes(
        np.atleast_2d(centre), np.atleast_2d(size), None if turn is None else turn[None]
    )


def still(level, solids, cell=0.125, steps=3):
    water = tank([1, 1, 1], cell, lambda x: x[:, 2] - level, solids)
    for _ in range(steps):
        problem, x = advance(water, 0.01, rtol=1e-12)
    return load(problem, x)


def submerged(centre, turn, level):
    """Volume [m³] and centroid (3,) [m] of the part of the box below the level."""
    half = manifold3d.Manifold.cube(SIZE, True)
    placed = half.transform(np.column_stack([turn, centre]))
    part = placed.trim_by_plane((0, 0, -1), -level)
    mesh = part.to_mesh()
    x = np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]
    volume = np.linalg.det(x) / 6.0
    return volume.sum(), (volume[:, None] * x.sum(axis=1) / 4.0).sum(axis=0) / volume.sum()


@pytest.mark.parametrize("height", [0.42, 0.5, 0.57, 0.63])
@pytest.mark.parametrize("level", [0.53, 0.56, 0.61])
def test_a_turned_box_through_the_surface_floats_on_what_it_displaces(height, level):
    """Archimedes, force and moment, with the level anywhere between nodes and 1 to 2 cells of depth: hat functions that
    reach above the surface made this up to 10 % wrong."""
    turn, centre = rotation([1, 2, 3], 0.6), np.array([0.48, 0.53, height])
    found = still(level, boxes(centre, turn))[0]
    volume, middle = submerged(centre, turn, level)
    force = np.array([0.0, 0.0, WEIGHT * volume])
    # manifold works in single precision
    np.testing.assert_allclose(found[:3], force, atol=1e-5 * force[2])
    np.testing.assert_allclose(found[3:], np.cross(middle - centre, force), atol=1e-5 * force[2] * SIZE.max())


@pytest.mark.parametrize("gap", [0.01, 0.03, 0.06])
def test_a_dry_deck_close_above_the_water_carries_no_load(gap):
    """A box whose deck is less than half a cell out of the water has all of its buoyancy."""
    level = 0.56
    found = still(level, boxes([0.49, 0.52, level + gap - 0.5 * SIZE[2]]))[0]
    assert found[2] == pytest.approx(WEIGHT * SIZE[0] * SIZE[1] * (SIZE[2] - gap), rel=1e-9)


def test_a_plate_above_the_water_carries_no_load():
    """Its underside lies in cells with water, but the water does not reach it."""
    found = still(0.56, boxes([0.5, 0.5, 0.63], size=[0.5, 0.5, 0.1]))
    np.testing.assert_allclose(found, 0.0, atol=1e-9 * WEIGHT)


def test_solids_wholly_under_water_need_no_correction():
    mesh = box_mesh([0, 0, 0], [1, 1, 1], 0.125)
    domain = cut_domain(mesh, boxes([0.5, 0.5, 0.3]))
    phi = domain.nodes[:, 2] - 0.9
    faces, none, no_side = np.arange(len(domain.face_cell)), np.zeros(0, int), np.zeros(len(phi), bool)
    state = (faces, none, phi, phi < 0.0, -WEIGHT * phi, no_side)
    assert not WaterlineLoad(Topology.of(mesh, domain), domain, *state).before().any()
