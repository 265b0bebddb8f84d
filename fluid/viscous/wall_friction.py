"""Friction of rough walls: shear stress τ = ρ C_f |u_t| u_t against the tangential velocity beside the wall.

Log law of a wall with sand roughness k_s (Nikuradse):

    C_f = [κ / ln(1 + y/z₀)]²,   κ = 0.41,   z₀ = k_s/30                                           (1)

The velocity beside the wall is not a point value of the profile: the value at a node on a wall represents the water
under its hat function. The mean of u = u*/κ ln(y/z₀) over it, 2/h ∫ (1 - y/h) u dy = u*/κ [ln(h/z₀) - 3/2], is the
profile at y = e^(-3/2) h.

Manning, for beds under water of depth d, with the mean velocity U over the depth (the stress of uniform flow):

    τ = ρ C_f |U| U,   C_f = g n² / d^(1/3)                                                       (2)

on the floor and on faces of solids that point upwards (n_z > 0.5); d and U are those of the water in the column of
cells, with d over the area that solids leave open (`OpenColumns`) and at least one cell.  The stress acts on the water
at the bed, and the turbulence that it makes carries it up:

    ν_t = u_* d max(κ/6, 2/3 sqrt(C_f)),   u_* = sqrt(C_f) |U|                                    (3)

the mean over the depth of κ u_* z (1 - z/d), which belongs to the logarithmic profile (Fischer, List, Koh, Imberger,
Brooks, Mixing in Inland and Coastal Waters, 1979, 5.1.1); its second part keeps half of U at the bed where the bed is
so rough that (1) would leave less.  Without this viscosity the water above the lowest cells runs down a slope ever
faster. Both laws are linear in u_t once their factors are taken from before the stage, so the step stays symmetric.

Roughness and n are numbers, or functions of x and y (n,) [m] → (n,) for beds of several kinds.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from fluid.numerics.cube_root import cube_root, root_of
from fluid.viscous.columns import Columns
from kernels.decorators import ranged
from kernels.threads import over

KARMAN = 0.41
OFF_WALL = np.exp(-1.5)
"""Distance from the wall, in cells, at which the profile equals its mean over the hat function of a node on the
wall."""
LOOKS_UP = 0.5
"""Least upward part of the unit normal of a bed."""
SLOWEST = 0.25
"""Least velocity assumed for the water at the bed, as a share of the mean velocity; it bounds the factor."""
MIXED = 5
"""Cost of equation (3) for one cell, in usual rows."""


@dataclass(frozen=True)
class WallFriction:
    """roughness k_s [m] or manning n [s/m^(1/3)], the other None · density [kg/m³] · gravity [m/s²]."""

    roughness: float | Callable | None
    manning: float | Callable | None
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

    def columns(self, water, phi, u, dt: float) -> Columns | None:
        """The water columns for Manning's law; None for the log law. u (N, 3) [m/s] is the velocity before the friction
        of the step dt [s]. The factors use the velocity U that friction leaves, U + C_f dt U²/d = |u|, since otherwise
        a steady stream would depend on the step."""
        if self.manning is None:
            return None
        c = Columns.of(water, phi, u)
        depth = np.maximum(c.depth, water.mesh.finest)
        k = dt * self._factor(depth, c.centre) / depth
        speed = np.linalg.norm(c.velocity, axis=1)
        left = 2.0 / (1.0 + np.sqrt(1.0 + 4.0 * k * speed))
        return replace(c, velocity=left[:, None] * c.velocity, left=left)

    def of_faces(self, water, walls, columns, u):
        """C (S,) [kg/(m² s)] of the polygons of cut walls (WettedWalls); u (N, 3) [m/s]."""
        t = water.topology
        body = _rigid_velocity(water, walls)
        slip = np.linalg.norm(_along(walls.at_points(u, t.cells).mean(axis=1) - body, walls.normal), axis=1)
        if columns is None:
            centre = walls.centre()
            return self.density * log_law(OFF_WALL * t.size[walls.cell], _at(self.roughness, centre)) * slip
        depth, velocity, left = columns.over(walls.cell)
        mean = np.linalg.norm(_along(velocity - body, walls.normal), axis=1)
        bed = walls.normal[:, 2] > LOOKS_UP
        least = water.mesh.local_size[t.background[walls.cell]]
        factor = self._bed(depth, least, walls.centre(), mean, left * slip)
        return np.where(bed, self.density * factor, 0.0)

    def of_nodes(self, water, phi, columns, u):
        """Drag (N,) [kg/s] of the nodes on closed sides of the tank: C times the wet area of each."""
        t, w = water.topology, water.walls
        some = (phi[w.rough_faces] < 0.0).any(axis=1)
        faces, area, cell = w.rough_faces[some], w.rough_area[some], w.rough_cell[some]
        size = np.linalg.norm(area, axis=1)
        unit = area / np.maximum(size, 1e-300)[:, None]
        if columns is not None:
            floor = unit[:, 2] < -LOOKS_UP
            faces, size, cell, unit = faces[floor], size[floor], cell[floor], unit[floor]
            depth, velocity, left = columns.over(cell)
            mean = np.linalg.norm(_along(velocity, unit), axis=1)
        centre, least = t.nodes[faces].mean(axis=1), water.mesh.local_size[t.background[cell]]
        drag = np.zeros(len(phi))
        for corner in range(3):
            node = faces[:, corner]
            speed = np.linalg.norm(_along(u[node], unit), axis=1)
            if columns is None:
                factor = log_law(OFF_WALL * t.size[cell], _at(self.roughness, centre)) * speed
            else:
                factor = self._bed(depth, least, centre, mean, left * speed)
            np.add.at(drag, node, np.where(phi[node] < 0.0, self.density * factor * size / 3.0, 0.0))
        return drag

    def mixing(self, water, columns, cells):
        """ν_t (n,) [m²/s] of equation (3) in cells (n,) of the domain."""
        t, (depth, velocity, _) = water.topology, columns.over(cells)
        rough, out = self.manning, np.empty(len(cells))
        if callable(rough):
            rough = _at(rough, t.nodes[t.cells[cells]].mean(axis=1))
        least = water.mesh.local_size[t.background[cells]]
        rough = np.atleast_1d(np.asarray(rough, float))
        over(_mixing, len(cells), depth, least, velocity, rough, self.gravity, out, weight=MIXED)
        return out

    def _bed(self, depth, least, place, mean, there):
        """C_f |U|² / |u| (n,) [m/s]: mean (n,) [m/s] is |U|, there (n,) [m/s] the velocity at the bed."""
        slowed = mean**2 / np.maximum(np.maximum(there, SLOWEST * mean), 1e-300)
        return self._factor(np.maximum(depth, least), place) * slowed

    def _factor(self, depth, place):
        return self.gravity * _at(self.manning, place) ** 2 / cube_root(depth)


@ranged
def _mixing(first, last, depth, least, velocity, rough, gravity, out):
    """Equation (3); rough: n of all cells, or of each."""
    for s in range(first, last):
        n, d = rough[s if rough.shape[0] > 1 else 0], max(depth[s], least[s])
        root = math.sqrt(gravity * n**2 / root_of(d))
        speed = math.sqrt(velocity[s, 0] ** 2 + velocity[s, 1] ** 2)
        out[s] = root * speed * d * max(KARMAN / 6.0, 2.0 / 3.0 * root)


def _at(value, place):
    """A number, or the values of a function at positions (n, 3) [m]."""
    return value(place[:, 0], place[:, 1]) if callable(value) else value


def _along(u, normal):
    """The part of u (n, 3) along faces with unit normals (n, 3)."""
    return u - np.einsum("nk,nk->n", u, normal)[:, None] * normal


def log_law(distance, roughness: float):
    """C_f of equation (1); distance (n,) [m], roughness k_s [m]."""
    return (KARMAN / np.log1p(30.0 * distance / roughness)) ** 2


def _rigid_velocity(water, walls):
    """Velocity (S, 3) of the bodies at the middle of the polygons."""
    V = water.body_velocity[walls.body]
    return V[:, :3] + np.cross(V[:, 3:], walls.arm.mean(axis=1))
