"""Readings of a structure for steps, histories and pictures."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from array_types import Array

if TYPE_CHECKING:
    from coupler.step.sides import CoupledSides
    from fluid.step.water import Water
    from yade_scripts.dynamics.structure import Structure


class JointCounts(NamedTuple):
    """Number of joints that carry traction, number of joints that have failed, and the largest damage of the former."""

    intact: int
    broken: int
    largest_damage: float


def joint_counts(structure: Structure) -> JointCounts:
    """The present counts; zeros without joints."""
    damage, alive = structure.joint_damage()
    return JointCounts(int(alive.sum()), int((~alive).sum()), float(damage[alive].max(initial=0.0)))


def size(coupling: CoupledSides) -> dict[str, int]:
    """The present size of the scene: cells outside the solids, cut cells and cells with water; blocks and joints. A
    side that the scene does not have is left out."""
    found = {}
    if coupling.water is not None:
        water, topology = coupling.water, coupling.water.topology
        found["cells"] = len(topology.cells)
        found["cut_cells"] = int(water.domain.is_cut.sum())
        found["wet_cells"] = wet_cells(water)
    if coupling.structure is not None:
        found["blocks"] = coupling.structure.n
        found["joints"] = joint_counts(coupling.structure).intact
    return found


def wet_cells(water: Water) -> int:
    """Cells with a node in the water."""
    return len(water.topology.cells_around(water.level_set < 0.0))


def block_damage(structure: Structure) -> Array:
    """Area-weighted mean damage (n,) of the joints that each block had at the start; 0 for blocks without joints.

    structure: with joints."""
    table = structure.joint_table()
    assert table is not None, "a structure without joints has no damage"
    damage, area = np.zeros(structure.n), np.zeros(structure.n)
    weighted = np.where(table.alive, table.mean_damage, 1.0) * table.area
    for side in (table.a, table.b):
        inner = side >= 0
        np.add.at(damage, side[inner], weighted[inner])
        np.add.at(area, side[inner], table.area[inner])
    return np.divide(damage, area, out=np.zeros(structure.n), where=area > 0.0)


def fastest_point(velocity: Array, radius: Array) -> float:
    """Upper bound of the speed of any point of blocks with velocity (n, 6) and radius (n,) [m/s]."""
    return float(fastest_points(velocity, radius).max(initial=0.0))


def fastest_points(velocity: Array, radius: Array) -> Array:
    """Bound (n,) of the speed of the points of each block, as in `fastest_point`."""
    return np.linalg.norm(velocity[:, :3], axis=1) + np.linalg.norm(velocity[:, 3:], axis=1) * radius
