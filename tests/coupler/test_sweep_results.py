"""From the files of runs to table, curves and report, with runs that come from a formula instead of a computation."""

import json
import math
import re
from html import unescape

import numpy as np
import pytest

from coupler.commands.study.runner import Cost
from coupler.commands.sweep import command
from coupler.commands.sweep.command import SweepRequest, _Progress, finish
from coupler.commands.sweep.folder import figures, read_spec, write_spec
from coupler.commands.sweep.fragility import Runs, curves, read_runs, refusal
from coupler.commands.sweep.one import make, outcome_of
from coupler.commands.sweep.page import analyse, write
from coupler.commands.sweep.plan import make_plan
from coupler.commands.sweep.quantities import read_quantity
from coupler.commands.sweep.results import collect, open_sweep, write_tables
from coupler.commands.sweep.sensitivity import rank_rows, sobol_rows
from coupler.commands.sweep.snakemake import export
from coupler.program.errors import BadCase, ExitCode
from coupler.results.history import HistoryTable, read_history

from .arm import CASE
from .fake_runs import SUMMARY

SWEEP = """
[sweep]
samples = 6
keep = "{keep}"
sensitivity = ["peak"]
[[sweep.vary]]
name = "load"
key = "structure.block[1].velocity[0]"
low = 0.5
high = 2
steps = 8
[[sweep.vary]]
key = "joints.strength"
distribution = "lognormal"
median = "1 MPa"
dispersion = 0.4
[[sweep.quantity]]
name = "peak"
table = "history/gauges.csv"
column = "value"
take = "max"
[[sweep.quantity]]
name = "square"
table = "history/gauges.csv"
formula = "value * abs(value) / joints"
take = "max"
[[sweep.quantity]]
name = "ratio"
formula = "peak * 1e6 / strength + 0 * joints.opening_at_failure"
[[sweep.fragility]]
name = "load"
measure = "load"
[[sweep.fragility.state]]
name = "cracked"
quantity = "ratio"
at_least = 1
[[sweep.fragility.state]]
name = "broken"
quantity = "ratio"
at_least = 1.6
"""
COLUMNS = (("time", "s", "t"), ("value", "N", "v"), ("joints", "1", "n"))


class Fake:
    """An `Execute`: a run has the value `load` at its end; some fail. calls: what was executed."""

    def __init__(self):
        self.calls, self.ends, self.doubts = [], {}, {}

    def __call__(self, words, log):
        from coupler.checks.read_case import load

        self.calls.append(words)
        log.write_text("some output\nlast line\n", encoding="utf-8")
        from pathlib import Path

        if words[0] == "resume":
            place = Path(words[1])
            case = load(place / "case.toml", json.loads((place / "sets.json").read_text())).case
        else:
            place = Path(words[words.index("--output") + 1])
            sets = [words[k + 1] for k, word in enumerate(words) if word == "--set"]
            file = load(words[1], sets)
            case = file.case
            (place / "history").mkdir(parents=True)
            (place / "case.toml").write_text(file.path.read_text())
            (place / "sets.json").write_text(json.dumps(sets))
            (place / "blocks.vtkhdf").write_bytes(b"0" * 1000)
            with HistoryTable(
                place / "history" / "gauges.csv",
                (("time", "s", "t"), ("value", "N", "v"), ("joints", "1", "n")),
            ) as t:
                for time in (0.0, 0.5, 1.0):
                    t.append(time=time, value=time * case.structure.block[1].velocity[0], joints=2.0)
        status, code, reason = self.ends.get(len(self.calls), ("done", ExitCode.DONE, "reached the end"))
        if status == "killed":
            (place / "checkpoints").mkdir(exist_ok=True)
            (place / "checkpoints" / "1.npz").write_bytes(b"1")
            summary = {"status": "running", "exit_code": None, "exit_reason": None}
        else:
            summary = {"status": status, "exit_code": int(code), "exit_reason": reason}
            if "carry" in reason:
                summary["error"] = "CannotStand"
        figures = {
            "time": 1.0,
            "joints": 2,
            "cpu_seconds": {},
            "doubts": self.doubts.get(len(self.calls), []),
        }
        from coupler.case.case import effective

        (place / "run.json").write_text(
            json.dumps(SUMMARY | summary | {"figures": figures, "case": effective(case)})
        )
        return Cost(1.0, 2.0, 10**8, -9 if status == "killed" else int(code))


@pytest.fixture
def made(tmp_path):
    def make_it(sweep=SWEEP, keep="histories", ends=None, doubts=None):
        (tmp_path / "case.toml").write_text(CASE + sweep.format(keep=keep), encoding="utf-8")
        spec = write_spec(tmp_path / "out", make_plan(tmp_path), 1)
        fake = Fake()
        fake.ends, fake.doubts = ends or {}, doubts or {}
        for id in spec.runs:
            make(spec, id, fake)
        return spec, fake

    return make_it


def test_the_table_holds_keys_units_quantities_and_how_runs_ended(made):
    spec, _ = made(ends={2: ("diverged", ExitCode.DIVERGED, "energy error 7 %")})
    results = collect(spec)
    write_tables(spec, results)
    table = read_history(spec.folder / "table.csv")
    assert {c.name: c.unit for c in table.columns}["strength"] == "Pa"
    assert len(table["load"]) == 48
    assert table["outcome"][1] == "diverged"
    assert table["reason"][1] == "energy error 7 %"
    assert table["peak"] == pytest.approx(table["load"])
    assert table["square"] == pytest.approx(0.5 * table["load"] ** 2)
    assert table["ratio"] == pytest.approx(table["load"] * 1e6 / table["strength"])


def test_pandas_reads_the_same_table_with_units(made):
    import pandas as pd

    spec, _ = made()
    write_tables(spec, collect(spec))
    frame, stored = open_sweep(spec.folder), pd.read_parquet(spec.folder / "table.parquet")
    pd.testing.assert_frame_equal(frame, stored)
    assert frame.attrs["units"]["strength"] == stored.attrs["units"]["strength"] == "Pa"
    assert frame.attrs["units"]["peak"] == "N", "it gives none: that of its column"
    assert frame.groupby("load").size().tolist() == [6] * 8


@pytest.mark.parametrize(
    ("keep", "left"),
    [
        ("table", {"case.toml", "run.json"}),
        ("histories", {"case.toml", "run.json", "history"}),
        ("all", {"case.toml", "run.json", "history", "blocks.vtkhdf", "sets.json"}),
    ],
)
def test_what_stays_of_a_run_is_what_was_asked_for(made, keep, left):
    spec, _ = made(keep=keep)
    place = spec.place(next(iter(spec.runs)))
    assert {entry.name for entry in place.iterdir()} == left
    assert math.isfinite(collect(spec).column("peak")[0])


def test_a_run_that_was_killed_goes_on_and_one_that_ended_is_left_alone(made):
    """The second call resumes the run with a checkpoint; nothing else is executed."""
    spec, fake = made(ends={3: ("killed", -9, "")})
    id = list(spec.runs)[2]
    assert collect(spec).column("outcome")[2] == "killed"
    assert "SIGKILL" in collect(spec).column("reason")[2]
    fake.calls.clear()
    for other in spec.runs:
        make(spec, other, fake)
    assert [call[0] for call in fake.calls] == ["resume"]
    reported = figures(spec, id)
    assert (reported["outcome"], reported["attempts"], reported["cpu_seconds"]) == ("done", 2, 2.0)


def test_a_run_given_up_at_its_limit_goes_on_when_the_limit_is_higher(made, tmp_path):
    spec, fake = made(ends={1: ("stopped", ExitCode.STOPPED, "the run has used 9 s (limits.cpu_seconds)")})
    id = next(iter(spec.runs))
    assert figures(spec, id)["outcome"] == "gave up"
    fake.calls.clear()
    make(spec, id, fake)
    assert not fake.calls
    text = (tmp_path / "case.toml").read_text().replace("[sweep]\n", "[sweep]\ncpu_seconds = 7200\n")
    (tmp_path / "case.toml").write_text(text)
    longer = write_spec(tmp_path / "out", make_plan(tmp_path), 1)
    fake.ends = {}
    assert list(longer.runs) == list(spec.runs)
    assert make(longer, id, fake)["outcome"] == "done"


def test_quantities_may_be_asked_for_later_while_their_files_are_there(made, tmp_path):
    spec, _ = made()
    text = (tmp_path / "case.toml").read_text().replace('take = "max"', 'take = "mean"', 1)
    (tmp_path / "case.toml").write_text(text)
    spec = write_spec(tmp_path / "out", make_plan(tmp_path), 1)
    results = collect(spec)
    assert results.column("peak") == pytest.approx([0.5 * x for x in results.column("load")])


def test_a_plan_that_is_only_shown_or_must_wait_leaves_the_sweep_as_it_is(made, tmp_path, monkeypatch):
    """Workers read sweep.json before each run: another plan there made the runs that were left crash."""
    made()
    before = (tmp_path / "out" / "sweep.json").read_bytes()
    other = ("joints.opening_at_failure=0.01,0.02",)
    monkeypatch.setattr(command, "forecast", lambda *_: [])
    assert command.sweep(tmp_path, SweepRequest(other, output=tmp_path / "out", plan=True)) == ExitCode.DONE
    assert command.sweep(tmp_path, SweepRequest(other, output=tmp_path / "no", plan=True)) == ExitCode.DONE
    with command._alone(tmp_path / "out"), pytest.raises(command.Busy):
        command.sweep(tmp_path, SweepRequest(other, output=tmp_path / "out"))
    assert (tmp_path / "out" / "sweep.json").read_bytes() == before
    assert not (tmp_path / "no").exists()


def test_a_figure_that_cannot_be_drawn_takes_nothing_else_with_it(made, monkeypatch, capsys):
    spec, _ = made()
    monkeypatch.setenv("MPLBACKEND", "none_of_these")
    assert command.finish(spec, stopped=False) == ExitCode.DONE
    assert "no figures: " in capsys.readouterr().out
    assert (spec.folder / "report.html").exists()


@pytest.mark.parametrize("keep", ["table", "histories", "all"])
def test_the_disk_space_of_a_run_is_that_of_the_files_that_are_kept(made, keep):
    spec, _ = made(keep=keep)
    for id in spec.runs:
        kept = sum(file.stat().st_size for file in spec.place(id).rglob("*") if file.is_file())
        assert figures(spec, id)["disk"] == kept > 0


@pytest.mark.parametrize(
    ("code", "summary", "outcome"),
    [
        (0, {}, "done"),
        (2, {}, "refused"),
        (2, {"error": "CannotStand"}, "cannot stand"),
        (3, {}, "diverged"),
        (4, {"exit_reason": "stopped by the system (SIGTERM)"}, "stopped"),
        (4, {"exit_reason": "has used 7 s; limit 6 s (limits.cpu_seconds)"}, "gave up"),
        (1, {}, "crashed"),
        (-11, {}, "killed"),
    ],
)
def test_how_a_run_ended_follows_from_its_exit_code_and_reason(code, summary, outcome):
    assert outcome_of(code, summary) == outcome


# ---------------------------------------------------------------- curves


def test_curves_have_bands_bars_and_medians(made):
    spec, _ = made()
    results = collect(spec)
    reported = curves(spec, results, spec.sweep.fragility[0])
    assert reported["refused"] == ""
    medians = [c["median"] for c in reported["curves"]]
    assert medians == pytest.approx([1.0, 1.6], rel=0.25)  # ratio = load/strength: exact for very many runs
    assert reported["dispersion"] == pytest.approx(0.4, rel=0.6)
    for curve in reported["curves"]:
        p, low, high = (np.array(curve[n]) for n in ("p", "low", "high"))
        assert ((low <= p + 1e-9) & (p <= high + 1e-9)).all()
    assert [bar["runs"] for bar in reported["bars"][0]] == [6] * 8
    assert reported["convergence"][-1]["width"] < reported["convergence"][0]["width"]


def test_runs_that_cannot_stand_are_in_the_state_and_failed_ones_are_unknown(made):
    spec, _ = made(
        ends={
            1: ("bad_case", ExitCode.BAD_CASE, "the structure cannot carry its own weight"),
            2: ("diverged", ExitCode.DIVERGED, "energy"),
        }
    )
    runs = read_runs(collect(spec), spec.sweep.fragility[0])
    assert runs.state[0] == 2
    assert runs.unknown == 1  # the second one had not reached the heaviest state
    assert len(runs.x) == 47


def test_a_run_that_failed_before_the_window_of_a_quantity_is_in_no_state(made):
    """The history ends at 1 s: a window beyond it held the last value on, which is above the limit of the state."""
    late = SWEEP.replace('take = "max"', 'take = "max"\nwindow = [2, 3]', 1)
    spec, _ = made(sweep=late, ends={48: ("diverged", ExitCode.DIVERGED, "energy")})
    results = collect(spec)
    assert np.isnan(results.column("peak")).all()
    assert results.column("reason")[0] == "peak: the run has nothing from 2 to 3 s"
    assert read_runs(results, spec.sweep.fragility[0]).unknown == 48


def test_a_quantity_that_runs_do_not_have_is_reported_with_the_reason(made, capsys):
    """By the first run, at the end and on the page, once each; a table of figures says what it holds."""
    wrong = SWEEP.replace(
        'table = "history/gauges.csv"\ncolumn = "value"\ntake = "max"', 'figure = "cost"', 1
    )
    spec, _ = made(sweep=wrong)
    progress = _Progress(spec, len(spec.runs))
    for id in list(spec.runs)[:2]:
        progress(figures(spec, id))
    assert (
        capsys.readouterr().out.count("note: it has no number of peak: run.json has no figure 'cost'; there")
        == 1
    )
    finish(spec, stopped=False)
    said = "peak has no number in 48 of 48 rows that are done: run.json has no figure 'cost'; there are time"
    assert capsys.readouterr().out.count(said) == 1
    assert said in unescape((spec.folder / "report.html").read_text(encoding="utf-8"))
    assert collect(spec).column("reason")[0].startswith("peak: run.json has")
    place = spec.place(next(iter(spec.runs)))
    summary = json.loads((place / "run.json").read_text())
    summary["figures"]["cost"] = {"water": 1.0}
    (place / "run.json").write_text(json.dumps(summary))
    why = read_quantity(place, spec.sweep.quantity[0]).why
    assert why == "peak: figure 'cost' of run.json is no number; there are cost.water"


def test_a_reason_that_runs_share_is_told_once_in_full_and_values_with_their_units(made, capsys):
    """Three hundred letters for each wall that could not stand hid the lines of those that did."""
    ends = {
        k: ("diverged", ExitCode.DIVERGED, f"energy off: {k} % lost near 'wall-{k}'. Refine the cells.")
        for k in (1, 2)
    }
    spec, _ = made(ends=ends)
    capsys.readouterr()
    progress = _Progress(spec, len(spec.runs))
    for id in list(spec.runs)[:2]:
        progress(figures(spec, id))
    first, second = capsys.readouterr().out.splitlines()
    assert "Refine the cells." in first
    assert second.endswith(": energy off")
    assert "strength" in first
    assert "MPa" in first


def test_reasons_to_doubt_runs_are_told_at_the_end_and_on_the_page(made, capsys):
    """Walls that no water reached stand in every curve. Those that differ in names and numbers alone are told once, and
    what a run that diverged doubts is not."""
    dry = "no water touched '{}' until the run ended at t = {:g} s"
    doubts = {2: [dry.format("a", 1.0)], 4: [dry.format("b", 1.5e-3), "thin"], 5: ["thin"]}
    spec, _ = made(doubts=doubts, ends={5: ("diverged", ExitCode.DIVERGED, "off")})
    finish(spec, stopped=False)
    said = capsys.readouterr().out
    page = unescape((spec.folder / "report.html").read_text(encoding="utf-8"))
    for text in (
        "2 of 47 rows that are done, the first of them row 1: no water touched 'a' until the run ended at t = 1 s",
        "1 of 47 rows that are done, the first of them row 3: thin",
    ):
        assert said.count(f"but: {text}") == page.count(text) == 1
    assert "'b'" not in said


def test_runs_that_all_change_at_one_intensity_are_refused_in_words_that_fit_it():
    x = np.array([0.6, 0.9, 0.9, 1.2])
    runs = Runs(x, np.array([0, 0, 1, 1]), 0, 0, 0)
    assert "draw strengths" in refusal(runs, [1], ["cracked"], drawn=False, unit="m")
    said = refusal(runs, [1], ["cracked"], drawn=True, unit="m")
    assert said.endswith("(it would be 0); add runs at intensities around this one"), (
        "strengths are drawn already"
    )
    assert "no run below 0.9 m reached 'cracked', every run above did, and of those at 0.9 m some" in said


def test_a_refusal_names_the_intensities_with_their_unit_and_enough_digits():
    """Depths of 12.31 and 12.34 m are both 12.3 m in three digits."""
    for low, high, words in ((12.31, 12.34, "12.31 m to 12.34 m"), (0.5, 2.0, "0.5 m to 2 m")):
        runs = Runs(np.array([low, high]), np.array([0, 1]), 0, 0, 0)
        below, above = words.split(" to ")
        said = refusal(runs, [1], ["cracked"], drawn=True, unit="m")
        assert f"no run up to {below} reached 'cracked' and every run from {above} on did" in said


def test_runs_that_differ_in_the_load_alone_are_refused_with_the_reason(made, capsys):
    """Deterministic runs are separable: the dispersion of a fit would be that of nothing."""
    alike = SWEEP.replace(
        'distribution = "lognormal"\nmedian = "1 MPa"\ndispersion = 0.4', 'values = ["1 MPa"]'
    )
    alike = alike.replace("samples = 6\n", "").replace('sensitivity = ["peak"]\n', "")
    spec, _ = made(sweep=alike)
    reported = curves(spec, collect(spec), spec.sweep.fragility[0])
    assert reported["curves"] == []
    assert "perfectly separated" in reported["refused"]
    assert "draw strengths" in reported["refused"]
    words = r"no run up to 928.6 mm/s reached .cracked. and every run from 1.143 m/s on did"
    assert re.search(words, reported["refused"]), reported["refused"]
    finish(spec, stopped=False)
    assert f"note: no curve of fragility '{reported['name']}': perfectly separated" in capsys.readouterr().out


def test_a_state_that_nobody_reached_is_left_out_and_reported(made):
    spec, _ = made(sweep=SWEEP.replace("at_least = 1.6", "at_least = 99"))
    reported = curves(spec, collect(spec), spec.sweep.fragility[0])
    assert [c["state"] for c in reported["curves"]] == ["cracked"]
    assert reported["left_out"] == ["broken: none of 48 runs reached it"]


def test_the_report_says_all_on_one_page_with_links_to_the_runs(made):
    spec, _ = made(ends={2: ("diverged", ExitCode.DIVERGED, "energy error 7 %")})
    results = collect(spec)
    analyse(spec, results)
    text = write(spec, results).read_text(encoding="utf-8")
    for wanted in (
        "48 runs: 47 done, 1 diverged",
        "energy error 7 %",
        "cracked",
        "partial rank correlations",
        "lognormal",
    ):
        assert wanted in text
    id = next(iter(spec.runs))
    assert f'href="runs/{id}/report.html"' in text
    assert (spec.place(id) / "report.html").exists()


# ---------------------------------------------------------------- sensitivity


def ishigami(x):
    """Ishigami and Homma (1990): first-order indices 0.3139, 0.4424, 0 and total 0.5576, 0.4424, 0.2437."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


class Asked:
    """As much of a Spec as the indices look at."""

    def __init__(self, samples, sample="saltelli"):
        from coupler.case.sweep import Sweep

        self.sweep = Sweep(samples=samples, sample=sample)


def test_sobol_indices_of_a_known_function():
    from coupler.commands.sweep.draw import cube

    n = 2048
    x = np.pi * (2.0 * cube("saltelli", n, 3, 1) - 1.0)
    rows = sobol_rows(x, ishigami(x), ["a", "b", "c"], Asked(n))
    assert [r["value"] for r in rows] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)
    assert [r["total"] for r in rows] == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.03)
    assert all(r["low"] <= r["value"] <= r["high"] for r in rows)
    y = ishigami(x)
    y[3] = np.nan
    assert "have no number" in sobol_rows(x, y, ["a", "b", "c"], Asked(n))


def test_partial_rank_correlations_of_a_known_function():
    """y = exp(3 a) + noise of b alone: the rank of a decides, that of c says nothing, -d goes the other way."""
    rng = np.random.default_rng(1)
    x = rng.random((200, 3))
    y = np.exp(3.0 * x[:, 0]) - 5.0 * x[:, 2] + 0.1 * rng.normal(size=200)
    rows = rank_rows(x, y, ["a", "c", "d"], Asked(200, "latin"))
    a, c, d = rows
    assert a["value"] > 0.9
    assert d["value"] < -0.7
    assert c["low"] < 0.0 < c["high"]
    assert rank_rows(x, np.ones(200), ["a", "c", "d"], Asked(200)) == "it is the same in all runs"
    assert "are needed" in rank_rows(x[:5], y[:5], ["a", "c", "d"], Asked(5))


# ---------------------------------------------------------------- engines


def test_the_snakefile_makes_every_run_by_its_id(made):
    spec, _ = made()
    text = export(spec).read_text(encoding="utf-8")
    assert "coupler.commands.sweep.one . {wildcards.run}" in text
    assert 'expand("runs/{run}.json", run=RUNS)' in text
    settings = json.loads((spec.folder / "snakemake.json").read_text())
    assert "PYTHONPATH" in settings["python"]


def test_options_that_no_engine_knows_are_refused(tmp_path):
    from coupler.commands.sweep.command import SweepRequest, sweep

    with pytest.raises(BadCase) as reported:
        sweep(tmp_path, SweepRequest(engine="slurn", export="make", options=("time",)))
    assert "--engine slurn: there are local, slurm" in str(reported.value)
    assert "--export make" in str(reported.value)
    assert "--option time: write KEY=VALUE" in str(reported.value)


def test_a_folder_that_holds_no_sweep_is_refused(tmp_path):
    from coupler.program.errors import NoRun

    with pytest.raises(NoRun, match="not the directory of a sweep"):
        read_spec(tmp_path)
    (tmp_path / "sweep.json").write_text('{"layout": 1}')
    with pytest.raises(NoRun, match="not what a sweep writes"):
        read_spec(tmp_path)
