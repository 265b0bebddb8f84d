"""One case in this process: `python -m coupler.commands.verify.one ID FILE [FIGURES]` writes a line of JSON for each
result, and for each figure where a second file is named."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import asdict

from coupler.commands.verify.curves import Figure, as_json
from coupler.commands.verify.registry import Check, Result, checks
from kernels.memory import keep_memory


def results(case: Check, figures=None) -> Iterator[Result]:
    """Run a case. An error ends the process; `runner` reports it with its message.

    figures: a text file for the figures that the case has; None: they are dropped."""
    began = cpu_seconds()
    for found in case.run():
        if isinstance(found, Figure):
            if figures is not None:
                print(json.dumps(as_json(found)), file=figures, flush=True)
            continue
        now = cpu_seconds()
        yield Result.of(case.id, found, now - began)
        began = now


def cpu_seconds() -> float:
    """Processor time [s] of this process and of the children that it has waited for, such as YADE with a script."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def main() -> None:
    """Write the results one by one, so that those before a crash are kept."""
    keep_memory()
    id, path, *more = sys.argv[1:]
    with open(path, "w", encoding="utf-8") as file, _figures(*more) as figures:
        for result in results(checks()[id], figures):
            print(json.dumps(asdict(result)), file=file, flush=True)


def _figures(path: str = ""):
    return open(path, "w", encoding="utf-8") if path else nullcontext()


if __name__ == "__main__":
    main()
