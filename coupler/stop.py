"""The user's wish to stop: Ctrl-C, or a file named `stop` in the run directory.

The loop asks once a step; the step under way ends properly and is written. A second Ctrl-C stops at once.
"""

from __future__ import annotations

import signal
import threading
from pathlib import Path

FILE_NAME = "stop"


class StopRequest:
    """A context in which Ctrl-C and SIGTERM ask for an end instead of killing the run."""

    SIGNALS = (signal.SIGINT, signal.SIGTERM)

    def __init__(self, directory: Path):
        self.file = Path(directory) / FILE_NAME
        self._reason: str | None = None
        self._before: dict[int, object] = {}

    def __enter__(self) -> StopRequest:
        if threading.current_thread() is threading.main_thread():
            self._before = {number: signal.getsignal(number) for number in self.SIGNALS}
            self._arm()
        return self

    def __exit__(self, *_) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def requested(self) -> str | None:
        """Why the run is to stop, or None."""
        if self._before and signal.getsignal(signal.SIGINT) != self._on_signal:
            self._arm()  # YADE installs handlers of its own when it is imported
        if self._reason is None and self.file.exists():
            self._reason = f"stopped because the file {self.file} is there; all steps until then are written"
        return self._reason

    def _arm(self) -> None:
        for number in self.SIGNALS:
            signal.signal(number, self._on_signal)

    def _on_signal(self, number: int, frame) -> None:
        if self._reason is not None:
            raise KeyboardInterrupt
        who = "Ctrl-C" if number == signal.SIGINT else "the system (SIGTERM)"
        self._reason = f"stopped by {who}; all steps until then are written"
