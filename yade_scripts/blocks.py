"""Rigid blocks: boxes and convex polyhedra, with exact volume, centre of mass and inertia.

A block lives in its own frame: origin at the centre of mass, axes of the description it came from.
World position of a body point:  x = c + R ξ.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError

Array = np.ndarray

BOX_CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    float,
)
BOX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
"""Corners of each face seen from outside, in the order -x +x -y +y -z +z."""


class BlockError(ValueError):
    """A block that cannot be built; the message names the block, the quantity, its value and the remedy."""


@dataclass(frozen=True)
class Block:
    """One rigid block.

    name: unique · group: free text for reports (wall, floor, ...) · centre (3,) [m] centre of mass, world
    size (3,) [m] of a box, or vertices (k, 3) [m] with faces (lists of rows of vertices, seen from outside)
    of a convex polyhedron; vertices may have any origin, they are moved to the centre of mass
    rotation (3, 3): body frame → world · density [kg/m³] · velocity (3,) [m/s] · spin (3,) [rad/s]
    fixed: does not move · driven: keeps `velocity` and `spin` whatever acts on it
    """

    name: str
    centre: Array
    size: Array | None = None
    vertices: Array | None = None
    faces: tuple[tuple[int, ...], ...] | None = None
    rotation: Array = field(default_factory=lambda: np.eye(3))
    density: float = 2400.0
    group: str = "block"
    material: str = "block"
    fixed: bool = False
    driven: bool = False
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    spin: Array = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self):
        for name, shape in (("centre", (3,)), ("rotation", (3, 3)), ("velocity", (3,)), ("spin", (3,))):
            value = np.broadcast_to(np.asarray(getattr(self, name), float), shape).copy()
            if not np.isfinite(value).all():
                raise BlockError(f"block '{self.name}': {name} = {value} is not finite")
            object.__setattr__(self, name, value)
        check_rotation(self.name, self.rotation)
        if not self.density > 0.0:
            raise BlockError(f"block '{self.name}': density = {self.density} kg/m³; it must be positive")
        if (self.size is None) == (self.vertices is None):
            raise BlockError(
                f"block '{self.name}': give either size (a box) or vertices (a convex polyhedron)"
            )
        if self.size is not None:
            self._as_box()
        else:
            self._as_polyhedron()

    def _as_box(self) -> None:
        size = np.broadcast_to(np.asarray(self.size, float), (3,)).copy()
        if not (size > 0.0).all():
            raise BlockError(f"block '{self.name}': size = {size} m; every edge must be positive")
        object.__setattr__(self, "size", size)
        object.__setattr__(self, "vertices", 0.5 * size * BOX_CORNERS)
        object.__setattr__(self, "faces", BOX_FACES)

    def _as_polyhedron(self) -> None:
        vertices = np.asarray(self.vertices, float)
        faces = self.faces if self.faces is not None else hull_faces(self.name, vertices)
        check_convex(self.name, vertices, faces)
        centre = polyhedron_moments(vertices, faces)[1]
        object.__setattr__(self, "vertices", vertices - centre)
        object.__setattr__(self, "faces", tuple(tuple(int(i) for i in f) for f in faces))

    @property
    def is_box(self) -> bool:
        return self.size is not None

    @cached_property
    def volume(self) -> float:
        """[m³]"""
        return float(np.prod(self.size)) if self.is_box else polyhedron_moments(self.vertices, self.faces)[0]

    @property
    def mass(self) -> float:
        """[kg]"""
        return self.density * self.volume

    @cached_property
    def inertia(self) -> Array:
        """(3, 3) [kg m²] about the centre of mass, body frame."""
        if self.is_box:
            s = self.size**2
            return self.mass / 12.0 * np.diag([s[1] + s[2], s[0] + s[2], s[0] + s[1]])
        second = polyhedron_moments(self.vertices, self.faces)[2]
        return self.density * (np.trace(second) * np.eye(3) - second)

    @cached_property
    def planes(self) -> tuple[Array, Array]:
        """Outward normals (f, 3) and offsets (f,) of the faces, body frame: inside is normals @ x <= offsets."""
        normals = np.array([face_normal(self.vertices[list(f)]) for f in self.faces])
        return normals, np.array([n @ self.vertices[f[0]] for n, f in zip(normals, self.faces)])

    @property
    def radius(self) -> float:
        """Distance of the farthest vertex from the centre [m]."""
        return float(np.linalg.norm(self.vertices, axis=1).max())

    def world_vertices(self) -> Array:
        """(k, 3) [m]"""
        return self.centre + self.vertices @ self.rotation.T


def check_rotation(name: str, rotation: Array) -> None:
    """Raise BlockError unless rotation is a proper orthogonal matrix (to 1e-9)."""
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0.0:
        raise BlockError(f"block '{name}': rotation is not a proper rotation matrix:\n{rotation}")


def face_normal(corners: Array) -> Array:
    """Unit normal of a planar polygon (k, 3), right-handed about the order of its corners (Newell's sum)."""
    area = polygon_area_vector(corners)
    return area / np.linalg.norm(area)


def polygon_area_vector(corners: Array) -> Array:
    """Area times unit normal of a planar polygon (k, 3) [m²]."""
    arm = corners - corners[0]
    return 0.5 * np.cross(arm[1:-1], arm[2:]).sum(axis=0)


def polyhedron_moments(vertices: Array, faces) -> tuple[float, Array, Array]:
    """Volume [m³], centroid (3,) [m] and central second moments ∫ ξξᵀ dV (3, 3) [m⁵] of a closed polyhedron.

    Exact: sum over tetrahedra spanned by an inner point and the triangles of the faces;
    over one with corners p₀..p₃, ∫ xxᵀ dV = V/20 (Σ pᵢpᵢᵀ + (Σpᵢ)(Σpᵢ)ᵀ).
    """
    origin = vertices.mean(axis=0)
    x = vertices - origin
    tri = np.array([(f[0], f[i], f[i + 1]) for f in faces for i in range(1, len(f) - 1)])
    p = x[tri]
    volume = np.einsum("ij,ij->i", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6.0
    total = p.sum(axis=1)
    V = volume.sum()
    centroid = (volume[:, None] * total).sum(axis=0) / (4.0 * V)
    second = np.einsum("t,tia,tib->ab", volume, p, p) + np.einsum("t,ta,tb->ab", volume, total, total)
    return float(V), origin + centroid, second / 20.0 - V * np.outer(centroid, centroid)


def hull_faces(name: str, vertices: Array) -> tuple[tuple[int, ...], ...]:
    """Faces of the convex hull of vertices (k, 3): coplanar triangles are merged, corners seen from outside."""
    try:
        hull = ConvexHull(vertices)
    except QhullError as error:
        raise BlockError(f"block '{name}': its {len(vertices)} vertices span no volume") from error
    merged: list[tuple[Array, set]] = []
    for simplex, plane in zip(hull.simplices, hull.equations):
        for known, corners in merged:
            if np.abs(known - plane).max() < 1e-9 * max(1.0, np.abs(vertices).max()):
                corners.update(simplex.tolist())
                break
        else:
            merged.append((plane, set(simplex.tolist())))
    return tuple(_ordered(vertices, np.array(sorted(c)), plane[:3]) for plane, c in merged)


def _ordered(vertices: Array, corners: Array, normal: Array) -> tuple[int, ...]:
    e1 = vertices[corners[1]] - vertices[corners[0]]
    e1 = e1 / np.linalg.norm(e1)
    e2 = np.cross(normal, e1)
    arm = vertices[corners] - vertices[corners].mean(axis=0)
    return tuple(corners[np.argsort(np.arctan2(arm @ e2, arm @ e1))].tolist())


def check_convex(name: str, vertices: Array, faces) -> None:
    """Raise BlockError where a vertex lies outside a face plane, or the faces do not close."""
    extent = np.ptp(vertices, axis=0).max()
    for index, face in enumerate(faces):
        n = face_normal(vertices[list(face)])
        height = (vertices - vertices[face[0]]) @ n
        if height.max() > 1e-7 * extent:
            raise BlockError(
                f"block '{name}' is not convex (or face {index} is seen from inside): vertex {height.argmax()} lies "
                f"{height.max():.3g} m outside face {index}; split it into convex blocks"
            )
    gap = sum(polygon_area_vector(vertices[list(f)]) for f in faces)
    if np.abs(gap).max() > 1e-7 * extent**2:
        raise BlockError(f"block '{name}' is not closed: its face areas sum to {gap} m², not to zero")
