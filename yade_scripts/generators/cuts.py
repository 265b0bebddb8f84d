"""Where a length is cut into blocks."""

from __future__ import annotations

import numpy as np

Array = np.ndarray


def equal_cuts(low: float, high: float, edge: float) -> Array:
    """Ends of equal blocks between low and high [m]: the whole number of them whose length comes nearest to `edge`."""
    return np.linspace(low, high, max(1, round((high - low) / edge)) + 1)


def shifted_cuts(cuts: Array) -> Array:
    """The same length cut half a block further on, with half blocks at both ends."""
    half = 0.5 * (cuts[1] - cuts[0])
    return np.concatenate([cuts[:1], cuts[:-1] + half, cuts[-1:]])
