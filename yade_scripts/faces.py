"""Faces that touch: between two blocks, or between a block and a fixed plane (ground, tank wall).

Two faces touch where their normals are opposite, their planes coincide and their polygons overlap; the overlap is
found by clipping one convex polygon by the other in the face plane (Sutherland and Hodgman 1974), so full faces,
running bond and offset courses are the same case.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from yade_scripts.blocks import Block, polygon_area_vector

Array = np.ndarray

PARALLEL = 1e-6
"""Largest 1 + n_a·n_b of faces that count as opposite."""
GAP = 1e-6
"""Largest distance of touching planes, as a share of the smaller block's radius."""
SLIVER = 1e-6
"""Smallest overlap, as a share of the smaller face, that counts."""


@dataclass(frozen=True)
class FixedPlane:
    """A fixed half space: the solid is where normal·(x - point) < 0. point (3,) [m], normal (3,) unit.

    bonds: blocks that stand on it are joined to it where joints are asked for; False: only contact
    material: for friction."""

    point: Array
    normal: Array
    name: str = "ground"
    bonds: bool = True
    material: str = "ground"

    def __post_init__(self):
        normal = np.asarray(self.normal, float)
        object.__setattr__(self, "point", np.asarray(self.point, float))
        object.__setattr__(self, "normal", normal / np.linalg.norm(normal))


@dataclass(frozen=True)
class TouchingFaces:
    """Overlap of face `face_a` of block a with face `face_b` of block b (b < 0: fixed plane number -1 - b).

    polygon (k, 3) [m] world, seen from outside block a · normal (3,) out of a.
    """

    a: int
    b: int
    face_a: int
    face_b: int
    polygon: Array
    normal: Array

    @property
    def area(self) -> float:
        return float(np.linalg.norm(polygon_area_vector(self.polygon)))


def touching_faces(blocks: list[Block], planes: list[FixedPlane] | tuple = ()) -> list[TouchingFaces]:
    """All touching faces of the blocks as described, a < b, then those on fixed planes."""
    world = [_world_faces(b) for b in blocks]
    found = []
    for a, b in neighbour_pairs(blocks):
        found += _pair_faces(blocks, world, a, b)
    for p, plane in enumerate(planes):
        if not plane.bonds:
            continue
        for a, block in enumerate(blocks):
            found += _plane_faces(block, world[a], a, p, plane)
    return found


def neighbour_pairs(blocks: list[Block]) -> list[tuple[int, int]]:
    """Pairs a < b whose bounding boxes touch, in order."""
    if len(blocks) < 2:
        return []
    low = np.array([b.world_vertices().min(axis=0) for b in blocks])
    high = np.array([b.world_vertices().max(axis=0) for b in blocks])
    slack = GAP * max(b.radius for b in blocks)
    half = 0.5 * np.linalg.norm(high - low, axis=1)
    near = cKDTree(0.5 * (low + high)).query_pairs(2.0 * half.max() + slack, output_type="ndarray")
    a, b = near.min(axis=1), near.max(axis=1)
    touch = ((low[a] <= high[b] + slack) & (low[b] <= high[a] + slack)).all(axis=1)
    return sorted(zip(a[touch].tolist(), b[touch].tolist()))


def _world_faces(block: Block) -> tuple[Array, Array, list[Array]]:
    normals, offsets = block.planes
    n = normals @ block.rotation.T
    vertices = block.world_vertices()
    return n, offsets + n @ block.centre, [vertices[list(f)] for f in block.faces]


def _pair_faces(blocks, world, a: int, b: int) -> list[TouchingFaces]:
    (na, da, pa), (nb, db, pb) = world[a], world[b]
    gap = GAP * min(blocks[a].radius, blocks[b].radius)
    opposite = np.argwhere((na @ nb.T < -1.0 + PARALLEL) & (np.abs(da[:, None] + db[None, :]) < gap))
    found = []
    for i, j in opposite:
        overlap = clip(pa[i], pb[j][::-1], na[i])
        smaller = min(np.linalg.norm(polygon_area_vector(p)) for p in (pa[i], pb[j]))
        if len(overlap) > 2 and np.linalg.norm(polygon_area_vector(overlap)) > SLIVER * smaller:
            found.append(TouchingFaces(a, b, int(i), int(j), overlap, na[i]))
    return found


def _plane_faces(block: Block, world, a: int, p: int, plane: FixedPlane) -> list[TouchingFaces]:
    normals, offsets, polygons = world
    level = -plane.normal @ plane.point
    on = (normals @ plane.normal < -1.0 + PARALLEL) & (np.abs(offsets - level) < GAP * block.radius)
    return [TouchingFaces(a, -1 - p, int(i), -1, polygons[i], normals[i]) for i in np.flatnonzero(on)]


def clip(subject: Array, window: Array, normal: Array) -> Array:
    """Part of the convex polygon `subject` (k, 3) inside `window` (l, 3); one plane, same sense about normal."""
    for start, end in zip(window, np.roll(window, -1, axis=0)):
        if len(subject) == 0:
            break
        inward = np.cross(normal, end - start)
        subject = _keep_inside(subject, (subject - start) @ (inward / np.linalg.norm(inward)))
    return _without_doubles(subject)


def _keep_inside(polygon: Array, height: Array) -> Array:
    height = np.where(np.abs(height) < 1e-12 * (1.0 + np.abs(polygon).max()), 0.0, height)
    kept = []
    for i in range(len(polygon)):
        j = (i + 1) % len(polygon)
        if height[i] >= 0.0:
            kept.append(polygon[i])
        if height[i] * height[j] < 0.0:
            kept.append(polygon[i] + (polygon[j] - polygon[i]) * (height[i] / (height[i] - height[j])))
    return np.array(kept).reshape(-1, 3)


def _without_doubles(polygon: Array) -> Array:
    if len(polygon) < 2:
        return polygon
    step = np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=1)
    return polygon[step > 1e-12 * (1.0 + np.abs(polygon).max())]


def gauss_points(polygon: Array, points: int) -> tuple[Array, Array]:
    """Positions (q, 3) [m] and weights (q,) [m²] on a convex polygon (k, 3).

    A parallelogram gets the tensor rule points x points, exact for polynomials of degree 2 points - 1 in each
    direction; any other polygon a fan of triangles with the same rule collapsed on each.
    """
    if len(polygon) == 4 and np.allclose(polygon[0] + polygon[2], polygon[1] + polygon[3]):
        return _mapped_rule(polygon, points)
    centre = polygon.mean(axis=0)
    ring = zip(polygon, np.roll(polygon, -1, axis=0))
    rules = [_mapped_rule(np.array([centre, p, q, centre]), points) for p, q in ring]
    return np.concatenate([r[0] for r in rules]), np.concatenate([r[1] for r in rules])


def _mapped_rule(corners: Array, points: int) -> tuple[Array, Array]:
    """Tensor Gauss rule of the bilinear map on four corners (4, 3); two equal corners make a triangle."""
    s, w = np.polynomial.legendre.leggauss(points)
    s, w = 0.5 * (s + 1.0), 0.5 * w
    u, v = (g.ravel() for g in np.meshgrid(s, s, indexing="ij"))
    shape = np.stack([(1 - u) * (1 - v), u * (1 - v), u * v, (1 - u) * v], axis=1)
    du = np.stack([-(1 - v), 1 - v, v, -v], axis=1) @ corners
    dv = np.stack([-(1 - u), -u, u, 1 - u], axis=1) @ corners
    return shape @ corners, np.outer(w, w).ravel() * np.linalg.norm(np.cross(du, dv), axis=1)
