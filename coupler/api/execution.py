"""Runs in the process of a script: callbacks after each step, requests to stop, and one run at a time."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from coupler.api.step import Step
from coupler.checks.read_case import CaseFile
from coupler.program.errors import ExitCode, SurgebreakError
from coupler.run.directory import RunDirectory
from coupler.run.execute import execute_case
from coupler.step.limits import Stopped

if TYPE_CHECKING:
    from coupler.step.coupled_step import CoupledStepper
    from coupler.step.record import StepRecord

Callback = Callable[[Step], object]
_one_at_a_time = threading.Lock()


class RunInRun(SurgebreakError):
    """Another run of this process has not ended yet."""

    exit_code = ExitCode.BAD_CASE


def execute(
    file: CaseFile,
    directory: RunDirectory,
    checkpoint: Any,
    callback: Callback | None,
    stop: Callable[[Step], object] | None,
    quiet: bool,
) -> None:
    """Run in a directory, from the start or a checkpoint. A request to stop ends the run normally; an exceeded limit
    raises."""
    watch = _Watch(callback, stop)
    each = watch.step if callback or stop else None
    with suppress(Stopped):  # as was asked; run.json says so
        execute_case(file, directory, checkpoint, each, watch.stop_reason, quiet)


class _Watch:
    """Calls the callback and the stop condition of a script after each step."""

    def __init__(self, callback: Callback | None, stop: Callable[[Step], object] | None) -> None:
        self._callback, self._stop = callback, stop
        self.reason: str | None = None

    def step(
        self, coupling: CoupledStepper, record: StepRecord, figures: dict[str, Any], readings: dict[str, Any]
    ) -> None:
        """Call both with the present `Step`."""
        step = Step(coupling, record, figures, readings)
        if self._callback is not None:
            self._callback(step)
        asked = self._stop(step) if self._stop is not None else None
        if asked:
            text = f": {asked}" if isinstance(asked, str) else ""
            self.reason = f"stopped by the script at t = {coupling.time:.6g} s{text}"

    def stop_reason(self) -> str | None:
        """Why the script asked to stop; None while it has not."""
        return self.reason


@contextmanager
def only_run() -> Iterator[None]:
    """Refuse a second run from a callback or another thread, since YADE has one scene in a process. Raises RunInRun."""
    if not _one_at_a_time.acquire(blocking=False):
        raise RunInRun(
            "another run or check of this process is not over yet, and YADE holds one scene a process; wait for its "
            "end, or start the other in a process of its own (`surgebreak run`, subprocess)"
        )
    try:
        yield
    finally:
        _one_at_a_time.release()


def resume(
    directory: Path,
    changes: Iterable[str],
    callback: Callback | None,
    stop: Callable[[Step], object] | None,
    quiet: bool,
    any_version: bool,
) -> None:
    """See `Run.resume`."""
    from coupler.run.resume import prepare

    with only_run():
        found = prepare(directory, changes, any_version, _discard if quiet else print)
        execute(found.file, found.directory, found.checkpoint, callback, stop, quiet)


def _discard(text: str) -> None:
    """Discard a line of report."""
