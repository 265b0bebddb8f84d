"""How a history is compared with what a case promises, on functions whose answers are known."""

import numpy as np
import pytest

from coupler.case.promises import mistakes_in
from coupler.checks.read_case import load
from coupler.program.errors import BadCase
from coupler.results.expected import TAKE, first_above, verdicts
from coupler.results.history import HistoryTable
from tests.coupler.test_case_file import WATER

TIME = np.linspace(0.0, 4.0, 401)
ENTRY = {"time": 1.234, "from": 1.0, "to": 2.5, "above": 6.0}


@pytest.mark.parametrize(
    ("take", "values", "answer"),
    [
        ("last", TIME**2, 16.0),
        ("largest", 3.0 - TIME**2, -13.0),
        ("mean", 5.0 * TIME, 10.0),
        ("at", 2.0 * TIME, 2.468),
        ("integral", 2.0 * TIME, 2.5**2 - 1.0),
        ("arrival", 5.0 * TIME, 1.2),
        ("period", 7.0 + np.cos(2 * np.pi * TIME / 0.8), 0.8),
    ],
)
def test_what_is_taken_from_a_history(take, values, answer):
    assert TAKE[take](TIME, values, ENTRY) == pytest.approx(answer, rel=1e-3)


def test_an_arrival_does_not_wait_for_the_next_row():
    """A gauge that is dry, and at the first row with water far above what is asked for: on a line between the two rows.
    One that is wet from the start has arrived at its first row, as one whose rows before are empty."""
    time = np.array([1.0, 2.0, 3.0])
    assert first_above(time, np.array([0.0, 0.0, 0.4]), 0.1) == pytest.approx(2.25)
    assert first_above(time, np.array([0.2, 0.3, 0.4]), 0.1) == 1.0
    assert first_above(time, np.array([np.nan, np.nan, 0.4]), 0.1) == 3.0
    assert np.isnan(first_above(time, np.array([0.0, 0.05, 0.1]), 0.1))


def write_history(folder):
    """x is 1, 2, 4 m at 0, 1, 2 s."""
    (folder / "history").mkdir()
    table = HistoryTable(folder / "history" / "a.csv", (("time", "s", "time"), ("x", "m", "a length")))
    for time, x in ((0.0, 1.0), (1.0, 2.0), (2.0, 4.0)):
        table.append(time=time, x=x)
    table.close()


def write_run(folder, expected):
    write_history(folder)
    (folder / "expected.toml").write_text(expected, encoding="utf-8")
    return verdicts(folder, folder / "expected.toml")


ONE = '[[expect]]\nwhat = "x"\ntable = "history/a.csv"\ncolumn = "x"\ntake = "largest"\n'


@pytest.mark.parametrize(
    ("bound", "kept"),
    [
        ("value = 4\ntolerance = 0.1", True),
        ("value = 3\ntolerance = 0.1", False),
        ("at_least = 5", False),
        ("at_most = 4", True),
    ],
)
def test_verdicts(tmp_path, bound, kept):
    (verdict,) = write_run(tmp_path, ONE + bound)
    assert (verdict.found, verdict.kept) == (4.0, kept)


@pytest.mark.parametrize(
    ("right", "wrong", "reported"),
    [
        ('column = "x"', 'column = "tim"', "history/a.csv has no column 'tim'; did you mean 'time'?"),
        ("a.csv", "b.csv", "the run has no table history/b.csv"),
    ],
)
def test_a_promise_about_what_the_run_has_not_is_not_kept(tmp_path, right, wrong, reported):
    """The run is done by then: its results must not be lost for a slip in the promise."""
    (verdict,) = write_run(tmp_path, ONE.replace(right, wrong) + "at_least = 0")
    assert not verdict.kept
    assert str(verdict) == f"x: {reported}, expected 0 to inf"


FIVE = '[[expect]]\nwhat = "x"\ntable = "history/b.csv"\ncolumn = "f"\nat_least = 0\n'


def constant(folder, entry):
    """The verdict on a force of 5 N that a run of one second recorded every 0.1 s, from its first step on."""
    (folder / "history").mkdir(parents=True)
    table = HistoryTable(folder / "history" / "b.csv", (("time", "s", "time"), ("f", "N", "a force")))
    for k in range(1, 11):
        table.append(time=0.1 * k, f=5.0)
    table.close()
    (folder / "expected.toml").write_text(FIVE + entry, encoding="utf-8")
    (verdict,) = verdicts(folder, folder / "expected.toml")
    return verdict


@pytest.mark.parametrize("take", ["integral", "mean", "max", "last", "period"])
@pytest.mark.parametrize(
    ("window", "missing"),
    [
        ("from = 0.5\nto = 3", "from 1 to 3 s"),
        ("from = -1\nto = 0.5", "from -1 to 0.1 s"),
        ("from = 2\nto = 3", "from 2 to 3 s"),
        ("from = -2\nto = 3", "from -2 to 0.1 s"),
    ],
)
def test_a_window_that_the_run_has_not_is_neither_extended_nor_shortened(tmp_path, take, window, missing):
    verdict = constant(tmp_path, f'take = "{take}"\n{window}\n')
    assert not verdict.kept
    assert verdict.reason == f"the run has nothing {missing}"


def test_a_window_may_begin_before_the_first_row_by_an_interval(tmp_path):
    """A history has no row at the start; what is integrated is what was recorded, 0.4 s and then 0.5 s of it."""
    assert constant(tmp_path / "0", 'take = "integral"\nfrom = 0\nto = 0.5\n').found == pytest.approx(2.0)
    assert constant(tmp_path / "1", 'take = "integral"\nfrom = 0.5\nto = 1.05\n').found == pytest.approx(2.5)


def test_a_value_at_a_time_after_the_end_is_none(tmp_path):
    assert constant(tmp_path / "0", 'take = "at"\ntime = 1.05\n').found == 5.0
    late = constant(tmp_path / "1", 'take = "at"\ntime = 1.5\n')
    assert late.reason == "the run has nothing at 1.5 s, only from 0.1 to 1 s"


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        (ONE, "expected.toml:1: expect[0]: give value and tolerance, or at_least, at_most or both of these"),
        (ONE + "value = 1", "give value and tolerance"),
        (ONE + "at_most = nan", "expected.toml:6: expect[0].at_most: nan: input should be a finite number"),
        (ONE.replace('"largest"', '"at"') + "at_most = 1", "take = 'at' needs time"),
        (ONE.replace('"largest"', '"integral"') + "at_most = 1\nfrom = 2\nto = 1", "must be less than to"),
        (
            ONE.replace('"largest"', '"biggest"') + "at_most = 1",
            "expected.toml:5: expect[0].take: 'biggest': inp",
        ),
        (ONE + "at_most = 1\nfoo = 1", "expected.toml:7: expect[0].foo: unknown name"),
        ("[[expect]]\nat_most = 1", "expected.toml:1: expect[0].what: missing"),
        ("expect = 1", "expected.toml:1: expect: 1: input should be a valid tuple"),
        ("expect = [", "expected.toml: not valid TOML"),
        (
            '[[curve]]\nfigure = "a"\npanel = "b"\ntable = "c"',
            "give column, or columns with places and above",
        ),
        (
            '[[curve]]\nfigure = "../a"\npanel = "b"\ntable = "c"\ncolumn = "d"',
            "curve[0].figure: '../a': string",
        ),
    ],
)
def test_a_wrong_file_is_reported_before_the_run(tmp_path, text, reported):
    (tmp_path / "expected.toml").write_text(text, encoding="utf-8")
    (line,) = [line for line in mistakes_in(tmp_path) if reported in line]
    assert line.startswith(str(tmp_path))


def test_a_wrong_file_beside_the_case_refuses_it(tmp_path):
    (tmp_path / "case.toml").write_text(WATER, encoding="utf-8")
    assert load(tmp_path)
    (tmp_path / "expected.toml").write_bytes(b"\xff")
    with pytest.raises(BadCase, match=r"expected.toml: not a text in UTF-8 \(byte 0\)"):
        load(tmp_path)
