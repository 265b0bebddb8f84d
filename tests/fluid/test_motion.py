"""Water in motion: free fall, sloshing, a dam break, symmetry, and the volume through all of it."""

import numpy as np
import pytest

from coupler.commands.verify.figures import columns
from tests.fluid.scenes import advance, column, tank


def test_blob_falls_freely():
    """No wall and no pressure: the centre falls g t²/2 (to 4 %, five cells across), momentum is m g t."""
    water = tank([1, 1, 2], 0.125, lambda x: np.linalg.norm(x - [0.5, 0.5, 1.4], axis=1) - 0.3)
    mass = 1000.0 * water.volume()
    start = water.nodal_water @ water.topology.nodes / water.volume()
    while water.time < 0.25:
        advance(water, 0.0125)
    fallen = start - water.nodal_water @ water.topology.nodes / water.volume()
    np.testing.assert_allclose(fallen, [0, 0, 0.5 * 9.81 * water.time**2], atol=0.04 * fallen[2])
    np.testing.assert_allclose(water.momentum()[2], -mass * 9.81 * water.time, rtol=0.02)
    assert abs(water.volume_error()) < 1e-6


def test_sloshing_has_the_linear_frequency_and_little_damping():
    """ω² = g k tanh(k d), first mode of a 1 m tank (sloshing_linear.csv): a coarse run over two periods."""
    omega = columns("sloshing_linear")["omega"][0]
    n, amplitude = 16, 0.01
    water = tank(
        [1, 2 / n, 10.5 / n],
        [1 / n, 1 / n, 1 / n],
        lambda x: x[:, 2] - 0.5 - amplitude * np.cos(np.pi * x[:, 0]),
    )
    period, mode = 2 * np.pi / omega, []
    dt = period / 50
    for _ in range(100):
        advance(water, dt, rtol=1e-7)
        mode.append(2 * (water.nodal_water @ np.cos(np.pi * water.topology.nodes[:, 0])) * n / 2)
    t = dt * np.arange(1, 101)
    found = _fit(t, np.array(mode), omega)
    assert abs(found[0] / omega - 1) < 0.01
    assert 0.0 < found[1] < 0.02


def _fit(t, signal, omega):
    """Frequency and damping ratio of A e^{-ζωt} cos(ωt + φ) + c by least squares."""
    from scipy.optimize import curve_fit

    def model(t, A, w, zeta, phase, c):
        return A * np.exp(-zeta * w * t) * np.cos(w * t + phase) + c

    return curve_fit(model, t, signal, [signal.max(), omega, 0.003, 0.0, 0.0])[0][1:3]


def test_dam_break_keeps_its_volume_and_loses_energy_slowly():
    """Through collapse, impact on the far wall and back: volume to 1e-3, every litre put back counted, energy never
    above what there was by more than 3 %."""
    water = tank([1.0, 0.25, 0.75], 0.0625, column(0.36, 0.53))
    available, moved = water.available_energy(), 0.0
    while water.time < 1.0:
        advance(water, rtol=1e-6)
        moved += abs(water.report.reinserted)
        assert abs(water.report.volume_error) < 1e-3
        assert water.available_energy() < 1.03 * available
    assert moved < 0.05 * water.initial_volume
    assert np.isfinite(water.velocity).all()


def test_front_of_a_dam_break_runs_as_far_as_measured():
    """Martin & Moyce: at T = t sqrt(2g/a) = 2 the front of a column of height 2a is 2.3 a from the wall; without gate
    and bed friction it leads by ΔT ≈ 0.3 to 0.4, so between 2.2 and 2.9."""
    a = 0.25
    water = tank([1.25, 0.125, 0.625], 0.0625 / 2, column(a, 2 * a))
    while water.time * np.sqrt(2 * 9.81 / a) < 2.0:
        advance(water, rtol=1e-6)
    x = water.topology.nodes
    low = (water.level_set < 0) & (x[:, 2] < 0.04)
    assert 2.2 < x[low, 0].max() / a < 2.9


def test_a_straight_dam_break_stays_straight():
    """Nothing varies across the tank, but the diagonals of the cells all run one way: carried along them, 56 % of the
    water ahead was in one half of the tank after 0.3 s, on any cells."""
    water = tank([1.5, 0.5, 0.5], 0.0625, column(0.5, 0.4))
    while water.time < 0.3:
        advance(water, rtol=1e-7)
    x = water.topology.nodes
    ahead = np.where(x[:, 0] > 1.0, water.nodal_water, 0.0)
    assert ahead.sum() > 0.002
    assert abs(ahead @ np.sign(x[:, 1] - 0.25)) < 0.02 * ahead.sum()


def test_symmetric_scene_stays_symmetric():
    """Kuhn's split is the same after x and y are swapped, so a column in the corner must spread alike both ways: to
    round-off at first, then to the ties between equally close surface polygons: 1e-3 h in the level set after three
    steps, which water that falls freely carries on to some hundredths of its speed."""
    water = tank(
        [1, 1, 0.75], 0.125, lambda x: np.max([x[:, 0] - 0.42, x[:, 1] - 0.42, x[:, 2] - 0.55], axis=0)
    )
    x = np.round(water.topology.nodes, 9)
    order, mirrored = np.lexsort(x[:, [0, 1, 2]].T), np.lexsort(x[:, [1, 0, 2]].T)
    for limit in (1e-12, 5e-2):
        for _ in range(3 if limit < 1e-3 else 9):
            advance(water, rtol=1e-10)
        np.testing.assert_allclose(
            water.velocity[mirrored],
            water.velocity[order][:, [1, 0, 2]],
            atol=limit * np.abs(water.velocity).max(),
        )


def test_open_side_lets_the_water_out():
    """p = 0 on the side x = 1: a pool drains through it, and the books follow the outflow."""
    water = tank(
        [1, 0.25, 0.5], 0.0625, lambda x: x[:, 2] - 0.3, is_open=lambda normal, centre: normal[:, 0] > 0.5
    )
    for _ in range(30):
        advance(water, rtol=1e-7)
    assert water.volume() < 0.9 * water.initial_volume
    assert abs(water.volume_error()) < 5e-3


def test_water_that_falls_from_an_open_top_leaves_it():
    """Air comes after it through the top. Before, the top stayed wet and fed a trickle whose speed grew by g t up to
    the limit, long after all else had reached the floor (at 0.4 s) and spread there."""
    water = tank(
        [0.4, 0.4, 0.8],
        0.05,
        lambda x: np.maximum(np.maximum(x[:, 0] - 0.12, x[:, 1] - 0.12), 0.7 - x[:, 2]),
        is_open=lambda normal, centre: normal[:, 2] > 0.5,
    )
    top = water.topology.nodes[:, 2] > 0.79
    assert (water.level_set[top] < 0.0).any()
    while water.time < 0.55:
        advance(water)
    assert not (water.level_set[top] < 0.0).any()
    assert water.fastest() < 0.7 * 9.81 * 0.55
    assert abs(water.volume_error()) < 1e-6


@pytest.mark.parametrize("theta", [0.5, 0.6, 1.0])
def test_predict_changes_nothing(theta):
    """A caller may ask again with another dt: the state is taken over by `correct` alone."""
    water = tank([1.0, 0.25, 0.75], 0.125, column(0.4, 0.5), theta=theta)
    for _ in range(3):
        advance(water)
    first = water.predict(0.01)
    water.predict(0.002)
    again = water.predict(0.01)
    np.testing.assert_array_equal(first.rhs, again.rhs)
    np.testing.assert_array_equal(first.matrix.data, again.matrix.data)


@pytest.mark.parametrize("level", [0.91, 0.95, 0.9999])
def test_water_in_the_last_cell_below_an_open_top_stays(level):
    """The pressure is that of the air at the surface, not at the open top above it: held there, the weight of the cell
    in between set still water moving with 0.1 m/s."""
    water = tank(
        [0.4, 0.2, 1.0], 0.1, lambda x: x[:, 2] - level, is_open=lambda normal, _: normal[:, 2] > 0.5
    )
    for _ in range(10):
        advance(water, 0.02)
    assert np.abs(water.velocity[water.level_set < 0.0]).max() < 1e-8
    assert water.volume() == pytest.approx(0.08 * level, rel=1e-6)
