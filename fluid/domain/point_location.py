"""Location of points in the physical domain: the cell, the side of a thin wall, or the inside of a body.

A background cell that a thin wall cuts in two contains two cells of the domain, each with its own unknowns. The cell
whose fluid part contains the point is the one sought: of all tetrahedra of the parts (`fans.py`), that with the least

    d(x) = max over its four planes of the distance of x outside of them, 0 within,

since round-off may put a point on the face of a wall outside of all of them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Bools, Floats, Integers
from kernels.decorators import inner, kernel

SKIN = 0.05
"""Share of a cell edge within which a point inside a body still counts as on its face: blocks creep under load."""
NEAR = 1e-9
"""Share of a cell edge within which a point counts as in the fluid part of a cell."""
RINGS = 4
"""Number of faces across which the fluid part that contains a point is sought; around a node of the mesh no more are
needed."""


class Outside(ValueError):
    """A point at which the water is read lies outside the mesh of the tank."""


@dataclass(frozen=True)
class Places:
    """Points (m, 3) [m] in a domain: corners (m, 4) nodes of the cell used for each, weight (m, 4) its hat functions
    there, known (m,) bool: there is such a cell · inside (m,) bool: in a body, deeper than its skin."""

    corners: Integers
    weight: Floats
    known: Bools
    inside: Bools

    @classmethod
    def of(cls, water, points, beyond: bool = False) -> Places:
        """Look up points (m, 3) or (3,) [m].  Raises Outside if one lies outside the mesh; with beyond=True only if all
        do, and other points outside count as inside a body.

        A point on a face of the mesh may be found in the background cell behind it; then a neighbour of that cell is
        used."""
        points = np.atleast_2d(np.asarray(points, float))
        parent = water.mesh.locate(points)
        outside = parent < 0
        if outside.all() if beyond else outside.any():
            low, high = water.mesh.bounds
            place, low, high = (
                "({:.6g}, {:.6g}, {:.6g})".format(*x) for x in (points[np.flatnonzero(outside)[0]], low, high)
            )
            raise Outside(
                f"the place {place} m, at which the water is asked, lies outside the mesh of the tank, which reaches "
                f"from {low} to {high} m: beyond a side or under the bed; move it into the water"
            )
        t = water.topology
        deep = outside | (_depth(water.domain.memory, parent, points) > SKIN * water.mesh.local_size[parent])
        first, count = t.rows_of_background
        neighbours, near = water.mesh.neighbours, NEAR * water.mesh.finest
        cell = _answering(points, parent, deep, neighbours, first, count, t.parts, t.nodes, near)
        corners = t.cells[cell]
        weight = np.einsum("mak,mk->ma", t.gradients[t.parent[cell]], points - t.nodes[corners[:, 0]])
        weight[:, 0] += 1.0
        return cls(corners, weight, cell >= 0, deep | (cell < 0))

    def read(self, field, inside: bool = False) -> Array:
        """P1 values (m, ...) of a field (N, ...); NaN inside bodies, or, with inside=True, continued into cut cells."""
        value = np.einsum("ma,ma...->m...", self.weight, field[self.corners])
        value[~self.known if inside else self.inside] = np.nan
        return value


@kernel
def _answering(points, parent, skipped, neighbours, first, count, parts, nodes, near):
    """Cell (m,) of a topology for points (m, 3) in background cells parent (m,), but those skipped (m,) bool; -1 where
    none is found.  A whole cell is used itself, otherwise the nearest fluid part, sought across an increasing number of
    faces until one is nearer than `near` [m]."""
    answer, x, corners = np.full(len(points), -1), np.empty((4, 3)), np.empty((4, 3))
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
                    d = _distance(parts, nodes, row, points[i], x, corners)
                    if d < nearest:
                        nearest, answer[i] = d, row
                n = _with_neighbours(neighbours[found[k]], found, n)
            if nearest < near:
                break
            begin = end
    return answer


@inner
def _with_neighbours(around, found, n):
    """Append those of `around` (4,) that exist and are not among the first n of `found`, and return the new n."""
    for c in around:
        new = c >= 0
        for k in range(n):
            new = new and found[k] != c
        if new:
            found[n] = c
            n += 1
    return n


@inner
def _distance(parts, nodes, row, point, x, corners):
    """d (see above) of a point (3,) from the fluid part of a cell [m]; x, corners (4, 3): work space."""
    for a in range(4):
        for k in range(3):
            x[a, k] = nodes[parts.cells[row, a], k]
    if parts.start[row] == parts.start[row + 1]:
        return _beyond(x, point)
    nearest = np.inf
    for t in range(parts.start[row], parts.start[row + 1]):
        for a in range(4):
            for k in range(3):
                corners[a, k] = 0.0
                for b in range(4):
                    corners[a, k] += parts.corners[t, a, b] * x[b, k]
        nearest = min(nearest, _beyond(corners, point))
    return nearest


@inner
def _beyond(x, point):
    """d of a point (3,) from a tetrahedron with the corners x (4, 3) [m]; planes without an area do not count."""
    largest = 0.0
    for k in range(4):
        a, b, c = (k + 1) % 4, (k + 2) % 4, (k + 3) % 4
        u0, u1, u2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        v0, v1, v2 = x[c, 0] - x[a, 0], x[c, 1] - x[a, 1], x[c, 2] - x[a, 2]
        n = (u1 * v2 - u2 * v1, u2 * v0 - u0 * v2, u0 * v1 - u1 * v0)
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        if length > 0.0:
            inward = 1.0 if _height(n, x[a], x[k]) > 0.0 else -1.0
            largest = max(largest, -inward * _height(n, x[a], point) / length)
    return largest


@inner
def _height(normal, a, x):
    """normal · (x - a)."""
    return normal[0] * (x[0] - a[0]) + normal[1] * (x[1] - a[1]) + normal[2] * (x[2] - a[2])


def _depth(memory, parent, points) -> Array:
    """Depth (m,) [m] of points (m, 3) in background cells parent (m,) inside the body that contains them deepest; at
    most 0 outside all bodies."""
    bodies, depth = memory.bodies, np.zeros(len(points))
    start, end = (np.searchsorted(memory.pair_cell, parent, side=side) for side in ("left", "right"))
    for i in np.flatnonzero(end > start):
        for body in memory.pair_body[start[i] : end[i]]:
            planes = slice(bodies.plane_start[body], bodies.plane_start[body + 1])
            height = bodies.normals[planes] @ points[i] - bodies.offsets[planes] - bodies.growth[planes]
            depth[i] = max(depth[i], -height.max())
    return depth
