"""Orders of convergence, cheapest settings and reductions of synthetic data, whose answers are known."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler.case.study import Quantity
from coupler.commands.study.cheapest import cheapest
from coupler.commands.study.order import last_slope, slope, three_run_order
from coupler.commands.study.reading import Curve, NotRecorded, taken
from coupler.commands.study.reference import against_curve

ORDERS = st.floats(0.3, 5.0)
SIZES = st.sampled_from([(0.4, 0.2, 0.1), (0.1, 0.07, 0.05), (1.0, 0.5, 0.4), (3e-3, 1e-3, 5e-4)])


@given(p=ORDERS, sizes=SIZES, C=st.floats(1e-3, 1e3))
def test_the_slope_of_a_power_is_its_exponent(p, sizes, C):
    errors = [C * (h / sizes[0]) ** p for h in sizes]
    assert slope(sizes, errors) == pytest.approx(p, rel=1e-6)
    assert last_slope(sizes, errors) == pytest.approx(p, rel=1e-6)


@given(p=st.floats(0.3, 3.9), sizes=SIZES, limit=st.floats(-10.0, 10.0))
def test_three_runs_tell_the_order_without_the_limit(p, sizes, limit):
    values = [limit + 3.0 * (h / sizes[0]) ** p for h in sizes]
    assert three_run_order(sizes, values) == pytest.approx(p, rel=1e-3)
    assert three_run_order(sizes[::-1], values[::-1]) == pytest.approx(p, rel=1e-3)  # in any order


def test_the_finest_runs_decide_where_a_coarse_one_is_not_yet_in_the_range():
    """Of four runs the coarsest is far off e = h²; the order is that of the two, and of the three, finest."""
    sizes = np.array([0.1, 0.8, 0.4, 0.2])
    errors = np.where(sizes > 0.5, 9.0, sizes**2)
    assert last_slope(sizes, np.where(sizes > 0.3, 9.0, sizes**2)) == pytest.approx(2.0)
    assert three_run_order(sizes, 7.0 + errors) == pytest.approx(2.0)


@pytest.mark.parametrize("values", [(1.0, 2.0, 1.5), (1.0, 1.0, 1.0), (1.0, 2.0, 2.0)])
def test_runs_that_do_not_approach_a_limit_have_no_order(values):
    assert np.isnan(three_run_order((0.4, 0.2, 0.1), values))


def test_two_runs_or_errors_of_zero_give_no_order_where_there_is_none():
    assert np.isnan(three_run_order((0.2, 0.1), (1.0, 2.0)))
    assert np.isnan(slope((0.2, 0.1), (0.0, 1e-3)))
    assert np.isnan(slope((0.1, 0.1), (1e-2, 1e-3)))


def ladder(errors, name="h", cost=lambda size: 1.0 / size):
    """A plan and outcomes of runs of one ladder, of whose sizes the errors are given; finer runs cost more."""
    rungs = [SimpleNamespace(ladder=name, curve="", size=size, setting=f"{name}{size}") for size in errors]
    run = lambda size: SimpleNamespace(cpu_seconds=cost(size))  # noqa: E731
    found = {
        rung.setting: SimpleNamespace(
            run=run(rung.size), readings={"q": SimpleNamespace(error=errors[rung.size])}
        )
        for rung in rungs
    }
    return rungs, found


def cheapest_of(*ladders):
    """The setting for 5 % of several ladders; None where there is none."""
    rungs = [rung for rungs, _ in ladders for rung in rungs]
    found = {setting: outcome for _, outcomes in ladders for setting, outcome in outcomes.items()}
    plan = SimpleNamespace(rungs=rungs, study=SimpleNamespace(quantity=[SimpleNamespace(name="q")]))
    (best,) = [c for c in cheapest(plan, found) if c.level == 0.05]
    return best.rung and best.rung.setting


def test_a_coarse_run_that_hits_the_answer_by_chance_is_not_the_cheapest_setting():
    """1 % at 0.4 means nothing beside 9 % at 0.2. An error of exactly the level is within it."""
    assert cheapest_of(ladder({0.4: 0.01, 0.2: 0.09, 0.1: 0.05, 0.05: 0.02})) == "h0.1"
    assert cheapest_of(ladder({0.4: 0.01, 0.2: 0.04, 0.1: 0.03})) == "h0.4"
    assert cheapest_of(ladder({0.4: 0.2, 0.2: 0.01, 0.1: 0.09})) is None


def test_the_finest_run_which_has_no_error_against_itself_takes_nothing_from_coarser_ones():
    assert cheapest_of(ladder({0.4: 0.09, 0.2: 0.02, 0.1: np.nan})) == "h0.2"


def test_each_ladder_is_judged_by_its_own_finer_runs():
    """A short step that is off says nothing of fine cells; the cheaper of both ladders is taken."""
    cells = ladder({0.4: 0.09, 0.2: 0.02, 0.1: 0.01})
    steps = ladder({0.08: 0.09, 0.04: 0.2}, name="dt")
    assert cheapest_of(cells, steps) == "h0.2"
    dear = ladder({0.3: 0.01}, name="dt", cost=lambda size: 100.0)
    assert cheapest_of(cells, dear) == "h0.2"


def quantity(**given):
    return Quantity.model_validate(
        {"name": "q", "table": "t", "column": "c", "against": "exact", "value": 1.0} | given
    )


def test_reductions_count_within_their_window_alone():
    """A ramp v = t to 10 s: its mean, ends and integral between 2.5 and 4.5 s, which are no sample times."""
    ramp = Curve(np.arange(11.0), np.arange(11.0))
    window = (2.5, 4.5)
    assert taken(quantity(take="mean", window=window), ramp) == pytest.approx(3.5)
    assert taken(quantity(take="max", window=window), ramp) == pytest.approx(4.5)
    assert taken(quantity(take="min", window=window), ramp) == pytest.approx(2.5)
    assert taken(quantity(take="integral", window=window), ramp) == pytest.approx(7.0)
    assert taken(quantity(take="at", time=3.25), ramp) == pytest.approx(3.25)
    assert taken(quantity(take="arrival", above=6.5), ramp) == pytest.approx(6.5)
    assert np.isnan(taken(quantity(take="arrival", above=60.0), ramp))


LATE = [("max", {}), ("min", {}), ("mean", {}), ("last", {}), ("integral", {}), ("arrival", {"above": 1.0})]


@pytest.mark.parametrize(("take", "given"), LATE)
@pytest.mark.parametrize(
    ("window", "missing"),
    [((20.0, 30.0), "from 20 to 30 s"), ((5.0, 12.0), "from 10 to 12 s"), ((4.5, 11.0), "")],
)
def test_a_window_that_a_run_did_not_reach_has_no_number(take, given, window, missing):
    """Rows are a second apart: a window may end that much later, as of `[[expect]]`."""
    ramp = Curve(np.arange(11.0), np.arange(11.0))
    q = quantity(take=take, window=window, **given)
    if missing:
        with pytest.raises(NotRecorded, match=f"the run has nothing {missing}"):
            taken(q, ramp)
    else:
        assert np.isfinite(taken(q, ramp))


def test_a_time_that_a_run_did_not_reach_has_no_number():
    with pytest.raises(NotRecorded, match="the run has nothing at 12 s, only from 0 to 10 s"):
        taken(quantity(take="at", time=12.0), Curve(np.arange(11.0), np.arange(11.0)))


def measured(folder, **given):
    """A quantity against the curve of the file ref.csv."""
    return Quantity.model_validate(
        {"name": "q", "table": "t", "column": "c", "take": "curve", "against": "measured", "columns": ("t", "v"),
         "path": str(folder / "ref.csv"), "band_columns": ("low", "high")} | given
    )  # fmt: skip


def test_the_distance_of_two_curves_is_their_root_mean_square(tmp_path):
    """2 against 1.9 is off by 5 %, whatever the times of the samples; the scatter 1.7 to 2.3 is 15 % wide a side."""
    (tmp_path / "ref.csv").write_text(
        "# who\nt,v,low,high\n0,2,1.7,2.3\n1,2,1.7,2.3\n3,2,1.7,2.3\n9,2,1.7,2.3\n"
    )
    q = measured(tmp_path, window=(0.0, 4.0))
    found = against_curve(q, Curve(np.linspace(0.0, 4.0, 50), np.full(50, 1.9)))
    assert found.value == pytest.approx(0.1)
    assert found.error == pytest.approx(0.05)
    assert found.band == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("end", "points", "window", "why"),
    [
        (
            4.0,
            (0, 1, 3, 9),
            None,
            r"the run has nothing from 4 to 9 s of the reference .*ref.csv; give a window",
        ),
        (0.5, (2, 3), None, "the run has nothing from 2 to 3 s of the reference"),
        (4.0, (5, 6), (0, 4), "ref.csv: there is nothing from 0 to 4 s"),
        (9.0, (0, 1, 3), (0, 9), "ref.csv: there is nothing from 3 to 9 s"),
        (4.0, (1,), None, "ref.csv has one point"),
    ],
)
def test_curves_that_do_not_cover_one_another_have_no_distance(tmp_path, end, points, window, why):
    """A run that covers half of a reference had the distance of that half; one that met a point of it divided by 0."""
    rows = "".join(f"{t},2,1.7,2.3\n" for t in points)
    (tmp_path / "ref.csv").write_text(f"# who\nt,v,low,high\n{rows}")
    with pytest.raises(NotRecorded, match=why):
        against_curve(measured(tmp_path, window=window), Curve(np.linspace(0.0, end, 50), np.full(50, 1.9)))


def test_a_value_that_meets_the_finest_by_chance_gives_no_order():
    """Impulses that differ by 7.2 and 0.67 % from the finest, on cells of 75 and 60 mm: 9.9 is no order."""
    assert np.isnan(three_run_order((0.075, 0.06, 0.05), (1.0721, 1.00671, 1.0)))
