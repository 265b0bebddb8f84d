"""Gauges read what is there: a pool at rest has its level, its pressure and its volume everywhere."""

import numpy as np
import pytest

from fluid import gauges
from fluid.bodies import ConvexBodies
from tests.fluid.scenes import advance, column, load, tank


@pytest.fixture(scope="module")
def pool():
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437)
    advance(water, 0.01)
    return water


def test_level(pool):
    for xy in ([0.5, 0.5], [0.01, 0.99], [0.0, 0.0], [1.0, 0.3]):
        assert abs(gauges.level(pool, xy) - 0.437) < 1e-9


def test_pressure_at_depth_and_in_the_air(pool):
    p = gauges.pressure(pool, [[0.3, 0.4, 0.1], [0.3, 0.4, 0.9]])
    np.testing.assert_allclose(p, [9810 * 0.337, 0.0], rtol=1e-6)


def test_velocity_at_rest(pool):
    assert np.abs(gauges.velocity(pool, [[0.3, 0.4, 0.1]])).max() < 1e-9


def test_level_is_the_wet_length():
    """A sheet of water in the air over a pool counts with its thickness, not with its height."""
    water = tank([1, 1, 1], 0.125, lambda x: np.minimum(x[:, 2] - 0.3, np.abs(x[:, 2] - 0.75) - 0.19))
    assert abs(gauges.level(water, (0.51, 0.32)) - 0.68) < 0.01


def test_volume_of_all_and_of_a_half(pool):
    np.testing.assert_allclose(gauges.volume_in_box(pool, [0, 0, 0], [1, 1, 1]), 0.437, rtol=1e-9)
    np.testing.assert_allclose(gauges.volume_in_box(pool, [0, 0, 0], [0.5, 1, 1]), 0.437 / 2, rtol=1e-9)


def test_gauge_outside_the_tank_is_refused(pool):
    with pytest.raises(gauges.Outside, match="lies outside the tank"):
        gauges.pressure(pool, [[2.0, 0.5, 0.5]])


def test_pressure_on_the_face_of_a_solid():
    """A gauge on the wall of a box that is flush with cell faces reads the water, one inside reads nothing."""
    box = ConvexBodies.boxes(np.array([[0.5, 0.5, 0.25]]), np.array([[0.5, 0.5, 0.5]]))
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.8, box)
    advance(water, 0.01)
    for x in (0.25, 0.75):
        np.testing.assert_allclose(gauges.pressure(water, [x, 0.5, 0.3]), 9810 * 0.5, rtol=1e-6)
    assert np.isnan(gauges.pressure(water, [0.5, 0.5, 0.25]))


def test_pressure_read_is_the_pressure_that_acts():
    """The nodal pressure summed over the wetted faces of a box is the load on it, also while a front hits it and
    the pressures of start and end of the step differ: a gauge must not read more than the structure feels."""
    box = ConvexBodies.boxes(np.array([[0.75, 0.25, 0.2]]), np.array([[0.2, 0.5, 0.4]]))
    water = tank([1, 0.5, 0.5], 0.0625, column(0.5, 0.4), box)
    largest = 0.0
    for _ in range(40):
        problem, x = advance(water)
        acted = problem.other_load - (water.coupling.T @ water.pressure).reshape(-1, 6)
        np.testing.assert_allclose(acted, load(problem, x), rtol=1e-9, atol=1e-9)
        largest = max(largest, np.abs(water.end_pressure - water.pressure).max())
    assert largest > 100.0, "the scene has no impact in which the two could be confused"
