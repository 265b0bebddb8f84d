"""Figures of damage: what they show of walls and loose blocks, and that their words are inside."""

import numpy as np
import pytest

from coupler.commands.view import damage
from coupler.commands.view.plots import STYLE, plt

SQUARE = np.array([[0, 0.0, 0.0], [0, 1.0, 0.0], [0, 1.0, 1.0], [0, 0.0, 1.0]])


@pytest.fixture
def found():
    """A wall of two blocks whose joint broke at 0.5 s, and a loose crate beside it."""
    cracks = {"joint": [0], "a": [0], "b": [1], "area": [1.0], "time": [0.5], "intact": [0]}
    blocks = {
        "member": ["wall", "wall", "crate"],
        "body": ["wall", "wall", "crate"],
        "left_at": [0.6, np.nan, np.nan],
        "first_break": [0.5, 0.5, np.nan],
        "mass": [1.0, 1.0, 1.0],
        "pressure": [np.nan] * 3,
    }
    tables = [{name: np.array(values) for name, values in table.items()} for table in (cracks, blocks)]
    faces = [SQUARE, SQUARE + np.array([0, 0, 1]), SQUARE + np.array([0, 2, 0])]
    joint = np.array([[0, 0, 1.0], [0, 1, 1.0], [1, 1, 1.0], [1, 0, 1.0]])
    return damage.Files(*tables, [joint], faces, np.arange(3), 1.0)


def test_the_words_beside_the_bar_of_one_wall_are_inside_the_figure(found):
    with plt.rc_context(STYLE):
        drawing = damage.over_time(found, ["wall"])
        drawing.canvas.draw()
        words = drawing.axes[-1].yaxis.label.get_window_extent()
    assert drawing.bbox.y0 <= words.y0
    assert words.y1 <= drawing.bbox.y1
    plt.close(drawing)


def test_cracks_are_drawn_of_what_has_joints(found, tmp_path, monkeypatch):
    """A panel of a crate that was never glued would show no crack, and say nothing of the wall."""
    drawn = {}
    monkeypatch.setattr(damage, "read", lambda run: found)
    monkeypatch.setattr(damage, "save", lambda drawing, path, endings: drawn.update({path.name: drawing}))
    for name in ("blocks.csv", "blocks.vtkhdf"):
        (tmp_path / name).touch()
    damage.damage_figures(tmp_path, tmp_path)
    assert [axis.get_title(loc="left") for axis in drawn["cracks"].axes if axis.get_title(loc="left")] == [
        "wall"
    ]
    for drawing in drawn.values():
        plt.close(drawing)
