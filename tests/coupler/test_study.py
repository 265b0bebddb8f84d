"""A study from the case to its figures: errors, orders, costs, going on, and what it refuses."""

import json

import pytest

from coupler.case.formula import BadFormula
from coupler.commands.study import command, runner
from coupler.commands.study.plan import make_plan
from coupler.program.errors import BadCase, ExitCode

from .fake_runs import CASE, FakeProcesses


@pytest.fixture
def fake(monkeypatch, request):
    processes = FakeProcesses()
    monkeypatch.setattr(runner, "measure", processes)
    if "with_figures" not in request.fixturenames:
        monkeypatch.setattr(command, "draw", lambda module, folder: None)
    return processes


@pytest.fixture
def with_figures():
    """Asked for by a test that draws; the others go without, which takes a second each."""


@pytest.fixture
def case(tmp_path):
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    return tmp_path


def made(case, *, ladders=(), repeat=None, larger=False, any_version=False):
    """The exit code, and what study.json says."""
    code = command.study(case, ladders, repeat, case / "out", larger, any_version)
    return code, json.loads((case / "out" / "study.json").read_text(encoding="utf-8"))


def test_errors_are_those_of_the_formula(fake, case):
    """value = 2 (1 + h²): h² from the exact answer 2; against 2.02 it is |h² - 0.01|/1.01."""
    code, reported = made(case)
    assert code == ExitCode.DONE
    for point, h in zip(reported["points"], (0.4, 0.2, 0.1)):
        found = point["readings"]
        assert found["exact"]["error"] == pytest.approx(h**2)
        assert found["measured"]["error"] == pytest.approx(abs(h**2 - 0.01) / 1.01, abs=1e-12)
        assert found["measured"]["band"] == pytest.approx(0.1 / 2.02)
        if h == 0.1:
            assert found["finest"]["error"] is None  # the reference has no error against itself
        else:
            assert found["finest"]["error"] == pytest.approx((h**2 - 0.01) / 1.01)


def test_the_order_is_that_of_the_formula_whatever_the_reference(fake, case):
    """2 from the errors, and from three runs without knowing the limit; a law has no size and no order."""
    _, reported = made(case)
    orders = {(o["quantity"], o["ladder"]): o for o in reported["orders"]}
    assert orders["exact", "dt"]["overall"] == pytest.approx(2.0)
    assert orders["exact", "dt"]["finest"] == pytest.approx(2.0)
    assert orders["finest", "dt"]["finest"] == pytest.approx(2.0)
    assert orders["finest", "dt"]["overall"] is None
    assert ("exact", "rule") not in orders


def test_cost_is_that_of_the_steps_with_start_set_up_and_compilation_apart(fake, case):
    """1/h + 0.25 s of steps in a process of 3 + 1/h s, 0.75 s of them set-up."""
    _, reported = made(case, ladders=["dt"])
    run = reported["runs"][reported["points"][0]["setting"]]
    assert run["cpu_seconds"] == pytest.approx(1 / 0.4 + 0.25)
    assert run["set_up_seconds"] == pytest.approx(0.75)
    assert run["start_seconds"] == pytest.approx(3.0 - 0.25 - 0.75)
    assert (run["passes"], run["peak_memory"], run["size"]) == (1.5, 10**8, {"blocks": 1})


def test_a_run_that_had_to_compile_is_made_again(fake, case):
    """Kernels that the warm-up did not need are compiled by the first run; its cost is not that of the setting."""
    fake.compiling = 2.0
    _, reported = made(case, ladders=["dt"])
    assert len(fake.calls) == 4
    assert {run["compile_seconds"] for run in reported["runs"].values()} == {0.0}


def test_the_cheapest_setting_is_found_and_what_a_part_costs(fake, case):
    """Errors 16, 4 and 1 %: 5 % needs h = 0.2; friction costs a quarter of a second of 10.25."""
    _, reported = made(case)
    found = {(c["quantity"], c["level"]): c["rung"] for c in reported["cheapest"] if not c["curve"]}
    assert found["exact", 0.05]["label"] == "0.2"
    assert found["exact", 0.10]["label"] == "0.2"
    (part,) = reported["parts"]
    assert part["name"] == "friction"
    assert part["cpu_seconds"] == pytest.approx(0.25)
    assert part["share"] == pytest.approx(0.25 / 10.25)


def test_a_window_that_the_runs_did_not_reach_gives_no_error_but_the_reason(fake, case):
    """In study.json, study.csv and on the page; the other quantities of the runs are as they were."""
    text = (
        (case / "case.toml")
        .read_text()
        .replace('against = "measured"', 'window = [20, 30]\nagainst = "measured"')
    )
    (case / "case.toml").write_text(
        text.replace('take = "mean"', 'take = "mean"\nwindow = [0, 30]'), encoding="utf-8"
    )
    code, reported = made(case, repeat=2)
    assert code == ExitCode.DONE
    point = reported["points"][0]["readings"]
    assert (point["measured"]["value"], point["measured"]["error"]) == (None, None)
    assert point["measured"]["why"] == "the run has nothing from 20 to 30 s"
    assert point["finest"]["why"].startswith("the run has nothing from ")
    assert point["exact"]["error"] == pytest.approx(0.16)
    assert all(run["same"] for run in reported["runs"].values())
    assert "measured: the run has nothing from 20 to 30 s" in (case / "out" / "study.md").read_text(
        encoding="utf-8"
    )
    assert "the run has nothing from 20 to 30 s" in (case / "out" / "study.csv").read_text(encoding="utf-8")


def test_the_same_setting_is_run_once(fake, case):
    """dt = 0.1 and rule = exact are the case as it stands."""
    made(case)
    assert len(fake.calls) == 5  # h = 0.4, 0.2, the case itself, rule = paper, no friction


def test_a_study_that_was_stopped_says_so_and_goes_on(fake, case, capsys):
    fake.stop_after = 2
    assert command.study(case, [], None, case / "out", False, False) == ExitCode.STOPPED
    assert "the same command goes on" in capsys.readouterr().out
    assert len(fake.calls) == 2
    fake.stop_after = None
    _, reported = made(case)
    assert len(fake.calls) == 5
    made(case)
    assert len(fake.calls) == 5  # nothing is left to do
    assert len(reported["points"]) == 5


def test_a_half_written_run_is_made_again(fake, case):
    """A machine that went down leaves a run directory without what it cost."""
    made(case)
    folder = case / "out" / "runs"
    figures = sorted(folder.glob("*-1.json"))[0]
    figures.unlink()
    (folder / figures.stem / "run.json").write_text('{"status": "running"', encoding="utf-8")
    made(case)
    assert len(fake.calls) == 6


def test_larger_rungs_are_added_to_what_is_there(fake, case):
    made(case)
    _, reported = made(case, larger=True)
    assert len(fake.calls) == 6
    assert [p["label"] for p in reported["points"]] == ["0.4", "0.2", "100 ms", "0.05", "exact", "paper"]
    # the finest run is another one now, and is named
    assert reported["quantities"][2]["finest"] == {"ladder": "dt", "label": "0.05"}


def test_runs_of_another_version_are_made_again_unless_reported_otherwise(fake, case, monkeypatch):
    made(case)
    monkeypatch.setattr(runner, "program", lambda: {"surgebreak": "another"})
    made(case, any_version=True)
    assert len(fake.calls) == 5
    made(case)
    assert len(fake.calls) == 10


def test_repeats_tell_the_cheapest_run_and_whether_they_agree(fake, case):
    _, reported = made(case, ladders=["dt"], repeat=3)
    assert len(fake.calls) == 9
    run = next(iter(reported["runs"].values()))
    assert len(run["repeats"]) == 3
    assert run["same"] is True


def test_a_failed_run_is_reported_with_its_reason_and_is_no_reference(fake, case, capsys):
    """The finest run fails: errors against it are absent, never taken against the next finest."""
    fake.broken = {0.1: "the energy balance is off by 9 %"}
    code, reported = made(case, ladders=["dt"])
    assert code == ExitCode.DIVERGED
    assert [p["reason"] for p in reported["points"]] == ["", "", "the energy balance is off by 9 %"]
    assert reported["points"][0]["readings"]["finest"]["error"] is None
    assert "off by 9 %" in capsys.readouterr().out
    assert len(fake.calls) == 3
    made(case, ladders=["dt"])
    assert len(fake.calls) == 3  # it would fail the same way again


def test_files_say_all_of_it_and_figures_are_drawn(fake, case, with_figures):
    fake.broken = {0.4: "too long a step"}
    made(case)
    rows = (case / "out" / "study.csv").read_text(encoding="utf-8").splitlines()
    assert len(rows) == 1 + 5 * 3
    text = (case / "out" / "study.md").read_text(encoding="utf-8")
    for words in ("Cheapest setting", "Observed order", "Cost of parts", "too long a step", "numba"):
        assert words in text
    for name in ("exact", "measured", "finest"):
        assert (case / "out" / f"{name}.png").stat().st_size > 10_000
        assert (case / "out" / f"{name}.pdf").exists()


LAWS = """
[[study.ladder]]
name = "laws"
laws = ["polynomial", "cohfrict"]
substeps = [2, 1]
"""


def test_laws_of_yade_have_points_and_a_figure_of_their_own(fake, case, with_figures):
    """From one comparison, at the CPU time of stepping alone; it is not made twice."""
    text = CASE.replace('against = "exact"', 'against = "exact"\ncompared = "peak_force"') + LAWS
    (case / "case.toml").write_text(text, encoding="utf-8")
    for _ in range(2):
        _, reported = made(case, ladders=["laws"])
        assert len(fake.calls) == 1
    errors = {(row["law"], row["multiple"]): row["readings"]["exact"]["error"] for row in reported["laws"]}
    assert errors["polynomial", 2] == pytest.approx(0.02)
    assert errors["cohfrict", 1] == pytest.approx(0.04)
    assert (case / "out" / "exact_laws.png").exists()


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('column = "value"\nagainst = "exact"', 'column = "valu"\nagainst = "exact"', "did you mean 'value'?"),
        ("history/gauges.csv", "history/gauge.csv", "did you mean 'history/gauges.csv'?"),
        ("block[0].size[2]", "block[0].siz[2]", "did you mean 'size'?"),
        ('value = "structure', 'value = "0 * structure', "give scale"),
    ],
)  # fmt: skip
def test_a_wrong_name_ends_the_study_at_the_first_run(fake, case, old, new, says):
    """Columns are known only from a run; the study does not spend the time of all of them first."""
    (case / "case.toml").write_text(CASE.replace(old, new, 1), encoding="utf-8")
    with pytest.raises((BadCase, BadFormula)) as reported:
        made(case)
    assert says in str(reported.value)
    assert len(fake.calls) == 1


def test_unknown_ladders_are_refused_with_those_there_are(case):
    with pytest.raises(BadCase, match="no such ladder; there are dt, rule"):
        make_plan(case, ["rul"])


def test_a_rung_that_is_no_case_is_refused_before_any_run(fake, case):
    text = CASE.replace('values = ["exact", "paper"]', 'values = ["exact", "papr"]')
    (case / "case.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadCase, match="did you mean 'paper'"):
        made(case)
    assert fake.calls == []


def test_a_case_without_a_study_says_what_to_write(case):
    (case / "case.toml").write_text(CASE.partition("[study]")[0], encoding="utf-8")
    with pytest.raises(BadCase, match=r"\[\[study.quantity\]\]"):
        make_plan(case)


REAL = """\
[case]
title = "a block falls"
[time]
end = 0.1
step_max = 0.05
output_every = 0.1
checkpoint_every = 0
[structure]
[[structure.block]]
name = "box"
size = [1, 1, 1]
centre = [0, 0, 5]
[contact]
stiffness = 1e5
[[gauge]]
kind = "motion"
name = "box"
of = "box"
[study]
[[study.quantity]]
name = "way"
table = "history/gauges.csv"
column = "box_centre_z"
against = "exact"
value = "5 - 0.5 * case.gravity * time.end**2"
scale = 0.049
[[study.ladder]]
name = "dt"
key = ["structure.substep", "time.step_max"]
values = [["20 ms", "20 ms"], ["10 ms", "10 ms"]]
"""


def test_a_real_study_of_a_falling_block(tmp_path):
    """Processes as a user runs them. The velocity of a step moves the block through it, so the way of a fall from rest
    is off by the share that the step has of the fall, whose error is of first order."""
    (tmp_path / "case.toml").write_text(REAL)
    code, reported = made(tmp_path)
    assert code == ExitCode.DONE
    errors = [point["readings"]["way"]["error"] for point in reported["points"]]
    assert errors == pytest.approx([0.2, 0.1], rel=0.02)
    assert reported["orders"][0]["overall"] == pytest.approx(1.0, abs=0.05)
    for run in reported["runs"].values():
        assert run["size"] == {"blocks": 1, "joints": 0}
        assert run["peak_memory"] > 50e6
        assert run["cpu_seconds"] > 0.0
        assert run["start_seconds"] > 0.1


def test_a_case_that_changes_while_the_study_runs_is_refused(fake, case, monkeypatch):
    """Its runs would be kept under the name of the case as it was."""
    wrong = {"case": {"title": "edited"}}
    monkeypatch.setattr(runner, "read_summary", lambda place: {"figures": {}, "case": wrong})
    with pytest.raises(BadCase, match="changed while the study ran"):
        made(case)
