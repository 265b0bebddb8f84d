"""A run that goes on from a checkpoint leaves what it would have left without a stop; what does not fit is refused."""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from coupler import vtkhdf
from coupler.array_file import write_arrays
from coupler.case_file import load
from coupler.checkpoint import FOLDER, UNSET, Checkpoint, OtherScene, listed
from coupler.errors import BadCase, ExitCode, NoRun
from coupler.limits import LimitReached
from coupler.resume import CannotResume, prepare
from coupler.run import run
from coupler.run_directory import RunDirectory
from coupler.storage import NotFinite
from coupler.warm_up import Silent

COUPLED = """\
[case]
title = "a wave breaks a wall, with a block afloat"
[time]
end = "0.42 s"
step_max = "15 ms"
output_every = "60 ms"
checkpoint_every = "0.3 s"
[tank]
lower = [0, 0, 0]
upper = [3, 1, 1.5]
cell = 0.25
[water]
covers = "multiple"
[[water.fill]]
lower = [0, 0, 0]
upper = [1.2, 1, 1.2]
[structure]
[[structure.block]]
name = "floating"
centre = [0.5, 0.5, 1.1]
size = [0.3, 0.3, 0.3]
density = 500
[[structure.wall]]
name = "wall"
lower = [1.5, 0, 0]
size = [0.25, 1, 1.0]
block = [0.25, 0.5, 0.25]
density = 1500
[structure.ground]
[contact]
[joints]
strength = "15 kPa"
opening_at_failure = "4 mm"
[[gauge]]
kind = "level"
name = "level"
at = [0.5, 0.1]
[[gauge]]
kind = "force"
name = "wall"
on = "wall"
mean_over = "50 ms"
impulse = ["0.1 s", "0.4 s"]
[[gauge]]
kind = "loads"
name = "split"
on = "wall"
each_block = true
every = "70 ms"
mean_over = "50 ms"
"""

STREAM = """\
[case]
title = "a stream past a post into a sea"
[time]
end = "0.4 s"
step_max = "20 ms"
output_every = "0.1 s"
checkpoint_every = "0.25 s"
[tank]
lower = [0, 0, 0]
upper = [2, 1, 1]
cell = 0.2
[water]
viscosity = "1 Pa s"
walls = "friction"
roughness = "1 cm"
[[water.fill]]
lower = [0, 0, 0]
upper = [2, 1, 0.5]
[[water.inflow]]
kind = "bore"
side = "x-"
ahead = 0.5
level = 0.7
[[water.sea]]
side = "x+"
level = 0.5
[[solid]]
name = "post"
centre = [1.1, 0.5, 0.5]
size = [0.25, 0.3, 1]
[[gauge]]
kind = "pressure"
name = "front"
at = [0.9, 0.5, 0.1]
mean_over = "0.1 s"
"""

STUCK = """\
[case]
title = "a light block in a thick liquid"
[time]
end = "0.1 s"
step_max = "10 ms"
output_every = "50 ms"
checkpoint_every = "50 ms"
[tank]
lower = [0, 0, 0]
upper = [0.6, 0.6, 0.6]
cell = 0.1
[water]
viscosity = "50 Pa s"
walls = "no-slip"
[[water.fill]]
lower = [0, 0, 0]
upper = [0.6, 0.6, 0.5]
[structure]
[[structure.block]]
name = "light"
centre = [0.3, 0.3, 0.25]
size = [0.2, 0.2, 0.2]
density = 600
[contact]
stiffness = "1 MN/m"
"""

DRY = """\
[case]
title = "a shot breaks a column"
[time]
end = "0.1 s"
step_max = "5 ms"
output_every = "10 ms"
checkpoint_every = "40 ms"
[structure]
[[structure.column]]
name = "column"
foot = [0.5, 0.5, 0]
height = 3
drums = 3
size = [1, 1]
[[structure.block]]
name = "shot"
centre = [-1, 0.5, 1.6]
size = [0.5, 0.5, 0.5]
velocity = [12, 0, 0]
[structure.ground]
[contact]
[joints]
strength = "0.2 MPa"
opening_at_failure = "2 mm"
"""


def directory_of(tmp_path, text):
    tmp_path.mkdir(exist_ok=True)
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    return tmp_path


def begin(place, text, output, *overrides, reporter=None):
    """A whole run in this process; its directory."""
    file = load(directory_of(place, text), overrides)
    with RunDirectory.create(file, output) as directory:
        run(file.case, directory, reporter or Silent())
    return directory.path


def go_on(path, *overrides, told=None, any_version=True):
    """Resume in this process. any_version: a commit between the two runs of a test does not matter."""
    found = prepare(path, overrides, any_version, (told if told is not None else []).append)
    with found.directory:
        run(found.file.case, found.directory, Silent(), found.checkpoint)
    return found


@pytest.fixture(scope="module")
def dry(tmp_path_factory):
    """A finished run with checkpoints at its end and at 80 ms."""
    place = tmp_path_factory.mktemp("dry")
    return begin(place / "case", DRY, place / "run")


@pytest.fixture
def copy(dry, tmp_path):
    return shutil.copytree(dry, tmp_path / "run")


@pytest.fixture
def stopped(copy):
    """As if it had been killed shortly before its end: the files go further than the checkpoint."""
    listed(copy / FOLDER)[0].unlink()
    return copy


def check_same(one, two):
    """Histories byte for byte, fields value for value, and everything that the last checkpoints hold."""
    tables = [p.relative_to(one) for p in (*one.glob("history/*.csv"), *one.glob("cracks.csv"))]
    assert len(tables) > 1
    for table in tables:
        assert (one / table).read_bytes() == (two / table).read_bytes(), table
    for name in ("fields.vtkhdf", "blocks.vtkhdf"):
        if (one / name).exists():
            check_same_steps(one / name, two / name)
    a, b = (Checkpoint.read(listed(place / FOLDER)[0]) for place in (one, two))
    assert a.path.name == b.path.name
    assert set(a.arrays) == set(b.arrays)
    for name in a.arrays:
        np.testing.assert_array_equal(a.arrays[name], b.arrays[name], err_msg=name, strict=True)
    figures = [
        json.loads((place / "run.json").read_text(encoding="utf-8"))["figures"] for place in (one, two)
    ]
    for found in figures:
        del found["cpu_seconds"]
        del found["imports"]  # of the process: the first one here has those of other tests
    assert figures[0] == figures[1]


def check_same_steps(one, two):
    times = vtkhdf.read_times(one)
    np.testing.assert_array_equal(vtkhdf.read_times(two), times)
    for k in range(len(times)):
        (points, *data), (others, *other_data) = vtkhdf.read_step(one, k), vtkhdf.read_step(two, k)
        np.testing.assert_array_equal(points, others)
        for fields, other_fields in zip(data, other_data):
            assert set(fields) == set(other_fields)
            for name, field in fields.items():
                np.testing.assert_array_equal(field, other_fields[name], err_msg=f"{name} of step {k}")


def command(*words, check=True):
    done = subprocess.run(
        [sys.executable, "-m", "coupler.cli", *map(str, words)], capture_output=True, text=True, check=False
    )
    assert not check or done.returncode == 0, done.stderr
    return done


def test_a_coupled_run_goes_on_in_a_new_process_bit_for_bit(tmp_path):
    """A wall half broken, joints half open, a block afloat and water on both sides of the wall at the checkpoint; the
    files go further than it, as after a kill."""
    whole = begin(tmp_path / "case", COUPLED, tmp_path / "whole")
    part = shutil.copytree(whole, tmp_path / "part")
    listed(part / FOLDER)[0].unlink()
    (checkpoint,) = listed(part / FOLDER)
    joints = Checkpoint.read(checkpoint).part("structure")
    assert 0 < joints["joints/alive"].sum() < len(joints["joints/alive"])
    assert (joints["joints/largest"] > 1e-4).any()
    assert len(joints["contacts/a"]) > 0
    done = command("resume", part, "--any-version")
    assert f"going on from {checkpoint}, t = 0.3 s" in done.stdout
    check_same(whole, part)


def test_water_alone_goes_on_bit_for_bit(tmp_path):
    """With what came in and left, viscosity, rough walls, a solid, and a gauge that remembers."""
    whole = begin(tmp_path / "case", STREAM, tmp_path / "whole")
    part = shutil.copytree(whole, tmp_path / "part")
    listed(part / FOLDER)[0].unlink()
    assert float(go_on(part).checkpoint.part("water")["entered"]) > 0.0
    check_same(whole, part)


def test_a_block_that_water_sticks_to_goes_on_bit_for_bit(tmp_path):
    """What moved it apart from shear, in the last two steps, belongs to the state."""
    whole = begin(tmp_path / "case", STUCK, tmp_path / "whole")
    part = shutil.copytree(whole, tmp_path / "part")
    listed(part / FOLDER)[0].unlink()
    (checkpoint,) = listed(part / FOLDER)
    assert np.abs(Checkpoint.read(checkpoint).part("coupling")["sheared"]).max() > 0.1
    assert command("resume", part, "--any-version").returncode == 0
    check_same(whole, part)


def test_a_dry_run_goes_on_bit_for_bit(dry, stopped):
    told = []
    found = go_on(stopped, told=told)
    assert found.checkpoint.time == pytest.approx(0.08)
    check_same(dry, stopped)
    summary = json.loads((stopped / "run.json").read_text(encoding="utf-8"))
    assert summary["status"] == "done"
    assert [again["from"] for again in summary["resumed"]] == [found.checkpoint.path.name]
    assert "reached the end" in (stopped / "log.txt").read_text(encoding="utf-8")


class StopAt(Silent):
    """A user who wants the run to stop at a time."""

    def __init__(self, time):
        self.time, self.now = time, 0.0

    def step(self, time, figures):
        self.now = time

    def stop_requested(self):
        return "stopped by the test" if self.now >= self.time * (1 - 1e-9) else None


@pytest.mark.parametrize("when", [0.015, 0.03, 0.08])
def test_a_clean_stop_leaves_a_checkpoint_of_the_very_step(dry, tmp_path, when):
    """Between outputs, at an output, and at a checkpoint; processor time of both processes is added."""
    output = tmp_path / "run"
    with pytest.raises(LimitReached, match=f"`surgebreak resume {output}` goes on"):
        begin(tmp_path / "case", DRY, output, reporter=StopAt(when))
    before = json.loads((output / "run.json").read_text(encoding="utf-8"))
    assert (before["status"], before["exit_code"]) == ("stopped", ExitCode.STOPPED)
    assert go_on(output).checkpoint.time == pytest.approx(when)
    check_same(dry, output)
    after = json.loads((output / "run.json").read_text(encoding="utf-8"))
    assert after["cpu_seconds"] > before["cpu_seconds"]
    assert after["figures"]["cpu_seconds"]["structure"] > before["figures"]["cpu_seconds"]["structure"]


def test_a_file_named_stop_is_served_once(stopped):
    """It ended the run; going on takes it away, or the run would end at once again."""
    (stopped / "stop").touch()
    half = stopped / FOLDER / ".00000003.h5.part"
    half.write_bytes(b"what a killed writer left")
    go_on(stopped)
    assert not (stopped / "stop").exists()
    assert not half.exists()


def test_a_run_goes_on_past_its_end(dry, tmp_path):
    """Run to 0.06 s and on to 0.1 s: the same as to 0.1 s at once, for the interval of outputs is the case's own."""
    path = begin(tmp_path / "case", DRY, tmp_path / "run", "time.end='60 ms'")
    told = []
    with pytest.raises(
        CannotResume, match=r"has reached t = 0.06 s, its end is 0.06 s; give a later one with --end"
    ):
        prepare(path, tell=told.append)
    found = go_on(path, "time.end='0.1 s'", told=told)
    assert found.checkpoint.time == pytest.approx(0.06)
    check_same(dry, path)
    assert json.loads((path / "effective.json").read_text(encoding="utf-8"))["time"]["end"] == 0.1


def test_two_checkpoints_stay(dry):
    assert [Checkpoint.read(path).time for path in listed(dry / FOLDER)] == pytest.approx([0.1, 0.08])


def damage_tear(path):
    path.write_bytes(path.read_bytes()[:-2000])


def damage_byte(path):
    """One bit of one number."""
    whole = bytearray(path.read_bytes())
    spot = whole.find(Checkpoint.read(path).arrays["structure/time"].tobytes())
    assert spot > 0
    whole[spot] ^= 1
    path.write_bytes(whole)


def damage_empty(path):
    path.write_bytes(b"")


@pytest.mark.parametrize("damage", [damage_tear, damage_byte, damage_empty])
def test_a_damaged_checkpoint_is_told_and_the_older_one_taken(dry, copy, damage):
    newest, older = listed(copy / FOLDER)
    damage(newest)
    told = []
    assert go_on(copy, told=told).checkpoint.path == older
    assert any(line.startswith("note: ") and newest.name in line and "left out" in line for line in told)
    check_same(dry, copy)


def test_a_history_that_ends_before_the_checkpoint_sends_back_to_the_older_one(dry, copy):
    """A machine that lost power may have lost the last rows, though the checkpoint was forced to the disk."""
    table = copy / "history" / "energy.csv"
    table.write_bytes(table.read_bytes()[:-10])
    told = []
    assert go_on(copy, told=told).checkpoint.time == pytest.approx(0.08)
    assert any("energy.csv ends before it" in line for line in told)
    check_same(dry, copy)


def test_without_any_usable_checkpoint_nothing_is_touched(copy):
    for path in listed(copy / FOLDER):
        damage_tear(path)
    before = (copy / "run.json").read_bytes()
    with pytest.raises(CannotResume, match=r"no checkpoint can be used:\n.*\n.*\nRun the case again"):
        prepare(copy)
    assert (copy / "run.json").read_bytes() == before
    shutil.rmtree(copy / FOLDER)
    with pytest.raises(CannotResume, match="no checkpoint to go on from"):
        prepare(copy)


def test_what_is_no_run_is_told(tmp_path):
    with pytest.raises(NoRun, match="not the directory of a run"):
        prepare(tmp_path)


def test_another_case_is_refused_with_the_difference(stopped):
    case = stopped / "case.toml"
    text = case.read_text(encoding="utf-8").replace('"2 mm"', '"3 mm"').replace("[12, 0, 0]", "[12, 0, 1]")
    case.write_text(text, encoding="utf-8")
    with pytest.raises(
        CannotResume,
        match=r"block\[0\]\.velocity\[2\]: was 0\.0, is 1\.0; joints\.opening_at_failure: was 0\.002, is 0\.003",
    ):
        prepare(stopped, any_version=True)


def test_only_what_leaves_the_scene_alone_may_be_set(stopped):
    with pytest.raises(
        CannotResume, match=r"--set contact.friction=0.1: .*only time.end, .*limits.\* may change"
    ):
        prepare(stopped, ["contact.friction=0.1"])
    with pytest.raises(BadCase, match=r"limits\.defect: -1 is out of range"):
        prepare(stopped, ["limits.defect=-1"])
    assert go_on(stopped, "limits.energy_error=0.5").file.case.limits.energy_error == 0.5


def rewritten(path, **about):
    """The same checkpoint with something else in what it belongs to."""
    found = Checkpoint.read(path)
    write_arrays(path, found.arrays, json.dumps(found.about | about), UNSET)
    return found.about


def test_another_program_is_refused_with_the_difference(stopped):
    """Unless the user says that it does not matter."""
    (path,) = listed(stopped / FOLDER)
    program = Checkpoint.read(path).about["program"]
    rewritten(path, program=program | {"surgebreak": "0.0.1", "commit": "abc"})
    with pytest.raises(CannotResume, match=r"surgebreak: was 0\.0\.1, is .*commit: was abc.*--any-version"):
        prepare(stopped)
    told = []
    go_on(stopped, told=told, any_version=True)
    assert any("written by another program: surgebreak: was 0.0.1" in line for line in told)


def test_another_layout_is_refused(stopped):
    rewritten(listed(stopped / FOLDER)[0], layout=99)
    with pytest.raises(CannotResume, match="written in layout 99, this program reads 2"):
        prepare(stopped)


def test_another_scene_is_refused_before_any_file_is_touched(stopped):
    """A file of blocks may have changed although the case that names it has not."""
    (path,) = listed(stopped / FOLDER)
    scene = Checkpoint.read(path).about["scene"]
    rewritten(path, scene=scene | {"blocks": "5 blocks (01234567)"})
    table = (stopped / "history" / "energy.csv").read_bytes()
    with pytest.raises(OtherScene, match=r"blocks: was 5 blocks \(01234567\), is 4 blocks"):
        go_on(stopped)
    assert (stopped / "history" / "energy.csv").read_bytes() == table


def test_a_run_that_still_runs_is_left_alone(stopped):
    """Its process is there and is ours; a number that went to another program since does not count."""
    for words, refused in (("surgebreak", True), ("something else", False)):
        other = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(60)", words])
        try:
            summary = json.loads((stopped / "run.json").read_text(encoding="utf-8"))
            summary |= {"status": "running", "process": other.pid}
            (stopped / "run.json").write_text(json.dumps(summary), encoding="utf-8")
            until = time.monotonic() + 10
            while words.encode() not in Path(f"/proc/{other.pid}/cmdline").read_bytes():
                assert time.monotonic() < until
            if refused:
                with pytest.raises(CannotResume, match=f"still running \\(process {other.pid}\\)"):
                    prepare(stopped)
            else:
                prepare(stopped, any_version=True, tell=[].append)
        finally:
            other.kill()
            other.wait()


def test_a_state_that_is_not_finite_is_never_saved(tmp_path, monkeypatch):
    """The run ends with the name of the array; the checkpoint before stays."""
    from coupler.loop import Coupling

    honest = Coupling.save

    def spoilt(self):
        found = honest(self)
        return found if self.time < 0.06 else found | {"defects": np.array([np.nan])}

    monkeypatch.setattr(Coupling, "save", spoilt)
    with pytest.raises(NotFinite, match="coupling/defects"):
        begin(tmp_path / "case", DRY, tmp_path / "run")
    assert [Checkpoint.read(path).time for path in listed(tmp_path / "run" / FOLDER)] == pytest.approx([0.04])


NOTHING_LOADED = """
import sys
from pathlib import Path
from coupler.case_file import load
from coupler.run import run
from coupler.run_directory import RunDirectory
from coupler.warm_up import Silent
file = load(sys.argv[1], ["time.checkpoint_every=0", "time.end='10 ms'"])
with RunDirectory.create(file, Path(sys.argv[2])) as directory:
    run(file.case, directory, Silent())
print([name for name in ("coupler.checkpoint", "coupler.array_file", "fluid.state") if name in sys.modules])
"""


def test_a_run_without_checkpoints_loads_and_leaves_nothing_of_them(tmp_path):
    case = directory_of(tmp_path / "case", DRY)
    done = subprocess.run(
        [sys.executable, "-c", NOTHING_LOADED, case, tmp_path / "run"],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ,
    )
    assert done.stdout.strip().endswith("[]")
    assert not (tmp_path / "run" / FOLDER).exists()


def test_the_command_tells_what_is_wrong_and_leaves_with_two(dry):
    done = command("resume", dry, check=False)
    assert done.returncode == ExitCode.BAD_CASE
    assert "give a later one with --end to go on" in done.stderr or "another program" in done.stderr
    assert "Traceback" not in done.stderr
