"""Compile the numba kernels once, by a run of two steps that uses all of them; the results are thrown away.

Numba keeps what it compiled beside the sources, so later runs start at once. Without this the first run of a
user pays for it.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

CASE = """\
[case]
title = "warm-up"
[time]
end = "20 ms"
step_max = "10 ms"
[tank]
lower = [0, 0, 0]
upper = [2, 1, 1]
cell = 0.25
[[water.fill]]
lower = [0, 0, 0]
upper = [1.2, 1, 0.6]
[[solid]]
centre = [1.8, 0.9, 0.1]
size = [0.2, 0.2, 0.3]
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
[[gauge]]
kind = "level"
name = "level"
at = [0.5, 0.1]
[[gauge]]
kind = "pressure"
name = "pressure"
at = [0.5, 0.1, 0.1]
"""


class Silent:
    """A Reporter that tells nothing and is never asked to stop."""

    def step(self, time, figures) -> None:
        return None

    def expect(self, calm: bool) -> None:
        return None

    def message(self, text: str) -> None:
        return None

    def stop_requested(self) -> None:
        return None


def warm_up() -> None:
    """Run the small case in a temporary directory."""
    from coupler.checks.read_case import load
    from coupler.run.directory import RunDirectory
    from coupler.run.run import run

    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "case.toml").write_text(CASE, encoding="utf-8")
        file = load(folder)
        with RunDirectory.create(file) as directory:
            run(file.case, directory, Silent())


if __name__ == "__main__":
    from coupler.program.start import one_thread

    one_thread()
    warm_up()
