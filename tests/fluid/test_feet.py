"""Paths on the virtual mesh end on the side of the wall they started from."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.bodies import ConvexBodies
from fluid.domain import cut_domain
from fluid.feet import reached_elements
from fluid.mesh import box_mesh

H = 1 / 8
MESH = box_mesh((0, 0, 0), (1, 1, 1), H)


@pytest.mark.parametrize("thickness", [0.1, 0.5, 1.2])
def test_no_path_crosses_a_wall(thickness):
    """Random steps of up to one cell from every node copy: an element on the same side, or none; and never
    none where the whole step stays clear of the wall."""
    turn = Rotation.from_euler("yz", [0.2, -0.15]).as_matrix()
    point = np.array([0.52, 0.5, 0.5])
    bodies = ConvexBodies.boxes([point], [[thickness * H, 4, 4]], turn[None])
    domain = cut_domain(MESH, bodies, "multiple")
    across = (domain.centroid - point) @ turn[:, 0]
    node_side = np.zeros(len(domain.nodes))
    node_side[domain.cells] = np.sign(across)[:, None]
    rng = np.random.default_rng(0)
    for _ in range(5):
        step = rng.uniform(-H, H, domain.nodes.shape) / np.sqrt(3)
        target = np.clip(domain.nodes + step, 1e-6, 1 - 1e-6)
        reached = reached_elements(domain, np.arange(len(domain.nodes)), target)
        found = reached >= 0
        np.testing.assert_array_equal(np.sign(across[reached[found]]), node_side[found])
        depth = (target - point) @ turn[:, 0] * node_side
        assert found[depth > thickness * H / 2 + 1e-9].all()


def test_the_end_of_the_mesh_is_out_of_reach():
    domain = cut_domain(MESH, ConvexBodies.empty(), "multiple")
    reached = reached_elements(domain, [0, 0], [[-0.1, 0, 0], [0.05, 0.05, 0.05]])
    assert reached[0] == -1
    assert reached[1] >= 0
