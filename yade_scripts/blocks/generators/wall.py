"""A wall, pier or plate: a box divided into equal blocks, in stack or in running bond."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.cuts import check_count, equal_cuts, pieces, shifted_cuts
from yade_scripts.blocks.polyhedra import BlockError

Bond = Literal["stack", "running"]


def wall_of_blocks(
    name: str, lower, size, block, bond: Bond = "stack", along: str | None = None, **more
) -> list[Block]:
    """The box lower (3,) + size (3,) [m] divided into blocks of edges near `block` (3,) [m].

    bond: "stack" (joints in line) or "running": every other course along the wall is shifted by half a block, with
    half blocks at its ends; where the wall is several blocks thick, neighbouring wythes are shifted against each
    other as well · along: "x" or "y", direction of the length of the wall; None: its longer side · more: further fields
    of every Block

    Raises BlockError for lengths that are not positive, too many blocks, and other names of bond and along.
    """
    lower, size, block = (np.broadcast_to(np.asarray(v, float), (3,)) for v in (lower, size, block))
    _check(name, size, block, bond, along)
    check_count(name, math.prod(pieces(s, edge) for s, edge in zip(size, block)))
    axis = int(size[1] > size[0]) if along is None else "xy".index(along)
    cuts = [equal_cuts(a, a + s, edge) for a, s, edge in zip(lower, size, block)]
    shifted = list(cuts)
    shifted[axis] = shifted_cuts(cuts[axis])
    found = []
    for course in range(len(cuts[2]) - 1):
        for wythe in range(len(cuts[1 - axis]) - 1):
            own = shifted if bond == "running" and (course + wythe) % 2 else cuts
            for place in range(len(own[axis]) - 1):
                at = [wythe, wythe, course]
                at[axis] = place
                low = np.array([own[k][at[k]] for k in range(3)])
                high = np.array([own[k][at[k] + 1] for k in range(3)])
                label = "-".join(str(k) for k in at)
                found.append(Block(f"{name}-{label}", 0.5 * (low + high), size=high - low, **more))
    return found


def _check(name: str, size, block, bond: str, along: str | None) -> None:
    for what, value in (("size", size), ("block", block)):
        if not (value > 0.0).all():
            raise BlockError(f"wall '{name}': {what} = {value} m; every edge must be positive")
    if bond not in ("stack", "running"):
        raise BlockError(f"wall '{name}': bond = {bond!r}; it must be 'stack' or 'running'")
    if along not in (None, "x", "y"):
        raise BlockError(f"wall '{name}': along = {along!r}; it must be 'x' or 'y'")
