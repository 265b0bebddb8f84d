"""Scales that all pictures of a run share: its extent, its fastest water, round numbers for bars, digits of times."""

import numpy as np

from coupler.commands.view.water_surface import some

SAMPLED_STEPS = 25
"""Stored steps from which the scales are taken."""


def bounds(run):
    """Corners (lower, upper) (3,) [m] of what the pictures show: the tank, or else all the places of the blocks."""
    boxes = []
    if run.tank is not None:
        boxes.append(np.asarray(run.tank, dtype=float))
    elif run.water:
        nodes = run.water.at(run.water.times[0]).nodes
        boxes.append((nodes.min(axis=0), nodes.max(axis=0)))
    if run.solids is not None:
        boxes.append(corners(run.solids))
    if run.blocks and not boxes:
        boxes += [corners(run.blocks.at(time)) for time in sampled(run.blocks.times)]
    elif run.blocks:
        boxes.append(corners(run.blocks.at(run.blocks.times[0])))
    lower, upper = np.min([b[0] for b in boxes], axis=0), np.max([b[1] for b in boxes], axis=0)
    return lower, np.maximum(upper, lower + 1e-3 * np.max(upper - lower))


def corners(mesh):
    """Lower and upper corner (2, 3) of a data set."""
    return np.reshape(mesh.bounds, (3, 2)).T


def sampled(times):
    """At most SAMPLED_STEPS of the times, first and last among them."""
    return times[np.unique(np.linspace(0, len(times) - 1, SAMPLED_STEPS).astype(int))]


def fastest_and_air(run):
    """Round speed [m/s] below which 98 % of the nodes at the surface stay over the run, and whether air is trapped in
    it. Nodes inside are not visible, and spray should not set the colour scale."""
    speeds, air = [np.zeros(1)], False
    for time in sampled(run.water.times):
        water = run.water.at(time)
        air = air or bool(water.pocket.any())
        wet = (water.level_set < 0)[water.cells]
        seen = np.zeros(len(water.nodes), bool)
        seen[water.cells[some(wet) & some(~wet)]] = True
        speeds.append(np.linalg.norm(water.velocity[seen & (water.level_set < 0)], axis=1))
    return nice_ceiling(float(np.percentile(np.concatenate(speeds), 98))), air


def nice_ceiling(value):
    """The next larger round number, so that little of a colour scale is left unused (1 where nothing moves)."""
    if value <= 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(r * power for r in (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10, 12) if r * power >= value))


def nice_floor(value):
    """The last of 1, 2, 5, 10, … times a power of ten that is not larger."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(next(r * power for r in (5, 2, 1) if r * power <= value * (1 + 1e-12)))


def decimals(times):
    """Digits after the point that tell neighbouring times apart, at least two."""
    apart = np.diff(np.unique(times))
    return 2 if len(apart) == 0 else int(np.clip(np.ceil(-np.log10(apart.min() * 1.001)), 2, 6))
