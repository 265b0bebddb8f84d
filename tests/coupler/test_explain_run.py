"""What a run left out, in figures and in words."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.commands.benchmark.water import dam_break
from coupler.commands.explain_run import explanation_of_run, not_loaded, shares, skipped
from coupler.program.errors import NoRun
from coupler.run.left_out import note_work
from coupler.step.observe import JointCounts, wet_cells
from fluid.numerics.bounded import solve_pressure
from tests.coupler.fake_runs import SUMMARY


def summary(**work):
    """A run of 10 steps in which everything cost 2 s, with the counts a step given."""
    return SUMMARY | {
        "status": "done",
        "exit_reason": "reached the end",
        "modules": {"water": True, "structure": True, "coupling": True, "viscosity": False},
        "case": {"case": {"title": "made up"}, "coupling": {"passes": 3}},
        "figures": {
            "steps": 10,
            "cpu_seconds": {"water": 1.5, "pressure": 0.5, "cut": 1.0, "carry over": 1.0, "structure": 2.0},
            "work": work,
            "imports": {"fluid": True, "yade": True, "matplotlib": False},
        },
    }


WATER = {"mesh_cells": 120, "cells": 100, "wet_cells": 25, "bodies": 5, "bodies_cut": 1, "passes": 1.0}
STRUCTURE = {"blocks": 4, "loose_blocks": 1, "joints": 6, "live_joints": 4, "contacts": 4}


def found(reported):
    return {row.what: row for row in skipped(reported)}


def test_the_estimate_is_cost_of_a_unit_times_units_skipped():
    """2 s over 25 wet cells: 75 dry ones would have cost 6 s; four bodies of five 8 s; two passes 5 s."""
    rows = found(summary(**WATER, **STRUCTURE))
    assert rows["cells without water"].seconds == pytest.approx(6.0)
    assert rows["cells inside solids"].seconds == pytest.approx(1.6)
    assert rows["bodies not cut again"].seconds == pytest.approx(8.0)
    assert rows["passes not needed"].seconds == pytest.approx(5.0)
    assert rows["broken joints"].seconds == pytest.approx(2.0 / 8 * 2)
    assert rows["bodies not cut again"].share == pytest.approx(0.2)


def test_no_estimate_without_a_measure():
    """A run that cut no body again does not know what a cut costs, and says so."""
    rows = found(summary(**WATER | {"bodies_cut": 0}))
    assert rows["bodies not cut again"].seconds is None
    assert rows["bodies not cut again"].skipped == 5


def test_absent_sides_have_no_rows():
    assert found(summary(**STRUCTURE)).keys() == {"broken joints", "blocks outside the search for contacts"}
    assert skipped(summary()) == []


def test_shares_are_of_the_whole():
    assert sum(share for _, _, share in shares(summary())) == pytest.approx(1.0)


def test_parts_that_were_not_loaded():
    assert list(not_loaded(summary())) == ["pictures"]


def test_the_words_say_what_is_an_estimate(tmp_path):
    (tmp_path / "run.json").write_text(json.dumps(summary(**WATER, **STRUCTURE)), encoding="utf-8")
    reported = explanation_of_run(tmp_path)
    assert "costs are estimates" in reported
    assert "cells without water: 75 of 100 a step; about 6 s more" in reported
    assert "off in this case: viscosity" in reported


def test_a_directory_without_a_run_is_refused(tmp_path):
    with pytest.raises(NoRun):
        explanation_of_run(tmp_path)


def test_counts_are_means_over_the_steps():
    """A tank of two tetrahedra of which the second dries after the first step: 1.5 wet cells a step."""
    water = SimpleNamespace(
        mesh=SimpleNamespace(cells=np.zeros((3, 4))),
        topology=SimpleNamespace(cells=np.zeros((2, 4))),
        domain=SimpleNamespace(n_bodies=0),
        report=SimpleNamespace(wet_cells=2),
    )
    structure = SimpleNamespace(n=2, loose=lambda: np.array([True, False]), contacts=lambda: [0, 0])
    coupling = SimpleNamespace(water=water, structure=structure)
    record, work = SimpleNamespace(bodies_cut=0, passes=1), {}
    note_work(work, coupling, record, JointCounts(2, 0, 0.0), 1)
    water.report.wet_cells = 1
    note_work(work, coupling, record, JointCounts(1, 1, 0.0), 2)
    assert work["wet_cells"] == 1.5
    assert (work["cells"], work["mesh_cells"]) == (2, 3)
    assert (work["joints"], work["live_joints"], work["contacts"]) == (2, 1.5, 2)
    assert work["loose_blocks"] == 1


def test_the_report_of_a_step_counts_the_cells_with_a_node_in_the_water():
    """With those that a box cuts and whose fluid part lies above the surface: they hold no water and are left out of
    the pressure, but they have such a node."""
    water, left_out = dam_break(1500), 0
    for _ in range(30):
        problem = water.predict(water.stable_step())
        left_out += len(problem.predicted.void)
        water.correct(problem, solve_pressure(problem, 1e-8).x)
        assert water.report.wet_cells == wet_cells(water)
    assert left_out > 0
