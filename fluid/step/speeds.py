"""How fast the water is, and what follows from it for a step: its length, and how implicit it is.

Functions of a `Water`.  Speeds are largest components of the velocity at the nodes of the water, films beside solids
left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from fluid.step.time_step import LEAST_GATHERED, fastest_wet, gathered, pace
from kernels.decorators import ranged
from kernels.threads import over

if TYPE_CHECKING:
    from fluid.step.water import Water

START_STEPS = 2
"""Steps of a start, which are implicit, and after which the surface lags by no more than by half of each."""
LONGEST_STEP = 0.3
"""dt ≤ LONGEST_STEP sqrt(h/g): a step at rest, h the least size of the cells at the surface ..."""
AT_SURFACE = 3.0
"""... down to so many of them."""


def theta(water: Water, dt: float, crossing: float) -> float:
    """Weight of the new pressure in a step dt [s]: from `calm_theta` in slow water to `theta` where the fastest crosses
    a cell in a step; 1 for the first two steps, so that a start at rest does not ring, and always where `theta` is 1.

    crossing [m/s]: `crossing`."""
    p = water.parameters
    if water.steps < START_STEPS or p.theta == 1.0:
        return 1.0
    return min(p.theta, p.theta - (p.theta - p.calm_theta) * calm(water, dt, crossing))


def calm(water: Water, dt: float, crossing: float) -> float:
    """1 for water at rest, 0 where the fastest crosses a cell in a step dt [s]; crossing [m/s]: `crossing`."""
    return 1.0 - min(1.0, crossing * dt / water.mesh.spacing)


def crossing(water: Water) -> float:
    """The speed [m/s] in which a cell of any size would be crossed in the time of one of the spacing."""
    return fastest_wet(_cells_crossed(water), water.level_set, water.roomy)


def in_waves(water: Water, crossing: float) -> float:
    """The speed over √(g h), that of the shallow-water wave of one of the cells there, of size h; crossing [m/s]:
    `crossing`."""
    t, spacing = water.topology, water.mesh.spacing
    if not t.is_uniform:
        crossing = fastest_wet(water.velocity * np.sqrt(t.finer)[:, None], water.level_set, water.roomy)
    return float(crossing / np.sqrt(water.parameters.gravity * spacing))


def stable_step(water: Water) -> float:
    """dt [s]: Courant number of all but spray and trickles (`time_step.py`), and LONGEST_STEP sqrt(h/g)."""
    h, t = water.mesh.spacing, water.topology
    least = LEAST_GATHERED * h**3
    volume = water.nodal_water if t.is_uniform else water.nodal_water * t.finer**3
    counted = gathered(_counted(water), volume, least, *t.around)
    speed = pace(_cells_crossed(water), water.nodal_water, counted)
    return float(min(longest_step(water), water.parameters.courant * h / max(speed, 1e-12)))


def longest_step(water: Water) -> float:
    """LONGEST_STEP sqrt(h/g) [s]: the step of water at rest."""
    return float(LONGEST_STEP * np.sqrt(_finest_surface(water) / water.parameters.gravity))


def fastest_place(water: Water) -> tuple[float, Array]:
    """Speed [m/s], all components together, and place (3,) [m] of the fastest water; zeros without water."""
    counted = np.flatnonzero(_counted(water))
    if len(counted) == 0:
        return 0.0, np.zeros(3)
    speed = np.linalg.norm(water.velocity[counted], axis=1)
    worst = int(speed.argmax())
    return float(speed[worst]), water.topology.nodes[counted[worst]]


def speed_cap(water: Water) -> float:
    """Largest speed [m/s] that is permitted: speed_limit sqrt(g H + v²/2) in a tank of height H whose water starts with
    at most v; twice what the fall of all of it could give."""
    p, (low, high) = water.parameters, water.mesh.bounds
    return float(p.speed_limit * np.sqrt(p.gravity * (high - low)[2] + 0.5 * water.start_speed**2))


def _cells_crossed(water: Water):
    """Velocity (N, 3) [m/s] in which a cell of any size would be crossed in the time of one of the spacing."""
    t = water.topology
    return water.velocity if t.is_uniform else water.velocity * t.finer[:, None]


def _finest_surface(water: Water) -> float:
    """Least size [m] of the cells at the surface or, where there is none, in the water."""
    t = water.topology
    if t.is_uniform:
        return water.mesh.spacing
    wet = t.active & (water.level_set < 0.0)
    near = wet & (water.level_set > -AT_SURFACE * t.node_size)
    chosen = near if near.any() else wet
    return float(t.node_size[chosen].min()) if chosen.any() else water.mesh.finest


def _counted(water: Water):
    """(N,) bool: nodes of the water with room."""
    counted = np.empty(len(water.level_set), bool)
    over(_wet_and_roomy, len(counted), water.level_set, water.roomy, counted)
    return counted


@ranged
def _wet_and_roomy(first, last, phi, roomy, found):
    for i in range(first, last):
        found[i] = phi[i] < 0.0 and roomy[i]
