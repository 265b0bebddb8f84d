"""A mesh whose boundary is the bed: columns of nodes over a lattice in x and y, from the bed to a level lid.

    mesh = fitted_mesh((0, 0, -2), (40, 20, 3), 0.5, lambda x, y: -2.0 + 0.1 * x).mesh

Layers.  The nodes of a column lie at the heights f + k dz, k = 0, 1, ..., between the bed b and the lid, and on both.
f is the largest function not above the bed whose slope along x and y is at most `follow`: where the bed is no steeper,
f = b and the layers follow it with bricks of the usual height that are only sheared; a steeper bed cuts through the
layers, and the lowest cell of each column is made 0.5 to 1.5 dz high.  So no cell is ever flatter than half a brick,
however shallow the water.  follow = 0 gives level layers.  With `thinnest` below 1 the layers are compressed between
bed and lid, down to that share of dz, so that there are as many over the shore as over deep water; this serves run-up a
few cells high.

Cells.  Over each triangle of the lattice a surface through one node of each column climbs from the bed to the lid;
whenever it rises by one node in one column, it passes over a tetrahedron.  The column whose next edge has the lowest
middle goes first: on the wall between two columns this gives the shorter diagonal, and since one order holds for all
columns, both sides of the wall choose the same one.  So the mesh is conforming for any heights, and whole bricks fall
into Kuhn's six tetrahedra (`bricks.py`).

Where the bed is within half a layer of the lid there is no room for water: triangles of the lattice with three
such corners are left out, at others the bed is lowered to one layer below the lid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array
from fluid.mesh.background import Background, MeshError
from kernels.decorators import helper, kernel

FOLLOW = 0.2
"""Steepest slope that layers follow: one in five. With more shear, disturbances of still water at a shore grow (by 0.01
a step at one in two)."""
NEAREST = 0.5
"""Least height of a cell at bed or lid, in layers."""
STEEPEST = 3.0
"""Rise of the bed from one column to the next over their distance beyond which it is refused."""
MOST_SLENDER_BRICK = 8.0
"""Longest over shortest edge of a brick beyond which it is refused."""


@dataclass(frozen=True)
class FittedMesh:
    """mesh: Background · on_bed (N,) bool, nodes on the bed · bed_face (B,) bool, faces of the boundary on it ·
    column_x (nx,), column_y (ny,) [m] and bed (nx, ny) [m], heights of the nodes on it (NaN where a column has none) ·
    layer [m], height of a brick · steepest, largest slope of the bed between columns beside each other, at
    steepest_at (2,) [m] · lowered: columns whose bed was taken down to one layer below the lid · lattice (N, 3): places
    of the nodes in bricks of edge 1, for `refinement.py`."""

    mesh: Background
    on_bed: Array
    bed_face: Array
    column_x: Array
    column_y: Array
    bed: Array
    layer: float
    steepest: float
    steepest_at: tuple[float, float]
    lowered: int
    lattice: Array


def fitted_mesh(
    lower,
    upper,
    cell_size,
    bed,
    axes=None,
    follow: float = FOLLOW,
    split: str = "kuhn",
    thinnest: float = 1.0,
) -> FittedMesh:
    """Mesh of the space between a bed and the upper side of a box.

    lower, upper (3,) [m]: corners of the box; the bed may lie below or above lower[2], which is not used ·
    cell_size [m], one number or (3,): wanted edges of the bricks, adjusted so that a whole number of them fits ·
    bed(x, y) → z [m], elevation at coordinates (n,), (n,) [m] → (n,), or the elevations (nx, ny) of the columns ·
    axes: (x, y), two increasing arrays [m] of the columns instead of evenly spaced ones · follow, thinnest, split:
    see above and `bricks.py`.

    Raises MeshError: for a bed that is not finite, steeper than STEEPEST between two columns (with the place), or
    nowhere below the lid; for bricks more slender than MOST_SLENDER_BRICK; for extents that are not positive."""
    lower, upper = np.asarray(lower, float), np.asarray(upper, float)
    size = np.broadcast_to(np.asarray(cell_size, float), (3,))
    if np.any(size <= 0.0) or np.any(upper[:2] <= lower[:2]):
        raise MeshError(f"box {lower} to {upper} with cell size {cell_size}: all extents must be positive")
    if split not in ("kuhn", "mirrored"):
        raise MeshError(f"split {split!r} of the bricks: must be one of kuhn, mirrored")
    x, y = _columns(lower, upper, size) if axes is None else (np.asarray(a, float) for a in axes)
    heights = _heights(bed, x, y)
    lid, thin = float(upper[2]), thinnest * size[2]
    above = _at_lid(heights, lid, NEAREST * thin)
    kept = np.where(above, np.minimum(heights, lid - thin), heights)
    used = _used_columns(above)
    steepest, place = _steepest(kept, used, x, y)
    _refuse_steep(steepest, place)
    layer = _layer(kept[used].min(), lid, size[2])
    base = _envelope(np.where(used, kept, np.inf), x, y, follow)
    layers = np.where(used, _squeezed(base, lid, kept[used].min(), layer, thinnest), layer)
    _refuse_slender(x, y, layers)
    columns = _Columns.of(kept, base, lid, layers, used, x, y)
    cells = _cells(*columns.of_cells(), ~above, split == "mirrored")
    z = np.linspace(kept[used].min(), lid, round((lid - kept[used].min()) / layer) + 1)
    mesh = Background.from_arrays(columns.nodes, cells, (x, y, z), straddling=True, lattice=columns.lattice())
    on_bed = np.zeros(len(columns.nodes), bool)
    on_bed[columns.start[:-1][used.ravel()]] = True
    bed_face = np.all(on_bed[mesh.boundary_faces], axis=1)
    return FittedMesh(
        mesh=mesh,
        on_bed=on_bed,
        bed_face=bed_face,
        column_x=x,
        column_y=y,
        bed=np.where(used, kept, np.nan),
        layer=layer,
        steepest=steepest,
        steepest_at=place,
        lowered=int((above & used).sum()),
        lattice=columns.lattice(),
    )


def _at_lid(heights, lid: float, nearest: float):
    """(nx, ny) bool: columns whose bed reaches to within `nearest` [m] of the lid. Raises MeshError if all do."""
    if not heights.min() < lid - nearest:
        raise MeshError(
            f"the bed is nowhere lower than {lid - nearest:g} m, half a cell below the upper side at "
            f"{lid:g} m: raise upper, or check the datum and the units of the bed"
        )
    return heights > lid - nearest


def _refuse_steep(steepest: float, place) -> None:
    """Raises MeshError for a bed that no mesh can follow, with the place (2,) [m] where it is steepest."""
    if steepest > STEEPEST:
        raise MeshError(
            f"the bed rises by {steepest:.3g} m per metre between columns at ({place[0]:.4g}, {place[1]:.4g}) m; up to "
            f"{STEEPEST:g} a mesh can follow it: smooth it, or make what is steeper a solid"
        )


@dataclass(frozen=True)
class _Columns:
    """nodes (N, 3) [m], those of column i ny + j from start[i ny + j] upwards · height (N,) in layers over the base."""

    nodes: Array
    height: Array
    start: Array
    shape: tuple[int, int]

    @classmethod
    def of(cls, bed, base, lid, layer, used, x, y) -> _Columns:
        low, high = (bed - base) / layer, (lid - base) / layer
        first, last = np.floor(low + NEAREST) + 1.0, np.ceil(high - NEAREST) - 1.0
        # whole numbers of layers stay whole, up to the round-off of the heights
        first = np.where(np.abs(low - np.rint(low)) < 1e-9, np.rint(low) + 1.0, first)
        last = np.where(np.abs(high - np.rint(high)) < 1e-9, np.rint(high) - 1.0, last)
        between = np.maximum(0.0, last - first + 1.0).astype(np.int64)
        count = np.where(used, between + 2, 0).ravel()
        start = np.concatenate([[0], np.cumsum(count)])
        column = np.repeat(np.arange(len(count)), count)
        rank = np.arange(start[-1]) - start[column]
        height = first.ravel()[column] + rank - 1.0
        height = np.where(rank == 0, low.ravel()[column], height)
        is_lid = rank == count[column] - 1
        height = np.where(is_lid, high.ravel()[column], height)
        z = base.ravel()[column] + layer.ravel()[column] * height
        z = np.where(rank == 0, bed.ravel()[column], np.where(is_lid, lid, z))
        nodes = np.column_stack([x[column // len(y)], y[column % len(y)], z])
        height = np.where(np.abs(height - np.rint(height)) < 1e-9, np.rint(height), height)
        return cls(nodes, height, start, bed.shape)

    def lattice(self):
        """Places (N, 3) of the nodes in bricks of edge 1."""
        column = np.repeat(np.arange(len(self.start) - 1), np.diff(self.start))
        return np.column_stack([column // self.shape[1], column % self.shape[1], self.height]).astype(float)

    def of_cells(self):
        """The first arguments of `_cells`."""
        return self.height, self.start, *self.shape


def _columns(lower, upper, size):
    count = np.maximum(1.0, np.rint((upper - lower)[:2] / size[:2]))
    if not np.prod(count) < 1e8:
        raise MeshError(f"box {lower} to {upper} with cell size {size}: {np.prod(count):.3g} columns")
    return [np.linspace(lower[k], upper[k], int(count[k]) + 1) for k in range(2)]


def _heights(bed, x, y):
    """Elevations (nx, ny) [m] of the bed at the columns."""
    if callable(bed):
        grid = np.meshgrid(x, y, indexing="ij")
        bed = np.asarray(bed(grid[0].ravel(), grid[1].ravel()), float).reshape(len(x), len(y))
    bed = np.asarray(bed, float)
    if bed.shape != (len(x), len(y)):
        raise MeshError(f"elevations of shape {bed.shape} for {len(x)} x {len(y)} columns")
    holes = np.argwhere(~np.isfinite(bed))
    if len(holes):
        i, j = holes[0]
        raise MeshError(
            f"no elevation at ({x[i]:g}, {y[j]:g}) m, and at {len(holes) - 1} more columns: fill the holes"
        )
    return bed


def _used_columns(above):
    """(nx, ny) bool: columns of some brick with a corner that is not above the lid."""
    wanted = ~(above[:-1, :-1] & above[1:, :-1] & above[:-1, 1:] & above[1:, 1:])
    used = np.zeros(above.shape, bool)
    for i in (0, 1):
        for j in (0, 1):
            used[i : i + wanted.shape[0], j : j + wanted.shape[1]] |= wanted
    return used


def _steepest(bed, used, x, y):
    """Largest slope of the bed between columns beside each other, and its place (2,) [m]."""
    found, place = 0.0, (float(x[0]), float(y[0]))
    for axis, step in enumerate((x, y)):
        slope = np.abs(np.diff(bed, axis=axis)) / np.expand_dims(np.diff(step), 1 - axis)
        both = used[1:] & used[:-1] if axis == 0 else used[:, 1:] & used[:, :-1]
        slope = np.where(both, slope, 0.0)
        i, j = np.unravel_index(slope.argmax(), slope.shape)
        if slope[i, j] > found:
            found, place = float(slope[i, j]), (float(x[i]), float(y[j]))
    return found, place


def _layer(lowest, lid, wanted):
    return (lid - lowest) / max(1.0, np.rint((lid - lowest) / wanted))


def _squeezed(base, lid, lowest, layer, thinnest):
    """Heights (nx, ny) [m] of the layers over each column."""
    count = np.rint((lid - lowest) / layer)
    return np.clip((lid - base) / count, thinnest * layer, layer)


def _refuse_slender(x, y, layers):
    """Raise MeshError where a brick is too slender; layers (nx, ny) [m]."""
    dx, dy = np.meshgrid(np.diff(x), np.diff(y), indexing="ij")
    dz = [layers[i : i + len(x) - 1, j : j + len(y) - 1] for i in (0, 1) for j in (0, 1)]
    edges = np.array([dx, dy, *dz])
    ratio = edges.max(axis=0) / edges.min(axis=0)
    i, j = np.unravel_index(ratio.argmax(), ratio.shape)
    if ratio[i, j] > MOST_SLENDER_BRICK:
        raise MeshError(
            f"bricks of {dx[i, j]:.3g} x {dy[i, j]:.3g} x {edges[2:, i, j].min():.3g} m at ({x[i]:.4g}, {y[j]:.4g}) m "
            f"are more slender than {MOST_SLENDER_BRICK:g} to 1: choose cell sizes that are more alike"
        )


@kernel
def _envelope(bed, x, y, most):
    """Largest function (nx, ny) ≤ bed whose slopes along x and y are at most `most`, by sweeps."""
    f = bed.copy()
    changed = True
    while changed:
        changed = False
        for sweep in range(4):
            for a in range(f.shape[0]):
                i = a if sweep % 2 == 0 else f.shape[0] - 1 - a
                for b in range(f.shape[1]):
                    j = b if sweep < 2 else f.shape[1] - 1 - b
                    least = f[i, j]
                    if i > 0:
                        least = min(least, f[i - 1, j] + most * (x[i] - x[i - 1]))
                    if i + 1 < f.shape[0]:
                        least = min(least, f[i + 1, j] + most * (x[i + 1] - x[i]))
                    if j > 0:
                        least = min(least, f[i, j - 1] + most * (y[j] - y[j - 1]))
                    if j + 1 < f.shape[1]:
                        least = min(least, f[i, j + 1] + most * (y[j + 1] - y[j]))
                    if least < f[i, j]:
                        f[i, j] = least
                        changed = True
    return f


@kernel
def _cells(height, start, nx, ny, below, mirrored):
    """Cells (M, 4) over all triangles of the lattice with a corner below the lid, below (nx, ny) bool."""
    cells = np.empty((6 * max(1, height.shape[0]), 4), np.int64)
    n = 0
    corner, rank = np.empty(3, np.int64), np.empty(3, np.int64)
    for i in range(nx - 1):
        for j in range(ny - 1):
            flip_x, flip_y = mirrored and i % 2 == 1, mirrored and j % 2 == 1
            for half in range(2):
                some = False
                for c in range(3):
                    # 00, 10, 11 and 00, 01, 11: the diagonal from 00 to 11 in both
                    p = 0 if c == 0 or (c == 1 and half == 1) else 1
                    q = 0 if c == 0 or (c == 1 and half == 0) else 1
                    rank[c] = p + q
                    a, b = i + (1 - p if flip_x else p), j + (1 - q if flip_y else q)
                    corner[c] = a * ny + b
                    some = some or below[a, b]
                if some:
                    n = _climb(height, start, corner, rank, mirrored, cells, n)
    return cells[:n].copy()


@helper
def _climb(height, start, corner, rank, mirrored, cells, n):
    """Tetrahedra between the three columns corner (3,), written from row n on → the next free row."""
    at, end = np.empty(3, np.int64), np.empty(3, np.int64)
    for c in range(3):
        at[c], end[c] = start[corner[c]], start[corner[c] + 1] - 1
    while True:
        best, lowest = -1, 0.0
        for c in range(3):
            if at[c] == end[c]:
                continue
            middle = 0.5 * (height[at[c]] + height[at[c] + 1])
            if best < 0 or middle < lowest:
                best, lowest = c, middle
            elif middle == lowest:
                down = mirrored and np.floor(middle) % 2 == 1.0
                if (rank[c] < rank[best]) if down else (rank[c] > rank[best]):
                    best = c
        if best < 0:
            return n
        cells[n, 0], cells[n, 1], cells[n, 2], cells[n, 3] = at[0], at[1], at[2], at[best] + 1
        at[best] += 1
        n += 1
