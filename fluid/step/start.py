"""Surface, velocity and fluxes of the water at the start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from fluid.domain.cell_vectors import CellVectors
from fluid.surface.level_set import no_steeper, redistance
from fluid.surface.volume import FluxAhead

if TYPE_CHECKING:
    from fluid.step.water import Water

AT_LEVEL = 1e-6
"""Share of a cell by which water at the start may be off the level of an absorbing side and still count as level."""
MOST_READINGS = 10
"""Most times that an absorbing side reads the water at the start."""


def surface_of(water: Water, level, given) -> Array:
    """φ (N,) [m] of a surface at the start; given (N,) bool: nodes where it is known."""
    level = water.dry_if_inactive(level)
    level = redistance(water.topology, level, water.topology.node_size, rescale=False)
    return no_steeper(water.topology, level, given)


def start_beside_sides(water: Water, level, given, velocity) -> None:
    """φ with the levels of the sides, the absorbing ones set to the water at the start, which may be lower beside
    them: a side at its own level at the start would give water that it takes back in the first step. What such a
    side reads depends on the surface that its level makes, so this goes on until both agree."""
    water.level_set, water.velocity = level, np.zeros((len(level), 3)) if velocity is None else velocity
    assert water.sides is not None  # they are what it starts beside
    absorbers, close = water.sides.absorbers(), AT_LEVEL * water.mesh.spacing
    for _ in range(MOST_READINGS):
        heights = [absorber.height for absorber in absorbers]
        water.read_absorbing_sides(0.0)
        for absorber in absorbers:
            if abs(absorber.height) < close:
                absorber.height = absorber.speed = 0.0
        surface = level.copy()
        water.sides.surface(surface, 0.0)
        water.level_set = surface_of(water, surface, given)
        if all(abs(a.height - before) < close for a, before in zip(absorbers, heights)):
            return


def flux_at_start(water: Water) -> FluxAhead:
    """The fluxes of the velocity of the cells at the start, which is that of all cells around the listed nodes."""
    t, near = water.topology, np.zeros(len(water.velocity), bool)
    near[water.listed] = True
    around = t.cells_around(near)
    now = CellVectors(around, water.cell_velocity.field(len(t.cells))[around])
    water.cell_velocity = now
    return FluxAhead(
        nodes=water.listed,
        graph=water.graph_for(water.listed),
        now=now,
        before=now.values,
        dt=0.0,
        water=water.nodal_water,
        capacity=t.node_volume,
    )


def start_moving(water: Water, velocity) -> None:
    """Velocity (N, 3) [m/s] of the nodes that the step works on, and of the cells between them."""
    water.start_speed = float(np.sqrt((velocity**2).sum(axis=1).max()))
    water.velocity[water.listed] = velocity[water.listed]
    water.hold(water.velocity, 0.0)
    near = np.zeros(len(velocity), bool)
    near[water.listed] = True
    cells = water.topology.cells_around(near)
    water.cell_velocity = CellVectors(cells, water.velocity[water.topology.cells[cells]].mean(axis=1))
