"""Water in films without room hands on the pressure and does not flow."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import RHO, G, block_in_a_pool, case, wall_with_uplift


def stepped(end, **sections):
    coupling = build(case(**sections), no_clock).coupling
    try:
        while coupling.time < end - 1e-9:
            coupling.step(coupling.step_size(end - coupling.time))
    finally:
        coupling.structure.close()
    return coupling


@pytest.mark.parametrize("uplift", ["full", "damage"])
def test_no_water_comes_through_the_joint_under_a_wall(uplift):
    """It squirted out of the film at the dry foot with all of the head, and the surface went with it: 0.06 m³ a second
    stood up behind the wall, taken from the basin."""
    coupling = stepped(1.0, **wall_with_uplift(uplift))
    water = coupling.water
    behind = water.topology.nodes[:, 0] > 3.79
    assert water.nodal_water[behind].sum() < 1e-6
    assert abs(water.report.reinserted) < 2e-5


def test_still_water_stays_still_beside_a_loose_block_against_a_side():
    """The film between block and side ends in the surface: the motion of its water fed a sway of the pool that grew
    from 0.01 to 0.8 J within seconds."""
    coupling = stepped(4.0, **block_in_a_pool((4, 1), 4, 5))
    assert coupling.water.kinetic_energy() < 1e-4
    assert coupling.water.pressure.max() == pytest.approx(3.0 * RHO * G, rel=1e-3)
    assert np.abs(coupling.structure.velocity()).max() < 1e-4
