"""Stability of the vibration of a bonded wall in still water with one pass and with two.

`python -m coupler.commands.verify.stability` prints the whole map: growth per step over density, damping, step and
passes.

The load is applied suddenly, and the wall vibrates far below damage. A coupling that treats the stiffness of the
structure implicitly over the step is not stable for that reason alone: the blocks respond with their mean motion over
the step, whereas the pressure solve assumed the implicit one. The growth is small (some ten thousandths per step) and
becomes visible only after hundreds of steps.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coupler.case.case import Case
from coupler.commands.verify.registry import Finding, check
from coupler.run.clock import Clock
from coupler.scene.build import build

STEPS = 600
WINDOWS = 6
"""Number of windows; growth follows from the largest speed in each."""
GROWS = 1e-3
"""Growth a step above which a run counts as unstable."""


@dataclass(frozen=True)
class Scene:
    """density [kg/m³] of the blocks · damping ζ of the joints at their highest frequency · dt [s] · passes."""

    density: float
    damping: float
    dt: float
    passes: int


def swinging_wall(scene: Scene):
    """The coupling: a wall of eight courses, 2 m high, 1 m of water on one side. Close its structure after use."""
    course = [0.2, 0.502, 0.25]
    case = Case.model_validate(
        {
            "case": {"title": "wall that swings in still water"},
            "time": {"end": 100.0, "step_max": scene.dt},
            "tank": {"lower": [0, 0, 0], "upper": [2.5, 0.5, 2.5], "cell": 0.25, "open": ["z+"]},
            "water": {"covers": "multiple", "fill": [{"lower": [0, 0, 0], "upper": [1.1, 0.5, 1.0]}]},
            "structure": {
                "density": scene.density,
                "start": "sudden",
                "ground": {"level": 0.0},
                "wall": [
                    {"name": "wall", "lower": [1.1, -0.001, 0], "size": [0.2, 0.502, 2], "block": course}
                ],
            },
            "joints": {"strength": 1e7, "opening_at_failure": 1e-2, "damping": scene.damping},
            "coupling": {"passes": scene.passes},
        }
    )
    return build(case, Clock()).coupling


def growth(scene: Scene, steps: int = STEPS) -> float:
    """Growth factor per step of the largest speed of the wall, from the second window of the run to the last. Below 1
    the vibration decays; the factor is infinite if a joint breaks."""
    coupling = swinging_wall(scene)
    coupling.tolerance = 1e-6  # every step takes all its passes
    coupling.defects.most = np.inf
    structure, speed = coupling.structure, []
    try:
        for _ in range(steps):
            coupling.step(scene.dt)
            speed.append(np.abs(structure.velocity()[:, 0]).max())
            if not structure.joint_table().alive.all():
                return np.inf
    finally:
        structure.close()
    largest = np.array(speed).reshape(WINDOWS, -1).max(axis=1)
    return float((largest[-1] / largest[1]) ** (1.0 / (steps * (WINDOWS - 2) / WINDOWS)))


@check(
    "P58",
    "a bonded wall swings in still water: one pass and two",
    "no growth without damping (own check)",
    "M",
)
def passes():
    for density, damping, number in ((2400.0, 0.02, 1), (2400.0, 0.0, 2), (500.0, 0.0, 2)):
        found = growth(Scene(density, damping, 0.01, number), 300)
        what = f"growth a step, {density:g} kg/m³, damping {damping:g}, dt 10 ms, {number} pass{'es' * (number > 1)}"
        yield Finding(what, max(found, 1.0), 1.0, GROWS, False)


def table(densities=(2400.0, 500.0), dampings=(0.0, 0.02, 0.1), steps=(0.01, 0.001)) -> Iterator[str]:
    """Lines of a table, one for each density, damping and step; columns are the passes."""
    yield "| density [kg/m³] | damping | dt [ms] | growth a step, 1 pass | 2 passes |"
    yield "|--:|--:|--:|--:|--:|"
    for density in densities:
        for damping in dampings:
            for dt in steps:
                found = [growth(Scene(density, damping, dt, number)) for number in (1, 2)]
                shown = " | ".join(f"{value:.5f}" for value in found)
                yield f"| {density:g} | {damping:g} | {1e3 * dt:g} | {shown} |"


def main() -> None:
    """Print the table row by row; arguments: densities to use instead of the default ones."""
    densities = tuple(float(word) for word in sys.argv[1:]) or (2400.0, 500.0)
    for line in table(densities):
        print(line, flush=True)


if __name__ == "__main__":
    main()
