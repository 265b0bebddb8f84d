"""A column: stacked drums, as boxes or as prisms of many sides, straight or tapered."""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.polyhedra import BlockError


def column_of_boxes(name: str, foot, size, count: int, **more) -> list[Block]:
    """A stack of `count` boxes; size (3,) [m] of the whole column, foot (3,) [m] the middle of its underside.

    Raises BlockError for lengths that are not positive, or no boxes."""
    size = np.asarray(size, float)
    _check(name, count, size)
    drum = size / np.array([1.0, 1.0, count])
    rise = np.array([0.0, 0.0, drum[2]])
    return [
        Block(f"{name}-{k}", np.asarray(foot, float) + (k + 0.5) * rise, size=drum, **more)
        for k in range(count)
    ]


def column_of_drums(
    name: str,
    foot,
    radius: float,
    height: float,
    count: int,
    sides: int = 12,
    top_radius: float | None = None,
    **more,
) -> list[Block]:
    """`count` drums of equal height with `sides` sides, foot (3,) [m] the middle of the underside.

    radius [m]: of the circle through the corners at the foot · top_radius [m]: the same at the top (None: radius);
    between the two the column tapers straight, so that every drum is a frustum with plane sides.
    Raises BlockError for lengths that are not positive, no drums, or fewer than three sides.
    """
    top_radius = radius if top_radius is None else top_radius
    _check(name, count, np.array([radius, top_radius, height]))
    if sides < 3:
        raise BlockError(f"column '{name}': sides = {sides}; a drum has at least 3")
    levels, radii = np.linspace(0.0, height, count + 1), np.linspace(radius, top_radius, count + 1)
    return [
        Block.standing(
            f"{name}-{k}",
            np.asarray(foot, float) + _frustum(levels[k : k + 2], radii[k : k + 2], sides),
            _frustum_faces(sides),
            **more,
        )
        for k in range(count)
    ]


def _frustum(levels: Array, radii: Array, sides: int) -> Array:
    """Corners (2 sides, 3) [m]: the ring below, then the ring above; two sides lie across x if `sides` is even."""
    angle = (np.arange(sides) + 0.5) * 2.0 * np.pi / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return np.vstack([np.c_[r * ring, np.full(sides, z)] for z, r in zip(levels, radii)])


def _frustum_faces(sides: int) -> tuple[tuple[int, ...], ...]:
    below, above = tuple(range(sides))[::-1], tuple(range(sides, 2 * sides))
    around = ((k, (k + 1) % sides, sides + (k + 1) % sides, sides + k) for k in range(sides))
    return (below, above, *around)


def _check(name: str, count: int, lengths: Array) -> None:
    if count < 1:
        raise BlockError(f"column '{name}': count = {count}; it has at least one drum")
    if not (lengths > 0.0).all():
        raise BlockError(f"column '{name}': lengths {lengths} m; all must be positive")
