"""Meshes with obtuse angles: the pressure stays definite and water at rest stays at rest."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.bodies import ConvexBodies
from fluid.domain import cut_domain
from fluid.mesh import Background, box_mesh
from fluid.parameters import WaterParameters
from fluid.water import Water
from tests.fluid.scenes import advance

N = 8
BOX = box_mesh((0, 0, 0), (1, 1, 1), 1 / N)


def jittered(share):
    """The inner nodes of the cube moved by up to `share` of a cell."""
    x = BOX.nodes.copy()
    move = np.random.default_rng(1).uniform(-share, share, x.shape) / N
    move[(x < 1e-9) | (x > 1 - 1e-9)] = 0
    return Background.from_arrays(x + move, BOX.cells)


def thin_wall(seed):
    """A plate right through the tank, 0.1 to 0.8 cells thick, at a random place and tilt."""
    random = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(random.uniform(-0.4, 0.4, 3)).as_matrix()[None]
    size = np.array([[0.05 * random.uniform(0.3, 2.0), 3.0, 3.0]])
    return ConvexBodies.boxes(np.zeros((1, 3)), size).moved(random.uniform(0.4, 0.6, (1, 3)), turn)


def test_bricks_split_into_tetrahedra_have_no_obtuse_angles():
    """So that nothing of this costs anything on the meshes that cases make."""
    assert not BOX.is_obtuse
    assert jittered(0.15).is_obtuse


@pytest.mark.parametrize(("share", "level", "seed"), [(0.15, 0.5, 0), (0.25, 0.5, 3), (0.25, 0.53, 0)])
def test_water_on_both_sides_of_a_thin_wall_stays_at_rest(share, level, seed):
    """Rows that obtuse cells made negative moved such water with 0.01 to 1 m/s within 50 steps, or conjugate gradients
    met a direction of negative curvature."""
    mesh = jittered(share)
    domain = cut_domain(mesh, thin_wall(seed), "multiple")
    water = Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters())
    for _ in range(50):
        advance(water)
    assert water.fastest() < 1e-7
