"""Checks of the water of a case: walls, friction, and water too thin for the cells. Every check yields (key path,
message)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.types import Problem
from coupler.checks.inflow_volumes import inflow_volume_problems
from coupler.checks.inflows import inflow_remarks, side_problems, struck
from coupler.geometry.bodies import Body
from coupler.geometry.cell_sizes import cells_at, has_equal_cells, places_in, places_in_box, widest_cell
from coupler.geometry.parts import parts_of
from coupler.geometry.solids import solids_of
from coupler.geometry.tank_mesh import finest_cell, floor_along, is_measured, mesh_of, on_side
from coupler.scene.build_water import SLACK, level_at_start

UPWARDS = np.array([0.0, 0.0, 1.0])

LEAST_CELLS = 3
"""Cells of the thinnest water without a remark."""

LEAST_DROP = 2.5
"""Cells of the thinnest water with air on both sides: while it falls a drop of one gains up to half of its energy, of
1.6 up to 20 %, of two 11 %, of two and a half 5 %, of three 1 %; a rescaled level set moves the two surfaces apart."""


def water_problems(case: Case) -> Iterator[Problem]:
    """All faults of [water] that involve more than one of its keys."""
    if case.water is None:
        return
    w = case.water
    if case.case.gravity == 0.0:
        yield (
            ("case", "gravity"),
            "0: water needs gravity, which determines its time step, its spray and its initial pressure; give a small "
            "value, for instance 0.01 m/s2, or leave [water] out",
        )
    if not (w.fill or w.inflow or w.sea):
        yield (
            ("water",),
            "no water: write at least one [[water.fill]] with lower and upper, or an inflow or a sea",
        )
    yield from _walls(w)
    yield from _without_effect(case)
    if case.tank is not None and is_measured(case.tank):
        wrong = list(side_problems(case))
        yield from wrong
        if not wrong:
            yield from inflow_volume_problems(case)
            yield from struck(case)
            yield from _without_air(case)
        yield from _drops(case)


def water_remarks(case: Case) -> Iterator[str]:
    """Water that the mesh does not resolve, and what inflows and seas do beside what they are meant for."""
    yield from thin_water_remarks(case)
    yield from inflow_remarks(case)
    yield from _rough_remarks(case)


def _rough_remarks(case: Case) -> Iterator[str]:
    """Roughness that sticks out of the cells on it: the log law is that of water over it, not among it."""
    k, tank = case.water.roughness if case.water else None, case.tank
    if k is None or tank is None or not is_measured(tank) or k <= finest_cell(tank):
        return
    cell = _finest_on_walls(case)
    if k > cell:
        yield (
            f"water.roughness = {k:.3g} m is larger than the finest cells on walls, solids and blocks ({cell:.3g} m): "
            "the log law describes the flow above the roughness, and in cells smaller than it friction grows without a "
            f"limit as they are refined; take cells larger than {k:.2g} m there, or a bed by water.manning"
        )


def _finest_on_walls(case: Case) -> float:
    """Size [m] of the smallest cells on closed sides that are not smooth, on solids and on blocks at the start."""
    tank, water = case.tank, case.water
    if has_equal_cells(tank):
        return tank.cell
    mesh = mesh_of(tank)
    centre = mesh.nodes[mesh.boundary_faces].mean(axis=1)
    free = {*tank.open, *tank.smooth, *(spec.side for spec in (*water.inflow, *water.sea))}
    off = [on_side(mesh, side, mesh.boundary_normal, centre) for side in free]
    rough = ~np.any(off, axis=0) if off else np.full(len(centre), True)
    sizes = [mesh.local_size[mesh.boundary_cell[rough]]]
    blocks = [Body.of_block(block) for part in parts_of(case) for block in part.blocks]
    for body in (*(solid.body for solid in solids_of(case)), *blocks):
        places = places_in(body)
        inside = ((places >= mesh.bounds[0]) & (places <= mesh.bounds[1])).all(axis=1)
        sizes.append(cells_at(tank, places[inside]))
    return float(np.concatenate(sizes).min(initial=np.inf))


def _without_effect(case: Case) -> Iterator[Problem]:
    """Keys that nothing reads in this case."""
    w = case.water
    if w.openings != "all" and w.covers == "single":
        yield (
            ("water", "openings"),
            f"'{w.openings}' is for several sets of unknowns beside thin walls: write water.covers = \"multiple\", or "
            "leave it out",
        )
    if w.cracks != "open" and case.joints is None:
        yield (
            ("water", "cracks"),
            f"'{w.cracks}' is for joints that break, and there is no section [joints]; leave it out",
        )


def thin_water_remarks(case: Case) -> Iterator[str]:
    """Boxes of water, inflows and seas that are thinner than a few cells; walls and other water lengthen a box."""
    if case.tank is None or case.water is None:
        return
    tank = case.tank
    found = []
    if tank.is_box:
        for i, fill in enumerate(case.water.fill):
            found += [(f"water.fill[{i}]", *free) for free in _free_edges(case, fill)]
    for kind in ("inflow", "sea"):
        for i, spec in enumerate(getattr(case.water, kind)):
            edge = level_at_start(spec) - floor_along(tank, spec.side)
            found.append((f"the water at water.{kind}[{i}]", edge, _cell_along(tank, spec, edge)))
    said: dict[str, None] = {}  # of a cube of water the same of each edge
    for name, edge, cell in found:
        if 0.0 < edge < LEAST_CELLS * cell * (1.0 - SLACK):
            said[
                f"{name} is {edge:.3g} m thin, {edge / cell:.2g} cells: under {LEAST_CELLS} cells water is not "
                f"resolved, volume and energy may be off by more than a run allows; take {_finer(tank, edge / 4)}"
            ] = None
    yield from said


def _finer(tank, cell: float) -> str:
    """What to write for cells of a size [m]: the key of the tank, or that of the parts where they have another size."""
    return f"tank.cell = {cell:.2g} m" if has_equal_cells(tank) else f"cells of {cell:.2g} m there"


def _cell_along(tank, spec, depth: float) -> float:
    """Largest height [m] of the cells along a side in water of this depth [m]."""
    axis = "xyz".index(spec.side[0])
    lower, upper = np.array(tank.lower), np.array(tank.upper)
    lower[2] = floor_along(tank, spec.side)
    upper[2] = lower[2] + max(depth, SLACK * tank.cell)
    if spec.side[1] == "-":
        upper[axis] = lower[axis] + SLACK * tank.cell
    else:
        lower[axis] = upper[axis] - SLACK * tank.cell
    return widest_cell(tank, places_in_box(lower, upper), UPWARDS)


def _drops(case: Case) -> Iterator[Problem]:
    """Boxes of water in the air that are too thin to hold a surface on each of their two sides."""
    for i, fill in enumerate(case.water.fill):
        free = min(_free_edges(case, fill, ends=2), key=lambda one: one[0] / one[1], default=None)
        if free is None:
            continue
        edge, cell = free
        if 0.0 < edge < LEAST_DROP * cell * (1.0 - SLACK):  # corners in the wrong order are reported as such
            yield (
                ("water", "fill", i),
                f"{edge:.3g} m thin, {edge / cell:.2g} cells, with air on both sides: under {LEAST_DROP:g} "
                f"cells the two surfaces cannot be distinguished; take {_finer(case.tank, edge / 3)}, or more water",
            )


def _free_edges(case: Case, fill, ends: int = 1) -> Iterator[tuple[float, float]]:
    """Edges [m] of a box of water of whose two ends at least `ends` are free, that is neither at a wall nor in other
    water, each with the largest size [m] of the cells along it. A box from wall to wall is a slice, whatever its
    width; one on the floor is a layer."""
    slack = SLACK * case.tank.cell
    for axis in range(3):
        low, high = fill.lower[axis], fill.upper[axis]
        at_wall = low <= case.tank.lower[axis] + slack, high >= case.tank.upper[axis] - slack
        others = [f for f in case.water.fill if f is not fill and _meet(f, fill, slack)]
        if sum(at_wall) <= 2 - ends and not others:
            lower = np.maximum(fill.lower, case.tank.lower)
            places = places_in_box(lower, np.maximum(np.minimum(fill.upper, case.tank.upper), lower))
            yield high - low, widest_cell(case.tank, places, np.eye(3)[axis])


def _meet(other, fill, slack: float) -> bool:
    """Whether two boxes of water touch or overlap, so that their water is one."""
    return all(
        other.lower[k] <= fill.upper[k] + slack and fill.lower[k] <= other.upper[k] + slack for k in range(3)
    )


def _walls(w) -> Iterator[Problem]:
    if w.walls == "no-slip" and w.viscosity == 0.0:
        yield ("water", "walls"), "walls that hold the water need water.viscosity"
    laws = [name for name in ("roughness", "manning") if getattr(w, name) is not None]
    if w.walls == "friction" and len(laws) != 1:
        yield (
            ("water", "walls"),
            f"friction needs water.roughness or water.manning, one of them; there are {len(laws)}",
        )
    if w.walls != "friction" and laws:
        yield ("water", laws[0]), f'is for walls = "friction"; they are "{w.walls}"'


def _without_air(case: Case) -> Iterator[Problem]:
    """Water that fills the tank up to its closed top, with a side or a lower sea that it may leave by: nothing can take
    its place."""
    tank = case.tank
    slack = SLACK * tank.cell
    exits = [f"open at {side}" for side in tank.open]
    exits += [
        f"beside a sea at z = {level_at_start(sea):g} m ({sea.side})"
        for sea in case.water.sea
        if level_at_start(sea) < tank.upper[2] - slack
    ]
    if tank.mesh is not None or not exits or "z+" in tank.open:
        return
    for i, fill in enumerate(case.water.fill):
        low = all(end <= wall + slack for end, wall in zip(fill.lower, tank.lower))
        if low and all(end >= wall - slack for end, wall in zip(fill.upper, tank.upper)):
            yield (
                ("water", "fill", i),
                f"fills the whole tank, which is {' and '.join(exits)} and closed above: no air is there to take the "
                'place of what leaves; open the top (tank.open with "z+"), or end the water below it',
            )
