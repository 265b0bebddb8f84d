"""The bodies of a random scene: fixed solids and blocks, each in its own section of the tank, so that none overlap."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from coupler.commands.stress.drawn.dice import Dice, rounded

DRUM = 1.2
"""Diameter of a drum of five corners or more over the least width of its face, at most."""
MARGIN = 0.1
"""Share of a slot left free at each of its ends."""
SMALLEST, LARGEST = 0.3, 6.0
"""Edges of blocks over a cell."""


@dataclass
class Slot:
    """Room for one body or group: corners low, high (3,) [m], the lower one on the floor; least [m]: least width of the
    faces that its blocks join, as far as it has room for that."""

    low: np.ndarray
    high: np.ndarray
    cell: float
    least: float = 0.0

    @property
    def size(self) -> np.ndarray:
        """Edges (3,) [m]."""
        return self.high - self.low

    @property
    def middle(self) -> np.ndarray:
        """Centre (3,) [m]."""
        return 0.5 * (self.low + self.high)

    def edges(self, dice: Dice) -> np.ndarray:
        """Edges (3,) [m] of a box that fits, 0.3 to 6 cells."""
        drawn = [max(self.least, self.cell * dice.decades(SMALLEST, LARGEST)) for _ in range(3)]
        return np.minimum(drawn, 0.85 * self.size)


@dataclass
class Bodies:
    """tables: [structure] without its own values, by kind · solids · files by name · names of single blocks with the
    room above them [m] · smallest, largest [m]: edges of blocks · narrowest [m]: about the least width of a face that
    may be joined; least [m]: that asked for · count: of blocks · tallest [m]: pile of blocks"""

    tables: dict[str, list[dict]] = field(default_factory=dict)
    solids: list[dict] = field(default_factory=list)
    files: dict[str, object] = field(default_factory=dict)
    singles: list[tuple[str, float]] = field(default_factory=list)
    groups: list[str] = field(default_factory=list)
    smallest: float = np.inf
    narrowest: float = np.inf
    least: float = 0.0
    largest: float = 0.0
    tallest: float = 0.0
    count: int = 0

    @property
    def wide(self) -> bool:
        """Whether a width was asked for, and every face that may be joined has it."""
        return 0.0 < self.least <= self.narrowest < np.inf

    def add(
        self, kind: str, table: dict, edges, count: int, height: float, width: float | None = None
    ) -> None:
        """Add a table of [structure] whose blocks have these edges [m] and are piled up to a height [m]; width [m]: of
        the faces that they join, that of their least edge if absent."""
        self.tables.setdefault(kind, []).append(table)
        self.narrowest = min(self.narrowest, min(map(float, edges)) if width is None else width)
        self.groups.append(table["name"])
        self.smallest = min(self.smallest, *map(float, edges))
        self.largest = max(self.largest, *map(float, edges))
        self.tallest = max(self.tallest, float(height))
        self.count += count


def slots(dice: Dice, low, high, cell: float, floor, count: int, least: float = 0.0) -> list[Slot]:
    """`count` rooms side by side along the longer of x and y; floor(low, high) [m]: height of the ground below one ·
    least [m]: as in Slot."""
    axis = 0 if high[0] - low[0] >= high[1] - low[1] else 1
    ends = np.linspace(low[axis], high[axis], count + 1)
    found = []
    for start, end in pairwise(ends):
        a, b = np.array(low, float), np.array(high, float)
        a[axis] = start + MARGIN * (end - start)
        b[axis] = end - MARGIN * (end - start)
        across = 1 - axis
        share = 0.0 if dice.chance(0.1) else dice.between(0.02, 0.2)
        a[across] += share * (high[across] - low[across])
        b[across] -= share * (high[across] - low[across])
        a[2] = floor(a, b)
        if b[2] - a[2] > cell:
            found.append(Slot(a, b, cell, least))
    return found


def bodies(dice: Dice, rooms: list[Slot], with_blocks: bool, only: tuple[str, ...] | None = None) -> Bodies:
    """A solid or blocks for each room; only: the kinds that blocks may be."""
    found = Bodies()
    for k, room in enumerate(rooms):
        fixed = not with_blocks or (len(rooms) > 1 and dice.chance(0.2))
        if fixed:
            _solid(dice, room, found, k)
            continue
        kinds = {name: weight for name, (weight, _) in MAKERS.items() if only is None or name in only}
        MAKERS[dice.one(kinds)][1](dice, room, found, k)
    return found


def _listed(vector) -> list[float]:
    return [rounded(float(x), 8) for x in vector]


def _turn(dice: Dice) -> dict:
    return {"axis": dice.direction(), "angle": rounded(dice.between(0.0, 3.0), 4)}


def _hull(dice: Dice, edges) -> list[list[float]]:
    """Corners about the origin, all on an ellipsoid with these axes."""
    corners = [np.multiply(dice.direction(), 0.5 * np.asarray(edges)) for _ in range(dice.whole(8, 14))]
    return [_listed(point) for point in corners]


def _solid(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """A box, a turned one or a hull, on the floor or above it; or a wall across the room."""
    name, edges = f"solid{k}", room.edges(dice)
    kind = dice.one(["box", "box", "turned", "hull", "wall"])
    if kind == "wall":
        edges = room.size * [dice.between(0.05, 0.3), 1.0, dice.between(0.3, 0.9)]
    if kind in ("turned", "hull"):
        edges = edges * min(1.0, 0.95 * float(room.size.min() / np.linalg.norm(edges)))
    centre = room.middle.copy()
    centre[2] = room.low[2] + 0.5 * edges[2]
    if kind in ("turned", "hull"):
        centre[2] = dice.between(room.low[2], room.middle[2]) + 0.5 * edges[2]
    table: dict = {"name": name}
    if kind == "hull":
        table["vertices"] = [_listed(np.add(point, centre)) for point in _hull(dice, edges)]
    else:
        table |= {"centre": _listed(centre), "size": _listed(edges)}
    if kind == "turned":
        table["rotation"] = _turn(dice)
    found.solids.append(table)


def _block(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """One block: on the floor or in the air, rotated, moving or held."""
    edges = room.edges(dice)
    if dice.chance(0.15):
        edges[dice.whole(0, 2)] *= dice.between(0.05, 0.3)
    free = dice.chance(0.5)
    table: dict = {"name": f"block{k}"}
    if free:
        reach = float(np.linalg.norm(edges))
        edges = edges * min(1.0, 0.95 * float(room.size.min()) / reach)
        reach = 0.5 * float(np.linalg.norm(edges))
        centre = np.array([dice.between(a + reach, b - reach) for a, b in zip(room.low, room.high)])
        if dice.chance(0.4):
            table["rotation"] = _turn(dice)
    else:
        centre = room.middle.copy()
        centre[2] = room.low[2] + 0.5 * edges[2]
    if dice.chance(0.25) and free:
        table |= {"centre": _listed(centre), "vertices": _hull(dice, edges)}
    else:
        table |= {"centre": _listed(centre), "size": _listed(edges)}
    if dice.chance(0.1):
        table["fixed"] = True
    found.add("block", table, edges, 1, edges[2], np.inf if free else float(min(edges[:2])))
    found.singles.append((table["name"], float(room.high[2] - centre[2]) - float(np.linalg.norm(edges))))


def _stack(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """Boxes on one another, the upper ones smaller."""
    edges, z = room.edges(dice), float(room.low[2])
    count = dice.whole(2, 4)
    edges[2] = min(edges[2], 0.9 * room.size[2] / count)
    for i in range(count):
        centre = [room.middle[0], room.middle[1], z + 0.5 * edges[2]]
        table = {
            "name": f"stack{k}-{i}",
            "group": f"stack{k}",
            "centre": _listed(centre),
            "size": _listed(edges),
        }
        found.add("block", table, edges, 1, z + edges[2] - room.low[2], float(min(edges[:2])))
        z = centre[2] + 0.5 * edges[2]
        smaller = edges * [dice.between(0.5, 1.0), dice.between(0.5, 1.0), 1.0]
        edges = np.maximum(smaller, np.minimum(edges, [room.least, room.least, 0.0]))


def _wall(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """A wall across the room or along it, thick or thin."""
    cell = room.cell
    height = min(0.9 * room.size[2], cell * dice.between(1.5, 6.0))
    long = 0 if room.size[0] > room.size[1] and dice.chance(0.5) else 1
    thick = min(max(room.least, cell * dice.decades(0.2, 2.5)), 0.5 * room.size[1 - long])
    size = np.array([0.0, 0.0, height])
    size[long], size[1 - long] = room.size[long] * dice.one([1.0, 0.7]), thick
    counts = np.array([dice.whole(2, 6), dice.whole(1, 2), dice.whole(2, 5)])
    if long == 1:
        counts = counts[[1, 0, 2]]
    if room.least > 0.0:
        counts = np.clip((size / room.least).astype(int), 1, counts)
    lower = room.middle - 0.5 * size
    lower[2] = room.low[2]
    table = {
        "name": f"wall{k}",
        "lower": _listed(lower),
        "size": _listed(size),
        "block": _listed(size / counts),
    }
    if dice.chance(0.4) and room.least == 0.0:  # half a block long are the joints of a running bond
        table["bond"] = "running"
    found.add("wall", table, size / counts, int(np.prod(counts)), height)


def _building(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """Four walls and a roof, perhaps with a door."""
    size = np.minimum(room.size * 0.9, room.cell * dice.between(3.0, 7.0))
    wall = float(size.min()) * dice.between(0.06, 0.2)
    block = [float(size.max()) / dice.whole(2, 4), float(size[2]) / dice.whole(2, 3)]
    lower = room.middle - 0.5 * size
    lower[2] = room.low[2]
    table = {
        "name": f"building{k}",
        "lower": _listed(lower),
        "size": _listed(size),
        "wall_thickness": rounded(wall),
        "block": _listed(block),
    }
    if dice.chance(0.3):
        table["roof"] = False
    if dice.chance(0.5):
        door = (
            [rounded(0.3 * float(size[1])), 0.0],
            [rounded(0.3 * float(size[1])), rounded(0.5 * float(size[2]))],
        )
        table["opening"] = [{"wall": "x-", "lower": door[0], "size": door[1]}]
    found.add("building", table, [*block, wall], 40, float(size[2]))


def _column(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """Drums on one another, square or round, straight or tapered."""
    height = min(0.9 * room.size[2], room.cell * dice.between(2.0, 8.0))
    drawn = max(DRUM * room.least, room.cell * dice.between(0.7, 2.5))
    width = min(0.8 * float(room.size[:2].min()), drawn, height)
    drums = dice.whole(2, 6)
    foot = [room.middle[0], room.middle[1], room.low[2]]
    table = {"name": f"column{k}", "foot": _listed(foot), "height": rounded(height), "drums": drums}
    if dice.chance(0.5):
        table["size"] = _listed([width, width])
    else:
        table |= {"radius": rounded(0.5 * width), "sides": dice.whole(5, 10)}
        if dice.chance(0.4):
            table["top_radius"] = rounded(0.5 * width * dice.between(0.5, 0.95))
    narrow = width if "size" in table else 2.0 * table.get("top_radius", 0.5 * width) / DRUM
    found.add("column", table, [width, height / drums], drums, height, narrow)


def _arch(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """A ring of voussoirs on two held abutments."""
    along = 0 if room.size[0] > room.size[1] else 1
    length, width = 0.9 * float(room.size[along]), min(0.6 * float(room.size[1 - along]), 2.0 * room.cell)
    depth = 0.15 * float(room.size[2])
    span = min(0.6 * length, 0.9 * (float(room.size[2]) - depth))
    thickness, rise = span * dice.between(0.12, 0.25), span * dice.between(0.25, 0.5)
    abutment = 0.5 * (length - span)
    foot = [room.middle[0], room.middle[1], room.low[2] + depth]
    count = dice.whole(5, 11)
    table = {
        "name": f"arch{k}",
        "foot": _listed(foot),
        "span": rounded(span),
        "rise": rounded(rise),
        "thickness": rounded(thickness),
        "width": rounded(width),
        "voussoirs": count,
        "along": "xy"[along],
        "abutment": _listed([max(abutment, 1.1 * thickness), depth]),
    }
    found.add("arch", table, [thickness, width, 1.5 * span / count], count + 2, depth + rise + thickness)


def _rubble(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """Loose blocks scattered over the upper part of the room, of which they fill at most a tenth."""
    low = room.low + room.size * [0.0, 0.0, dice.between(0.0, 0.5)]
    size = 0.95 * (room.high - low)
    largest = min(room.cell * dice.decades(0.5, 3.0), 0.4 * float(size.min()))
    smallest = largest * dice.between(0.4, 1.0)
    count = max(1, min(dice.whole(3, 30), int(0.1 * np.prod(size) / (0.52 * largest**3))))
    table = {
        "name": f"rubble{k}",
        "lower": _listed(low),
        "size": _listed(size),
        "count": count,
        "diameter": _listed([smallest, largest]),
        "shape": dice.one(["polyhedra", "boxes", "mixed"]),
        "corners": dice.whole(6, 12),
        "seed": dice.whole(0, 999),
    }
    found.add("rubble", table, [0.4 * smallest, largest], count, largest, np.inf)


def _file(dice: Dice, room: Slot, found: Bodies, k: int) -> None:
    """Hexahedra or tetrahedra of a mesh file, whole faces on one another."""
    from fluid.mesh.background import box_mesh

    size = np.minimum(0.8 * room.size, room.cell * np.array([dice.between(1.5, 4.0) for _ in range(3)]))
    low = room.middle - 0.5 * size
    low[2] = room.low[2]
    counts = [dice.whole(1, 2) for _ in range(3)]
    axes = [np.linspace(0.0, edge, n + 1) for edge, n in zip(size, counts)]
    name = f"blocks{k}.vtu"
    if dice.chance(0.5):
        mesh = box_mesh(None, None, axes=axes)
        found.files[name] = (np.array(mesh.nodes), "tetra", np.array(mesh.cells, np.int64))
        count = len(mesh.cells)
    else:
        found.files[name] = _bricks(axes)
        count = int(np.prod(counts))
    table = {"name": f"file{k}", "path": name, "offset": _listed(low)}
    found.add("file", table, size / np.array(counts) / 2.0, count, size[2])


def _bricks(axes) -> tuple:
    """Points and hexahedra of a grid."""
    n = [len(axis) for axis in axes]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    rows = np.arange(len(points)).reshape(n)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    parts = [rows[a : n[0] - 1 + a, b : n[1] - 1 + b, c : n[2] - 1 + c].ravel() for a, b, c in corners]
    return points, "hexahedron", np.stack(parts, axis=1)


MAKERS = {
    "block": (4.0, _block),
    "stack": (1.0, _stack),
    "wall": (1.5, _wall),
    "building": (0.7, _building),
    "column": (1.0, _column),
    "arch": (0.7, _arch),
    "rubble": (1.5, _rubble),
    "file": (0.7, _file),
}
"""Weight and maker of each kind of blocks."""
