"""One case in this process: `python -m coupler.verify.one ID FILE` writes a line of JSON for each result."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict

from coupler.verify.registry import Check, Result, checks


def results(case: Check) -> Iterator[Result]:
    """Run a case. An error ends the process: `runner` reports it with what it said."""
    began = cpu_seconds()
    for found in case.run():
        now = cpu_seconds()
        yield Result.of(case.id, found, now - began)
        began = now


def cpu_seconds() -> float:
    """Processor time of this process and of those that it has waited for, as YADE running a script."""
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system


def main() -> None:
    """Write the results one by one, so that those before a crash are kept."""
    id, path = sys.argv[1:]
    with open(path, "w", encoding="utf-8") as file:
        for result in results(checks()[id]):
            print(json.dumps(asdict(result)), file=file, flush=True)


if __name__ == "__main__":
    main()
