"""A raster of uneven columns as one whose points are evenly spaced, as files of rasters hold it."""

from __future__ import annotations

import numpy as np

from array_types import Array

UNEVEN = 1e-6
"""Share of a spacing by which spacings may differ and still count as even."""
MOST_POINTS = 4_000_000
"""Number of points from which an even raster is coarser than its finest columns, so that its file stays below 40 MB."""


def even_raster(x: Array, y: Array, *values: Array) -> tuple[Array, Array, list[Array]]:
    """Evenly spaced x (mx,) and y (my,) [m] between the same ends, and the values (nx, ny) there (mx, my).

    Along an axis that is even already nothing changes. Along another one points lie as close as its finest columns,
    with the values linear between these; beside a column without a value (NaN) the nearer of the two counts.
    """
    axes = [_even(axis) for axis in (x, y)]
    changed = [k for k, old in enumerate((x, y)) if axes[k] is not old]
    points = len(axes[0]) * len(axes[1])
    if changed and points > MOST_POINTS:
        share = (MOST_POINTS / points) ** (1.0 / len(changed))
        for k in changed:
            ends, count = axes[k][[0, -1]], max(len((x, y)[k]), int(share * len(axes[k])))
            axes[k] = np.linspace(ends[0], ends[1], count)
    found = list(values)
    for k in changed:
        found = [_between(np.moveaxis(z, k, 0), (x, y)[k], axes[k], k) for z in found]
    return axes[0], axes[1], found


def _even(axis: Array) -> Array:
    """The axis itself where it is even, else one as fine as its finest part."""
    step = np.diff(axis)
    if np.ptp(step) <= UNEVEN * step.min():
        return axis
    return np.linspace(
        axis[0], axis[-1], int(np.ceil((axis[-1] - axis[0]) / step.min() * (1.0 - UNEVEN))) + 1
    )


def _between(z: Array, old: Array, new: Array, axis: int) -> Array:
    """Values z (n, ...) at the places `old` (n,), along their first axis, at the places `new`; the result has that axis
    in its place."""
    i = np.clip(np.searchsorted(old, new, side="right") - 1, 0, len(old) - 2)
    share = ((new - old[i]) / (old[i + 1] - old[i]))[:, None]
    a, b = z[i], z[i + 1]
    nearer = np.where(share < 0.5, a, b)
    return np.moveaxis(
        np.where(np.isfinite(a) & np.isfinite(b), (1.0 - share) * a + share * b, nearer), 0, axis
    )
