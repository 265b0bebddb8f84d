"""The load where the surface passes through the cells of a body: pushed by the water that is there now."""

import numpy as np

from coupler.commands.verify.scenes import box, column, tank, top
from yade_scripts.blocks.block import Block
from yade_scripts.dynamics.structure import Structure

CENTRE, SIZE = (0.85, 0.05, 0.45), (0.3, 0.1, 0.02)


def lifts(coupling):
    """Vertical force [N] on its only body in every step while a dam breaks and runs up the wall below it."""
    found = []
    while coupling.time < 0.8:
        found.append(coupling.step(coupling.step_size(0.8 - coupling.time)).load[0, 2])
    return np.array(found)


def scene(structure=None, solids=()):
    shape = (1.0, 0.1, 1.0), (20, 2, 20), column(0.6, 0.6)
    return tank(*shape, structure, solids, is_open=top, covers="multiple", openings="edges")


def test_a_slab_hit_from_below_is_not_pulled():
    """A sheet that runs up a wall meets a slab of half a cell. With the correction of the step before the slab was
    pulled down in the steps after each blow, where the pressure is nowhere below that of the air."""
    of_solid = lifts(scene(solids=[box(CENTRE, SIZE)]))
    assert of_solid.max() > 10.0
    assert of_solid.min() > -1e-9 * of_solid.max()
    with Structure([Block("slab", CENTRE, size=SIZE, fixed=True)]) as structure:
        of_block = lifts(scene(structure))
    np.testing.assert_allclose(of_block, of_solid, rtol=1e-6, atol=1e-6 * of_solid.max())
