"""Fragility curves: the maximum of the likelihood, bands that cover what they promise, refusals."""

import numpy as np
import pytest
import statsmodels.api as sm
from scipy.special import ndtr
from statsmodels.miscmodels.ordinal_model import OrderedModel

from coupler.case.sweep import DamageState, Fragility
from coupler.commands.sweep.fit import bootstrap, check, fit, separation
from coupler.commands.sweep.fragility import Runs, _fitted, dispersion_band
from coupler.commands.sweep.page import _with_band

BETA = 0.4


def runs(seed, levels=10, each=10, ratios=(1.0,)):
    """Runs at fixed intensities of structures with log-normal capacity of median 1; states at multiples of it."""
    rng = np.random.default_rng(seed)
    x = np.repeat(np.linspace(0.5, 2.0, levels), each)
    capacity = np.exp(rng.normal(0.0, BETA, len(x)))
    return x, sum((x > ratio * capacity).astype(int) for ratio in ratios)


@pytest.mark.parametrize("ratios", [(1.0,), (1.0, 1.4), (1.0, 1.2, 1.6)])
def test_a_second_search_finds_the_same_maximum(ratios):
    x, state = runs(1, ratios=ratios)
    found = fit(x, state, len(ratios))
    dispersion, median = check(x, state, len(ratios))
    assert found.dispersion[0] == pytest.approx(dispersion, rel=1e-6)
    assert found.median[0] == pytest.approx(median, rel=1e-6)


def test_the_curve_of_one_state_is_that_of_statsmodels():
    """Its generalised linear model with a probit link, to seven digits."""
    x, state = runs(1)
    found = fit(x, state, 1)
    link = sm.families.links.Probit()
    model = sm.GLM(state.astype(float), sm.add_constant(np.log(x)), family=sm.families.Binomial(link=link))
    const, slope = model.fit(tol=1e-12, maxiter=200).params
    assert found.dispersion[0] == pytest.approx(1.0 / slope, rel=1e-7)
    assert found.median[0, 0] == pytest.approx(np.exp(-const / slope), rel=1e-7)


def test_the_curves_of_two_states_are_those_of_statsmodels():
    """Its ordered model, to what that converges to."""
    x, state = runs(1, ratios=(1.0, 1.4))
    found = fit(x, state, 2)
    logs = np.log(x)
    model = OrderedModel(state, (logs - logs.mean())[:, None], distr="probit")
    slope, first, gap = model.fit(method="bfgs", disp=False, maxiter=500, gtol=1e-8).params
    median = np.exp(np.array([first, first + np.exp(gap)]) / slope + logs.mean())
    assert found.dispersion[0] == pytest.approx(1.0 / slope, rel=1e-4)
    assert found.median[0] == pytest.approx(median, rel=1e-4)


def test_the_curve_of_very_many_runs_is_the_known_one():
    x, state = runs(2, levels=40, each=500, ratios=(1.0, 1.4))
    found = fit(x, state, 2)
    assert found.dispersion[0] == pytest.approx(BETA, rel=0.03)
    assert found.median[0] == pytest.approx([1.0, 1.4], rel=0.02)


def test_curves_of_states_never_cross():
    for seed in range(10):
        x, state = runs(seed, levels=8, each=5, ratios=(1.0, 1.1, 1.3))
        p = fit(x, state, 3).probability(np.geomspace(0.05, 20.0, 400))[0]
        assert (np.diff(p, axis=0) <= 1e-15).all()


def test_weights_are_repeated_runs():
    x, state = runs(3)
    weight = np.random.default_rng(0).integers(1, 4, len(x))
    once = fit(x, state, 1, weight[None])
    again = fit(np.repeat(x, weight), np.repeat(state, weight), 1)
    assert once.cut == pytest.approx(again.cut, rel=1e-9)
    assert once.slope == pytest.approx(again.slope, rel=1e-9)


def test_a_unit_of_the_intensity_changes_the_median_alone():
    x, state = runs(4)
    metres, millimetres = fit(x, state, 1), fit(1e3 * x, state, 1)
    assert millimetres.dispersion == pytest.approx(metres.dispersion, rel=1e-9)
    assert millimetres.median == pytest.approx(1e3 * metres.median, rel=1e-9)


def test_a_band_of_90_per_cent_covers_the_known_curve_in_85_to_95_per_cent_of_the_samples():
    """200 sets of 200 runs each, at three intensities: 10, 50 and 80 % of the known curve."""
    at = np.array([0.6, 1.0, 1.4])
    exact = ndtr(np.log(at) / BETA)
    covered = []
    for seed in range(200):
        x, state = runs(1000 + seed, levels=20)
        sets = bootstrap(x, state, 1, 300, seed)
        assert sets.found.all()
        low, high = np.percentile(sets.probability(at)[:, 0], [5, 95], axis=0)
        covered.append((low <= exact) & (exact <= high))
    share = np.mean(covered, axis=0)
    assert ((share >= 0.85) & (share <= 0.95)).all(), share


def scattered(seed, beta, number=30):
    """Runs at six intensities of structures with log-normal capacity of median 1.1, too few for so wide a scatter."""
    rng = np.random.default_rng(seed)
    x = np.repeat(np.linspace(0.5, 2.0, 6), number // 6)
    return x, (np.log(x / 1.1) / beta + rng.normal(size=number) > 0.0).astype(int)


@pytest.mark.parametrize("number", [30, 60])
def test_the_band_of_the_dispersion_covers_the_known_one_and_holds_the_estimate(number):
    """β = 1 from few runs: in many of the sets some samples of the bootstrap fall with the intensity, where 1/b jumps
    from infinity to minus infinity. A third of the bands began below 0."""
    covered, open_ended = [], 0
    for seed in range(1000, 1200):
        x, state = scattered(seed, 1.0, number)
        best, sets = fit(x, state, 1), bootstrap(x, state, 1, 300, seed)
        if best.rising[0] and sets.found.mean() >= 0.9:
            low, high = dispersion_band(sets, 0.9)
            assert 0.0 < low <= best.dispersion[0] <= high
            covered.append(low <= 1.0 <= high)
            open_ended += np.isinf(high)
    assert len(covered) > 180
    assert 0.85 <= np.mean(covered) <= 0.95
    assert open_ended > 10


def test_medians_of_samples_that_fall_with_the_intensity_make_no_band():
    """β = 2 from 30 runs: a seventh of the samples have no rising curve, so that the band of the median is refused with
    the reason, that of β has no upper end, and those of the curve stay."""
    x, state = scattered(0, 2.0)
    best, sets = fit(x, state, 1), bootstrap(x, state, 1, 500, 1)
    assert best.rising[0]
    assert sets.found.mean() > 0.95
    assert sets.rising.mean() < 0.9
    f = Fragility(name="f", measure="depth", state=(DamageState(name="falls", quantity="q", at_least=1.0),))
    reported = _fitted(Runs(x, state, 0, 0, 0), f, [1], best, sets)
    (curve,) = reported["curves"]
    assert curve["median_band"] is None
    assert reported["note"].startswith("no bands of medians: ")
    assert "rises with depth" in reported["note"]
    low, high = reported["dispersion_band"]
    assert 0.0 < low < best.dispersion[0] < high == np.inf
    p, lower, upper = (np.array(curve[name]) for name in ("p", "low", "high"))
    assert ((lower <= p) & (p <= upper)).all()
    assert _with_band(1.0, [low, None], "1").endswith("to ∞)")


def test_separated_runs_have_no_maximum():
    """Every run breaks above 1 m and none below: the likelihood grows for ever with the slope."""
    x = np.linspace(0.5, 1.5, 20)
    state = (x > 1.0).astype(int)
    assert not fit(x, state, 1).found[0]
    low, high = separation(x, state >= 1)
    assert low < 1.0 < high
    assert separation(*[np.append(x, 0.6), np.append(state, 1) >= 1]) is None


def test_states_that_nobody_or_everybody_reached_have_no_fit():
    x = np.linspace(0.5, 1.5, 20)
    assert not fit(x, np.zeros(20, int), 1).found[0]
    assert not fit(x, np.ones(20, int), 1).found[0]
    assert not fit(np.ones(20), np.arange(20) % 2, 1).found[0]


def test_runs_of_one_intensity_that_differ_are_where_a_state_begins():
    """Separated still: everything below stands, everything above has fallen; at 2 both were seen."""
    x, reached = np.array([1.0, 2.0, 2.0, 3.0]), np.array([False, False, True, True])
    assert separation(x, reached) == (2.0, 2.0)
