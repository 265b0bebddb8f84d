"""Convex bodies in space for the checks of a case: bounds, points inside, and the depth at which two overlap.

Two convex polyhedra overlap by the smallest of their overlaps along the separating axes: normals of the faces of
either, and products of their edges (Gottschalk, Lin, Manocha 1996); zero or less means that a plane parts them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
PARALLEL = 1e-9
"""Sine of the angle below which two edges give no axis."""


@dataclass(frozen=True)
class Body:
    """vertices (k, 3) [m] · normals (f, 3) outward unit · edges (e, 3) unit directions, each direction once."""

    vertices: np.ndarray
    normals: np.ndarray
    edges: np.ndarray

    @classmethod
    def box(cls, centre, size, rotation=None) -> Body:
        """size (3,) [m] along the columns of rotation (3, 3); None: along the axes."""
        rotation = np.eye(3) if rotation is None else np.asarray(rotation, float)
        corners = np.asarray(centre, float) + (_SIGNS * np.asarray(size, float) / 2) @ rotation.T
        return cls(corners, np.concatenate([rotation.T, -rotation.T]), rotation.T)

    @classmethod
    def between(cls, lower, upper) -> Body:
        """The box along the axes with these corners."""
        lower, upper = np.asarray(lower, float), np.asarray(upper, float)
        return cls.box((lower + upper) / 2, upper - lower)

    @classmethod
    def of_block(cls, block) -> Body:
        """The body of a block of the structure."""
        if block.is_box:
            return cls.box(block.centre, block.size, block.rotation)
        vertices = block.world_vertices()
        pairs = {tuple(sorted(edge)) for f in block.faces for edge in zip(f, (*f[1:], f[0]))}
        edges = np.array([vertices[b] - vertices[a] for a, b in sorted(pairs)])
        edges /= np.linalg.norm(edges, axis=1)[:, None]
        return cls(vertices, block.planes[0] @ block.rotation.T, _once(edges))

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest coordinates (3,), (3,) [m]."""
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    def thickness(self) -> float:
        """Smallest width across a face [m]."""
        return float(np.ptp(self.vertices @ self.normals.T, axis=0).min())

    def depth(self, points: np.ndarray) -> np.ndarray:
        """Depth (n,) [m] of the points (n, 3) inside the body; negative: outside."""
        middle = self.vertices.mean(axis=0)
        offsets = ((self.vertices - middle) @ self.normals.T).max(axis=0)
        return (offsets - (points - middle) @ self.normals.T).min(axis=1)


def _once(directions: np.ndarray) -> np.ndarray:
    """Unit directions without those that are parallel to an earlier one."""
    same = np.linalg.norm(np.cross(directions[:, None], directions[None]), axis=2) < PARALLEL
    return directions[~np.tril(same, -1).any(axis=1)]


def rotation_matrix(axis, angle: float) -> np.ndarray:
    """Rodrigues: R = I + sin(a) W + (1 - cos(a)) W^2, W the cross product with the unit axis (3, 3)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def turned(rotation) -> np.ndarray:
    """Matrix (3, 3) of a rotation as cases give it, with axis and angle [rad]; None: no rotation."""
    return np.eye(3) if rotation is None else rotation_matrix(rotation.axis, rotation.angle)


def overlap_depth(a: Body, b: Body, enough: float = 0.0) -> float:
    """Smallest displacement [m] of one body that separates the two; ≤ 0: they do not overlap.

    enough [m]: an overlap that is not larger is returned without looking for the axis that makes it smallest.
    """
    middle = a.vertices.mean(axis=0)
    corners = a.vertices - middle, b.vertices - middle
    depth = _least(np.concatenate([a.normals, b.normals]), *corners)
    if depth <= enough:
        return depth
    axes = np.cross(a.edges[:, None], b.edges[None]).reshape(-1, 3)
    length = np.linalg.norm(axes, axis=1)
    axes = axes[length > PARALLEL] / length[length > PARALLEL, None]
    return min(depth, _least(axes, *corners)) if len(axes) else depth


def _least(axes: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    """Smallest overlap of two sets of corners along the axes (n, 3)."""
    on_a, on_b = a @ axes.T, b @ axes.T
    return float(np.minimum(on_a.max(axis=0) - on_b.min(axis=0), on_b.max(axis=0) - on_a.min(axis=0)).min())
