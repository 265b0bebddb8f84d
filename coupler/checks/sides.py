"""Blocks that rub on the sides of a slice."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.geometry.parts import Part, parts_of

AT = 1e-6
"""Distance [m] over the size of the tank within which a corner of a block is at a side."""


def side_remarks(case: Case) -> Iterator[str]:
    """Parts that reach from side to side of the tank, whose sides have the friction of the contacts: loose blocks, and
    glued ones where the sides are smooth for the water, as symmetry planes are.

    A dry wall of two columns of blocks 2 m high and 0.5 m thick stood in such a slice with 1.5 m of water before it,
    where 1.4 m overturn it: the water in the joint between the columns pressed them against the sides, and these
    carried 1.0 of the 6.9 kN m of the water. A glued sea wall 4 m long between smooth sides, which a bore of 3 m
    overtopped, broke from its foot, bent between them and had moved 0.8 m after 5 s, with 37 of its 42 joints broken;
    without that friction it slid away as a whole, 14 m in 4 s."""
    if case.structure is None or case.contact is None or case.tank is None:
        return
    for part in parts_of(case):
        for axis, name in enumerate("xy"):
            friction = _friction(case, part.blocks[0].material)
            planes = {f"{name}-", f"{name}+"} <= set(case.tank.smooth)
            if case.joints is not None and not planes:
                continue
            if friction > 0.0 and _from_side_to_side(case, part, axis):
                blocks = "loose blocks" if case.joints is None else "blocks"
                floor = "" if case.structure.ground else ", and [structure.ground] for that of the floor"
                yield (
                    f"the {blocks} of '{part.name}' reach from {name}- to {name}+ of the tank and rub on both "
                    f"sides, with friction {friction:g}; if the tank is a slice of something longer, write "
                    f'[[contact.pair]] materials = ["{part.blocks[0].material}", "tank"], friction = 0{floor}'
                )


def _from_side_to_side(case: Case, part: Part, axis: int) -> bool:
    """Whether blocks of a part that can move have faces at both sides along an axis, and both sides are closed."""
    assert case.tank is not None
    name, ends = "xyz"[axis], (case.tank.lower[axis], case.tank.upper[axis])
    if {f"{name}-", f"{name}+"} & set(case.tank.open):
        return False
    slack = AT * float(np.subtract(case.tank.upper, case.tank.lower).max())
    places = [block.world_vertices()[:, axis] for block in part.blocks if not block.fixed]
    return all(any((np.abs(x - end) < slack).sum() >= 3 for x in places) for end in ends)


def _friction(case: Case, material: str) -> float:
    """Friction of blocks of a material on the sides of the tank."""
    assert case.contact is not None
    for pair in case.contact.pair:
        if set(pair.materials) == {material, "tank"} and pair.friction is not None:
            return pair.friction
    return case.contact.friction
