"""Rigid blocks: boxes and convex polyhedra, with exact volume, centre of mass and inertia.

A block has its own frame, with the origin at the centre of mass and the axes of its description. The world position of
a body point is x = c + R ξ.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from array_types import Array, Floats
from yade_scripts.blocks.polyhedra import (
    BlockError,
    Faces,
    convex_polyhedron,
    face_planes,
    polyhedron_moments,
)
from yade_scripts.blocks.prescribed import Prescribed

MARGIN = 0.01
"""In contact a face extends beyond its edges by this share of the block's inner radius, so that flush blocks support
each other."""

BOX_CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    float,
)
BOX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
"""Corners of each face seen from outside, in the order -x +x -y +y -z +z."""


FROM_SIZE: Any = None
"""Vertices and faces of a box until it is made: every block has both."""
BOX_NORMALS = np.repeat(np.eye(3), 2, axis=0) * np.array([-1.0, 1.0] * 3)[:, None]


@dataclass(frozen=True)
class Block:
    """One rigid block.

    name: unique · group: free text for reports (wall, floor, ...) · material: name for friction by pairs
    centre (3,) [m] centre of mass, world
    size (3,) [m] of a box, or vertices (k, 3) [m] with faces (lists of rows of vertices, seen from outside)
    of a convex polyhedron; vertices may have any origin, they are moved to the centre of mass
    rotation (3, 3): body frame → world · density [kg/m³] · velocity (3,) [m/s] · spin (3,) [rad/s]
    fixed: does not move · driven: keeps `velocity` and `spin` whatever acts on it, or moves as `motion` says
    """

    name: str
    centre: Floats
    size: Floats | None = None
    vertices: Floats = FROM_SIZE
    faces: Faces = FROM_SIZE
    rotation: Floats = field(default_factory=lambda: np.eye(3))
    density: float = 2400.0
    group: str = "block"
    material: str = "block"
    fixed: bool = False
    driven: bool = False
    velocity: Floats = field(default_factory=lambda: np.zeros(3))
    spin: Floats = field(default_factory=lambda: np.zeros(3))
    motion: Prescribed | None = None

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
        vertices, faces = convex_polyhedron(self.name, self.vertices, self.faces)
        object.__setattr__(self, "vertices", vertices - polyhedron_moments(vertices, faces)[1])
        object.__setattr__(self, "faces", faces)

    @classmethod
    def standing(
        cls, name: str, vertices: Array, faces: Faces | None = None, tolerance: float | None = None, **more
    ) -> Block:
        """The convex polyhedron whose corners are at vertices (k, 3) [m] in the world, turned by `rotation` if given.

        tolerance [m]: largest distance of corners from the planes of their faces, None: their rounding.  Raises
        BlockError."""
        vertices, faces = convex_polyhedron(name, vertices, faces, tolerance)
        centre = polyhedron_moments(vertices, faces)[1]
        return cls(name, centre, vertices=vertices - centre, faces=faces, **more)

    def changed(self, **changes) -> Block:
        """The same block with the given fields changed."""
        if self.is_box:
            changes = {"vertices": None, "faces": None} | changes
        return replace(self, **changes)

    @property
    def is_box(self) -> bool:
        """Whether the block is a box with edges along the axes of its frame."""
        return self.size is not None

    @cached_property
    def volume(self) -> float:
        """[m³]"""
        return (
            float(np.prod(self.size))
            if self.size is not None
            else polyhedron_moments(self.vertices, self.faces)[0]
        )

    @property
    def mass(self) -> float:
        """[kg]"""
        return self.density * self.volume

    @cached_property
    def inertia(self) -> Array:
        """(3, 3) [kg m²] about the centre of mass, body frame."""
        if self.size is not None:
            s = self.size**2
            return self.mass / 12.0 * np.diag([s[1] + s[2], s[0] + s[2], s[0] + s[1]])
        second = polyhedron_moments(self.vertices, self.faces)[2]
        return self.density * (np.trace(second) * np.eye(3) - second)

    @cached_property
    def planes(self) -> tuple[Array, Array]:
        """Outward normals (f, 3) and offsets (f,) of the faces, body frame: inside is normals @ x <= offsets."""
        if self.size is not None:
            return BOX_NORMALS, 0.5 * np.repeat(self.size, 2)
        return face_planes(self.vertices, self.faces)

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
