"""Requests to stop a run: Ctrl-C, the end of the session, or a file named `stop` in the run directory.

The time loop checks for them once per step, and within a step that lasts long (`within_step.py`). A second Ctrl-C stops
at once. After the terminal has closed (SIGHUP), output to it is discarded.
"""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections.abc import Callable
from pathlib import Path

FILE_NAME = "stop"
WHO = {
    signal.SIGINT: "Ctrl-C",
    signal.SIGTERM: "the system (SIGTERM)",
    signal.SIGHUP: "the end of its terminal (SIGHUP)",
}


class StopRequest:
    """A context in which Ctrl-C, SIGTERM and SIGHUP ask for an end instead of killing the run."""

    SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

    def __init__(self, directory: Path):
        self.file = Path(directory) / FILE_NAME
        self._reason: str | None = None
        self._before: dict[signal.Signals, Callable | int | None] = {}
        self._terminals: list[int] = []

    def __enter__(self) -> StopRequest:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.getsignal(number) for number in self.SIGNALS}
            if self._before[signal.SIGHUP] == signal.SIG_IGN:  # nohup
                del self._before[signal.SIGHUP]
            self._terminals = [handle for handle in (1, 2) if os.isatty(handle)]
            self._arm()
        return self

    def __exit__(self, *_) -> None:
        for number, handler in self._before.items():
            if handler is None:  # that of a library, which Python cannot put back
                handler = signal.SIG_DFL
            signal.signal(number, handler)

    def requested(self) -> str | None:
        """Why the run is to stop, or None."""
        if self._before and signal.getsignal(signal.SIGINT) != self._on_signal:
            self._arm()  # YADE installs handlers of its own when it is imported
        if self._reason is None and self.file.exists():
            self._reason = f"stopped because the file {self.file} is there; all steps until then are written"
        return self._reason

    def _arm(self) -> None:
        for number in self._before:
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame) -> None:
        if number == signal.SIGHUP:  # often comes twice, from the terminal and from the shell
            self._leave_the_terminal()
        elif self._reason is not None:
            raise KeyboardInterrupt
        self._reason = (
            self._reason or f"stopped by {WHO[signal.Signals(number)]}; all steps until then are written"
        )

    def _leave_the_terminal(self) -> None:
        """Redirect output after the terminal is gone: printing to it would end the run at once instead of after its
        step."""
        with contextlib.suppress(OSError):
            nowhere = os.open(os.devnull, os.O_WRONLY)
            for handle in self._terminals:
                os.dup2(nowhere, handle)
            os.close(nowhere)
