"""A run that goes on from a checkpoint leaves what it would have left without a stop."""

import hashlib
import json
import shutil

import numpy as np
import pytest

from coupler.commands.warm_up import Silent
from coupler.program.errors import ExitCode
from coupler.results import vtkhdf
from coupler.results.history import read_history
from coupler.run.checkpoint import FOLDER, LAYOUT, Checkpoint, listed
from coupler.run.resume import CannotResume, prepare
from coupler.step.limits import LimitReached
from tests.coupler.resumed import DRY, begin, check_same, command, go_on

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

ABSORBED = """\
[case]
title = "a crate adrift before a side that absorbs"
[time]
end = "0.4 s"
step_max = "20 ms"
output_every = "0.1 s"
checkpoint_every = "0.2 s"
[tank]
lower = [0, 0, 0]
upper = [2, 1, 1]
cell = 0.2
open = ["z+"]
[[water.fill]]
lower = [0, 0, 0]
upper = [2, 1, 0.5]
[[water.inflow]]
kind = "record"
side = "x-"
path = "wave.csv"
absorbs = true
[[structure.block]]
name = "crate"
centre = [0.5, 0.5, 0.5]
size = [0.3, 0.3, 0.3]
density = 500
[contact]
stiffness = "1 MN/m"
"""


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
    check_layout(Checkpoint.read(checkpoint).arrays)


def check_layout(arrays):
    """Kernels do not check bounds: with --any-version, joints whose history had two columns would have been read as if
    it had four. So arrays whose names, kinds or columns change need another LAYOUT, and its digest here."""
    laid_out = sorted((name, a.dtype.kind, a.shape[1:]) for name, a in arrays.items())
    digest = hashlib.sha256(repr(laid_out).encode()).hexdigest()[:16]
    assert {LAYOUT: digest} == {10: "16d5b1d5331e6602"}, laid_out


def test_water_alone_goes_on_bit_for_bit(tmp_path):
    """With what came in and left, viscosity, rough walls, a solid, and a gauge that remembers."""
    whole = begin(tmp_path / "case", STREAM, tmp_path / "whole")
    part = shutil.copytree(whole, tmp_path / "part")
    listed(part / FOLDER)[0].unlink()
    assert float(go_on(part).checkpoint.part("water")["entered"]) > 0.0
    check_same(whole, part)


def test_a_body_beside_a_side_that_absorbs_goes_on_bit_for_bit(tmp_path):
    """Values at the side are held where bodies move, before the side takes what returns anew: what it took last belongs
    to the state."""
    case = tmp_path / "case"
    case.mkdir()
    (case / "wave.csv").write_text("time,level,velocity\n0,0.5,0\n0.2,0.6,0.4\n1,0.6,0.4\n")
    whole = begin(case, ABSORBED, tmp_path / "whole")
    part = shutil.copytree(whole, tmp_path / "part")
    listed(part / FOLDER)[0].unlink()
    (checkpoint,) = listed(part / FOLDER)
    assert np.abs(Checkpoint.read(checkpoint).part("water")["absorbed"]).max() > 1e-3
    go_on(part)
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
    reported = []
    found = go_on(stopped, reported=reported)
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
    reported = []
    with pytest.raises(
        CannotResume, match=r"has reached t = 0.06 s, its end is 0.06 s; give a later one with --end"
    ):
        prepare(path, tell=reported.append)
    found = go_on(path, "time.end='0.1 s'", reported=reported)
    assert found.checkpoint.time == pytest.approx(0.06)
    check_same(dry, path)
    assert json.loads((path / "effective.json").read_text(encoding="utf-8"))["time"]["end"] == 0.1


def test_another_interval_of_outputs_counts_from_the_checkpoint_on(dry, stopped):
    """Outputs at 10 ms until 80 ms, then at the multiples of 7 ms and at the end; a second continuation, without a
    change, keeps the interval that the first one set."""
    go_on(stopped, "time.output_every='7 ms'")
    times = vtkhdf.read_times(stopped / "blocks.vtkhdf")
    np.testing.assert_allclose(times, [*(0.01 * k for k in range(9)), 0.084, 0.091, 0.098, 0.1])
    rows = read_history(stopped / "history" / "structure.csv")["joints_broken"]
    assert rows[-1] == read_history(dry / "history" / "structure.csv")["joints_broken"][-1]
    go_on(stopped, "time.end='0.11 s'")
    np.testing.assert_allclose(vtkhdf.read_times(stopped / "blocks.vtkhdf")[-2:], [0.105, 0.11])


SLEEPS = """\
[[structure.column]]
name = "far"
foot = [6.5, 0.5, 0]
height = 2
drums = 2
size = [1, 1]
[structure.sleep]
"""


def test_a_run_in_which_one_column_sleeps_and_another_breaks_goes_on_bit_for_bit(tmp_path):
    whole = begin(tmp_path / "case", DRY + SLEEPS, tmp_path / "whole")
    stopped = tmp_path / "stopped"
    with pytest.raises(LimitReached):
        begin(tmp_path / "case", DRY + SLEEPS, stopped, reporter=StopAt(0.03))
    go_on(stopped)
    check_same(whole, stopped)
    summary = json.loads((whole / "run.json").read_text(encoding="utf-8"))
    assert summary["figures"]["sleep"]["asleep"] == 2
