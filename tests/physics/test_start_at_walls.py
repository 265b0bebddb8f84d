"""The first steps of still water whose boxes end at the faces of walls that let it under them."""

import numpy as np
import pytest

from coupler.scene.build import build
from tests.fakes import no_clock
from tests.physics.scenes import RHO, STIFF_CONTACT, G, block_in_a_pool, case, wall_with_uplift


def loads(steps=4, **sections):
    """Horizontal and vertical force [N] of the water on all blocks in each of the first steps."""
    coupling = build(case(**sections), no_clock).coupling
    try:
        return np.array(
            [coupling.step(coupling.step_size(1.0)).load[:, [0, 2]].sum(axis=0) for _ in range(steps)]
        )
    finally:
        coupling.structure.close()


def test_a_loose_wall_that_ends_on_planes_of_nodes_has_its_thrust_at_once():
    """3 m against 1 m. Where nodes in the slivers along its face, drawn in for the film under it, were dry, the surface
    stood in the heel, and the thrust swung between 6 and 66 kN for half a second."""
    found = loads(
        time={"end": 1.0, "step_max": 1 / 30},
        tank={"lower": [0, 0, 0], "upper": [12, 1, 4.5], "cell": 0.25},
        water={"fill": [{"lower": [0, 0, 0], "upper": [5, 1, 3]}, {"lower": [7, 0, 0], "upper": [12, 1, 1]}]},
        structure={"density": 2400.0, "block": [{"name": "quay", "centre": [6, 0.5, 2], "size": [2, 1, 4]}]},
        contact=STIFF_CONTACT,
    )
    assert found[:, 0] == pytest.approx(0.5 * RHO * G * (3.0**2 - 1.0), rel=0.025)


def test_a_joined_wall_that_settles_has_its_thrust_at_once():
    """The wall leans as it settles and its heel opens by a fifth of a millimetre. With the surface in this wedge, the
    first steps had 40, 160 and 80 % of the thrust."""
    found = loads(**wall_with_uplift("full"))
    assert found[:, 0] == pytest.approx(0.5 * RHO * G * 2.2**2, rel=0.01)


@pytest.mark.parametrize("height", [3.99, 4.0])
def test_water_gets_under_a_block_as_high_as_its_tank(height):
    """Its weight less that of the water: reaching from floor to top counted as reaching from side to side, which closes
    the faces along both, and the block had no uplift at all."""
    found = loads(**block_in_a_pool((4, 3), height, 4))
    assert found[1:, 1] == pytest.approx(RHO * G * 3.0 * 4.0, rel=0.01)
