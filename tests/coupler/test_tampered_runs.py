"""Run directories that were torn, edited or mixed up: every command that reads one says what is wrong in which file."""

import json
import shutil

import numpy as np
import pytest

from coupler.commands.explain_run import explanation_of_run
from coupler.commands.report.command import report
from coupler.commands.view.__main__ import summary as summary_for_pictures
from coupler.program.errors import ExitCode, SurgebreakError
from coupler.results.history import BadTable, read_history
from coupler.run.array_file import write_arrays
from coupler.run.checkpoint import FOLDER, UNSET, Checkpoint, OtherScene, listed
from coupler.run.resume import CannotResume, prepare
from coupler.run.summary import NoRun
from tests.coupler.resumed import go_on

JUNK = ["[]", "{}", "null", "1", '"x"', "", "\0", "{", '{"status": 1}', "[" * 100_000, '{"figures": []}']


def refusals(run):
    """What resume, explain and report say of a run that none of them can use."""
    reported = []
    for use in (prepare, explanation_of_run, lambda run: report(run, False)):
        with pytest.raises(SurgebreakError) as refusal:
            use(run)
        assert refusal.value.exit_code == ExitCode.BAD_CASE
        reported.append(str(refusal.value))
    return reported


@pytest.mark.parametrize("content", JUNK, ids=range(len(JUNK)))
def test_a_summary_that_no_run_wrote(copy, content):
    (copy / "run.json").write_text(content, encoding="utf-8")
    assert all("run.json" in reported for reported in refusals(copy))


@pytest.mark.parametrize("content", JUNK, ids=range(len(JUNK)))
def test_pictures_need_little_of_a_summary_but_no_torn_one(copy, content):
    (copy / "run.json").write_text(content, encoding="utf-8")
    if content.endswith("}"):
        assert isinstance(summary_for_pictures(copy), dict)
    else:
        with pytest.raises(NoRun, match=r"run\.json: "):
            summary_for_pictures(copy)


@pytest.mark.parametrize(
    ("path", "value", "reported"),
    [
        (("figures", "cpu_seconds"), [1], "figures.cpu_seconds"),
        (("figures", "work"), {"cells": 1}, "figures.work: Value error, mesh_cells is missing"),
        (("figures", "steps"), "many", "figures.steps"),
        (("case", "case"), [], "case.case"),
        (("process",), None, "process"),
        (("machine",), "mine", "machine"),
        (("overrides",), [1], "overrides[0]"),
        (("modules", "water"), "no", "modules.water"),
    ],
)
def test_a_summary_that_was_edited(copy, path, value, reported):
    summary = json.loads((copy / "run.json").read_text(encoding="utf-8"))
    holder = summary
    for name in path[:-1]:
        holder = holder[name]
    holder[path[-1]] = value
    (copy / "run.json").write_text(json.dumps(summary), encoding="utf-8")
    with pytest.raises(NoRun, match="not what a run writes") as refusal:
        explanation_of_run(copy)
    assert reported in str(refusal.value)


def test_a_folder_instead_of_a_summary(copy):
    (copy / "run.json").unlink()
    (copy / "run.json").mkdir()
    assert all("is a directory" in reported or "neither a run" in reported for reported in refusals(copy))


def edited(path, arrays=None, **about):
    """The same checkpoint with other contents and a digest that fits."""
    found = Checkpoint.read(path)
    write_arrays(path, arrays or found.arrays, json.dumps(found.about | about), UNSET)


@pytest.mark.parametrize(
    "about", [{"figures": []}, {"case": 1}, {"outputs": "x"}, {"cpu_seconds": {"a": "b"}}, {"layout": None}]
)
def test_edited_texts_of_checkpoints_are_damaged(stopped, about):
    """A digest says that a file is whole, not that a run wrote it."""
    edited(listed(stopped / FOLDER)[0], **about)
    with pytest.raises(CannotResume, match="does not hold what a run writes"):
        prepare(stopped)


def test_arrays_that_are_missing_or_of_another_shape_are_no_state_of_the_scene(stopped):
    (path,) = listed(stopped / FOLDER)
    whole = Checkpoint.read(path)
    name = "structure/motion"
    assert name in whole.arrays
    write_arrays(path, whole.arrays | {name: np.zeros((7, 5))}, json.dumps(whole.about), UNSET)
    with pytest.raises(OtherScene, match="does not hold a state of this scene"):
        go_on(stopped)
    rest = {name: array for name, array in whole.arrays.items() if name != "coupling/time"}
    write_arrays(path, rest, json.dumps(whole.about), UNSET)
    with pytest.raises(CannotResume, match="no coupling/time"):
        prepare(stopped)


def test_a_folder_among_the_checkpoints_is_passed_over(stopped):
    (stopped / FOLDER / "99999999.h5").mkdir()
    found = prepare(stopped, any_version=True, tell=[].append)
    assert found.checkpoint.path.name != "99999999.h5"
    found.directory.lock.release()


TABLES = [
    "",
    "junk",
    "1,2,3\n",
    "# a\n# time [s]: t\nx\n1\n",
    "# a\n# time [s]: t\ntime\n1,2\n",
    "\xff",
    "# a\n# time [s]: t\ntime\nx\n",
]


@pytest.mark.parametrize("content", TABLES, ids=range(len(TABLES)))
def test_tables_that_no_run_wrote(copy, content):
    path = copy / "history" / "energy.csv"
    path.write_bytes(content.encode("latin-1"))
    with pytest.raises(BadTable, match=r"energy.csv: "):
        read_history(path)
    with pytest.raises(BadTable, match=r"energy.csv: "):
        report(copy, False)


def test_a_column_that_is_missing_is_reported(copy):
    path = copy / "history" / "energy.csv"
    path.write_text("# energy\n# time [s]: t\ntime\n1\n", encoding="utf-8")
    with pytest.raises(BadTable, match=r"the table 'energy' has no column 'energy_error'\. It has time"):
        report(copy, False)
    with pytest.raises(BadTable, match=r"no column 'tme'; did you mean 'time'\?"):
        read_history(path)["tme"]


@pytest.mark.parametrize("name", ["blocks.vtkhdf", "fields.vtkhdf"])
def test_fields_that_no_run_wrote(copy, name):
    (copy / name).write_bytes(b"junk")
    with pytest.raises(SurgebreakError, match=f"{name}: not what a run writes"):
        report(copy)


@pytest.mark.parametrize("content", ["[]", "{}", "x", '{"title": 1}', '{"title": "a", "ladders": 3}'])
def test_a_study_that_was_edited(tmp_path, content):
    (tmp_path / "study.json").write_text(content, encoding="utf-8")
    with pytest.raises(NoRun, match=r"study.json: not what a study writes"):
        report(tmp_path)


def test_another_run_in_its_place(dry, stopped, tmp_path):
    """Swapped files: the histories of one run with the checkpoints of another that went further."""
    shutil.copy(listed(dry / FOLDER)[0], stopped / FOLDER)
    (stopped / "history" / "energy.csv").write_text("# energy\n", encoding="utf-8")
    with pytest.raises(CannotResume, match=r"energy.csv ends before it"):
        prepare(stopped)
