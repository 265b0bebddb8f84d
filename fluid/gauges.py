"""Reading the water at places: level, pressure, velocity, volume in a box."""

from __future__ import annotations

import numpy as np

from fluid.moments import cells_touching, wet_fraction


class Outside(ValueError):
    """A gauge lies outside the tank."""


SAMPLES_PER_CELL = 4


def level(water, xy) -> float:
    """Height z [m] of the highest free surface above the place xy (2,) [m]; the floor where it is dry.

    φ is read on a vertical line, SAMPLES_PER_CELL a cell, and its highest zero taken between two samples."""
    low, high = water.mesh.bounds[:, 2]
    count = int(np.ceil(SAMPLES_PER_CELL * (high - low) / water.mesh.spacing)) + 1
    z = np.linspace(low, high, count)
    phi = level_set_at(water, np.column_stack([np.full(count, xy[0]), np.full(count, xy[1]), z]))
    wet = np.flatnonzero(phi < 0.0)
    if len(wet) == 0:
        return float(low)
    top = wet[-1]
    if top + 1 == count or not np.isfinite(phi[top + 1]):
        return float(z[top])
    return float(z[top] + (z[top + 1] - z[top]) * phi[top] / (phi[top] - phi[top + 1]))


def pressure_at(water, points) -> np.ndarray:
    """Pressure [Pa] at points (m, 3) [m] → (m,); 0 in the air."""
    points = np.atleast_2d(points)
    p = _interpolated(water, points, water.pressure[:, None])[:, 0]
    return np.where(level_set_at(water, points) < 0.0, p, 0.0)


def velocity_at(water, points) -> np.ndarray:
    """Velocity [m/s] at points (m, 3) [m] → (m, 3); 0 in the air."""
    points = np.atleast_2d(points)
    u = _interpolated(water, points, water.velocity)
    return np.where(level_set_at(water, points)[:, None] < 0.0, u, 0.0)


def level_set_at(water, points) -> np.ndarray:
    """φ [m] at points (m, 3) [m] → (m,), negative in the water."""
    return _interpolated(water, np.atleast_2d(points), water.level_set[:, None])[:, 0]


def volume_in(water, lower, upper) -> float:
    """Water [m³] in the cells whose centroid lies in the box lower, upper (3,) [m]."""
    t = water.topology
    cells = cells_touching(water.level_set < 0.0, t.cells)
    centre = t.nodes[t.cells[cells]].mean(axis=1)
    inside = np.all((centre >= lower) & (centre < upper), axis=1)
    share = wet_fraction(cells[inside], water.level_set, t.cells)
    return float(share @ t.volume[cells[inside]])


def _interpolated(water, points, field):
    """P1 value (m, k) of field (N, k) at points (m, 3); NaN inside solids. Raises Outside."""
    cell = water.mesh.locate(points)
    if np.any(cell < 0):
        place = points[np.flatnonzero(cell < 0)[0]]
        low, high = water.mesh.bounds
        raise Outside(f"gauge at {place} lies outside the tank {low} to {high}")
    row = _row_of_parent(water)[cell]
    found = row >= 0
    value = np.full((len(points), field.shape[1]), np.nan)
    corners = water.topology.cells[row[found]]
    g = water.mesh.gradients[cell[found]]
    weight = np.einsum("mak,mk->ma", g, points[found] - water.topology.nodes[corners[:, 0]])
    weight[:, 0] += 1.0
    value[found] = np.einsum("ma,mak->mk", weight, field[corners])
    return value


def _row_of_parent(water):
    """Row of the (first) cell of each background cell, -1 inside solids."""
    row = np.full(len(water.mesh.cells), -1)
    row[water.topology.parent[::-1]] = np.arange(len(water.topology.parent))[::-1]
    return row
