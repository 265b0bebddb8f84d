"""Pictures for the page, made one at a time in a process of their own and at a limited rate."""

from __future__ import annotations

import subprocess
import sys
import time as clock

from coupler.program.process import environment

SIZE = "640x360"
PAUSE = 60.0
"""[s] at least between the end of one picture and the next."""
SHARE = 10.0
"""A picture that took T is followed by none for so many T: looking on costs a tenth of a core at most."""


class Pictures:
    """Makes a still of a run that has written a new state since the last one."""

    def __init__(self):
        self._process: subprocess.Popen | None = None
        self._began = self._next = 0.0
        self._made: dict[str, float] = {}

    def consider(self, runs, states: list[dict]) -> None:
        """Begin the next picture, if it is time for one."""
        now = clock.monotonic()
        if self._process is not None:
            if self._process.poll() is None:
                return
            self._process = None
            self._next = now + max(PAUSE, SHARE * (now - self._began))
        if now < self._next:
            return
        for run, state in zip(runs, states):
            time = state.get("time") or 0.0
            if (
                time > self._made.get(str(run.path), -1.0)
                and (run.path / "log.txt").exists()
                and self._has_fields(run)
            ):
                self._made[str(run.path)] = time
                self._began = now
                words = ("--still", "--size", SIZE, "--letters", "1.4", "--to", str(run.path / "watch"))
                self._process = subprocess.Popen(
                    [sys.executable, "-m", "coupler.commands.view", str(run.path), *words],
                    env=environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                )  # fmt: skip
                return

    @staticmethod
    def _has_fields(run) -> bool:
        return any((run.path / name).exists() for name in ("fields.vtkhdf", "blocks.vtkhdf"))

    def close(self) -> None:
        """End a picture that is being made."""
        if self._process is not None and self._process.poll() is None:
            self._process.terminate()
