"""Runs side by side: what differs in their cases and in their results, from the files alone."""

import json
import re

import numpy as np
import pytest

from coupler.commands.diff.case import changes
from coupler.commands.diff.command import diff
from coupler.commands.diff.figures import Row, Run, rows
from coupler.program.errors import BadCase, NoRun, UnknownName
from coupler.results.history import read_history
from coupler.run.summary import read_summary
from tests.coupler.resumed import DRY, begin

GAUGE = """\
[[gauge]]
kind = "motion"
name = "shot"
of = "shot"
[[gauge]]
kind = "loads"
name = "all"
on = "column"
"""


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """A shot that breaks a column, and a slower one that ends early; both are measured."""
    place = tmp_path_factory.mktemp("pair")
    fast = begin(place / "fast", DRY + GAUGE, place / "a")
    slow = begin(
        place / "slow", DRY + GAUGE, place / "b", "structure.block[0].velocity=[2, 0, 0]", "time.end=0.06"
    )
    return fast, slow


def read(paths):
    return [Run(path, label, read_summary(path)) for path, label in zip(paths, "ABC")]


def row(found, what):
    (one,) = [r for r in found if r.what == what]
    return one


def test_the_figures_are_those_of_the_files(pair):
    found = rows(read(pair))
    histories = [read_history(path / "history" / "gauges.csv") for path in pair]
    ways = [
        np.linalg.norm([h[f"shot_centre_{a}"] - h[f"shot_centre_{a}"][0] for a in "xyz"], axis=0).max()
        for h in histories
    ]
    assert row(found, "shot centre").values == pytest.approx(ways)
    loads = [read_history(path / "history" / "loads_all.csv") for path in pair]
    largest = [np.linalg.norm([t[f"contact_force_{a}"] for a in "xyz"], axis=0).max() for t in loads]
    assert row(found, "contact force").values == pytest.approx(largest)
    summaries = [read_summary(path) for path in pair]
    assert row(found, "joints broken").values == tuple(s["figures"]["joints_broken"] for s in summaries)
    assert row(found, "processor time").values == tuple(s["cpu_seconds"] for s in summaries)


def test_keys_are_paired_by_names_and_a_table_of_one_case_is_one_line():
    """By its place alone every block after one that was put in would differ."""
    first = {
        "structure": {"block": [{"name": "a", "density": 1.0}, {"name": "b", "density": 2.0}]},
        "tank": {"cell": 0.5},
    }
    second = {
        "structure": {"block": [{"name": "c"}, {"name": "a", "density": 1.0}, {"name": "b", "density": 3.0}]}
    }
    found = {c.key: c.words() for c in changes([first, second])}
    assert found == {
        "structure.block[b].density": ["2 kg/m³", "3 kg/m³"],
        "structure.block[c]": ["absent", "given"],
        "tank": ["given", "absent"],
    }


def test_files_are_compared_by_their_contents(tmp_path):
    """A record that was changed in its place is a difference; the same one in the folder of another case is none."""
    driven = DRY.replace("velocity = [12, 0, 0]\n", "") + '[[motion]]\nblock = "shot"\npath = "way.csv"\n'
    found = []
    for name, speed, case in (("a", 1, "one"), ("b", 1, "two"), ("c", 2, "two")):
        (tmp_path / case).mkdir(exist_ok=True)
        (tmp_path / case / "way.csv").write_text(f"time,velocity_x\n0,{speed}\n1,{speed}\n")
        begin(tmp_path / case, driven, tmp_path / name, "time.end=0.01")
        found.append(Run(tmp_path / name, name.upper(), read_summary(tmp_path / name)))
    cases, files = [run.summary["case"] for run in found], [run.files for run in found]
    assert changes(cases[:2], files[:2]) == []
    (change,) = changes(cases[1:], files[1:])
    assert change.key == "motion[0].path"
    assert change.words()[0] != change.words()[1]
    assert all(word.startswith("contents ") and word.endswith(" of way.csv") for word in change.words())
    (change,) = changes(cases[:2], [files[0], {}])  # a run that kept no digests
    assert change.key == "motion[0].path"


def test_a_difference_is_told_against_the_first_run():
    assert Row("", "load", "N", (2000.0, 2500.0, None)).words() == ["2 kN", "2.5 kN (+25.0%)", "–"]
    assert Row("", "load", "N", (-2000.0, -2500.0)).words()[1] == "-2.5 kN (-25.0%)"
    assert Row("", "load", "N", (1.0, 20.0)).words()[1] == "20 N (20 times)"
    assert Row("", "error", "%", (0.01, 0.02)).words() == ["1 %", "2 %"]
    assert Row("", "load", "N", (-1.0, 20.0)).words() == ["-1 N", "20 N"]
    assert Row("", "load", "N", (0.0, 20.0)).words() == ["0 N", "20 N"]


def test_the_command_prints_a_table_and_writes_a_page(pair, tmp_path, capsys):
    diff(pair, tmp_path / "out", [], only_json=False)
    printed = capsys.readouterr().out
    assert "structure.block[shot].velocity" in printed
    assert re.search(r"\[12, 0, 0\] m/s +\[2, 0, 0\] m/s", printed)
    assert "note: the runs reached different times" in printed
    page = (tmp_path / "out" / "diff.html").read_text(encoding="utf-8")
    assert "structure.block[shot].velocity" in page
    assert page.count("data:image/") >= 1
    diff(pair, None, [], only_json=True)
    content = json.loads(capsys.readouterr().out)
    assert content == json.loads((tmp_path / "out" / "diff.json").read_text(encoding="utf-8"))
    assert content["case"][0] == {"key": "time.end", "unit": "s", "values": [0.1, 0.06]}


def test_runs_of_one_case_are_said_to_be_of_one(pair, capsys):
    diff([pair[0], pair[0]], None, [], only_json=False)
    assert "the cases are the same, value by value" in capsys.readouterr().out


def test_what_cannot_be_compared_is_named(pair, tmp_path):
    with pytest.raises(BadCase, match="name two runs or more"):
        diff(pair[:1], None, [], only_json=False)
    with pytest.raises(NoRun, match="not the directory of a run"):
        diff([pair[0], tmp_path], None, [], only_json=False)
    with pytest.raises(UnknownName, match=r"no run has a history 'energi'; did you mean 'energy'"):
        diff(pair, None, ["energi.blocks_kinetic"], only_json=False)
    with pytest.raises(UnknownName, match=r"no column 'blocks_kinetik'; did you mean 'blocks_kinetic'"):
        diff(pair, None, ["energy.blocks_kinetik"], only_json=False)
