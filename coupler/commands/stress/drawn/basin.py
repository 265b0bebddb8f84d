"""The tank of a random scene: a box of split bricks, a mesh from a file, or a terrain in a box or as the floor of the
mesh."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coupler.commands.stress.drawn.dice import Dice, rounded

SHAPES = {
    "slice": ((14, 26), (2, 2), (8, 14)),
    "channel": ((16, 28), (3, 6), (5, 9)),
    "flat": ((10, 16), (9, 14), (4, 7)),
    "tower": ((4, 8), (4, 8), (12, 20)),
    "cube": ((8, 12), (8, 12), (8, 12)),
}
"""Bricks along the axes, least and most."""
MOST_BRICKS = 1800
SIDES = ("x-", "x+", "y-", "y+")


@dataclass
class Basin:
    """The tank while the scene is drawn: lower, upper (3,) [m] · cell [m] · bed: heights of a terrain over the lower
    side [m] at raster points, None for a flat floor · table: [tank] · files: meshes that it names, by their names."""

    lower: np.ndarray
    upper: np.ndarray
    cell: float
    table: dict
    bed: tuple | None = None
    meshed: bool = False
    files: dict[str, object] = field(default_factory=dict)

    @property
    def size(self) -> np.ndarray:
        """Edges (3,) [m]."""
        return self.upper - self.lower

    def floor(self, low, high) -> float:
        """Height z [m] that no terrain passes between x, y of two corners."""
        if self.bed is None:
            return float(self.lower[2])
        x, y, height = self.bed
        near = (
            (x >= low[0] - np.diff(x).max()) & (x <= high[0] + np.diff(x).max()),
            (y >= low[1] - np.diff(y).max()) & (y <= high[1] + np.diff(y).max()),
        )
        return float(self.lower[2] + height[np.ix_(*near)].max())


def basin(dice: Dice, terrain: str) -> Basin:
    """A tank; terrain: "flat", "solids" (a bed of fixed wedges) or "mesh" (a mesh that follows the bed)."""
    cell = dice.decades(0.01, 3.0)
    counts = _bricks(dice, SHAPES[dice.one(list(SHAPES))])
    lower = np.zeros(3)
    if dice.chance(0.3):
        lower = np.array([rounded(cell * dice.between(-100.0, 100.0), 4) for _ in range(3)])
    size = np.array([cell * (n + (dice.between(-0.4, 0.4) if dice.chance(0.5) else 0.0)) for n in counts])
    upper = np.array([rounded(x, 7) for x in lower + size])
    found = Basin(lower, upper, cell, {})
    if terrain != "flat":
        found.bed = _bed(dice, found, along_nodes=dice.chance(0.3))
    kind = "file" if terrain == "mesh" or dice.chance(0.1) else "bricks"
    if kind == "file":
        _meshed(dice, found, counts, terrain == "mesh")
    else:
        found.table |= {"lower": lower.tolist(), "upper": upper.tolist(), "cell": cell}
        if dice.chance(0.35):
            found.table["split"] = "mirrored"
    return found


def terrain_solids(found: Basin) -> list[dict]:
    """The bed as fixed wedges, two a square of its raster, from a cell below the tank up."""
    x, y, height = found.bed
    foot = found.lower[2] - found.cell
    wedges = []
    for i in range(len(x) - 1):
        for j in range(len(y) - 1):
            square = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            for corners in ((0, 1, 2), (0, 2, 3)):
                own = [square[c] for c in corners]
                if max(height[a, b] for a, b in own) <= 0.0:
                    continue
                top = [[x[a], y[b], found.lower[2] + height[a, b]] for a, b in own]
                points = [*top, *([px, py, foot] for px, py, _ in top)]
                wedges.append([[rounded(v, 8) for v in point] for point in points])
    return [{"name": f"bed{k}", "vertices": points} for k, points in enumerate(wedges)]


def _bricks(dice: Dice, shape) -> list[int]:
    counts = [dice.whole(*ends) for ends in shape]
    while np.prod(counts) > MOST_BRICKS:
        counts[int(np.argmax(counts))] -= 1
    if dice.chance(0.5):
        counts[0], counts[1] = counts[1], counts[0]
    return counts


def _bed(dice: Dice, found: Basin, along_nodes: bool) -> tuple:
    """x (n,), y (m,) [m] and heights (n, m) [m]: a slope or a beach with bumps, up to half of the tank; along_nodes:
    at multiples of a cell, so that the bed passes through nodes of the mesh."""
    axes = []
    for axis in range(2):
        cells = found.size[axis] / found.cell
        points = max(2, min(6, round(cells / dice.between(2.0, 5.0)))) + 1
        axes.append(np.linspace(found.lower[axis], found.upper[axis], points))
    x, y = axes
    across = (x[:, None] - x[0]) / found.size[0], (y[None, :] - y[0]) / found.size[1]
    slope = dice.between(0.0, 0.5) * (across[0] if dice.chance(0.7) else across[1])
    height = np.clip(slope - dice.between(0.0, 0.15), 0.0, None) + np.zeros((len(x), len(y)))
    bumps = np.array([[dice.between(0.0, 0.12) for _ in y] for _ in x])
    height = (height + bumps) * found.size[2]
    if along_nodes:
        height = found.cell * np.rint(height / found.cell)
    return x, y, height


def _meshed(dice: Dice, found: Basin, counts: list[int], follows_bed: bool) -> None:
    """The tank as a file of tetrahedra: bricks of unequal width, with nodes inside moved a little, or layers over the
    bed."""
    from fluid.mesh.background import box_mesh

    axes = []
    for axis, n in enumerate(counts):
        widths = np.array([dice.between(1.0, 2.0) for _ in range(n)])
        ends = np.concatenate([[0.0], np.cumsum(widths)]) / widths.sum()
        axes.append(found.lower[axis] + found.size[axis] * ends)
    mesh = box_mesh(None, None, axes=axes, split=dice.one(["kuhn", "mirrored"]))
    nodes, cells = np.array(mesh.nodes), np.array(mesh.cells, np.int64)
    if follows_bed:
        nodes[:, 2] = _over_bed(nodes, found)
    elif dice.chance(0.5):
        inside = np.all((nodes > found.lower + 1e-9) & (nodes < found.upper - 1e-9), axis=1)
        least = min(float(np.diff(axis).min()) for axis in axes)
        shift = np.array([[dice.between(-0.15, 0.15) for _ in range(3)] for _ in range(int(inside.sum()))])
        nodes[inside] += least * shift.reshape(-1, 3)
    name = dice.one(["tank.vtu", "tank.vtk", "tank.msh"])
    found.files[name] = (nodes, "tetra", cells)
    found.table["mesh"] = name
    found.meshed = True


def _over_bed(nodes, found: Basin):
    """z (N,) [m] of the nodes when the layers between bed and lid share the height."""
    from scipy.interpolate import RegularGridInterpolator

    x, y, height = found.bed
    places = np.clip(nodes[:, :2], [x[0], y[0]], [x[-1], y[-1]])  # ends differ in the last digit
    bed = found.lower[2] + RegularGridInterpolator((x, y), height)(places)
    share = (nodes[:, 2] - found.lower[2]) / found.size[2]
    return bed + share * (found.upper[2] - bed)
