"""A camera that frames any box: the direction is chosen, distance and aim follow from the corners."""

import itertools
from dataclasses import dataclass

import numpy as np

STRAIGHT_ABOVE = 89.9
"""Elevation [degree] from which x points to the right of the picture, since up has no direction any more."""
VIEWS = {
    "plan": (-90.0, 90.0), "south": (-90.0, 0.0), "east": (0.0, 0.0), "north": (90.0, 0.0), "west": (180.0, 0.0),
}  # fmt: skip
"""Azimuth and elevation [degree] of a view by name: from above, and from the side at y-, x+, y+ and x-."""
WIDE, FAR = 24.0, 1.0
"""View angles [degree]: of a picture, and that which frames a view by name. Such a view is drawn without perspective,
so that one scale holds at every depth."""
SIDES = (-62.0, -118.0, 118.0, 62.0)
"""Azimuths [degree] of which `side_of` takes one."""


def side_of(where, usual=SIDES[0]):
    """The azimuth [degree] of SIDES at which a direction (2,) in plan points to the camera; without one, the usual."""
    size = np.linalg.norm(where)
    if not size > 0.0:
        return usual
    turns = np.radians(SIDES)
    facing = np.cos(turns) * where[0] / size + np.sin(turns) * where[1] / size
    return SIDES[int(np.flatnonzero(facing >= facing.max() - 1e-3)[0])]


def angle_of(azimuth, elevation):
    """View angle [degree] of a picture in a direction [degree]: FAR in that of a view by name."""
    return FAR if (azimuth, elevation) in VIEWS.values() else WIDE


@dataclass(frozen=True)
class Camera:
    """position (3,), focus (3,) [m], up (3,), view_angle [degree] over the height of the picture."""

    position: np.ndarray
    focus: np.ndarray
    up: np.ndarray
    view_angle: float


def direction(azimuth, elevation):
    """Unit vector (3,) from the scene to the camera; degrees, azimuth from +x towards +y."""
    a, e = np.radians([azimuth, elevation])
    return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])


def frame(
    lower, upper, aspect, azimuth=-65.0, elevation=24.0, view_angle=WIDE, margin=(0.05, 0.05, 0.05, 0.05)
):
    """The nearest camera in the given direction that sees all corners of the box [lower, upper] (3,) [m].

    aspect: width over height of the picture · margin: shares of it kept free at left, right, bottom, top.
    A corner at the depth d in front of the camera is in the picture if |across| ≤ d tan(angle/2). Each side of the
    picture is thus a plane, and along each picture axis the tightest pair of planes gives the aim and the distance.
    """
    corners = np.array(list(itertools.product(*zip(lower, upper))), dtype=float)
    back = direction(azimuth, elevation)
    right = np.cross([0.0, 0.0, 1.0], back) if elevation < STRAIGHT_ABOVE else np.array([1.0, 0.0, 0.0])
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    tangent = np.tan(np.radians(view_angle) / 2)
    left_, right_, bottom, top = margin
    x, dx = _fit(
        corners @ right,
        corners @ back,
        tangent * aspect * (1 - 2 * left_),
        tangent * aspect * (1 - 2 * right_),
    )
    y, dy = _fit(corners @ up, corners @ back, tangent * (1 - 2 * bottom), tangent * (1 - 2 * top))
    depth = max(dx, dy)
    position = x * right + y * up + depth * back
    return Camera(position, position - back * (depth - (corners @ back).mean()), up, view_angle)


def _fit(across, depth, low, high):
    """Place and depth of a camera so that -low (c - depth) ≤ across - place ≤ high (c - depth) holds tightly."""
    upper = np.max(across + high * depth)  # place + high c ≥ upper
    lower = np.max(-across + low * depth)  # low c - place ≥ lower
    c = (upper + lower) / (low + high)
    return upper - high * c, c
