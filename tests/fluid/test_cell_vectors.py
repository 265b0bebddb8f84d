"""Vectors of a few of the cells against the same in an array of all cells."""

import numpy as np
import pytest

from fluid.domain.cell_vectors import CellVectors, places_among
from fluid.numerics.fields import added, copied_at, less
from fluid.step.remainders import carry_remainder
from kernels.threads import use


def random_field(seed, cells, share=0.3):
    random = np.random.default_rng(seed)
    return np.where(random.random((cells, 1)) < share, random.normal(size=(cells, 3)), 0.0)


@pytest.mark.parametrize("threads", [1, 3])
def test_what_cells_hold_is_found_along_both_lists(threads):
    """Also where ranges of several threads begin between cells of the list, before the first and after the last: what
    cells of water at rest hold remains."""
    random = np.random.default_rng(4)
    corners, size, at_rest = np.zeros((400, 4), np.uint32), np.ones(400), np.zeros((1, 3))
    use(threads, least=7)
    try:
        for held, wanted in ((50, 200), (300, 200), (0, 30), (30, 0), (400, 400)):
            cells = np.sort(random.choice(400, held, replace=False))
            asked = np.sort(random.choice(400, wanted, replace=False))
            values = random.normal(size=(held, 3))
            field = CellVectors(cells, values).field(400)
            known = (cells, values, np.zeros((held, 3)))
            found = carry_remainder(asked, known, 0.1, at_rest, 0.1, 0.0, corners, size)
            np.testing.assert_array_equal(found, field[asked])
    finally:
        use(1)


def test_a_field_of_all_cells_comes_back():
    whole = random_field(1, 60)
    listed = CellVectors.of(whole)
    assert 0 < len(listed.cells) < 60
    np.testing.assert_array_equal(listed.field(60), whole)
    np.testing.assert_array_equal(CellVectors.none().field(4), np.zeros((4, 3)))


def test_carried_to_another_numbering_like_an_array():
    """Cells that are gone, new ones, and two that continue the same one, as the covers of a cut cell do."""
    whole, source = random_field(2, 60), np.random.default_rng(3).integers(-1, 60, 80)
    expected = np.where(source[:, None] >= 0, whole[source], 0.0)
    carried = CellVectors.of(whole).carried(source, 60)
    np.testing.assert_array_equal(carried.field(80), expected)
    assert (np.diff(carried.cells) > 0).all()
    fresh = np.flatnonzero(source < 0)
    more = np.ones((len(fresh), 3))
    expected[fresh] = more
    joined = carried.joined(fresh, more)
    np.testing.assert_array_equal(joined.field(80), expected)
    assert (np.diff(joined.cells) > 0).all()


@pytest.mark.parametrize("threads", [1, 3])
def test_fields_that_threads_share_are_those_of_numpy(threads):
    a = np.random.default_rng(5).normal(size=(100_003, 3))
    use(threads, least=1)
    try:
        b, c = np.ascontiguousarray(a[:, 0]), np.ascontiguousarray(a[:, 1])
        np.testing.assert_array_equal(added(b, c), b + c)
        np.testing.assert_array_equal(less(b, c), b - c)
        np.testing.assert_array_equal(copied_at(np.array([3, 99_000]), a)[[3, 99_000]], a[[3, 99_000]])
    finally:
        use(1)


@pytest.mark.parametrize("threads", [1, 3])
def test_places_of_wanted_cells_in_a_list(threads):
    """Whatever the gaps in both, at their ends and where nothing is wanted or listed."""
    random = np.random.default_rng(6)
    use(threads, least=1)
    try:
        for n, k in ((0, 5), (5, 0), (1, 1), (3000, 20), (20, 3000), (500, 500)):
            cells = np.flatnonzero(random.random(4000) < n / 4000)
            wanted = np.flatnonzero(random.random(4000) < k / 4000)
            expected = np.flatnonzero(np.isin(cells, wanted))
            np.testing.assert_array_equal(places_among(wanted, cells), expected)
    finally:
        use(1)
