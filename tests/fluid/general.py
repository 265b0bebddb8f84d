"""Really unstructured tetrahedra: Delaunay's of points on no lattice, through a file as a mesh generator writes it."""

import meshio
import numpy as np
from scipy.spatial import Delaunay

from fluid.mesh.background import CORNERS_OF_FACE, Background

LEAST_ANGLE = 5.0
"""[degrees] between two faces of a cell: slivers below it are shaken out, as generators do."""


def unstructured(n, file, seed=0) -> Background:
    """The unit cube with about n cells a side, written to a file that meshio knows and read again."""
    points, cells = _shaken(n, np.random.default_rng(seed))
    meshio.Mesh(points, [("tetra", cells)]).write(file)
    mesh = meshio.read(file)
    return Background.from_arrays(mesh.points, mesh.cells_dict["tetra"])


def _shaken(n, random):
    """Points of a lattice moved by a third of a cell within their side, edge or corner, and again where slivers are."""
    axis = np.linspace(0, 1, n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    free = (points > 1e-9) & (points < 1 - 1e-9)
    points += np.where(free, random.uniform(-0.33, 0.33, points.shape) / n, 0)
    bad = np.inf
    while True:
        cells = _solid_cells(points, n)
        thin = _least_angle(points, cells) < LEAST_ANGLE
        if thin.sum() < bad:
            bad, kept = thin.sum(), (points, cells, np.unique(cells[thin]))
        if bad == 0:
            return points, cells
        points, moved = kept[0].copy(), kept[2][random.random(len(kept[2])) < 0.3]
        points[moved] += np.where(free[moved], random.uniform(-0.15, 0.15, (len(moved), 3)) / n, 0)


def _solid_cells(points, n):
    cells = Delaunay(points).simplices
    x = points[cells]
    return cells[np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) > 1e-9 / n**3]


def _least_angle(points, cells):
    """Smallest angle (M,) [degrees] between two faces of each cell."""
    x = points[cells]
    x = np.where(np.linalg.det(x[:, 1:] - x[:, :1])[:, None, None] < 0, x[:, [0, 1, 3, 2]], x)
    f = x[:, CORNERS_OF_FACE]
    normal = np.cross(f[:, :, 1] - f[:, :, 0], f[:, :, 2] - f[:, :, 0])
    normal /= np.linalg.norm(normal, axis=2, keepdims=True)
    cosine = -np.einsum("eak,ebk->eab", normal, normal) - 2 * np.eye(4)
    return np.degrees(np.arccos(np.clip(cosine.max(axis=(1, 2)), -1, 1)))
