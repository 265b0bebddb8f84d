"""A run directory is never overwritten, always readable, and says how the run ended, whatever ended it."""

import errno
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.program.errors import CannotWrite, ExitCode, RunDirectoryExists, SurgebreakError
from coupler.program.failures import Failure, Failures
from coupler.run.directory import RunDirectory, write_json

from .test_case_file import WATER, write


@pytest.fixture
def file(tmp_path):
    (tmp_path / "case").mkdir()
    return load(write(tmp_path / "case", WATER), ["time.end=3"])


def summary(run):
    return json.loads((run.path / "run.json").read_text(encoding="utf-8"))


def test_everything_needed_to_know_what_was_run(file):
    """Case, effective case, versions, machine and git state are there before the first step."""
    run = RunDirectory.create(file)
    reported = summary(run)
    assert (run.path / "case.toml").read_text(encoding="utf-8") == WATER
    assert json.loads((run.path / "effective.json").read_text(encoding="utf-8"))["time"]["end"] == 3.0
    assert reported["status"] == "running"
    assert reported["process"] == os.getpid()
    assert reported["overrides"] == ["time.end=3"]
    assert reported["versions"]["numpy"] == np.__version__
    assert {"system", "processor", "cores", "threads"} <= set(reported["machine"])
    assert "git" in reported
    assert reported["modules"]["water"]


def test_the_place_is_beside_the_case_with_time_and_hash(file):
    run = RunDirectory.create(file)
    assert run.path.parent == file.directory / "runs"
    assert len(run.path.name.split("-")[1]) == 8


def test_two_runs_in_one_second_have_two_directories(file):
    assert RunDirectory.create(file).path != RunDirectory.create(file).path


def test_of_two_runs_that_begin_in_one_directory_at_once_the_second_is_refused(file, tmp_path, monkeypatch):
    """Both found it empty; the first to make the folder of the histories has it."""
    place = tmp_path / "results"
    RunDirectory.create(file, place)
    monkeypatch.setattr("coupler.run.directory._make", lambda *_: place)
    with pytest.raises(
        RunDirectoryExists, match="another run has just begun there; name another with --output"
    ):
        RunDirectory.create(file, place)


def test_an_existing_directory_is_never_touched(file, tmp_path):
    place = tmp_path / "results"
    place.mkdir()
    (place / "run.json").write_text("old", encoding="utf-8")
    with pytest.raises(
        RunDirectoryExists, match="exists and is not an empty directory; results are never overwritten"
    ):
        RunDirectory.create(file, place)
    assert (place / "run.json").read_text(encoding="utf-8") == "old"


def test_a_file_in_the_way_is_reported(file, tmp_path):
    (tmp_path / "results").write_text("", encoding="utf-8")
    with pytest.raises(RunDirectoryExists):
        RunDirectory.create(file, tmp_path / "results")
    with pytest.raises(CannotWrite, match="cannot make the directory for the results"):
        RunDirectory.create(file, tmp_path / "results" / "below")


def test_the_end_is_written_once(file):
    with RunDirectory.create(file) as run:
        run.record(steps=np.int64(12), force=np.array([1.0, 2.0]))
        run.finish(ExitCode.STOPPED, "limit")
    reported = summary(run)
    assert (reported["status"], reported["exit_code"], reported["exit_reason"]) == ("stopped", 4, "limit")
    assert reported["figures"] == {"steps": 12, "force": [1.0, 2.0]}
    assert not (run.path / ".reserve").exists()


class Diverged(RuntimeError):
    exit_code = 3


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (Diverged("the water volume is off"), 3, "the water volume is off"),
        (SurgebreakError("a message"), 1, "a message"),
        (
            OSError(errno.ENOSPC, "No space left on device", "fields.vtkhdf"),
            4,
            "fields.vtkhdf: no room for the results",
        ),
        (KeyboardInterrupt(), 4, "stopped at once by Ctrl-C"),
        (ZeroDivisionError("division by zero"), 1, "unexpected ZeroDivisionError: division by zero"),
    ],
)
def test_an_error_is_in_the_summary_and_the_log(file, error, code, says):
    """Mistakes of the program leave their traceback in the log; errors with a message leave the message alone."""
    run = RunDirectory.create(file)
    run.record(steps=3)
    with pytest.raises(type(error)), run:
        raise error
    reported = summary(run)
    assert reported["exit_code"] == code
    assert reported["exit_reason"].startswith(says)
    assert reported["figures"] == {"steps": 3}
    log = run.log_path.read_text(encoding="utf-8")
    assert says in log
    assert ("Traceback" in log) == says.startswith("unexpected")


def test_a_command_leaves_with_the_code_of_the_error(file, capsys):
    run = RunDirectory.create(file)
    with pytest.raises(SystemExit) as leaving, Failures(), run:
        raise ZeroDivisionError("division by zero")
    assert leaving.value.code == 1
    reported = capsys.readouterr().err
    assert "surgebreak: unexpected ZeroDivisionError: division by zero" in reported
    assert f"the traceback is in {run.log_path}" in reported
    assert "Traceback" not in reported


def test_errors_of_the_rooms_are_messages_without_traceback():
    """fluid and yade_scripts know nothing of exit codes; their named errors reach the user unchanged."""
    from yade_scripts.yade_side.engine import YadeMissing

    failure = Failure.of(YadeMissing("YADE is not installed"))
    assert (failure.exit_code, failure.message, failure.traceback) == (1, "YADE is not installed", "")


FULL_DISK = """
import sys
from pathlib import Path
from coupler.checks.read_case import load
from coupler.program.failures import Failures
from coupler.run.directory import RunDirectory
with Failures(), RunDirectory.create(load(sys.argv[1]), Path(sys.argv[2])) as run:
    run.record(steps=1)
    with (run.path / "fields").open("wb") as stream:
        while True:
            stream.write(bytes(65536))
            stream.flush()
"""


def test_a_really_full_disk(file, tmp_path):
    """On a file system of 1 MB the data fill it; the reserve lets the reason be written all the same."""
    disk = tmp_path / "disk"
    disk.mkdir()
    script = f'mount -t tmpfs -o size=1m none {disk} && "$@"; code=$?; cp -r {disk}/run {tmp_path}/copy; exit $code'
    python = [sys.executable, "-c", FULL_DISK, str(file.path), str(disk / "run")]
    command = ["unshare", "--mount", "--map-root-user", "sh", "-c", script, "sh", *python]
    if subprocess.run(["unshare", "--mount", "--map-root-user", "true"], check=False).returncode != 0:
        pytest.skip("this system does not let tests mount a small disk")
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == ExitCode.STOPPED, done.stderr
    assert "no room for the results" in done.stderr
    reported = json.loads((tmp_path / "copy" / "run.json").read_text(encoding="utf-8"))
    assert reported["exit_code"] == ExitCode.STOPPED
    assert reported["figures"] == {"steps": 1}


KILLED = """
import sys, time
from coupler.checks.read_case import load
from coupler.run.directory import RunDirectory
with RunDirectory.create(load(sys.argv[1])) as run:
    run.record(steps=7)
    print(run.path, flush=True)
    while True:
        run.save()
"""


def test_a_killed_run_is_readable_and_says_that_it_was_running(file):
    """SIGKILL while run.json is rewritten without pause: a reader finds a whole file, never half of one."""
    child = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(file.path)], stdout=subprocess.PIPE, text=True
    )
    path = child.stdout.readline().strip()
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    with open(f"{path}/run.json", encoding="utf-8") as stream:
        reported = json.load(stream)
    assert (reported["status"], reported["process"], reported["figures"]) == (
        "running",
        child.pid,
        {"steps": 7},
    )


def test_a_nan_among_the_figures_does_not_hide_why_the_run_ended(tmp_path):
    """A run that diverged has NaN figures; run.json must still be written, and be JSON, which knows no NaN."""
    write_json(tmp_path / "x.json", {"a": float("nan"), "b": np.array([1.0, np.inf]), "c": np.float64(2.0)})
    assert json.loads((tmp_path / "x.json").read_text(encoding="utf-8")) == {
        "a": None,
        "b": [1.0, None],
        "c": 2.0,
    }


def test_what_is_written_as_json_is_what_the_standard_library_writes(tmp_path):
    """Line by line with one blank a level, so that a summary can be read and compared by lines."""
    content = {
        "text": 'a "quoted" path\\ and a line\nwith ü and \x07',
        "numbers": [0, -3, True, False, None, 1.5, 1e-300, 12345678901234567890],
        "empty": [{}, [], ()],
        "nested": {"list": [[1, 2], {"a": {"b": "c"}}]},
    }
    write_json(
        tmp_path / "a.json", content | {"array": np.array([[1.0, np.nan]]), "path": Path("x"), 3: "key"}
    )
    expected = content | {"array": [[1.0, None]], "path": "x", "3": "key"}
    text = json.dumps(expected, indent=1, ensure_ascii=False)
    assert (tmp_path / "a.json").read_text(encoding="utf-8") == text + "\n"
    with pytest.raises(TypeError, match="set has no form in JSON"):
        write_json(tmp_path / "b.json", {"a": {1}})


def test_running_the_case_of_a_run_says_which_of_its_changes_are_not_in_it(file):
    """The copy of the case lacks what --set gave to that run: without them this would silently be another case."""
    from coupler.commands.run import _of_the_run

    run = RunDirectory.create(file)
    (note,) = _of_the_run(load(run.path))
    assert "made with --set time.end=3, which case.toml does not hold" in note
    assert not list(_of_the_run(load(run.path, ["time.end=3"])))
    assert not list(_of_the_run(file))
