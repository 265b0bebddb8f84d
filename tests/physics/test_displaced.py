"""The water that blocks take as they move: by the wet part of their surface, and by nothing else."""

import numpy as np
import pytest

from coupler.commands.verify.scenes import level_at, tank
from fluid.pressure.displaced import taken_from_nodes
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

SIZE, CELLS, LEVEL, EDGE = (1.0, 1.0, 1.0), (8, 8, 8), 0.4, 0.3


def taken(height, way, covers):
    """Volume (N,) [m³] that a cube at a height [m] takes on a way (6,), and the nodes (N, 3)."""
    with Structure([Block("b", (0.5, 0.5, height), size=EDGE)]) as s:
        water = tank(SIZE, CELLS, level_at(LEVEL), s, covers=covers).water
        phi = water.topology.nodes[:, 2] - LEVEL
        ways = np.zeros((water.domain.n_bodies, 6))
        ways[0] = way
        return taken_from_nodes(water.domain, water.coupling, phi, ways), water.topology.nodes


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_a_cube_takes_what_the_wet_part_of_its_faces_sweeps(covers):
    """Half a cube under water: down it takes the area of its base, to a side the wet part of one face, which the other
    gives back, and in turning about the upright as much as it gives."""
    d = 1e-6
    for height in (0.4, 0.43):
        wet = LEVEL - (height - 0.5 * EDGE)
        down, _ = taken(height, (0, 0, -d, 0, 0, 0), covers)
        assert down.sum() == pytest.approx(d * EDGE**2, rel=1e-9)
        aside, nodes = taken(height, (d, 0, 0, 0, 0, 0), covers)
        assert aside[nodes[:, 0] > 0.51].sum() == pytest.approx(d * EDGE * wet, rel=1e-9)
        assert aside.sum() == pytest.approx(0.0, abs=1e-9 * d)
        turned, _ = taken(height, (0, 0, 0, 0, 0, d), covers)
        assert turned.sum() == pytest.approx(0.0, abs=1e-9 * d)


def test_nothing_at_all_is_taken_above_the_cells_of_the_surface():
    """Half of a turned cube is in the air, where what it pushes is air: not even round-off of water is left there."""
    way = 1e-3 * np.array([1.0, -0.7, 0.4, 0.3, -0.2, 0.5])
    found, nodes = taken(0.43, way, "single")
    assert (found[nodes[:, 2] > LEVEL + SIZE[2] / CELLS[2]] == 0.0).all()
    assert np.count_nonzero(found) > 20


def test_a_cube_in_the_air_of_wet_cells_takes_nothing():
    """Its base is 1 mm above the water, in cells that hold some."""
    for way in np.eye(6):
        assert np.abs(taken(LEVEL + 0.5 * EDGE + 1e-3, way, "single")[0]).max() < 1e-15


@pytest.mark.parametrize("height", [0.57, 0.7])
def test_the_books_close_while_a_light_block_falls_towards_a_pool(height):
    """Its base is in cells that hold water, or in those above them: next to nothing is put in by then, a hundred
    thousandth of what the pool holds, and the pool must not gain a thousandth of that."""
    with Structure([Block("b", (0.5, 0.5, height), size=EDGE, density=20.0)], ContactLaw(1e5, 0.3)) as s:
        c = tank(SIZE, CELLS, level_at(LEVEL), s, rtol=1e-9)
        assert max(c.step(2e-3).balance.energy_error for _ in range(8)) < 1e-3


def test_what_falls_beside_a_falling_block_releases_the_same_energy():
    """A slab of water, alone and with a block in the air before it, which its cells reach: what the surface lacks of
    the first two steps was made up for as that of calm water that bodies push, and the slab seemed to gain an eighth of
    its kinetic energy."""
    held = []
    for blocks in ([], [Block("b", (0.52, 0.5, 0.8), size=0.1)]):
        with Structure([*blocks, Block("a", (0.75, 0.5, 0.1), size=0.1)], ContactLaw(1e5, 0.3)) as s:
            slab = tank(
                SIZE, CELLS, lambda x: np.maximum(np.abs(x[:, 2] - 0.7) - 0.2, x[:, 0] - 0.4), s, rtol=1e-9
            )
            for _ in range(4):
                slab.step(0.01)
            held.append(slab.water.kinetic_energy() + slab.water.potential_energy())
    assert held[1] == pytest.approx(held[0], abs=5e-3 * slab.water.kinetic_energy())
