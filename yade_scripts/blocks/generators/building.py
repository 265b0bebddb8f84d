"""A building of box blocks: walls, floors, roof, doors and windows.

Blocks are cut to fit: a length is divided into the nearest whole number of equal blocks, between the borders of
openings where there are any.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from array_types import Array, Floats
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.cuts import check_count, equal_cuts, pieces
from yade_scripts.blocks.polyhedra import BlockError

SAME = 1e-6
"""Cuts closer than this share of a block's edge are merged."""
CLOSE = 1.0 / 3.0
"""Regular cuts are dropped within this share of a block's edge from the border of an opening."""


@dataclass(frozen=True)
class Opening:
    """A door or window: the part of the building in the box lower (3,) .. upper (3,) [m] is left out, exactly."""

    lower: Floats
    upper: Floats

    def meets(self, low: Array, high: Array) -> bool:
        """Whether the opening and the box low .. high share a volume."""
        return bool(np.all(np.minimum(self.upper, high) - np.maximum(self.lower, low) > 0.0))

    def holds(self, point: Array) -> bool:
        """Whether a point lies inside."""
        return bool(np.all(point > np.asarray(self.lower)) and np.all(point < np.asarray(self.upper)))


@dataclass(frozen=True)
class Building:
    """lower, upper (2,) [m]: footprint, outer faces · height [m] to the top of the walls · base [m]: level it stands on

    thickness [m] of walls · floor_thickness [m] of floors and roof (None: as the walls)
    block: edge of a block along walls and slabs [m]
    course: height of a block in the walls [m] (None: as `block`)
    storeys: number of storeys (slabs between them) · roof: slab on top · openings: doors and windows
    density [kg/m³] · material: name for friction by pairs
    """

    lower: Floats
    upper: Floats
    height: float
    thickness: float
    block: float
    course: float | None = None
    floor_thickness: float | None = None
    storeys: int = 1
    roof: bool = True
    base: float = 0.0
    density: float = 2400.0
    openings: tuple[Opening, ...] = field(default_factory=tuple)
    name: str = "building"
    material: str = "block"

    def __post_init__(self):
        span = np.asarray(self.upper, float) - np.asarray(self.lower, float)
        if not (span > 2.0 * self.thickness).all():
            raise BlockError(
                f"building '{self.name}': footprint {span} m leaves no room between walls of {self.thickness} m"
            )
        for name in ("height", "thickness", "block", "density"):
            if not getattr(self, name) > 0.0:
                raise BlockError(
                    f"building '{self.name}': {name} = {getattr(self, name)}; it must be positive"
                )
        if self.storeys < 1 or self.storey_height <= self.slab:
            raise BlockError(
                f"building '{self.name}': {self.storeys} storeys in {self.height} m leave no wall "
                f"between slabs of {self.slab} m"
            )

    @property
    def slab(self) -> float:
        """Thickness of floors and roof [m]."""
        return self.thickness if self.floor_thickness is None else self.floor_thickness

    @property
    def storey_height(self) -> float:
        """Height from the foot of one storey to the foot of the next [m]."""
        return self.height / self.storeys


@dataclass(frozen=True)
class _Part:
    """A wall of one storey, or a slab: the box low (3,) .. high (3,) [m] and the wanted edges of its blocks (3,).

    preferred: preferred cuts along x, y, z, omitted near an opening.
    """

    name: str
    group: str
    low: Floats
    high: Floats
    edges: tuple[float, float, float]
    preferred: tuple[tuple[float, ...], ...]


def building_blocks(b: Building) -> list[Block]:
    """Walls, floor slabs and roof of a building, less its openings.

    Slabs lie on the walls over the whole footprint and form the top of their storey; corner piers belong to the walls
    along y, and walls along x fit between them. Where no opening is near, walls and slabs share one grid. The borders
    of an opening are cuts of the parts it meets, so that it has exactly the given size.

    Raises BlockError for an opening that meets no part of the building.
    """
    parts = [part for storey in range(b.storeys) for part in _storey_parts(b, storey)]
    for opening in b.openings:
        if not any(opening.meets(p.low, p.high) for p in parts):
            raise BlockError(
                f"building '{b.name}': the opening {np.asarray(opening.lower)} .. {np.asarray(opening.upper)} m meets "
                "no wall and no slab; check its wall, its place and its size"
            )
    check_count(b.name, sum(_wanted_blocks(part) for part in parts))
    return [block for part in parts for block in _part_blocks(part, b)]


def _storey_parts(b: Building, storey: int) -> list[_Part]:
    """Four walls and the slab on top of them, if there is one."""
    foot, t = b.base + storey * b.storey_height, b.thickness
    with_slab = b.roof or storey < b.storeys - 1
    head = foot + b.storey_height - (b.slab if with_slab else 0.0)
    (x0, y0), (x1, y1) = np.asarray(b.lower, float), np.asarray(b.upper, float)
    course = b.course or b.block
    boxes = {
        "x-": ((x0, y0), (x0 + t, y1)),
        "x+": ((x1 - t, y0), (x1, y1)),
        "y-": ((x0 + t, y0), (x1 - t, y0 + t)),
        "y+": ((x0 + t, y1 - t), (x1 - t, y1)),
    }
    preferred = ((x0 + t, x1 - t), (y0 + t, y1 - t), ())
    parts = []
    for side, (corner, opposite) in boxes.items():
        edges = (np.inf, b.block, course) if side[0] == "x" else (b.block, np.inf, course)
        name = f"{b.name}-wall{storey}{side}"
        low, high = np.array([*corner, foot]), np.array([*opposite, head])
        parts.append(_Part(name, "wall", low, high, edges, preferred))
    if with_slab:
        kind = "roof" if storey == b.storeys - 1 else "floor"
        low, high = np.array([x0, y0, head]), np.array([x1, y1, head + b.slab])
        parts.append(
            _Part(f"{b.name}-{kind}{storey}", kind, low, high, (b.block, b.block, np.inf), preferred)
        )
    return parts


def _wanted_blocks(part: _Part) -> float:
    """Approximate number of blocks of a wall or slab without openings."""
    return math.prod(pieces(h - l, edge) for l, h, edge in zip(part.low, part.high, part.edges))


def _part_blocks(part: _Part, b: Building) -> list[Block]:
    openings = [o for o in b.openings if o.meets(part.low, part.high)]
    x, y, z = (_part_cuts(part, axis, openings) for axis in range(3))
    found = []
    for i, j, k in np.ndindex(len(x) - 1, len(y) - 1, len(z) - 1):
        low, high = np.array([x[i], y[j], z[k]]), np.array([x[i + 1], y[j + 1], z[k + 1]])
        centre = 0.5 * (low + high)
        if not any(o.holds(centre) for o in openings):
            name = f"{part.name}-{i}-{j}-{k}"
            found.append(
                Block(name, centre, size=high - low, density=b.density, group=part.group, material=b.material)
            )
    return found


def _part_cuts(part: _Part, axis: int, openings: list[Opening]) -> Array:
    """Cuts of a part along an axis: its ends, the borders of openings, preferred cuts, and equal blocks between."""
    low, high, edge = part.low[axis], part.high[axis], part.edges[axis]
    size = min(edge, high - low)
    borders = [c for o in openings for c in (o.lower[axis], o.upper[axis]) if low < c < high]
    fixed = _apart([low, high, *borders], SAME * size)
    preferred = [c for c in part.preferred[axis] if low < c < high and np.abs(fixed - c).min() > CLOSE * size]
    ends = _apart([*fixed, *preferred], SAME * size)
    pieces = [equal_cuts(start, end, edge)[:-1] for start, end in pairwise(ends)]
    return np.concatenate([*pieces, [high]])


def _apart(cuts, distance: float) -> Array:
    """Sorted cuts without those within `distance` of the one before."""
    cuts = np.sort(np.asarray(cuts, float))
    return cuts[np.concatenate([[True], np.diff(cuts) > distance])]
