"""What a run tells: one line per 10 % without a terminal, and the user's wish to stop is heard."""

import io
import os
import re
import signal

import pytest

from coupler.program.terminal import Row, duration, newtons, table
from coupler.run.progress import BarReporter, LineReporter, reporter
from coupler.run.stop import StopRequest

FIGURES = {"dt": "10 ms", "joints broken": "3/90"}


def run_to_the_end(tell, steps):
    for k in range(1, steps + 1):
        tell.step(4.0 * k / steps, FIGURES)


@pytest.mark.parametrize("steps", [10, 73, 1000])
def test_one_line_for_each_tenth(steps):
    """Whatever the number of steps, a log of ten lines; the figures and the time are in each."""
    stream, log = io.StringIO(), []
    run_to_the_end(LineReporter(4.0, log.append, lambda: None, stream), steps)
    lines = stream.getvalue().splitlines()
    assert len(lines) == 10
    assert log == lines
    assert re.match(r"100%  t 4.000 of 4 s  dt 10 ms  joints broken 3/90  left 0 s", lines[-1])


def test_time_left_does_not_count_the_first_step(monkeypatch):
    """The first step compiles: it took 100 s here, the others 1 s each; after two of ten steps 8 s are left."""
    now = iter([100.0, 101.0])
    monkeypatch.setattr("coupler.run.progress.clock.monotonic", lambda: next(now))
    reported = io.StringIO()
    tell = LineReporter(10.0, lambda line: None, lambda: None, reported)
    tell.step(1.0, {})
    tell.step(2.0, {})
    assert reported.getvalue().splitlines()[-1].endswith("left 8 s")


def test_few_long_steps_give_a_line_each():
    stream = io.StringIO()
    run_to_the_end(LineReporter(4.0, lambda text: None, lambda: None, stream), 3)
    assert len(stream.getvalue().splitlines()) == 3


def test_the_bar_logs_the_same_tenths(capsys):
    log = []
    with BarReporter(4.0, log.append, lambda: None) as tell:
        tell.message("modules on: water")
        run_to_the_end(tell, 50)
    assert log[0] == "modules on: water"
    assert len(log) == 11


def test_without_a_terminal_lines_are_chosen():
    assert isinstance(reporter(1.0, print, lambda: None), LineReporter)


def test_a_stop_file_ends_a_run(tmp_path):
    with StopRequest(tmp_path) as stop:
        assert stop.requested() is None
        (tmp_path / "stop").touch()
        assert "/stop is there" in stop.requested()


def test_ctrl_c_asks_first_and_forces_then(tmp_path):
    """The step under way must end properly; whoever cannot wait presses again."""
    before = signal.getsignal(signal.SIGINT)
    with StopRequest(tmp_path) as stop:
        os.kill(os.getpid(), signal.SIGINT)
        assert stop.requested().startswith("stopped by Ctrl-C")
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before


def test_a_handler_that_was_not_set_by_python_ends_no_run(tmp_path, monkeypatch):
    """`signal.getsignal` gives None for that of a library; to put None back is a TypeError, after the last step."""
    before = {number: signal.getsignal(number) for number in StopRequest.SIGNALS}
    monkeypatch.setattr(signal, "getsignal", lambda number: None)
    try:
        with StopRequest(tmp_path):
            pass
        monkeypatch.undo()
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def test_a_handler_that_a_library_installs_does_not_swallow_ctrl_c(tmp_path):
    """YADE sets its own handlers when it is imported in the middle of a run."""
    with StopRequest(tmp_path) as stop:
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        assert stop.requested() is None
        os.kill(os.getpid(), signal.SIGINT)
        assert stop.requested().startswith("stopped by Ctrl-C")


@pytest.mark.parametrize(("seconds", "text"), [(42.4, "42 s"), (185, "3 min 05 s"), (7800, "2 h 10 min")])
def test_durations(seconds, text):
    assert duration(seconds) == text


def test_tables_without_a_terminal_are_aligned_lines(capsys):
    table("forecast", [Row("steps", 120), Row("substep", 1.23456e-4, "s", "limited by blocks a and b")])
    assert capsys.readouterr().out.splitlines() == [
        "forecast",
        "  steps    120",
        "  substep  0.0001235 s  limited by blocks a and b",
    ]


@pytest.mark.parametrize(
    ("force", "text"),
    [(0.0, "0.0 N"), (0.0118, "0.0 N"), (4.84, "4.8 N"), (12345.0, "12.35 kN"), (2.5e6, "2.5 MN")],
)
def test_forces_have_the_unit_that_suits_them(force, text):
    """A small flume has newtons, a quay meganewtons; what is below a tenth of a newton is round-off."""
    assert newtons(force) == text


def test_two_times_that_read_alike_are_told_as_one():
    """At the end of a run that may still break both are zero."""
    lines = []
    reporter = LineReporter(10.0, lines.append, lambda: None, stream=io.StringIO())
    reporter.expect(True, False)
    for time in (1.0, 2.0):
        reporter.step(time, {})
    assert reporter.pace.between() is not None
    reporter.step(10.0, {})
    assert lines[-1].endswith("left 0 s")
    assert " to " not in lines[-1]
