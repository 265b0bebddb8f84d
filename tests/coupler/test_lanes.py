"""Four numbers at a time have the bits of single numbers: a structure does not depend on which of both a loop takes."""

import numpy as np
import pytest

from kernels.decorators import plain
from kernels.lanes import (
    added,
    any_more,
    any_not_less,
    for_both,
    larger,
    magnitude,
    parts,
    root,
    taken,
    together,
    where_more,
)


@for_both
def _formula(a, b):
    """A bit of everything, with numbers that stand for four alike on either side."""
    c = larger(a, b) * 3.0 - root(magnitude(a)) / b
    return where_more(c, 0.1, -c + 1.0 / b, 2.0 - a * b), larger(a, 0.5), where_more(a, b, 0.0, c)


@plain
def _fours(a, b, out):
    for k, four in enumerate(_formula(taken(a, 2), together(b[0], b[1], b[2], b[3]))):
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = parts(four)


@plain
def _singles(a, b, out):
    for i in range(4):
        out[0, i], out[1, i], out[2, i] = _formula(a[2 + i], b[i])


@plain
def _any(a, limit):
    return any_more(taken(a, 0), limit), any_not_less(taken(a, 0), limit)


@plain
def _added(a, count):
    return added(0.1, taken(a, 0), count)


@pytest.mark.parametrize("seed", range(5))
def test_a_formula_gives_four_numbers_the_bits_of_single_ones(seed):
    random = np.random.default_rng(seed)
    a, b = random.normal(size=6), random.normal(size=4)
    a[3], a[4] = 0.5, b[2]  # where a maximum and a choice have equals
    fours, singles = np.empty((3, 4)), np.empty((3, 4))
    _fours(a, b, fours)
    _singles(a, b, singles)
    assert fours.tobytes() == singles.tobytes()


def test_one_of_four_is_enough_and_one_that_is_not_finite_is_not_less():
    assert _any(np.array([0.0, 0.0, 2.0, 0.0]), 1.0) == (True, True)
    assert _any(np.array([1.0, 0.0, 0.0, 0.0]), 1.0) == (False, True)
    assert _any(np.array([0.0, 0.0, 0.0, np.nan]), 1.0) == (False, True)
    assert _any(np.zeros(4), 1.0) == (False, False)


def test_four_are_added_one_after_the_other():
    """Sums depend on the order of their summands in the last digits."""
    a = np.array([1e16, 1.0, -1e16, 1.0])
    total = 0.1
    for count in range(1, 5):
        total += a[count - 1]
        assert _added(a, count) == total
