"""White water: where fast water is torn over a cell, as in breakers, jets and behind what they hit.

    foam = ramp(h |∇u| / U; TORN) ramp(|u| / U; FAST)        h: edge of a cell · U: end of the run's scale of speed

after two measures of Ihmsen et al., Vis. Comput. 28 (2012) 669, for the entrainment of air: local differences of
velocity, and kinetic energy. The foam is instantaneous: it does not drift, and it is not computed in the run.
"""

import numpy as np

from coupler.commands.view.water_surface import right_handed

TORN = (0.1, 0.4)
FAST = (0.15, 0.4)
"""Shares of U at which foam begins, and at which it is complete."""


def foam(nodes, cells, level_set, velocity, fastest):
    """Share of foam (n,) at the nodes of cells that the surface cuts, zero elsewhere. fastest: U [m/s]"""
    share = np.zeros(len(nodes))
    cut = np.any(level_set[cells] < 0, axis=1) & np.any(level_set[cells] >= 0, axis=1)
    if not cut.any() or not fastest > 0.0:
        return share
    near = right_handed(nodes, cells[cut])
    difference, volume = differences(nodes, near, velocity)
    weight = np.bincount(near.ravel(), np.repeat(volume, 4), len(nodes))
    mean = np.bincount(near.ravel(), np.repeat(volume * difference, 4), len(nodes))
    at = weight > 0.0
    torn = mean[at] / weight[at] / fastest
    fast = np.linalg.norm(velocity[at], axis=1) / fastest
    share[at] = ramp(torn, TORN) * ramp(fast, FAST)
    return share


def differences(nodes, cells, velocity):
    """h |∇u| (m,) [m/s] of right-handed cells, with |∇u|² the sum of all squares and h³/6 the volume, and that (m,)."""
    edge = nodes[cells[:, 1:]] - nodes[cells[:, :1]]
    volume = np.linalg.det(edge) / 6.0
    sound = volume > 1e-12 * volume.max()
    gradient = np.zeros((len(cells), 3, 3))
    rise = velocity[cells[:, 1:]] - velocity[cells[:, :1]]
    gradient[sound] = np.linalg.solve(edge[sound], rise[sound])
    return np.cbrt(6.0 * np.maximum(volume, 0.0)) * np.linalg.norm(gradient, axis=(1, 2)), volume


def ramp(value, ends):
    """0 below the first end, 1 above the second, straight between."""
    return np.clip((value - ends[0]) / (ends[1] - ends[0]), 0.0, 1.0)
