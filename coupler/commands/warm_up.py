"""Compile kernels by runs of two steps whose results are thrown away: `python -m coupler.commands.warm_up PART...`.

Numba keeps what it compiled, so later runs start at once. `coupler.run.compile_ahead` starts processes for the
parts that a case needs. Without a part, the scene that has water and a structure is run, which uses the kernels of all.

Two processes that make the same step reach its kernels in the same order, and one always waits for the other. The part
"solids" therefore calls kernels of the middle and the end of a step directly while another process begins its first
step: the linear solver, the extrapolation of the velocity, gauges, the rows that couple blocks and pressure, and the
volume that bodies displace.
"""

from __future__ import annotations

import gc
import os
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fluid.step.water import Water

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
FAST = "velocity = [3, 0, 0]\n"
PIER = """\
[[solid]]
centre = [1.1, 0.9, 0.4]
size = [0.2, 0.2, 0.8]
"""
PARTS = {
    "water": TIME + WATER + FAST,
    "solids": TIME + WATER + PIER,
    "structure": TIME + STRUCTURE,
    "both": CASE,
}


class Silent:
    """A Reporter that prints nothing and never asks to stop."""

    def step(self, time, figures) -> None:
        """Nothing."""

    def expect(self, calm: bool, broken: bool) -> None:
        """Nothing."""

    def message(self, text: str) -> None:
        """Nothing."""

    def stop_requested(self) -> None:
        """Never asks."""


def warm_up(part: str = "both") -> None:
    """Run the small case of a part in a temporary directory. The part "solids" makes no step: its scene is built, and
    kernels of the end of a step are called."""
    from coupler.checks.read_case import from_text
    from coupler.run.clock import Clock
    from coupler.run.directory import RunDirectory
    from coupler.run.run import run
    from coupler.scene.build import build

    with tempfile.TemporaryDirectory() as folder:
        file = from_text(PARTS[part], "warm-up", Path(folder))
        if part == "solids":
            call_last_kernels(build(file.case, Clock()).coupling.water)
            return
        with RunDirectory.create(file) as directory:
            run(file.case, directory, Silent())


def call_last_kernels(water: Water) -> None:
    """Call kernels that a step uses after its beginning, on the state of a `Water` that has made no step."""
    import numpy as np
    import scipy.sparse as sp

    import kernels.threads as threads
    from coupler.step.coupling_rows import Wetting
    from fluid.numerics.solve import MULTIGRID_FROM, solve
    from fluid.pressure.waterline import hydrostatic_stiffness
    from fluid.readings import gauges
    from fluid.surface.extrapolation import extend_velocity

    threads.use(2, least=1)
    threads.zeros((1000,))
    threads.use(1)
    ones = np.ones(MULTIGRID_FROM)
    matrix = sp.diags_array([-ones, 2.1 * ones, -ones], offsets=(-1, 0, 1), shape=(len(ones), len(ones)))
    solve(matrix.tocsr(), ones, np.zeros(len(ones)), 1e-6)
    topology, u, a = water.topology, water.velocity.copy(), water.acceleration.copy()
    wet = water.level_set < 0.0
    wet_cells = np.flatnonzero(wet[topology.cells].all(axis=1))
    layers = water.listed, water.layer_start
    extend_velocity(topology, layers, wet, wet_cells, u, a, 1.0, water.velocity)
    gauges.level(water, [0.5, 0.1])
    gauges.pressure(water, [0.5, 0.1, 0.1])
    wetting = Wetting.of(sp.csr_array(np.ones((2, 6))))
    wetting.on_water(wetting.on_bodies(np.ones(2)))
    hydrostatic_stiffness(water, water.level_set, np.ones(water.domain.n_bodies, bool))
    water.pushed_by[:] = 1.0
    water.displacement(1e-3)


if __name__ == "__main__":
    from coupler.program.start import one_thread

    one_thread()
    gc.disable()  # numba makes millions of objects and keeps most: looking for those that it does not costs a tenth
    os.environ.setdefault(
        "NUMBA_DISABLE_ERROR_MESSAGE_HIGHLIGHTING", "1"
    )  # it asks the terminal for colours each time
    for part in sys.argv[1:] or ["both"]:
        warm_up(part)
