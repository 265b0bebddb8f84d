"""Connected water, against scipy's components of the same graph."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from fluid.surface.pools import own_shift, pools
from kernels import threads
from tests.fluid.scenes import tank


@pytest.mark.parametrize("share", [0.05, 0.2, 0.5, 0.97, 1.0])
def test_pools_are_the_components_of_the_water(share):
    t = tank([1.0, 0.9, 0.8], 0.1, lambda x: x[:, 2] - 0.4).topology
    start, neighbours = t.around
    phi = np.where(np.random.default_rng(3).random(len(t.nodes)) < share, -1.0, 1.0)
    label, count = pools(phi, start, neighbours)

    wet, n = np.flatnonzero(phi < 0.0), len(phi)
    ways = sp.csr_array(
        (np.ones(len(neighbours)), neighbours.astype(np.int64), start.astype(np.int64)), shape=(n, n)
    )
    expected, component = connected_components(ways[wet][:, wet], directed=False)
    assert count == expected
    assert len(np.unique(np.column_stack([component, label[wet]]), axis=0)) == expected
    assert (np.unique(label[wet], return_index=True)[1] == np.unique(component, return_index=True)[1]).all()
    for i in np.flatnonzero(phi >= 0.0):
        row = neighbours[start[i] : start[i + 1]]
        assert label[i] == next((label[j] for j in row if phi[j] < 0.0), -1)


@pytest.fixture
def on_threads():
    yield lambda n: threads.use(n, least=1)
    threads.use(1)


@pytest.mark.parametrize("count", [2, 3, 4, 16])
def test_pools_of_ranges_are_joined_along_their_borders(count, on_threads):
    """Water winds through all ranges, and what is dry lies beside some of it everywhere."""
    t = tank([1.0, 0.9, 0.8], 0.1, lambda x: x[:, 2] - 0.4).topology
    x, y, z = t.nodes.T
    phi = np.cos(14.0 * x) * np.cos(11.0 * y) + 0.5 * np.cos(9.0 * z) + 0.4
    expected, number = pools(phi, *t.around)
    on_threads(count)
    label, found = pools(phi, *t.around)
    assert number == found > 2
    np.testing.assert_array_equal(label, expected)


@pytest.mark.parametrize(("total", "lengths"), [(0.2, [0.0, 0.05, 0.0, 0.0]), (-0.2, [0.1, 0.0, 0.0, 0.0])])
def test_a_pool_makes_up_for_what_it_lacks_itself(total, lengths):
    """Pool 0 has 0.3 m³ too much below 3 m², pool 1 lacks 0.1 m³ below 2 m², and pool 2, under a lid, lacks as much.
    Where all water lacks some, only pools that lack some rise, by volume over area; where all has too much, only those
    with too much sink: a correction in the other direction would take from one pool what another lacks."""
    label = np.array([0, 0, 1, 1, 2, -1])
    carried = np.array([1.0, 1.0, 2.0, 2.0, 1.1, 0.0])
    inner = np.array([0.7, 0.8, 1.1, 1.0, 1.0, 0.0])
    near = np.array([0.5, 0.3, 0.8, 1.0, 0.0, 0.0])
    area = np.array([1.0, 2.0, 1.5, 0.5, 0.0, 0.0])
    found = own_shift(label, 3, np.array([1, 3, 4, 5]), (carried, inner, near), area, total)
    np.testing.assert_allclose(found, lengths, atol=1e-15)
