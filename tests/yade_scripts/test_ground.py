"""Uneven ground beyond its edges, where blocks come that leave a tank over an open side."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.contact.ground import GroundSurface, surface_at
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

SLOPE, ACROSS = 0.3, 0.2
X, Y = np.linspace(0.0, 10.0, 11), np.linspace(0.0, 4.0, 5)
UP = (0.0, 0.0, 1.0)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize(
    ("place", "gradient"),
    [
        ((12.0, 2.3), (0.0, ACROSS)),
        ((-1.0, 2.0), (0.0, ACROSS)),
        ((3.6, 5.0), (SLOPE, 0.0)),
        ((3.0, -2.0), (SLOPE, 0.0)),
        ((12.0, 5.0), (0.0, 0.0)),
        ((-1.0, -1.0), (0.0, 0.0)),
    ],
)
def test_ground_goes_on_level_outwards(place, gradient, mirrored):
    z = SLOPE * X[:, None] + ACROSS * Y
    ground = GroundSurface((0.0, 0.0, 0.0), UP, x=X, y=Y, z=z, mirrored=mirrored).as_row(0)
    normal = np.zeros(3)
    height = surface_at(ground, *place, normal)
    assert height == pytest.approx(SLOPE * np.clip(place[0], 0, 10) + ACROSS * np.clip(place[1], 0, 4))
    np.testing.assert_allclose(-normal[:2] / normal[2], gradient, atol=1e-12)


@pytest.mark.parametrize("mirrored", [False, True])
def test_heights_of_many_places_are_those_of_the_kernel(mirrored):
    rng = np.random.default_rng(3)
    z = rng.uniform(0.0, 2.0, (len(X), len(Y)))
    ground = GroundSurface((1.0, -2.0, 5.0), UP, x=X, y=Y, z=z, mirrored=mirrored)
    places = rng.uniform((-1, -4, 0), (13, 4, 0), (200, 3))
    row, normal = ground.as_row(0), np.zeros(3)
    wanted = [5.0 + surface_at(row, x - 1.0, y + 2.0, normal) for x, y, _ in places]
    np.testing.assert_allclose(ground.height(places), wanted, rtol=0, atol=1e-12)


@pytest.mark.parametrize("slope", [SLOPE, -SLOPE])
def test_block_beyond_the_edge_stays_where_it_is(slope):
    """Without friction: with the normal of the last triangle it slid at slope g, and its energy grew."""
    z = np.tile((slope * X - min(0.0, slope * X[-1]))[:, None], (1, len(Y)))
    ground = GroundSurface((0.0, 0.0, 0.0), UP, "terrain", bonds=False, x=X, y=Y, z=z)
    block = Block("b", np.array([12.0, 2.0, z[-1, 0] + 0.5]), size=np.ones(3))
    with Structure([block], ContactLaw(stiffness=5e7, friction=0.0), planes=[ground]) as structure:
        structure.advance(0.5)
        np.testing.assert_allclose(structure.centre()[0, :2], block.centre[:2], atol=1e-12)
        assert structure.energies()["kinetic"] < 1e-6


def test_springs_that_cross_a_ridge_give_their_part_along_the_new_normal_to_friction():
    """A block so heavy that it keeps its speed scrapes over a roof of 0.3 : 1. Friction carries it along one side; the
    part of that which is normal to the other side is let go there, a seventh of all friction: without it in the ledger
    that much energy is missing. What is left is of first order in the substep, whose force holds across the ridge."""
    x, y = np.array([-1.0, 0.0, 1.0]), np.array([-1.0, 1.0])
    z = np.tile(0.32 - 0.3 * np.abs(x)[:, None], (1, 2))
    roof = GroundSurface(np.array([0.0, 0.0, -0.3]), np.array(UP), "terrain", bonds=False, x=x, y=y, z=z)
    block = Block("b", (-0.4, 0.0, 0.25), size=0.5, density=1e6, velocity=(1.0, 0.0, 0.0))
    law = ContactLaw(stiffness=1e5, restitution=1.0, friction=5.0)
    with Structure([block], law, planes=[roof], gravity=(0.0, 0.0, 0.0), substep=1e-3) as structure:
        start = structure.energies()["kinetic"]
        structure.advance(0.9)
        found = structure.energies()
    assert found["contact_stored"] == 0.0  # all nodes are past it
    gone = start - found["kinetic"] - found["dashpot"]
    assert gone == pytest.approx(found["friction"], rel=0.01)
    assert found["friction"] > 400.0
