"""Forecast of a run before it begins: steps, substeps, memory, disk space, and what determines them.

The number of steps follows from the speed √(2 g H) of a fall from the highest water; the substep is that of the
structure. Memory and disk space per cell were measured in runs; they are forecasts and not bounds.
"""

from __future__ import annotations

import math
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from coupler.case.case import Case
from coupler.case.inflow_records import record_of
from coupler.case.schedule import Schedule, checkpoint_interval
from coupler.checks.places import mesh_size
from coupler.geometry import start_surfaces
from coupler.geometry.tank_mesh import finest_cell, water_in
from coupler.geometry.tank_regions import bytes_of_cells
from coupler.program.quantities import counted
from coupler.program.terminal import Row, duration, lines
from coupler.run.fast_openings import resolved_row
from coupler.step.observe import joint_counts

LONGEST_REST_STEP = 0.3
NO_DAMAGE = 1e-12
"""Damage of joints that is round-off."""
BYTES_PER_BLOCK = 60_000
"""Resident memory per block, its contact nodes included."""
BYTES_PER_WET_BLOCK = 300_000
"""The same with the cells that it cuts."""
BYTES_PER_COUPLED_CELL = 750
"""Resident memory per cell where blocks move, since two domains exist at once at times."""
PROGRAM_BYTES = {"base": 105e6, "water": 155e6, "structure": 330e6, "both": 385e6}
"""Resident memory of code and libraries: of every run, and what each side adds, kernels included."""
DISK_BYTES_PER_NODE = 12
"""Compressed level set, velocity and pressure of one written state."""
DISK_BYTES_PER_BLOCK = 150
CHECKPOINT_BYTES_PER_CELL = 36
"""Size of one checkpoint per cell, compressed; blocks take less than a tenth of it."""
HISTORY_BYTES_PER_STEP = 4000
"""Rows of all histories without gauges."""
SECONDS_PER_SUBSTEP, SECONDS_PER_POINT, SECONDS_PER_LOOSE_BLOCK = 1.2e-4, 1.7e-7, 3e-6
"""Processor time of a substep, and more for each Gauss point of a joint and for each block without a joint, whose
contacts must be found."""
SECONDS_OF_A_START, SECONDS_OF_A_STRUCTURE = 1.0, 0.8
SECONDS_PER_STEP, SECONDS_PER_WATER_STEP = 5e-3, 5e-3
"""[s] Balances and histories of a step, and the part of a step of the water that does not depend on its size."""
SECONDS_PER_CELL, SECONDS_PER_WET_BLOCK = 6e-7, 1.2e-3
"""Of a step: for each cell of the mesh, and for each block that moves in water (cutting, carrying over, its rows of the
pressure)."""
SECONDS_PER_STATE_CELL, SECONDS_PER_STATE_BLOCK = 5e-7, 7e-4
"""Of a written state. All read off ten of the cases, one thread of an AMD EPYC; see docs/speed.md."""


@dataclass(frozen=True)
class Forecast:
    """rows: (name, value, unit, remark), in the order of output · remarks: further sentences."""

    rows: list[Row]
    remarks: tuple[str, ...] = ()

    def __getitem__(self, name: str) -> str | float | int:
        """The value of a row, in its unit. Raises KeyError."""
        for row in self.rows:
            if row.name == name:
                return row.value
        raise KeyError(f"{name}: not in this forecast; it has {', '.join(row.name for row in self.rows)}")

    def __str__(self) -> str:
        return "\n".join([*lines(self.rows), *(f"note: {remark}" for remark in self.remarks)])


def forecast(case: Case, exact: bool = False, place: Path = Path()) -> Forecast:
    """The forecast of a case; starts YADE when the case has a structure, to ask it for the substep.

    exact: with the exact frequency of the joints beside the bound that sets the substep (an eigenvalue problem) ·
    place: a directory on the disk that the results go to."""
    rows: list[Row] = []
    cells = blocks = 0
    disk = 0.0
    interval = Schedule.of(case).interval
    outputs = max(1, round(case.time.end / interval))
    step = min(case.time.step_max, interval)
    if case.water:
        step = _water_rows(case, interval, rows)
        cells, nodes = mesh_size(case.tank)
        disk += DISK_BYTES_PER_NODE * nodes * (outputs + 1)
        if not case.structure:
            rows += _air_rows(case, None)
    steps = math.ceil(case.time.end / step)
    rows.append(Row("steps", steps, "", "at least, while the water is fast" if case.water else ""))
    seconds = SECONDS_OF_A_START + steps * SECONDS_PER_STEP
    if case.water:
        seconds += steps * (SECONDS_PER_WATER_STEP + SECONDS_PER_CELL * cells)
    if case.structure:
        blocks, moving, substeps = _structure_rows(case, rows, exact)
        seconds += SECONDS_OF_A_STRUCTURE + substeps
        seconds += SECONDS_PER_WET_BLOCK * moving * steps if case.water else 0.0
        disk += DISK_BYTES_PER_BLOCK * blocks * (outputs + 1)
    disk += HISTORY_BYTES_PER_STEP * steps + _checkpoint_bytes(case)
    rows.append(Row("written states", outputs + 1, "", ""))
    seconds += (outputs + 1) * (SECONDS_PER_STATE_CELL * cells + SECONDS_PER_STATE_BLOCK * blocks)
    rows += _time_rows(seconds)
    rows.append(Row("memory", memory(case, cells, blocks) / 1e6, "MB", "about"))
    rows.append(Row("disk", disk / 1e6, "MB", _disk_remark(disk, shutil.disk_usage(place).free)))
    return Forecast(rows)


def memory(case: Case, cells: int, blocks: int) -> float:
    """Largest resident memory [B] of a run with so many cells and blocks."""
    if case.water is None:
        return PROGRAM_BYTES["base"] + PROGRAM_BYTES["structure"] + BYTES_PER_BLOCK * blocks
    if case.structure is None:
        held = bytes_of_cells(cells, case.tank.mesh is not None)
        return PROGRAM_BYTES["base"] + PROGRAM_BYTES["water"] + held
    both = PROGRAM_BYTES["base"] + PROGRAM_BYTES["both"]
    return both + BYTES_PER_COUPLED_CELL * cells + BYTES_PER_WET_BLOCK * blocks


def _disk_remark(wanted: float, free: float) -> str:
    """Whether the disk has room for the results [B]."""
    if wanted < free:
        return "about"
    return f"more than the {free / 1e6:.4g} MB that are free: raise time.output_every, or give --output another disk"


def _checkpoint_bytes(case: Case) -> float:
    """Size [B] of the checkpoints that are kept; 0 if the case asks for none."""
    if checkpoint_interval(case) == 0.0 or case.water is None:
        return 0.0
    from coupler.run.checkpoint import KEPT

    return float(KEPT * CHECKPOINT_BYTES_PER_CELL * mesh_size(case.tank)[0])


def _water_rows(case: Case, interval: float, rows: list[Row]) -> float:
    """Add the rows of the water; return the step [s] that its largest speed allows."""
    cells, nodes = mesh_size(case.tank)
    volume = sum(start_surfaces.volume(fill) for fill in case.water.fill)
    if not case.tank.is_box:
        volume = water_in(case.tank, case.water.fill)
    height = _highest(case) - case.tank.lower[2]
    g, h = case.case.gravity, finest_cell(case.tank)
    fastest = math.sqrt(2.0 * g * height)
    limits = {
        "time.step_max": case.time.step_max,
        "time.output_every": interval,
        "time.cfl at the speed of a free fall": case.time.cfl * h / fastest if fastest > 0.0 else math.inf,
        "the cell size at rest": LONGEST_REST_STEP * math.sqrt(h / g) if g > 0.0 else math.inf,
    }
    reason = min(limits, key=limits.get)
    rows.append(Row("mesh", cells, "cells", f"{nodes} nodes, edge {h:.4g} m"))
    rows.append(Row("water", volume, "m3", "in the fill boxes, solids not taken off"))
    rows.append(Row("step", 1e3 * limits[reason], "ms", f"set by {reason}"))
    return limits[reason]


def _highest(case: Case) -> float:
    """Height z [m] of the highest water: in the boxes at the start, of a sea, or that comes in."""
    found = [start_surfaces.highest(fill) for fill in case.water.fill]
    found += [sea.level + (sea.tide.amplitude or 0.0 if sea.tide else 0.0) for sea in case.water.sea]
    for spec in case.water.inflow:
        if spec.kind == "record":
            found.append(float(record_of(spec).level.max()))
        else:
            found.append(spec.level + (spec.height if spec.kind in ("solitary", "n-wave") else 0.0))
    return min(max(found), case.tank.upper[2])


def structure_seconds(structure, substeps: int) -> float:
    """Estimated processor time [s] of that many substeps while joints hold."""
    points = 0 if structure.joints is None else len(structure.joints.weight)
    loose = int(structure.loose().sum())
    each = SECONDS_PER_SUBSTEP + SECONDS_PER_POINT * points + SECONDS_PER_LOOSE_BLOCK * loose
    return substeps * each


def _time_rows(seconds: float) -> Iterator[Row]:
    """Rows of processor time, and of wall time beside the programs that run now."""
    busy = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    share = min(1.0, (os.cpu_count() or 1) / (1.0 + busy))
    yield Row(
        "processor time",
        seconds,
        "s",
        "about, to a factor of two; more where much breaks or fast water splashes",
    )
    wall = seconds / share
    beside = f"beside {counted(round(busy), 'other program')}" if busy >= 1.0 else "on this machine as it is"
    yield Row("wall time", wall, "s", beside if wall < 60.0 else f"{duration(wall)}, {beside}")


def _structure_rows(case: Case, rows: list[Row], exact: bool) -> tuple[int, int, float]:
    """Rows of the structure; the number of its blocks, of those that can move, and the processor time [s] of their
    substeps."""
    from coupler.scene.build import build_structure

    structure = build_structure(case)
    try:
        limit, substep = structure.substep_limit(), structure.substep()
        rows.append(
            Row(
                "blocks",
                structure.n,
                "",
                f"{structure.mass[~structure.fixed].sum() / 1e3:.4g} t that can move",
            )
        )
        rows.append(Row("joints", joint_counts(structure).intact, "", ""))
        reason = (
            limit.remark(substep) or f"set by {limit.what if case.structure.substep is None else 'the case'}"
        )
        rows.append(Row("substep", 1e6 * substep, "us", reason))
        fall = _highest(case) - case.tank.lower[2] if case.water else 0.0
        fastest = resolved_row(case, structure, substep, fall)
        rows += [fastest] if fastest is not None else []
        if exact and structure.joints is not None:
            rows.append(_frequency_row(structure, limit.omega))
        rows.append(Row("substeps", math.ceil(case.time.end / substep), "", ""))
        if structure.joints is not None and case.structure.start == "settled":
            _row_at_rest(structure, rows)
        if case.water:
            rows += _air_rows(case, structure)
        seconds = structure_seconds(structure, math.ceil(case.time.end / substep))
        return structure.n, int((~structure.fixed).sum()), seconds
    finally:
        structure.close()


def _air_rows(case: Case, structure) -> list[Row]:
    """Rows about trapped air at the start; none if all air is open."""
    if case.water.air.model == "open":
        return []
    from coupler.run.trapped_air import air_row

    return [air_row(case, structure)]


def _row_at_rest(structure, rows: list[Row]) -> None:
    """Row of the damage under the structure's own weight; raises CannotStand where it cannot carry it."""
    from yade_scripts.dynamics.equilibrium import settle

    moved = settle(structure)
    damage = float(structure.joint_table().damage.max())
    damage = damage if damage > NO_DAMAGE else 0.0
    rows.append(Row("damage at rest", damage, "", f"under its own weight; blocks move {1e3 * moved:.3g} mm"))


def _frequency_row(structure, bound: float) -> Row:
    """ω_max of the joints from the eigenvalue problem of all blocks, and how far the bound is above it."""
    from yade_scripts.dynamics.timestep import exact_joint_frequency

    omega = exact_joint_frequency(structure.blocks, structure.joints)
    remark = f"the bound is {bound / omega:.3f} of it" if omega > 0.0 else "no joint can move"
    return Row("frequency of the joints, exact", omega, "rad/s", remark)
