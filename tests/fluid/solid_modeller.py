"""The independent reference for cutting: the solid modeller manifold3d, its results as plain arrays."""

from __future__ import annotations

import manifold3d
import numpy as np
from manifold3d import Manifold


def hull(points) -> Manifold:
    """Convex hull of points (k, 3); its triangles can be recognised in later results."""
    return Manifold.hull_points(np.asarray(points, float)).as_original()


def union(solids) -> Manifold:
    """All of them together."""
    return Manifold.batch_boolean(list(solids), manifold3d.OpType.Add)


def triangles(solid: Manifold):
    """Corners (t, 3, 3) and identity (t,) of the solid that each triangle of the surface stems from."""
    mesh = solid.to_mesh64()
    corners = mesh.vert_properties[:, :3][mesh.tri_verts.astype(np.int64)]
    identity = np.empty(len(corners), np.int64)
    for at, name in enumerate(mesh.run_original_id):
        identity[mesh.run_index[at] // 3 : mesh.run_index[at + 1] // 3] = name
    return corners, identity


def vector_area(corners):
    """Half the cross product of the edges (t, 3), outward."""
    return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2


def moments(solid: Manifold):
    """Volume, ∫ x dV (3,), ∫ x xᵀ dV (3, 3) by a fan of tetrahedra from the middle of the solid."""
    corners, _ = triangles(solid)
    if len(corners) == 0:
        return 0.0, np.zeros(3), np.zeros((3, 3))
    apex = corners.reshape(-1, 3).mean(axis=0)
    d = corners - apex
    v = np.einsum("ti,ti->t", d[:, 0], np.cross(d[:, 1], d[:, 2])) / 6
    s = d.sum(axis=1)
    volume, first = v.sum(), np.einsum("t,ti->i", v / 4, s)
    second = np.einsum("t,ti,tj->ij", v / 20, s, s) + np.einsum("t,tki,tkj->ij", v / 20, d, d)
    second += np.outer(first, apex) + np.outer(apex, first) + volume * np.outer(apex, apex)
    return volume, first + volume * apex, second
