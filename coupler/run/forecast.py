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
from coupler.geometry.tank_mesh import finest_cell
from coupler.geometry.tank_regions import bytes_of_cells
from coupler.program.quantities import counted
from coupler.program.terminal import Row, duration, lines
from coupler.run import cost
from coupler.run.fast_openings import resolved_row
from coupler.step.observe import joint_counts

LONGEST_REST_STEP = 0.3
FALL = "time.cfl at the speed of a free fall"
LONG_SUBSTEPS = 10.0
"""Processor time [s] of the substeps from which their saving is worth a remark."""
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
CHECKPOINT_BYTES_PER_CELL = 60
"""Size of one checkpoint per cell, compressed: 40 to 70 of runs of water alone and of the building; blocks take less
than a tenth of it."""
HISTORY_BYTES_PER_STEP = 4000
"""Rows of all histories without gauges."""


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
    remarks: list[str] = []
    cells = blocks = 0
    disk = 0.0
    interval = Schedule.of(case).interval
    outputs = max(1, round(case.time.end / interval))
    step, varies = min(case.time.step_max, interval), False
    if case.water:
        step, varies = _water_rows(case, interval, rows)
        cells, nodes = mesh_size(case.tank)
        disk += DISK_BYTES_PER_NODE * nodes * (outputs + 1)
        if not case.structure:
            rows += _air_rows(case, None)
    # a step ends at each written state, which a step that varies may do anyway
    steps = math.ceil(case.time.end / step) if varies else outputs * math.ceil(interval / step * (1.0 - 1e-9))
    rows.append(Row("steps", steps, "", "at least, while the water is fast" if case.water else ""))
    seconds = cost.SECONDS_OF_A_START + steps * cost.SECONDS_PER_STEP
    if case.water:
        seconds += cost.SECONDS_OF_A_WATER + steps * cost.water_seconds(case, cells)
    if case.structure:
        blocks, moving, of_substeps = _structure_rows(case, rows, steps, exact)
        spent = cost.passes(case) * of_substeps
        remarks += _sleep_remark(case, spent, seconds)
        seconds += cost.SECONDS_OF_A_STRUCTURE + spent
        if case.water and moving:
            seconds += steps * cost.coupling_seconds(cells, moving)
        disk += DISK_BYTES_PER_BLOCK * blocks * (outputs + 1)
    disk += HISTORY_BYTES_PER_STEP * steps + _checkpoint_bytes(case)
    rows.append(Row("written states", outputs + 1, "", ""))
    seconds += (outputs + 1) * cost.state_seconds(cells, blocks)
    rows += _time_rows(seconds)
    rows.append(Row("memory", memory(case, cells, blocks) / 1e6, "MB", "about"))
    rows.append(Row("disk", disk / 1e6, "MB", _disk_remark(disk, shutil.disk_usage(place).free)))
    return Forecast(rows, tuple(remarks))


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


def _water_rows(case: Case, interval: float, rows: list[Row]) -> tuple[float, bool]:
    """Add the rows of the water; return the step [s] that its largest speed allows, and whether that speed sets it, so
    that slower water takes longer ones."""
    cells, nodes = mesh_size(case.tank)
    volume = cost.volume_in(case.tank, case.water.fill)
    height = _highest(case) - case.tank.lower[2]
    g, h = case.case.gravity, finest_cell(case.tank)
    thrown = max((math.hypot(*fill.velocity) for fill in case.water.fill), default=0.0)
    fastest = math.hypot(math.sqrt(2.0 * g * height), thrown)
    limits = {
        "time.step_max": case.time.step_max,
        "time.output_every": interval,
        FALL: case.time.cfl * h / fastest if fastest > 0.0 else math.inf,
        "the cell size at rest": LONGEST_REST_STEP * math.sqrt(h / g) if g > 0.0 else math.inf,
    }
    reason = min(limits, key=limits.get)
    rows.append(Row("mesh", cells, "cells", f"{nodes} nodes, edge {h:.4g} m"))
    rows.append(Row("water", volume, "m3", "in the fill boxes, solids not taken off"))
    rows.append(Row("step", 1e3 * limits[reason], "ms", f"set by {reason}"))
    return limits[reason], reason == FALL


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


def _time_rows(seconds: float) -> Iterator[Row]:
    """Rows of processor time, and of wall time beside the programs that run now."""
    busy = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    share = min(1.0, (os.cpu_count() or 1) / (1.0 + busy))
    yield Row(
        "processor time",
        seconds,
        "s",
        "about, to a factor of 1.6; more where much breaks or fast water splashes",
    )
    wall = seconds / share
    beside = f"beside {counted(round(busy), 'other program')}" if busy >= 1.0 else "on this machine as it is"
    yield Row("wall time", wall, "s", beside if wall < 60.0 else f"{duration(wall)}, {beside}")


def _sleep_remark(case: Case, spent: float, else_spent: float) -> Iterator[str]:
    """That buildings can sleep, where substeps of joined blocks take most of a run [s] in which water comes to them.

    else_spent [s]: what the water and the start of the run take."""
    sleeps = case.structure.sleep is not None
    if sleeps or case.joints is None or case.water is None or spent < LONG_SUBSTEPS:
        return
    if spent > else_spent:
        yield (
            f"substeps of the blocks take about {duration(spent)} of it: with an empty section [structure.sleep] "
            "buildings whose loads do not change make none, which saves about half where water reaches them late or "
            "only a few of them; `surgebreak explain structure.sleep` says at what error"
        )


def _structure_rows(case: Case, rows: list[Row], steps: int, exact: bool) -> tuple[int, int, float]:
    """Rows of the structure in a run of so many steps; the number of its blocks, of those that can move, and the
    processor time [s] of their substeps."""
    from coupler.scene.build import build_structure

    structure = build_structure(case)
    try:
        limit, substep = structure.substep_limit(), structure.substep()
        mass = float(structure.mass[~structure.fixed].sum())
        weight = f"{mass:.4g} kg" if mass < 1e3 else f"{mass / 1e3:.4g} t"
        rows.append(Row("blocks", structure.n, "", f"{weight} that can move"))
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
        # a step takes one substep at least
        substeps = max(math.ceil(case.time.end / substep), steps)
        rows.append(Row("substeps", substeps, "", "at least one a step" if substeps == steps else ""))
        if structure.joints is not None and case.structure.start == "settled":
            _row_at_rest(structure, rows)
        if case.water:
            rows += _air_rows(case, structure)
        seconds = cost.structure_seconds(structure, substeps)
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
