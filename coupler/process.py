"""Python processes that this one starts run the program that this one is, wherever they are started.

A child would otherwise find the installed package, or one in the folder in which the user happens to stand: another
checkout would then be checked, measured or drawn with than the one that was called.
"""

from __future__ import annotations

import os
import subprocess
import sys

from coupler.provenance import ROOT


def run_module(module: str, *words: object, **options) -> subprocess.CompletedProcess:
    """`python -m module words...` of this very program; options of subprocess.run, of which check is False."""
    command = [sys.executable, "-m", module, *map(str, words)]
    return subprocess.run(command, **{"check": False, "env": environment(), **options})


def environment() -> dict[str, str]:
    """The variables of this process, with this checkout first on the path and the working directory not on it."""
    found = dict(os.environ, PYTHONSAFEPATH="1")
    if (ROOT / "pyproject.toml").exists():  # else it was installed, and is found by itself
        others = [place for place in found.get("PYTHONPATH", "").split(os.pathsep) if place]
        found["PYTHONPATH"] = os.pathsep.join([str(ROOT), *(p for p in others if p != str(ROOT))])
    return found
