"""Footprints of buildings that are not rectangular."""

from __future__ import annotations

import numpy as np

from coupler.geometry.footprints import area_of

OUTSIDE = 1e-6
"""Share of size by which a corner of an outline may lie beside it: the digits of a file."""


def outline_of(spec) -> np.ndarray:
    """Corners (k, 2) [m] of the footprint of a building with an outline, counter-clockwise, before its turn. Raises
    BlockError."""
    from yade_scripts.blocks.polyhedra import BlockError

    corners = np.array(spec.outline, float)
    size = np.array(spec.size[:2])
    if len(corners) < 3 or not abs(area_of(corners)) > 0.0:
        raise BlockError(f"building '{spec.name}': outline: {len(corners)} corners without an area")
    if (corners < -OUTSIDE * size).any() or (corners > (1.0 + OUTSIDE) * size).any():
        raise BlockError(
            f"building '{spec.name}': outline: its corners lie between 0 and size ({size[0]:g} x {size[1]:g} m)"
        )
    if spec.opening:
        raise BlockError(f"building '{spec.name}': openings are for rectangles; leave outline or them out")
    corners = corners if area_of(corners) > 0.0 else corners[::-1]
    return corners + np.array(spec.lower[:2])
