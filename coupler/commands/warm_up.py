"""Compile kernels by runs of two steps whose results are thrown away: `python -m coupler.commands.warm_up PART...`.

Numba keeps what it compiled, so later runs start at once. `coupler.run.compile_ahead` starts processes for the
parts that a case needs. Without a part, the scene that has water and a structure is run, which uses the kernels of all.
"""

from __future__ import annotations

import gc
import os
import sys
import tempfile
from pathlib import Path

TIME = """\
[case]
title = "warm-up"
[time]
end = "20 ms"
step_max = "10 ms"
"""
WATER = """\
[tank]
lower = [0, 0, 0]
upper = [2, 1, 1]
cell = 0.125
[water]
covers = "multiple"
[[water.fill]]
lower = [0, 0, 0]
upper = [1.2, 1, 0.6]
"""
SOLID = """\
[[solid]]
centre = [1.8, 0.9, 0.1]
size = [0.2, 0.2, 0.3]
"""
STRUCTURE = """\
[structure]
[[structure.block]]
name = "floating"
centre = [0.5, 0.5, 0.61]
size = [0.3, 0.3, 0.3]
density = 500
[[structure.wall]]
name = "wall"
lower = [1, 0, 0]
size = [0.3, 1, 0.6]
block = [0.3, 0.5, 0.3]
[structure.ground]
[contact]
stiffness = "1 MN/m"
[joints]
strength = "100 kPa"
opening_at_failure = "1 mm"
"""
GAUGES = """\
[[gauge]]
kind = "level"
name = "level"
at = [0.5, 0.1]
[[gauge]]
kind = "pressure"
name = "pressure"
at = [0.5, 0.1, 0.1]
"""
CASE = TIME + WATER + SOLID + STRUCTURE + GAUGES
PARTS = {
    "water": TIME + WATER,
    "solids": TIME + WATER + SOLID.replace("1.8,", "1.1,"),
    "structure": TIME + STRUCTURE,
    "both": CASE,
}


class Silent:
    """A Reporter that prints nothing and never asks to stop."""

    def step(self, time, figures) -> None:
        return None

    def expect(self, calm: bool) -> None:
        return None

    def message(self, text: str) -> None:
        return None

    def stop_requested(self) -> None:
        return None


def warm_up(part: str = "both") -> None:
    """Run the small case of a part in a temporary directory; solids are only cut, since steps are those of water."""
    from coupler.checks.read_case import from_text
    from coupler.run.clock import Clock
    from coupler.run.directory import RunDirectory
    from coupler.run.run import run
    from coupler.scene.build import build

    with tempfile.TemporaryDirectory() as folder:
        file = from_text(PARTS[part], "warm-up", Path(folder))
        if part == "solids":
            build(file.case, Clock())
            return
        with RunDirectory.create(file) as directory:
            run(file.case, directory, Silent())


if __name__ == "__main__":
    from coupler.program.start import one_thread

    one_thread()
    gc.disable()  # numba makes millions of objects and keeps most: looking for those that it does not costs a tenth
    os.environ.setdefault(
        "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1"
    )  # it asks the terminal for colours each time
    for part in sys.argv[1:] or ["both"]:
        warm_up(part)
