"""Tetrahedra from a mesh file, as the flow needs them: one piece whose cells share whole faces.

Meshes that the flow cannot use are refused with the place of the fault: other kinds of cells, flat cells, and nodes or
cells that are not connected. Points that no cell has are dropped; cells of either orientation are taken.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from array_types import Array
from coupler.geometry.mesh_files import MeshFileError, read_mesh
from coupler.program.quantities import counted

BOUNDARY_KINDS = ("vertex", "line", "triangle", "quad", "polygon")
"""Cells that meshers write along with the volume, for marks on its boundary."""
FLAT = 1e-5
"""Six volumes over the cube of the longest edge, below which a cell is flat."""
TWINS = 1e-5
"""Share of the mean edge within which two nodes are at one place."""
BEYOND = 1e-3
"""Share of its width by which a point before a face of the boundary must lie outside all cells."""


def read_tetrahedra(path: Path, scale: float, offset):
    """The `Background` of a file: scale [m] of its unit, offset (3,) [m] added to all places. Raises MeshFileError."""
    from fluid.mesh.background import Background

    points, kinds, _ = read_mesh(path)
    nodes, cells = _used(points * scale + np.array(offset), _tetrahedra(path.name, kinds))
    _refuse_flat(path.name, nodes, cells)
    _refuse_twins(path.name, nodes, cells)
    mesh = Background.from_arrays(nodes, cells)
    _refuse_overlaps(path.name, mesh)
    _refuse_gaps(path.name, mesh)
    _refuse_parts(path.name, mesh)
    return mesh


def shown(place) -> str:
    """A place (3,) as text."""
    return "(" + ", ".join(f"{c:.4g}" for c in place) + ")"


def _tetrahedra(name: str, kinds: dict[str, Array]) -> Array:
    """Rows of four corners (m, 4); cells of the boundary are left out, other volumes refused."""
    other = [kind for kind in kinds if kind != "tetra" and not kind.startswith(BOUNDARY_KINDS)]
    if other:
        kind = other[0]
        remedy = "write cells of first order (gmsh: Mesh.ElementOrder = 1)"
        if not kind.startswith("tetra"):
            remedy = "mesh with tetrahedra (gmsh: neither Recombine nor Layers with it), or split each cell into them"
        cells = counted(len(kinds[kind]), "cell")
        raise MeshFileError(
            f"{name}: {cells} of kind '{kind}'; the water takes linear tetrahedra only: {remedy}"
        )
    if "tetra" not in kinds or len(kinds["tetra"]) == 0:
        there = ", ".join(f"{len(rows)} of kind '{kind}'" for kind, rows in kinds.items()) or "none at all"
        raise MeshFileError(f"{name}: no tetrahedra among its cells ({there}); mesh the volume too (gmsh -3)")
    return kinds["tetra"].astype(np.int64)


def _used(points: Array, cells: Array) -> tuple[Array, Array]:
    """Points that cells have, in the same order, and the cells in their numbers: meshers keep centres of circles."""
    used, row = np.unique(cells, return_inverse=True)
    return points[used], row.reshape(-1, 4)


def _refuse_flat(name: str, nodes: Array, cells: Array) -> None:
    x = nodes[cells]
    six_volumes = np.abs(np.linalg.det(x[:, 1:] - x[:, :1]))
    longest = np.max([np.linalg.norm(x[:, b] - x[:, a], axis=1) for a in range(4) for b in range(a)], axis=0)
    flat = np.flatnonzero(six_volumes <= FLAT * longest**3)
    if len(flat):
        raise MeshFileError(
            f"{name}: cell {flat[0]} at {shown(x[flat[0]].mean(axis=0))} is flat, and {len(flat) - 1} more; mesh "
            "again, with optimisation (gmsh: Mesh.Optimize = 1)"
        )


def _refuse_twins(name: str, nodes: Array, cells: Array) -> None:
    from scipy.spatial import cKDTree

    edges = np.linalg.norm(nodes[cells[:, 1]] - nodes[cells[:, 0]], axis=1)
    twins = cKDTree(nodes).query_pairs(TWINS * edges.mean(), output_type="ndarray")
    if len(twins):
        raise MeshFileError(
            f"{name}: two nodes at {shown(nodes[twins[0, 0]])}, and {len(twins) - 1} more such pairs: the cells on "
            "both sides are not connected there; merge double nodes (gmsh: Coherence Mesh)"
        )


def _refuse_overlaps(name: str, mesh) -> None:
    """Refuse overlapping cells: two cells that share a face must lie on opposite sides of it."""
    cell, corner = np.nonzero(mesh.neighbours >= 0)
    other = mesh.neighbours[cell, corner]
    mutual = (mesh.neighbours[other] == cell[:, None]).any(axis=1)
    cells = mesh.cells.astype(np.int64)
    far = cells[other].sum(axis=1) - cells[cell].sum(axis=1) + cells[cell, corner]
    reach = mesh.nodes[np.clip(far, 0, len(mesh.nodes) - 1)] - mesh.nodes[mesh.cells[cell, corner]]
    beyond = 1.0 + np.einsum("fk,fk->f", mesh.gradients[cell, corner], reach) < 0.0
    bad = np.flatnonzero(~mutual | ~beyond)
    if len(bad):
        one, two = cell[bad[0]], other[bad[0]]
        raise MeshFileError(
            f"{name}: cells {one} and {two} at {shown(mesh.nodes[mesh.cells[one]].mean(axis=0))} overlap, or share a "
            "face with a third one; remove doubled cells or mesh again"
        )


def _refuse_parts(name: str, mesh) -> None:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    cell, corner = np.nonzero(mesh.neighbours >= 0)
    shape = (len(mesh.cells),) * 2
    graph = coo_matrix((np.ones(len(cell), np.int8), (cell, mesh.neighbours[cell, corner])), shape=shape)
    count, part = connected_components(graph, directed=False)
    if count > 1:
        size = np.bincount(part)
        first = np.flatnonzero(part == size.argmin())[0]
        raise MeshFileError(
            f"{name}: {count} parts that share no face; the smallest has {size.min()} cells, one of them at "
            f"{shown(mesh.nodes[mesh.cells[first]].mean(axis=0))}. Join them (gmsh: BooleanFragments or Coherence "
            "before meshing), or keep one"
        )


def _refuse_gaps(name: str, mesh) -> None:
    """Refuse hanging nodes, which make faces that seem free: no other cell may lie just outside a boundary face."""
    x = mesh.nodes[mesh.boundary_faces]
    width = np.sqrt(np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1))
    before = x.mean(axis=1) + BEYOND * width[:, None] * mesh.boundary_normal
    inner = np.flatnonzero(mesh.locate(before) >= 0)
    if len(inner):
        raise MeshFileError(
            f"{name}: cells meet at {shown(x[inner[0]].mean(axis=0))} without sharing a face, and at "
            f"{len(inner) - 1} more places: hanging nodes, or cells that overlap; mesh again in one piece"
        )
