"""Sides that let go what comes back, by the invariants of long waves."""

import numpy as np
import pytest

from fluid.sides.absorbing import Absorber, kept_discharge
from fluid.sides.inflow import Flow
from fluid.sides.waves import n_wave, steady

G, DEPTH, STEP = 9.81, 2.0, 0.02
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
    side.update(np.full(2, h), np.tile(-u * INWARD, (2, 1)), 0.0, STEP)
    flow = side.as_flow()
    assert flow.level(0.0) == pytest.approx(h - 5.0)
    np.testing.assert_allclose(flow.velocity(np.zeros((3, 3)), 0.0), np.tile(-u * INWARD, (3, 1)), atol=1e-12)


def test_a_given_flow_that_differs_along_a_side_over_a_slope_is_left_as_it_is():
    """The mean velocity of both flows is that of their discharge: deep water counts more, as it does inside."""

    def velocity(points, time):
        return np.column_stack([0.2 + 0.5 * points[:, 1], np.zeros((len(points), 2))])

    side = Absorber(Flow(lambda time: DEPTH, velocity), INWARD, PLACES, np.array([0.0, 1.5]), G)
    depths = np.array([2.0, 0.5])
    side.update(depths, velocity(side.points(depths), 0.0), 0.0, STEP)
    assert side.height == pytest.approx(0.0, abs=1e-12)
    assert side.speed == pytest.approx(0.0, abs=1e-12)


def test_a_kept_discharge_has_the_same_bits_at_four_times_the_size():
    """Lengths times 4 and velocities times 2 are the same flow; roots of powers of two must not change the last bit."""
    random = np.random.default_rng(1)
    for h, u, inside, back in random.uniform((0.1, 0.1, 0.05, -1.0), 2.0, (500, 4)):
        depth, speed = kept_discharge(h, u, inside, back, G)
        assert kept_discharge(4 * h, 2 * u, 4 * inside, 2 * back, G) == (4 * depth, 2 * speed)


def test_given_wave_alone_is_left_as_it_is():
    h, u = simple_wave(0.4)
    side = absorber(steady(INWARD, h, u))
    side.update(np.full(2, h), np.tile(u * INWARD, (2, 1)), 0.0, STEP)
    assert side.height == pytest.approx(0.0, abs=1e-12)
    assert side.speed == pytest.approx(0.0, abs=1e-12)


def test_wave_that_comes_in_and_one_that_goes_out_pass_each_other():
    """Of small waves the levels add up and the velocities take off one another."""
    a, b = 1e-4, 0.6e-4
    c = np.sqrt(G * DEPTH)
    side = absorber(steady(INWARD, DEPTH + a, c * a / DEPTH))
    velocity = c * (a - b) / DEPTH
    side.update(np.full(2, DEPTH + a + b), np.tile(velocity * INWARD, (2, 1)), 0.0, STEP)
    assert side.height == pytest.approx(b, rel=1e-3)
    assert side.speed == pytest.approx(-c * b / DEPTH, rel=1e-3)


def test_water_that_circulates_over_an_uneven_bed_brings_nothing():
    """Out over the deep half, back twice as fast over the shallow one: what counts is the flow, not the mean speed."""
    side = Absorber(steady(INWARD, DEPTH, 0.0), INWARD, PLACES, np.array([0.0, DEPTH / 2]), G)
    side.update(np.array([DEPTH, DEPTH / 2]), np.array([-1.0, 2.0])[:, None] * INWARD, 0.0, STEP)
    assert side.height == pytest.approx(0.0, abs=1e-12)
    assert side.speed == pytest.approx(0.0, abs=1e-12)


def test_still_water_above_the_level_of_a_side_is_drawn_no_faster_than_it_can_follow():
    """Water comes off a wall that leaves it faster than some quarter of gravity: it does not pull.  While the side has
    no speed yet, it is as deep as the water, and in the end it has what the long waves lead to."""
    side, still = absorber(steady(INWARD, DEPTH, 0.0)), np.zeros((2, 3))
    for step in range(3):
        side.update(np.full(2, 1.5 * DEPTH), still, step * STEP, STEP if step else 0.0)
        assert side.speed == pytest.approx(-0.25 * G * step * STEP)
        out = np.sqrt(G * 1.5 * DEPTH) + 0.5 * side.speed
        assert side.height == pytest.approx(out**2 / G - DEPTH)
    side.update(np.full(2, 1.5 * DEPTH), still, 1.0, 10.0)
    assert side.speed == pytest.approx(np.sqrt(G * DEPTH) - np.sqrt(G * 1.5 * DEPTH))


def test_a_front_that_runs_out_is_let_go_at_once():
    side = absorber(steady(INWARD, DEPTH, 0.0))
    h, u = simple_wave(0.4)
    side.update(np.full(2, h), np.tile(-u * INWARD, (2, 1)), 0.0, 1e-6)
    assert side.speed == pytest.approx(-u)


def test_dry_side_brings_nothing():
    side = absorber(steady(INWARD, -1.0, 0.0))
    side.update(np.zeros(2), np.zeros((2, 3)), 0.0, STEP)
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


@pytest.mark.parametrize("speed", [0.01, 0.5, 3.0])
def test_a_stream_that_goes_on_behind_its_side_keeps_its_level(speed):
    assert kept_discharge(DEPTH, speed, DEPTH, speed, G) == pytest.approx((DEPTH, speed), rel=1e-12)


@pytest.mark.parametrize(
    ("inside", "u_inside"), [(1.3 * DEPTH, 0.2), (0.9 * DEPTH, 0.6), (1.1 * DEPTH, -0.3)]
)
def test_water_behind_sets_the_depth_and_all_of_the_discharge_enters(inside, u_inside):
    """The wave that comes out of the tank passes the side: -u + 2 sqrt(g h) is the same on both sides of it."""
    h, u = kept_discharge(DEPTH, 0.5, inside, u_inside, G)
    assert h * u == pytest.approx(0.5 * DEPTH, rel=1e-12)
    assert u < np.sqrt(G * h)
    assert 2.0 * np.sqrt(G * h) - u == pytest.approx(2.0 * np.sqrt(G * inside) - u_inside, rel=1e-12)


def test_water_that_falls_away_takes_the_discharge_at_the_critical_depth():
    h, u = kept_discharge(DEPTH, 0.5, 0.0, 0.0, G)
    assert h * u == pytest.approx(0.5 * DEPTH)
    assert u == pytest.approx(np.sqrt(G * h))


def test_a_fast_stream_brings_its_depth_until_a_jump_reaches_its_side():
    """0.5 m at 5 m/s has a jump to 1.366 m (momentum of both sides is equal there)."""
    h, u = 0.5, 5.0
    jump = 0.5 * h * (np.sqrt(1.0 + 8.0 * u**2 / (G * h)) - 1.0)
    assert 0.5 * G * h**2 + h * u**2 == pytest.approx(0.5 * G * jump**2 + (h * u) ** 2 / jump)
    for inside, u_inside in ((0.0, 0.0), (h, u), (0.99 * jump, 2.0)):
        assert kept_discharge(h, u, inside, u_inside, G) == (h, u)
    inside = 1.2 * jump
    drowned, slow = kept_discharge(h, u, inside, h * u / inside, G)
    assert (drowned, slow) == pytest.approx((inside, h * u / inside), rel=1e-12)


def test_side_that_keeps_its_discharge_moves_level_and_speed_together():
    side = Absorber(steady(INWARD, DEPTH, 0.5), INWARD, PLACES, np.zeros(2), G, kept_discharge)
    side.update(np.full(2, 1.2 * DEPTH), np.tile(0.4 * INWARD, (2, 1)), 0.0, STEP)
    flow = side.as_flow()
    assert side.height > 0.1 * DEPTH
    assert flow.level(0.0) * flow.velocity(np.zeros((1, 3)), 0.0)[0, 0] == pytest.approx(0.5 * DEPTH)
