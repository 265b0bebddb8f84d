"""Rigid convex bodies for the water: half spaces n·x ≤ o in world coordinates.

A body is the intersection of its half spaces; its vertices serve only the broad search and the tests.
Every plane may be shifted outward by its `growth` [m] before the water is cut. In this way the state of a joint, and
not the noise of the gap, closes the faces of an intact joint, and a negative value may open faces in mere contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial import ConvexHull

from array_types import Array, Floats, Ints
from fluid.mesh.arrays import Planes
from kernels.decorators import kernel

# Two facets of a hull belong to one plane below this difference of (normal, offset / size).
SAME_PLANE = 1e-9


class NotConvex(ValueError):
    """A polyhedron passed to the water is not convex, not closed, or has no volume."""


@dataclass(frozen=True, kw_only=True)
class BodyShapes:
    """n convex polyhedra in their own frames (reference point at the origin, axes of the body).

    normals (P, 3) · offsets (P,) [m] · plane_start (n+1,) · vertices (V, 3) [m] · vertex_start (n+1,)
    reach (n,): a shift g of the planes moves no vertex by more than reach * g.
    """

    normals: Floats
    offsets: Floats
    plane_start: Ints
    vertices: Floats
    vertex_start: Ints
    reach: Floats

    def __len__(self) -> int:
        return len(self.plane_start) - 1

    def placed(self, centre, rotation=None, growth=None) -> ConvexBodies:
        """The bodies at x = centre + rotation X.

        centre (n, 3) [m] · rotation (n, 3, 3) or None for none · growth (P,) [m] or None for 0."""
        centre = np.ascontiguousarray(centre, dtype=np.float64).reshape(-1, 3)
        normals, vertices = self.normals, self.vertices
        of_plane = _owners(self.plane_start)
        of_vertex = _owners(self.vertex_start)
        if rotation is not None:
            rotation = np.asarray(rotation, dtype=np.float64)
            normals = _rotated(rotation[of_plane], normals)
            vertices = _rotated(rotation[of_vertex], vertices)
        else:
            rotation = np.repeat(np.eye(3)[None], len(centre), axis=0)
        offsets = self.offsets + _dot(normals, centre[of_plane])
        grown = np.zeros(len(offsets)) if growth is None else np.array(growth, dtype=np.float64)
        return ConvexBodies(
            normals=np.ascontiguousarray(normals),
            offsets=offsets,
            plane_start=self.plane_start,
            vertices=vertices + centre[of_vertex],
            vertex_start=self.vertex_start,
            centre=centre,
            rotation=rotation,
            growth=grown,
            reach=self.reach,
            shapes=self,
        )

    @classmethod
    def from_polyhedra(cls, polyhedra) -> BodyShapes:
        """polyhedra: list of (vertices (k, 3), faces) in the body frame; faces = list of vertex index
        loops of any orientation, or None for the convex hull. Raises NotConvex."""
        planes = [_planes_of(vertices, faces, at) for at, (vertices, faces) in enumerate(polyhedra)]
        vertices = [np.asarray(v, dtype=np.float64) for v, _ in polyhedra]
        return cls(
            normals=_stacked([n for n, _ in planes]),
            offsets=np.concatenate([o for _, o in planes]) if planes else np.zeros(0),
            plane_start=_starts([len(o) for _, o in planes]),
            vertices=_stacked(vertices),
            vertex_start=_starts([len(v) for v in vertices]),
            reach=np.array([_reach(v, n, o) for v, (n, o) in zip(vertices, planes)]),
        )


@dataclass(frozen=True, kw_only=True)
class ConvexBodies:
    """n convex polyhedra in world coordinates; inside: normals @ x <= offsets + growth.

    normals (P, 3) outward, unit · offsets (P,) [m] · plane_start (n+1,): planes of body b are
    plane_start[b]:plane_start[b+1] · vertices (V, 3) [m], vertex_start (n+1,): of the exact position
    centre (n, 3) [m]: point that moments refer to · rotation (n, 3, 3) body to world
    growth (P,) [m] outward shift used by the cutter · reach (n,): see BodyShapes
    shapes: the reference geometry, for `moved`.
    """

    normals: Floats
    offsets: Floats
    plane_start: Ints
    vertices: Floats
    vertex_start: Ints
    centre: Floats
    rotation: Floats
    growth: Floats
    reach: Floats
    shapes: BodyShapes = field(repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.plane_start) - 1

    @classmethod
    def from_polyhedra(cls, polyhedra, centre=None) -> ConvexBodies:
        """polyhedra: list of (vertices (k, 3) in world coordinates [m], faces or None for the hull).
        centre (n, 3) [m], or None for the centres of volume. Raises NotConvex."""
        if not polyhedra:
            return cls.empty()
        if centre is None:
            centre = [centre_of_volume(vertices) for vertices, _ in polyhedra]
        centre = np.asarray(centre, dtype=np.float64).reshape(-1, 3)
        local = [(np.asarray(v, dtype=np.float64) - c, f) for (v, f), c in zip(polyhedra, centre)]
        return BodyShapes.from_polyhedra(local).placed(centre)

    @classmethod
    def boxes(cls, centre, size, rotation=None) -> ConvexBodies:
        """centre (n, 3), size (n, 3) edge lengths [m], rotation (n, 3, 3) body to world or None."""
        centre = np.asarray(centre, dtype=np.float64).reshape(-1, 3)
        return box_shapes(size).placed(centre, rotation)

    @classmethod
    def empty(cls) -> ConvexBodies:
        """An empty set of bodies."""
        return BodyShapes.from_polyhedra([]).placed(np.zeros((0, 3)))

    def moved(self, centre, rotation=None) -> ConvexBodies:
        """The same bodies (and growth) with reference points at centre (n, 3) and turned by
        rotation (n, 3, 3) from their reference attitude."""
        return self.shapes.placed(centre, rotation, self.growth)

    def grown(self, growth) -> ConvexBodies:
        """The same bodies with another outward shift of their planes, growth (P,) or () [m]."""
        return replace(self, growth=np.array(np.broadcast_to(growth, self.offsets.shape), dtype=np.float64))

    def cut_offsets(self) -> Array:
        """(P,) [m] offsets of the planes that the water is cut by."""
        return self.offsets + self.growth

    def planes(self) -> Planes:
        """The planes that cut the water, as kernels take them."""
        return Planes(self.normals, self.cut_offsets(), self.plane_start)

    def bounds(self) -> Array:
        """(n, 2, 3) [m] bounding boxes of the grown bodies."""
        if len(self) == 0:
            return np.zeros((0, 2, 3))
        lower = np.minimum.reduceat(self.vertices, self.vertex_start[:-1], axis=0)
        upper = np.maximum.reduceat(self.vertices, self.vertex_start[:-1], axis=0)
        growth = np.maximum.reduceat(np.maximum(self.growth, 0.0), self.plane_start[:-1])
        margin = (self.reach * growth)[:, None]
        return np.stack([lower - margin, upper + margin], axis=1)

    def contains(self, points) -> Array:
        """points (m, 3) [m] -> (m,) first (grown) body that contains the point, -1 where there is none."""
        points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
        return _holder(points, self.normals, self.cut_offsets(), self.plane_start, self.bounds())


def box_shapes(size) -> BodyShapes:
    """size (n, 3) edge lengths [m] -> n boxes centred at the origin of their frames."""
    size = np.asarray(size, dtype=np.float64).reshape(-1, 3)
    n = len(size)
    axes = np.vstack([-np.eye(3), np.eye(3)])
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return BodyShapes(
        normals=np.tile(axes, (n, 1)),
        offsets=np.hstack([size, size]).ravel() / 2,
        plane_start=np.arange(n + 1) * 6,
        vertices=(corners[None] * size[:, None]).reshape(-1, 3),
        vertex_start=np.arange(n + 1) * 8,
        reach=np.full(n, np.sqrt(3.0)),
    )


def centre_of_volume(vertices) -> Array:
    """Centre of volume (3,) [m] of the convex hull of vertices (k, 3)."""
    vertices = np.asarray(vertices, dtype=np.float64)
    hull = ConvexHull(vertices)
    apex = vertices.mean(axis=0)
    edges = vertices[hull.simplices] - apex
    volume = np.abs(np.linalg.det(edges))
    return apex + (volume[:, None] * edges.sum(axis=1) / 4).sum(axis=0) / volume.sum()


def _planes_of(vertices, faces, at):
    vertices = np.asarray(vertices, dtype=np.float64)
    if faces is None:
        return _hull_planes(vertices)
    inner = vertices.mean(axis=0)
    planes = [_loop_plane(vertices[list(loop)], inner) for loop in faces]
    normals = np.array([n for n, _ in planes])
    offsets = np.array([o for _, o in planes])
    size = np.ptp(vertices, axis=0).max()
    sticking_out = (vertices @ normals.T - offsets).max()
    if not np.isfinite(normals).all() or sticking_out > SAME_PLANE * size:
        raise NotConvex(
            f"polyhedron {at}: a vertex lies {sticking_out:.3g} m outside one of its faces "
            f"(size {size:.3g} m); "
            "split it into convex parts, or pass faces=None to take its convex hull"
        )
    return normals, offsets


def _hull_planes(vertices):
    """Distinct planes of the convex hull; coplanar facets count once."""
    equations = ConvexHull(vertices).equations
    size = np.ptp(vertices, axis=0).max()
    scaled = equations / np.array([1.0, 1.0, 1.0, size])
    kept = []
    for row in range(len(scaled)):
        if all(np.abs(scaled[row] - scaled[k]).max() > SAME_PLANE for k in kept):
            kept.append(row)
    return equations[kept, :3], -equations[kept, 3]


def _loop_plane(loop, inner):
    """Newell's normal of a polygon, pointing away from the inner point."""
    normal = _cross(loop, np.concatenate([loop[1:], loop[:1]])).sum(axis=0)
    normal = normal / np.linalg.norm(normal)
    middle = loop.mean(axis=0)
    if normal @ (middle - inner) < 0:
        normal = -normal
    return normal, float(normal @ middle)


def _cross(a, b):
    """a × b of vectors (k, 3); numpy.cross takes ten times as long for few of them."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)


def _reach(vertices, normals, offsets):
    """sqrt(k) / smallest singular value of the k normals that meet at a vertex, largest over vertices."""
    size = np.ptp(vertices, axis=0).max()
    meeting = np.abs(vertices @ normals.T - offsets) < 1e-6 * size
    reach = 1.0
    for row in meeting:
        if row.sum() >= 3:
            smallest = np.linalg.svd(normals[row], compute_uv=False)[-1]
            reach = max(reach, np.sqrt(row.sum()) / max(smallest, 1e-6))
    return reach


def _owners(start):
    return np.repeat(np.arange(len(start) - 1), np.diff(start))


def _rotated(rotation, vectors):
    """R v written out, so that the result for one item never depends on the batch it is in."""
    return (
        rotation[:, :, 0] * vectors[:, 0:1]
        + rotation[:, :, 1] * vectors[:, 1:2]
        + rotation[:, :, 2] * vectors[:, 2:3]
    )


def _dot(a, b):
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def _stacked(rows):
    return np.vstack(rows) if rows else np.zeros((0, 3))


def _starts(counts):
    return np.concatenate([[0], np.cumsum(counts, dtype=np.int64)]).astype(np.int64)


@kernel
def _holder(points, normals, offsets, plane_start, bounds):
    holder = np.full(len(points), -1, dtype=np.int64)
    for i in range(len(points)):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        for b in range(len(plane_start) - 1):
            if x < bounds[b, 0, 0] or y < bounds[b, 0, 1] or z < bounds[b, 0, 2]:
                continue
            if x > bounds[b, 1, 0] or y > bounds[b, 1, 1] or z > bounds[b, 1, 2]:
                continue
            inside = True
            for g in range(plane_start[b], plane_start[b + 1]):
                if normals[g, 0] * x + normals[g, 1] * y + normals[g, 2] * z > offsets[g]:
                    inside = False
                    break
            if inside:
                holder[i] = b
                break
    return holder
