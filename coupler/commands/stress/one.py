"""One scene in this process: `python -m coupler.commands.stress.one ID FILE` writes a line of JSON for each measure,
then the outcome."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import asdict

from coupler.commands.stress.registry import Measure, Outcome, Scene, judged, scenes
from coupler.program.errors import SurgebreakError
from kernels.memory import keep_memory


def is_refusal(error: Exception) -> bool:
    """An error of ours, whose message is meant for the user."""
    return isinstance(error, SurgebreakError) or type(error).__module__.split(".")[0] in (
        "coupler",
        "fluid",
        "yade_scripts",
    )


def outcome(scene: Scene, keep=lambda measure: None) -> Outcome:
    """Run a scene and return its outcome; unexpected exceptions are passed on to the caller."""
    cpu, wall, measures, refused = time.process_time(), time.perf_counter(), [], ""
    try:
        for measure in scene.run():
            found = Measure(measure.quantity, float(measure.value), measure.limit, measure.unit)
            measures.append(found)
            keep(found)
    except (ArithmeticError, RuntimeError, ValueError, SurgebreakError) as error:
        if not is_refusal(error):
            raise
        refused = str(error)
    return judged(scene, measures, refused, time.process_time() - cpu, time.perf_counter() - wall)


def main() -> None:
    """Write the measures one by one, so that those before a crash are kept."""
    keep_memory()
    id, path = sys.argv[1:]
    with open(path, "w", encoding="utf-8") as file:

        def keep(measure: Measure) -> None:
            print(json.dumps({"measure": asdict(measure)}), file=file, flush=True)

        found = outcome(scenes()[id], keep)
        print(
            json.dumps({"outcome": [found.verdict, found.message, found.cpu_s, found.wall_s]}),
            file=file,
            flush=True,
        )


if __name__ == "__main__":
    main()
