"""Where the water stands at the start, from boxes of a case."""

import numpy as np
import pytest

from coupler.fill import start_level
from fluid.bodies import ConvexBodies
from fluid.domain import cut_domain
from fluid.mesh import box_mesh
from fluid.parameters import WaterParameters
from fluid.water import Water
from tests.fluid.scenes import advance

TANK = ((0.0, 0.0, 0.0), (1.0, 0.5, 0.5))
CELL = 0.125


def water_in(boxes):
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, ConvexBodies.empty())
    return Water(mesh, domain, start_level(boxes, TANK, mesh, domain), WaterParameters())


@pytest.mark.parametrize("seam", [0.5, 0.5 * CELL])
def test_boxes_that_touch_are_one_pool(seam):
    """The distance to both is zero on the face that they share: taken as a surface, the water falls apart there."""
    halves = [((0.0, 0.0, 0.0), (seam, 0.5, 0.3)), ((seam, 0.0, 0.0), (1.0, 0.5, 0.3))]
    water, whole = water_in(halves), water_in([((0.0, 0.0, 0.0), (1.0, 0.5, 0.3))])
    assert water.volume() == pytest.approx(whole.volume(), rel=1e-12)
    for _ in range(10):
        advance(water)
    assert np.abs(water.velocity).max() < 1e-9


def test_boxes_on_top_of_each_other_keep_their_own_surfaces():
    """A step of two boxes: water to 0.25 m over one half, to 0.375 m over the other; only the seam goes."""
    low, high = ((0.0, 0.0, 0.0), (1.0, 0.5, 0.25)), ((0.0, 0.0, 0.25), (0.5, 0.5, 0.375))
    assert water_in([low, high]).volume() == pytest.approx(0.125 + 0.03125, rel=0.03)
