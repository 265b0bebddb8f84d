"""Cells that hold no water: judged by all corners of their fluid part, whatever bounds it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import WIDE_OPENINGS
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.pressure.active_cells import WetPart, _holding
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water

CELL = 0.5


def boxes_in_water(seed, level, connection):
    """Five boxes at random in a tank of 4³ cells with water up to a level [m]."""
    rng = np.random.default_rng(seed)
    mesh = box_mesh(np.zeros(3), [2.0, 2.0, 2.0], CELL)
    centres, sizes = rng.uniform(0.5, 1.5, (5, 3)), rng.uniform(0.15, 0.75, (5, 3))
    bodies = ConvexBodies.boxes(centres, sizes, Rotation.random(5, rng=rng).as_matrix())
    domain = cut_domain(mesh, bodies, "multiple", connection=connection)
    return Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters())


@pytest.mark.parametrize("seed", [0, 1])
def test_no_cell_under_water_is_void(seed):
    """With wide openings, parts of cells lie on no body but between other parts. Fifty of them counted as dry here; a
    node between two turning blocks was left with 1e-10 of a cell, and met 1 GPa."""
    water = boxes_in_water(seed, 10.0, WIDE_OPENINGS)
    domain = water.domain
    bare = domain.is_cut.copy()
    bare[domain.face_cell] = False
    assert bare.sum() > 20
    assert len(WetPart.of(water.topology, domain, water.level_set, CELL).void) == 0


def test_a_part_that_lies_on_no_body_holds_water_where_a_corner_of_it_is_below_the_surface():
    """The tetrahedra that fill a part have all corners of it."""
    water = boxes_in_water(3, 0.83, WIDE_OPENINGS)
    domain, phi, dry = water.domain, water.level_set, -1e-9 * CELL
    holds, bare = _holding(domain, water.topology, phi, dry), domain.is_cut.copy()
    bare[domain.face_cell] = False
    expected = []
    for cell in np.flatnonzero(bare):
        corners = domain.fan_corners[domain.fan_start[cell] : domain.fan_start[cell + 1]]
        expected.append((corners @ phi[domain.cells[cell]]).min() < dry)
    assert 5 < sum(expected) < len(expected) - 5
    np.testing.assert_array_equal(holds[domain.part[bare]], expected)


def test_faces_on_the_border_of_whole_cells_wet_no_part():
    """A box that ends where cells end cuts none of them, but has faces in them. They counted for the last part there
    is, and without any for memory that lies before the list of parts."""
    mesh = box_mesh(np.zeros(3), [2.0, 2.0, 2.0], CELL)
    under_water, in_the_air = ([0.75, 0.75, 0.75], [0.5, 0.5, 0.5]), ([0.75, 0.75, 1.75], [0.3, 0.3, 0.3])
    domain = cut_domain(mesh, ConvexBodies.boxes(*map(list, zip(under_water, in_the_air))))
    assert (domain.part[domain.face_cell] < 0).any()
    water = Water(mesh, domain, lambda x: x[:, 2] - 1.25, WaterParameters())
    holds = _holding(domain, water.topology, water.level_set, -1e-9 * CELL)
    assert len(holds) > 10
    assert not holds.any()


@pytest.mark.parametrize("seed", range(4))
def test_unknowns_are_the_nodes_below_the_surface_that_a_cell_with_water_touches(seed):
    """A node of void cells alone has no row of its own; with one, the matrix would be singular."""
    water = boxes_in_water(seed, 0.83, WIDE_OPENINGS)
    part, t = WetPart.of(water.topology, water.domain, water.level_set, CELL), water.topology
    touched = np.zeros(len(t.nodes), bool)
    touched[t.cells[part.cells]] = True
    below = (water.level_set < 0.0) & t.active
    np.testing.assert_array_equal(part.nodes, below & touched)
    assert (below & ~touched).any()
