"""Water at the top of the tank, and walls too thin for single covers: told in the run, in run.json and on the page."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.commands.report.run_page import _doubts
from coupler.results.tank_top import TankTop, in_all, reached
from coupler.run.directory import RunDirectory
from coupler.run.execute import execute_case
from coupler.run.summary import read_summary

CASE = """
[case]
title = "water against the end of a low tank"
[time]
end = "0.5 s"
[tank]
lower = [0, 0, 0]
upper = [0.9, 0.2, 0.5]
cell = 0.1
open = []
[[water.fill]]
lower = [0, 0, 0]
upper = [0.5, 0.2, 0.3]
velocity = [4, 0, 0]
[structure]
[[structure.block]]
name = "plate"
centre = [0.7, 0.1, 0.05]
size = [0.02, 0.1, 0.1]
[contact]
stiffness = "1 MN/m"
"""


def run_of(directory, text):
    """The directory of a run of this case to its end."""
    (directory / "case.toml").write_text(text)
    file = load(directory)
    run = RunDirectory.create(file, directory / "run")
    assert execute_case(file, run, quiet=True) == 0
    return run.path


@pytest.mark.parametrize("top", ["closed", "open"])
def test_a_run_tells_when_and_where_water_reached_the_top_and_that_loads_are_doubtful(tmp_path, top):
    text = CASE if top == "closed" else CASE.replace("open = []", 'open = ["z+"]')
    run = run_of(tmp_path, text)
    summary = read_summary(run)
    found = summary["figures"]["tank_top"]
    assert found["open"] == (top == "open")
    assert 0.0 < found["first"] <= found["share_at"] <= 0.5
    assert 0.0 < found["share"] <= 1.0
    log = (run / "log.txt").read_text()
    assert f"note: {reached(found)}" in log
    assert f"but: {in_all(found)}" in log
    thin, of_top = summary["figures"]["doubts"]
    assert thin.startswith("plate is 0.02 m thick, thinner than a cell")
    assert f"but: {thin}" in log
    assert of_top == in_all(found)
    page = _doubts(summary)
    assert "single covers" in page
    assert f"{top} top of the tank" in page
    assert "force on plate" in log


def test_finer_cells_elsewhere_do_not_hide_it(tmp_path):
    """A quarter of the finest cell of the tank is a sixteenth of those at the top, within which no surface came."""
    fine = "[[tank.refine]]\nlower = [0, 0, 0]\nupper = [0.2, 0.2, 0.1]\nlevels = 2\n"
    water = CASE.partition("[structure]")[0].replace("[4, 0, 0]", "[2.8, 0, 0]").replace("0.5 s", "0.32 s")
    for name, text in (("plain", water), ("fine", water.replace("[[water.fill]]", f"{fine}[[water.fill]]"))):
        (tmp_path / name).mkdir()
        assert "tank_top" in read_summary(run_of(tmp_path / name, text))["figures"], name


def test_water_that_stays_below_is_not_told(tmp_path):
    low = CASE.replace("velocity = [4, 0, 0]", "").replace("0.5 s", "0.1 s")
    run = run_of(tmp_path, low)
    summary = read_summary(run)
    assert "tank_top" not in summary["figures"]


def test_water_too_thin_for_the_cells_is_told_again_at_the_end(tmp_path):
    """What was remarked before the run is a reason to doubt its loads; lines at the start are out of sight by then."""
    thin = CASE.replace("upper = [0.5, 0.2, 0.3]", "upper = [0.5, 0.2, 0.25]").replace("0.5 s", "0.02 s")
    run = run_of(tmp_path, thin)
    told = [line for line in read_summary(run)["figures"]["doubts"] if "cells water is not resolved" in line]
    assert len(told) == 1
    assert f"but: {told[0]}" in (run / "log.txt").read_text()


def test_a_verdict_without_water_at_the_structure_is_doubtful(tmp_path):
    """STANDS means nothing for a run that ended before the water came."""
    run = run_of(tmp_path, CASE.replace("0.5 s", "20 ms"))
    summary = read_summary(run)
    assert summary["figures"]["verdict"]["largest"]["force"] is None
    said = "no water touched the structure until the run ended at t = 0.02 s"
    assert summary["figures"]["doubts"][-1].startswith(said)
    assert f"but: {said}" in (run / "log.txt").read_text()
    assert said in _doubts(summary)


def column(wet):
    """Water on a mesh of two nodes at the top and two below."""
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1], [1, 0, 1]], float)
    mesh = SimpleNamespace(node_size=np.ones(4), nodes=nodes, bounds=np.array([[0, 0, 0], [1, 0, 1]], float))
    domain = SimpleNamespace(parent_node=np.array([0, 1, 2, 3, 3]))
    topology = SimpleNamespace(active=np.ones(5, bool))
    return SimpleNamespace(mesh=mesh, domain=domain, topology=topology, level_set=np.where(wet, -1.0, 1.0))


def test_what_stood_at_the_top_at_the_start_does_not_count_and_a_run_goes_on_with_what_it_saw():
    full = [True, True, True, False, False]
    top = TankTop(column(full))
    assert not top.step(column(full), 0.1)
    assert top.reported(True) is None
    assert top.step(column([True] * 4 + [False]), 0.2)
    again = TankTop(column([True] * 5))
    again.restore(top.save())
    assert not again.step(column([True] * 5), 0.3), "told once"
    expected = {
        "first": 0.2,
        "place": [1.0, 0.0],
        "height": 1.0,
        "open": False,
        "share": 0.5,
        "share_at": 0.2,
    }
    assert again.reported(False) == expected
