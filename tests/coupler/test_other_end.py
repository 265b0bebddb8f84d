"""When a run is to end says nothing about what happens before: runs with other ends have the same bits until then."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.scene.side_energy import coming_energy
from tests.coupler.resumed import begin

RISING = """\
[case]
title = "a block afloat beside an inflow that grows"
[time]
end = "0.2 s"
step_max = "20 ms"
output_every = "0.1 s"
checkpoint_every = 0
[tank]
lower = [0, 0, 0]
upper = [1.2, 0.6, 0.9]
cell = 0.15
[coupling]
passes = 3
[[water.fill]]
lower = [0, 0, 0]
upper = [1.2, 0.6, 0.3]
[[water.inflow]]
kind = "record"
side = "x-"
path = "rising.csv"
[structure]
[[structure.block]]
name = "box"
centre = [0.6, 0.3, 0.3]
size = [0.3, 0.3, 0.2]
density = 500
[structure.ground]
[contact]
stiffness = "1 MN/m"
"""


def tables(path):
    return {file.name: file.read_text(encoding="utf-8").splitlines() for file in (path / "history").iterdir()}


def test_a_run_with_another_end_has_the_same_bits_until_then(tmp_path):
    """Also where the record brings far more water after the first end: the scale of the energy error, and of the defect
    that decides on further passes, does not go by the end."""
    text = "time,level,velocity\n0,0.3,0\n0.2,0.31,0.1\n0.8,0.32,0.1\n1.2,0.8,3\n9,0.8,3\n"
    for name in ("short", "long"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "rising.csv").write_text(text, encoding="utf-8")
    short = tables(begin(tmp_path / "short", RISING, tmp_path / "short.run"))
    other = tables(begin(tmp_path / "long", RISING, tmp_path / "long.run", "time.end=0.3 s"))
    assert set(short) == set(other)
    for name, lines in short.items():
        assert other[name][: len(lines)] == lines, name
    assert "input_energy" in "".join(short["energy.csv"])


def test_a_sea_counts_with_what_it_brings_soon_and_not_with_all_of_its_tide(tmp_path):
    """A tide of 0.2 m that takes 12 h brings nothing in the time of a wave; one that takes 2 s brings all of it."""
    found = []
    for period in ("12 h", "2 s"):
        (tmp_path / period).mkdir()
        text = TIDE.replace("PERIOD", period).replace("HIGH", "6 h" if period == "12 h" else "1 s")
        (tmp_path / period / "case.toml").write_text(text, encoding="utf-8")
        coming = coming_energy(load(tmp_path / period).case)
        found.append((coming(0.0), coming(0.5)))
    most = 0.5 * 1000 * 0.6 * 0.5 * 9.81 * 0.2**2
    assert max(found[0]) < 1e-6 * most
    assert 0.01 * most < found[1][0] < 0.5 * most  # at cos(2π 0.4 s/2 s) of the tide
    assert found[1][1] == pytest.approx(most * _at(0.5 + CROSSING), rel=1e-9)


def _at(time):
    """Energy over that at high water, which comes at 1 s."""
    rise = 0.1 + 0.1 * np.cos(np.pi * (time - 1.0))
    return (0.3 + rise) / 0.5 * (rise / 0.2) ** 2


CROSSING = 1.2 / np.sqrt(9.81 * 0.9)
TIDE = """\
[case]
title = "a tide"
[time]
end = "1 s"
[tank]
lower = [0, 0, 0]
upper = [1.2, 0.6, 0.9]
cell = 0.15
[[water.fill]]
lower = [0, 0, 0]
upper = [1.2, 0.6, 0.3]
[[water.sea]]
side = "x+"
level = 0.4
tide = { amplitude = "0.1 m", period = "PERIOD", high = "HIGH" }
"""
