"""What does not fit a run is refused before anything of it is touched, and the difference is named."""

import json
import subprocess
import sys
import time
from pathlib import Path

import pytest

from coupler.program.errors import BadCase, ExitCode, NoRun
from coupler.run.array_file import write_arrays
from coupler.run.checkpoint import FOLDER, LAYOUT, UNSET, Checkpoint, OtherScene, listed
from coupler.run.resume import CannotResume, prepare
from tests.coupler.resumed import begin, command, go_on

INFLOW = """\
[case]
title = "a record drives the water"
[time]
end = "0.04 s"
step_max = "10 ms"
output_every = "20 ms"
checkpoint_every = "20 ms"
[tank]
lower = [0, 0, 0]
upper = [1, 0.2, 0.8]
cell = 0.1
[water]
[[water.fill]]
lower = [0, 0, 0]
upper = [1, 0.2, 0.5]
[[water.inflow]]
kind = "record"
side = "x-"
path = "wave.csv"
"""


def test_what_is_no_run_is_reported(tmp_path):
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
    for change, why in (
        ("contact.friction=0.1", "first part was computed with another value"),
        ("verdict.moved=0.2", "followed its blocks by this rule"),
        ("sweep.seed=3", "does not read"),
    ):
        with pytest.raises(CannotResume, match=rf"--set {change}: .*{why}.*: time\.\*, .*limits\.\*"):
            prepare(stopped, [change])
    with pytest.raises(BadCase, match=r"output_evry.*did you mean 'output_every'"):
        prepare(stopped, ["time.output_evry=0.1"])
    with pytest.raises(BadCase, match=r"limits\.defect: -1 is out of range"):
        prepare(stopped, ["limits.defect=-1"])
    assert go_on(stopped, "limits.energy_error=0.5").file.case.limits.energy_error == 0.5


def test_a_file_that_the_case_names_and_that_changed_is_refused(tmp_path):
    """A record of an inflow has no part in the mesh or the blocks. It could change between the two parts of a run."""
    wave = tmp_path / "case" / "wave.csv"
    wave.parent.mkdir()
    wave.write_text("time,level,velocity\n0,0.5,0\n1,0.52,0.05\n", encoding="utf-8")
    run = begin(tmp_path / "case", INFLOW, tmp_path / "run")
    go_on(run, "time.end=0.05")
    wave.write_text("time,level,velocity\n0,0.5,0\n1,0.62,0.05\n", encoding="utf-8")
    with pytest.raises(CannotResume, match=r"have changed since the run began: .*wave\.csv: was \w+, is \w+"):
        prepare(run, any_version=True)


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
    reported = []
    go_on(stopped, reported=reported, any_version=True)
    assert any("written by another program: surgebreak: was 0.0.1" in line for line in reported)


def test_another_layout_is_refused(stopped):
    rewritten(listed(stopped / FOLDER)[0], layout=99)
    with pytest.raises(CannotResume, match=f"written in layout 99, this program reads {LAYOUT}"):
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


def test_the_command_tells_what_is_wrong_and_leaves_with_two(dry):
    done = command("resume", dry, check=False)
    assert done.returncode == ExitCode.BAD_CASE
    assert "give a later one with --end to go on" in done.stderr or "another program" in done.stderr
    assert "Traceback" not in done.stderr
