"""Checks of the positions of bodies and fills. Every check yields (key path, message)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.paths import BadPath
from coupler.case.structure import Building
from coupler.case.types import KeyPath, Problem
from coupler.geometry.basin import basin_problem, outside_of
from coupler.geometry.bodies import Body, overlap_depth
from coupler.geometry.parts import Part, standing_on_terrain
from coupler.geometry.solids import solids_of
from coupler.geometry.start_surfaces import surface_of
from coupler.geometry.tank_mesh import is_basin, is_measured, mesh_of, tank_places
from coupler.geometry.tank_regions import bytes_of_cells
from coupler.geometry.terrain.grid import TerrainError
from coupler.geometry.terrain.standing import ground_surface
from coupler.program.memory import memory

Placed = tuple[KeyPath, str, Body]

TOUCH = 1e-5
"""Overlap below this share of the smallest width is contact, not overlap (rounding of decimals and of files)."""

INTO = 1e-3
"""Share of its thickness by which a block may reach into a terrain, which is uneven."""


def mesh_size(tank) -> tuple[int, int]:
    """Cells and nodes of the mesh of a tank: those of its file, or six tetrahedra a box of about the wanted edge."""
    if not tank.is_box or tank.regions is not None or tank.stretch:
        mesh = mesh_of(tank)
        return len(mesh.cells), len(mesh.nodes)
    edges = np.subtract(tank.upper, tank.lower)
    parts = [int(n) for n in np.maximum(1.0, np.rint(edges / tank.cell))]  # of any length: cells may be tiny
    return 6 * math.prod(parts), math.prod(n + 1 for n in parts)


def solid_bodies(case: Case) -> list[Placed]:
    """The fixed solids."""
    return [(solid.path, solid.name, solid.body) for solid in solids_of(case)]


def frame_problems(case: Case) -> Iterator[Problem]:
    """Rotations without an axis, boxes whose corners are in the wrong order, and parts on a terrain that is absent;
    with any of these, nothing else can be checked."""
    for path, _ in standing_on_terrain(case):
        if case.terrain is None:
            yield (*path, "on"), "there is no section [terrain] to stand on; write one, or leave `on` out"
    turned = [(("solid", i), solid) for i, solid in enumerate(case.solid)]
    turned += [
        (("structure", "block", i), b) for i, b in enumerate(case.structure.block if case.structure else ())
    ]
    for path, body in turned:
        if body.rotation is not None and not np.any(body.rotation.axis):
            yield (*path, "rotation", "axis"), "[0, 0, 0] is not a direction; write for instance [0, 0, 1]"
    if case.tank is not None and is_measured(case.tank):
        yield from corners_in_order(("tank",), case.tank)


def place_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """All faults of positions; parts: those of the structure that could be made."""
    solids = solid_bodies(case)
    blocks = [(part.path, part.name, Body.of_block(b)) for part in parts for b in part.blocks]
    yield from _tank(case)
    yield from tank_places(case)
    yield from _fills(case)
    yield from _overlaps(solids, blocks, [b.name for part in parts for b in part.blocks])
    yield from _outside(case, solids, blocks, [b.name for part in parts for b in part.blocks])
    yield from _in_terrain(case, parts)
    yield from _submerged_fills(case, [*solids, *blocks])


def _in_terrain(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Blocks that are not held, with corners in the ground of a terrain: the contacts of the first step throw them."""
    if not parts or case.tank is None or case.tank.ground is None:
        return
    ground = ground_surface(case)
    driven = {motion.block for motion in case.motion}
    for part in parts:
        worst = None
        for block in part.blocks:
            if block.fixed or block.name in driven:
                continue
            corners = block.world_vertices()
            depth = ground.height(corners) - corners[:, 2]
            k = int(depth.argmax())
            if depth[k] > INTO * 2.0 * float(block.planes[1].min()) and (
                worst is None or depth[k] > worst[0]
            ):
                worst = float(depth[k]), corners[k], block.name
        if worst is not None:
            depth, place, name = worst
            which = "" if name == part.name else f" (block {name})"
            has_on = part.path[1] in ("wall", "building")
            yield (
                part.path,
                f"'{part.name}' reaches {depth:.4g} m into the terrain at ({place[0]:.6g}, {place[1]:.6g}) m, where "
                f"the ground is at z = {place[2] + depth:.6g} m{which}; raise it"
                + (', or let it stand there on a footing with on = "terrain"' if has_on else ""),
            )


def corners_in_order(path: KeyPath, box) -> Iterator[Problem]:
    """Boxes whose upper corner is not above the lower one; path: of the section with both."""
    for axis, low, high in zip("xyz", box.lower, box.upper):
        if low >= high:
            yield (*path, "upper"), f"{axis}: upper ({high:g} m) must be greater than lower ({low:g} m)"


def _tank(case: Case) -> Iterator[Problem]:
    if case.tank is None:
        return
    smallest = min(np.subtract(case.tank.upper, case.tank.lower))
    if case.tank.is_box and 0 < smallest < case.tank.cell:
        yield (
            ("tank", "cell"),
            f"{case.tank.cell:g} m is larger than the smallest side of the tank ({smallest:g} m)",
        )
    elif smallest > 0 and case.water:
        yield from _memory(case)


def _memory(case: Case) -> Iterator[Problem]:
    """A mesh too large for the memory that there is: the system would kill the run without a message."""
    cells, _ = mesh_size(case.tank)
    needed, there = bytes_of_cells(cells, case.tank.mesh is not None), memory()
    if needed > there and case.tank.mesh is not None:
        yield (
            ("tank", "mesh"),
            f"{cells:.3g} cells need about {needed / 1e9:.3g} GB, there are {there / 1e9:.3g} GB for it; mesh coarser",
        )
    elif needed > there:
        fits = case.tank.cell * (needed / there) ** (1.0 / 3.0)
        yield (
            ("tank", "cell"),
            f"{cells:.3g} cells of {case.tank.cell:g} m need about {needed / 1e9:.3g} GB, there are "
            f"{there / 1e9:.3g} GB for it; use cells of {1.1 * fits:.2g} m or more",
        )


def _fills(case: Case) -> Iterator[Problem]:
    for i, fill in enumerate(case.water.fill if case.water else ()):
        path = ("water", "fill", i)
        disorder = list(corners_in_order(path, fill))
        yield from disorder
        if not disorder:
            yield from _start_surface(case, path, fill)
        if case.tank is not None and case.tank.is_box:  # a basin of any shape cuts its boxes of water
            yield from _beyond_tank(case, path, f"water fill {i}", np.array([fill.lower, fill.upper]))


def _start_surface(case: Case, path: KeyPath, fill) -> Iterator[Problem]:
    """A surface of the water that cannot be read, does not cover its box, or lies beside it."""
    if fill.slope is not None and fill.surface is not None:
        yield (*path, "slope"), "the surface is given by a file as well; leave one of them out"
        return
    try:
        surface = surface_of(fill)
    except (TerrainError, BadPath) as error:
        yield (*path, "surface"), str(error)
        return
    if surface is None:
        return
    key = (*path, "slope" if fill.surface is None else "surface")
    x, y, z = surface.sampled()
    unknown = ~np.isfinite(z)
    if unknown.any():
        yield (
            key,
            f"has no height over {unknown.mean():.1%} of the box of water, for instance at ({x[unknown][0]:.6g}, "
            f"{y[unknown][0]:.6g}) m: its points must cover the box, in coordinates of the tank",
        )
        return
    top = int(z.argmax())
    if z[top] <= fill.lower[2]:
        yield (
            key,
            f"lies at z = {z.min():.4g} to {z[top]:.4g} m, below the box of water (z = {fill.lower[2]:g} m)",
        )
    limit, what = fill.upper[2], "upper[2] of the box"
    if fill.surface is None:
        limit, what = (case.tank.upper[2], "the top of the tank") if case.tank is not None else (math.inf, "")
    if z[top] > limit + TOUCH * (fill.upper[2] - fill.lower[2]):
        yield (
            key,
            f"rises to z = {z[top]:.4g} m at ({x[top]:.6g}, {y[top]:.6g}) m, above {what} ({limit:g} m)",
        )


def _beyond_tank(case: Case, path: KeyPath, name: str, bounds: np.ndarray) -> Iterator[Problem]:
    """bounds (2, 3) [m]"""
    slack = TOUCH * np.ptp(bounds, axis=0).min()
    for axis, letter in enumerate("xyz"):
        for side, excess, limit in (
            ("-", case.tank.lower[axis] - bounds[0, axis], case.tank.lower[axis]),
            ("+", bounds[1, axis] - case.tank.upper[axis], case.tank.upper[axis]),
        ):
            if excess > slack:
                yield (
                    path,
                    (
                        f"{name} reaches {excess:.4g} m beyond the side {letter}{side} of the tank "
                        f"({letter} = {limit:g} m); move it or enlarge the tank"
                    ),
                )


def _outside(case: Case, solids: list[Placed], blocks: list[Placed], names: list[str]) -> Iterator[Problem]:
    """Blocks must lie inside the tank; fixed solids may stick out of it, but not be wholly outside."""
    outlines = _outlines(blocks)
    if case.tank is not None:
        tank = Body.between(case.tank.lower, case.tank.upper)
        for path, name, bounds in outlines:
            for place, text in _beyond_tank(case, path, f"'{name}'", bounds):
                yield place, text + _which_blocks(case, path, name, blocks, names)
        if is_basin(case.tank) and basin_problem(mesh_of(case.tank)) is None:
            yield from outside_of(mesh_of(case.tank), [(p, n, body.vertices) for p, n, body in blocks])
        for path, name, body in solids:
            if overlap_depth(tank, body) <= 0:
                yield (
                    path,
                    f"'{name}' lies outside the tank, where there is no water; move it or leave it out",
                )
    ground = case.structure.ground if case.structure else None
    for path, name, bounds in outlines if ground else ():
        depth = ground.level - bounds[0, 2]
        if depth > TOUCH * np.ptp(bounds, axis=0).min():
            yield path, f"'{name}' reaches {depth:.4g} m below the ground (z = {ground.level:g} m); raise it"


def _which_blocks(case: Case, path: KeyPath, name: str, blocks: list[Placed], names: list[str]) -> str:
    """Which blocks of a part reach out of the tank, where it has several: of a file they are found by number alone."""
    of_part = [
        (own, np.array(body.bounds()))
        for (at, part, body), own in zip(blocks, names)
        if (at, part) == (path, name)
    ]
    out = [own for own, bounds in of_part if any(True for _ in _beyond_tank(case, path, own, bounds))]
    if len(of_part) < 2 or not out:
        return ""
    return f" ({len(out)} of its {len(of_part)} blocks: {', '.join(out[:3])}{' ...' if len(out) > 3 else ''})"


def _outlines(bodies: list[Placed]) -> list[tuple[KeyPath, str, np.ndarray]]:
    """Bounds (2, 3) [m] of all bodies of each part, so that a building is reported once."""
    parts: dict[tuple[KeyPath, str], list[np.ndarray]] = {}
    for path, name, body in bodies:
        parts.setdefault((path, name), []).append(np.array(body.bounds()))
    return [
        (path, name, np.array([np.min(bounds, axis=0)[0], np.max(bounds, axis=0)[1]]))
        for (path, name), bounds in parts.items()
    ]


def _overlaps(solids: list[Placed], blocks: list[Placed], block_names: list[str]) -> Iterator[Problem]:
    """Bodies of different parts, and blocks of one file, that share a volume; of two parts the deepest only."""
    if not blocks:
        return
    from yade_scripts.blocks.faces import touching_bounds
    from yade_scripts.blocks.polyhedra import shown

    bodies, names = [*solids, *blocks], [*(name for _, name, _ in solids), *block_names]
    bounds = np.array([body.bounds() for _, _, body in bodies])
    deepest: dict[tuple[KeyPath, KeyPath], tuple[float, int, int]] = {}
    for i, j in touching_bounds(bounds[:, 0], bounds[:, 1], 0.0).tolist():
        path, other = bodies[i][0], bodies[j][0]
        if not _may_overlap(path, other):
            continue
        a, b = bodies[i][2], bodies[j][2]
        enough = TOUCH * min(a.thickness(), b.thickness())
        depth = overlap_depth(a, b, enough)
        if depth > max(enough, deepest.get((path, other), (0.0,))[0]):
            deepest[path, other] = depth, i, j
    for (path, other), (depth, i, j) in deepest.items():
        if path == other:
            place = 0.5 * (bodies[i][2].vertices.mean(axis=0) + bodies[j][2].vertices.mean(axis=0))
            text = (
                f"'{names[j]}' overlaps '{names[i]}' by {depth:.4g} m near {shown(place)}; mend the file (walls around "
                "a room are cut into blocks by [[structure.drawing]])"
            )
        else:
            text = (
                f"'{bodies[j][1]}' overlaps '{bodies[i][1]}' by {depth:.4g} m; move one of them by that much"
            )
        yield other, text


def _may_overlap(path: KeyPath, other: KeyPath) -> bool:
    """Solids may overlap each other; generators make blocks that do not."""
    if path == other:
        return path[:2] == ("structure", "file")
    return not path[0] == other[0] == "solid"


def _submerged_fills(case: Case, bodies: list[Placed]) -> Iterator[Problem]:
    """Fills that lie wholly inside one body. A body displaces water, but such a fill is a mistake."""
    for i, fill in enumerate(case.water.fill if case.water else ()):
        corners = Body.between(fill.lower, fill.upper).vertices
        for _, name, body in bodies:
            if (body.depth(corners) > -TOUCH * body.thickness()).all():
                yield ("water", "fill", i), f"this water lies wholly inside '{name}', so there is none"
                break


def opening_problems(case: Case) -> Iterator[Problem]:
    """Buildings without room inside, and openings that reach out of their wall."""
    for i, building in enumerate(case.structure.building if case.structure else ()):
        path = ("structure", "building", i)
        yield from _hollow(path, building)
        for j, opening in enumerate(building.opening):
            width = building.size[1] if opening.wall[0] == "x" else building.size[0]
            limits = (("along the wall", width), ("in height", building.size[2]))
            for (direction, limit), start, length in zip(limits, opening.lower, opening.size):
                if start < -TOUCH or start + length > limit + TOUCH:
                    yield (
                        (*path, "opening", j),
                        f"reaches from {start:g} to {start + length:g} m {direction}, outside the wall "
                        f"{opening.wall} of '{building.name}' (0 to {limit:g} m)",
                    )


def _hollow(path: KeyPath, building: Building) -> Iterator[Problem]:
    inside = min(building.size[:2]) - 2 * building.wall_thickness
    if inside <= 0:
        yield (
            (*path, "wall_thickness"),
            f"two walls of {building.wall_thickness:g} m leave no room in '{building.name}' "
            f"({min(building.size[:2]):g} m); use [[structure.wall]] for a solid body",
        )
    floor = building.floor_thickness or building.wall_thickness
    if building.size[2] / building.storeys <= floor:
        yield (
            (*path, "storeys"),
            f"storeys of {building.size[2] / building.storeys:.4g} m have no room above floors of {floor:g} m",
        )
