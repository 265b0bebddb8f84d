"""The state of the water carried to a domain that solids which moved have cut anew."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fluid.domain.continued_nodes import pick_old_cells
from fluid.domain.physical_domain import carry
from fluid.surface.extrapolation import fill_missing
from fluid.surface.volume import renumbering, room_of_heirs

if TYPE_CHECKING:
    from fluid.step.water import Water


def carry_to(domain, water: Water) -> None:
    """Change to the present domain outside of the solids: every field is transferred, and values of newly wet nodes
    are extrapolated from their neighbours.  The volume of water in the balance does not change; the next step
    lifts the surface by what the solids displaced."""
    old, old_topology = water.domain, water.topology
    source = carry(old, domain)
    water.set_domain(domain)
    known = (source >= 0) & old_topology.active[source]
    if water.left_behind is None:
        water.left_behind = (water.velocity, water.acceleration, water.level_set, old_topology)
    _carry_nodes(water, source, known)
    _carry_cells(water, old, source)
    water.find_band()
    if not np.array_equal(source, np.arange(len(source))):
        room = room_of_heirs(water.topology, water.level_set, source)
        handed_on = renumbering(source, old.parent_node, domain.parent_node, room)
        water.nodal_water = handed_on @ water.nodal_water
        water.displaced = handed_on @ water.displaced
        water.renumbered = handed_on if water.renumbered is None else handed_on @ water.renumbered


def _carry_nodes(water: Water, source, known) -> None:
    """Fields of the nodes; source (N,): old node of each node, known (N,) bool: where it had values."""
    scalars = np.column_stack([water.level_set, water.pressure, water.end_pressure])
    fields = [scalars, water.velocity, water.acceleration]
    moved = [np.ascontiguousarray(f[source]) for f in fields]
    fill_missing(water.topology, known, *moved)
    water.level_set = water.dry_if_inactive(moved[0][:, 0])
    water.pressure, water.end_pressure = moved[0][:, 1].copy(), moved[0][:, 2].copy()
    water.velocity, water.acceleration = moved[1], moved[2]
    water.at_bound, water.ventilated = known & water.at_bound[source], known & water.ventilated[source]
    if water.air is not None:
        water.air = water.air.carried(source, known)
        water.moved_by_end = np.zeros_like(water.moved_by_end)
    water.hold(water.velocity, water.time)


def _carry_cells(water: Water, old, source) -> None:
    """Cell fields go on in the cells that continue the old ones; source (N,): old node of each node."""
    if old.covers == "single" and np.array_equal(old.parent_cell, water.domain.parent_cell):
        return
    cells = pick_old_cells(old, water.domain, source)
    if np.array_equal(cells, np.arange(len(old.cells))):
        return
    for name in ("cell_velocity", "remainder", "kick_remainder"):
        setattr(water, name, getattr(water, name).carried(cells, len(old.cells)))
    fresh = np.flatnonzero(cells < 0)
    of_nodes = water.velocity[water.topology.cells[fresh]].mean(axis=1)
    water.cell_velocity = water.cell_velocity.joined(fresh, of_nodes)
