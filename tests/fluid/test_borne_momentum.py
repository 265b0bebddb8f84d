"""Momentum of fast water above the surface, borne by the nodes that its velocity is continued from."""

import numpy as np
import pytest

from fluid.step import corrector
from fluid.surface.borne_momentum import Borne
from fluid.transport.surface_momentum import by_speed
from tests.fluid.scenes import advance, column, tank


def _surface(water):
    """wet (N,) bool, and the nodes outside that share cells with them."""
    wet = water.level_set < 0.0
    order, start = water.layers(wet)
    return wet, order[start[1] : start[2]]


@pytest.mark.parametrize("kept", [None, 0.0, 0.4])
def test_what_the_water_bears_is_kept(kept):
    """Σ W u as with what the nodes outside have of their own, to round-off; of nodes around jumps less is borne, and
    less follows."""
    water = tank([2, 0.25, 0.75], 0.125, column(0.6, 0.5))
    advance(water)
    wet, outside = _surface(water)
    rng = np.random.default_rng(4)
    own, u = 9.0 + rng.normal(size=water.velocity.shape), rng.normal(size=water.velocity.shape)
    in_jumps = None if kept is None else np.full(len(wet), kept)
    W = water.nodal_water
    borne = Borne(water.topology, outside, wet, W, np.ones(len(wet)), in_jumps)
    expected = W @ u + (1.0 - (kept or 0.0)) * (W[outside] @ (own - u)[outside])
    before = u.copy()
    borne.give(own, u)
    assert W @ u == pytest.approx(expected, rel=1e-13)
    assert np.abs(u - before)[outside].max() > 0.01
    moved = np.abs(u - before).max(axis=1) > 0.0
    assert np.all(wet[moved] | (W[moved] > 0.0))


def test_water_bears_as_much_as_follows_the_momentum_of_the_volume():
    """Nothing below √(g h), all from 3 √(g h) on."""
    water = tank([2, 0.25, 0.75], 0.125, column(0.6, 0.5))
    wet, outside = _surface(water)
    W, size, shallow = water.nodal_water, water.topology.node_size, np.sqrt(9.81 * 0.125)
    held = W[outside].sum() * shallow
    for speed, share in ((0.999, 0.0), (2.0, 0.5), (4.0, 1.0)):
        own, u = np.zeros(water.velocity.shape), np.zeros(water.velocity.shape)
        own[:, 0] = speed * shallow
        fast = np.empty(len(wet))
        some = by_speed(outside, own, 9.81, 0.0, size, fast)
        Borne(water.topology, outside, wet, W, fast, None).give(own, u)
        assert some == (len(outside) if share else 0)
        assert W @ u[:, 0] == pytest.approx(share * speed * held, rel=1e-12)


def test_the_continuation_takes_no_momentum_of_fast_water(monkeypatch):
    """A lump that flies and spins, far from all sides: at the end of a step its momentum is that which nodes in the
    water, and those above the surface under the forces alone, had before the continuation. The continued velocity
    alone took 0.1 to 1 % of it in one step."""
    seen = {}
    extend = corrector.extend_velocity

    def spy(t, layers, wet, wet_cells, u, a, calm, forced, rubbed=None):
        seen["u"] = np.where(wet[:, None], u, forced)
        extend(t, layers, wet, wet_cells, u, a, calm, forced, rubbed)

    monkeypatch.setattr(corrector, "extend_velocity", spy)
    water = tank(
        [1.5, 1.25, 1.25], 0.125, lambda x: np.abs(x - [0.5, 0.6, 0.65]).max(axis=1) - 0.2,
        gravity=1e-4, speed_limit=1e4,
    )  # fmt: skip
    x, _, z = (water.topology.nodes - [0.5, 0.6, 0.65]).T
    water.velocity[:, 0], water.velocity[:, 2] = 1.0 - 2.0 * z, 2.0 * x
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    for _ in range(5):
        advance(water)
        W = water.nodal_water
        assert water.report.clipped == 0
        assert np.abs(W @ (water.velocity - seen["u"])).max() < 1e-12 * W.sum()
