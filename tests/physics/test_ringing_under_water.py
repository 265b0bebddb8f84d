"""A heavy block that rings on a light one under water: the energy of the water goes by work alone."""

import numpy as np
import pytest

from coupler.commands.stress.coupling.bodies import WALLS, pool
from coupler.commands.verify.scenes import G
from fluid.pressure.film_volume import film_volume
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

EDGE, STIFFNESS = 0.2, 1e7


def stack():
    """Two cubes flush on the bed, 20 and 20 000 kg/m³."""
    blocks = [
        Block("light", (0.52, 0.47, 0.5 * EDGE), size=EDGE, density=20.0),
        Block("heavy", (0.52, 0.47, 1.5 * EDGE), size=EDGE, density=20000.0),
    ]
    return Structure(blocks, ContactLaw(STIFFNESS, 0.1), ground=0.0, planes=WALLS)


def test_films_that_open_and_close_take_no_energy_from_the_water():
    """Contacts close and open by 0.15 mm, and the films drawn in for them with it, over half a second. As water of the
    scene they moved 0.2 J to and fro, of 1.1 J put in; flush faces kept their water out until their contact began."""
    with stack() as structure:
        coupling = pool(structure)
        balances = []
        while coupling.time < 0.5:
            balances.append(coupling.step(coupling.step_size(1.0 - coupling.time)).balance)
    taken = [balance.numerical_dissipation for balance in balances]
    assert balances[-1].input_energy > 0.5
    assert max(abs(energy) for energy in taken) < 2e-3
    assert coupling.water.film_volume > 0.0


def test_films_hold_what_the_faces_that_water_reaches_are_drawn_in_by():
    """The bottom of each cube and the top of the light one, by a ten-thousandth of a cell, as all other faces."""
    with stack() as structure:
        coupling = pool(structure)
        water, film = coupling.water, 1e-4 * coupling.water.mesh.finest
        wet = 2 * 6 * EDGE**2
        assert water.film_volume == pytest.approx(wet * film, rel=1e-3)
        assert water.film_potential / water.film_volume == pytest.approx(-G * EDGE, rel=1e-3)
        dry = np.ones_like(water.level_set)
        none = film_volume(water.domain, water.films.drawn_in, dry, water.nodes_below_floor)
        assert none == (0.0, 0.0)
