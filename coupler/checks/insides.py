"""Buildings that are full of water at the start, since a box of water covers them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.geometry.parts import parts_of


def inside_remarks(case: Case) -> Iterator[str]:
    """Buildings without an opening in the water, whose middle a box of water covers: only their blocks displace it, so
    that walls are loaded from both sides alike. The house of a test, 1.5 m deep in still water, had a load of 1.7 N."""
    if case.water is None or case.structure is None:
        return
    for part in parts_of(case):
        if part.path[1] != "building":
            continue
        spec = case.structure.building[part.path[2]]
        corners = np.concatenate([block.world_vertices() for block in part.blocks if not block.fixed])
        low, high = corners.min(axis=0), corners.max(axis=0)
        foot = np.array([*(0.5 * (low + high))[:2], low[2]])
        openings = [low[2] + opening.lower[1] for opening in spec.opening]
        for i, fill in enumerate(case.water.fill):
            if fill.surface is not None:
                continue
            lower, upper = np.array(fill.lower), np.array(fill.upper)
            covers = (lower[:2] < foot[:2]).all() and (foot[:2] < upper[:2]).all() and lower[2] < high[2]
            depth = upper[2] - max(foot[2], lower[2])
            if covers and depth > 0.0 and not any(sill < upper[2] for sill in openings):
                yield (
                    f"water.fill[{i}] fills '{part.name}' inside, too, {depth:.3g} m deep: its walls have the same "
                    "water on both sides, and no load from it; for a dry house make the water of boxes that end at "
                    "its walls"
                )
                break
