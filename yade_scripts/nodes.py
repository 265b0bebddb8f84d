"""Contact nodes of a box: small spheres just under its faces, edges and corners.

A node of one block against a face of another is one contact point. A face carries n x n nodes, so that resting,
stacking, toppling and sliding come out right; two nodes an edge let offset blocks fall over, so n ≥ 3.
"""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def node_positions(size: Array, per_edge: int, radius: float) -> Array:
    """Centres (k, 3) [m] in the body frame; the spheres touch the faces of the box `size` (3,) from inside."""
    line = np.linspace(-1.0, 1.0, per_edge)
    grid = np.stack(np.meshgrid(line, line, line, indexing="ij"), axis=-1).reshape(-1, 3)
    surface = grid[np.abs(grid).max(axis=1) == 1.0]
    return surface * (0.5 * np.asarray(size) - radius)


def node_radius(size: Array, share: float) -> float:
    """Sphere radius [m]: a share of the smallest half edge."""
    return share * 0.5 * float(np.min(size))
