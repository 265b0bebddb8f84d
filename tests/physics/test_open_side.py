"""Water that falls out of a tank through an open side takes no more energy with it than it had."""

import numpy as np
import pytest

from coupler.commands.verify.scenes import level_at, tank


def test_a_pool_that_drains_neither_gains_nor_loses_energy_at_its_open_side():
    """What leaves, and what is left: with half of its slowness kept on the way to the side it gained 22 % of it."""
    n = 16
    c = tank((1.0, 2 / n, 0.6), (n, 2, 10), level_at(0.4), is_open=lambda normal, _: normal[:, 0] > 0.5)
    while c.time < 0.5 * (1 - 1e-9):
        c.step(c.step_size(0.5 - c.time))
    balance = c.ledger.balance(c._water_energy(), None)
    assert c.water.volume() < 0.75 * c.water.initial_volume
    assert abs(balance.numerical_dissipation) < 0.04 * balance.left


def test_a_slab_leaves_the_open_top_as_fast_as_it_falls():
    """From rest, a twentieth of a cell below the top, half a cell in 7 steps without pressure: its surface is where a
    free fall takes it, and all of it loses the height of that. Where air came in at the top by one step's fall at most,
    however far the surface had gone, the surface was left behind by a third of a cell."""
    h, dt = 0.92, 0.045
    level, base = 4.95 * h, 1.95 * h
    water = tank(
        (3 * h, 4 * h, 5 * h),
        (3, 4, 5),
        lambda x: np.maximum(base - x[:, 2], x[:, 2] - level),
        is_open=lambda normal, _: normal[:, 2] > 0.5,
    ).water
    top = water.topology.nodes[:, 2] > 4.99 * h
    for _ in range(7):
        problem = water.predict(dt)
        water.correct(problem, np.zeros(len(problem.dofs)))
    fallen = 0.5 * 9.81 * water.time**2
    np.testing.assert_allclose(water.level_set[top], 0.05 * h + fallen, atol=0.05 * h)
    assert water.topology.nodes[:, 2] @ water.nodal_water / water.volume() == pytest.approx(
        0.5 * (level + base) - fallen, abs=0.05 * h
    )


def test_air_that_enters_along_the_surface_does_not_lower_it():
    """At a side that the surface meets at a right angle, a flow inwards moves the surface along itself: the distance of
    a node above it stays what it was, however often air is let in."""
    water = tank((2, 1, 1), (4, 2, 4), level_at(0.5), is_open=lambda normal, _: normal[:, 0] > 0.5).water
    nodes = water.topology.nodes
    above = (nodes[:, 0] > 1.99) & (nodes[:, 2] > 0.7)
    phi, u = water.level_set.copy(), np.zeros_like(nodes)
    u[:, 0] = -1.0
    before = phi[above].copy()
    for _ in range(5):
        water.walls.admit_air(phi, u, 0.05, water.topology.node_size, np.array([0.0, 0.0, 1.0]))
    np.testing.assert_array_equal(phi[above], before)
