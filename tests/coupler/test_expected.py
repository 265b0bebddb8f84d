"""How a history is compared with what a case promises, on functions whose answers are known."""

import numpy as np
import pytest

from coupler.expected import TAKE, BadExpectation, verdicts
from coupler.history import HistoryTable

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
        ("arrival", 5.0 * TIME, 1.21),
        ("period", 7.0 + np.cos(2 * np.pi * TIME / 0.8), 0.8),
    ],
)
def test_what_is_taken_from_a_history(take, values, answer):
    assert TAKE[take](TIME, values, ENTRY) == pytest.approx(answer, rel=1e-3)


def write_run(folder, expected):
    (folder / "history").mkdir()
    table = HistoryTable(folder / "history" / "a.csv", (("time", "s", "time"), ("x", "m", "a length")))
    for time, x in ((0.0, 1.0), (1.0, 2.0), (2.0, 4.0)):
        table.append(time=time, x=x)
    table.close()
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


def test_a_wrong_column_is_told_with_the_nearest(tmp_path):
    with pytest.raises(BadExpectation, match=r"no column 'tim'; did you mean 'time'\?"):
        write_run(tmp_path, ONE.replace('column = "x"', 'column = "tim"') + "at_least = 0")
