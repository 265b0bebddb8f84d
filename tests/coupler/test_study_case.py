"""The section [study]: references of one kind, names that exist, and no trace in a run."""

import subprocess
import sys

import pytest

from coupler.case.case import effective
from coupler.case.formula import BadFormula, evaluate
from coupler.checks.read_case import load
from coupler.program.errors import BadCase

from .fake_runs import CASE


def messages(tmp_path, text):
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    with pytest.raises(BadCase) as reported:
        load(tmp_path)
    return "\n".join(reported.value.lines)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('against = "finest"', 'against = "finest"\nvalue = 3', "references must be of one kind"),
        ('against = "finest"', 'against = "finest"\nband = 3', "references must be of one kind"),
        ('against = "exact"', 'against = "exact"\nladder = "dt"', "must be of one kind"),
        ('against = "exact"', 'against = "exact"\nband = 0.1', "an exact answer has none"),
        ("band = 0.1\n", "", "needs the scatter of the measurement"),
        ("value = 2.02\n", "", "needs one of value and path"),
        ('take = "mean"', 'take = "at"', "needs time"),
        ('take = "mean"', 'take = "curve"', "needs a curve"),
        ('take = "mean"', 'take = "mea"', "did you mean 'mean'"),
        ('ladder = "dt"', 'ladder = "dtt"', "there is no ladder 'dtt'; did you mean 'dt'"),
        ('ladder = "dt"\n', "", "say which ladder ends with the finest run: dt, rule"),
        ('key = "time.step_max"', 'key = "time.step_mx"', "did you mean 'time.step_max'"),
        ('name = "rule"', 'name = "rule"\nacross = "d"', "there is no ladder 'd'"),
        ('name = "rule"', 'name = "dt"', "is taken by study.ladder[0]"),
        ('name = "rule"', 'name = "rule"\nlabels = ["a"]', "1 labels for 2 values"),
        ('name = "rule"', 'name = "rule"\nlaws = ["cpm"]', "laws and substeps go together"),
        ('set = ["contact.friction=0"]', 'set = ["contact.friction"]', "contact.friction"),
        (
            'set = ["contact.friction=0"]',
            'set = ["limits.cpu_seconds=6"]',
            "study.cpu_seconds takes its place",
        ),
        ('key = "time.step_max"', 'key = "limits.cpu_seconds"', "study.cpu_seconds takes its place"),
    ],
)
def test_mistakes_in_a_study_are_reported_with_a_way_out(tmp_path, old, new, says):
    assert old in CASE
    assert says in messages(tmp_path, CASE.replace(old, new, 1))


def test_a_run_takes_no_notice_of_the_study(tmp_path):
    """Else another quantity would make a finished run another one, and a checkpoint useless."""
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    with_study = effective(load(tmp_path).case)
    (tmp_path / "case.toml").write_text(CASE.partition("[study]")[0], encoding="utf-8")
    assert with_study == effective(load(tmp_path).case)


def test_a_case_without_a_study_loads_nothing_of_it(tmp_path):
    (tmp_path / "case.toml").write_text(CASE.partition("[study]")[0], encoding="utf-8")
    code = (
        "import sys; from coupler.checks.read_case import load; load(sys.argv[1]); "
        "print([name for name in sys.modules if name.startswith('coupler.commands.study')])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_formulas_know_names_and_functions_of_a_case():
    case = {"joints": {"strength": 2e6}, "structure": {"block": [{"size": [1.0, 2.0]}]}}
    assert evaluate("27/4 * joints.strength", case) == pytest.approx(13.5e6)
    assert evaluate("sqrt(structure.block[0].size[1] ** 2) - -1", case) == pytest.approx(3.0)
    assert evaluate(4, case) == 4.0


@pytest.mark.parametrize(
    ("formula", "says"),
    [
        ("joints.strenght", "did you mean 'strength'"),
        ("joints.strength *", "not a formula"),
        ("1/0", "division by zero"),
        ("__import__('os')", "neither a number"),
        ("open", "the case has no open"),
        ("joints", "float"),
        ("sqrt(-1)", "math domain"),
        ("(1).real", "neither a number"),
    ],
)
def test_formulas_are_arithmetic_and_nothing_else(formula, says):
    with pytest.raises(BadFormula, match=says):
        evaluate(formula, {"joints": {"strength": 1.0}})


def test_absent_leaves_a_name_out(tmp_path):
    """--set joints=absent: the case without the section, which no value could say."""
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    assert load(tmp_path, ["contact.friction=0.1", "contact.friction=absent"]).case.contact.friction == 0.5
    assert load(tmp_path, ["study=absent"]).case.study is None
    assert load(tmp_path, ["joints.strength=absent"]).case.joints is None
    with pytest.raises(BadCase, match="did you mean 'study'"):
        load(tmp_path, ["studi=absent"])
