"""Finer cells in a case: where its tables ask for them, the same after a restart, refused with the reason."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.geometry.cell_sizes import edges_at, widest_cell
from coupler.geometry.stretches import graded
from coupler.geometry.tank_mesh import finest_cell, mesh_of
from coupler.program.errors import BadCase
from coupler.run.checkpoint import FOLDER, listed
from coupler.run.forecast import forecast
from tests.coupler.resumed import begin, check_same, directory_of, go_on

CASE = """\
[case]
title = "a column falls on a post"
[time]
end = "0.2 s"
output_every = "0.1 s"
checkpoint_every = "0.1 s"
[tank]
lower = [0, 0, 0]
upper = [1.6, 0.4, 0.8]
cell = "0.1 m"
REFINED
[water]
covers = "multiple"
[[water.fill]]
lower = [0, 0, 0]
upper = [0.4, 0.4, 0.6]
[[solid]]
name = "post"
centre = [0.8, 0.2, 0.15]
size = [0.04, 0.3, 0.3]
"""
AROUND = '[[tank.refine]]\naround = ["post"]\n'
BOX = "[[tank.refine]]\nlower = [0.6, 0, 0]\nupper = [1.0, 0.4, 0.4]\nlevels = 2\n"
SLICES = '[[tank.stretch]]\nalong = "x"\nlower = 1.2\ncell = "0.2 m"\n'


def loaded(place, refined):
    return load(directory_of(place, CASE.replace("REFINED", refined)), ()).case


def refusal(place, refined):
    with pytest.raises(BadCase) as found:
        loaded(place, refined)
    return "\n".join(found.value.lines)


def test_cells_are_finer_around_the_named_body(tmp_path):
    case = loaded(tmp_path, AROUND)
    mesh = mesh_of(case.tank)
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    near = (np.abs(centre - [0.8, 0.2, 0.15]) < [0.06, 0.19, 0.19]).all(axis=1)
    np.testing.assert_allclose(mesh.cell_size[near], 0.05)
    np.testing.assert_allclose(mesh.cell_size[centre[:, 0] < 0.4], 0.1)
    assert finest_cell(case.tank) == pytest.approx(0.05)
    assert mesh_of(case.tank) is mesh
    rows = {row.name: row for row in forecast(case).rows}
    assert rows["mesh"].value == len(mesh.cells)
    assert "0.05 m" in rows["mesh"].remark


def test_boxes_and_stretches(tmp_path):
    """Two levels in the box; slices of 0.2 m at the end, with one length after the other in between."""
    mesh = mesh_of(loaded(tmp_path, SLICES + BOX).tank)
    assert mesh.finest == pytest.approx(0.025)
    x = np.unique(mesh.nodes[:, 0])
    assert x[-1] - x[-2] == pytest.approx(0.2)
    assert mesh.cell_volume.sum() == pytest.approx(1.6 * 0.4 * 0.8)


def test_edges_of_bricks_are_halved_with_each_level(tmp_path):
    """Two levels in the box, none before it, and slices of 0.2 m at the end, where a body that is thin along x has
    wider cells across it than one that is thin along y."""
    tank = loaded(tmp_path, SLICES + BOX).tank
    places = np.array([[0.8, 0.21, 0.11], [0.21, 0.21, 0.11], [1.55, 0.21, 0.11]])
    np.testing.assert_allclose(edges_at(tank, places), [[0.025] * 3, [0.1] * 3, [0.2, 0.1, 0.1]], rtol=1e-9)
    assert widest_cell(tank, places[2:], np.eye(3)[0]) == pytest.approx(0.2)
    assert widest_cell(tank, places[2:], np.eye(3)[1]) == pytest.approx(0.1)


def test_lengths_change_by_the_growth_at_most():
    """Ends are met exactly; the stretch has its cells, and none is longer than the one before beyond the growth."""
    stretch = SimpleNamespace(lower=4.0, upper=5.0, cell=0.25, growth=1.2)
    x = graded(0.0, 10.0, 1.0, [stretch])
    step = np.diff(x)
    assert {0.0, 4.0, 5.0, 10.0} <= set(x)
    np.testing.assert_allclose(step[(x[:-1] >= 4.0) & (x[:-1] < 5.0)], 0.25)
    assert (np.maximum(step[1:] / step[:-1], step[:-1] / step[1:]) < 1.25).all()
    assert step.max() < 1.1
    whole = SimpleNamespace(lower=None, upper=None, cell=0.5, growth=1.2)
    np.testing.assert_allclose(np.diff(graded(0.0, 3.0, 1.0, [whole])), 0.5)


def test_a_run_on_finer_cells_goes_on_to_the_last_digit(tmp_path):
    text = CASE.replace("REFINED", SLICES + AROUND)
    whole = begin(tmp_path / "case", text, tmp_path / "whole")
    run = begin(tmp_path / "case", text, tmp_path / "run")
    listed(run / FOLDER)[0].unlink()
    go_on(run)
    check_same(whole, run)


@pytest.mark.parametrize(
    ("refined", "reason"),
    [
        (
            AROUND.replace("post", "pots"),
            r"tank.refine\[0\].around: no solid, .* named 'pots'; did you mean 'post'",
        ),
        (AROUND + "lower = [0, 0, 0]\n", r"tank.refine\[0\]: write either lower and upper"),
        ("[[tank.refine]]\n", r"tank.refine\[0\]: write either lower and upper"),
        (BOX.replace("1.0, 0.4, 0.4", "0.5, 0.4, 0.4"), r"upper: x: upper \(0.5 m\) must be greater"),
        (
            BOX.replace("0.6, 0, 0", "0.6, 9, 0").replace("1.0, 0.4", "1.0, 10"),
            r"lower: y: .* outside of the tank",
        ),
        (BOX.replace("levels = 2", "levels = 7"), r"levels: .*6"),
        (AROUND.replace("post", "terrain"), r"'terrain': the case has no section \[terrain\]"),
        (AROUND + "between = [0, 1]\n", r'between: is for around = \["terrain"\]'),
        (
            BOX.replace("levels = 2", "levels = 6") + AROUND + 'margin = "9 m"\nlevels = 6\n',
            "GB for it",
        ),
        (SLICES.replace("1.2", "1.7"), r"tank.stretch\[0\].lower: x: 1.7 to 1.6|upper: x: upper \(1.6 m\)"),
        (SLICES.replace('"0.2 m"', '"0.01 m"'), "more slender than 8 to 1"),
    ],
)
def test_what_cannot_be_is_refused_with_the_reason(tmp_path, refined, reason):
    assert re.search(reason, refusal(tmp_path, refined)), refusal(tmp_path, refined)
