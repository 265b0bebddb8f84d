"""Generators of blocks: wall in stack or running bond, column, and a building with openings, floors and roof.

All are lists of box blocks that touch face to face, so that `touching_faces` finds the joints. Blocks are cut to fit:
a length is divided into the nearest whole number of equal blocks.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from yade_scripts.blocks import Block, BlockError

Array = np.ndarray


@dataclass(frozen=True)
class Opening:
    """A door or window: whole blocks are left out where their centre lies in the box lower (3,) .. upper (3,) [m]."""

    lower: Array
    upper: Array

    def holds(self, point: Array) -> bool:
        return bool(np.all(point > np.asarray(self.lower)) and np.all(point < np.asarray(self.upper)))


@dataclass(frozen=True)
class Building:
    """lower, upper (2,) [m]: footprint, outer faces · height [m] to the top of the walls · base [m]: level it stands on

    thickness [m] of walls, floors and roof · block: edge of a block along walls and slabs [m]
    course: height of a block in the walls [m] (None: as `block`)
    storeys: number of storeys (slabs between them) · roof: slab on top · openings: doors and windows
    density [kg/m³].
    """

    lower: Array
    upper: Array
    height: float
    thickness: float
    block: float
    course: float | None = None
    storeys: int = 1
    roof: bool = True
    base: float = 0.0
    density: float = 2400.0
    openings: tuple[Opening, ...] = field(default_factory=tuple)
    name: str = "building"

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
        if self.storeys < 1 or self.storey_height <= self.thickness:
            raise BlockError(
                f"building '{self.name}': {self.storeys} storeys in {self.height} m leave no wall "
                f"between slabs of {self.thickness} m"
            )

    @property
    def storey_height(self) -> float:
        """From the foot of one storey to the foot of the next [m]."""
        return self.height / self.storeys


def building_blocks(b: Building) -> list[Block]:
    """Walls, floor slabs and roof of a building.

    Slabs lie on the walls, over the whole footprint, and take the top `thickness` of their storey; corner piers belong
    to the walls along y, so walls along x fit between them. Slab blocks share the wall's grid: joints are full faces.
    """
    blocks: list[Block] = []
    for s in range(b.storeys):
        foot = b.base + s * b.storey_height
        with_slab = b.roof or s < b.storeys - 1
        head = foot + b.storey_height - (b.thickness if with_slab else 0.0)
        blocks += _storey_walls(b, s, foot, head)
        if with_slab:
            name = "roof" if s == b.storeys - 1 else "floor"
            blocks += _slab(b, s, name, head)
    return blocks


def _cuts(low: float, high: float, edge: float) -> Array:
    """Ends of equal blocks between low and high, none longer than about `edge`."""
    return np.linspace(low, high, max(1, round((high - low) / edge)) + 1)


def _grid(b: Building) -> tuple[Array, Array]:
    """Cuts of the footprint along x and y: wall thickness at the ends, equal blocks between."""
    t = b.thickness
    axes = []
    for k in range(2):
        low, high = float(b.lower[k]), float(b.upper[k])
        axes.append(np.concatenate([[low], _cuts(low + t, high - t, b.block), [high]]))
    return axes[0], axes[1]


def _storey_walls(b: Building, storey: int, foot: float, head: float) -> list[Block]:
    x, y = _grid(b)
    z = _cuts(foot, head, b.course or b.block)
    last_x, last_y = len(x) - 2, len(y) - 2
    cells = [
        (i, j) for i in range(last_x + 1) for j in range(last_y + 1) if i in (0, last_x) or j in (0, last_y)
    ]
    return _boxes(b, f"{b.name}-wall{storey}", "wall", x, y, z, cells)


def _slab(b: Building, storey: int, kind: str, foot: float) -> list[Block]:
    x, y = _grid(b)
    cells = [(i, j) for i in range(len(x) - 1) for j in range(len(y) - 1)]
    return _boxes(b, f"{b.name}-{kind}{storey}", kind, x, y, np.array([foot, foot + b.thickness]), cells)


def _boxes(b: Building, name: str, group: str, x: Array, y: Array, z: Array, cells: Iterable) -> list[Block]:
    found = []
    for i, j in cells:
        for k in range(len(z) - 1):
            low, high = np.array([x[i], y[j], z[k]]), np.array([x[i + 1], y[j + 1], z[k + 1]])
            centre = 0.5 * (low + high)
            if not any(o.holds(centre) for o in b.openings):
                found.append(
                    Block(f"{name}-{i}-{j}-{k}", centre, size=high - low, density=b.density, group=group)
                )
    return found


def wall_blocks(
    name: str,
    start,
    along,
    length: float,
    height: float,
    thickness: float,
    block: float,
    course: float,
    bond: str = "stack",
    density: float = 2400.0,
) -> list[Block]:
    """A straight wall. start (3,) [m]: lower corner on its centre line · along: 'x' or 'y' · course: block height [m]

    bond: "stack" (joints in line) or "running" (every other course shifted by half a block, half blocks at the ends).
    """
    if bond not in ("stack", "running"):
        raise BlockError(f"wall '{name}': bond = {bond!r}; it must be 'stack' or 'running'")
    if along not in ("x", "y"):
        raise BlockError(f"wall '{name}': along = {along!r}; it must be 'x' or 'y'")
    axis = 0 if along == "x" else 1
    levels = _cuts(0.0, height, course)
    regular = _cuts(0.0, length, block)
    half = 0.5 * (regular[1] - regular[0])
    shifted = np.concatenate([[0.0], regular[:-1] + half, [length]])
    blocks = []
    for k in range(len(levels) - 1):
        cuts = shifted if bond == "running" and k % 2 else regular
        for i in range(len(cuts) - 1):
            centre, size = np.array(start, float), np.full(3, thickness)
            centre[axis] += 0.5 * (cuts[i] + cuts[i + 1])
            centre[2] += 0.5 * (levels[k] + levels[k + 1])
            size[axis], size[2] = cuts[i + 1] - cuts[i], levels[k + 1] - levels[k]
            blocks.append(Block(f"{name}-{k}-{i}", centre, size=size, density=density, group="wall"))
    return blocks


def column_blocks(name: str, foot, size, count: int, density: float = 2400.0) -> list[Block]:
    """`count` equal blocks `size` (3,) [m] on one another, the first standing on foot (3,) [m]."""
    size = np.asarray(size, float)
    rise = np.array([0.0, 0.0, size[2]])
    return [
        Block(
            f"{name}-{k}",
            np.asarray(foot, float) + (k + 0.5) * rise,
            size=size,
            density=density,
            group="column",
        )
        for k in range(count)
    ]


def divided_box(name: str, lower, size, block, density: float = 2400.0, group: str = "wall") -> list[Block]:
    """A box lower (3,) + size (3,) [m] divided into equal blocks of edges near `block` (3,) [m], in stack bond."""
    lower, size = np.asarray(lower, float), np.asarray(size, float)
    x, y, z = (_cuts(a, a + s, edge) for a, s, edge in zip(lower, size, block))
    found = []
    for i, j, k in np.ndindex(len(x) - 1, len(y) - 1, len(z) - 1):
        low, high = np.array([x[i], y[j], z[k]]), np.array([x[i + 1], y[j + 1], z[k + 1]])
        found.append(
            Block(f"{name}-{i}-{j}-{k}", 0.5 * (low + high), size=high - low, density=density, group=group)
        )
    return found
