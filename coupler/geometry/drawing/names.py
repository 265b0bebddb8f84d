"""Names of the blocks of a drawing: walls, floors, roofs and other parts, storey by storey.

A part that is thin vertically is a floor (the highest one is the roof, one at the foot of the walls the base), one that
is thin horizontally is a wall in the plane across its thickness, and any other is a pier. Storeys lie between floors.
Walls in one plane are one wall; x-, x+, y-, y+ are the outermost ones along the axes, the rest are numbered.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from array_types import Array
from coupler.geometry.drawing.convex_parts import directions

THIN = 0.5
"""Largest ratio of the smallest to the middle width of a wall or floor."""
UPWARDS = 0.7
"""Upward component of its normal from which a thin part is a floor."""
ALONG = 0.999
"""Component of the normal of a wall along an axis from which it lies along that axis."""
SAME_STOREY = 0.3
"""Share of the highest storey within which the heights of floors are those of one storey; a floor as near to the foot
of the walls lies on the ground."""
WIDE = 4.0
"""Widths of a floor over its thickness, both, from which it parts two storeys: steps of stairs do not."""


def member_names(
    name: str, parts: Sequence[Array], middles: Sequence[Array], tolerance: float
) -> list[list[str]]:
    """The wall, floor, ... of each block of each convex part: NAME-wall0x- and so on.

    parts: corners (k, 3) [m] of each · middles: of the blocks that each was divided into, (b, 3) [m]: a wall may go
    over several storeys · tolerance [m]: planes nearer than this are one."""
    axes = [directions(corners) for corners in parts]
    spans = [np.ptp(corners @ own.T, axis=0) for corners, own in zip(parts, axes)]
    kinds = [_kind(own, span) for own, span in zip(axes, spans)]
    centres = np.array([0.5 * (c.min(axis=0) + c.max(axis=0)) for c in parts]).reshape(-1, 3)
    standing = [k for k, kind in enumerate(kinds) if kind != "floor"]
    foot = min((parts[k][:, 2].min() for k in standing), default=-np.inf)
    levels, ground = _levels(kinds, spans, centres, foot)
    top = max((parts[k][:, 2].max() for k in standing), default=-np.inf)
    planes = _planes(kinds, axes, centres, tolerance)
    found = []
    for k, kind in enumerate(kinds):
        if kind == "floor":
            storey = int(np.sum(levels < centres[k, 2] - tolerance))
            if centres[k, 2] < ground:
                kind = "base"
            elif storey >= len(levels) - 1 and centres[k, 2] >= top - spans[k].min():
                kind = "roof"
            storeys = [storey] * len(middles[k])
        else:
            storeys = [int(np.sum(levels < z - tolerance)) for z in middles[k][:, 2]]
        found.append([f"{name}-{kind}{storey}{planes[k]}" for storey in storeys])
    return found


def _kind(axes: Array, span: Array) -> str:
    """wall, floor or pier, from its own directions (3, 3) and widths (3,)."""
    if np.sort(span)[0] > THIN * np.sort(span)[1]:
        return "pier"
    return "floor" if abs(axes[0][2]) > UPWARDS else "wall"


def _levels(kinds, spans, middles, foot: float) -> tuple[Array, float]:
    """Heights (s,) [m] of the middles of the floors and roofs that end a storey, from below, and the height below which
    a floor lies on the ground · foot: of the walls [m], -inf without walls."""
    wide = np.sort(
        [
            z
            for kind, span, z in zip(kinds, spans, middles[:, 2])
            if kind == "floor" and np.sort(span)[1] > WIDE * span.min() and z > foot
        ]
    )
    if not len(wide):
        return np.zeros(0), foot
    from_ground = wide if np.isinf(foot) else np.insert(wide, 0, foot)
    apart = SAME_STOREY * np.diff(from_ground).max(initial=0.0)
    wide = wide[wide > foot + apart]
    return wide[np.diff(wide, prepend=-np.inf) > apart], foot + apart


def _planes(kinds, axes, middles, tolerance: float) -> list[str]:
    """Which of the walls each wall is in: x-, x+, y-, y+, or the axis and a number, d for oblique ones."""
    names = [""] * len(kinds)
    groups: dict[tuple, dict[float, list[int]]] = {}
    for k, kind in enumerate(kinds):
        if kind == "wall":
            normal = axes[k][0]
            axis = "x" if abs(normal[0]) > ALONG else "y" if abs(normal[1]) > ALONG else "d"
            direction = tuple(np.round(normal, 3)) if axis == "d" else ()
            offset = round(float(normal @ middles[k]) / (100 * tolerance)) * 100 * tolerance
            groups.setdefault((axis, direction), {}).setdefault(offset, []).append(k)
    numbers: dict[str, int] = {}
    for (axis, _), planes in sorted(groups.items()):
        places = sorted(planes)
        for i, offset in enumerate(places):
            if axis != "d" and len(places) > 1 and i in (0, len(places) - 1):
                which = axis + ("-" if i == 0 else "+")
            else:
                numbers[axis] = numbers.get(axis, 0) + 1
                which = f"{axis}{numbers[axis]}"
            for k in planes[offset]:
                names[k] = which
    return names
