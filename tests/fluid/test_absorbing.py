"""Sides that let go what comes back, by the invariants of long waves."""

import numpy as np
import pytest

from fluid.sides.absorbing import Absorber
from fluid.sides.waves import n_wave, steady

G, DEPTH = 9.81, 2.0
INWARD = np.array([1.0, 0.0, 0.0])
PLACES = np.array([[0.5, 0.0], [0.5, 1.0]])


def absorber(flow, bed=0.0):
    return Absorber(flow, INWARD, PLACES, np.full(2, bed), G)


def simple_wave(height):
    """Depth and velocity in its direction of a long wave into still water (Stoker 1957, 10.4)."""
    h = DEPTH + height
    return h, 2.0 * (np.sqrt(G * h) - np.sqrt(G * DEPTH))


@pytest.mark.parametrize("height", [0.3, -0.3])
def test_long_wave_of_any_height_goes_out_as_if_the_water_went_on(height):
    h, u = simple_wave(height)
    side = absorber(steady(INWARD, DEPTH - 5.0, 0.0), bed=-5.0)
    side.update(np.full(2, h), np.tile(-u * INWARD, (2, 1)), 0.0)
    flow = side.as_flow()
    assert flow.level(0.0) == pytest.approx(h - 5.0)
    np.testing.assert_allclose(flow.velocity(np.zeros((3, 3)), 0.0), np.tile(-u * INWARD, (3, 1)), atol=1e-12)


def test_given_wave_alone_is_left_as_it_is():
    h, u = simple_wave(0.4)
    side = absorber(steady(INWARD, h, u))
    side.update(np.full(2, h), np.tile(u * INWARD, (2, 1)), 0.0)
    assert side.height == pytest.approx(0.0, abs=1e-12)
    assert side.speed == pytest.approx(0.0, abs=1e-12)


def test_wave_that_comes_in_and_one_that_goes_out_pass_each_other():
    """Of small waves the levels add up and the velocities take off one another."""
    a, b = 1e-4, 0.6e-4
    c = np.sqrt(G * DEPTH)
    side = absorber(steady(INWARD, DEPTH + a, c * a / DEPTH))
    velocity = c * (a - b) / DEPTH
    side.update(np.full(2, DEPTH + a + b), np.tile(velocity * INWARD, (2, 1)), 0.0)
    assert side.height == pytest.approx(b, rel=1e-3)
    assert side.speed == pytest.approx(-c * b / DEPTH, rel=1e-3)


def test_water_that_circulates_over_an_uneven_bed_brings_nothing():
    """Out over the deep half, back twice as fast over the shallow one: what counts is the flow, not the mean speed."""
    side = Absorber(steady(INWARD, DEPTH, 0.0), INWARD, PLACES, np.array([0.0, DEPTH / 2]), G)
    side.update(np.array([DEPTH, DEPTH / 2]), np.array([-1.0, 2.0])[:, None] * INWARD, 0.0)
    assert side.height == pytest.approx(0.0, abs=1e-12)
    assert side.speed == pytest.approx(0.0, abs=1e-12)


def test_dry_side_brings_nothing():
    side = absorber(steady(INWARD, -1.0, 0.0))
    side.update(np.zeros(2), np.zeros((2, 3)), 0.0)
    assert (side.height, side.speed) == (0.0, 0.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_n_wave_has_trough_and_crest_of_its_height_and_no_volume(sign):
    flow = n_wave(INWARD, -DEPTH, DEPTH, 0.2, G, 20.0, sign)
    time = np.linspace(0.0, 40.0, 8001)
    level = np.array([flow.level(t) for t in time])
    assert level.max() == pytest.approx(0.2, rel=1e-4)
    assert level.min() == pytest.approx(-0.2, rel=1e-4)
    assert (time[level.argmax()] - time[level.argmin()]) * sign > 0.0
    u = np.array([flow.velocity(np.zeros((1, 3)), t)[0, 0] for t in time])
    brought = np.trapezoid(u * (DEPTH + level), time)
    assert abs(brought) < 1e-6 * np.trapezoid(np.abs(u) * DEPTH, time)
