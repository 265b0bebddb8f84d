"""One case in this process: `python -m coupler.verify.one ID FILE` writes a line of JSON for each result."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict

from coupler.verify.registry import Check, Result, checks


def results(case: Check) -> Iterator[Result]:
    """Run a case. An error ends the process: `runner` reports it with what it said."""
    began = time.process_time()
    for found in case.run():
        now = time.process_time()
        yield Result.of(case.id, found, now - began)
        began = now


def main() -> None:
    """Write the results one by one, so that those before a crash are kept."""
    id, path = sys.argv[1:]
    with open(path, "w", encoding="utf-8") as file:
        for result in results(checks()[id]):
            print(json.dumps(asdict(result)), file=file, flush=True)


if __name__ == "__main__":
    main()
