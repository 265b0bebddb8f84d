"""One process a run directory, and an end of the session that a run survives as a stopped one."""

import errno
import json
import os
import pty
import resource
import signal
import subprocess
import sys
import time

import pytest

from coupler.program.errors import ExitCode
from coupler.program.failures import Failure
from coupler.run.lock import Busy, RunLock
from coupler.run.resume import prepare
from coupler.run.stop import StopRequest
from tests.coupler.resumed import DRY, directory_of

HOLDER = """
import sys, time
from pathlib import Path
from coupler.run.lock import RunLock
lock = RunLock(Path(sys.argv[1]))
print("held", flush=True)
time.sleep(60)
"""


def test_a_directory_that_another_process_holds_is_refused_until_that_is_killed(stopped):
    """A lock of a process that died must not be in the way: the system lets it go."""
    before = (stopped / "run.json").read_bytes()
    other = subprocess.Popen([sys.executable, "-c", HOLDER, stopped], stdout=subprocess.PIPE, text=True)
    try:
        assert other.stdout.readline() == "held\n"
        with pytest.raises(Busy, match="another process runs or resumes it at this moment"):
            prepare(stopped, any_version=True)
        assert Failure.of(Busy("")).exit_code == ExitCode.BAD_CASE
        assert (stopped / "run.json").read_bytes() == before
    finally:
        other.kill()
        other.communicate()
    prepare(stopped, any_version=True, tell=[].append).directory.lock.release()


def test_of_two_resumptions_at_once_one_goes_on(stopped):
    found = prepare(stopped, any_version=True, tell=[].append)
    with pytest.raises(Busy):
        prepare(stopped, any_version=True)
    found.directory.finish(ExitCode.STOPPED, "enough")
    prepare(stopped, any_version=True, tell=[].append).directory.lock.release()


def test_a_refused_resumption_holds_nothing(stopped):
    with pytest.raises(Exception, match=r"this belongs to what the run computes"):
        prepare(stopped, ["contact.friction=1"])
    lock = RunLock(stopped)
    assert lock.known
    lock.release()
    lock.release()
    RunLock(stopped).release()


def run_in_a_terminal(tmp_path):
    """A run whose standard output is a terminal of its own, when it has made its first steps."""
    case = directory_of(tmp_path / "case", DRY.replace('end = "0.1 s"', 'end = "60 s"'))
    main, other = pty.openpty()

    def take_the_terminal():
        os.setsid()
        os.close(os.open(os.ttyname(other), os.O_RDWR))

    run = subprocess.Popen(
        [sys.executable, "-m", "coupler.commands.cli", "run", case, "--output", tmp_path / "run"],
        stdin=other, stdout=other, stderr=other, preexec_fn=take_the_terminal,
    )  # fmt: skip
    os.close(other)
    until = time.monotonic() + 60
    table = tmp_path / "run" / "history" / "energy.csv"
    os.set_blocking(main, False)
    while not (table.exists() and table.read_bytes().count(b"\n") > 40):
        assert time.monotonic() < until
        assert run.poll() is None
        try:
            os.read(main, 1 << 16)
        except BlockingIOError:
            time.sleep(0.02)
    return run, main


def test_a_run_whose_terminal_closes_ends_as_a_stopped_one(tmp_path):
    """What it prints is refused from then on, which must not end it instead."""
    run, main = run_in_a_terminal(tmp_path)
    os.close(main)
    assert run.wait(timeout=30) == ExitCode.STOPPED
    reported = json.loads((tmp_path / "run" / "run.json").read_text(encoding="utf-8"))
    assert reported["status"] == "stopped"
    assert "stopped by the end of its terminal (SIGHUP)" in reported["exit_reason"]
    assert list((tmp_path / "run" / "checkpoints").glob("*.h5"))


def test_the_end_of_a_session_comes_twice_and_stops_once(tmp_path):
    with StopRequest(tmp_path) as stop:
        os.kill(os.getpid(), signal.SIGHUP)
        os.kill(os.getpid(), signal.SIGHUP)
        assert "SIGHUP" in stop.requested()


def test_a_session_that_was_reported_to_go_on_is_not_stopped(tmp_path):
    """nohup: the signal is ignored when the program starts."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with StopRequest(tmp_path) as stop:
            os.kill(os.getpid(), signal.SIGHUP)
            assert stop.requested() is None
    finally:
        signal.signal(signal.SIGHUP, before)


def chained(outer, inner):
    outer.__cause__ = inner
    return outer


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("Unable to allocate 3 GiB"),
        OSError(12, "Cannot allocate memory"),
        chained(
            RuntimeError("YADE does not load"), ImportError("x.so: failed to map segment from shared object")
        ),
    ],
)
def test_a_lack_of_memory_is_called_so(error, monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (7 * 10**8, resource.RLIM_INFINITY))
    failure = Failure.of(error)
    assert failure.exit_code == ExitCode.STOPPED
    assert failure.message.startswith("there is not enough memory (")
    assert "this process may take 700 MB (ulimit -v)" in failure.message
    assert not failure.traceback


def test_other_errors_are_no_lack_of_memory():
    assert Failure.of(chained(RuntimeError("a"), ImportError("no module"))).exit_code == ExitCode.CRASHED


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS, errno.EPERM])
def test_places_that_are_closed_to_the_user_are_named(number):
    failure = Failure.of(OSError(number, os.strerror(number), "/a/report.html"))
    assert failure.exit_code == ExitCode.BAD_CASE
    assert (
        failure.message == f"/a/report.html: {os.strerror(number)}; name a place that you may read and write"
    )
    assert not failure.traceback
