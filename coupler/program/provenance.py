"""Where a result comes from: program, packages, machine and state of the checkout."""

from __future__ import annotations

import os
import platform
import subprocess
from importlib import metadata
from pathlib import Path

from coupler.program.arithmetic import missing
from coupler.program.threads import threads

ROOT = Path(__file__).resolve().parent.parent.parent
PACKAGES = ("numpy", "scipy", "scikit-fem", "meshio", "h5py", "numba", "pydantic")


def version() -> str:
    """Version of this program."""
    return metadata.version("surgebreak")


def versions() -> dict[str, str]:
    """Versions of Python, YADE and the packages that the numbers depend on; absent ones are left out."""
    found = {"surgebreak": version(), "python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            continue
    yade = _output("dpkg-query", "-W", "-f", "${Version}", "yade")
    if yade:
        found["yade"] = yade
    return found


def machine() -> dict[str, str | int]:
    """System, processor and threads."""
    return {
        "system": platform.platform(),
        "processor": _processor(),
        "instructions": "its own" if missing() else os.environ.get("NUMBA_CPU_NAME", "its own"),
        "cores": os.cpu_count() or 1,
        "threads": threads(),
        "host": platform.node(),
    }


def git_state() -> dict[str, str | bool] | None:
    """Commit of the checkout and whether files differ from it; None outside of git, and where the program is installed
    somewhere inside a checkout of something else, whose commit says nothing about it."""
    top = _output("git", "-C", str(ROOT), "rev-parse", "--show-toplevel")
    if not top or Path(top).resolve() != ROOT:
        return None
    commit = _output("git", "-C", str(ROOT), "rev-parse", "HEAD")
    if not commit:
        return None
    changed = _output("git", "-C", str(ROOT), "status", "--porcelain", "--untracked-files=no")
    return {"commit": commit, "changed": bool(changed)}


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor()


def _output(*command: str) -> str:
    """Standard output of a small command, empty when it is absent or fails."""
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return done.stdout.strip() if done.returncode == 0 else ""
