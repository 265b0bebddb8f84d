"""Blocks in a thick liquid that sticks to them: the step that the coupling chooses lets their spin die away."""

import numpy as np
import pytest

from coupler.loop import SHEAR
from coupler.observe import surface_area
from coupler.verify.scenes import level_at, tank
from yade_scripts.blocks import BOX_CORNERS, BOX_FACES, Block
from yade_scripts.structure import Structure

THICK = 200.0
"""Viscosity [Pa s]."""


def spinning_cube(structure):
    """Full, closed tank of half a metre with a cube of four cells."""
    return tank((0.5, 0.5, 0.5), (8, 8, 8), level_at(9.0), structure, viscosity=THICK, walls="no-slip")


def test_the_surface_of_a_box_is_that_of_its_six_faces():
    size = np.array([0.3, 0.4, 0.5])
    exact = 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0])
    assert surface_area(0.5 * size * BOX_CORNERS, BOX_FACES) == pytest.approx(exact)


def test_the_spin_of_a_block_dies_away_and_does_not_turn_round():
    """The shear of a step goes by the velocity at its start: a long step would turn the spin, and let it grow. (At the
    density of the liquid it does at any step: the cells that stick to the cube weigh more than it.)"""
    edge, density = 0.25, 8000.0
    block = Block("cube", (0.25, 0.25, 0.25), size=edge, density=density, spin=(0.0, 0.0, 1.0))
    with Structure([block]) as s:
        c = spinning_cube(s)
        dt = c.step_size(1e6)
        assert dt == pytest.approx(SHEAR * density * edge / 6.0 * 0.0625 / THICK, rel=1e-3)
        spins = [1.0]
        for _ in range(12):
            c.step(dt)
            spins.append(s.velocity()[0, 5])
    assert (np.diff(spins) < 0.0).all()
    assert spins[-1] > 0.0
