"""A camera inside the blocks: in the widest place that has walls around it, near the wall behind it."""

import itertools

import numpy as np
from scipy.spatial import cKDTree

from coupler.commands.view.camera import Camera, direction
from coupler.program.errors import ExitCode, SurgebreakError

PLACES = (9, 9, 5)
"""Points along each side of the box around the blocks that are tried."""
LEVELS = (0.1, 0.6)
"""Shares of its height between which they lie."""
BACK = 0.8
"""Share of the way to the wall behind that the camera goes back."""
WIDE = 70.0
"""Angle [degree] over the height of the picture."""
COMPASS = ((1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (0, 0, 1))


class NoInside(SurgebreakError):
    """No place has blocks on all four sides."""

    exit_code = ExitCode.BAD_CASE


def inside(blocks, azimuth):
    """The camera that looks towards an azimuth [degree] from inside the blocks (their surface mesh at the start).

    Raises NoInside where no place has blocks on all four sides."""
    low, high = np.reshape(blocks.bounds, (3, 2)).T
    reach = float(np.linalg.norm(high - low))
    near = cKDTree(_spread(blocks))
    best, clear, sides = None, 0.0, 0
    for share in itertools.product(*(np.linspace(*ends, n) for ends, n in zip(_span(), PLACES))):
        place = low + np.array(share) * (high - low)
        free = near.query(place)[0]
        if sides == len(COMPASS) and free <= clear:
            continue
        if len(_hits(blocks, place, np.array([0.3, 0.2, 1.0]), reach)) % 2:  # in a block
            continue
        around = sum(_way(blocks, place, np.array(way, float), reach) is not None for way in COMPASS)
        if around >= len(COMPASS) - 1 and (around, free) > (sides, clear):
            best, clear, sides = place, free, around
    if best is None:
        raise NoInside("--view inside: no place among the blocks has some on all sides; leave --view out")
    ahead = direction(azimuth, 0.0)
    behind = _way(blocks, best, -ahead, reach)
    eye = best - BACK * (0.0 if behind is None else behind) * ahead
    return Camera(eye, eye + ahead * reach, np.array([0.0, 0.0, 1.0]), WIDE)


def _span():
    """Shares of the box between which places lie, along each axis."""
    return (0.05, 0.95), (0.05, 0.95), LEVELS


def _spread(blocks):
    """Points (k, 3) on the faces: corners, middles of faces, and those between."""
    faces = blocks.triangulate().regular_faces
    corners = np.asarray(blocks.points, float)[faces]
    middles = corners.mean(axis=1)
    return np.concatenate(
        [corners.reshape(-1, 3), middles, (0.5 * (corners + middles[:, None])).reshape(-1, 3)]
    )


def _way(blocks, place, towards, reach):
    """Distance [m] to the next block in a direction; None where there is none."""
    hits = _hits(blocks, place, towards, reach)
    return float(np.linalg.norm(hits - place, axis=1).min()) if len(hits) else None


def _hits(blocks, place, towards, reach):
    """Points (k, 3) [m] at which a ray enters or leaves blocks."""
    return blocks.ray_trace(place, place + reach * towards, first_point=False)[0]
