"""One law of this program in a process of its own: `python -m coupler.commands.compare.own REQUEST.json` writes a table
and figures.

The structure is built and moved as in a run of the case; the columns and figures are those of the stock scripts
(yade_scripts/stock/driver.py). Where its motion would be unstable at the substep, there is no table, and the only
figure is TOO_LONG, the reason.
"""

from __future__ import annotations

import csv
import json
import sys
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from coupler.checks.read_case import load
from coupler.run.clock import Clock
from coupler.scene.build import build
from yade_scripts.blocks.faces import touching_faces
from yade_scripts.dynamics.description import local_origin, moved_block
from yade_scripts.dynamics.timestep import SubstepTooLong
from yade_scripts.joints.cohesion import JointParameterError
from yade_scripts.stock.scene import described

COLUMNS = ("time", "displacement", "force", "kinetic", "stored", "work", "dissipated", "joints_broken")

TOO_LONG = "too_long"

CHUNKS = 50
"""Calls of `advance` in the run that is timed: as few as a long run has, since a record is not part of the cost."""


@dataclass(frozen=True)
class Request:
    """What to run: the case with overrides, a multiple of its own substep, records, and where to write."""

    case: str
    overrides: tuple[str, ...]
    substeps: int
    records: int
    folder: str
    stem: str
    scene: str = ""
    """Where to write the blocks and joints for the stock laws; empty: not at all."""

    def write(self, path: Path) -> None:
        """As JSON."""
        path.write_text(json.dumps(asdict(self)), encoding="utf-8")


def run(request: Request) -> tuple[list[tuple], dict]:
    """Rows of COLUMNS and the figures of a run. Raises SubstepTooLong."""
    file = load(Path(request.case), request.overrides)
    structure = build(file.case, Clock()).coupling.structure
    own = structure.stable_substep()[0]
    end, substep = file.case.time.end, own * request.substeps
    records = min(request.records, max(1, int(np.ceil(end / substep))))
    start = structure.save()
    rows, substeps = [row(structure)], 0
    for _ in range(records):
        report = structure.advance(end / records, substep)
        substeps += report.substeps
        rows.append(row(structure))
    table = structure.joint_table()
    broken = np.flatnonzero(~table.alive)
    structure.restore(start)
    cpu, timed = cost(structure, end, substep)
    figures = {
        "cpu_seconds": cpu * substeps / timed,
        "substeps": substeps,
        "substep": report.dt_s,
        "own_substep": own,
        "joints": len(table),
        "blocks": structure.n,
        "failed_at": {int(j): float(table.failure_time[j]) for j in broken},
    }
    if request.scene:
        write_stock_scene(structure, Path(request.scene))
    structure.close()
    return rows, figures


def cost(structure, end: float, substep: float) -> tuple[float, int]:
    """CPU seconds and substeps of the same run without records, in CHUNKS calls of `advance`."""
    began, substeps = time.process_time(), 0
    for _ in range(CHUNKS):
        substeps += structure.advance(end / CHUNKS, substep).substeps
    return time.process_time() - began, substeps


def write_stock_scene(structure, path: Path) -> None:
    """Blocks and joints as they were built, described for the stock laws (`timed` adds law and times)."""
    parameters = structure.joints.parameters
    if not structure.joint_rules.plain:
        raise JointParameterError(
            "joints.pair and joints.distribution are not known to the stock laws; leave them out"
        )
    origin = local_origin(structure.blocks)
    blocks = [moved_block(b, -origin) for b in structure.blocks]
    planes = [replace(p, point=p.point - origin) for p in structure.planes if parameters.ground]
    friction = structure.contact.friction if structure.contact else 0.0
    faces = touching_faces(blocks, planes)
    scene = described(blocks, faces, parameters, len(parameters.rule), friction, structure.gravity)
    path.write_text(json.dumps(scene), encoding="utf-8")


def row(structure) -> tuple:
    """A record of COLUMNS [s, m, N, J, J, J, J, -]; force and displacement of the driven blocks along their motion."""
    velocity = structure.velocity()[structure.fixed]
    speed = float(np.linalg.norm(velocity[:, :3], axis=1).max(initial=0.0))
    power = float((structure.reaction()[structure.fixed, :3] * velocity[:, :3]).sum())
    energies = structure.energies()
    return (
        structure.time,
        structure.time * speed,
        power / speed if speed else 0.0,
        energies["kinetic"],
        energies["joint_stored"],
        energies["driving_work"],
        energies["joint_dissipated"],
        int((~structure.joint_table().alive).sum()),
    )


def main() -> None:
    """Read the request, run, write STEM.csv and STEM.json."""
    request = Request(**json.loads(Path(sys.argv[1]).read_text(encoding="utf-8")))
    path = Path(request.folder) / f"{request.stem}.json"
    try:
        rows, figures = run(request)
    except SubstepTooLong as error:
        path.write_text(json.dumps({TOO_LONG: str(error)}), encoding="utf-8")
        return
    with (Path(request.folder) / f"{request.stem}.csv").open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([COLUMNS, *rows])
    path.write_text(json.dumps(figures), encoding="utf-8")


if __name__ == "__main__":
    main()
