"""Rubble: loose random blocks scattered in a box without contact, the same for the same seed.

Each block gets a free place for the sphere around it (random sequential addition, the large ones first), so that it can
turn freely there. Spheres fill a third of a box at most this way; let them fall to get a denser heap.
"""

from __future__ import annotations

import itertools
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.cuts import check_count
from yade_scripts.blocks.polyhedra import BlockError

Shape = Literal["polyhedra", "boxes", "mixed"]

TRIES, TRIES_IN_ALL = 5000, 400_000
"""Places tried for one block, and for all of them, before the region counts as full."""
FLATTEST = 0.6
"""Smallest ratio of the axes of a stone, and of the edges of a box."""
CANDIDATES = 8
"""Random points for each corner, of which the one farthest from the corners so far is taken (Mitchell 1991)."""


def rubble_blocks(
    name: str,
    lower,
    size,
    count: int,
    diameter: tuple[float, float],
    seed: int,
    shape: Shape = "polyhedra",
    corners: int = 12,
    **more,
) -> list[Block]:
    """`count` blocks in the box lower (3,) + size (3,) [m].

    diameter [m]: smallest and largest of the spheres around them, evenly spread · shape: "polyhedra" with `corners`
    corners on an ellipsoid, "boxes", or "mixed", half of each · more: further fields of every Block

    Raises BlockError when there is no room for them.
    """
    lower, size = np.asarray(lower, float), np.asarray(size, float)
    _check(name, size, count, diameter, shape, corners)
    check_count(name, count)
    random = np.random.default_rng(seed)
    diameters = np.sort(random.uniform(*diameter, size=count))[::-1]
    centres = _places(name, lower, size, 0.5 * diameters, random)
    found = []
    for k in range(count):
        turn = Rotation.from_quat(random.normal(size=4)).as_matrix()
        boxy = shape == "boxes" or (shape == "mixed" and k % 2 == 1)
        body = _box(random, diameters[k]) if boxy else _stone(random, diameters[k], corners)
        found.append(Block(f"{name}-{k}", centres[k], rotation=turn, **body, **more))
    return found


def _places(name: str, lower: Array, size: Array, radius: Array, random) -> Array:
    """Centres (n, 3) [m] of spheres that lie in the box and apart from each other; the largest come first."""
    spheres = _Spheres(lower, radius)
    tried = 0
    for k, r in enumerate(radius):
        for _ in range(min(TRIES, TRIES_IN_ALL - tried)):
            tried += 1
            place = lower + r + random.random(3) * (size - 2.0 * r)
            if spheres.put(k, place):
                break
        else:
            raise BlockError(
                f"rubble '{name}': only {k} of {len(radius)} blocks found room in {size} m; enlarge it, or take fewer "
                "or smaller blocks"
            )
    return spheres.centres


class _Spheres:
    """Spheres that lie apart. Bins are as wide as the largest sphere, so that only spheres of the same and the adjacent
    bins can overlap."""

    def __init__(self, lower: Array, radius: Array):
        self.lower, self.radius, self.width = lower, radius, 2.0 * radius.max()
        self.centres = np.empty((len(radius), 3))
        self._bins: dict[tuple[int, ...], list[int]] = {}

    def put(self, k: int, place: Array) -> bool:
        """Put sphere k at a place (3,) [m] if this is free → whether it was."""
        own = tuple(((place - self.lower) / self.width).astype(int).tolist())
        around = itertools.product(*((i - 1, i, i + 1) for i in own))
        near = [n for key in around for n in self._bins.get(key, ())]
        apart = np.linalg.norm(self.centres[near] - place, axis=1)
        if (apart <= self.radius[near] + self.radius[k]).any():
            return False
        self.centres[k] = place
        self._bins.setdefault(own, []).append(k)
        return True


def _box(random, diameter: float) -> dict:
    edges = np.array([1.0, *random.uniform(FLATTEST, 1.0, 2)])
    return {"size": diameter * edges / np.linalg.norm(edges)}


def _stone(random, diameter: float, corners: int) -> dict:
    """Corners spread over an ellipsoid, about their centre of mass, the farthest at half the diameter."""
    points = [_direction(random)]
    while len(points) < corners:
        tried = np.array([_direction(random) for _ in range(CANDIDATES)])
        apart = np.linalg.norm(tried[:, None] - np.array(points)[None], axis=2).min(axis=1)
        points.append(tried[apart.argmax()])
    axes = np.array([1.0, *random.uniform(FLATTEST, 1.0, 2)])
    stone = Block("stone", np.zeros(3), vertices=np.array(points) * axes)
    return {"vertices": stone.vertices * (0.5 * diameter / stone.radius), "faces": stone.faces}


def _direction(random) -> Array:
    x = random.normal(size=3)
    return x / np.linalg.norm(x)


def _check(name: str, size: Array, count: int, diameter, shape: str, corners: int) -> None:
    if not 0.0 < diameter[0] <= diameter[1]:
        raise BlockError(f"rubble '{name}': diameter = {diameter} m; give the smallest, then the largest")
    if not (size >= diameter[1]).all():
        raise BlockError(f"rubble '{name}': the largest block ({diameter[1]} m) does not fit into {size} m")
    if shape not in ("polyhedra", "boxes", "mixed"):
        raise BlockError(f"rubble '{name}': shape = {shape!r}; it must be 'polyhedra', 'boxes' or 'mixed'")
    if count < 1 or corners < 4:
        raise BlockError(
            f"rubble '{name}': count = {count}, corners = {corners}; at least 1 block of 4 corners"
        )
