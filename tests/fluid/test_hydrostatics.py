"""Water at rest stays at rest, at any level, tilt and cut, and carries bodies with the exact load."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from tests.fluid.scenes import advance, load, rotation, tank

WEIGHT = 1000.0 * 9.81


def box(centre, size, turn):
    return ConvexBodies.boxes(np.array([centre]), np.array([size]), np.array([turn]))


@pytest.mark.parametrize("offset", [0.0, 1e-6, 0.01, 0.37, 0.99])
def test_level_anywhere_between_two_layers_of_nodes(offset):
    """Surface through the nodes, a hair above them, and anywhere between: the symmetric ghost condition is exact
    for a linear pressure, so nothing may move."""
    level = 0.5 + 0.125 * offset
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - level)
    for _ in range(50):
        advance(water, 0.01)
    assert np.abs(water.velocity).max() < 1e-9
    depth = np.maximum(level - water.topology.nodes[:, 2], 0)
    np.testing.assert_allclose(water.pressure, WEIGHT * depth, atol=1e-6 * WEIGHT)
    assert abs(water.volume() - level) < 1e-6


@pytest.mark.parametrize(("tilt", "yaw"), [(0.2, 0.3), (0.5, 0.0), (0.7, 1.0)])
def test_tilted_tank(tilt, yaw):
    up = np.array([np.sin(tilt) * np.cos(yaw), np.sin(tilt) * np.sin(yaw), np.cos(tilt)])
    water = tank([1, 1, 1], 0.125, lambda x: (x - [0.5, 0.5, 0.53]) @ up, down=tuple(-up))
    for _ in range(50):
        advance(water, 0.01)
    assert np.abs(water.velocity).max() < 1e-8


def test_noise_does_not_grow():
    """A surface just above a layer of nodes once amplified noise by 1.1 a step; it must decay or stay."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.5 - 1e-4 * 0.125)
    water.velocity[:] = np.random.default_rng(0).normal(0, 1e-5, water.velocity.shape)
    for _ in range(150):
        advance(water, 0.02, rtol=1e-7)
    assert np.abs(water.velocity).max() < 1e-4


@pytest.mark.parametrize("turn", [np.eye(3), rotation([1, 2, 3], 0.7)], ids=["straight", "turned"])
def test_sunken_box_feels_exactly_its_buoyancy(turn):
    """Archimedes, force and moment, for a box at an arbitrary position: integration over the cut is exact."""
    size = [0.3, 0.25, 0.2]
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.78, box([0.5, 0.45, 0.4], size, turn))
    for _ in range(20):
        problem, x = advance(water, 0.01)
    expected = np.array([[0, 0, WEIGHT * np.prod(size), 0, 0, 0]])
    np.testing.assert_allclose(load(problem, x), expected, atol=1e-6 * WEIGHT * np.prod(size))
    assert np.abs(water.velocity).max() < 1e-8


def test_upright_box_through_the_surface():
    """Half out of the water: draft times area, and no current along the water line."""
    water = tank(
        [1, 1, 1], 0.125, lambda x: x[:, 2] - 0.53, box([0.5, 0.45, 0.5], [0.3, 0.25, 0.4], np.eye(3))
    )
    for _ in range(20):
        problem, x = advance(water, 0.01)
    np.testing.assert_allclose(load(problem, x)[0, 2], WEIGHT * 0.3 * 0.25 * 0.23, rtol=1e-9)
    assert np.abs(water.velocity).max() < 1e-8


def test_closed_full_tank_has_a_pressure_and_rests():
    """No free surface: the pressure level is free, and the matrix would be singular without the compressibility."""
    size = [0.26, 0.22, 0.24]
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 10.0, box([0.5, 0.5, 0.5], size, np.eye(3)))
    for _ in range(5):
        problem, x = advance(water, 0.01)
    assert np.abs(water.velocity).max() < 1e-8
    np.testing.assert_allclose(load(problem, x)[0, 2], WEIGHT * np.prod(size), rtol=1e-8)


def test_tank_without_water_runs():
    """Dry: nothing to solve, nothing to move."""
    water = tank([1, 1, 1], 0.25, lambda x: np.full(len(x), 1.0))
    for _ in range(3):
        problem, _ = advance(water, 0.01)
    assert len(problem.dofs) == 0
    assert water.volume() == 0.0


def test_noise_dies_where_the_surface_lies_just_below_a_layer_of_nodes():
    """Grid-scale noise of 1e-5 m/s in still water, at two thirds of the largest step: a continuation of the velocity
    that follows its slope let it grow fivefold in these 200 steps."""
    n, rng = 10, np.random.default_rng(0)
    water = tank([1, 1, 1], 1 / n, lambda x: x[:, 2] - 0.5 - 0.95 / n)
    speed = []
    for step in range(200):
        advance(water, 0.02)
        if step == 2:
            water.velocity += 1e-5 * rng.standard_normal(water.velocity.shape)
        speed.append(np.abs(water.velocity).max())
    assert speed[-1] < speed[10]


def ramp(run, level, cell=0.1, foot=0.4):
    """A slice with a fixed slope of 1 in `run` from x = foot on, which cuts the cells, and water to `level`."""
    length = foot + run * (level + 0.2)
    angle, thick = np.arctan(1 / run), 4.0 * length
    turn = np.array([[np.cos(angle), 0, -np.sin(angle)], [0, 1, 0], [np.sin(angle), 0, np.cos(angle)]])
    centre = np.array([foot, cell, 0.0]) - 0.5 * thick * turn[:, 2]
    slope = box(centre, [2 * thick, 4.0, thick], turn)
    size = [cell * np.ceil(length / cell), 2 * cell, cell * np.ceil(level / cell + 3)]
    return tank(size, cell, lambda x: x[:, 2] - level, slope)


@pytest.mark.parametrize("level", [0.3, 0.31, 0.337])
@pytest.mark.parametrize("run", [2, 5, 20])
def test_water_line_on_a_slope_that_cuts_the_cells(run, level):
    """Beyond the water line nodes of cut cells lie below the surface, but all their fluid is air; on the line, velocity
    of one cell's wave length and the surface fed each other. Such water once moved with 0.1 to 0.5 m/s."""
    water = ramp(run, level)
    for _ in range(60):
        advance(water)
    assert np.abs(water.velocity[water.level_set < 0.0]).max() < 1e-7


def test_noise_on_a_slope_does_not_grow():
    """Noise of 1e-6 m/s grew by 0.02 a step beside a slope of 1:5, to a tenfold in 120 steps."""
    water = ramp(5, 0.337)
    water.velocity += 1e-6 * np.random.default_rng(0).standard_normal(water.velocity.shape)
    for _ in range(150):
        advance(water)
    assert np.abs(water.velocity[water.level_set < 0.0]).max() < 5e-6
