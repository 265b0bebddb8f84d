"""Sides of the tank where walls stand in them: what they leave open or rough on both of their sides."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.viscous.wall_friction import OFF_WALL, log_law
from tests.fluid.scenes import tank

SIZE, THICK = (1.6, 0.8, 0.4), 0.02


def divided(middle=0.4, covers="multiple", **settings):
    """Water 0.2 m deep in a tank with a thin wall along it that ends in the side x+."""
    wall = ConvexBodies.boxes([[1.2, middle, 0.2]], [[0.8, THICK, 0.4]])
    return tank(SIZE, 0.1, lambda x: x[:, 2] - 0.2, wall, covers=covers, **settings)


def to_x(normal, centre):
    return normal[:, 0] > 0.5


@pytest.mark.parametrize("middle", [0.4, 0.437])
@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_an_open_side_is_open_but_for_the_walls_that_stand_in_it(middle, covers):
    """Its area is that of the side less that of the wall, and no node in the opening is without a face: with one copy
    of each node, water on one side of a thin wall could not leave."""
    water = divided(middle, covers, is_open=to_x)
    area = np.linalg.norm(water.walls.open_area, axis=1).sum()
    assert area == pytest.approx((SIZE[1] - THICK) * SIZE[2], rel=1e-9)
    nodes = np.flatnonzero(water.walls.open_node & water.topology.active)
    assert np.isin(nodes, water.walls.open_faces).all()


def test_the_floor_rubs_on_both_sides_of_a_thin_wall():
    """Drag over the two halves of the floor, of water that moves as one on a mirrored mesh: of the copies of its nodes
    one side had all, the other none."""
    water = divided(walls="friction", roughness=3e-3, split="mirrored")
    u = np.zeros_like(water.velocity)
    u[:, 0] = 1.0
    drag = water.viscous.friction.of_nodes(water, water.level_set, None, u)
    y = water.topology.nodes[water.topology.cells].mean(axis=1)[:, 1]
    side = np.zeros(len(drag))
    side[water.topology.cells[y > 0.4]] = 1.0
    on_floor = (water.topology.nodes[:, 2] < 1e-9) & (water.topology.nodes[:, 0] > 0.85)
    assert drag[on_floor & (side > 0)].sum() == pytest.approx(drag[on_floor & (side == 0)].sum(), rel=1e-9)


@pytest.mark.parametrize("bottom", [0.03, 0.0])
@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_a_floor_rubs_but_for_what_stands_on_it(bottom, covers):
    """Drag over a full tank: all of its sides under a plate just above the floor, which had lost a third there, and the
    rest of them around one on it."""
    plate = ConvexBodies.boxes([[0.8, 0.4, bottom + 0.02]], [[0.53, 0.31, 0.04]])
    rough = {"walls": "friction", "roughness": 3e-3}
    water = tank(SIZE, 0.1, lambda x: x[:, 2] - 9.0, plate, covers=covers, **rough)
    u = np.zeros_like(water.velocity)
    u[:, 0] = 1.0
    drag = water.viscous.friction.of_nodes(water, water.level_set, None, u)
    area = 2.0 * SIZE[0] * (SIZE[1] + SIZE[2]) - (0.0 if bottom else 0.53 * 0.31)
    assert drag.sum() == pytest.approx(1000.0 * log_law(OFF_WALL * 0.1, 3e-3) * area, rel=1e-9)
