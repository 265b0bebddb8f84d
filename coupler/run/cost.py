"""Processor time of the parts of a run, before it begins.

Each constant was read off the parts of runs of the cases and of scenes beside them, one thread of machine C of
docs/speed.md, which compares the sum with what the cases took."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from coupler.case.case import Case, Tank
from coupler.case.inflow_records import record_of
from coupler.case.water import Fill
from coupler.geometry.start_surfaces import volume
from coupler.geometry.tank_mesh import water_in

if TYPE_CHECKING:
    from yade_scripts.blocks.block import Block
    from yade_scripts.dynamics.structure import Structure

SECONDS_PER_SUBSTEP, SECONDS_PER_BLOCK, SECONDS_PER_POINT = 1.2e-4, 1.7e-6, 1.7e-7
"""Processor time [s] of a substep, and more for each block, whose state is exchanged with YADE, and for each Gauss
point of a joint."""
SECONDS_PER_LOOSE_BOX = 2.5e-6
"""The same for a box without a joint, whose contacts must be found; other blocks in proportion to their nodes times
their faces, as the nodes of one are looked for behind the faces of another: stones of ten corners take five times as
long."""
PASSES = 1.4
"""Passes a step where water moves blocks; 1.0 to 1.6 in the cases, by how much gives way."""
AWAKE = 0.5
"""Share of the substeps' time that a structure takes whose buildings sleep until the water reaches them."""
SECONDS_OF_A_START, SECONDS_OF_A_WATER, SECONDS_OF_A_STRUCTURE = 0.7, 0.9, 0.6
"""Before the first step: of every run, and what each side adds."""
SECONDS_PER_STEP, SECONDS_PER_WATER_STEP = 5e-3, 7e-3
"""[s] Balances and histories of a step, and the part of a step of the water that does not depend on its size."""
SECONDS_PER_CELL, SECONDS_PER_WET_CELL = 2e-7, 1.6e-6
"""Of a step: for each cell of the mesh, and for each that holds water."""
SECONDS_PER_RUBBED_CELL, SECONDS_PER_SHEARED_CELL = 7e-7, 2.6e-6
"""More for each wet cell where walls rub by a log law; and where the water has a viscosity, of its own or the eddies'
of Manning's law, which is solved for in all of it."""
SECONDS_PER_CUT, SECONDS_PER_CUT_CELL, SECONDS_PER_WET_BLOCK = 5e-3, 6e-7, 1e-3
"""Of a step in which blocks move in water: its part that does not depend on their number, more for each cell of the
mesh (lists that are made anew), and for each block (cutting, carrying over, its rows of the pressure)."""
SAMPLES = 100
"""Instants at which the level of a record is read for its mean over the run."""
SPREAD = 1.15
"""Wet cells over those that the volume of the water would fill: cells that the surface cuts count in full."""
SECONDS_PER_STATE_CELL, SECONDS_PER_STATE_BLOCK = 5e-7, 7e-4
"""Of a written state. Where each comes from: docs/speed.md."""


def _level_of_sides(case: Case) -> float:
    """Height z [m] up to which inflows and seas can fill the tank: the mean of a record over the run, since waves come
    and go; below the tank without any."""
    found = [sea.level for sea in case.water.sea]
    for spec in case.water.inflow:
        if spec.kind == "record":
            record = record_of(spec)
            instants = [case.time.end * (k + 0.5) / SAMPLES for k in range(SAMPLES)]
            found.append(sum(record.level_at(time) for time in instants) / SAMPLES)
        elif spec.kind in ("steady", "bore"):
            found.append(spec.level)
    return min(max(found, default=-math.inf), case.tank.upper[2])


def structure_seconds(structure: Structure, substeps: int) -> float:
    """Estimated processor time [s] of that many substeps while joints hold."""
    points = 0 if structure.joints is None else len(structure.joints.weight)
    loose = sum(_boxes(structure.blocks[i]) for i in structure.loose().nonzero()[0])
    each = SECONDS_PER_SUBSTEP + SECONDS_PER_BLOCK * structure.n + SECONDS_PER_POINT * points
    return substeps * (each + SECONDS_PER_LOOSE_BOX * loose)


def _boxes(block: Block) -> float:
    """Nodes times faces of a block over those of a box, which are 26 and 6; nodes are corners, and middles of edges and
    faces."""
    corners, faces = len(block.vertices), len(block.faces)
    nodes = 2 * (corners + faces) - 2
    return nodes * faces / (26 * 6)


def wet_cells(case: Case, cells: int) -> float:
    """Mean number of cells with water over a run, of so many: half way between the water at the start and that up to
    the level that its sides lead to."""
    lower, upper = case.tank.lower, case.tank.upper
    room = volume_in(case.tank, [Fill(lower=lower, upper=upper)])
    start = end = volume_in(case.tank, case.water.fill)
    level = _level_of_sides(case)
    if level > lower[2]:
        end = max(start, volume_in(case.tank, [Fill(lower=lower, upper=[*upper[:2], level])]))
    return min(SPREAD * 0.5 * (start + end) / room, 1.0) * cells


def volume_in(tank: Tank, fills) -> float:
    """Volume [m³] of boxes of water in a tank, solids not taken off."""
    return sum(map(volume, fills)) if tank.is_box else water_in(tank, fills)


def water_seconds(case: Case, cells: int) -> float:
    """Processor time [s] of a step of the water on so many cells."""
    water, wet = case.water, wet_cells(case, cells)
    each = SECONDS_PER_WET_CELL
    if water.viscosity > 0.0 or water.manning is not None:
        each += SECONDS_PER_SHEARED_CELL
    elif water.walls != "slip":
        each += SECONDS_PER_RUBBED_CELL
    return SECONDS_PER_WATER_STEP + SECONDS_PER_CELL * cells + each * wet


def passes(case: Case) -> float:
    """How often the substeps of a run are computed, buildings that sleep taken off."""
    each = PASSES if case.water else 1.0
    return each if case.structure.sleep is None else AWAKE * each


def coupling_seconds(cells: int, moving: int) -> float:
    """Processor time [s] of a step for what blocks that move in water take beside both sides, on so many cells."""
    return SECONDS_PER_CUT + SECONDS_PER_CUT_CELL * cells + SECONDS_PER_WET_BLOCK * moving


def state_seconds(cells: int, blocks: int) -> float:
    """Processor time [s] to write a state."""
    return SECONDS_PER_STATE_CELL * cells + SECONDS_PER_STATE_BLOCK * blocks
