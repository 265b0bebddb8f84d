"""Figures of computed over measured curves: what verify hands out, what a run reads from its case."""

import json

import numpy as np
import pytest

from coupler.case.records import SHIPPED, NoSuchData, find_record, read_record
from coupler.commands.verify import one
from coupler.commands.verify.courant import figures as peak_mean_impulse
from coupler.commands.verify.curves import Curve, Figure, Panel, as_json
from coupler.commands.verify.registry import Check, Finding
from coupler.results.history import HistoryTable

view = pytest.importorskip("coupler.commands.view.over_data", reason="the extra `view` is not installed")
draw = pytest.importorskip("coupler.commands.view.curves").draw
RAMP = np.linspace(0.0, 2.0, 21)
FIGURE = Figure(
    "ramp",
    (
        Panel(
            "time [s]",
            "level [m]",
            (
                Curve("band", "band", RAMP, RAMP - 0.1, RAMP + 0.1),
                Curve("record", "measured", RAMP, RAMP),
                Curve("theory", "exact", RAMP, RAMP),
                Curve("ours", "computed", RAMP, RAMP),
                Curve("theirs", "other", RAMP, RAMP),
            ),
        ),
    ),
)


def test_figures_travel_beside_the_findings(tmp_path):
    """Only findings are judged; figures are written where they are asked for, and dropped else."""

    def run():
        yield Finding("q", 1.0, 1.0, 0.1)
        yield FIGURE

    case = Check("P99", "none", "t", "s", "S", run)
    assert [r.quantity for r in one.results(case)] == ["q"]
    with open(tmp_path / "figures", "w", encoding="utf-8") as file:
        assert len(list(one.results(case, file))) == 1
    (line,) = (tmp_path / "figures").read_text(encoding="utf-8").splitlines()
    assert json.loads(line) == as_json(FIGURE)


def test_a_figure_is_drawn_in_three_formats(tmp_path):
    path = draw(as_json(FIGURE), tmp_path)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["ramp.pdf", "ramp.png", "ramp.svg"]
    assert path.stat().st_size > 10_000


def test_arrivals_of_a_front():
    """A front of 1 m/s that passes 0.503, 1.008 and (not within the run) 5 m, between two rows of the table."""
    level = np.array([RAMP - x for x in (0.503, 1.008, 5.0)])
    found = view.arrivals(RAMP, level, 0.0)
    assert found[:2] == pytest.approx([0.503, 1.008])
    assert np.isnan(found[2])


def test_peak_mean_and_impulse_of_a_known_pulse():
    """A rectangle of 10 Pa over 0.2 s within the window, on steps of any length: peak and mean 10, impulse 2."""
    t = np.array([0.0, 0.4, 0.4001, 0.6, 0.6001, 1.2])
    p = np.array([0.0, 0.0, 10.0, 10.0, 0.0, 0.0])
    assert peak_mean_impulse(t, p, 0.1, 1.0) == pytest.approx((10.0, 10.0, 2.0), rel=1e-2)


def case_with_run(folder, expected):
    """A case directory with a record, and a run of it with one history."""
    case, run = folder / "case", folder / "run"
    (run / "history").mkdir(parents=True)
    case.mkdir()
    (case / "record.csv").write_text("# source\nt,h\n0,0\n2,4\n", encoding="utf-8")
    (case / "expected.toml").write_text(expected, encoding="utf-8")
    (run / "run.json").write_text(json.dumps({"case_file": str(case / "case.toml")}), encoding="utf-8")
    table = HistoryTable(run / "history" / "gauges.csv", (("time", "s", "time"), ("H_level", "m", "depth")))
    for time in RAMP:
        table.append(time=time, H_level=2 * time)
    table.close()
    return run


CURVE = """[[curve]]
figure = "levels"
panel = "depth [m]"
table = "history/gauges.csv"
column = "H_level"
references = [{ file = "record.csv", x = "t", y = "h", label = "measured" }]
"""


def test_a_run_is_drawn_over_the_data_of_its_case(tmp_path):
    run = case_with_run(tmp_path, CURVE)
    (path,) = view.over_data(run, tmp_path)
    assert path.name == "levels.png"
    assert path.exists()


@pytest.mark.parametrize(
    ("was", "now", "said"),
    [('y = "h"', 'y = "hh"', "no column 'hh'"), ("record.csv", "recrd.csv", "no such file")],
)
def test_data_that_are_not_there_are_named(tmp_path, was, now, said):
    run = case_with_run(tmp_path, CURVE.replace(was, now))
    with pytest.raises(NoSuchData, match=said):
        view.over_data(run, tmp_path)


def test_a_run_whose_case_is_gone_has_no_data(tmp_path):
    """Copied results are still shown; what they were compared with is elsewhere."""
    assert view.directory_of_case(tmp_path) is None
    (tmp_path / "run.json").write_text(json.dumps({"case_file": "/no/such/case.toml"}), encoding="utf-8")
    assert view.over_data(tmp_path, tmp_path) == []


def test_records_of_the_program_are_found_by_name_behind_those_of_the_case(tmp_path):
    """A copied case still finds them; a file of the case with the same name goes before."""
    name = "sloshing_linear.csv"
    assert find_record(name, tmp_path) == SHIPPED / name
    (tmp_path / name).write_text("# ours\na,b\n1,2\n", encoding="utf-8")
    assert read_record(find_record(name, tmp_path))["b"] == [2.0]
    assert find_record("nowhere.csv", tmp_path) == tmp_path / "nowhere.csv"
