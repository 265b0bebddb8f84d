"""Impulses, means and peaks do not depend on how the time is cut into steps; patches cover their area evenly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler.results.gauge_windows import Windows
from coupler.results.gauges import disc, free_mean, parallelogram

STEPS = st.lists(st.tuples(st.floats(1e-3, 0.5), st.floats(-10, 10)), min_size=1, max_size=30)


def run(windows, steps):
    time, reported = 0.0, None
    for dt, value in steps:
        time += dt
        reported = windows.add(time, dt, value)
    return time, reported


@given(STEPS)
def test_impulse_over_all_time_is_the_sum(steps):
    _, (total,) = run(Windows((0.0, 1e9), None), steps)
    assert total == pytest.approx(sum(dt * v for dt, v in steps), abs=1e-9)


@given(STEPS)
def test_halving_every_step_changes_nothing(steps):
    """Windows cut through steps: impulse and mean are integrals of the held values, wherever the steps end."""
    halves = [(0.5 * dt, v) for dt, v in steps for _ in range(2)]
    one, two = Windows((0.2, 0.7), 0.3), Windows((0.2, 0.7), 0.3)
    np.testing.assert_allclose(run(one, steps)[1][:2], run(two, halves)[1][:2], atol=1e-9)


def test_mean_of_a_jump_rises_linearly_and_its_peak_stays():
    windows = Windows(None, 0.4)
    reported = [windows.add(0.1 * (k + 1), 0.1, 0.0 if k < 10 else 2.0 if k < 30 else 0.0) for k in range(40)]
    mean, peak = np.array(reported).T
    np.testing.assert_allclose(mean[9:15], [0.0, 0.5, 1.0, 1.5, 2.0, 2.0], atol=1e-12)
    assert mean[-1] == pytest.approx(0.0, abs=1e-12)
    assert peak[-1] == pytest.approx(2.0)


def test_vectors_have_a_column_for_each_component_and_the_peak_of_their_length():
    windows = Windows((0.0, 1.0), 0.1)
    names = [name for name, *_ in windows.columns("g", "N", ("_x", "_y", "_z"))]
    reported = dict(zip(names, windows.add(0.5, 0.5, [3.0, 0.0, 4.0])))
    assert reported["g_impulse_x"] == pytest.approx(1.5)
    assert reported["g_mean_z"] == pytest.approx(4.0)
    assert reported["g_peak"] == pytest.approx(5.0)


def test_points_of_a_disc_have_its_moments():
    """Mean of r² is R²/2 by construction; the points lie in the plane, around the centre."""
    normal = np.array([1.0, 2.0, -1.0])
    points = disc([1, 2, 3], 0.4, normal) - [1, 2, 3]
    assert np.mean((points**2).sum(axis=1)) == pytest.approx(0.5 * 0.4**2, rel=1e-12)
    np.testing.assert_allclose(points @ normal, 0.0, atol=1e-12)
    np.testing.assert_allclose(points.mean(axis=0), 0.0, atol=1e-12)


def test_points_of_a_parallelogram_are_its_middle_on_the_mean():
    points = parallelogram([1, 2, 3], [[0.2, 0, 0], [0.1, 0, 0.3]])
    np.testing.assert_allclose(points.mean(axis=0), [1, 2, 3])
    np.testing.assert_allclose(np.ptp(points[:, 2]), 0.25)


def test_units_of_sums_over_time():
    """A force gives newton seconds, a flux the volume that has passed."""
    units = [Windows((0.0, 1.0), None).columns("g", unit, ("",))[0][1] for unit in ("N", "Pa", "m3/s")]
    assert units == ["N s", "Pa s", "m3"]


def test_steps_without_a_value_leave_sums_means_and_peaks_alone():
    """A block lies over the place from 0.2 to 0.6 s: the mean of the last 0.2 s goes over what was measured in it, is
    NaN where that is nothing, and impulse and peak go on from what they were."""
    windows = Windows((0.0, 1.0), 0.2)
    values = [1.0, 3.0, np.nan, np.nan, np.nan, np.nan, 2.0]
    reported = np.array([windows.add(0.1 * (k + 1), 0.1, v) for k, v in enumerate(values)])
    np.testing.assert_allclose(reported[:, 0], [0.1, 0.4, 0.4, 0.4, 0.4, 0.4, 0.6])
    np.testing.assert_allclose(reported[:, 1], [1.0, 2.0, 3.0, np.nan, np.nan, np.nan, 2.0])
    np.testing.assert_allclose(reported[:, 2], [1.0, 2.0, 3.0, 3.0, 3.0, 3.0, 3.0])
    assert np.isfinite(windows.save()["steps"]).all()  # checkpoints hold numbers only


def test_a_patch_reads_its_free_part_and_says_how_much_is_covered():
    assert free_mean(np.array([4.0, np.nan, 8.0, np.nan])) == (6.0, 0.5)
    mean, covered = free_mean(np.full(3, np.nan))
    assert np.isnan(mean)
    assert covered == 1.0


def test_only_what_lies_in_the_window_counts():
    """2 N over 1 s in steps of 0.1 s, from 0.35 to 0.75 s: 0.8 N s, steps cut at both ends."""
    _, (impulse,) = run(Windows((0.35, 0.75), None), [(0.1, 2.0)] * 10)
    assert impulse == pytest.approx(0.8, rel=1e-12)
