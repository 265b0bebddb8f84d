"""A basin from a mesh file as blocks meet it: its walls, which are planes around it, and its bed, a height map.

A boundary face that is steeper than the steepest bed, or that faces downwards, belongs to a wall; no part of the basin
may lie behind its plane.  All other faces form the bed; no two of them may lie above one another.  A level bed is the
floor of the box around the mesh, any other is sampled on a lattice of an eighth of the smallest cell.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from array_types import Array
from coupler.geometry.tetrahedra import shown

STEEPEST_BED = 3.0
"""Rise over run of a face that is still bed; that of the bed under a [terrain] too."""
LATTICE = 8.0
"""Points of the lattice of an uneven bed along the smallest cell ..."""
MOST_POINTS = 1500
"""... and at most along an axis."""
SAME_PLANE = 1e-4
"""Largest difference of two unit normals of one wall, and of their places as a share of the smallest cell."""
BEHIND = 0.01
"""Share of the smallest cell that a basin may reach beyond the plane of one of its walls."""
MISSING = 1e-3
"""Share of the ground plan that the faces of the bed may miss, or have twice."""
MOST_WALLS = 400


class BasinError(ValueError):
    """A basin whose walls are not well defined for blocks; the message names the place."""


@dataclass(frozen=True)
class Basin:
    """point (k, 3) [m] and inward unit normal (k, 3) of the walls that are no sides of the box around it · x (nx,),
    y (ny,) and bed (nx, ny) [m] of an uneven bed, None for a level one."""

    point: Array
    normal: Array
    x: Array | None = None
    y: Array | None = None
    bed: Array | None = None

    def depth_behind(self, points: Array) -> tuple[float, str]:
        """How far (m) the deepest of the points (n, 3) lies behind a wall or below the bed, and behind what."""
        deepest, what = 0.0, ""
        for point, normal in zip(self.point, self.normal):
            depth = -float(((points - point) @ normal).min())
            if depth > deepest:
                deepest, what = depth, f"the wall of tank.mesh through {shown(point)} m"
        if self.bed is not None:
            depth = (self._bed_at(points[:, 0], points[:, 1]) - points[:, 2]).max()
            if depth > deepest:
                deepest, what = float(depth), "the bed of tank.mesh"
        return deepest, what

    def _bed_at(self, px, py) -> Array:
        from scipy.interpolate import RegularGridInterpolator

        x, y = np.clip(px, self.x[0], self.x[-1]), np.clip(py, self.y[0], self.y[-1])
        return RegularGridInterpolator((self.x, self.y), self.bed)(np.column_stack([x, y]))


def basin_of(mesh) -> Basin:
    """The basin of a `Background`. Raises BasinError."""
    return _found(_Key(mesh))


class _Key:
    """A key that compares meshes by identity and keeps them alive as long as it is used."""

    def __init__(self, mesh):
        self.mesh = mesh

    def __eq__(self, other):
        return self.mesh is other.mesh

    def __hash__(self):
        return id(self.mesh)


@lru_cache(maxsize=1)
def _found(key: _Key) -> Basin:
    mesh = key.mesh
    normal = np.asarray(mesh.boundary_normal, float)
    centre = mesh.nodes[mesh.boundary_faces].mean(axis=1)
    is_bed = -normal[:, 2] > 1.0 / np.hypot(1.0, STEEPEST_BED)
    in_box = _in_sides(mesh, normal, centre)
    point, inward = _walls(mesh, normal[~is_bed & ~in_box], centre[~is_bed & ~in_box])
    faces = mesh.boundary_faces[is_bed]
    if len(faces) == 0 or np.ptp(mesh.nodes[faces][:, :, 2]) <= SAME_PLANE * mesh.finest:
        return Basin(point, inward)
    _covers_plan(mesh, faces, normal[~is_bed], mesh.boundary_faces[~is_bed])
    return Basin(point, inward, *_heights(mesh, faces))


def _in_sides(mesh, normal: Array, centre: Array) -> Array:
    """(B,) bool: whether each face lies in a side of the box around the mesh."""
    flat = np.abs(normal).max(axis=1) > 1.0 - SAME_PLANE
    axis = np.abs(normal).argmax(axis=1)
    side = mesh.bounds[(normal[np.arange(len(axis)), axis] > 0.0).astype(int), axis]
    return flat & (np.abs(centre[np.arange(len(axis)), axis] - side) <= BEHIND * mesh.finest)


def _walls(mesh, normal: Array, centre: Array) -> tuple[Array, Array]:
    """Points (k, 3) and inward normals (k, 3) of the different planes of these faces."""
    offset = np.einsum("ij,ij->i", normal, centre)
    points, normals, left = [], [], np.ones(len(normal), bool)
    while left.any():
        first = int(np.flatnonzero(left)[0])
        like = np.abs(normal - normal[first]).max(axis=1) <= SAME_PLANE
        like &= np.abs(offset - offset[first]) <= SAME_PLANE * np.ptp(mesh.bounds, axis=0).max()
        left &= ~like
        beyond = mesh.nodes @ normal[first] - offset[first]
        worst = int(beyond.argmax())
        if beyond[worst] > BEHIND * mesh.finest:
            raise BasinError(
                f"blocks would be stopped at {shown(centre[first])} m, where a wall steeper than {STEEPEST_BED:g} to 1 "
                f"lies, and the basin goes on behind the plane of that wall, {beyond[worst]:.3g} m at "
                f"{shown(mesh.nodes[worst])} m: with [structure] walls may only be flat and bound the whole basin; "
                "mesh without this part and make it a [[solid]]"
            )
        points.append(centre[first])
        normals.append(-normal[first])
        if len(points) > MOST_WALLS:
            raise BasinError(
                f"its steep walls lie in more than {MOST_WALLS} different planes, too many for the contact of blocks; "
                "make the walls of larger flat faces"
            )
    return np.array(points).reshape(-1, 3), np.array(normals).reshape(-1, 3)


def _plan_area(corners: Array) -> Array:
    """Area [m²] of triangles (n, 3, 3) seen from above."""
    one, two = corners[:, 1, :2] - corners[:, 0, :2], corners[:, 2, :2] - corners[:, 0, :2]
    return 0.5 * np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def _covers_plan(mesh, bed: Array, steep_normal: Array, steep: Array) -> None:
    """Check that the bed and the steep walls above it cover every place of the plan exactly once."""
    from scipy.spatial import ConvexHull

    hull = ConvexHull(mesh.nodes[:, :2]).volume
    upward = steep_normal[:, 2] < -SAME_PLANE
    plan = _plan_area(mesh.nodes[bed]).sum() + _plan_area(mesh.nodes[steep[upward]]).sum()
    if abs(plan - hull) > MISSING * hull:
        more = "twice, below an overhang or on an island in its middle" if plan > hull else "nowhere"
        raise BasinError(
            f"its bed lies over {abs(plan / hull - 1.0):.1%} of the ground plan {more}: with [structure] the bed must "
            "be a height over every place; mesh the basin without that part and make it a [[solid]]"
        )


def _heights(mesh, faces: Array) -> tuple[Array, Array, Array]:
    """Lattice x (nx,), y (ny,) and heights (nx, ny) [m] of the bed; beside it those of its nearest place."""
    from scipy.ndimage import distance_transform_edt

    low, high = mesh.bounds[:, :2]
    n = [int(min(np.ceil(LATTICE * s / mesh.finest), MOST_POINTS)) + 1 for s in high - low]
    x, y = (np.linspace(low[k], high[k], n[k]) for k in (0, 1))
    bed = np.full((n[0], n[1]), -np.inf)
    slack = 1e-9 * mesh.finest
    for corners in mesh.nodes[faces]:
        first = [np.searchsorted(a, corners[:, k].min() - slack) for k, a in enumerate((x, y))]
        last = [np.searchsorted(a, corners[:, k].max() + slack, side="right") for k, a in enumerate((x, y))]
        at = np.ix_(range(first[0], last[0]), range(first[1], last[1]))
        dx, dy = x[first[0] : last[0], None] - corners[0, 0], y[None, first[1] : last[1]] - corners[0, 1]
        inverse = np.linalg.inv((corners[1:, :2] - corners[0, :2]).T)
        s, t = inverse[0, 0] * dx + inverse[0, 1] * dy, inverse[1, 0] * dx + inverse[1, 1] * dy
        inside = (s >= -1e-6) & (t >= -1e-6) & (s + t <= 1.0 + 1e-6)
        z = corners[0, 2] + s * (corners[1, 2] - corners[0, 2]) + t * (corners[2, 2] - corners[0, 2])
        bed[at] = np.where(inside, np.maximum(bed[at], z), bed[at])
    beside = ~np.isfinite(bed)
    if beside.any():
        nearest = distance_transform_edt(beside, return_distances=False, return_indices=True)
        bed = bed[tuple(nearest)]
    return x, y, bed


def basin_problem(mesh) -> str | None:
    """Why blocks cannot be in the basin of a mesh; None where they can."""
    try:
        basin_of(mesh)
    except BasinError as error:
        return str(error)
    return None


def basin_planes(mesh) -> tuple:
    """Its uneven bed as a `GroundSurface`, None where it is level, and its walls as `FixedPlane`s (BasinError)."""
    from yade_scripts.blocks.faces import FixedPlane
    from yade_scripts.contact.ground import GroundSurface

    basin = basin_of(mesh)
    walls = [
        FixedPlane(point, normal, f"tank wall {k}", False, "tank")
        for k, (point, normal) in enumerate(zip(basin.point, basin.normal), 1)
    ]
    if basin.bed is None:
        return None, walls
    low, first = float(basin.bed.min()), np.array([basin.x[0], basin.y[0]])
    at, up = (*first, low), (0.0, 0.0, 1.0)
    lattice = {"x": basin.x - first[0], "y": basin.y - first[1], "z": basin.bed - low}
    return GroundSurface(at, up, "tank bed", bonds=False, material="tank", **lattice), walls


def outside_of(mesh, bodies) -> Iterator[tuple]:
    """Places and texts of the bodies (path, name, corners (n, 3)) that reach out of the basin of a mesh."""
    basin = basin_of(mesh)
    for path, name, corners in bodies:
        depth, what = basin.depth_behind(corners)
        if depth > SAME_PLANE * max(mesh.finest, np.ptp(corners, axis=0).min()):
            yield path, f"'{name}' reaches {depth:.4g} m into {what}; move it or raise it"
