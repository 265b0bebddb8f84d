"""Friction of rough walls: shear stress τ = ρ C_f |u_t| u_t against the tangential velocity beside the wall.

Log law of a wall with sand roughness k_s (Nikuradse):

    C_f = [κ / ln(1 + y/z₀)]²,   κ = 0.41,   z₀ = k_s/30                                           (1)

The velocity beside the wall is no point of the profile: the value of a node on a wall stands for the water of its hat.
The mean of u = u*/κ ln(y/z₀) over it, 2/h ∫ (1 - y/h) u dy = u*/κ [ln(h/z₀) - 3/2], is the profile at y = e^(-3/2) h.

Manning, for beds under water of depth d (the stress of uniform flow, τ = ρ g n² |u| u / d^(1/3)):

    C_f = g n² / d^(1/3)                                                                          (2)

on the floor and on faces of solids that look up (n_z > 0.5); d is the water in the column of cells, at least one cell.
Both are linear in u_t once |u_t| is taken from before the stage, so the step stays symmetric.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fluid.domain.moments import wet_fraction
from fluid.numerics.cube_root import cube_root

KARMAN = 0.41
OFF_WALL = np.exp(-1.5)
"""Where the profile has its mean over the hat of a node on the wall, in cells."""
LOOKS_UP = 0.5


@dataclass(frozen=True)
class WallFriction:
    """roughness k_s [m] or manning n [s/m^(1/3)], the other None · density [kg/m³] · gravity [m/s²]."""

    roughness: float | None
    manning: float | None
    density: float
    gravity: float

    @classmethod
    def of(cls, parameters) -> WallFriction:
        """Raises ValueError unless one of roughness and manning is given."""
        p = parameters
        if (p.roughness is None) == (p.manning is None):
            raise ValueError(
                f"walls = 'friction' needs roughness or manning, one of them; got {p.roughness} and {p.manning}"
            )
        return cls(p.roughness, p.manning, p.density, p.gravity)

    def of_faces(self, water, walls, phi, u):
        """C (S,) [kg/(m² s)] of the polygons of cut walls (WettedWalls); u (N, 3) [m/s]."""
        t = water.topology
        slip = walls.at_points(u, t.cells).mean(axis=1) - _rigid_velocity(water, walls)
        across = np.einsum("sk,sk->s", slip, walls.normal)
        speed = np.linalg.norm(slip - across[:, None] * walls.normal, axis=1)
        if self.manning is None:
            return self.density * log_law(OFF_WALL * t.size[walls.cell], self.roughness) * speed
        depth = column_depth(water, phi, walls.cell)
        bed = walls.normal[:, 2] > LOOKS_UP
        least = water.mesh.local_size[t.background[walls.cell]]
        return np.where(bed, self.density * self._bed(depth, least) * speed, 0.0)

    def of_nodes(self, water, phi, u):
        """Drag (N,) [kg/s] of the nodes on closed sides of the tank: C times the wet area of each."""
        t, (faces, area, cell) = water.topology, water.rough_faces()
        size = np.linalg.norm(area, axis=1)
        unit = area / size[:, None]
        if self.manning is not None:
            floor = unit[:, 2] < -LOOKS_UP
            faces, size, cell, unit = faces[floor], size[floor], cell[floor], unit[floor]
            factor = self._bed(column_depth(water, phi, cell), water.mesh.local_size[t.background[cell]])
        else:
            factor = log_law(OFF_WALL * t.size[cell], self.roughness)
        size = size * t.fraction[cell]  # what solids stand on does not slide
        drag = np.zeros(len(phi))
        for corner in range(3):
            node = faces[:, corner]
            across = np.einsum("fk,fk->f", u[node], unit)
            speed = np.linalg.norm(u[node] - across[:, None] * unit, axis=1)
            np.add.at(drag, node, np.where(phi[node] < 0.0, self.density * factor * speed * size / 3.0, 0.0))
        return drag

    def _bed(self, depth, least):
        return self.gravity * self.manning**2 / cube_root(np.maximum(depth, least))


def log_law(distance, roughness: float):
    """C_f of equation (1); distance (n,) [m], roughness k_s [m]."""
    return (KARMAN / np.log1p(30.0 * distance / roughness)) ** 2


def column_depth(water, phi, cells):
    """Depth of water (n,) [m] in the columns of bins over the cells (n,): their water over the area of the bin."""
    t, (x, y, _) = water.topology, water.mesh.axes
    wet = t.cells_around(phi < 0.0)
    area = np.outer(np.diff(x), np.diff(y)).ravel()
    volume = np.bincount(
        _column(water, wet), t.volume[wet] * wet_fraction(wet, phi, t.parts), minlength=len(area)
    )
    return (volume / area)[_column(water, cells)]


def _column(water, cells):
    """Number of the column of bins that holds the centre of each cell (n,)."""
    x, y, _ = water.mesh.axes
    centre = water.topology.nodes[water.topology.cells[cells]].mean(axis=1)
    i = np.clip(np.searchsorted(x, centre[:, 0]) - 1, 0, len(x) - 2)
    j = np.clip(np.searchsorted(y, centre[:, 1]) - 1, 0, len(y) - 2)
    return i * (len(y) - 1) + j


def _rigid_velocity(water, walls):
    """Velocity (S, 3) of the bodies at the middle of the polygons."""
    V = water.body_velocity[walls.body]
    return V[:, :3] + np.cross(V[:, 3:], walls.arm.mean(axis=1))
