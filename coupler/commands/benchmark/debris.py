"""Processor time of debris in a coupled step, by part: `python -m coupler.commands.benchmark.debris [BLOCKS]`.

The same mesh and water are measured without blocks, with blocks and single covers, and with blocks and multiple
covers; the difference of the last two is the cost of the covers. The result is the median of STEPS in CPU milliseconds
per step.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from coupler.program.process import run_module
from coupler.run.clock import Clock
from coupler.step.coupled_step import CoupledStepper
from coupler.step.immersion import Immersion
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

BLOCKS, STEPS, WARM = 1000, 8, 3
DT = 0.01
MOST = 2.0
"""Target: a pressure solve with debris, structure included, over one without."""
PARTS = {
    "cut": "geometry",
    "covers": "covers",
    "carry over": "fields carried to the new cells",
    "water": "water: transport, assembly, correction",
    "pressure": "pressure",
    "structure in pressure": "structure for the pressure",
    "structure": "blocks: YADE, contact, saving",
}


def debris(count: int) -> list[Block]:
    """Boxes of 0.5 to 1 m, randomly oriented, 500 to 2400 kg/m³, apart from each other on a lattice."""
    edge = round(np.ceil(np.cbrt(count)))
    random = np.random.default_rng(1)
    places = np.stack(np.meshgrid(*[np.arange(edge)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)[:count]
    return [
        Block(
            f"b{k}",
            2.0 * place + 1.0,
            size=random.uniform(0.5, 1.0, 3),
            rotation=Rotation.from_quat(random.normal(size=4)).as_matrix(),
            density=random.uniform(500.0, 2400.0),
        )
        for k, place in enumerate(places)
    ]


def scene(count: int, covers: str, blocks: list[Block]):
    """(structure or None, coupling, clock): water over all blocks, cells of one metre; its surface is tilted, so that
    the pressure has to be found with blocks and without."""
    edge = 2 * round(np.ceil(np.cbrt(count)))
    size = np.array([edge, edge, edge + 2.0])
    mesh = box_mesh(np.zeros(3), size, 1.0)
    structure = Structure(blocks, ContactLaw(1e7), ground=0.0) if blocks else None
    immersion, clock = Immersion(mesh, structure, [], covers), Clock()
    tilted = lambda x: x[:, 2] - edge - 0.5 - 0.05 * (x[:, 0] - 0.5 * edge)  # noqa: E731
    water = Water(mesh, immersion.domain, tilted, WaterParameters())
    c = CoupledStepper(water, structure, immersion, rtol=1e-8, step_max=DT, clock=clock, passes=2)
    return structure, c, clock


def measured(count: int, covers: str, blocks: str) -> dict:
    """Median milliseconds a step of every part, pressure unknowns, iterations and passes; blocks: "none", "held" or
    "free"."""
    placed = [] if blocks == "none" else [b.changed(fixed=blocks == "held") for b in debris(count)]
    structure, c, clock = scene(count, covers, placed)
    rows, records, before = [], [], {}
    for k in range(WARM + STEPS):
        record = c.step(DT)
        now = dict(clock.seconds)
        if k >= WARM:
            rows.append({name: 1e3 * (now[name] - before.get(name, 0.0)) for name in now})
            records.append(record)
        before = now
    if structure is not None:
        structure.close()
    found = {name: float(np.median([row.get(name, 0.0) for row in rows])) for name in PARTS}
    found["iterations"] = float(np.mean([r.iterations / max(1, r.passes) for r in records]))
    found["passes"] = float(np.mean([r.passes for r in records]))
    found["unknowns"] = records[-1].unknowns
    return found


@dataclass(frozen=True)
class Costs:
    """CPU ms of each part of a step: bare, without blocks; held, with blocks that do not move; full, with free ones,
    covers apart from the geometry."""

    bare: dict
    held: dict
    full: dict

    @property
    def shares(self) -> tuple[float, float]:
        """A pressure solve with the structure inside, over one on the same mesh without blocks, and over one with the
        same cuts and the blocks held."""
        solve = (self.full["pressure"] + self.full["structure in pressure"]) / self.full["passes"]
        return solve / self.bare["pressure"], solve / self.held["pressure"]


def costs(count: int = BLOCKS) -> Costs:
    """Measured in processes of their own: YADE holds one scene."""
    bare, held, single, multiple = (_in_process(count, *case) for case in CASES)
    covers = max(0.0, multiple["cut"] - single["cut"])
    return Costs(bare, held, multiple | {"covers": covers, "cut": multiple["cut"] - covers})


def summary_line(found: Costs, count: int) -> str:
    """A table."""
    tables = (found.bare, found.held, found.full)
    lines = [f"{'CPU ms a step':44}{'no blocks':>12}{f'{count} held':>12}{f'{count} free':>12}"]
    for name, what in (PARTS | {n: n for n in ("unknowns", "iterations", "passes")}).items():
        lines.append(f"{what:44}" + "".join(f"{table.get(name, 0.0):12.4g}" for table in tables))
    none, held = found.shares
    lines.append(
        f"a pressure solve with blocks over one without: {none:.2f}; over one with them held: {held:.2f}"
    )
    return "\n".join(lines)


CASES = (("single", "none"), ("single", "held"), ("single", "free"), ("multiple", "free"))


def _in_process(count: int, covers: str, blocks: str) -> dict:
    words = (count, covers, blocks)
    done = run_module("coupler.commands.benchmark.debris", *words, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Argument COUNT: print the table. Further arguments COVERS and BLOCKS: print one measurement as JSON."""
    words = sys.argv[1:]
    if len(words) < 2:
        count = int(words[0]) if words else BLOCKS
        print(summary_line(costs(count), count))
        return
    print(json.dumps(measured(int(words[0]), words[1], words[2])))


if __name__ == "__main__":
    main()
