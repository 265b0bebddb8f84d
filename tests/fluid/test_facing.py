"""Bodies that lie near one another: which pairs are found."""

import numpy as np
import pytest

from fluid.cut.facing import near_bodies


def by_hand(low, high, loose, reach):
    """All pairs one by one."""
    return [
        [
            b
            for b in range(len(low))
            if b != a
            and (loose[a] or loose[b])
            and (low[a] <= high[b] + reach).all()
            and (low[b] <= high[a] + reach).all()
        ]
        for a in range(len(low))
    ]


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_every_near_pair_is_found_once_and_in_order(axis, seed):
    """Boxes of very different sizes, one as long as them all, spread along each of the axes; some touch exactly."""
    random = np.random.default_rng(seed)
    spread = np.where(np.arange(3) == axis, 40.0, 6.0)
    low = np.round(random.uniform(0.0, spread, (150, 3)))
    high = low + np.round(random.uniform(0.0, 3.0, (150, 3)))
    high[7] = low[7] + spread
    loose = random.uniform(size=150) < 0.5
    for reach in (0.0, 1.0):
        start, members = near_bodies(low, high, loose, reach)
        found = [members[start[a] : start[a + 1]].tolist() for a in range(150)]
        assert found == by_hand(low, high, loose, reach)
    assert start[-1] > 100


def test_no_bodies_and_none_near():
    start, members = near_bodies(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, bool), 1.0)
    assert start.tolist() == [0]
    assert len(members) == 0
    low = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0]])
    start, members = near_bodies(low, low + 1.0, np.ones(2, bool), 1.0)
    assert start.tolist() == [0, 0, 0]
    assert len(members) == 0
