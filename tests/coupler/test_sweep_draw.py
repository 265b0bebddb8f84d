"""What is drawn: distributions have the moments asked for, samples of one point do not depend on the others."""

import numpy as np
import pytest
from scipy import stats

from coupler.commands.sweep.draw import cube, distribution, quantiles, seed_of


@pytest.mark.parametrize("sample", ["latin", "sobol", "random"])
def test_samples_are_uniform_in_the_open_cube(sample):
    u = cube(sample, 512, 3, 7)
    assert u.shape == (512, 3)
    assert ((u > 0) & (u < 1)).all()
    for k in range(3):
        assert stats.kstest(u[:, k], "uniform").pvalue > 1e-3
    assert np.abs(np.corrcoef(u.T) - np.eye(3)).max() < 0.15


def test_a_latin_hypercube_has_one_sample_in_every_slice():
    u = cube("latin", 40, 2, 1)
    assert (np.sort((u * 40).astype(int), axis=0) == np.arange(40)[:, None]).all()


@pytest.mark.parametrize("sample", ["sobol", "random"])
def test_more_samples_leave_the_first_ones_as_they_were(sample):
    assert (cube(sample, 8, 2, 3) == cube(sample, 32, 2, 3)[:8]).all()


def test_sobol_points_of_a_power_of_two_halve_every_axis():
    u = cube("sobol", 64, 4, 5)
    assert ((u < 0.5).sum(axis=0) == 32).all()


def test_pairs_for_sobol_indices_differ_in_one_column_each():
    u = cube("saltelli", 16, 3, 2)
    a, b, *mixed = u.reshape(5, 16, 3)
    for i, m in enumerate(mixed):
        assert (m[:, i] == b[:, i]).all()
        others = [k for k in range(3) if k != i]
        assert (m[:, others] == a[:, others]).all()


@pytest.mark.parametrize("kind", ["normal", "lognormal", "weibull"])
@pytest.mark.parametrize("variation", [0.1, 0.5])
def test_mean_and_variation_are_those_asked_for(kind, variation):
    """Closed forms: scipy's own moments of the frozen distribution."""
    frozen = distribution(kind, {"mean": 3.0, "variation": variation})
    assert frozen.mean() == pytest.approx(3.0, rel=1e-9)
    assert frozen.std() / frozen.mean() == pytest.approx(variation, rel=1e-9)


def test_median_and_dispersion_of_a_lognormal():
    frozen = distribution("lognormal", {"median": 2e5, "dispersion": 0.3})
    x = quantiles(frozen, np.array([0.5, stats.norm.cdf(1.0)]))
    assert x == pytest.approx([2e5, 2e5 * np.exp(0.3)])


def test_a_distribution_that_is_cut_off_keeps_its_shape_between():
    frozen = distribution("normal", {"mean": 0.0, "deviation": 1.0})
    x = quantiles(frozen, cube("sobol", 1024, 1, 1)[:, 0], lower=-0.5, upper=2.0)
    assert (x.min() >= -0.5) & (x.max() <= 2.0)
    assert x.mean() == pytest.approx(stats.truncnorm(-0.5, 2.0).mean(), abs=1e-3)


def test_what_cannot_be_drawn_is_refused():
    frozen = distribution("normal", {"mean": 0.0, "deviation": 1.0})
    with pytest.raises(ValueError, match="between lower and upper"):
        quantiles(frozen, np.array([0.5]), lower=9.0)
    with pytest.raises(ValueError, match="not below high"):
        distribution("uniform", {"low": 2.0, "high": 1.0})
    with pytest.raises(ValueError, match="median = -1 is not above 0"):
        distribution("lognormal", {"median": -1.0, "dispersion": 0.1})


def test_seeds_depend_on_nothing_but_what_is_given():
    """Of hash() they would differ from process to process; here a number that any machine finds."""
    assert seed_of(1, "joints.seed", {"depth": "0.8 m"}) == seed_of(1, "joints.seed", {"depth": "0.8 m"})
    assert seed_of(1, "a") != seed_of(2, "a")
    assert seed_of("known") == 1230080361
    assert 0 <= seed_of(3) < 2**31
