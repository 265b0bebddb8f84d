"""Where a point is in the physical domain: in which cell, on which side of a thin wall, or inside a body.

A background cell that a thin wall cuts in two holds two cells of the domain, each with its own unknowns. The one whose
fluid part holds the point answers: of all tetrahedra of the parts (`fans.py`) that to which the point is nearest,

    d(x) = max over its four planes of the distance of x outside of them, 0 within,

since a point on the face of a wall is outside of all of them by round-off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

SKIN = 0.05
"""Share of a cell edge within which a point inside a body still counts as on its face: blocks creep under load."""
NEAR = 1e-9
"""Share of a cell edge within which a point counts as in the fluid part of a cell."""
RINGS = 4
"""Faces across which the fluid part that holds a point is sought: around a node of the mesh no more are needed."""


class Outside(ValueError):
    """A gauge lies outside the tank."""


@dataclass(frozen=True)
class Places:
    """Points (m, 3) [m] in a domain: corners (m, 4) nodes of the cell that answers, weight (m, 4) its hat functions
    there, known (m,) bool: there is such a cell · inside (m,) bool: in a body, deeper than its skin."""

    corners: np.ndarray
    weight: np.ndarray
    known: np.ndarray
    inside: np.ndarray

    @classmethod
    def of(cls, water, points, beyond: bool = False) -> Places:
        """Look points (m, 3) or (3,) [m] up.  Raises Outside for those outside the mesh; beyond: only if all are, the
        rest count as inside a body.

        A point on a face of the mesh may be found in the background cell behind it: then a neighbour answers."""
        points = np.atleast_2d(np.asarray(points, float))
        parent = water.mesh.locate(points)
        outside = parent < 0
        if outside.all() if beyond else outside.any():
            low, high = water.mesh.bounds
            place = points[np.flatnonzero(outside)[0]]
            raise Outside(f"gauge at {place} lies outside the tank {low} to {high}; move it inside")
        t = water.topology
        deep = outside | (_depth(water.domain.memory, parent, points) > SKIN * water.mesh.local_size[parent])
        first, count = t.rows_of_background
        neighbours, near = water.mesh.neighbours, NEAR * water.mesh.finest
        cell = _answering(points, parent, deep, neighbours, first, count, t.parts, t.nodes, near)
        corners = t.cells[cell]
        weight = np.einsum("mak,mk->ma", t.gradients[t.parent[cell]], points - t.nodes[corners[:, 0]])
        weight[:, 0] += 1.0
        return cls(corners, weight, cell >= 0, deep | (cell < 0))

    def read(self, field, inside: bool = False) -> np.ndarray:
        """P1 values (m, ...) of a field (N, ...); NaN inside bodies, or, with inside=True, continued into cut cells."""
        value = np.einsum("ma,ma...->m...", self.weight, field[self.corners])
        value[~self.known if inside else self.inside] = np.nan
        return value


@njit(cache=True)
def _answering(points, parent, skipped, neighbours, first, count, parts, nodes, near):
    """Cell (m,) of a topology for points (m, 3) in background cells parent (m,), but those skipped (m,) bool; -1 where
    none is found.  Whole cells answer for themselves; else the nearest fluid part does, sought across ever more faces
    until one is nearer than `near` [m]."""
    answer = np.full(len(points), -1)
    found = np.empty(4**RINGS * 2, np.int64)
    for i in range(len(points)):
        row = first[parent[i]]
        if skipped[i]:
            continue
        if count[parent[i]] == 1 and parts.start[row] == parts.start[row + 1]:
            answer[i] = row
            continue
        found[0], begin, n, nearest = parent[i], 0, 1, np.inf
        for _ in range(RINGS):
            end = n
            for k in range(begin, end):
                for row in range(first[found[k]], first[found[k]] + count[found[k]]):
                    d = _distance(parts, nodes, row, points[i])
                    if d < nearest:
                        nearest, answer[i] = d, row
                n = _with_neighbours(neighbours[found[k]], found, n)
            if nearest < near:
                break
            begin = end
    return answer


@njit(cache=True)
def _with_neighbours(around, found, n):
    """Add those of `around` (4,) that are there and not among the first n of `found` yet; the new n."""
    for c in around:
        new = c >= 0
        for k in range(n):
            new = new and found[k] != c
        if new:
            found[n] = c
            n += 1
    return n


@njit(cache=True)
def _distance(parts, nodes, row, point):
    """d (see above) of a point (3,) from the fluid part of a cell [m]."""
    x = nodes[parts.cells[row]]
    if parts.start[row] == parts.start[row + 1]:
        return _beyond(x, point)
    nearest = np.inf
    for t in range(parts.start[row], parts.start[row + 1]):
        nearest = min(nearest, _beyond(parts.corners[t] @ x, point))
    return nearest


@njit(cache=True)
def _beyond(x, point):
    """d of a point (3,) from a tetrahedron with the corners x (4, 3) [m]; planes without an area do not count."""
    largest = 0.0
    for k in range(4):
        a, b, c = x[(k + 1) % 4], x[(k + 2) % 4], x[(k + 3) % 4]
        normal = np.cross(b - a, c - a)
        length = np.sqrt(normal @ normal)
        if length > 0.0:
            inward = 1.0 if normal @ (x[k] - a) > 0.0 else -1.0
            largest = max(largest, -inward * (normal @ (point - a)) / length)
    return largest


def _depth(memory, parent, points) -> np.ndarray:
    """How deep (m,) [m] points (m, 3) in background cells parent (m,) lie in the body that they lie deepest in, at
    most 0 outside of all."""
    bodies, depth = memory.bodies, np.zeros(len(points))
    start, end = (np.searchsorted(memory.pair_cell, parent, side=side) for side in ("left", "right"))
    for i in np.flatnonzero(end > start):
        for body in memory.pair_body[start[i] : end[i]]:
            planes = slice(bodies.plane_start[body], bodies.plane_start[body + 1])
            height = bodies.normals[planes] @ points[i] - bodies.offsets[planes] - bodies.growth[planes]
            depth[i] = max(depth[i], -height.max())
    return depth
