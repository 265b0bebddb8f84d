"""Overlapping blocks, and the depth of overlap relative to their thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupler.geometry.bodies import Body, overlap_depth


@dataclass(frozen=True)
class Overlap:
    """block, other: names, the other with its article or in quotes · depth [m] that parts them · share: of the
    thickness of the thinner one · joined: a live joint holds them apart, not a contact."""

    block: str
    other: str
    depth: float
    share: float
    joined: bool = False


def deepest_overlap(structure, limit: float) -> Overlap | None:
    """The pair with the largest relative overlap, if that is more than `limit` of the thinner block; else None.

    The contacts give upper bounds of the depths; those that seem too large are computed exactly."""
    a, b, depth, share, joined = structure.deepest()
    for p in np.argsort(-share, kind="stable"):
        if share[p] <= limit:
            return None
        exact = depth[p] if b[p] < 0 else _exact(structure, int(a[p]), int(b[p]))
        part = float(exact * share[p] / depth[p])
        if part > limit:
            other = f"'{structure.names[b[p]]}'" if b[p] >= 0 else f"the {structure.planes[-1 - b[p]].name}"
            return Overlap(structure.names[a[p]], other, float(exact), part, bool(joined[p]))
    return None


def _exact(structure, a: int, b: int) -> float:
    """Smallest displacement [m] that separates two blocks in their present positions."""
    centre, rotation = structure.centre(), structure.rotation()
    first, second = (
        Body.of_block(structure.blocks[row].changed(centre=centre[row], rotation=rotation[row]))
        for row in (a, b)
    )
    return max(overlap_depth(first, second), 0.0)
