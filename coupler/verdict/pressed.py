"""Across which faces of a block the net pressure of the water is measured.

A net pressure is the force of the water along the normal of a pair of faces, over their mean area (volume over width).
Of a block in a wall it is that across the wall, and of one in a floor or roof the vertical one: along the wall's length
or height, a force would be divided by the small ends of a block. What the wall is follows from all of its blocks, since
a single one may be lower or shorter than the wall is thick, as a course of bricks or half a block of a running bond.
Where blocks are no wall and no slab (caissons, columns, containers, stones), every pair of upright faces counts, and
the largest pressure is the one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array, Floats, Ints

if TYPE_CHECKING:
    from yade_scripts.blocks.block import Block

THIN = 0.5
"""Largest ratio of the thickness of a wall to its length, and of a slab to its shorter side."""
FLAT = 0.75
"""The same ratio of the widths of each block of a slab; containers that lie apart are no slab."""
LEVEL = 0.7
"""Upward component of a normal above which its face is not upright."""
MOST_AXES = 64
"""Directions of faces in a group above which its blocks are stones, each taken by itself."""


@dataclass(frozen=True)
class Pressed:
    """The pairs of faces that count: row (k,) of the block · normal (k, 3), unit · area (k,) [m²]"""

    row: Ints
    normal: Floats
    area: Floats

    @classmethod
    def of(cls, blocks: list[Block], label: Array) -> Pressed:
        """label (n,): the wall, floor or part that each block is in, negative for none."""
        groups = [np.flatnonzero(label == k) for k in np.unique(label[label >= 0])]
        groups += [np.array([i]) for i in np.flatnonzero(label < 0)]
        found = [pair for rows in groups for pair in _of_group([blocks[i] for i in rows], rows)]
        row, normal, area = zip(*found) if found else ((), (), ())
        return cls(np.array(row, int), np.array(normal).reshape(-1, 3), np.array(area, float))

    def pressure(self, force: Array) -> Array:
        """The largest net pressure [Pa] across each block (n,) under forces (n, 3) [N]."""
        found = np.zeros(len(force))
        across = np.abs(np.einsum("ki,ki->k", force[self.row], self.normal)) / self.area
        np.maximum.at(found, self.row, across)
        return found


def _of_group(blocks: list[Block], rows: Array) -> list[tuple[int, Array, float]]:
    """(row, normal, area) of the pairs of faces of the blocks of one group."""
    axes = [_axes(block) for block in blocks]
    corners = [block.world_vertices() for block in blocks]
    keys = [[tuple(np.round(axis, 3)) for axis in own] for own in axes]
    known = {key: axis for of_block, own in zip(keys, axes) for key, axis in zip(of_block, own)}
    together = len(known) <= MOST_AXES
    extent = dict(zip(known, np.ptp(np.concatenate(corners) @ np.array([*known.values()]).T, axis=0)))
    found = []
    for row, block, own, of_block, x in zip(rows.tolist(), blocks, axes, keys, corners):
        width = np.ptp(x @ own.T, axis=0)
        whole = np.array([extent[key] for key in of_block]) if together else width
        found += [(row, own[k], float(block.volume / width[k])) for k in _chosen(own, width, whole)]
    return found


def _axes(block: Block) -> Array:
    """(k, 3) unit normals of the faces, one of each opposite pair."""
    normals = block.planes[0] @ block.rotation.T
    found: dict[tuple[float, ...], Array] = {}
    for n in normals:
        lead = n[np.argmax(np.abs(n) > 1e-6)]
        axis = n if lead > 0.0 else -n
        found.setdefault(tuple(np.round(axis, 3) + 0.0), axis)
    return np.array([*found.values()])


def _chosen(axes: Array, width: Array, whole: Array) -> Array:
    """Which axes (k, 3) count for a block of these widths (k,) in a group of these extents (k,)."""
    order = np.argsort(whole, kind="stable")
    upright = order[np.abs(axes[order, 2]) <= LEVEL]
    first = order[0]
    flat = width[first] <= FLAT * np.delete(width, first).min(initial=np.inf)
    if first not in upright and (not len(upright) or (flat and whole[first] <= THIN * whole[upright[0]])):
        return order[:1]
    wall = len(upright) > 1 and whole[upright[0]] <= THIN * whole[upright[1]]
    return upright[:1] if wall else upright
