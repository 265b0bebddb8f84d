"""The command compare: which laws, matched how, errors against what, and that the scripts are what was run."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from coupler.checks.read_case import load
from coupler.commands.compare.command import _multiples, show_laws
from coupler.commands.compare.matching import matched
from coupler.commands.compare.outcome import Exact, Outcome, curve_error, errors, exact_answers
from coupler.commands.compare.plan import OwnLaw, general_limits, make_plan
from coupler.commands.compare.report import COLUMNS, rows, table, write
from coupler.commands.compare.run import LawFailed, run_plan
from coupler.program.errors import BadCase
from coupler.program.provenance import ROOT
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.stock.script import stock_law

PULLED = ROOT / "cases" / "joint_pulled"
needs_yade = pytest.mark.skipif(shutil.which("yade") is None, reason="the command yade is not installed")


@given(strength=st.floats(1e3, 1e8), failure=st.floats(1e-6, 1e-1))
def test_another_law_of_ours_gets_strength_and_work_of_the_reference(strength, failure):
    """And its stiffness where the law has a free place of its peak: bilinear; else a remark says so."""
    reference = JointParameters(strength, failure, damping=0.0)
    for law, reported in (("bilinear", False), ("exponential", True)):
        made, not_matched = matched(reference, law)
        assert made.strength == strength
        assert made.work_of_separation == pytest.approx(reference.work_of_separation)
        assert any("stiffness" in text for text in not_matched) is reported
    assert matched(reference, "bilinear")[0].stiffness == pytest.approx(reference.stiffness, rel=1e-6)


def test_the_law_of_the_case_comes_first_whatever_is_asked():
    plan = make_plan(PULLED, [], ["cohfrict", "bilinear", "cohfrict"], [4, 1, 4], 100)
    assert [law.name for law in plan.laws] == ["polynomial", "cohfrict", "bilinear"]
    assert plan.substeps == (1, 4)
    assert plan.laws[0].not_matched == ()


def test_without_names_all_of_ours_and_the_usual_ones_of_yade_are_taken():
    names = {law.name for law in make_plan(PULLED, [], [], [1], 100).laws}
    assert {"polynomial", "bilinear", "exponential", "cohfrict", "jcfpm", "mortar", "cpm"} <= names


def test_unknown_laws_are_refused_all_at_once_with_the_nearest():
    with pytest.raises(BadCase) as reported:
        make_plan(PULLED, [], ["cohfric", "mortor"], [1], 100)
    assert "did you mean 'cohfrict'?" in reported.value.lines[0]
    assert "did you mean 'mortar'?" in reported.value.lines[1]


def test_a_case_with_water_is_refused_with_a_way_out():
    """Stock scenes know no water: each law would see another load."""
    with pytest.raises(BadCase, match="works on cases without water only") as reported:
        make_plan(ROOT / "cases" / "dam_break_building", [], [], [1], 100)
    assert "--set joints.law=" in str(reported.value)


def test_a_case_without_joints_is_refused(tmp_path):
    text = (PULLED / "case.toml").read_text(encoding="utf-8")
    head, _, tail = text.replace("[contact]", "[contact]\nstiffness = 1e9").partition("[joints]")
    (tmp_path / "case.toml").write_text(head + tail[tail.index("[[gauge]]") :], encoding="utf-8")
    with pytest.raises(BadCase, match="there are no joints"):
        make_plan(tmp_path, [], [], [1], 100)


@pytest.mark.parametrize(
    "changes",
    [
        ["joints.distribution=weibull", "joints.variation=0.2"],
        ["joints.pair=[{between = ['held', 'moved'], strength = 2e6}]"],
        ["structure.block[0].material=concrete", "structure.block[1].material=concrete"],
    ],
)
def test_joints_that_differ_from_one_another_are_refused_before_anything_runs(changes):
    """By pairs, by chance, or by presets of materials: the reference had been run first, and ended with a traceback."""
    with pytest.raises(BadCase, match="gives all joints one law"):
        make_plan(PULLED, changes, ["bilinear"], [1], 100)


def test_what_no_stock_scene_matches_follows_from_the_case():
    assert not any("dashpot of the joints" in text for text in general_limits(load(PULLED)))
    damped = load(PULLED, ["joints.damping=0.02", "joints.closing_ratio=10"])
    reported = " | ".join(general_limits(damped))
    assert "dashpot of the joints" in reported
    assert "not 10 times it" in reported


@pytest.mark.parametrize("text", ["0", "1,x", "", "1,-2", "101"])
def test_odd_substeps_are_refused(text):
    with pytest.raises(BadCase, match="--substeps"):
        _multiples(text)


def outcome(name, force, s=None, multiple=1, lost=500.0):
    s = np.linspace(0.0, 1e-3, len(force)) if s is None else s
    force = np.asarray(force, float)
    zero = np.zeros(len(force))
    columns = {
        "time": s * 100,
        "displacement": s,
        "force": force,
        "kinetic": zero,
        "stored": zero,
        "work": zero,
    }
    columns |= {"dissipated": np.linspace(0.0, lost, len(force)), "joints_broken": zero}
    figures = {"cpu_seconds": 2.0, "substeps": 1000, "substep": 1e-5, "joints": 4}
    law = OwnLaw(name, (), ()) if name != "cohfrict" else stock_law(name)
    return Outcome(law, multiple, columns, figures)


def test_the_largest_force_is_that_before_the_first_joint_failed():
    found = outcome("polynomial", [0.0, 5.0, 1.0, 9.0])
    found.table["joints_broken"][2:] = 1
    assert found.peak_force == 5.0


def test_the_distance_of_curves_is_that_of_their_integrals():
    """A curve 10 % above another everywhere is 10 % away, whatever the records of each."""
    s = np.linspace(0.0, 1e-3, 301)
    reference = outcome("polynomial", np.sin(s * 3e3), s)
    fine = np.linspace(0.0, 1e-3, 1001)
    assert curve_error(outcome("cohfrict", 1.1 * np.sin(fine * 3e3), fine), reference) == pytest.approx(
        0.1, rel=1e-3
    )
    assert curve_error(reference, reference) == 0.0


def test_errors_are_against_the_exact_answer_and_else_against_the_reference():
    reference, other = (
        outcome("polynomial", [0.0, 8.0, 0.0]),
        outcome("cohfrict", [0.0, 6.0, 0.0], lost=250.0),
    )
    exact = {"peak_force": Exact(10.0, "known")}
    reported = errors(other, reference, exact)
    assert reported["peak_force"] == pytest.approx(0.4)
    assert reported["dissipated"] == pytest.approx(0.5)
    assert reported["largest"] == reported["peak_force"]
    assert errors(other, reference, {})["largest"] == errors(other, reference, {})["curve"]


def test_exact_answers_come_from_the_promises_of_the_case(tmp_path):
    assert exact_answers(load(PULLED))["dissipated"].value == 562.5
    (tmp_path / "case.toml").write_text((PULLED / "case.toml").read_text(encoding="utf-8"), encoding="utf-8")
    assert exact_answers(load(tmp_path)) == {}


def test_promises_of_a_case_are_no_answers_once_its_values_are_changed():
    """With twice the strength each law has twice the force and the energy; each was said to be off by 100 %."""
    plan = make_plan(PULLED, ["joints.strength=2 MPa"], ["bilinear"], [1], 100)
    assert exact_answers(plan.file) == {}
    outcomes = [outcome("polynomial", [0.0, 2e6]), outcome("bilinear", [0.0, 1.99e6])]
    said = table(plan, outcomes, rows(outcomes, {}), {})
    assert "expected.toml are those of the case without --set" in said
    assert "error of peak force: against polynomial" in said


def test_table_csv_and_json_say_the_same(tmp_path):
    plan = make_plan(PULLED, [], ["cohfrict"], [1], 100)
    outcomes = [outcome("polynomial", [0.0, 1e6, 0.0]), outcome("cohfrict", [0.0, 9e5, 0.0])]
    exact = exact_answers(load(PULLED))
    found = write(plan, outcomes, exact, tmp_path)
    assert found == rows(outcomes, exact)
    head = (tmp_path / "comparison.csv").read_text(encoding="utf-8").splitlines()[0]
    assert head.split(",")[2] == "peak_force [N]"
    assert len(head.split(",")) == len(COLUMNS)
    about = json.loads((tmp_path / "comparison.json").read_text(encoding="utf-8"))
    assert [row["peak_force"] for row in about["laws"]] == [1e6, 9e5]
    assert [row["stock"] for row in about["laws"]] == [False, True]
    reported = table(plan, outcomes, found, exact)
    assert "G_c: T_max²/(2 K_0)" in reported
    assert "against 1e+06 (T_max A)" in reported


def test_errors_against_nothing_are_not_shown(tmp_path):
    """Where nothing is driven the reference has no force, and an error against it would be NaN or absurd."""
    plan = make_plan(PULLED, [], ["cohfrict"], [1], 100)
    outcomes = [outcome("polynomial", [0.0, 0.0], lost=1e-12), outcome("cohfrict", [0.0, 0.0], lost=1.0)]
    reported = table(plan, outcomes, rows(outcomes, {}), {}).splitlines()
    assert reported[2].split()[1:6] == ["0", "-", "1", "-", "-"]


def test_all_laws_are_listed_with_their_class_in_yade(capsys):
    show_laws()
    reported = capsys.readouterr().out
    assert "polynomial: ours" in reported
    assert "Law2_ScGeom_MortarPhys_Lourenco" in reported


@needs_yade
def test_a_comparison_runs_the_scripts_it_writes(tmp_path):
    """One joint pulled: ours is exact, the brittle one takes 2/27 against 9/16; the script by itself gives the same."""
    plan = make_plan(PULLED, [], ["cohfrict"], [4], 200)
    own, stock = run_plan(plan, tmp_path, lambda text: None)
    assert own.dissipated == pytest.approx(562.5, rel=2e-3)
    assert stock.dissipated == pytest.approx(562.5 * 32.0 / 243.0, rel=0.05)
    assert stock.figures["substep"] == pytest.approx(own.figures["substep"], rel=0.1)
    script = tmp_path / "substeps-4" / "cohfrict.py"
    alone = tmp_path / "alone"
    alone.mkdir()
    shutil.copy(script, alone)
    subprocess.run(["yade", "-x", "-n", "-j1", script.name], cwd=alone, capture_output=True, check=True)
    assert (alone / "cohfrict.csv").read_bytes() == script.with_suffix(".csv").read_bytes()


@needs_yade
def test_substeps_at_which_a_law_is_unstable_are_left_out_and_told(tmp_path):
    """Two cubes let go: their joint is stable up to ten substeps. The comparison had ended there, without its table."""
    changes, told = ["motion=absent", "gauge=absent"], []
    plan = make_plan(PULLED, changes, ["bilinear"], [1, 2, 20], 50)
    found = run_plan(plan, tmp_path, told.append)
    assert [(o.law.name, o.multiple) for o in found] == [
        (law, m) for m in (1, 2) for law in ("polynomial", "bilinear")
    ]
    assert [text.split(",")[0] for text in told if "left out" in text] == ["polynomial", "bilinear"]
    assert "unstable beyond" in told[-1]
    other = tmp_path / "other"
    other.mkdir()
    with pytest.raises(LawFailed, match=r"20 x the substep: .* unstable beyond"):
        run_plan(make_plan(PULLED, changes, ["bilinear"], [20], 50), other, told.append)


def test_the_figure_is_made_from_the_files_alone(tmp_path):
    pytest.importorskip("matplotlib", reason="the extra `view` is not installed")
    plan = make_plan(PULLED, [], ["cohfrict"], [1], 100)
    outcomes = [outcome("polynomial", [0.0, 1e6, 0.0]), outcome("cohfrict", [0.0, 9e5, 0.0])]
    write(plan, outcomes, exact_answers(plan.file), tmp_path)
    (tmp_path / "laws").mkdir()
    for o in outcomes:
        lines = [",".join(o.table), *(",".join(map(str, line)) for line in zip(*o.table.values()))]
        (tmp_path / "laws" / f"{o.law.stem}.csv").write_text("\n".join(lines), encoding="utf-8")
    command = [sys.executable, "-m", "coupler.commands.view.comparison", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    for ending in ("png", "pdf", "svg"):
        assert (tmp_path / f"comparison.{ending}").stat().st_size > 5000
