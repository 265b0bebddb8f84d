"""A report is one file that needs no other, says what happened, and gives every number its unit."""

import json
import os
import re
import subprocess
import sys
from html.parser import HTMLParser

import pytest

from coupler.commands.report import html
from coupler.commands.report.command import report
from coupler.commands.report.html import figure, table
from coupler.commands.report.markdown import to_html
from coupler.commands.report.run_page import plots
from coupler.commands.study import command, runner
from coupler.program import extras
from coupler.program.errors import NoRun
from coupler.program.quantities import quantity
from coupler.results.columns import ENERGY, WATER
from coupler.results.cracks import CRACK_COLUMNS, write_cracks
from coupler.results.history import HistoryTable

from .fake_runs import CASE, FakeProcesses

pytestmark = pytest.mark.before_yade

PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d49484452000000010000000108060000001f15c4890000000d49444154789c6360000002000001e221bc33"
    "0000000049454e44ae426082"
)
SUMMARY = {
    "status": "diverged", "exit_code": 3, "exit_reason": "the water volume is off by <5 %",
    "started": "2026-01-01T00:00:00+00:00", "ended": "2026-01-01T00:01:00+00:00", "process": 1,
    "command": ["surgebreak", "run", "case"], "case_file": "/nowhere/case.toml", "overrides": ["time.end=2 s"],
    "modules": {"water": True, "structure": True, "coupling": True, "joints": True, "viscosity": False},
    "versions": {"surgebreak": "0.1.0"}, "git": None, "wall_seconds": 4000.0, "cpu_seconds": 50.0,
    "machine": {"system": "Linux", "processor": "a processor", "cores": 2, "threads": "1"},
    "figures": {
        "steps": 2, "time": 0.2, "largest_volume_error": 0.03, "largest_water_force": 12500.0,
        "cpu_seconds": {"water": 3.0, "pressure": 1.0},
        "work": {"mesh_cells": 90, "cells": 80, "wet_cells": 20, "bodies": 0, "bodies_cut": 0, "passes": 1},
        "imports": {"fluid": True, "yade": True}, "expected": {"the water keeps its volume": False},
    },
    "case": {"case": {"title": "Water & a <wall>"}, "limits": {"volume_error": 0.02}},
}  # fmt: skip


@pytest.fixture
def run(tmp_path):
    """A run directory as one that diverged leaves it, without fields: two steps of histories and two joints."""
    (tmp_path / "history").mkdir()
    (tmp_path / "run.json").write_text(json.dumps(SUMMARY), encoding="utf-8")
    (tmp_path / "case.toml").write_text('[case]\ntitle = "<b>"\n', encoding="utf-8")
    for name, columns in (("energy", ENERGY), ("water", WATER)):
        with HistoryTable(tmp_path / "history" / f"{name}.csv", columns) as history:
            for step in (1, 2):
                history.append(**{c[0]: 1500.0 * step if c[1] == "J" else 0.1 * step for c in columns})
    one = {c.name: [1.0, 0.0] for c in CRACK_COLUMNS if c.unit != "J"} | {"dissipated": [2500.0, 0.0]}
    vectors = {name: [[0.5, 0.0, 1.0]] * 2 for name in ("centre", "normal")}
    write_cracks(tmp_path / "cracks.csv", one | vectors | {"intact": [0, 1], "time": [0.15, float("nan")]})
    return tmp_path


class Outside(HTMLParser):
    """Collects what a page would load from elsewhere, and checks that tags close in order."""

    def __init__(self):
        super().__init__()
        self.found, self.open = [], []

    def handle_starttag(self, tag, attributes):
        self.found += [v for k, v in attributes if k in ("src", "href") and not v.startswith("data:")]
        if tag not in ("meta", "img", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def read(path):
    text = path.read_text(encoding="utf-8")
    page = Outside()
    page.feed(text)
    assert page.open == []
    assert page.found == []
    return text


def test_the_page_of_a_run_is_whole_and_alone(run):
    reported = read(report(run, with_pictures=False))
    assert "diverged (exit code 3): the water volume is off by &lt;5 %" in reported
    assert "Water &amp; a &lt;wall&gt;" in reported
    assert "&lt;b&gt;" in reported
    for title in ("What was run", "Ledger", "Cracks", "Limits", "Processor time, and what was not computed"):
        assert f"<h2>{title}</h2>" in reported
    assert "NOT KEPT" in reported
    assert "time.end=2 s" in reported


def test_numbers_have_their_units(run):
    reported = read(report(run, with_pictures=False))
    assert "12.5 kN" in reported
    assert "4000 s" in reported
    assert "energy [kJ]" in reported
    assert re.search(r"1\.5<.*>3<.*>1\.5<", reported)
    assert "1 of 2 joints broke" in reported
    assert "dissipated 2.5 kJ" in reported


def test_a_limit_that_was_passed_is_marked(run):
    assert "150 % – passed" in read(report(run, with_pictures=False))


def test_what_could_not_be_drawn_is_said(run, monkeypatch):
    """A run that was stopped before its first output has no pictures; nor has a machine without the extra."""
    assert "the run has stored no fields" in read(report(run))
    monkeypatch.setitem(extras.EXTRAS, "view", ("a_package_that_is_nowhere",))
    assert "a_package_that_is_nowhere is not installed" in read(report(run))


def test_a_directory_of_something_else_is_refused(tmp_path):
    (tmp_path / "case.toml").touch()
    with pytest.raises(NoRun, match=r"a case; `surgebreak run .*` makes a run of it"):
        report(tmp_path)
    (tmp_path / "case.toml").unlink()
    (tmp_path / "run.json").touch()
    with pytest.raises(NoRun, match="a file of a run or a study; name its directory"):
        report(tmp_path / "run.json")
    (tmp_path / "run.json").unlink()
    with pytest.raises(NoRun, match="neither a run"):
        report(tmp_path)


def test_the_report_leaves_yade_and_pictures_alone(run):
    """It reads files; VTK and matplotlib are loaded by the processes that draw."""
    code = (
        "import sys; from pathlib import Path; from coupler.commands.report.command import report\n"
        f"report(Path({str(run)!r}), False)\n"
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert loaded & {"yade", "yade_scripts", "fluid", "matplotlib", "pyvista", "vtkmodules"} == set()


@pytest.mark.parametrize(
    ("value", "unit", "reported"),
    [
        (1234.5, "J", "1.234 kJ"), (0.0, "N", "0 N"), (-2.5e-5, "m", "-25 µm"), (3600.0, "s", "3600 s"),
        (0.02, "s", "20 ms"), (12.0, "m3", "12 m³"), (0.25, "1", "0.25"), (None, "J", "–"), (float("nan"), "J", "–"),
    ],
)  # fmt: skip
def test_quantities_are_short_and_have_units(value, unit, reported):
    assert quantity(value, unit) == reported


def test_a_figure_is_in_the_page(tmp_path):
    """Of the same figure as SVG and PNG the smaller is taken."""
    (tmp_path / "a.png").write_bytes(PIXEL)
    assert "data:image/png;base64," in figure(tmp_path / "a.png", "a")
    (tmp_path / "a.svg").write_text("<svg/>", encoding="utf-8")
    assert "data:image/svg+xml;base64," in figure(tmp_path / "a.png", "a")


def test_the_pages_of_a_figure_are_in_their_order(tmp_path):
    """The tenth leaf of a long table follows the ninth, whatever the formats of the leaves."""
    (tmp_path / "history").mkdir()
    (tmp_path / "history" / "gauges.csv").touch()
    names = ["gauges", *(f"gauges_{k}" for k in range(2, 12))]
    for name in names:
        (tmp_path / f"{name}.svg").write_text("<svg/>", encoding="utf-8")
    (tmp_path / "gauges_3.png").write_bytes(b"")
    shown = plots(tmp_path, tmp_path)
    assert [path.stem for path in shown] == names
    assert shown[2].suffix == ".png"


def test_a_table_without_rows_is_not_there():
    assert table(["a", "b"], []) == ""


def test_markdown_of_a_study(tmp_path):
    (tmp_path / "q.png").write_bytes(PIXEL)
    reported = to_html(
        "# T & U\n\n**bold** and `a < b`\n\n![what](q.png)\n\n![gone](r.png)\n\n"
        "| run | set-up |\n|---|--:|\n| a | 1 |\n\n- one\n- two\n",
        tmp_path,
    )
    assert "<h1>T &amp; U</h1>" in reported
    assert "<strong>bold</strong> and <code>a &lt; b</code>" in reported
    assert reported.count("<img") == 1
    assert "r.png was not drawn" in reported
    assert "set-up s" in reported
    assert "<li>one</li><li>two</li>" in reported


def test_the_page_of_a_study_holds_its_tables_and_figures(tmp_path, monkeypatch):
    """The figures are drawn where the study has none yet; a failed run stands in the page with its reason."""
    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    processes = FakeProcesses()
    processes.broken = {0.4: "the water volume is off"}
    monkeypatch.setattr(runner, "measure", processes)
    monkeypatch.setattr(command, "draw", lambda module, folder: None)
    command.study(tmp_path, [], None, tmp_path / "out", False, False)
    reported = read(report(tmp_path / "out"))
    assert reported.count("<img") == 3
    assert "Cheapest setting for an error" in reported
    assert "the water volume is off" in reported


def test_a_small_film_is_in_the_page_and_a_large_one_linked(run, monkeypatch):
    """Paper shows neither; a page of a hundred megabytes could not be sent."""
    (run / "pictures").mkdir()
    (run / "pictures" / "film.mp4").write_bytes(b"0" * 3000)
    assert "<video controls" in read(report(run, with_pictures=False))
    monkeypatch.setattr(html, "LARGEST_FILM", 2000)
    reported = report(run, with_pictures=False).read_text(encoding="utf-8")
    assert '<a href="pictures/film.mp4">' in reported
    assert "(3 kB)" in reported


def test_a_killed_run_is_reported_from_one_that_goes_on(run):
    """Both left the same run.json; one has no process any more. What it took is not known, so no times."""
    with subprocess.Popen([sys.executable, "-c", ""]) as ended:
        ended.wait()
    for process, reported in (
        (ended.pid, "killed: its process is gone"),
        (os.getpid(), "running: this is what"),
    ):
        going = SUMMARY | {"status": "running", "exit_code": None, "exit_reason": None, "ended": None}
        (run / "run.json").write_text(json.dumps(going | {"process": process}), encoding="utf-8")
        page = read(report(run, with_pictures=False))
        assert reported in page
        assert "wall time" not in page


def test_a_resumed_run_tells_from_where(run):
    again = {
        "at": "2026-01-01T00:00:30+00:00",
        "command": [],
        "from": "1.h5",
        "time": 0.1,
        "changed": ["a=1"],
    }
    (run / "run.json").write_text(json.dumps(SUMMARY | {"resumed": [again]}), encoding="utf-8")
    reported = read(report(run, with_pictures=False))
    assert "2026-01-01 00:00:30 UTC, from the checkpoint at t = 100 ms; a=1" in reported


def test_round_off_in_a_book_is_zero(run):
    """1e-14 J beside kilojoules is not an energy."""
    (run / "history" / "energy.csv").unlink()
    with HistoryTable(run / "history" / "energy.csv", ENERGY) as history:
        for size in (1e-14, 1500.0):
            history.append(**{c[0]: size if c[1] == "J" else 0.1 for c in ENERGY})
    assert "<td class=n>0</td><td class=n>1.5</td>" in read(report(run, with_pictures=False))


def test_the_maps_of_a_flood_are_in_the_page(tmp_path):
    from coupler.commands.report.run_page import _flood

    assert _flood(tmp_path) == ""
    (tmp_path / "flood_map.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    assert "Largest depth" in _flood(tmp_path)


def test_tables_of_many_blocks_are_named_in_place_of_their_figures(tmp_path):
    from coupler.commands.report.run_page import _histories

    (tmp_path / "history").mkdir()
    for name, number in (("few", 2), ("many", 8)):
        columns = [("time", "s", "t"), ("block", "", "name"), ("f_x", "N", "f")]
        with HistoryTable(tmp_path / "history" / f"loads_{name}_blocks.csv", columns) as table:
            for k in range(number):
                table.append(time=0.1, block=f"b{k}", f_x=1.0)
    (tmp_path / "loads_few_blocks.png").write_bytes(PIXEL)
    shown = _histories(tmp_path, tmp_path, of_scheme=False)
    assert len(shown) == 2
    assert "more than 7 blocks: history/loads_many_blocks.csv." in shown[1]
