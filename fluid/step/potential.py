"""The potential energy of the water, and that of the same water at a level: motion can draw on the difference."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fluid.numerics.fields import is_nothing, less
from fluid.surface.volume import nodal_volume

if TYPE_CHECKING:
    from fluid.step.water_readings import WaterReadings

LEVEL_HALVINGS = 40
"""Halvings of the range of heights in which the level is sought."""


def potential_energy(water: WaterReadings) -> float:
    """-∫ ρ g·x dV [J] above the floor of the tank, where the surface is.

    What the volume is off by within the tolerance of its correction counts as if it were put right at the surface:
    a millionth of a deep pool would outweigh a small wave."""
    p, held = water.parameters, less(water.nodal_water, water.displaced)
    found = -p.density * (float(held @ water.nodes_below_floor) - water.film_potential)
    surface, farther = _at_surface(water), water.taken_by(water.farther)
    if not is_nothing(farther):
        found += p.density * float(farther @ (water.nodes_below_floor - surface))
    return found + p.density * (water.volume() - water.conserved_volume) * surface


def _at_surface(water: WaterReadings) -> float:
    """g·x [m²/s²] of the surface, mean over the nodes within half a cell of it; 0 where there is none."""
    t, listed = water.topology, water.listed
    near = listed[np.abs(t.in_cells(water.level_set)[listed]) < 0.5 * water.mesh.spacing]
    return float(water.below_floor(t.nodes[near]).mean()) if len(near) else 0.0


def level_energy(water: WaterReadings) -> float:
    """Potential energy [J] above the floor of the tank of the water at a level, which an open side may bound."""
    t, p, weight = water.topology, water.parameters, water.parameters.weight
    height = -(t.nodes @ weight) / max(p.gravity, 1e-300)
    low, high = height.min(), height.max()
    faces, area = water.walls.open_faces, water.walls.open_area
    upright = area @ weight > -0.9 * p.gravity * np.linalg.norm(area, axis=1)
    spill = height[faces[upright]].min() if upright.any() else np.inf
    for _ in range(LEVEL_HALVINGS):
        level = 0.5 * (low + high)
        held = nodal_volume(t, height - level)
        low, high = (level, high) if held.sum() < water.conserved_volume else (low, level)
    if high > spill:
        held = nodal_volume(t, height - spill)
    return -p.density * float(held @ water.nodes_below_floor)
