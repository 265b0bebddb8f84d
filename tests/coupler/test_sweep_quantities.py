"""Drift of storeys from the written states of blocks, on motions whose drift is known."""

import numpy as np
import pytest

from coupler.case.sweep import Sweep, SweepQuantity
from coupler.commands.sweep.quantities import asked, read_quantity
from coupler.results.fields import BlockWriter
from coupler.results.history import HistoryTable
from coupler.run.directory import write_json
from yade_scripts.blocks.generators.column import column_of_boxes
from yade_scripts.blocks.generators.wall import wall_of_blocks

from .fake_runs import SUMMARY

GROUND = {"structure": {"ground": {"level": 0.0}}}


def drift(folder, parts, moved, case=GROUND, **given):
    """The drift ratio of a run in which blocks of parts {group: blocks} move from x to moved(x, group)."""
    blocks = [block for part in parts.values() for block in part]
    groups = [group for group, part in parts.items() for _ in part]
    write_json(
        folder / "run.json",
        SUMMARY
        | {"status": "done", "exit_reason": "", "figures": {}, "case": {"case": {"title": "t"}} | case},
    )
    shapes = [b.vertices for b in blocks], [b.faces for b in blocks], [b.name for b in blocks]
    writer = BlockWriter(folder / "blocks.vtkhdf", *shapes, groups)
    start, still = np.array([b.centre for b in blocks]), np.repeat(np.eye(3)[None], len(blocks), 0)
    writer.append(0.0, start, still, {})
    writer.append(1.0, np.array([moved(x, group) for x, group in zip(start, groups)]), still, {})
    found = read_quantity(folder, SweepQuantity(name="q", damage="drift", **given))
    assert not found.why
    return found.value


def sheared(x, group):
    return x + np.array([0.1 * x[2], 0.0, 0.0])


@pytest.mark.parametrize("number", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("course", [0.15, 0.2, 0.25, 0.3, 0.4])
@pytest.mark.parametrize("level", [0.0, 12.3])
def test_the_foot_of_a_column_on_the_ground_does_not_move(tmp_path, number, course, level):
    """Sheared by a tenth of the height: the topmost block has moved by that of its middle, whatever float32 makes of
    the heights."""
    height = number * course
    column = column_of_boxes("c", (0, 0, level), (0.3, 0.3, height), number)
    case = {"structure": {"ground": {"level": level}}}
    found = drift(
        tmp_path,
        {"c": column},
        lambda x, _: x + np.array([0.1 * (x[2] - level), 0, 0]),
        case,
        lower=level,
        upper=level + height,
    )
    assert found == pytest.approx(0.1 * (height - 0.5 * course) / height, rel=1e-4)


def two_walls():
    return {
        "lower": wall_of_blocks("lower", (0, 0, 0), (2, 0.2, 3), (0.5, 0.2, 0.3)),
        "upper": wall_of_blocks("upper", (0, 0, 3), (2, 0.2, 3), (0.5, 0.2, 0.3)),
        "beside": wall_of_blocks("beside", (5, 0, 0), (2, 0.2, 6), (0.5, 0.2, 0.3)),
    }


@pytest.mark.parametrize("lower", [2.9, 3.0, 3.1, 3.2])
@pytest.mark.parametrize("of", [None, "upper"])
def test_a_storey_that_is_carried_along_undeformed_has_no_drift(tmp_path, of, lower):
    """The wall under it slides by 0.3 m and takes it along; another one beside stands still and does not count."""
    parts = two_walls()
    if of is None:
        del parts["beside"]

    def slides(x, group):
        return x if group == "beside" else x + np.array([0.0, 0.3, 0.0])

    assert drift(tmp_path, parts, slides, of=of, lower=lower, upper=6.0) == pytest.approx(0.0, abs=1e-6)


def test_the_drift_of_a_storey_is_against_what_it_stands_on(tmp_path):
    """The upper wall slides by 0.3 m on the lower one, 2.85 m up to the middle of its topmost blocks."""
    parts = {"lower": two_walls()["lower"], "upper": two_walls()["upper"]}
    found = drift(
        tmp_path,
        parts,
        lambda x, group: x + np.array([0.0, 0.3 * (group == "upper"), 0.0]),
        of="upper",
        lower=2.8,
        upper=6.0,
    )
    assert found == pytest.approx(0.3 / 3.2, rel=1e-5)


@pytest.mark.parametrize(
    ("case", "wanted"),
    [
        ({"tank": {"lower": [0, 0, 0]}}, 0.5 / 0.6),
        ({"tank": {"lower": [0, 0, -1]}}, 0.4 / 0.6),
        ({"tank": {"lower": [0, 0, 0]}, "terrain": {"path": "t"}}, 0.4 / 0.6),
        ({"structure": {"ground": None}}, 0.4 / 0.6),
    ],
)
def test_only_level_ground_stands_still_under_a_column(tmp_path, case, wanted):
    """Three blocks of 0.2 m; elsewhere the lowest one, which moves as its height, is what the drift is against."""
    column = column_of_boxes("c", (0, 0, 0), (0.3, 0.3, 0.6), 3)
    found = drift(tmp_path, {"c": column}, sheared, case, lower=0.0, upper=0.6)
    assert found == pytest.approx(0.1 * wanted, rel=1e-4)


@pytest.mark.parametrize(
    ("take", "unit"), [("max", "N"), ("last", "N"), ("integral", "N s"), ("arrival", "s"), ("period", "s")]
)
def test_a_quantity_has_the_unit_of_its_column_unless_another_is_given(tmp_path, take, unit):
    """Axes of figures and tables of a sweep gave forces as bare numbers."""
    (tmp_path / "history").mkdir()
    columns = [("time", "s", ""), ("pier_force_x", "N", ""), ("rate", "m3/s", ""), ("damage", "1", "")]
    with HistoryTable(tmp_path / "history" / "gauges.csv", columns) as table:
        for k in range(5):
            table.append(time=float(k), pier_force_x=(-1.0) ** k, rate=1.0, damage=0.1 * k)

    def found(column, **more):
        given = {"table": "history/gauges.csv", "column": column, "take": take}
        return read_quantity(tmp_path, SweepQuantity(name="q", **given, **more)).unit

    more = {"arrival": {"above": 0.5}, "integral": {"window": (0.0, 4.0)}}.get(take, {})
    assert found("pier_force_x", **more) == unit
    assert found("rate", **more) == {"N": "m3/s", "N s": "m3", "s": "s"}[unit]
    assert found("damage", **more) == {"N": "1", "N s": "s", "s": "s"}[unit]


def test_a_sweep_without_quantities_tells_whether_loose_blocks_moved(tmp_path):
    """They have no joints that could break: without the shares of the weight all rows looked alike."""
    verdict = {
        "name": "structure", "word": "moved", "state": "collapsed", "rule": "", "blocks": 4, "blocks_moved": 2,
        "joints": 0, "joints_broken": 0, "area_broken": 0.0, "weight_moved": 0.5, "weight_out": 0.25,
        "farthest": {"block": "a", "way": 1.0}, "first_break": None, "largest": {}, "bodies": [], "members": [],
        "storeys": [], "displaced": {"blocks": 2, "first": 0.1, "list": []}, "hits": {"pairs": 0, "list": []},
    }  # fmt: skip
    figures = {"joints": 0, "joints_broken": 0, "verdict": verdict}
    case = {"case": {"title": "t"}}
    whole = SUMMARY | {"status": "done", "exit_reason": "", "figures": figures, "case": case}
    write_json(tmp_path / "run.json", whole)
    found = {q.name: read_quantity(tmp_path, q).value for q in asked(Sweep())}
    assert (found["weight_moved"], found["weight_out"]) == (0.5, 0.25)
