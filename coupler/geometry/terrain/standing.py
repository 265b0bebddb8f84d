"""What stands on the terrain: heights of the ground under a footprint, footings, and the ground that blocks meet.

A part with on = "terrain" stands on a footing: a held box from its foot down into the ground, its foot at the highest
ground under it.  Blocks meet the same triangles on which the mesh of the water ends.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from coupler.geometry.terrain.bed_mesh import fitted_of

INTO_GROUND = 0.5
"""Cells that a footing reaches below the lowest ground under it."""
SAMPLES = 24
"""Places along each edge of a footprint at which the ground is looked up."""


def corners_of(lower, size, turn: float) -> Array:
    """Corners (4, 2) [m] of a footprint, turned about its middle [rad]."""
    low, edges = np.array(lower[:2], float), np.array(size[:2], float)
    half = 0.5 * edges * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    c, s = np.cos(turn), np.sin(turn)
    return low + 0.5 * edges + half @ np.array([[c, s], [-s, c]])


def ground_under(tank, corners) -> tuple[float, float]:
    """Lowest and highest z [m] of the bed of the mesh and of the terrain under a footprint, corners (4, 2) [m]."""
    s = np.linspace(0.0, 1.0, SAMPLES)
    u, v = (a.ravel()[:, None] for a in np.meshgrid(s, s))
    p = corners[0] + u * (corners[1] - corners[0]) + v * (corners[3] - corners[0])
    z = np.concatenate([bed_at(tank, *p.T), tank.ground(*p.T)])
    return float(np.nanmin(z)), float(np.nanmax(z))


def bed_at(tank, x, y) -> Array:
    """z (n,) [m] of the bed of the mesh, bilinear between its columns; the top of the tank where there is none."""
    fitted = fitted_of(tank)
    X, Y = fitted.column_x, fitted.column_y
    bed = np.where(np.isfinite(fitted.bed), fitted.bed, tank.upper[2])
    i = np.clip(np.searchsorted(X, x, side="right") - 1, 0, len(X) - 2)
    j = np.clip(np.searchsorted(Y, y, side="right") - 1, 0, len(Y) - 2)
    s = np.clip((x - X[i]) / (X[i + 1] - X[i]), 0.0, 1.0)
    t = np.clip((y - Y[j]) / (Y[j + 1] - Y[j]), 0.0, 1.0)
    low = (1 - s) * bed[i, j] + s * bed[i + 1, j]
    high = (1 - s) * bed[i, j + 1] + s * bed[i + 1, j + 1]
    return (1 - t) * low + t * high


def on_ground(case, spec):
    """A table of the structure with on = "terrain": its heights count from the highest ground under it."""
    if case.tank is None or case.tank.ground is None:  # refused elsewhere
        return spec
    _, high = ground_under(case.tank, corners_of(spec.lower, spec.size, spec.turn))
    return spec.model_copy(update={"lower": (*spec.lower[:2], high + spec.lower[2])})


def footing_box(case, spec) -> tuple[Array, Array]:
    """Centre (3,) and size (3,) [m] of the footing of a table that stands on the terrain, turned as it is."""
    pad = getattr(spec, "pad", 0.0)
    low, _ = ground_under(
        case.tank, corners_of(np.array(spec.lower[:2]) - pad, np.array(spec.size[:2]) + 2 * pad, spec.turn)
    )
    _, high = ground_under(case.tank, corners_of(spec.lower, spec.size, spec.turn))
    top, bottom = high + spec.lower[2], low - INTO_GROUND * case.tank.cell
    centre = [spec.lower[0] + 0.5 * spec.size[0], spec.lower[1] + 0.5 * spec.size[1], 0.5 * (top + bottom)]
    return np.array(centre), np.array([spec.size[0] + 2 * pad, spec.size[1] + 2 * pad, top - bottom])


def ground_surface(case):
    """The bed of the mesh as ground for blocks, of material "ground": the same triangles; None without terrain."""
    from yade_scripts.contact.ground import GroundSurface

    if case.tank is None or case.tank.ground is None:
        return None
    fitted = fitted_of(case.tank)
    bed = np.where(np.isfinite(fitted.bed), fitted.bed, case.tank.upper[2])
    low = float(bed.min())
    return GroundSurface(
        (0.0, 0.0, low),
        (0.0, 0.0, 1.0),
        "terrain",
        bonds=False,
        x=fitted.column_x,
        y=fitted.column_y,
        z=bed - low,
        mirrored=case.tank.split == "mirrored",
    )
