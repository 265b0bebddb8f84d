"""Narrow cracks of a wall: open, closed or lumped, by what the case asks for and by their opening and depth."""

import numpy as np
import pytest

from coupler.step.cracks import THINNEST, WIDEST, NarrowCracks
from coupler.step.immersion import Immersion
from fluid.domain.covers import components
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

CELL = 0.25
WIDTH = 0.5
FAILURE = 1e-3
"""Opening at which a joint breaks [m]."""


@pytest.fixture
def cracked():
    """A function (opening, thickness) -> structure: a wall of eight courses, those above the third lifted."""
    made = []

    def wall(opening, thickness=0.2):
        blocks = wall_of_blocks(
            "wall", (1.1, -0.001, 0.0), (thickness, WIDTH + 0.002, 2.0), (thickness, WIDTH + 0.002, 0.25)
        )
        structure = Structure(
            blocks, None, JointParameters(1e6, FAILURE, damping=0.0), ground=0.0, gravity=(0, 0, 0)
        )
        made.append(structure)
        above = np.flatnonzero(structure.centre()[:, 2] > 0.75)
        structure.displace(
            above, np.tile([0, 0, opening], (len(above), 1)), np.tile(np.eye(3), (len(above), 1, 1))
        )
        structure.advance(1e-9)
        return structure

    yield wall
    for structure in made:
        structure.close()


def immersed(structure, kind):
    mesh = box_mesh((0, 0, 0), (2.5, WIDTH, 2.0), CELL)
    narrow = None if kind == "open" else NarrowCracks(structure, CELL, lumped=kind == "slit")
    return mesh, Immersion(mesh, structure, [], "multiple", narrow)


def basins(immersion):
    return components(immersion.domain.cells, len(immersion.domain.nodes)).max() + 1


@pytest.mark.parametrize(("kind", "parts"), [("open", 1), ("closed", 2), ("slit", 2)])
def test_a_narrow_crack_is_open_or_closed_as_the_case_says(cracked, kind, parts):
    """A broken joint 5 mm wide in a wall of 0.8 cells: one water on both sides, or two."""
    structure = cracked(5 * FAILURE)
    assert (~structure.joint_table().alive).sum() == 1
    assert basins(immersed(structure, kind)[1]) == parts


def test_wide_cracks_and_cracks_of_thick_walls_are_open(cracked):
    """Wider than a quarter of a cell, or deeper than two: the mesh sees them."""
    wide = cracked(1.1 * WIDEST * CELL)
    assert len(NarrowCracks(wide, CELL, lumped=True).cracks()) == 0
    assert basins(immersed(wide, "slit")[1]) == 1
    wide.close()
    thick = cracked(5 * FAILURE, thickness=1.1 * THINNEST * CELL)
    assert len(NarrowCracks(thick, CELL, lumped=True).cracks()) == 0
    assert basins(immersed(thick, "slit")[1]) == 1


def test_a_crack_whose_faces_have_slid_by_a_quarter_of_their_depth_is_open(cracked):
    """However narrow it is: what it would have been closed by lies elsewhere."""
    structure = cracked(5 * FAILURE)
    above = np.flatnonzero(structure.centre()[:, 2] > 0.75)
    for slid, narrow in ((0.9, 1), (1.1, 0)):
        way = slid * WIDEST * 0.2 - 0.9 * WIDEST * 0.2 * (slid > 1.0)
        structure.displace(
            above, np.tile([way, 0, 0], (len(above), 1)), np.tile(np.eye(3), (len(above), 1, 1))
        )
        assert len(NarrowCracks(structure, CELL, lumped=True).cracks()) == narrow


def test_each_face_of_a_closed_crack_grows_by_half_of_its_largest_opening(cracked):
    """So that the two meet also where a wall that tilts has opened most."""
    structure = cracked(5 * FAILURE)
    above = np.flatnonzero(structure.centre()[:, 2] > 0.75)
    tilt = 0.02
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    foot = structure.centre()[above].mean(axis=0) * [1, 1, 0] + [0, 0, 0.75 + 5 * FAILURE]
    arm = structure.centre()[above] - foot
    structure.displace(above, arm @ turn.T - arm, np.tile(turn, (len(above), 1, 1)))
    narrow = NarrowCracks(structure, CELL, lumped=False)
    block, _, half = narrow.faces()
    table = structure.joint_table()
    (joint,) = np.flatnonzero(~table.alive)
    assert sorted(block) == sorted([table.a[joint], table.b[joint]])
    largest = 5 * FAILURE + 0.1 * np.sin(tilt)  # at the points of the joint, which lie on its rim or inside
    assert half[0] == half[1]
    assert 0.75 * largest < 2.0 * half[0] <= largest * (1 + 1e-9)
    assert 2.0 * half[0] > 1.2 * narrow.cracks().opening[0]


def test_crack_handed_to_the_water(cracked):
    """Its polygon lies between the two blocks, the opening is the one now, the blocks are the joint's."""
    structure = cracked(5 * FAILURE)
    cracks = NarrowCracks(structure, CELL, lumped=True).cracks()
    assert len(cracks) == 1
    np.testing.assert_allclose(cracks.opening, 5 * FAILURE, rtol=1e-6)
    table = structure.joint_table()
    joint = cracks.name[0]
    np.testing.assert_array_equal(cracks.bodies[0], [table.a[joint], table.b[joint]])
    assert np.ptp(cracks.corners[:, 0]) == pytest.approx(0.2, rel=1e-9)
    np.testing.assert_allclose(cracks.corners[:, 2], 0.75, atol=6 * FAILURE)


def test_water_passes_a_lumped_crack(cracked):
    """Water 1.5 m deep before the wall, none behind: none passes a closed crack, and a lumped one lets it out of the
    basin at up to Torricelli's rate."""
    structure = cracked(5 * FAILURE)
    mesh, immersion = immersed(structure, "slit")
    water = Water(
        mesh, immersion.domain, lambda x: np.maximum(x[:, 2] - 1.57, x[:, 0] - 1.2), WaterParameters()
    )
    for _ in range(3):
        advance(water)
    kept = water.nodal_water.sum()
    water.set_cracks(immersion.cracks.cracks())
    assert len(water.slits) == 2
    for _ in range(40):
        advance(water, dt=0.01)
    most = 0.6 * 5 * FAILURE * WIDTH * np.sqrt(2 * 9.81 * (1.57 - 0.75))
    assert 0.5 * most < abs(water.slits.flow.sum()) < 1.05 * most
    assert water.nodal_water.sum() == pytest.approx(kept, rel=1e-3)
