"""The median by a sample and a count is that of NumPy, to the bit."""

import numpy as np
import pytest

import kernels.threads as kernels
from fluid.numerics.median import SAMPLE, median_of


@pytest.fixture(params=[1, 3])
def threads(request):
    kernels.use(request.param, least=1)
    yield request.param
    kernels.use(1)


def _fields(n):
    rng = np.random.default_rng(7)
    yield rng.random(n)
    yield np.sort(rng.normal(size=n))
    yield np.round(rng.random(n), 1)
    yield np.ones(n)
    yield np.where(np.arange(n) < n // 2, 1.0, 2.0)  # the median of an even number lies between two values
    yield np.where(np.arange(n) % (n // SAMPLE or 1) == 0, 5.0, rng.random(n))  # the sample misses the median


@pytest.mark.parametrize("n", [1, 2, 9, 8 * SAMPLE, 8 * SAMPLE + 1, 50_000])
def test_the_median_is_that_of_numpy(n, threads):
    """Of even and odd numbers of entries, few and many, with many that are equal, and where the sample is not like
    the rest."""
    rng = np.random.default_rng(n)
    for field in _fields(n):
        larger = np.concatenate([field, rng.random(n)])
        assert median_of(larger, np.arange(n)) == np.median(field)
        rows = np.flatnonzero(rng.random(2 * n) < 0.7)
        if len(rows):
            assert median_of(larger, rows) == np.median(larger[rows])
