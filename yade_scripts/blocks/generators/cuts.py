"""The cuts that divide a length into blocks."""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.polyhedra import BlockError

MOST_BLOCKS = 20_000
"""Most blocks of a scene; this many take gigabytes, and hours for a second of motion."""


def check_count(name: str, count: float) -> None:
    """Raise BlockError for more blocks than a scene can have, before any of them is made."""
    if not count <= MOST_BLOCKS:
        raise BlockError(
            f"'{name}' would have {count:.3g} blocks, at most {MOST_BLOCKS} are possible; take larger or fewer ones"
        )


def pieces(length: float, edge: float) -> float:
    """Number of equal blocks in a length [m], a whole number, whose edges come nearest to `edge` [m]."""
    return max(1.0, float(np.rint(length / edge)))


def equal_cuts(low: float, high: float, edge: float) -> Array:
    """Ends of equal blocks between low and high [m]: the whole number of blocks whose edges come nearest to `edge`
    [m]."""
    return np.linspace(low, high, int(pieces(high - low, edge)) + 1)


def shifted_cuts(cuts: Array) -> Array:
    """Cuts of the same length shifted by half a block, with half blocks at both ends."""
    half = 0.5 * (cuts[1] - cuts[0])
    return np.concatenate([cuts[:1], cuts[:-1] + half, cuts[-1:]])
