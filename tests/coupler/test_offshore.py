"""The sea before a coast by ANUGA: what passes the side is what the tank then has, and mistakes are told."""

import numpy as np
import pytest

from coupler.case.inflow_records import record_of
from coupler.case.water import RecordInflow
from coupler.checks.read_case import load
from coupler.commands.offshore.command import _case_at_the_coast, offshore
from coupler.commands.offshore.file import read
from coupler.program.errors import BadCase
from coupler.program.extras import absent
from coupler.run.clock import Clock
from coupler.scene.build import build
from fluid.readings.gauges import levels

needs_anuga = pytest.mark.skipif(bool(absent("offshore")), reason="needs the extra offshore")

DEPTH, SIDE = 5.0, 300.0
NEAR = """
[case]
title = "the coast"
[time]
end = "50 s"
[tank]
lower = [300, 0, -5]
upper = [420, 10, 1.25]
cell = "1.25 m"
[[tank.stretch]]
along = "x"
cell = "5 m"
[[tank.stretch]]
along = "y"
cell = "5 m"
[water]
[[water.fill]]
lower = [300, 0, -5]
upper = [420, 10, 0]
[[water.inflow]]
kind = "record"
side = "x-"
path = "wave.csv"
start = "10 s"
[[water.sea]]
side = "x+"
level = 0
absorbs = true
"""
SEA = """
[near]
case = "case.toml"
side = "x-"
record = "wave.csv"
[sea]
lower = [0, 0]
upper = [600, 10]
cell = "5 m"
floor = -5
manning = 0
open = ["x+"]
end = "60 s"
every = "0.5 s"
[[source]]
kind = "hump"
centre = [100, 5]
height = 0.4
width = [40, 1e6]
"""


def made(tmp_path, text=SEA):
    (tmp_path / "wave.csv").write_text("time,level,velocity\n0,0,0\n50,0,0\n")
    (tmp_path / "case.toml").write_text(NEAR)
    (tmp_path / "offshore.toml").write_text(text)
    return tmp_path / "offshore.toml"


def record(path):
    return record_of(RecordInflow(kind="record", side="x-", path=str(path)))


@needs_anuga
def test_wave_through_the_sea_is_the_same_wave_in_the_tank(tmp_path):
    """50 m inside the tank, against what ANUGA has there: the crest within 3 % and half a second."""
    offshore(made(tmp_path, SEA.replace("[near]\n", "[near]\npoints = 1\n")))
    inner = SEA.replace('"case.toml"', '"inner.toml"').replace('"wave.csv"', '"inner.csv"')
    (tmp_path / "inner.toml").write_text(NEAR.replace("[300, 0, -5]", "[350, 0, -5]"))
    (tmp_path / "inner_sea.toml").write_text(inner)
    offshore(tmp_path / "inner_sea.toml")
    wanted = record(tmp_path / "inner.csv")
    water = (scene := build(load(tmp_path).case, Clock())).coupling.water
    found = []
    while water.time < 45.0:
        scene.coupling.step(min(water.stable_step(), 0.4))
        found.append((water.time + 10.0, levels(water, [(350.0, 5.0)])[0] - DEPTH))
    time, level = np.array(found).T
    crest = wanted.level[:, 0].max()
    assert crest > 0.15
    assert level.max() == pytest.approx(crest, rel=0.03)
    assert time[level.argmax()] == pytest.approx(wanted.time[wanted.level[:, 0].argmax()], abs=0.5)
    print(
        np.round(
            np.column_stack([time, level, np.interp(time, wanted.time, wanted.level[:, 0])])[::6], 3
        ).tolist()
    )


@needs_anuga
def test_record_along_a_side_and_a_wave_through_another(tmp_path):
    """A wave that comes in through y- of the sea runs along the side x- of the tank: sideways there, one place after
    the other."""
    c = np.sqrt(9.81 * DEPTH)
    time = np.arange(0.0, 60.5, 0.5)
    level = 0.3 * np.exp(-(((time - 12.0) / 5.0) ** 2))
    rows = "\n".join(f"{t},{z},{c * z / (DEPTH + z)}" for t, z in zip(time, level))
    (tmp_path / "south.csv").write_text("time,level,velocity\n" + rows + "\n")
    text = SEA.partition("[[source]]")[0].replace("[near]\n", "[near]\npoints = 3\n")
    text = text.replace("lower = [0, 0]\nupper = [600, 10]", "lower = [290, -200]\nupper = [310, 100]")
    text = (
        text.replace('open = ["x+"]', 'open = ["y+"]')
        + '[[inflow]]\nkind = "record"\nside = "y-"\npath = "south.csv"\n'
    )
    path = made(tmp_path, text)
    (tmp_path / "case.toml").write_text(NEAR.replace("420, 10", "420, 80"))
    offshore(path)
    found = record(tmp_path / "wave.csv")
    np.testing.assert_allclose(found.along, [0, 40, 80])
    crest = found.level.argmax(axis=0)
    np.testing.assert_allclose(found.level.max(axis=0), 0.3, rtol=0.1)
    np.testing.assert_allclose(np.diff(found.time[crest]), 40 / np.sqrt(9.81 * 5.3), atol=1.1)
    assert found.sideways[crest[1], 1] == pytest.approx(c * 0.3 / 5.3, rel=0.15)
    assert abs(found.velocity).max() < 0.02


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("floor = -5\n", "", "sea.floor: give the bed once"),
        ("upper = [600, 10]", "upper = [-1, 10]", "sea.upper: must lie above sea.lower"),
        ("every = ", "evry = ", r"sea.evry: unknown name; did you mean 'every'"),
        ('kind = "hump"\n', 'kind = "okada"\n', "source"),
        ("end = \"60 s\"", "end = \"60 m\"", "sea.end"),
        (SEA[SEA.index("[[source]]") :], "", "nothing moves the water"),
    ],
)  # fmt: skip
def test_offshore_files_with_mistakes_are_refused(tmp_path, old, new, says):
    assert old in SEA
    with pytest.raises(BadCase, match=says):
        read(made(tmp_path, SEA.replace(old, new)))


def test_before_the_first_call_the_case_names_a_record_that_is_not_there(tmp_path):
    """As the page of the terrain shows it; the command was refused for want of the file that it writes. Other files
    that a case lacks are told as ever."""
    path = made(tmp_path)
    (tmp_path / "wave.csv").unlink()
    assert _case_at_the_coast(read(path)).tank.lower == (300, 0, -5)
    (tmp_path / "case.toml").write_text(NEAR, encoding="utf-8-sig")  # as editors of Windows do
    assert _case_at_the_coast(read(path)).tank.lower == (300, 0, -5)
    (tmp_path / "case.toml").write_text(NEAR.replace('"wave.csv"', '"other.csv"'))
    with pytest.raises(BadCase, match=r"other\.csv: no such file"):
        _case_at_the_coast(read(path))


@needs_anuga
def test_side_that_lies_beside_the_sea_is_refused(tmp_path):
    with pytest.raises(
        BadCase, match=r"lies beside the sea at \(300, 5\) m; the sea goes from \(0, 0\) to \(200, 10\)"
    ):
        offshore(made(tmp_path, SEA.replace("upper = [600, 10]", "upper = [200, 10]")))
