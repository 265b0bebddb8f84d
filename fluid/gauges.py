"""Reading the water at places: level, pressure, velocity, volume in a box."""

from __future__ import annotations

import numpy as np

from fluid.moments import cells_touching, wet_fraction


class Outside(ValueError):
    """A gauge lies outside the tank."""


SAMPLES_PER_CELL = 4


def level(water, xy) -> float:
    """Depth [m] of water over xy (2,) [m]: the wet length of a vertical line, as a wire gauge measures it.

    φ is read on the line, SAMPLES_PER_CELL a cell, and taken as linear between two samples; inside solids it is dry.
    Spray and the space under an overturning crest do not count; over a solid that stands on the floor the depth is
    that above it."""
    low, high = water.mesh.bounds[:, 2]
    count = int(np.ceil(SAMPLES_PER_CELL * (high - low) / water.mesh.spacing)) + 1
    z = np.linspace(low, high, count)
    phi = level_set_at(water, np.column_stack([np.full(count, xy[0]), np.full(count, xy[1]), z]))
    wet = np.fmax(-phi, 0.0)  # NaN inside solids
    length = np.abs(phi[1:] - phi[:-1])
    share = np.divide(np.abs(wet[1:] - wet[:-1]), length, out=(wet[1:] > 0.0) * 1.0, where=length > 0.0)
    both = (phi[1:] < 0.0) & (phi[:-1] < 0.0)
    open_water = np.isfinite(phi[1:]) & np.isfinite(phi[:-1])
    return float((z[1] - z[0]) * np.where(both, 1.0, share)[open_water].sum())


def pressure(water, points):
    """Pressure [Pa] at points (m, 3) or (3,) [m] → (m,) or a number; 0 in the air, NaN inside a solid."""
    p = _interpolated(water, points, water.pressure[:, None])[:, 0]
    p = np.where(level_set_at(water, points) >= 0.0, 0.0, p)
    return p if np.ndim(points) == 2 else float(p[0])


def velocity(water, points):
    """Velocity [m/s] at points (m, 3) or (3,) [m] → the same shape; 0 in the air, NaN inside a solid."""
    u = _interpolated(water, points, water.velocity)
    u = np.where(level_set_at(water, points)[:, None] >= 0.0, 0.0, u)
    return u if np.ndim(points) == 2 else u[0]


def level_set_at(water, points) -> np.ndarray:
    """φ [m] at points (m, 3) [m] → (m,), negative in the water."""
    return _interpolated(water, points, water.level_set[:, None])[:, 0]


def volume_in_box(water, lower, upper) -> float:
    """Water [m³] in the cells whose centre lies in the box lower, upper (3,) [m]: sharp to one cell."""
    t = water.topology
    cells = cells_touching(water.level_set < 0.0, t.cells)
    centre = t.nodes[t.cells[cells]].mean(axis=1)
    inside = np.all((centre >= lower) & (centre < upper), axis=1)
    share = wet_fraction(cells[inside], water.level_set, t.cells)
    return float(share @ t.volume[cells[inside]])


def _interpolated(water, points, field):
    """P1 value (m, k) of field (N, k) at points (m, 3) or (3,); NaN inside solids. Raises Outside.

    A point on the face of a solid may be found in the cell behind it: then the cell beside that one answers."""
    points = np.atleast_2d(np.asarray(points, float))
    parent = water.mesh.locate(points)
    if np.any(parent < 0):
        low, high = water.mesh.bounds
        place = points[np.flatnonzero(parent < 0)[0]]
        raise Outside(f"gauge at {place} lies outside the tank {low} to {high}; move it inside")
    row = water.topology.row_of_parent
    beside = row[np.append(parent[:, None], water.mesh.neighbours[parent], axis=1)]
    cell = beside[np.arange(len(points)), np.argmax(beside >= 0, axis=1)]
    corners = water.topology.cells[cell]
    g = water.mesh.gradients[water.topology.parent[cell]]
    weight = np.einsum("mak,mk->ma", g, points - water.topology.nodes[corners[:, 0]])
    weight[:, 0] += 1.0
    value = np.einsum("ma,mak->mk", weight, field[corners])
    return np.where(cell[:, None] >= 0, value, np.nan)
