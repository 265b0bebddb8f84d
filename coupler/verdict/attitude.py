"""How far blocks are from their places and how they lie: whether what left its place slid, leans or has overturned."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array

if TYPE_CHECKING:
    from yade_scripts.dynamics.structure import Structure

UPRIGHT = np.radians(10.0)
"""Tilt [rad] up to which a block counts as upright: it slid, floats or fell without turning."""
OVER = np.radians(45.0)
"""Tilt [rad] from which a block counts as overturned: a cube comes to rest on another side from there on."""


def shift_of(structure: Structure) -> Array:
    """(n, 3) [m] the present displacement of the centre of each block."""
    return structure.centre() - np.array([block.centre for block in structure.blocks]).reshape(-1, 3)


def tilt_of(structure: Structure) -> Array:
    """(n,) [rad] angle between the vertical and the line of each block that was vertical at the start, 0 to π. A turn
    about the vertical is no tilt."""
    start = np.array([block.rotation for block in structure.blocks]).reshape(-1, 3, 3)
    line = np.einsum("nij,nj->ni", structure.rotation(), start[:, 2])
    return np.arctan2(np.hypot(line[:, 0], line[:, 1]), line[:, 2])
