"""The sum of a field by threads is that of NumPy, to the bit."""

import numpy as np
import pytest

import kernels.threads as kernels
from fluid.numerics.fields import added, less, nothing
from fluid.numerics.sums import LEAF, total


@pytest.fixture(params=[1, 3])
def threads(request):
    kernels.use(request.param, least=1)
    yield request.param
    kernels.use(1)


@pytest.mark.parametrize("n", [1, 7, LEAF, LEAF + 1, LEAF + 8, 1025, 20_001, 65_536])
def test_the_total_is_the_sum_of_numpy(n, threads):
    """Numbers of both signs over thirty powers of ten, many of them zero: another order of the summands shows."""
    rng = np.random.default_rng(n)
    field = np.where(rng.random(n) < 0.3, 0.0, rng.normal(size=n) * 10.0 ** rng.uniform(-15.0, 15.0, n))
    assert total(field) == field.sum()


def test_nothing_is_passed_by_and_stays_zero():
    """It adds nothing, is one array for all who ask for it, and nobody can write to it."""
    field = np.arange(5.0)
    assert added(field, nothing(5)) is field
    assert less(field, nothing(5)) is field
    assert nothing(5) is nothing(5)
    assert total(nothing(5)) == 0.0
    assert np.array_equal(added(field, np.zeros(5)), field)
    assert added(field, np.zeros(5)) is not field
    with pytest.raises(ValueError, match="read-only"):
        nothing(5)[0] = 1.0
