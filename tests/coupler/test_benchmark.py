"""The command benchmark: scenes of the size they say, times per unit, targets. The times themselves are not tested."""

import json
import time

import numpy as np
import pytest

from coupler.commands.benchmark import command, cutting, debris, part, scenes, solver, water
from coupler.commands.benchmark.command import Line
from coupler.program.errors import BadCase, ExitCode
from yade_scripts.blocks.faces import touching_faces


@pytest.mark.parametrize("joints", [56, 500, 1000])
def test_a_wall_has_about_the_joints_asked_for(joints):
    assert len(touching_faces(scenes.wall(joints))) == pytest.approx(joints, rel=0.1)


def test_the_building_has_500_blocks_and_the_pile_touches_everywhere():
    assert len(scenes.building()) == pytest.approx(500, abs=5)
    assert len(touching_faces(scenes.pile(3))) == 3 * 9 * 2


def test_the_best_time_is_that_of_one_unit():
    """Work that takes 1 ms a unit on this processor's clock."""

    def work(count):
        until = time.process_time() + 1e-3 * count
        while time.process_time() < until:
            pass

    assert part.best(work) == pytest.approx(1e-3, rel=0.05)


def test_a_wall_is_taken_apart_to_the_last_joint(monkeypatch):
    """From all joints to none, each state timed; the times are for the benchmark to show."""
    monkeypatch.setattr(part, "CHUNK", 0.03)
    found = part.dead(56)
    assert found["alive"][0] == found["joints"]
    assert found["alive"][-1] == 0
    assert len(found["cost"]) == len(found["alive"])
    assert min(found["cost"]) > 0.0


def test_a_line_without_target_is_kept_and_a_missed_one_is_reported():
    assert Line("x", 1, 1, 5.0, "a joint").kept
    missed = Line("x", 1, 1, 5.0, "a joint", 1.0)
    assert not missed.kept
    assert "MISSED" in command._reported(missed)


def test_cutting_is_measured_per_cell_that_lost_something(monkeypatch):
    """A coarse mesh: every wall and number of bodies has its line, the limits belong to them, and finer walls cut the
    same cells."""
    monkeypatch.setattr(cutting, "CELLS_ALONG", 10)
    monkeypatch.setattr(cutting, "BOXES", 60)
    monkeypatch.setattr(cutting, "REPEATS", 1)
    monkeypatch.setattr(cutting, "NEAR", (1, 2))
    measured = cutting.cutting(0)
    assert len({cells for _, cells, _ in measured["walls"]}) == 1
    lines = list(cutting.figures(measured))
    assert [limit for *_, limit in lines] == [4.6, 5.8, 9.0, 35.0, None, 10.7]
    assert all(line[2] > 0 for line in lines)


def test_json_is_one_object_and_a_missed_target_is_the_exit_code(monkeypatch, capsys):
    monkeypatch.setattr(command, "GROUPS", {"joints": lambda sizes: [Line("a", 1, 1, 5.0, "a joint", 1.0)]})
    assert command.benchmark(quick=True, as_json=True) == ExitCode.DIVERGED
    reported = json.loads(capsys.readouterr().out)
    assert reported["lines"][0]["kept"] is False
    assert {"machine", "versions"} <= reported.keys()


def test_debris_is_apart_and_as_many_as_asked_for():
    """Blocks that overlapped at the start would be thrown about: spheres around them have their own cubes."""
    blocks = debris.debris(30)
    places = np.array([b.centre for b in blocks])
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + 10.0 * np.eye(30)
    assert len(blocks) == 30
    assert apart.min() >= 2.0 > 2.0 * max(b.radius for b in blocks)


def test_the_costs_of_debris_are_reported_part_by_part():
    """The share is that of one solve, structure included."""
    bare = dict.fromkeys(debris.PARTS, 1.0) | {"unknowns": 10, "iterations": 5.0, "passes": 1.0}
    full = dict.fromkeys(debris.PARTS, 3.0) | {"unknowns": 10, "iterations": 5.0, "passes": 2.0}
    found = debris.Costs(bare, bare | {"pressure": 2.0}, full)
    assert found.shares == pytest.approx((3.0, 1.5))
    shown = debris.summary_line(found, 30)
    assert all(what in shown for what in debris.PARTS.values())


def test_one_group_may_be_chosen_and_an_unknown_one_is_refused(monkeypatch, capsys):
    groups = {name: lambda sizes, name=name: [Line(name, 1, 1, 1.0, "")] for name in ("joints", "water")}
    monkeypatch.setattr(command, "GROUPS", groups)
    assert command.benchmark(quick=True, as_json=True, only="water") == ExitCode.DONE
    assert [line["what"] for line in json.loads(capsys.readouterr().out)["lines"]] == ["water"]
    with pytest.raises(BadCase, match="choose one of joints, water"):
        command.benchmark(quick=True, as_json=True, only="wat")


def test_stages_are_those_of_a_step_and_add_up_to_no_more_than_it(monkeypatch):
    """Every stage is found in the code and takes time; a stage inside another counts once."""
    monkeypatch.setattr(water, "BEFORE", 0.05)
    found = water.water(8000)
    assert all(seconds > 0.0 for seconds in found["stages"].values())
    assert 0.0 <= found["rest"] < 0.5 * found["step"]


def test_all_solvers_solve_the_systems_alone_and_with_a_wall():
    for wall in (False, True):
        found = solver.solver(1500, wall)["solvers"]
        assert set(found) == set(solver.PRECONDITIONERS)
        assert found["multigrid"]["iterations"][0] < 0.5 * found["diagonal"]["iterations"][0]
