"""Water that falls out of a tank through an open side takes no more energy with it than it had."""

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
