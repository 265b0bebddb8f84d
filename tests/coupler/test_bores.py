"""What `check` says of a bore at the structure, against closed forms and what a run measures."""

import math

import pytest

from coupler.case.first_cases import write_first_case
from coupler.checks.bores import Bore, against_wall, bores, in_words, over_step
from coupler.checks.read_case import load
from coupler.commands.report.stands import _bores

G = 9.81


@pytest.mark.parametrize(("depth", "velocity"), [(2.0, 1.5), (0.5, 6.0), (3.0, 5.0)])
def test_a_wall_stops_a_bore_with_the_balance_of_momentum(depth, velocity):
    high = against_wall(depth, velocity, G)
    back = depth * velocity / (high - depth)  # speed of the bore back, from the volume
    gain = 0.5 * G * (high**2 - depth**2)
    assert gain == pytest.approx(depth * velocity * (velocity + back))


def test_over_a_step_the_head_and_the_volume_are_kept():
    depth, velocity, step = 3.0, 4.0, 1.0
    there, over = over_step(depth, velocity, step, G)
    assert over == pytest.approx(math.sqrt(G * there))
    head = step + 1.5 * there
    q = there * over
    back = next(h for h in (depth + 1e-4 * k for k in range(100_000)) if h + (q / h) ** 2 / (2 * G) >= head)
    shock = (back - depth) * math.sqrt(G * (back + depth) / (2 * back * depth))
    assert q / back == pytest.approx(velocity - shock, abs=2e-3)


def test_fast_water_passes_a_low_step_and_a_high_one_holds_it():
    depth, velocity, step = 1.0, 7.0, 0.2
    there, over = over_step(depth, velocity, step, G)
    assert there * over == pytest.approx(depth * velocity)
    assert step + there + over**2 / (2 * G) == pytest.approx(depth + velocity**2 / (2 * G))
    assert there < (49.0 / G) ** (1 / 3)
    assert over_step(depth, velocity, 1.01 * against_wall(depth, velocity, G), G) == (0.0, 0.0)


def test_without_a_step_a_slow_bore_falls_to_critical_at_an_edge_as_a_dam_break_does():
    """A depth of still water, taken by an edge of no height: 4/9 of it, Ritter's depth at the dam."""
    there, over = over_step(2.0, 0.0, 0.0, G)
    assert there == pytest.approx(4.0 / 9.0 * 2.0, rel=1e-6)
    assert over == pytest.approx(2.0 / 3.0 * math.sqrt(G * 2.0), rel=1e-6)


def test_the_template_of_a_harbour_says_what_its_bore_is_at_the_house(tmp_path):
    case = load(write_first_case(tmp_path / "harbour", "harbour")).case
    (found,) = bores(case)
    assert found.at == "house"
    assert 0.5 < found.depth_there < found.depth
    assert found.against_wall > found.depth_there
    assert "on top of the step" in in_words(found)
    assert found.arrival < case.time.end


ON_DRY_GROUND = """
[case]
title = "a bore on dry ground"
[time]
end = "1 s"
[tank]
lower = [0, 0, 0]
upper = [10, 4, 5]
cell = 0.5
[[water.inflow]]
kind = "bore"
side = "x-"
level = 3
[structure]
[[structure.block]]
name = "block"
centre = [6.5, 2, 0.5]
size = [1, 1, 1]
[contact]
stiffness = "1 MN/m"
"""


def test_the_tip_on_dry_ground_runs_ahead_of_the_water_behind_it(tmp_path):
    """Ritter: u + 2 sqrt(g h) = 3 sqrt(g h) = 16.3 m/s. In a run of such a bore a wall at x = 6 m broke at
    0.72 s, when water at the velocity of the side, 5.4 m/s, had come to 3.9 m."""
    (tmp_path / "case.toml").write_text(ON_DRY_GROUND, encoding="utf-8")
    (found,) = bores(load(tmp_path).case)
    assert found.velocity == pytest.approx(math.sqrt(G * 3.0), rel=1e-3)
    assert found.front == pytest.approx(3.0 * math.sqrt(G * 3.0), rel=1e-3)
    assert found.arrival == pytest.approx(6.0 / found.front)
    shallow = ON_DRY_GROUND.replace("level = 3", "level = 3\nahead = 0.5")
    shallow += "[[water.fill]]\nlower = [0, 0, 0]\nupper = [10, 4, 0.5]\n"
    (tmp_path / "case.toml").write_text(shallow, encoding="utf-8")
    (wet,) = bores(load(tmp_path).case)
    assert wet.front == pytest.approx(wet.velocity * 3.0 / 2.5)


def test_the_report_sets_theory_beside_what_was_measured(tmp_path):
    bore = Bore("x-", 7.5, 4.8, 10.3, "house", 5.5, 3.31, 5.7, 7.18, 2.0).as_table()
    judged = {"largest": {"depth": {"value": 3.9, "time": 2.4}}}
    (page,) = _bores([bore], judged)
    assert "3.31 m, 5.7 m/s" in page
    assert "3.9 m at 2.4 s" in page
    assert _bores([], judged) == []
