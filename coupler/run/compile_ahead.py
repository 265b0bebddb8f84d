"""Compiles the kernels of a case before its run, in two processes side by side: a single one takes about twice as long.

A part of the program counts as compiled if most of its modules have their folder in the cache. Kernels that are still
missing, after an edit for instance, are compiled by the run when it first calls them. Processes that need the same
kernel wait for one another (`kernels/decorators.py`), so none is compiled twice.
"""

from __future__ import annotations

import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

from coupler.case.case import Case
from coupler.program.kernel_cache import folder_of
from coupler.program.process import environment
from coupler.program.provenance import ROOT

MODULES = {"solids": "fluid/cut", "water": "fluid", "structure": "yade_scripts", "both": "coupler/step"}
"""Folders with the kernels of each part; those of fluid/cut count for solids alone."""
CHAINS = (("solids", "water"), ("structure", "both"))
"""Parts that one process compiles one after the other, since the second uses kernels of the first. Both chains take
about equally long."""
KERNEL = re.compile(r"^@(kernel|helper|inner|plain|ranged|released|nogil)$", re.MULTILINE)
ENOUGH = 0.5
"""Share of the modules of a part with kernels in the cache, from which it counts as compiled."""


def compile_ahead(case: Case, tell: Callable[[str], object]) -> None:
    """Compile the kernels that the case needs and the cache lacks, if there is more than one core; otherwise say that
    the run will. Failures are left to the run, too."""
    cores = len(os.sched_getaffinity(0))
    wanted = [part for part in needed(case) if not is_compiled(part)]
    chains = [own for chain in CHAINS if (own := [part for part in chain if part in wanted])]
    if not wanted:
        return
    what = f"compiling the numerical kernels ({', '.join(wanted)}), once for this version of the program"
    if cores < 2 or len(chains) < 2:
        tell(f"{what}, as they are first called: half a minute or more")
        return
    tell(f"{what}: {len(chains)} processes on {cores} cores, a minute or more")
    began, before = time.monotonic(), _children_seconds()
    failed = _compile(chains)
    if failed:
        tell(f"note: {', '.join(failed)}: not compiled ahead; the run compiles what it needs itself")
    tell(
        f"compiled in {time.monotonic() - began:.0f} s ({_children_seconds() - before:.0f} s of processor time)"
    )


def _children_seconds() -> float:
    """Processor time [s] of the processes that this one has waited for."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def needed(case: Case) -> list[str]:
    """Parts of the program that the case runs."""
    water, structure = case.water is not None, case.structure is not None
    on = {
        "solids": water and (structure or bool(case.solid)),
        "water": water,
        "structure": structure,
        "both": water and structure,
    }
    return [part for part in MODULES if on[part]]


def is_compiled(part: str) -> bool:
    """Whether most modules of a part have kernels in the cache; also True if the program uses no cache of its own."""
    place = os.environ.get("NUMBA_CACHE_DIR")
    if not place or "NUMBA_CACHE_LOCATOR_CLASSES" not in os.environ:
        return True
    modules = _modules(part)
    there = sum(any(folder_of(module, Path(place)).glob("*.nbi")) for module in modules)
    return there >= ENOUGH * len(modules)


def _modules(part: str) -> list[Path]:
    """Modules of a part that hold kernels which every such case uses."""
    found = [
        path for path in (ROOT / MODULES[part]).rglob("*.py") if part == "solids" or path.parent.name != "cut"
    ]
    return [path for path in found if KERNEL.search(path.read_text(encoding="utf-8"))]


def _compile(chains: list[list[str]]) -> list[str]:
    """Run the chains side by side; the parts of those that failed."""
    words = [sys.executable, "-m", "coupler.commands.warm_up"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "env": environment()}
    running = [(chain, subprocess.Popen([*words, *chain], **quiet)) for chain in chains]
    try:
        return [part for chain, process in running if process.wait() != 0 for part in chain]
    finally:
        for _, process in running:
            if process.poll() is None:
                process.terminate()
                process.wait()
