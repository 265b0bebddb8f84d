"""Touching faces: of two blocks, or of a block and a fixed plane (ground, tank wall).

Two faces touch where their normals are opposite, their planes coincide and their polygons overlap; the overlap is
found by clipping one convex polygon by the other in the face plane (Sutherland and Hodgman 1974), so that full faces,
running bond and offset courses are the same case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats, Ints
from kernels.decorators import helper, inner, kernel
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.polyhedra import cross_products, face_areas, polygon_area_vector
from yade_scripts.blocks.quadrature import Rule, gauss

PARALLEL = 1e-6
"""Largest 1 + n_a·n_b of faces that count as opposite."""
GAP = 1e-5
"""Largest distance of touching planes, as a share of the smaller block's radius; single precision in files of blocks
causes a tenth of it."""
SLIVER = 1e-6
"""Smallest overlap, as a share of the smaller face, that counts."""
SQUARE = 1e-5
"""Deviation from a parallelogram, as a share of the size of a face, up to which the face counts as one."""
DOUBLE = 1e-12
"""Corners of an overlap that are closer than this share of a face's extent are merged."""


@dataclass(frozen=True)
class FixedPlane:
    """A fixed half space: the solid is where normal·(x - point) < 0. point (3,) [m], normal (3,) unit.

    bonds: blocks that stand on it are joined to it where joints are asked for; False: only contact
    material: name for friction by pairs."""

    point: Floats
    normal: Floats
    name: str = "ground"
    bonds: bool = True
    material: str = "ground"

    def __post_init__(self):
        normal = np.asarray(self.normal, float)
        object.__setattr__(self, "point", np.asarray(self.point, float))
        object.__setattr__(self, "normal", normal / np.linalg.norm(normal))

    def distance(self, points: Array) -> Array:
        """(k,) [m] of points (k, 3), negative in the solid."""
        return (points - self.point) @ self.normal


@dataclass(frozen=True, kw_only=True)
class TouchingFaces:
    """Overlap of face `face_a` of block a with face `face_b` of block b (b < 0: fixed plane number -1 - b).

    polygon (k, 3) [m] world, seen from outside block a · normal (3,) out of a.
    """

    a: int
    b: int
    face_a: int
    face_b: int
    polygon: Floats
    normal: Floats

    @property
    def area(self) -> float:
        """Area of the overlap [m²]."""
        return float(np.linalg.norm(polygon_area_vector(self.polygon)))


def both_held(blocks: list[Block], face: TouchingFaces) -> bool:
    """Whether both sides are fixed, so that nothing between them can break. (Driven blocks may separate.)"""
    return all(blocks[row].fixed for row in (face.a, face.b) if row >= 0)


@dataclass(frozen=True)
class _WorldFaces:
    """All faces of all blocks, block after block. block_start (n+1,): faces of each block · corner_start (f+1,)

    normals (f, 3) · middles (f, 3) [m] mean of the corners · areas (f,) [m²] · corners (c, 3) [m]."""

    block_start: Ints
    corner_start: Ints
    normals: Floats
    middles: Floats
    areas: Floats
    corners: Floats


def touching_faces(blocks: list[Block], planes: list[FixedPlane] | tuple = ()) -> list[TouchingFaces]:
    """All touching faces of the blocks as described, a < b, then those on fixed planes."""
    if not blocks:
        return []
    world = _world_faces(blocks)
    radius = np.array([b.radius for b in blocks])
    pairs = np.array(neighbour_pairs(blocks), int).reshape(-1, 2)
    rows, points = _overlaps(
        pairs, radius, world.block_start, world.corner_start, world.normals, world.middles, world.areas, world.corners
    )  # fmt: skip
    found = []
    for a, b, i, j, start, end in rows.tolist():
        face = world.block_start[a] + i
        found.append(
            TouchingFaces(a=a, b=b, face_a=i, face_b=j, polygon=points[start:end], normal=world.normals[face])
        )
    for p, plane in enumerate(planes):
        if plane.bonds:
            found += _on_plane(world, radius, p, plane)
    return found


def neighbour_pairs(blocks: list[Block]) -> list[tuple[int, int]]:
    """Pairs a < b whose bounding boxes touch, in order."""
    if len(blocks) < 2:
        return []
    corners = [b.world_vertices() for b in blocks]
    low, high = np.array([c.min(axis=0) for c in corners]), np.array([c.max(axis=0) for c in corners])
    slack = GAP * max(b.radius for b in blocks)
    return [(a, b) for a, b in touching_bounds(low, high, slack).tolist()]


def touching_bounds(low: Array, high: Array, slack: float) -> Array:
    """(m, 2) pairs a < b of boxes low (n, 3) .. high (n, 3) [m] that are at most `slack` [m] apart, in order."""
    axis = int(np.argmax(np.ptp(0.5 * (low + high), axis=0)))
    order = np.argsort(low[:, axis], kind="stable")
    pairs = _swept(low[order], high[order] + slack, axis)
    found = np.sort(order[pairs], axis=1)
    return found[np.lexsort((found[:, 1], found[:, 0]))]


@kernel
def _swept(low, high, axis):
    """Pairs of boxes that meet, sorted by low[:, axis]."""
    found = np.empty((16, 2), np.int64)
    count = 0
    for i in range(len(low)):
        for j in range(i + 1, len(low)):
            if low[j, axis] > high[i, axis]:
                break
            meet = True
            for k in range(3):
                meet = meet and low[i, k] <= high[j, k] and low[j, k] <= high[i, k]
            if meet:
                if count == len(found):
                    found = np.concatenate((found, np.empty_like(found)))
                found[count, 0], found[count, 1] = i, j
                count += 1
    return found[:count]


def _world_faces(blocks: list[Block]) -> _WorldFaces:
    faces = [[b.world_vertices()[list(f)] for f in b.faces] for b in blocks]
    sizes = [len(f) for own in faces for f in own]
    areas = np.concatenate([face_areas(b.vertices, b.faces) @ b.rotation.T for b in blocks])
    area = np.linalg.norm(areas, axis=1)
    return _WorldFaces(
        block_start=np.concatenate([[0], np.cumsum([len(own) for own in faces])]),
        corner_start=np.concatenate([[0], np.cumsum(sizes)]),
        normals=np.concatenate([b.planes[0] @ b.rotation.T for b in blocks]),
        middles=np.array([f.mean(axis=0) for own in faces for f in own]),
        areas=area,
        corners=np.concatenate([f for own in faces for f in own]),
    )


def _on_plane(world: _WorldFaces, radius: Array, p: int, plane: FixedPlane) -> list[TouchingFaces]:
    """Faces of blocks that lie on a fixed plane."""
    owner = np.repeat(np.arange(len(radius)), np.diff(world.block_start))
    distance = np.abs((world.middles - plane.point) @ plane.normal)
    on = (world.normals @ plane.normal < -1.0 + PARALLEL) & (distance < GAP * radius[owner])
    found = []
    for face in np.flatnonzero(on):
        a, corners = int(owner[face]), slice(world.corner_start[face], world.corner_start[face + 1])
        own = int(face - world.block_start[a])
        found.append(
            TouchingFaces(
                a=a,
                b=-1 - p,
                face_a=own,
                face_b=-1,
                polygon=world.corners[corners],
                normal=world.normals[face],
            )
        )
    return found


@kernel
def _overlaps(pairs, radius, block_start, corner_start, normals, middles, areas, corners):
    """Rows (a, b, face_a, face_b, start, end) of the overlaps and their corners (·, 3), counted by start and end."""
    rows = np.empty((16, 6), np.int64)
    points = np.empty((64, 3))
    count = used = 0
    for p in range(len(pairs)):
        a, b = pairs[p, 0], pairs[p, 1]
        gap = GAP * min(radius[a], radius[b])
        for i in range(block_start[a], block_start[a + 1]):
            for j in range(block_start[b], block_start[b + 1]):
                if not _opposite(normals[i], normals[j], middles[i], middles[j], gap):
                    continue
                window = corners[corner_start[j] : corner_start[j + 1]][::-1]
                overlap = clip(corners[corner_start[i] : corner_start[i + 1]], window, normals[i])
                if len(overlap) < 3 or _area(overlap) <= SLIVER * min(areas[i], areas[j]):
                    continue
                while used + len(overlap) > len(points):
                    points = np.concatenate((points, np.empty_like(points)))
                if count == len(rows):
                    rows = np.concatenate((rows, np.empty_like(rows)))
                for corner in range(len(overlap)):
                    for k in range(3):
                        points[used + corner, k] = overlap[corner, k]
                rows[count, 0], rows[count, 1] = a, b
                rows[count, 2], rows[count, 3] = i - block_start[a], j - block_start[b]
                rows[count, 4], rows[count, 5] = used, used + len(overlap)
                count += 1
                used += len(overlap)
    return rows[:count], points[:used]


@inner
def _opposite(n, m, of_n, of_m, gap):
    """Whether two faces are opposite and lie in one plane; of_n, of_m: a point of each."""
    if n[0] * m[0] + n[1] * m[1] + n[2] * m[2] > -1.0 + PARALLEL:
        return False
    x, y, z = of_n[0] - of_m[0], of_n[1] - of_m[1], of_n[2] - of_m[2]
    from_n = abs(n[0] * x + n[1] * y + n[2] * z)
    from_m = abs(m[0] * x + m[1] * y + m[2] * z)
    return max(from_n, from_m) < gap


@inner
def _area(polygon):
    """Area of a plane convex polygon (k, 3) [m²]."""
    x = y = z = 0.0
    for i in range(1, len(polygon) - 1):
        u0, u1, u2 = _between(polygon, 0, i)
        v0, v1, v2 = _between(polygon, 0, i + 1)
        x += u1 * v2 - u2 * v1
        y += u2 * v0 - u0 * v2
        z += u0 * v1 - u1 * v0
    return 0.5 * np.sqrt(x * x + y * y + z * z)


@inner
def _between(polygon, i, j):
    """Vector from corner i of a polygon to its corner j."""
    return polygon[j, 0] - polygon[i, 0], polygon[j, 1] - polygon[i, 1], polygon[j, 2] - polygon[i, 2]


@helper
def clip(subject, window, normal):
    """Part of the convex polygon `subject` (k, 3) inside `window` (l, 3); one plane, same sense about normal."""
    kept, extent = np.empty((len(subject), 3)), 0.0  # relative to the first corner of the window
    for i in range(len(subject)):
        for k in range(3):
            kept[i, k] = subject[i, k] - window[0, k]
            extent = max(extent, abs(kept[i, k]))
    for i in range(len(window)):
        u0, u1, u2 = _between(window, i, (i + 1) % len(window))
        x, y, z = (
            normal[1] * u2 - normal[2] * u1,
            normal[2] * u0 - normal[0] * u2,
            normal[0] * u1 - normal[1] * u0,
        )
        length = np.sqrt(x * x + y * y + z * z)
        inward = (x / length, y / length, z / length)
        kept = _keep_inside(kept, _between(window, 0, i), inward, DOUBLE * extent)
    kept = _without_doubles(kept, DOUBLE * extent)
    for i in range(len(kept)):
        for k in range(3):
            kept[i, k] += window[0, k]
    return kept


@helper
def _keep_inside(polygon, start, inward, same):
    """Part of a convex polygon where inward·(x - start) ≥ 0; heights below `same` are zero."""
    count = len(polygon)
    height = np.empty(count)
    for i in range(count):
        h = (polygon[i, 0] - start[0]) * inward[0]
        h += (polygon[i, 1] - start[1]) * inward[1]
        h += (polygon[i, 2] - start[2]) * inward[2]
        height[i] = 0.0 if abs(h) < same else h
    kept = np.empty((2 * count, 3))
    found = 0
    for i in range(count):
        j = (i + 1) % count
        if height[i] >= 0.0:
            for k in range(3):
                kept[found, k] = polygon[i, k]
            found += 1
        if height[i] * height[j] < 0.0:
            share = height[i] / (height[i] - height[j])
            for k in range(3):
                kept[found, k] = polygon[i, k] + (polygon[j, k] - polygon[i, k]) * share
            found += 1
    return kept[:found]


@helper
def _without_doubles(polygon, same):
    """The corners (k, 3) that lie farther than `same` [m] from the one before."""
    kept = np.empty((len(polygon), 3))
    found = 0
    for i in range(len(polygon)):
        x, y, z = _between(polygon, i - 1 if i > 0 else len(polygon) - 1, i)
        if np.sqrt(x * x + y * y + z * z) > same:
            for k in range(3):
                kept[found, k] = polygon[i, k]
            found += 1
    return kept[:found]


def gauss_points(polygon: Array, rule: Rule | int) -> tuple[Array, Array]:
    """Positions (q, 3) [m] and weights (q,) [m²] on a convex polygon (k, 3). rule: a number q stands for the Gauss rule
    with q points.

    A parallelogram gets the tensor rule, which with q Gauss points is exact for polynomials of degree 2 q - 1 in each
    direction; any other polygon gets a fan of triangles with the same rule collapsed on each.
    """
    rule = gauss(rule) if isinstance(rule, int) else rule
    if len(polygon) == 4 and _is_parallelogram(polygon):
        return _mapped_rule(polygon, rule)
    centre = polygon.mean(axis=0)
    ring = zip(polygon, np.roll(polygon, -1, axis=0))
    rules = [_mapped_rule(np.array([centre, p, q, centre]), rule) for p, q in ring]
    return np.concatenate([r[0] for r in rules]), np.concatenate([r[1] for r in rules])


def _is_parallelogram(corners: Array) -> bool:
    """Whether opposite sides of four corners (4, 3) are equal, relative to their size and not to their place."""
    left_over = np.abs(corners[0] - corners[1] + corners[2] - corners[3]).max()
    return bool(left_over <= SQUARE * np.ptp(corners, axis=0).max())


def _mapped_rule(corners: Array, rule: Rule) -> tuple[Array, Array]:
    """Tensor rule of the bilinear map on four corners (4, 3); two equal corners make a triangle."""
    s, w = rule.places, rule.weights
    u, v = (g.ravel() for g in np.meshgrid(s, s, indexing="ij"))
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    du = np.stack([-(1 - v), 1 - v, v, -v], axis=1) @ corners
    dv = np.stack([-(1 - u), -u, u, 1 - u], axis=1) @ corners
    return shape @ corners, np.outer(w, w).ravel() * np.linalg.norm(cross_products(du, dv), axis=1)


def to_body(points: Array, row: Array, centre: Array, R: Array) -> Array:
    """World points (P, 3) → frame of their body; row < 0 stays in the world."""
    local = points.copy()
    on = row >= 0
    local[on] = np.einsum("pji,pj->pi", R[row[on]], points[on] - centre[row[on]])
    return local
