"""`study compare`: exit codes for what got worse, and refusals of what does not compare."""

import copy
import json

import pytest
from typer.testing import CliRunner

from coupler.commands.cli import app
from coupler.commands.study.against import compare, refuse, worse
from coupler.program.errors import BadCase, ExitCode


def point(label, cpu, error, reason=""):
    readings = {} if reason else {"force": {"value": 1.0, "reference": 1.0, "error": error, "band": 0.0}}
    return {
        "ladder": "h",
        "curve": "",
        "label": label,
        "cpu_seconds": cpu,
        "reason": reason,
        "readings": readings,
    }


BEFORE = {
    "machine": {"processor": "one"},
    "quantities": [{"name": "force", "against": "exact", "finest": None}],
    "points": [point("1", 10.0, 0.1), point("2", 20.0, 1e-14)],
}


def compared(tmp_path, now, error=1.1, cpu=1.2):
    for name, reported in (("a", BEFORE), ("b", now)):
        (tmp_path / name).mkdir()
        (tmp_path / name / "study.json").write_text(json.dumps(reported), encoding="utf-8")
    return compare(tmp_path / "a", tmp_path / "b", error, cpu)


def changed(**values):
    now = copy.deepcopy(BEFORE)
    for name, value in values.items():
        if name == "error":
            now["points"][0]["readings"]["force"]["error"] = value
        else:
            now["points"][0][name] = value
    return now


@pytest.mark.parametrize(
    ("change", "code"),
    [
        ({}, ExitCode.DONE),
        ({"error": 0.109}, ExitCode.DONE),
        ({"error": 0.111}, ExitCode.DIVERGED),
        ({"error": 0.001}, ExitCode.DONE),
        ({"error": None}, ExitCode.DIVERGED),
        ({"cpu_seconds": 11.9}, ExitCode.DONE),
        ({"cpu_seconds": 12.1}, ExitCode.DIVERGED),
        ({"reason": "diverged"}, ExitCode.DIVERGED),
    ],
)
def test_the_exit_code_says_whether_something_got_worse(tmp_path, change, code):
    assert compared(tmp_path, changed(**change)) == code


def test_limits_are_those_given(tmp_path):
    assert compared(tmp_path, changed(error=0.15, cpu_seconds=15.0), error=1.6, cpu=1.6) == ExitCode.DONE


def test_errors_of_round_off_do_not_get_worse(tmp_path):
    now = copy.deepcopy(BEFORE)
    now["points"][1]["readings"]["force"]["error"] = 5e-12
    assert compared(tmp_path, now) == ExitCode.DONE


def test_references_of_two_kinds_are_refused(tmp_path):
    now = copy.deepcopy(BEFORE)
    now["quantities"][0]["against"] = "measured"
    with pytest.raises(BadCase, match="against exact and against measured do not compare"):
        compared(tmp_path, now)


def test_studies_without_a_common_run_are_refused(tmp_path):
    now = copy.deepcopy(BEFORE)
    now["points"] = [point("3", 1.0, 0.1)]
    with pytest.raises(BadCase, match="no run in common"):
        compared(tmp_path, now)


def test_a_place_without_a_study_is_reported(tmp_path):
    with pytest.raises(BadCase, match="not the result of a study"):
        compare(tmp_path, tmp_path, 1.1, 1.2)


def test_the_command_leaves_with_the_code(tmp_path):
    """As a pipeline calls it: 0, or 3 when B got worse; what is neither a case nor a comparison is refused with 2."""
    compared(tmp_path, changed(error=0.15))
    run = CliRunner().invoke
    place = [str(tmp_path / "a"), str(tmp_path / "b")]
    assert run(app, ["study", "compare", *place]).exit_code == 3
    assert run(app, ["study", "compare", *place, "--error", "2"]).exit_code == 0
    assert run(app, ["study", *place]).exit_code == 2


def test_what_got_worse_is_told_in_the_order_of_the_study():
    """And not in that of the hashes of names, which differs from process to process."""
    names = [f"quantity {k}" for k in range(12)]
    before, now = copy.deepcopy(BEFORE), copy.deepcopy(BEFORE)
    for study, error in ((before, 0.1), (now, 0.2)):
        study["quantities"] = [{"name": name, "against": "exact", "finest": None} for name in names]
        for read in study["points"]:
            read["readings"] = {name: {"error": error} for name in names}
    told = worse(before, now, 1.1, 1.2)
    assert [line.what for line in told] == [f"h {label}: error of {name}" for label in "12" for name in names]
    for quantity in now["quantities"]:
        quantity["against"] = "measured"
    with pytest.raises(BadCase) as refused:
        refuse(before, now)
    assert [line.partition(":")[0] for line in refused.value.lines] == names
