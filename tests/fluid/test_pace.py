"""The step of the water: spray does not set it, everything else does."""

from __future__ import annotations

import numpy as np
import pytest

from fluid.step.time_step import LEAST_COUNTED, SPRAY, SPRAY_COURANT, SPRAY_SPEED, largest_component, pace
from tests.fluid.scenes import tank


def water_at(speed, volume=None):
    """pace of nodes that each move along x at a speed [m/s]."""
    u = np.zeros((len(speed), 3))
    u[:, 0] = speed
    volume = np.ones(len(speed)) if volume is None else np.asarray(volume, float)
    return pace(u, volume, np.ones(len(speed), bool))


def half_full(speed: float = 10.0):
    """A tank half full of water that moves along x, faster than LONGEST_STEP minds."""
    water = tank((1.0, 1.0, 1.0), 0.1, lambda x: x[:, 2] - 0.45)
    water.velocity[water.level_set < 0.0, 0] = speed
    return water


def test_one_fast_drop_does_not_set_the_step():
    """One node of 605 at 1.8 times the speed of the rest: it may cross more than one cell, the step is that of
    SPRAY_SPEED times the speed of the rest."""
    water = half_full()
    drop = np.flatnonzero(water.level_set < 0.0)[0]
    water.velocity[drop] = [18.0, 0.0, 0.0]
    assert water.nodal_water[drop] < SPRAY * water.nodal_water.sum()
    assert water.stable_step() == pytest.approx(0.1 / (10.0 * SPRAY_SPEED), rel=1e-12)
    assert water.fastest() == 18.0


def test_no_drop_crosses_more_than_twice_the_cells():
    """However fast one node is, it crosses SPRAY_COURANT cells at most: volume is carried in substeps, but impacts of
    single nodes that cross many cells would be smeared over as many."""
    water = half_full()
    water.velocity[np.flatnonzero(water.level_set < 0.0)[0]] = [0.0, -90.0, 0.0]
    assert water.stable_step() == pytest.approx(SPRAY_COURANT * 0.1 / 90.0, rel=1e-12)


def test_a_drop_in_the_air_does_not_set_the_step_however_fast():
    """Less than the water of one node, with air around it: its path may cross any number of cells. The same drop inside
    the water still counts (above), and alone in the tank it sets the step itself."""
    drop = np.array([0.5, 0.5, 0.8])

    def ball(x):
        return np.linalg.norm(x - drop, axis=1) - 0.06

    water = tank((1.0, 1.0, 1.0), 0.1, lambda x: np.minimum(x[:, 2] - 0.45, ball(x)))
    water.velocity[water.level_set < 0.0, 0] = 10.0
    flying = (water.level_set < 0.0) & (water.topology.nodes[:, 2] > 0.6)
    assert 0.0 < water.nodal_water[flying].sum() < 0.1**3
    water.velocity[flying] = [0.0, 0.0, -90.0]
    assert water.stable_step() == 0.1 / 10.0
    alone = tank((1.0, 1.0, 1.0), 0.1, ball)
    alone.velocity[alone.level_set < 0.0, 2] = -90.0
    assert alone.stable_step() == 0.1 / 90.0


def test_water_without_outliers_keeps_the_step_of_its_fastest_node():
    """A smooth field, here the speeds of a rotation: the step is the one of the largest component, bit for bit."""
    water = half_full()
    x = water.topology.nodes
    water.velocity = np.where(
        (water.level_set < 0.0)[:, None],
        np.column_stack([x[:, 1] - 0.5, 0.5 - x[:, 0], np.zeros(len(x))]) * 40.0,
        0.0,
    )
    assert water.stable_step() == 0.1 / water.fastest()


def test_fast_water_of_more_than_the_share_is_not_spray():
    """Two nodes of a hundred hold more than the share: a jet, which sets the step."""
    jet = np.ones(100)
    jet[:2] = 5.0
    assert water_at(jet) == 5.0
    # the same two nodes with a tenth of the water of the others are spray
    assert water_at(jet, np.where(jet > 1.0, 0.1, 1.0)) == 5.0 / SPRAY_COURANT


def test_nodes_that_are_left_out_do_not_count():
    """Films beside solids (LEAST_COUNTED) neither set the step nor count as water."""
    u = np.array([[1.0, 0.0, 0.0], [0.0, 7.0, 0.0]])
    counted = np.array([True, False])
    assert pace(u, np.ones(2), counted) == largest_component(u, counted) == 1.0
    assert pace(u, np.ones(2), np.zeros(2, bool)) == 0.0
    assert 0.0 < LEAST_COUNTED < 1.0


def test_pace_lies_between_its_limits_for_any_speeds():
    """Random speeds with long tails: never below the fastest over SPRAY_COURANT, never above the fastest, and what
    is faster than pace / SPRAY_SPEED but was not counted holds no more than the share."""
    random = np.random.default_rng(3)
    for _ in range(200):
        speed, volume = random.pareto(2.0, 300), random.uniform(0.0, 1.0, 300)
        found = water_at(speed, volume)
        fastest = speed.max()
        assert fastest / SPRAY_COURANT <= found <= fastest
        if found < fastest:
            beyond = volume[speed > found / SPRAY_SPEED * (1.0 + 1e-12)].sum()
            assert beyond <= SPRAY * volume.sum()


@pytest.mark.parametrize("spray", [0.002, 0.05, 0.3])
def test_sorting_only_the_fastest_finds_the_same_speed(spray):
    """The speed that a hundredth of the water exceeds, among 3000 nodes of any speeds and volumes: with few nodes that
    hold it all, and with more than an eighth of all that hold less."""
    rng = np.random.default_rng(5)
    speed, volume = rng.uniform(4.0, 10.0, 3000), rng.random(3000)
    fast = speed > np.quantile(speed, 1.0 - spray)
    volume[fast] *= 0.5 * SPRAY * volume.sum() / volume[fast].sum()
    order = np.argsort(-speed)
    exceeded = np.cumsum(volume[order]) > SPRAY * volume.sum()
    expected = SPRAY_SPEED * speed[order[exceeded.argmax()]]
    assert water_at(speed, volume) == max(min(speed.max(), expected), speed.max() / SPRAY_COURANT)
