"""Where a length is cut into blocks."""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.polyhedra import BlockError

MOST_BLOCKS = 20_000
"""Blocks of a scene: that many take gigabytes, and hours a second of motion."""


def check_count(name: str, count: float) -> None:
    """Refuse more blocks than a scene can have, before one of them is made. Raises BlockError."""
    if not count <= MOST_BLOCKS:
        raise BlockError(
            f"'{name}' would have {count:.3g} blocks, at most {MOST_BLOCKS} are possible; take larger or fewer ones"
        )


def pieces(length: float, edge: float) -> float:
    """The whole number of equal blocks in a length whose own length comes nearest to `edge` [m]."""
    return max(1.0, float(np.rint(length / edge)))


def equal_cuts(low: float, high: float, edge: float) -> Array:
    """Ends of equal blocks between low and high [m]: the whole number of them whose length comes nearest to `edge`."""
    return np.linspace(low, high, int(pieces(high - low, edge)) + 1)


def shifted_cuts(cuts: Array) -> Array:
    """The same length cut half a block further on, with half blocks at both ends."""
    half = 0.5 * (cuts[1] - cuts[0])
    return np.concatenate([cuts[:1], cuts[:-1] + half, cuts[-1:]])
