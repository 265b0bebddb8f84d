"""The number of threads of a run: from the command, from SURGEBREAK_THREADS, or the number of cores of this process.

The results have the same bits with any number (`kernels/threads.py`). A run and the processes that it starts
read the variable; without it, as in scripts and tests, there is one thread."""

from __future__ import annotations

import math
import os

from coupler.program.control_groups import groups
from coupler.program.errors import ExitCode, SurgebreakError

VARIABLE = "SURGEBREAK_THREADS"


class BadThreads(SurgebreakError):
    """A number of threads that is not a positive whole number."""

    exit_code = ExitCode.BAD_CASE


def cores() -> int:
    """Cores that this process may use: those it is bound to, fewer where its control group gets less of their time."""
    bound = len(os.sched_getaffinity(0))
    quota = _quota()
    return bound if quota is None else max(1, min(bound, math.floor(quota + 1e-9)))


def threads() -> int:
    """Threads of the runs of this process: SURGEBREAK_THREADS, else one. Raises BadThreads."""
    text = os.environ.get(VARIABLE, "1")
    if not text.isdigit() or int(text) < 1:
        raise BadThreads(f"{VARIABLE}={text}: a whole number of threads, at least 1")
    return int(text)


def take_threads(asked: int | None) -> None:
    """Set the number of threads from the command, else from the variable, else to that of all cores. Raises
    BadThreads."""
    if asked is not None and asked < 1:
        raise BadThreads(
            f"--threads {asked}: at least 1; without it all {cores()} cores of this process work"
        )
    if asked is not None or VARIABLE not in os.environ:
        os.environ[VARIABLE] = str(cores() if asked is None else asked)
    threads()


def _quota() -> float | None:
    """Cores' worth of time that the control groups of this process give it, None: no limit."""
    found = []
    for group in groups("cpu"):
        try:
            most, period = (group / "cpu.max").read_text(encoding="ascii").split()
        except (OSError, ValueError):
            continue
        if most != "max":
            found.append(int(most) / int(period))
    return min(found, default=None)
