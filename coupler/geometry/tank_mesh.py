"""The mesh of a tank: split bricks of a box, those above a terrain, or the tetrahedra of a file.

With a file, lower, upper and cell of the tank follow from it: the box around its nodes and the mean edge of its cells.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.case import Case, Tank
from coupler.case.paths import stamp
from coupler.case.types import Problem
from coupler.geometry.basin import basin_problem
from coupler.geometry.mesh_files import MeshFileError
from coupler.geometry.start_surfaces import surface_of
from coupler.geometry.stretches import axes_of
from coupler.geometry.tank_regions import regions_of, stretch_problems, too_many
from coupler.geometry.terrain.bed_mesh import fitted_of
from coupler.geometry.tetrahedra import read_tetrahedra, shown
from coupler.program.errors import SurgebreakError

OF_BOX = {
    "lower": "corner with the smallest coordinates [m]",
    "upper": "corner with the largest coordinates [m]",
    "cell": "wanted edge of the mesh cells [m]",
}
OF_FILE = ("scale", "offset")
SHARP = 30.0
"""Least angle [degrees] between two faces of the boundary whose common edge is drawn."""
FULL = 1e-4
"""Share of the box around a mesh that may be missing in one that fills it."""
THIN = 5.0
"""Least angle [degrees] between two faces of a cell without a remark."""
UPRIGHT = 1e-9
"""Twice the area seen from above, over the square of the finest cell, up to which a face stands upright."""
ON_EDGE = 1e-9
"""Share of a face by which a place may lie beyond its edge and still be on it: round-off."""
UNLIKE = 8.0
"""Largest over smallest cell without a remark."""
IN_PLANE = 1e-3
"""Share of a cell within which a face lies in a side of the box around the mesh."""


def measured(case: Case) -> tuple[Case, list[Problem]]:
    """The case with lower, upper and cell of its tank, from the file if it names one; and why that cannot be."""
    tank = case.tank
    if tank is None:
        needed = "the ground needs a section [tank] with lower, upper and cell: where water may be above it"
        return case, [(("terrain",), needed)] if case.terrain is not None else []
    wrong = list(_wrong_keys(tank))
    if case.terrain is not None and tank.mesh is not None:
        wrong.append((("tank", "mesh"), "with [terrain] the mesh is made on it; leave one of them out"))
    if wrong and tank.mesh is not None:  # it is unclear which of the two is meant, so neither is checked
        return case.model_copy(update={"tank": tank.model_copy(update={"lower": None})}), wrong
    if wrong:
        return case, wrong
    if tank.mesh is None:
        wrong = list(stretch_problems(case))
    if wrong:
        return case.model_copy(update={"tank": tank.model_copy(update={"lower": None})}), wrong
    if case.terrain is not None:
        case, wrong = _on_terrain(case)
        if wrong:  # what stands on the ground, or is joined to it, would be refused for the same fault again
            return case.model_copy(update={"tank": tank.model_copy(update={"lower": None})}), wrong
    elif tank.mesh is not None:
        case, wrong = _of_file(case)
    return (case, wrong) if wrong else _with_finer_parts(case)


def _of_file(case: Case) -> tuple[Case, list[Problem]]:
    """The case with lower, upper and cell of its tank from the file of it, and why that cannot be."""
    tank = case.tank
    try:
        mesh = mesh_of(tank)
    except MeshFileError as error:
        return case, [(("tank", "mesh"), str(error))]
    lower, upper = (tuple(corner) for corner in mesh.bounds.tolist())
    found = {"lower": lower, "upper": upper, "cell": mesh.spacing}
    return case.model_copy(update={"tank": tank.model_copy(update=found)}), []


def _with_finer_parts(case: Case) -> tuple[Case, list[Problem]]:
    """The case with the regions of `[[tank.refine]]`, and what is wrong with them; bodies that cannot be made are left
    to the checks of their own tables."""
    if not case.tank.refine:
        return case, []
    try:
        regions, wrong = regions_of(case)
    except (ValueError, OSError, SurgebreakError):
        return case, []
    heavy = None if wrong else too_many(case.tank, regions)
    if heavy is not None:
        wrong = [(("tank", "refine"), heavy)]
    if wrong:
        return case, wrong
    return case.model_copy(update={"tank": case.tank.with_regions(regions)}), wrong


def is_measured(tank: Tank) -> bool:
    """Whether the position and the cell size of a tank are known."""
    return None not in (tank.lower, tank.upper, tank.cell)


def mesh_of(tank: Tank):
    """The `Background` of a tank; a file is read once unless it changes. Raises MeshFileError."""
    from fluid.mesh.background import box_mesh

    if tank.regions is not None or tank.stretch:
        there = stamp(tank.mesh) if tank.mesh is not None and Path(tank.mesh).is_file() else None
        return _in_parts(tank, tank.regions, tank.ground, there)
    if tank.ground is not None:
        return fitted_of(tank).mesh
    if tank.mesh is None:
        return box_mesh(tank.lower, tank.upper, tank.cell, split=tank.split)
    there = stamp(tank.mesh) if Path(tank.mesh).is_file() else None
    return _kept(Path(tank.mesh), tank.scale, tank.offset, there)


def finest_cell(tank: Tank) -> float:
    """Size [m] of the smallest cells of a tank; of a box without finer parts the wanted edge."""
    return tank.cell if tank.regions is None and not tank.stretch else mesh_of(tank).finest


def bed_along(tank: Tank, side: str) -> Array:
    """Places along a side and heights of the bed there (n, 2) [m]: the floor of a box, and the lower edge of a mesh
    from a file at its nodes in the side; of a mesh without a face there its lowest node."""
    axis, along = "xyz".index(side[0]), 1 - "xyz".index(side[0])
    if tank.mesh is not None:
        found = _lower_edge(mesh_of(tank), side)
        if len(found):
            return found
    if tank.ground is None:
        return np.array([[end[along], tank.lower[2]] for end in (tank.lower, tank.upper)])
    fitted = fitted_of(tank)
    at = 0 if side[1] == "-" else -1
    bed = fitted.bed[at] if axis == 0 else fitted.bed[:, at]
    found = np.column_stack([(fitted.column_x, fitted.column_y)[along], bed])
    return found[np.isfinite(bed)]


def _lower_edge(mesh, side: str) -> Array:
    """Places along a side and heights (n, 2) [m] of the lowest edges of the faces that lie in it."""
    along = 1 - "xyz".index(side[0])
    faces = mesh.boundary_faces[
        on_side(mesh, side, mesh.boundary_normal, mesh.nodes[mesh.boundary_faces].mean(axis=1))
    ]
    edges = mesh.nodes[np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])][
        :, :, [along, 2]
    ]
    places = np.unique(edges[:, :, 0])
    (start, low), (end, high) = edges[:, 0].T, edges[:, 1].T
    width = np.where(start == end, 1.0, end - start)
    found = np.empty(len(places))
    for i, place in enumerate(places):
        over = (np.minimum(start, end) <= place) & (place <= np.maximum(start, end))
        share = ((place - start) / width)[over]
        level = (low[over] + share * (high - low)[over]).min()
        upright = over & (start == end)
        found[i] = min(level, np.minimum(low, high)[upright].min(initial=np.inf))
    return np.column_stack([places, found])


def bed_under(mesh, places) -> Array:
    """Heights z (n,) [m] at which vertical lines through places (n, 2) [m] enter a mesh (`Background`) from below; NaN
    where they miss it."""
    places = np.asarray(places, float)
    down = mesh.boundary_normal[:, 2] < 0.0
    corners = mesh.nodes[mesh.boundary_faces[down]]
    (a, z), (b, c) = (corners[:, 0, :2], corners[:, :, 2]), np.moveaxis(corners[:, 1:, :2], 1, 0)
    turn = _cross(b - a, c - a)
    standing = np.abs(turn) <= UPRIGHT * mesh.finest**2
    turn, a, b, c, z = (part[~standing] for part in (turn, a, b, c, z))
    found = np.full(len(places), np.nan)
    for i, place in enumerate(places):
        share = np.column_stack(
            [_cross(b - place, c - place), _cross(c - place, a - place), _cross(a - place, b - place)]
        )
        share /= turn[:, None]
        over = (share >= -ON_EDGE).all(axis=1)
        if over.any():
            found[i] = np.einsum("fk,fk->f", share[over], z[over]).min()
    return found


def _cross(p, q):
    """z of the cross products of vectors (n, 2)."""
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]


def floor_along(tank: Tank, side: str) -> float:
    """Lowest z [m] of the bed along a side; of a side that is all land, the top of the tank."""
    return float(bed_along(tank, side)[:, 1].min(initial=tank.upper[2]))


def mean_bed(tank: Tank, side: str, level: float) -> float:
    """Height z [m] of the level bed with as much water over it, up to a level, as along a side: by its wet width."""
    along = bed_along(tank, side)
    depth = np.maximum(level - along[:, 1], 0.0)
    step = np.diff(along[:, 0])
    wet = ((depth[1:] > 0.0) | (depth[:-1] > 0.0)) * step
    area = (0.5 * (depth[1:] + depth[:-1]) * step).sum()
    return level if not wet.sum() > 0.0 else float(level - area / wet.sum())


def on_side(mesh, side: str, normals: Array, centres: Array) -> Array:
    """(B,) bool: faces of the boundary, by normals and centres (B, 3), in the named side of the box around the mesh.

    A centre is in the plane of a side only if all corners are; the rest of a boundary of any shape is wall."""
    axis, sign = "xyz".index(side[0]), 1.0 if side[1] == "+" else -1.0
    plane = mesh.bounds[int(sign > 0.0), axis]
    return (sign * normals[:, axis] > 0.5) & (np.abs(centres[:, axis] - plane) <= IN_PLANE * mesh.finest)


def tank_places(case: Case) -> Iterator[Problem]:
    """Sides that a mesh from a file has not, water beside it, and blocks in one that is no box."""
    if case.tank is None or case.tank.is_box:
        return
    mesh = mesh_of(case.tank)
    yield from _sides(case, mesh)
    for i, fill in enumerate(case.water.fill if case.water else ()):
        if not _within(mesh.nodes, fill).any():
            yield (
                ("water", "fill", i),
                f"no node of {what_of(case.tank)} lies in this box, so there is no water; enlarge it",
            )
    if case.structure is not None and is_basin(case.tank):
        wrong = basin_problem(mesh)
        if wrong is not None:
            yield ("tank", "mesh"), wrong


def is_basin(tank: Tank | None) -> bool:
    """Whether a tank is a mesh file that does not fill the box around it."""
    return tank is not None and tank.mesh is not None and not _fills_its_box(mesh_of(tank))


def mesh_remarks(tank: Tank) -> Iterator[str]:
    """Cells of a file for which the flow was not tested: thinner, or more uneven in size, than in its tests; and land
    that rises through the top of the tank."""
    if tank.ground is not None and fitted_of(tank).lowered:
        reach = tank.upper[2] - 0.5 * fitted_of(tank).layer
        yield (
            f"the ground rises through the top of the tank: where it lies above z = {reach:.4g} m the rim of the mesh "
            f"is cut down to a cell below the top ({tank.upper[2]:g} m), a moat for water that climbs so high; raise "
            "tank.upper[2] if it may"
        )
    if tank.mesh is None:
        return
    from fluid.mesh.background import CORNERS_OF_FACE

    mesh = mesh_of(tank)
    normals = -mesh.gradients / np.linalg.norm(mesh.gradients, axis=2, keepdims=True)
    cosine = -np.einsum("eak,ebk->eab", normals, normals) - 2.0 * np.eye(len(CORNERS_OF_FACE))
    cosine = cosine.max(axis=(1, 2))
    thin = int(cosine.argmax())
    angle = float(np.degrees(np.arccos(min(1.0, cosine[thin]))))
    if angle < THIN:
        place = shown(mesh.nodes[mesh.cells[thin]].mean(axis=0))
        yield (
            f"tank.mesh has a cell at {place} m with two faces {angle:.2g} degrees apart; the solver was tested down "
            f"to {THIN:g}: optimise the mesh (gmsh: Mesh.Optimize = 1)"
        )
    small, large = mesh.cell_size.min(), mesh.cell_size.max()
    if large > UNLIKE * small:
        yield (
            f"tank.mesh has cells of {small:.2g} to {large:.2g} m; the solver was tested with cells up to {UNLIKE:g} "
            "times as large as others: expect small steps, set by the smallest"
        )


def room_beside(tank: Tank, boxes) -> float:
    """Volume [m³] of a tank without that of the boxes of water in it; of a box without the largest of them."""
    if tank.is_box:
        volumes = [np.prod(np.subtract(box.upper, box.lower)) for box in boxes]
        return float(np.prod(np.subtract(tank.upper, tank.lower)) - max(volumes, default=0.0))
    return float(mesh_of(tank).cell_volume.sum()) - water_in(tank, boxes)


def room_under(tank: Tank, boxes, level: float) -> float:
    """Volume [m³] of a tank below a level z [m] without that of the boxes of water in it, as in `room_beside`."""
    if tank.is_box:
        return room_beside(tank.model_copy(update={"upper": (*tank.upper[:2], level)}), boxes)
    mesh = mesh_of(tank)
    z = mesh.nodes[mesh.cells, 2]
    low, high = z.min(axis=1), z.max(axis=1)
    under = np.clip((level - low) / (high - low), 0.0, 1.0)
    return float(mesh.cell_volume @ under) - water_in(tank, boxes)


def water_above(tank: Tank, boxes, level: float) -> float:
    """Volume [m³] of the boxes of water above a level z [m]: of a box the largest, of a mesh that of the cells whose
    middle lies in one of them."""
    if tank.is_box:
        sizes = [
            (*np.subtract(box.upper, box.lower)[:2], box.upper[2] - max(level, box.lower[2])) for box in boxes
        ]
        return float(max([np.prod(size) for size in sizes if size[2] > 0.0], default=0.0))
    over = [box.model_copy(update={"lower": (*box.lower[:2], max(level, box.lower[2]))}) for box in boxes]
    return water_in(tank, over)


def water_in(tank: Tank, boxes) -> float:
    """Volume [m³] of the cells of a mesh whose middle lies in one of the boxes."""
    mesh = mesh_of(tank)
    middle = mesh.nodes[mesh.cells].mean(axis=1)
    inside = np.any([_within(middle, box) for box in boxes], axis=0) if boxes else np.zeros(len(middle), bool)
    return float(mesh.cell_volume[inside].sum())


def basin_edges(mesh) -> Array | None:
    """Ends (k, 2, 3) [m] of the sharp edges of the boundary, for pictures; None for a box, whose edges are known."""
    if _fills_its_box(mesh):
        return None
    faces = np.sort(mesh.boundary_faces, axis=1)
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [0, 2]], faces[:, [1, 2]]])
    face = np.tile(np.arange(len(faces)), 3)
    order = np.lexsort(edges.T)
    edges, normal = edges[order], mesh.boundary_normal[face[order]]
    same = (edges[1:] == edges[:-1]).all(axis=1)
    sharp = np.einsum("ek,ek->e", normal[1:], normal[:-1]) < np.cos(np.radians(SHARP))
    return mesh.nodes[edges[1:][same & sharp]]


def _fills_its_box(mesh) -> bool:
    share = mesh.cell_volume.sum() / np.prod(np.ptp(mesh.bounds, axis=0))
    return bool(abs(share - 1.0) <= FULL)


def beside_mesh(tank: Tank, place) -> bool:
    """Whether a point (3,), or the vertical line over a point (2,) [m], misses all cells of a mesh file."""
    mesh = mesh_of(tank)
    points = np.atleast_2d(np.asarray(place, float))
    if len(place) == 2:
        low, high = mesh.bounds[:, 2]
        z = np.arange(low, high, 0.25 * mesh.finest)
        points = np.column_stack([np.full(len(z), place[0]), np.full(len(z), place[1]), z])
    return not (mesh.locate(points) >= 0).any()


def what_of(tank: Tank) -> str:
    """The name of a tank's mesh in messages."""
    return "tank.mesh" if tank.mesh is not None else "the mesh over the terrain"


def _on_terrain(case: Case) -> tuple[Case, list[Problem]]:
    """The case with its tank over its terrain, and why that cannot be."""
    from coupler.geometry.terrain.checks import terrain_problems
    from coupler.geometry.terrain.grid import TerrainError
    from coupler.geometry.terrain.site import scaled_twice, terrain_of
    from fluid.mesh.background import MeshError

    twice = scaled_twice(case.terrain)
    if twice:
        return case, [(("terrain", "scale"), twice)]
    try:
        ground = terrain_of(case.terrain)
    except TerrainError as error:
        return case, [(("terrain", "path"), str(error))]
    found = list(terrain_problems(case, ground))
    if found:
        return case, found
    tank = case.tank.standing_on(ground)
    try:
        fitted_of(tank)
    except MeshError as error:
        return case, [(("terrain",), f"{error} (terrain.smooth, terrain.steepest)")]
    return case.model_copy(update={"tank": tank}), []


def _wrong_keys(tank: Tank) -> Iterator[Problem]:
    if tank.mesh is None:
        for name, meaning in OF_BOX.items():
            if getattr(tank, name) is None:
                yield (
                    ("tank", name),
                    f"missing; {meaning}. Write lower, upper and cell, or mesh, a file of tetrahedra",
                )
        for name in OF_FILE:
            if name in tank.model_fields_set:
                yield ("tank", name), "is for tank.mesh, and there is none; leave it out"
        return
    for name in (*OF_BOX, "split", "stretch"):
        if name in tank.model_fields_set:
            yield ("tank", name), "follows from tank.mesh, which is given as well; leave one of them out"


def _sides(case: Case, mesh) -> Iterator[Problem]:
    """Sides that a case names although no face of the mesh lies there."""
    named = [(("tank", "open"), s) for s in case.tank.open] + [
        (("tank", "smooth"), s) for s in case.tank.smooth
    ]
    for kind in ("inflow", "sea"):
        specs = getattr(case.water, kind) if case.water else ()
        named += [(("water", kind, i, "side"), spec.side) for i, spec in enumerate(specs)]
    centres = mesh.nodes[mesh.boundary_faces].mean(axis=1)
    for path, side in named:
        if not on_side(mesh, side, mesh.boundary_normal, centres).any():
            plane = mesh.bounds[int(side[1] == "+"), "xyz".index(side[0])]
            yield (
                path,
                f"{side}: no face of {what_of(case.tank)} lies in the plane {side[0]} = {plane:g} m at its end; "
                "only flat ends along an axis are sides, the rest is wall: cut the mesh flat there, or leave this "
                "side out",
            )


def _within(points: Array, box) -> Array:
    """(n,) bool: points (n, 3) in the water of a box."""
    top = surface_of(box)
    inside = np.all((points >= box.lower)[:, :2] & (points <= box.upper)[:, :2], axis=1)
    return (
        inside
        & (points[:, 2] >= box.lower[2])
        & (points[:, 2] <= (box.upper[2] if top is None else top(points)))
    )


@lru_cache(maxsize=1)
def _in_parts(tank: Tank, regions, ground, _stamp):
    """The mesh of a tank with stretches or regions of finer cells; ground: that of the tank, by which tanks differ."""
    from fluid.mesh.background import box_mesh
    from fluid.mesh.refinement import refined_mesh

    found = () if regions is None else regions.found
    if ground is not None:
        fitted = fitted_of(tank)
        return refined_mesh(fitted.mesh, found, fitted.lattice)
    if tank.mesh is not None:
        return refined_mesh(_kept(Path(tank.mesh), tank.scale, tank.offset, _stamp), found)
    return refined_mesh(box_mesh(None, None, axes=axes_of(tank), split=tank.split), found)


@lru_cache(maxsize=1)
def _kept(path: Path, scale: float, offset: tuple, _stamp):
    return read_tetrahedra(path, scale, offset)
