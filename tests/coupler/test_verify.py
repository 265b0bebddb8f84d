"""The command verify: judging, reporting, isolation. The physics is in the cases themselves."""

import json
import math

import numpy as np
import pytest

from coupler.case.records import SHIPPED
from coupler.commands.verify import collapse, dam_breaks, page, registry, report, runner
from coupler.commands.verify.figures import columns, named_values
from coupler.commands.verify.registry import Check, Finding, Result
from coupler.commands.verify.scenes import tank
from coupler.program.errors import BadCase, ExitCode


def test_the_error_is_a_share_or_a_difference():
    assert Finding("q", 1.02, 1.0, 0.05).error == pytest.approx(0.02)
    assert Finding("q", 3.0, 2.0, 0.5, relative=False).error == 1.0


@pytest.mark.parametrize(
    ("value", "passed"), [(1.04, True), (0.96, True), (1.06, False), (math.nan, False), (math.inf, False)]
)
def test_a_value_passes_within_its_tolerance_and_never_without_being_a_number(value, passed):
    assert Result.of("P99", Finding("q", value, 1.0, 0.05), 0.1).passed is passed


def test_every_reference_case_is_checked_or_its_absence_explained():
    """The list of reference cases runs from P01; P58 is our own. No id is both checked and excused."""
    checked, excused = set(registry.checks()), set(registry.NOT_COVERED)
    assert not checked & excused
    known = {*range(1, 12), *range(20, 29), *range(30, 44), *range(50, 59), *range(60, 69)}
    assert checked | excused == {f"P{k:02}" for k in known}


def test_references_name_their_source():
    """Each table starts with lines that say where it comes from, and its numbers can be read."""
    for path in sorted(SHIPPED.glob("*.csv")):
        assert path.read_text(encoding="utf-8").startswith("# ")
    assert columns("coh_mode1_law")["T_over_Tmax"].max() == pytest.approx(1.0, abs=1e-3)
    assert named_values("dem_simple_closed_forms")["drop 0.5 m: impact speed"] == pytest.approx(3.132092)


def test_the_clock_of_a_record_is_found_from_the_fall_of_the_reservoir():
    """A computed level that is the measured one 20 ms later, read by a probe 4 mm off, sets the clock 20 ms ahead; on
    that clock a pressure that is as late is right, and on its own it is not."""
    levels, pressures = columns("kleefsman_heights_h1_h4"), columns("kleefsman_pressure_p1_p3_p5_p7")
    late = {"t": levels["t_s"] + 0.02, "H4": levels["H4_x2638_m"] + 0.004}
    assert dam_breaks.clock(late) == pytest.approx(0.02, abs=1e-9)
    late = {"t": pressures["t_s"] + 0.02, "P1": pressures["P1_Pa"]}
    assert dam_breaks.pressure_rms(late, pressures, "P1", 0.02) < 1.0
    assert dam_breaks.pressure_rms(late, pressures, "P1", 0.0) > 1000.0


def test_unknown_and_absent_cases_are_distinguished(monkeypatch):
    with pytest.raises(BadCase, match="did you mean"):
        runner.chosen(["P2O"], quick=False)
    monkeypatch.setitem(registry.NOT_COVERED, "P99", "a reference that nobody has")
    with pytest.raises(BadCase, match=r"not covered: .*nobody"):
        runner.chosen(["P99"], quick=False)


def test_quick_leaves_the_long_cases_out():
    assert {case.cost for case in runner.chosen([], quick=True)} == {"S"}
    with pytest.raises(BadCase, match="--quick leaves out P23"):  # or it would end well without a check
        runner.chosen(["P23"], quick=True)


def test_a_process_that_dies_is_a_failed_result_with_its_last_words():
    """An id that the child does not know makes it end with a KeyError: seen as any crash is."""
    lost = Check("P00", "none", "nothing", "nowhere", "S", lambda: iter(()))
    (result,) = runner.run(lost)
    assert not result.passed
    assert "P00" in result.reason
    assert "FAIL" in report.line(result)


def test_a_case_of_the_law_runs_in_its_own_process(capsys):
    """From the command to JSON: two rows of formulas, and four of each law from a joint pulled apart in YADE."""
    code = report.verify(["p20"], quick=True, as_json=True, only_list=False)
    rows = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert code == ExitCode.DONE
    assert len(rows) == 14
    assert {"id", "quantity", "value", "expected", "error", "tolerance", "pass", "cpu_s"} <= set(rows[0])
    assert all(row["pass"] for row in rows)


def test_what_is_only_reported_is_not_counted_as_kept():
    """A case that promises nothing would else raise the share of figures that pass."""
    reported = Result("P43", "rms of G1 (reported, not judged)", 0.04, 0.0, 0.04, 0.1, False, True, 1.0)
    kept = Result("P43", "volume", 0.0, 0.0, 0.0, 0.1, False, True, 1.0)
    assert "1 of 1 figures" in report.totals([reported, kept])
    assert " reported " in report.line(reported)
    assert "1 of 1 |" in page.page([reported, kept])


@pytest.mark.parametrize("value", [0.15, math.nan])
def test_what_is_only_reported_fails_no_case(value, monkeypatch):
    """Whatever its value and the tolerance it was given."""
    reported = Result.of("P43", Finding(f"rms of G1 {registry.TOLD}", value, 0.0, 0.1, False), 0.0)
    kept = Result.of("P43", Finding("volume", 0.0, 0.0, 0.1, False), 0.0)
    assert "1 of 1 cases pass, 1 of 1 figures" in report.totals([reported, kept])
    assert "1 of 1 cases pass, and 1 of 1 quantities" in page.page([reported, kept])
    monkeypatch.setattr(report, "run", lambda case, plots: [reported, kept])
    assert report.verify(["p43"], quick=False, as_json=False, only_list=False) == ExitCode.DONE


def test_a_failure_is_counted_and_named():
    good = Result.of("P01", Finding("a", 1.0, 1.0, 0.1), 1.0)
    bad = Result.of("P02", Finding("b", 2.0, 1.0, 0.1), 2.0)
    reported = report.totals([good, bad])
    assert "1 of 2 cases pass" in reported
    assert "not: P02" in reported


@pytest.mark.parametrize("cells", [8, 12])
@pytest.mark.parametrize("at", [0.513, 0.54])
def test_the_front_of_a_wedge_is_read_where_it_is(cells, at):
    """A plane surface that meets a line above the bed at x = `at`, between the points of the line: the cells represent
    it exactly. Read at the last wet point, the front lagged by up to their distance, more on coarser cells."""
    height = 0.03

    def wedge(x):
        return 0.8 * (x[:, 0] - at) + 0.6 * (x[:, 2] - height)

    water = tank((1.0, 1.0 / cells, 1.0), (cells, 1, cells), wedge).water
    x = np.linspace(0.0, 1.0, 4 * cells + 1)
    bed = np.column_stack([x, np.full_like(x, 0.5 / cells), np.full_like(x, height)])
    assert collapse._front(water, bed) == pytest.approx(at, abs=1e-9)
