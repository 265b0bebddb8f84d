"""Reports of a running run: a bar with the time left on a terminal, one line per 10 % anywhere else.

The loop knows only the protocol `Reporter`; figures are ordered name -> text, for instance
{"dt": "12 ms", "joints broken": "140/900", "force on house": "2.1 MN", "volume": "+0.02 %", "energy": "0.4 %"}.
"""

from __future__ import annotations

import contextlib
import io
import json
import math
import os
import time as clock
from collections.abc import Callable, Mapping
from typing import Protocol, TextIO

from coupler.program.terminal import console, duration
from coupler.run.pace import Pace


class Reporter(Protocol):
    """Receives the reports of the time loop."""

    def step(self, time: float, figures: Mapping[str, str]) -> None:
        """After each coupled step: the time reached [s] and the figures that matter."""

    def expect(self, calm: bool, broken: bool) -> None:
        """Called before a step is reported: whether the run is expected to become slower, and whether a joint has
        broken (`coupler/run/pace.py`)."""

    def message(self, text: str) -> None:
        """A sentence for the user and the log (modules on and off, remarks, written files)."""

    def stop_requested(self) -> str | None:
        """Why the user wants the run to end, or None; asked once a step."""


PROGRESS = "progress.json"
"""File in the run directory with the progress of the run, for other programs."""
EVERY = 1.0
"""Time [s] between two versions of that file."""


class ProgressFile:
    """Passes reports on to another reporter, and keeps PROGRESS in the run directory up to date."""

    def __init__(self, inner, path):
        self.inner, self.path = inner, path / PROGRESS
        self.message, self.stop_requested, self.expect = inner.message, inner.stop_requested, inner.expect
        self._written = -math.inf

    def step(self, time: float, figures: Mapping[str, str]) -> None:
        """Pass a step on, and write the file if the last one is EVERY seconds old."""
        self.inner.step(time, figures)
        if clock.monotonic() - self._written >= EVERY or time >= self.inner.end:
            self._written = clock.monotonic()
            self._write(
                {
                    "time": time,
                    "end": self.inner.end,
                    "left": self.inner.pace.left(),
                    "left_between": self.inner.pace.between(),
                    "figures": dict(figures),
                }
            )

    def _write(self, reported: dict) -> None:
        """Replace the file as a whole; a full disk does not end the run."""
        beside = self.path.with_name(f".{PROGRESS}.part")
        with contextlib.suppress(OSError):
            beside.write_text(json.dumps(reported | {"written": clock.time()}), encoding="utf-8")
            os.replace(beside, self.path)


class _Base:
    """Common part of the reporters: the log, the request to stop and the clock."""

    def __init__(self, end: float, log: Callable[[str], None], stop: Callable[[], str | None]):
        self.end, self.log, self.stop_requested = end, log, stop
        self.pace = Pace(end)
        self._tenth = 0

    def expect(self, calm: bool, broken: bool) -> None:
        """Tell the forecast of the remaining time what the structure is doing; see `Pace.expect`."""
        self.pace.expect(calm, broken)

    def _line(self, time: float, figures: Mapping[str, str]) -> str:
        share = min(1.0, time / self.end)
        reported = "  ".join(f"{name} {text}" for name, text in figures.items())
        return f"{share:4.0%}  t {time:.3f} of {self.end:g} s  {reported}  {self._left(time)}".rstrip()

    def _left(self, time: float) -> str:
        """Wall time left, as text; two times where what breaks decides."""
        between = self.pace.between()
        least, most = map(duration, between or (0.0, 0.0))
        if least != most:
            return f"left {least} to {most}"
        left = self.pace.left()
        return "" if left is None else f"left {duration(left)}"

    def _new_tenth(self, time: float) -> bool:
        self.pace.add(time, clock.monotonic())
        tenth = int(10.0 * time / self.end + 1e-9)
        new, self._tenth = tenth > self._tenth, max(tenth, self._tenth)
        return new

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        return None


class LineReporter(_Base):
    """One line per 10 %, for pipes, logs and batch systems."""

    def __init__(self, end, log, stop, stream: TextIO | None = None):
        super().__init__(end, log, stop)
        self.stream = stream

    def step(self, time: float, figures: Mapping[str, str]) -> None:
        """Print a line at each tenth of the run."""
        if self._new_tenth(time):
            line = self._line(time, figures)
            print(line, file=self.stream, flush=True)
            self.log(line)

    def message(self, text: str) -> None:
        """Print a message and log it."""
        print(text, file=self.stream, flush=True)
        self.log(text)


class BarReporter(_Base):
    """A bar that is redrawn five times a second; the log gets the line per 10 %."""

    def __init__(self, end, log, stop):
        super().__init__(end, log, stop)
        from rich.progress import BarColumn, Progress, TextColumn

        self._bar = Progress(
            BarColumn(bar_width=24),
            TextColumn("{task.percentage:3.0f} %  {task.description}"),
            console=console(),
            auto_refresh=False,
        )
        self._drawn = 0.0
        self._task = self._bar.add_task("starting", total=end)

    def __enter__(self):
        self._bar.start()
        return self

    def __exit__(self, *_) -> None:
        self._bar.refresh()
        self._bar.stop()

    def step(self, time: float, figures: Mapping[str, str]) -> None:
        """Redraw the bar; the log gets a line at each tenth."""
        if self._new_tenth(time):
            self.log(self._line(time, figures))
        reported = "  ".join(f"{name} {text}" for name, text in figures.items())
        self._bar.update(
            self._task,
            completed=min(time, self.end),
            description=f"t {time:.3f} s  {reported}  {self._left(time)}",
        )
        if clock.monotonic() - self._drawn > 0.2:  # redrawn here, because a thread would starve in long calls
            self._drawn = clock.monotonic()
            self._bar.refresh()

    def message(self, text: str) -> None:
        """Print a message above the bar and log it."""
        self._bar.console.print(text, markup=False)
        self.log(text)


class QuietReporter(LineReporter):
    """A reporter that writes only to the log."""

    def __init__(self, end, log, stop):
        super().__init__(end, log, stop)
        self.stream = io.StringIO()


def reporter(end: float, log: Callable[[str], None], stop: Callable[[], str | None], quiet: bool = False):
    """The reporter that suits standard output, or a quiet one; a Reporter that is a context manager."""
    kind = QuietReporter if quiet else BarReporter if console().is_terminal else LineReporter
    return kind(end, log, stop)
