"""Boxes in space for the checks of a case: corners, bounds, and how deep two of them overlap.

Two boxes overlap by the smallest of their overlaps along the 15 separating axes (faces of either, products of
edges; Gottschalk, Lin, Manocha 1996); zero or less means that a plane parts them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SIGNS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)


@dataclass(frozen=True)
class Box:
    """centre (3,) [m], size (3,) [m] along the columns of rotation (3, 3)."""

    centre: np.ndarray
    size: np.ndarray
    rotation: np.ndarray

    @classmethod
    def between(cls, lower, upper) -> Box:
        """The box along the axes with these corners."""
        lower, upper = np.asarray(lower, float), np.asarray(upper, float)
        return cls((lower + upper) / 2, upper - lower, np.eye(3))

    def corners(self) -> np.ndarray:
        """(8, 3) [m]."""
        return self.centre + (_SIGNS * self.size / 2) @ self.rotation.T

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Smallest and largest coordinates (3,), (3,) [m]."""
        corners = self.corners()
        return corners.min(axis=0), corners.max(axis=0)

    def holds(self, points: np.ndarray, margin: float = 0.0) -> np.ndarray:
        """Which of the points (n, 3) lie inside; a margin [m] > 0 counts points just outside as well."""
        local = (points - self.centre) @ self.rotation
        return (np.abs(local) <= self.size / 2 + margin).all(axis=1)


def rotation_matrix(axis, angle: float) -> np.ndarray:
    """Rodrigues: R = I + sin(a) W + (1 - cos(a)) W^2, W the cross product with the unit axis (3, 3)."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross


def overlap_depth(a: Box, b: Box) -> float:
    """How far one box must move for the two to part [m]; ≤ 0: they do not overlap."""
    edges = [np.cross(u, v) for u in a.rotation.T for v in b.rotation.T]
    axes = np.array([*a.rotation.T, *b.rotation.T, *(e for e in edges if np.linalg.norm(e) > 1e-9)])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    reach_a = np.abs(axes @ a.rotation) @ a.size / 2
    reach_b = np.abs(axes @ b.rotation) @ b.size / 2
    return float((reach_a + reach_b - np.abs(axes @ (b.centre - a.centre))).min())


def near_pairs(boxes: list[Box]) -> np.ndarray:
    """(k, 2) pairs of boxes whose bounds overlap."""
    if len(boxes) < 2:
        return np.empty((0, 2), int)
    bounds = np.array([box.bounds() for box in boxes])
    lower, upper = bounds[:, 0], bounds[:, 1]
    touching = ((lower[:, None] < upper[None]) & (lower[None] < upper[:, None])).all(axis=2)
    return np.argwhere(np.triu(touching, 1))
