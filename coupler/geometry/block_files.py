"""Blocks from mesh files: each volume cell, or each closed convex surface, is one block.

The corners of all cells are first welded, so that faces shared in the drawing coincide to the last bit, and joints
are found from shared or touching faces. meshio reads the formats and kinds of cells, and the user gives the unit. A
body that is not a convex block is refused with the number of the cell or surface and its place.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from array_types import Array
from coupler.geometry.closed_surfaces import SurfaceError, closed_surfaces, convex_corners
from coupler.geometry.mesh_files import MeshFileError, read_mesh
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.cuts import check_count
from yade_scripts.blocks.polyhedra import BlockError, fans, shown

VOLUME_FACES = {
    "tetra": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)),
    "pyramid": ((0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
    "hexahedron": ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)),
}
"""Faces of the cells that can be blocks, in the numbering of meshio, seen from outside."""
IGNORED = ("vertex", "line", "polygon1", "polygon2")
"""Points and lines that meshers write along with the rest."""
WELD = 1e-5
"""Corners closer than this share of the usual edge are one."""
STL_DIGITS = 2.0**-23
"""Relative resolution of a coordinate of an STL file (single precision)."""
COARSEST = 1e-3
"""Largest uncertainty of a file's coordinates as a share of the usual edge."""


def blocks_from_file(spec, **common) -> list:
    """Blocks NAME-0 .. of a `[[structure.file]]`; common: for every Block. Raises MeshFileError."""
    path = Path(spec.path)
    points, cells, single = read_mesh(path)
    points = points * spec.scale + np.array(spec.offset)
    weld = _weld(path, points, cells, single, spec)
    points = welded(points, weld)
    found = []
    for k, (kind, vertices, faces) in enumerate(_bodies(path, points, cells, weld)):
        try:
            found.append(Block.standing(f"{spec.name}-{k}", vertices, faces, tolerance=weld, **common))
        except BlockError as error:
            place = shown(vertices.mean(axis=0))
            raise MeshFileError(f"{path.name}: {kind} at {place}: {error}") from error
    return found


def _weld(path: Path, points: Array, cells: dict, single: bool, spec) -> float:
    """Distance [m] within which corners are merged; refuses coordinates that are too coarse for the blocks."""
    rings = [points[rows] for kind, rows in cells.items() if kind not in IGNORED and len(rows)]
    if not rings:
        raise MeshFileError(
            f"{path.name}: holds no cells; write a mesh of volume cells or of closed surfaces"
        )
    lengths = np.concatenate([np.linalg.norm(r - np.roll(r, 1, axis=1), axis=2).ravel() for r in rings])
    usual = float(np.median(lengths))
    digits = STL_DIGITS * float(np.abs(points - np.array(spec.offset)).max()) if single else 0.0
    if spec.weld is None and digits > COARSEST * usual:
        raise MeshFileError(
            f"{path.name}: its coordinates are single precision and resolve {digits:.2g} m only, too coarse for edges "
            f"of {usual:.3g} m; move the drawing to its own origin before writing it and give the shift as offset"
        )
    return spec.weld or max(WELD * usual, 4.0 * digits)


def welded(points: Array, distance: float) -> Array:
    """The same points, those within `distance` [m] of each other moved to their mean."""
    pairs = cKDTree(points).query_pairs(distance, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(points),) * 2)
    count, group = connected_components(graph, directed=False)
    origin = points.mean(axis=0)
    mean = np.zeros((count, 3))
    np.add.at(mean, group, points - origin)
    return (origin + mean / np.bincount(group, minlength=count)[:, None])[group]


def _bodies(path: Path, points: Array, cells: dict[str, Array], weld: float):
    """(what it is, vertices, faces or None) of every block of the file."""
    volumes = {kind: rows for kind, rows in cells.items() if kind in VOLUME_FACES}
    surfaces = {k: rows for k, rows in cells.items() if k in ("triangle", "quad") or k.startswith("polygon")}
    surfaces = {k: rows for k, rows in surfaces.items() if k not in IGNORED}
    other = [kind for kind in cells if kind not in (*VOLUME_FACES, *surfaces, *IGNORED)]
    if other:
        raise MeshFileError(
            f"{path.name}: cells of kind '{other[0]}' cannot be rigid blocks with plane faces; write linear "
            f"{', '.join(VOLUME_FACES)}, or closed surfaces of triangles or quads"
        )
    if volumes:
        _check_count(path, sum(len(rows) for rows in volumes.values()))
        yield from _cells(points, volumes)
    else:
        yield from _surfaces(path, points, surfaces, weld)


def _check_count(path: Path, count: int) -> None:
    try:
        check_count(path.name, count)
    except BlockError as error:
        raise MeshFileError(str(error)) from error


def _cells(points: Array, volumes: dict[str, Array]):
    """Volume cells with their faces turned outwards: formats differ in the order of the corners of a wedge."""
    number = 0
    for kind, rows in volumes.items():
        for row in rows:
            x = points[row]
            faces = VOLUME_FACES[kind]
            yield (
                f"cell {number} ({kind})",
                x,
                faces if _volume(x, faces) >= 0.0 else tuple(f[::-1] for f in faces),
            )
            number += 1


def _volume(x: Array, faces) -> float:
    """Signed volume [m³] within faces that fan out from their first corner."""
    x = x - x.mean(axis=0)
    p = x[fans(faces)[0]]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2]))) / 6.0


def _surfaces(path: Path, points: Array, surfaces: dict[str, Array], weld: float):
    loops = [row for rows in surfaces.values() for row in rows]
    try:
        parts = closed_surfaces(points, loops)
    except SurfaceError as error:
        raise MeshFileError(
            f"{path.name}: {error} (corners within {weld:.2g} m are one; weld of this table sets that)"
        ) from error
    _check_count(path, len(parts))
    for k, part in enumerate(parts):
        try:
            yield f"surface {k}", convex_corners(part, weld), None
        except SurfaceError as error:
            raise MeshFileError(f"{path.name}: surface {k} {error}") from error
