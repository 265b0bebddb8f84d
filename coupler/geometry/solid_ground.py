"""Solids as ground: how high those that stand on the bed of a tank raise it."""

from __future__ import annotations

import numpy as np

from array_types import Array

TOUCHING = 1e-6
"""Share of its height by which a solid may stand over what it stands on."""


def raised_by(bed, places, solids) -> Array:
    """Heights z (n,) [m] of the ground at places (n, 2) [m]: of the bed (n,) [m], or of the top of the convex solids
    [(vertices (v, 3), faces)] that stand on it or on one another there."""
    ground = np.array(bed, float)
    spans = [_upright(vertices, faces, places) for vertices, faces in solids]
    for _ in spans:
        before = ground.copy()
        for low, high in spans:
            ground = np.where(low <= ground + TOUCHING * (high - low), np.maximum(ground, high), ground)
        if (ground == before).all():
            break
    return ground


def tops_below(bed, places, heights, blocks) -> Array:
    """Heights z (n,) [m] of what lies below places (n, 2) [m] at most at these heights (n,) [m]: the bed (n,) [m], or
    the top of a block there, whatever it stands on."""
    found = np.array(bed, float)
    for block in blocks:
        _, high = _upright(block.world_vertices(), block.faces, places)
        found = np.where(high <= heights, np.maximum(found, high), found)
    return found


def _upright(vertices, faces, places) -> tuple[Array, Array]:
    """Ends z (n,) [m] of what a convex solid has of the vertical lines through places (n, 2) [m]; (∞, -∞) where it has
    none."""
    vertices = np.asarray(vertices, float)
    middle = vertices.mean(axis=0)
    low, high = np.full(len(places), -np.inf), np.full(len(places), np.inf)
    for face in faces:
        corners = vertices[np.asarray(face, int)]
        normal = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0)
        normal /= np.linalg.norm(normal)
        offset = normal @ corners.mean(axis=0)
        if normal @ middle > offset:
            normal, offset = -normal, -offset
        left = offset - np.asarray(places, float) @ normal[:2]
        if abs(normal[2]) < TOUCHING:
            outside = left < -TOUCHING * np.ptp(vertices, axis=0).max()
            low, high = np.where(outside, np.inf, low), np.where(outside, -np.inf, high)
        elif normal[2] > 0.0:
            high = np.minimum(high, left / normal[2])
        else:
            low = np.maximum(low, left / normal[2])
    missed = low > high
    return np.where(missed, np.inf, low), np.where(missed, -np.inf, high)
