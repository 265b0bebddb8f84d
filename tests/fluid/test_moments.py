"""Volume of water in a cell: exact, complementary and symmetric, whatever the corner values."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from fluid.domain.moments import marked_corners, wet_moments

values = st.floats(-1, 1).filter(lambda v: abs(v) > 1e-6)


def moments(phi):
    out = np.empty(4)
    wet_moments(np.asarray(phi, float), out)
    return out


@settings(deadline=None)  # the first call compiles
@given(st.tuples(values, values, values, values))
def test_water_and_air_make_the_cell(phi):
    np.testing.assert_allclose(moments(phi) + moments(-np.array(phi)), 0.25, atol=1e-13)


@settings(deadline=None)  # the first call compiles
@given(st.tuples(values, values, values, values), st.permutations(range(4)))
def test_numbering_does_not_matter(phi, order):
    np.testing.assert_allclose(moments(np.array(phi)[order]), moments(phi)[order], atol=1e-13)


@settings(deadline=None)  # the first call compiles
@given(st.tuples(values, values, values, values))
def test_moments_against_sampling(phi):
    """The share of wet sample points and the mean of N_k over them, 4000 low-discrepancy points."""
    points = _samples()
    wet = points @ phi < 0
    np.testing.assert_allclose(moments(phi), (points * wet[:, None]).mean(axis=0), atol=0.01)


def _samples(n=4000):
    """Even barycentric points: sorted spacings of a golden-ratio sequence in the unit cube."""
    alpha = 1.0 / 1.2207440846057596 ** np.arange(1, 4)
    cube = np.sort((0.5 + np.outer(np.arange(n), alpha)) % 1.0, axis=1)
    return np.diff(np.column_stack([np.zeros(n), cube, np.ones(n)]), axis=1)


def test_marked_corners_are_counted_for_the_listed_cells():
    random = np.random.default_rng(2)
    cells, marked, listed = (
        random.integers(0, 30, (40, 4)),
        random.random(30) < 0.4,
        random.integers(0, 40, 25),
    )
    count = marked[cells[listed]].sum(axis=1)
    assert set(count) > {0, 1, 2}
    np.testing.assert_array_equal(marked_corners(listed, marked, cells), count)
