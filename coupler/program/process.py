"""Processes: a command starts child processes of its own program, wherever it is called from. Also: whether the process
of a run still exists.

A child would otherwise find the installed package, or one in the working directory, and so run another checkout than
the one that was called.
"""

from __future__ import annotations

import ctypes
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from coupler.program.provenance import ROOT

_LIBC = ctypes.CDLL(None)
"""The C library, loaded here because a forked process should not load it."""
PR_SET_PDEATHSIG = 1
"""prctl(2)"""
LAST_LINES = 3
"""Number of lines of a process's output in a message about its failure."""


def run_module(module: str, *words: object, **options: Any) -> subprocess.CompletedProcess:
    """`python -m module words...` of this very program, which ends with this process; options of subprocess.run, of
    which check is False."""
    command = [sys.executable, "-m", module, *map(str, words)]
    ours = {"check": False, "env": environment(), "preexec_fn": partial(end_with, os.getpid())}
    return subprocess.run(command, **{**ours, **options})


def end_with(parent: int) -> None:
    """To be called in a child process: have the system send it SIGTERM when the thread that started it ends. parent:
    process id of the parent, which may have ended already."""
    _LIBC.prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    if os.getppid() != parent:
        os.kill(os.getpid(), signal.SIGTERM)


def rows_of_module(module: str, id: str, limit: float, *words: object) -> tuple[list[dict], str]:
    """Run `python -m module ID FILE words...`, which writes a line of JSON for each thing that it finds.

    The rows, those before a crash among them, and how the process failed, if it did; limit [s] of wall time."""
    wrong = ""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rows"
        try:
            done = run_module(module, id, path, *words, capture_output=True, text=True, timeout=limit)
            wrong = "" if done.returncode == 0 else trouble(done.returncode, done.stderr)
        except subprocess.TimeoutExpired as error:
            wrong = f"not done after {error.timeout} s"
        lines = path.read_text(encoding="utf-8").splitlines() if path.exists() else []
    return [json.loads(line) for line in lines], wrong


def trouble(exit_code: int, output: str) -> str:
    """A description of how a process failed, with the last lines of its output."""
    last = " | ".join(output.strip().splitlines()[-LAST_LINES:])
    return f"its process ended with {exit_code}: {last}"


def environment() -> dict[str, str]:
    """The variables of this process, with this checkout first on the path and the working directory not on it."""
    found = dict(os.environ, PYTHONSAFEPATH="1")
    if (ROOT / "pyproject.toml").exists():  # else it was installed, and is found by itself
        others = [place for place in found.get("PYTHONPATH", "").split(os.pathsep) if place]
        found["PYTHONPATH"] = os.pathsep.join([str(ROOT), *(p for p in others if p != str(ROOT))])
    return found


def status_of(summary: dict) -> str:
    """The status in run.json (its content), but "killed" where `was_killed` says so."""
    return "killed" if was_killed(summary) else str(summary["status"])


def was_killed(summary: dict) -> bool:
    """Whether run.json (its content) says "running" although its process is gone: it could not record its end.

    For a run on another machine this cannot be known.
    """
    here = summary.get("machine", {}).get("host", platform.node()) == platform.node()
    if summary.get("status") != "running" or not here:
        return False
    try:
        os.kill(summary["process"], 0)
    except ProcessLookupError:
        return True
    except PermissionError:  # the process belongs to another user, so it exists
        return False
    return False
