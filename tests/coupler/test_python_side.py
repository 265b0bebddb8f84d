"""`import surgebreak`: a case run by a script is what the command makes of it, and what is read back is what ran."""

import ast
import importlib
import shutil
import subprocess
import sys

import numpy as np
import pytest

import surgebreak
from coupler.case.first_cases import text_of
from coupler.program.errors import UnknownName
from coupler.program.provenance import ROOT
from coupler.results.history import read_history

DRY = {
    "case": {"title": "a block pulled off another"},
    "time": {"end": "40 ms", "step_max": "4 ms", "output_every": "20 ms"},
    "structure": {
        "ground": {},
        "block": [
            {"name": "lower", "size": [1, 1, 1], "centre": [0, 0, 0.5]},
            {"name": "upper", "size": [1, 1, 1], "centre": [0, 0, 1.5]},
        ],
        "start": "sudden",
    },
    "contact": {"stiffness": "1 GN/m"},
    "joints": {"strength": "0.1 MPa", "opening_at_failure": "1 mm"},
    "motion": [{"block": "upper", "velocity": [0, 0, "10 cm/s"]}],
}


def dry():
    return surgebreak.Case(DRY)


# ---- changing a case


@pytest.mark.parametrize(
    ("key", "value", "reported"),
    [
        ("joints.strenght", 1, r"joints\.strenght: unknown name; did you mean 'strength'\?"),
        ("joints.strength", "1 mm", r"joints\.strength: '1 mm' is a length, needs a pressure"),
        ("contact.restitution", 2, r"2 is out of range; must be at most 1"),
        ("structure.block[7].name", "x", r"there is no item \[7\]; the list has 2"),
        (
            "tank",
            {"lower": [0, 0, 0], "uper": [1, 1, 1]},
            r"tank\.uper: unknown name; did you mean 'upper'\?",
        ),
        ("time[+]", 1, r"\[\+\] adds to a list"),
        (
            "gaugee[+]",
            {"kind": "level"},
            r"^--set gaugee\[\+\]=.*: gaugee: unknown name; did you mean 'gauge'\?",
        ),
        ("tankk.cell", 1, r"^--set tankk.cell=1: tankk: unknown name; did you mean 'tank'\?"),
    ],
)
def test_a_wrong_change_is_refused_at_once_and_changes_nothing(key, value, reported):
    """The words are those of the case file, and the case stays what it was."""
    case = dry()
    before = case.effective
    with pytest.raises(surgebreak.BadCase, match=reported):
        case.set(key, value)
    assert case.changes == ()
    assert case.effective == before


def test_values_of_python_arrive_as_if_they_were_written_in_the_file():
    case = dry()
    case["structure.block[0].centre"] = np.array([0.0, 0.25, 0.5])
    case["structure.block[0].density"] = np.float64(900)
    case.set("case.description", 'quotes " and \\ and\nlines').set("structure.ground", None)
    case.add("gauge", kind="motion", name="watch", of="lower")
    found = case.effective
    assert found["structure"]["block"][0]["centre"] == [0.0, 0.25, 0.5]
    assert found["structure"]["block"][0]["density"] == 900.0
    assert found["case"]["description"] == 'quotes " and \\ and\nlines'
    assert "ground" not in found["structure"]
    assert found["gauge"][0]["name"] == "watch"
    assert case["gauge[0].of"] == "lower"
    assert "structure.ground" not in case
    with pytest.raises(TypeError, match="no object"):
        case.set("time.end", object())


def test_a_copy_is_changed_apart():
    case = dry()
    other = case.copy().set("time.end", "1 s")
    assert other["time.end"] == "1 s"
    assert case["time.end"] == "40 ms"


def test_what_is_saved_is_read_back_as_the_same_case(tmp_path):
    case = dry().set("joints.law", "bilinear").add("gauge", kind="motion", name="watch", of="lower")
    case.save(tmp_path / "case")
    assert surgebreak.load(tmp_path / "case").effective == case.effective
    with pytest.raises(surgebreak.SurgebreakError, match="exists and is left as it is"):
        case.save(tmp_path / "case")


def test_mistakes_of_a_loaded_case_have_the_lines_of_its_file(tmp_path):
    (tmp_path / "case.toml").write_text(text_of("tank"), encoding="utf-8")
    case = surgebreak.load(tmp_path).set("structure.block[0].centre", [9.0, 0.5, 0.2])
    with pytest.raises(surgebreak.BadCase, match=r"structure\.block"):
        case.file()
    (tmp_path / "case.toml").write_text(text_of("tank").replace("density", "densty"), encoding="utf-8")
    with pytest.raises(surgebreak.BadCase, match=r"case\.toml:\d+: structure\.densty"):
        surgebreak.load(tmp_path)


# ---- running it


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    seen = []
    place = tmp_path_factory.mktemp("python") / "run"
    return dry().run(place, callback=seen.append), seen


def test_a_run_of_a_script_is_that_of_the_command_to_the_last_digit(ran, tmp_path):
    """The command runs in a process of its own; here other runs of this process may have gone before."""
    run, _ = ran
    dry().save(tmp_path / "case")
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "coupler.commands.cli",
            "run",
            tmp_path / "case",
            "--output",
            tmp_path / "run",
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for name in run.histories:
        assert (run.directory / "history" / f"{name}.csv").read_bytes() == (
            tmp_path / "run" / "history" / f"{name}.csv"
        ).read_bytes()


def test_the_callback_sees_what_the_histories_keep(ran):
    run, seen = ran
    times = run.history("structure")["time"]
    assert [step.time for step in seen] == list(times)
    assert [step.number for step in seen] == list(range(1, len(times) + 1))
    assert [step.dt for step in seen] == pytest.approx(np.diff(times, prepend=0.0), rel=1e-12)
    assert [step.joints_broken for step in seen][-1] == run.figures["joints_broken"] > 0
    assert sum(step.substeps for step in seen) == run.figures["substeps"]


def test_the_tables_of_blocks_and_cracks_are_read_as_histories_are(ran, tmp_path):
    run, _ = ran
    assert list(run.history("blocks")["name"]) == list(run.blocks().names)
    assert len(run.history("cracks")["joint"]) == len(run.cracks["joint"]) == run.figures["joints"]
    with pytest.raises(
        UnknownName, match=r"no such table; did you mean 'blocks'\? It has angular_momentum, "
    ):
        run.history("block")
    with pytest.raises(UnknownName, match=r"no such table\. It has "):
        run.history("buildings")
    bare = shutil.copytree(run.directory, tmp_path / "bare")
    (bare / "cracks.csv").unlink()
    with pytest.raises(UnknownName, match=r"it has no joints"):
        _ = surgebreak.open(bare).cracks


def test_a_second_run_in_a_process_gives_the_same_bytes(ran, tmp_path):
    """YADE keeps a scene for the process; nothing of the first run may be left in the second."""
    run, _ = ran
    again = dry().run(tmp_path / "again")
    for name in run.histories:
        assert (again.directory / "history" / f"{name}.csv").read_bytes() == (
            run.directory / "history" / f"{name}.csv"
        ).read_bytes()


def test_a_run_within_a_run_is_refused(tmp_path):
    reported = []

    def inner(step):
        with pytest.raises(surgebreak.RunInRun, match="one scene a process"):
            dry().run(tmp_path / "inner")
        reported.append(step.number)

    dry().set("time.end", "4 ms").run(tmp_path / "outer", callback=inner)
    assert reported == [1]
    assert not (tmp_path / "inner").exists()
    dry().check()  # and after it, all is free again


def test_a_script_stops_a_run_and_goes_on_to_the_last_digit(ran, tmp_path):
    run, _ = ran
    stopped = (
        dry()
        .set("time.checkpoint_every", 0.001)
        .run(tmp_path / "run", stop=lambda step: step.number == 4 and "seen enough")
    )
    assert stopped.status == "stopped"
    assert "seen enough" in stopped.reason
    assert stopped.figures["steps"] == 4
    on = stopped.resume()
    assert on.status == "done"
    assert (on.history("energy")["energy_error"] == run.history("energy")["energy_error"]).all()


def test_what_a_callback_raises_ends_the_run_and_is_kept(tmp_path):
    def wrong(step):
        raise ZeroDivisionError("mine")

    with pytest.raises(ZeroDivisionError, match="mine"):
        dry().run(tmp_path / "run", callback=wrong)
    assert surgebreak.open(tmp_path / "run").status == "crashed"


def test_a_limit_of_the_case_raises(tmp_path):
    with pytest.raises(surgebreak.LimitReached, match=r"limits\.cpu_seconds"):
        dry().set("limits.cpu_seconds", 1e-6).run(tmp_path / "run")


def test_the_verdict_of_a_run_that_ends_early_says_until_when(ran, tmp_path):
    """A structure stands at the start of any run: without the time, that reads like the answer."""
    run = dry().run(tmp_path / "run", stop=lambda step: step.number == 2)
    (doubt,) = run.summary["figures"]["doubts"]
    assert doubt.startswith("the run ended early, at t = 8 ms of ")
    whole, _ = ran
    assert not whole.summary["figures"]["doubts"]


# ---- reading a run


def test_blocks_are_where_the_callback_saw_them(ran):
    run, seen = ran
    last, state = seen[-1].blocks, run.blocks()
    assert state.names == last.names == ["lower", "upper"]
    assert state.time == run.times[-1]
    for k, name in enumerate(state.names):
        assert state.corners(name).mean(axis=0) == pytest.approx(last.centre[k], abs=1e-6)
        assert len(state.corners(k)) == 8
    assert state.damage == pytest.approx(last.damage)
    with pytest.raises(surgebreak.SurgebreakError, match="did you mean 'lower'"):
        state.corners("lowr")


def test_tables_are_numpy_and_pandas(ran):
    run, _ = ran
    table, frame = run.history("energy"), run.frame("energy")
    assert list(frame.columns) == [column.name for column in table.columns]
    assert (frame["blocks_kinetic"].to_numpy() == table["blocks_kinetic"]).all()
    assert frame.attrs["units"]["blocks_kinetic"] == "J"
    assert (run.cracks["intact"] == run.cracks_frame()["intact"]).all()
    with pytest.raises(surgebreak.SurgebreakError, match="did you mean 'energy'"):
        run.history("enrgy")
    with pytest.raises(surgebreak.SurgebreakError, match="the case has no water"):
        run.water()


WATER = """
import surgebreak, numpy as np
case = surgebreak.Case({"case": {"title": "still"}, "time": {"end": "20 ms"},
    "tank": {"lower": [5, 0, 0], "upper": [7, 1, 1], "cell": 0.25},
    "water": {"fill": [{"lower": [5, 0, 0], "upper": [7, 1, 0.75]}]}})
run = case.run("run")
state = run.water(0.0)
mesh = state.mesh()
assert mesh.n_cells == len(state.cells) and np.allclose(mesh.bounds, (5, 7, 0, 1, 0, 1)), mesh.bounds
assert abs(mesh.volume - 2.0) < 1e-9
last = run.water()
depth = 0.75 - last.nodes[:, 2]
wet = depth > 0.1
assert np.allclose(last.pressure[wet], 1000 * 9.81 * depth[wet], rtol=1e-3), last.pressure[wet]
import sys
assert not any(name.split(".")[0] in ("yade", "yade_scripts") for name in sys.modules), "YADE for water alone"
"""


def test_water_read_back_is_hydrostatic_and_has_a_mesh_for_pyvista(tmp_path):
    """In a process of its own: VTK is refused where YADE is."""
    done = subprocess.run(
        [sys.executable, "-c", WATER], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_vtk_is_refused_beside_yade_with_a_way_out(ran):
    with pytest.raises(ImportError, match="process of their own"):
        ran[0].blocks().mesh()


def test_type_checkers_find_the_same_names():
    """They read the stubs, since a single module that is installed has no place for `py.typed`. Each name there has to
    stand for the object that a script gets."""
    stubs = ast.parse((ROOT / "surgebreak-stubs" / "__init__.pyi").read_text(encoding="utf-8"))
    imported = [node for node in stubs.body if isinstance(node, ast.ImportFrom)]
    assigned = {node.targets[0].id: node.value for node in stubs.body if isinstance(node, ast.Assign)}
    names = {name.asname or name.name for node in imported for name in node.names}
    assert sorted(names | {"load", "open"}) == sorted(surgebreak.__all__)
    assert ast.literal_eval(assigned.pop("__all__")) == surgebreak.__all__
    assert {name: ast.unparse(value) for name, value in assigned.items()} == {
        "load": "Case.load",
        "open": "Run",
    }
    for node in imported:
        for name in node.names:
            package = importlib.import_module(node.module)
            there = getattr(package, name.name, None) or importlib.import_module(f"{node.module}.{name.name}")
            assert getattr(surgebreak, name.asname or name.name) is there


def test_every_public_name_is_there_and_says_what_it_is():
    for name in surgebreak.__all__:
        assert getattr(surgebreak, name).__doc__, name
    assert surgebreak.__version__
    assert (ROOT / "surgebreak.py").is_file()


def test_the_table_of_a_run_is_that_of_the_file(ran):
    run, _ = ran
    assert (run.history("coupling")["dt"] == read_history(run.directory / "history/coupling.csv")["dt"]).all()
