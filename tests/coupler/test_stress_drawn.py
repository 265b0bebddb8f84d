"""Scenes drawn at random: the same ones again, all of them cases, judged from outside, and failures made small.

Twenty of them are run here, the beginning of each; `surgebreak stress --random` runs whole ones."""

import copy
import subprocess
import sys
import tomllib

import numpy as np
import pytest

from coupler.case.case import Case, effective
from coupler.case.toml_text import document
from coupler.checks.read_case import load
from coupler.commands.stress.drawn import command
from coupler.commands.stress.drawn import trial as trials
from coupler.commands.stress.drawn.case import write
from coupler.commands.stress.drawn.judge import _finite, measures
from coupler.commands.stress.drawn.scene import draw
from coupler.commands.stress.drawn.shrink import shrunk
from coupler.commands.stress.drawn.trial import Trial, asked_too_much
from coupler.commands.stress.registry import Measure
from coupler.geometry.overlaps import Overlap
from coupler.program.errors import BadCase, ExitCode
from coupler.results.fields import BlockWriter
from coupler.results.gauges import make_gauge
from coupler.results.history import HistoryTable, read_history
from coupler.run.directory import RunDirectory, write_json
from coupler.run.execute import execute_case
from coupler.step.limits import Diverged, check_overlap
from coupler.step.step_limits import ONE_PASS

SEED = 2
NUMBERS = range(20)
SHORT = 0.4
"""[CPU s] that a scene is sized for here."""


def made(directory, number, seconds=SHORT):
    """The case of a scene, and whether its water has no reason to move; any machine may take as long as it takes."""
    drawn = draw(SEED, number, seconds)
    del drawn.table["limits"]["cpu_seconds"]
    return load(write(drawn.table, drawn.files, directory / drawn.id)), drawn.still


def test_a_scene_is_the_same_whenever_it_is_drawn():
    assert [document(draw(3, n).table) for n in range(20)] == [document(draw(3, n).table) for n in range(20)]
    assert len({document(draw(seed, n).table) for seed in (3, 4) for n in range(20)}) == 40


def test_files_say_what_was_drawn(tmp_path):
    for number in range(20):
        drawn = draw(SEED, number)
        place = write(drawn.table, drawn.files, tmp_path / drawn.id)
        assert tomllib.loads((place / "case.toml").read_text()) == tomllib.loads(document(drawn.table))
        assert {path.name for path in place.iterdir()} == {"case.toml", *drawn.files}


def test_every_drawn_scene_is_a_case(tmp_path):
    """A scene that is refused is one that nobody meant: the makers keep bodies apart and inside of the tank."""
    refused = []
    for number in range(100, 140):
        try:
            made(tmp_path, number)
        except BadCase as error:
            refused.append((number, str(error)))
    assert refused == []


def test_scenes_cover_the_case_format():
    """Every section, kind of body, side, wall and law turns up."""
    text = "\n".join(document(draw(SEED, number).table) for number in range(300))
    wanted = [
        "[[solid]]",
        "[joints]",
        "[coupling]",
        "[[motion]]",
        "[structure.ground]",
        "[[water.sea]]",
        "mesh = ",
    ]
    wanted += [
        f"[[structure.{kind}]]" for kind in ("block", "wall", "building", "column", "arch", "rubble", "file")
    ]
    wanted += [f'kind = "{kind}"' for kind in ("bore", "solitary", "steady", "record")]
    wanted += [f'kind = "{kind}"' for kind in ("level", "volume", "flux", "motion", "force", "loads")]
    wanted += [
        'walls = "no-slip"',
        'walls = "friction"',
        "viscosity",
        'covers = "multiple"',
        'openings = "wide"',
        'model = "trapped"',
        "[[water.air.vent]]",
        'kind = "air"',
    ]
    wanted += [
        'cracks = "slit"',
        'cracks = "closed"',
        'split = "mirrored"',
        'law = "bilinear"',
        "smooth",
        "open",
    ]
    wanted += ["rotation", "vertices", "velocity", "spin", "fixed", "gravity", "advection", "pair"]
    wanted += [
        "[[tank.refine]]",
        "[[tank.stretch]]",
        "absorbs = true",
        'kind = "n-wave"',
        'openings = "edges"',
        "uplift_share",
        'uplift = "damage"',
        'uplift = "full"',
        "distribution",
        "[structure.sleep]",
        'start = "ramp"',
    ]
    assert [name for name in wanted if name not in text] == []


@pytest.mark.parametrize("number", NUMBERS)
def test_a_short_scene_keeps_what_it_must(tmp_path, number):
    file, still = made(tmp_path, number)
    code = execute_case(file, RunDirectory.create(file, tmp_path / "out"))
    assert code in (ExitCode.DONE, ExitCode.STOPPED)
    assert [m for m in measures(tmp_path / "out", still) if not m.kept] == []


# ---------------------------------------------------------------- judged from outside

BLOCKS = {
    "case": {"title": "two blocks"},
    "time": {"end": 1.0},
    "tank": {"lower": [0, 0, 0], "upper": [4, 4, 4], "cell": 1.0},
    "structure": {"block": [{"name": "a", "centre": [1, 1, 0.5], "size": [1, 1, 1]}]},
    "contact": {"stiffness": 1e6},
}
CUBE = 0.5 * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
ENERGY = (
    "water_kinetic",
    "water_potential",
    "air_energy",
    "blocks_kinetic",
    "blocks_gravity",
    "joint_stored",
    "contact_stored",
)
ENERGY += ("entered", "driving_work", "energy_error")


def written(directory, kinetic=(1.0, 1.0), places=((1.0, 1.0, 0.5), (2.5, 1.0, 0.5)), lines=None):
    """The files of a run of two unit cubes: kinetic energy [J] in its rows (None: no number), centres (n, 3) [m] at
    its end."""
    (directory / "history").mkdir(parents=True)
    write_json(directory / "run.json", {"case": effective(Case.model_validate(BLOCKS)), "figures": {}})
    energy = HistoryTable(
        directory / "history" / "energy.csv", [(name, "J", "") for name in (*ENERGY, "input_energy")]
    )
    for value in kinetic:
        energy.append(**dict.fromkeys(ENERGY, 0.0) | {"blocks_kinetic": value, "input_energy": 1.0})
    energy.close()
    names = [f"{name}_{axis}" for name in ("blocks", "contact", "residual") for axis in "xyz"]
    momentum = HistoryTable(directory / "history" / "momentum.csv", [(name, "N s", "") for name in names])
    momentum.append(**{name: 0.0 if name.startswith("residual") else 1.0 for name in names} | (lines or {}))
    momentum.close()
    blocks = BlockWriter(directory / "blocks.vtkhdf", [CUBE] * 2, [FACES] * 2, ["a", "b"], ["a", "b"])
    turns = np.tile(np.eye(3), (2, 1, 1))
    blocks.append(0.0, np.array([[1.0, 1.0, 0.5], [2.5, 1.0, 0.5]]), turns, {"speed": np.zeros(2)})
    blocks.append(1.0, np.array(places), turns, {"speed": np.zeros(2)})
    return [m.quantity for m in measures(directory, still=False) if not m.kept]


def test_files_of_a_sound_run_keep_everything(tmp_path):
    assert written(tmp_path / "run", places=((1.0, 1.0, 0.48), (1.95, 1.0, 0.5))) == []


@pytest.mark.parametrize(
    ("what", "wrong"),
    [
        ({"kinetic": (1.0, 1.06)}, "energy above what was put in"),
        ({"kinetic": (1.0, None)}, "numbers that are not finite"),
        ({"lines": {"residual_y": 1e-5}}, "momentum missed along y"),
        ({"places": ((1.0, 1.0, 0.5), (1.85, 1.0, 0.5))}, "overlap over the thinner body (a and b, t = 1 s)"),
        (
            {"places": ((1.0, 1.0, 0.35), (2.5, 1.0, 0.5))},
            "reach through a wall over the thickness (a at z-, t = 1 s)",
        ),
        (
            {"places": ((1.0, 1.0, 0.5), (3.7, 1.0, 0.5))},
            "reach through a wall over the thickness (b at x+, t = 1 s)",
        ),
    ],
)
def test_a_fault_is_seen_in_the_files(tmp_path, what, wrong):
    assert wrong in written(tmp_path / "run", **what)


GAUGES = (
    {"kind": "air", "name": "a", "at": (1, 1, 1)},
    {"kind": "pressure", "name": "p", "at": (1, 1, 1), "impulse": (0, 1), "mean_over": 0.1},
    {"kind": "patch", "name": "s", "at": (1, 1, 1), "radius": 0.1, "normal": (1, 0, 0), "mean_over": 0.1},
    {"kind": "velocity", "name": "v", "at": (1, 1, 1), "mean_over": 0.1},
    {"kind": "level", "name": "l", "at": (1, 1), "mean_over": 0.1},
    {"kind": "flux", "name": "f", "at": (1, 1, 1), "edges": ((0, 1, 0), (0, 0, 1)), "mean_over": 0.1},
    {"kind": "motion", "name": "m", "of": "a"},
)


@pytest.mark.parametrize("gauge", GAUGES, ids=lambda gauge: gauge["kind"])
def test_cells_of_gauges_may_be_empty_exactly_where_there_is_nothing_to_measure(gauge):
    """The gauge itself writes NaN as an empty cell in those columns, whose names come from it."""
    case = Case.model_validate(BLOCKS | {"gauge": [gauge]})
    names = [name for name, *_ in make_gauge(case.gauge[0], {"a": np.array([0])}).columns]
    always = ("covered", "impulse", "peak")
    if gauge["kind"] in ("level", "flux", "motion"):
        always = tuple(names)
    counted = {}
    for name in names:
        tables = {"gauges": {name: np.array([1.0, np.nan])}}
        (found,) = _finite(tables, case)
        counted[name] = found.value
    assert counted == {name: float(name.endswith(always)) for name in names}


def test_a_block_that_left_through_an_open_side_is_not_looked_for(tmp_path):
    assert written(tmp_path / "run", places=((1.0, 1.0, 0.5), (9.0, 1.0, 7.0))) == []


def rewritten(path, column, value):
    """The last row of a history with another value."""
    head = [line for line in path.read_text().splitlines() if line.startswith("#")]
    found = read_history(path)
    found.values[column][-1] = value
    rows = [
        ",".join(found.values),
        *(",".join(map(repr, map(float, row))) for row in zip(*found.values.values())),
    ]
    path.write_text("\n".join([*head, *rows]) + "\n")


def test_still_water_that_moves_or_pulls_is_seen(tmp_path):
    """A scene whose water stands still, with a kinetic energy and a pressure that it should not have."""
    still = next(n for n in range(200) if draw(SEED, n).still)
    file, _ = made(tmp_path, still, 0.05)
    out = tmp_path / "out"
    execute_case(file, RunDirectory.create(file, out))
    speed = [m for m in measures(out, still=True) if m.quantity == "speed of still water"]
    assert [m.kept for m in speed] == [True]
    assert [m for m in measures(out, still=True) if not m.kept] == []
    energy, water = out / "history" / "energy.csv", out / "history" / "water.csv"
    rewritten(energy, "water_kinetic", read_history(energy)["water_potential"][-1])
    rewritten(water, "lowest_pressure", -1.2e5)
    missed = [m.quantity for m in measures(out, still=True) if not m.kept]
    assert {"speed of still water", "pull over that of vapour"} <= set(missed)


# ---------------------------------------------------------------- failures made small


def test_a_failure_is_made_small():
    """A fault that takes two solids and viscosity, at 0.3 s: all else goes, and the run ends just after it."""
    table = {
        "case": {"title": "x"},
        "time": {"end": 2.0, "output_every": 0.1},
        "tank": {"cell": 1.0},
        "water": {"viscosity": 1.0, "walls": "slip", "fill": [{"a": 1}, {"a": 2}]},
        "solid": [{"name": "one", "size": 1}, {"name": "two"}, {"name": "three"}],
        "gauge": [{"kind": "level"}],
        "limits": {"cpu_seconds": 10},
    }
    before = copy.deepcopy(table)

    def fails_at(t):
        fault = len(t.get("solid", ())) >= 2 and "viscosity" in t.get("water", {}) and "tank" in t
        return 0.3 if fault and t["time"]["end"] > 0.3 else None

    small = shrunk(table, fails_at, 0.3)
    assert small["time"]["end"] == pytest.approx(0.306)
    assert small["water"] == {"viscosity": 1.0}
    assert small["tank"] == {}
    assert len(small["solid"]) == 2
    assert "gauge" not in small
    assert table == before


def test_a_failure_that_does_not_come_again_stays_as_it_was():
    table = {"case": {}, "time": {"end": 2.0}, "water": {"viscosity": 1.0}}
    assert shrunk(table, lambda t: None, 1.0) == table


def reported(text):
    return Trial("failed", text, [], 1.0, 1.0, 0.5)


def test_failures_are_the_same_whatever_their_numbers():
    first = reported("the water volume is off by -20.94% at t = 0.5772 s; limit 2.00% (limits.volume_error).")
    second = reported("the water volume is off by +3.1% at t = 1e-05 s; limit 2.00% (limits.volume_error).")
    assert first.kind == second.kind == "the water volume is off by at t"
    assert first.kind != reported("the energy balance is off by 19.80% of the input energy").kind


def test_a_scene_may_ask_too_much_of_its_joints_but_not_of_its_contact():
    with pytest.raises(Diverged) as error:
        check_overlap(1.0, Overlap("a", "'b'", 0.1, 0.2), 0.1)
    reported = str(error.value)
    assert asked_too_much(reported, {"contact": {"friction": 0.5}})
    assert not asked_too_much(reported, {"contact": {"stiffness": 1e6}})
    assert not asked_too_much("the energy balance is off by 6 %", {})


def test_one_pass_may_end_a_scene_of_blocks_lighter_than_the_water():
    """As `check` remarks beforehand; the message is that of the run."""
    said = f"off by 9.82%. Block 'b' missed 6e-06 J of the water's work in this step, {ONE_PASS};"
    heavy = {"structure": {"density": 2000.0, "block": [{"density": None}]}, "water": {}}
    assert not asked_too_much(said, heavy)
    assert asked_too_much(said, heavy | {"structure": {"density": 2000.0, "block": [{"density": 900.0}]}})
    assert asked_too_much(said, heavy | {"structure": {"density": 300.0, "block": []}})
    assert not asked_too_much(
        "the energy balance is off by 9.82%.", heavy | {"structure": {"density": 300.0}}
    )


def test_a_start_that_asks_too_much_counts_as_refused_whatever_the_exit_code(tmp_path, monkeypatch):
    """A structure that cannot stand ends a run with the code of a bad case; what else does must name file and key."""
    said = f"surgebreak: {trials.TOO_WEAK}: a joint opens beyond its opening at failure.\n"
    for code, stderr, verdict in (
        (ExitCode.BAD_CASE, said, "refused"),
        (ExitCode.BAD_CASE, "surgebreak: something else\n", "failed"),
    ):
        ended = subprocess.CompletedProcess([], code, "", stderr)
        monkeypatch.setattr(trials, "run_module", lambda *args, ended=ended, **more: ended)
        assert trials.trial(tmp_path, tmp_path / "out", False).verdict == verdict


def test_a_failure_is_kept_as_a_case_with_its_story(tmp_path, monkeypatch):
    """A run that fails as long as its scene has joints."""

    def run(case, output, still):
        joints = "joints" in tomllib.loads((case / "case.toml").read_text())
        found = [Measure("error of the volume", 0.5 if joints else 0.0, 0.02)]
        return Trial("failed" if joints else "passed", "", found, 1.0, 1.0, 1e-9)

    monkeypatch.setattr(command, "trial", run)
    drawn = next(d for d in (draw(SEED, n) for n in range(100)) if "joints" in d.table)
    found = command.outcome(drawn, tmp_path, seconds=100.0)
    small = tomllib.loads((tmp_path / drawn.id / "small" / "case.toml").read_text())
    assert found.verdict == "failed"
    assert str(tmp_path / drawn.id) in found.message
    assert (small["joints"], "contact" in small, "structure" in small) == ({}, False, False)
    assert "error of the volume 0.5, at most 0.02" in (tmp_path / drawn.id / "found.txt").read_text()
    (row,) = command.named([drawn.id])
    assert document(draw(*row).table) == document(drawn.table)


def test_random_scenes_are_named_in_a_call_of_their_own():
    assert command.are_drawn(["R1-12", "r2-3"])
    assert not command.are_drawn(["S01", "water"])
    assert not command.are_drawn([])
    with pytest.raises(BadCase, match="R1-12: a random scene, and S01 is none"):
        command.are_drawn(["S01", "R1-12"])


def test_scenes_of_a_group_keep_their_numbers():
    water = list(command.numbered(SEED, 3, 0, ["water"]))
    assert [draw(*row).group for row in water] == ["water"] * 3
    assert water == [row for row in command.numbered(SEED, 30, 0, []) if draw(*row).group == "water"][:3]
    with pytest.raises(BadCase, match="unknown group"):
        list(command.numbered(SEED, 1, 0, ["wind"]))
    with pytest.raises(BadCase, match="R<seed>-<number>"):
        list(command.named(["S01"]))


def test_the_list_names_scenes_without_running_them(tmp_path, capsys):
    asked = command.numbered(SEED, 2, 5, [])
    assert command.stress_drawn(asked, tmp_path, 0.0, as_json=False, only_list=True) == ExitCode.DONE
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == [f"R{SEED}-5", f"R{SEED}-6"]


def test_a_scene_that_computes_for_ever_is_ended_by_its_processor_time(monkeypatch, tmp_path):
    """Not by the clock: beside other programs a sound scene of ten seconds took five minutes, and counted as failed."""
    monkeypatch.setattr(trials, "CPU_SECONDS", 1)
    monkeypatch.setattr(trials, "run_module", lambda *_, **options: _for_ever(options))
    found = trials.trial(tmp_path / "case", tmp_path / "out", still=False)
    assert (found.verdict, found.message) == ("failed", "still computing after 1 s of processor time")


def _for_ever(options):
    return subprocess.run([sys.executable, "-c", "while True: pass"], check=False, **options)
