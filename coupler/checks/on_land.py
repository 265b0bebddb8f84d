"""Houses on a terrain by the levels of the water of the case: above all of them, or in water thin for the cells."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.inflow_records import record_of
from coupler.checks.water import LEAST_CELLS
from coupler.geometry.cell_sizes import cells_at
from coupler.geometry.parts import standing_on_terrain
from coupler.geometry.terrain.standing import on_ground

NAMED = 3
"""Houses that are named; of more the number is said."""


def land_remarks(case: Case) -> Iterator[str]:
    """Houses that no level of the water reaches, and those where it is thinner than a few cells: the load of a sheet
    thinner than a cell is four fifths of what it should be on a narrow column, and thin water is slow."""
    if case.water is None or case.tank is None or case.tank.ground is None:
        return
    highest = _highest_level(case)
    if highest is None:
        return
    dry, thin = [], []
    for _, spec in standing_on_terrain(case):
        standing = on_ground(case, spec)
        foot = np.array(standing.lower, float)
        middle = foot + 0.5 * np.array([*standing.size[:2], 0.0])
        depth, cell = highest - foot[2], float(cells_at(case.tank, middle[None])[0])
        if depth <= 0.0:
            dry.append(spec.name)
        elif depth < LEAST_CELLS * cell:
            thin.append((depth / cell, depth, cell, spec.name))
    if dry:
        yield (
            f"{_listed(dry)} {'stands' if len(dry) == 1 else 'stand'} above all levels of the water "
            f"(z = {highest:.3g} m): only what runs up can reach {'it' if len(dry) == 1 else 'them'}"
        )
    if thin:
        cells, depth, cell, name = min(thin)
        more = f" (and {len(thin) - 1} more stand in thin water)" if len(thin) > 1 else ""
        yield (
            f"at '{name}' water up to z = {highest:.3g} m is {depth:.3g} m deep, {cells:.2g} cells of {cell:.3g} m"
            f"{more}: under {LEAST_CELLS} cells its load there is too small and it comes too late; halve the cells "
            "around what stands there ([[tank.refine]] with around)"
        )


def _highest_level(case: Case) -> float | None:
    """Highest z [m] that the water of the case is given to have anywhere; None where a table of a tide says it."""
    levels = [fill.upper[2] for fill in case.water.fill]
    for spec in case.water.inflow:
        if spec.kind == "record":
            levels.append(float(record_of(spec).level.max()))
        else:
            levels.append(spec.level + getattr(spec, "height", 0.0))
    for sea in case.water.sea:
        if sea.tide is not None and sea.tide.amplitude is None:
            return None
        levels.append(sea.level + (sea.tide.amplitude if sea.tide is not None else 0.0))
    return max(levels, default=None)


def _listed(names: list[str]) -> str:
    """The first names of a list, and how many more there are."""
    said = ", ".join(f"'{name}'" for name in names[:NAMED])
    return said if len(names) <= NAMED else f"{said} and {len(names) - NAMED} more"
