"""The background (mathematical) mesh: tetrahedra that cover water, air and solids alike.

A cell with nodes x_0..x_3 carries the barycentric coordinates λ_a(x) = c_a + g_a·x, with the constant P1
gradients g_a = ∇N_a [1/m].  Neighbours are numbered by the opposite corner: neighbours[e, a] shares the
face of cell e that does not hold corner a; -1 means the boundary of the mesh.

Gradients are not stored: a table of the distinct shapes (`shapes.py`) serves the loops over all cells, and for a few
cells they are computed from the corners.  Temporary arrays are made for some cells at a time (`spans.py`).

Points are found through a lattice of bins (coordinate axes, graded allowed).  In a box mesh the bins are
the bricks that were split into tetrahedra; for any other mesh they are uniform boxes of one mean spacing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from skfem import MeshTet

from array_types import Array, Floats, Integers, Ints
from fluid.mesh.brick_sides import ALL, NONE, sides_of
from fluid.mesh.bricks import SPLITS, split_bricks
from fluid.mesh.gradients import gradient_rows, gradients, products_of
from fluid.mesh.neighbours import cell_neighbours
from fluid.mesh.shapes import Shapes
from fluid.numerics.cube_root import cube_root
from fluid.numerics.spans import spans
from kernels.decorators import inner, kernel

CORNERS_OF_FACE = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])  # outward for a positive cell
SAME_SIZE = 1e-9
"""Difference of sizes over the spacing that counts as round-off."""
IN_PLANE, ROUND_OFF = 1e-10, 16.0 * float(np.finfo(float).eps)
"""Shares of the spacing and of the largest coordinate in `Background.tolerance`."""
ALONG = 1e-9
"""Largest 1 - |n·e| of a face that counts as normal to an axis: round-off."""
STEEPEST_BED = 1.0
"""Largest slope of a side that counts as a bed on which water runs out thin; water on a steeper one ends on a wall."""
MOST_BRICKS = 3e8
"""Most bricks of a box: with more, the numbers of the tetrahedra, six a brick, exceed 32 bits."""


class MeshError(ValueError):
    """The background mesh cannot be used; the message names the cell or node and the remedy."""


@dataclass(frozen=True, kw_only=True)
class Background:
    """Tetrahedra with the data that every step needs.  Cells are positively oriented.

    nodes (N, 3) [m] · cells (M, 4) uint32 · spacing [m], mean edge of the equivalent brick (6 |e|)^(1/3) ·
    cell_volume (M,) [m³] · neighbours (M, 4) int32 ·
    boundary_faces (B, 3) · boundary_cell (B,) · boundary_normal (B, 3), outward, unit ·
    axes: three increasing arrays [m], the walls of the bins · bin_start, bin_cells: cells of each bin (CSR) ·
    sides (M,) uint8: which edges of a cell are sides of a brick (`brick_sides.py`).
    """

    nodes: Floats
    cells: Integers
    spacing: float
    cell_volume: Floats
    neighbours: Integers
    boundary_faces: Ints
    boundary_cell: Ints
    boundary_normal: Floats
    axes: tuple[Array, Array, Array]
    bin_start: Ints
    bin_cells: Integers
    sides: Integers

    @classmethod
    def from_arrays(cls, nodes, cells, axes=None, straddling: bool = False, lattice=None) -> Background:
        """A mesh of any tetrahedra: nodes (N, 3) [m], cells (M, 4).  Cells may have either orientation.

        axes: walls of bins such that no cell straddles two of them (a split brick lattice), or None · straddling: cells
        may straddle the bins of `axes` · lattice (N, 3): places of the nodes in bricks of edge 1, None: of no bricks.
        Raises MeshError for cells without volume or indices out of range."""
        nodes = np.ascontiguousarray(nodes, float)
        cells, volume = _oriented(nodes, _checked_cells(nodes, cells))
        neighbours = cell_neighbours(cells, len(nodes))
        faces, owner = _boundary(cells, neighbours)
        spacing = float(cube_root(6.0 * volume.mean()))
        in_bins = axes is not None and not straddling
        axes = _uniform_axes(nodes, spacing) if axes is None else tuple(np.asarray(a, float) for a in axes)
        start, members = _bins(nodes, cells, axes, in_bins)
        normal = _face_normals(nodes, faces)
        return cls(
            nodes=nodes,
            cells=cells,
            spacing=spacing,
            cell_volume=volume,
            neighbours=neighbours,
            boundary_faces=faces,
            boundary_cell=owner,
            boundary_normal=normal,
            axes=axes,
            bin_start=start,
            bin_cells=members,
            sides=np.zeros(len(cells), np.uint8) if lattice is None else sides_of(lattice, cells),
        )

    def locate(self, points) -> Array:
        """Cell that holds each point (m, 3) [m] → (m,), -1 outside; ties go to the first cell of the bin."""
        points = np.ascontiguousarray(np.atleast_2d(points), float)
        x, y, z = self.axes
        return _locate(points, x, y, z, self.bin_start, self.bin_cells, self.nodes, self.cells)

    @property
    def gradients(self) -> Array:
        """∇N_a (M, 4, 3) [1/m] of all cells, computed at each call unless cells share none (`Shapes`)."""
        shapes = self.shapes
        return shapes.gradients if shapes.is_of_each_cell else gradients(self.nodes, self.cells)[0]

    def gradients_of(self, cells) -> Array:
        """∇N_a (n, 4, 3) [1/m] of some cells (n,)."""
        return gradients(self.nodes, self.cells[cells])[0]

    @cached_property
    def bounds(self) -> Array:
        """(2, 3) [m] lowest and highest coordinates."""
        return np.array([self.nodes.min(axis=0), self.nodes.max(axis=0)])

    @cached_property
    def tolerance(self) -> float:
        """Distance [m] from a plane within which a node lies in it: a share of the spacing, and at least what round-off
        makes of it at the node farthest from zero. At map coordinates, millions of metres, that is more where cells
        are small."""
        return max(IN_PLANE * self.spacing, ROUND_OFF * float(np.abs(self.bounds).max()))

    @cached_property
    def cell_size(self) -> Array:
        """(M,) [m] edge of the brick that holds six such cells, (6 |e|)^(1/3)."""
        size = np.empty(len(self.cells))
        for some in spans(len(size)):
            size[some] = cube_root(6.0 * self.cell_volume[some])
        return size

    @cached_property
    def local_size(self) -> Array:
        """(M,) [m] `cell_size`; exactly the spacing where the two differ by round-off only, as in a box of equal
        bricks, for which one number is stored."""
        size, h = self.cell_size, self.spacing
        if all((np.abs(size[some] - h) <= SAME_SIZE * h).all() for some in spans(len(size))):
            return np.broadcast_to(h, size.shape)
        return np.where(np.abs(size - h) <= SAME_SIZE * h, h, size)

    @cached_property
    def node_size(self) -> Array:
        """Smallest `local_size` (N,) [m] of the cells around each node: the length scale of everything near the
        node."""
        if self.local_size.strides == (0,):
            return np.full(len(self.nodes), self.spacing)
        size = np.full(len(self.nodes), np.inf)
        np.minimum.at(size, self.cells.ravel(), np.repeat(self.local_size, 4))
        return np.where(np.isfinite(size), size, self.spacing)

    def size_at(self, points) -> Array:
        """(m,) [m] `local_size` of the cells that hold points (m, 3) [m]; outside the mesh the least size of all."""
        cell = self.locate(points)
        return np.where(cell >= 0, self.local_size[cell], self.finest)

    @cached_property
    def slanting(self) -> Array:
        """(N,) bool: nodes of boundary faces that are normal to no axis, such as those of a bed."""
        along = np.abs(self.boundary_normal).max(axis=1) > 1.0 - ALONG
        found = np.zeros(len(self.nodes), bool)
        found[self.boundary_faces[~along]] = True
        return found

    @cached_property
    def sloping_bed(self) -> Array:
        """(N,) bool: nodes of slanting boundary faces that look down and are no steeper than STEEPEST_BED."""
        down = -self.boundary_normal[:, 2]
        found = np.zeros(len(self.nodes), bool)
        found[self.boundary_faces[(down < 1.0 - ALONG) & (down > 1.0 / np.hypot(1.0, STEEPEST_BED))]] = True
        return found

    @cached_property
    def finest(self) -> float:
        """Least size of a cell [m]."""
        return float(self.local_size.min())

    @cached_property
    def boundary_area(self) -> Array:
        """(B,) [m²] of the boundary faces."""
        x = self.nodes[self.boundary_faces]
        return 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)

    @cached_property
    def boundary_of_nodes(self) -> Array:
        """(N,) [m²] of the boundary faces, a third to each of their corners."""
        thirds = np.repeat(self.boundary_area / 3.0, 3)
        return np.bincount(self.boundary_faces.ravel(), thirds, minlength=len(self.nodes))

    @property
    def products(self) -> Array:
        """∇N_a·∇N_b (M, 6) [1/m²] of the pairs ab = 01, 02, 03, 12, 13, 23."""
        return products_of(self.gradients)

    @cached_property
    def obtuse(self) -> Array:
        """(M,) bool: some dihedral angle of the cell exceeds a right angle, ∇N_a·∇N_b > 0; this never occurs in
        `box_mesh`."""
        found = np.empty(len(self.cells), bool)
        for some in spans(len(found)):
            found[some] = products_of(self.gradients_of(some)).max(axis=1) * self.cell_size[some] ** 2 > 1e-9
        return found

    @cached_property
    def is_obtuse(self) -> bool:
        """Whether some cell is obtuse."""
        return bool(self.obtuse.any())

    @cached_property
    def along(self) -> Array:
        """(M,) uint8: along which edges of a cell volume passes, see `brick_sides.py`. On meshes without obtuse cells
        along ALL; on others along the sides of the bricks that cells are parts of, where they are known, and in other
        obtuse cells along NONE in particular, through the planes of their medians."""
        if not self.is_obtuse:
            return np.full(len(self.cells), ALL, np.uint8)
        return np.where(self.sides == NONE, np.where(self.obtuse, NONE, ALL), self.sides).astype(np.uint8)

    @cached_property
    def shapes(self) -> Shapes:
        """The distinct shapes of the cells (`Shapes`)."""
        return Shapes.of(self)

    @cached_property
    def plan(self) -> sp.csr_array:
        """(M, nx ny) share of each cell in each column of bins, number i ny + j: that of the rectangle around the cell
        in the plan. A cell that straddles no columns is in one of them."""
        return self._shares_along((0, 1))

    @cached_property
    def layers(self) -> sp.csr_array:
        """(M, nz) share of each cell in each layer of bins: that of the height of the box around it."""
        return self._shares_along((2,))

    def bin_volume(self, cells, volume) -> sp.csr_array:
        """(nx ny, nz) [m³] in the bins of each column of volumes (n,) [m³] of cells (n,), by `plan` and `layers`."""
        held = self.layers[cells]
        held.data *= np.repeat(volume, np.diff(held.indptr))
        return self.plan[cells].T.tocsr() @ held

    @cached_property
    def volume_of_bins(self) -> sp.csr_array:
        """`bin_volume` of all cells."""
        return self.bin_volume(np.arange(len(self.cells)), self.cell_volume)

    def _shares_along(self, along) -> sp.csr_array:
        """(M, bins) share of the box around each cell in each bin of the axes with the numbers `along`."""
        axes = [self.axes[k] for k in along]
        corners = (self.nodes[self.cells[some]][:, :, along] for some in spans(len(self.cells)))
        count, number, share = zip(*(_shares(axes, *_shrunk(c.min(axis=1), c.max(axis=1))) for c in corners))
        start = np.concatenate([[0], np.cumsum(np.concatenate(count))])
        shape = (len(self.cells), math.prod(len(axis) - 1 for axis in axes))
        return sp.csr_array((np.concatenate(share), np.concatenate(number), start), shape=shape)

    @cached_property
    def skfem(self) -> MeshTet:
        """The same mesh for scikit-fem (node and cell numbers unchanged)."""
        cells = self.cells.T.astype(np.int64)
        return MeshTet(self.nodes.T.copy(), cells, sort_t=False, validate=False)


def box_mesh(lower, upper, cell_size=None, axes=None, split: str = "kuhn") -> Background:
    """Box [lower, upper] (3,) [m] in bricks of about cell_size ((3,) or one number [m]), six cells each.

    axes: three increasing coordinate arrays instead (graded meshes); lower, upper and cell_size are then ignored.
    split: "kuhn" or "mirrored", see `bricks.py`.  Raises MeshError for extents that are not positive and for
    any other split."""
    if split not in SPLITS:
        raise MeshError(f"split {split!r} of the bricks: must be one of {', '.join(SPLITS)}")
    if axes is None:
        axes = _axes_of_box(np.asarray(lower, float), np.asarray(upper, float), cell_size)
    return Background.from_arrays(*split_bricks(axes, split), axes)


def _checked_cells(nodes, cells):
    cells = np.asarray(cells)
    if cells.ndim != 2 or cells.shape[1] != 4 or len(cells) == 0:
        raise MeshError(f"cells has shape {cells.shape}; tetrahedra need (M, 4) with M > 0")
    if cells.min() < 0 or cells.max() >= len(nodes):
        raise MeshError(f"cells name node {cells.max()} of {len(nodes)}; node numbers start at 0")
    return np.array(cells, np.uint32, order="C")


def _oriented(nodes, cells):
    """Swap two corners of the cells (M, 4) of negative volume, in place, and refuse flat ones; the cells and their
    volume (M,) [m³]."""
    volume = np.empty(len(cells))
    for some in spans(len(cells)):
        volume[some] = gradients(nodes, cells[some])[1]
    flat = np.flatnonzero(np.abs(volume) <= 1e-14 * np.abs(volume).max())
    if flat.size:
        raise MeshError(f"cell {flat[0]} (and {flat.size - 1} more) has no volume; remove or repair it")
    turned = volume < 0
    cells[turned, 2:] = cells[turned, 3:1:-1]
    return cells, np.abs(volume, out=volume)


def _boundary(cells, neighbours):
    cell, corner = np.nonzero(neighbours < 0)
    return cells[cell[:, None], CORNERS_OF_FACE[corner]].astype(np.int64), cell


def _face_normals(nodes, faces):
    x = nodes[faces]
    n = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    return n / np.linalg.norm(n, axis=1, keepdims=True)


def _axes_of_box(lower, upper, cell_size):
    if cell_size is None or np.any(np.asarray(cell_size) <= 0) or np.any(upper <= lower):
        raise MeshError(
            f"box {lower} to {upper} with cell size {cell_size}: all three extents must be positive"
        )
    count = np.maximum(1.0, np.rint((upper - lower) / cell_size))
    if not np.prod(count) < MOST_BRICKS:
        raise MeshError(f"box {lower} to {upper} with cell size {cell_size}: {np.prod(count):.3g} bricks")
    return [np.linspace(lower[k], upper[k], int(count[k]) + 1) for k in range(3)]


def _uniform_axes(nodes, spacing):
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    count = np.maximum(1, np.floor((high - low) / spacing).astype(int))
    return tuple(np.linspace(low[k], high[k], count[k] + 1) for k in range(3))


def _bins(nodes, cells, axes, lattice):
    """Cells of each bin as CSR: of the centroid in a lattice, otherwise all whose box reaches into the bin."""
    nx, ny, nz = (len(a) - 1 for a in axes)
    low, high = np.empty((len(cells), 3), np.int32), np.empty((0 if lattice else len(cells), 3), np.int32)
    for some in spans(len(cells)):
        x = nodes[cells[some]]
        corners = (x.mean(axis=1),) if lattice else _shrunk(x.min(axis=1), x.max(axis=1))
        for reach, corner in zip((low, high), corners):
            reach[some] = np.stack([bin_of(axes[k], corner[:, k]) for k in range(3)], axis=1)
    if not lattice:
        return _fill_bins(low.astype(np.int64), high.astype(np.int64), nx, ny, nz)
    bins = (low[:, 0].astype(np.int64) * ny + low[:, 1]) * nz + low[:, 2]
    start = np.concatenate([[0], np.cumsum(np.bincount(bins, minlength=nx * ny * nz))])
    return start, np.argsort(bins, kind="stable").astype(np.uint32)


def _shrunk(low, high):
    """Boxes (M, 3), (M, 3) less round-off, so that a cell that ends at a wall of the bins is in one of them only."""
    less = 1e-11 * (high - low)
    return low + less, high - less


def bin_of(axis, x) -> Array:
    """Number of the bin along one of the axes that holds each coordinate x (m,) [m]; beyond the ends, the nearest."""
    return np.clip(np.searchsorted(axis, x, side="right") - 1, 0, len(axis) - 2)


def _shares(axes, low, high):
    """Bins of one or two axes that the intervals or rectangles from low to high (n, axes) reach: count (n,), number
    (k,) of each bin, and share (k,) of its rectangle that lies in it."""
    first, last = (np.column_stack([bin_of(a, x[:, k]) for k, a in enumerate(axes)]) for x in (low, high))
    across = last - first + 1
    count = across.prod(axis=1)
    of = np.repeat(np.arange(len(low)), count)
    rank = np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)
    along = divmod(rank, across[of, -1])[-len(axes) :]
    at = [first[of, k] + steps for k, steps in enumerate(along)]
    area, number = np.ones(len(of)), np.zeros(len(of), np.int64)
    for k, axis in enumerate(axes):
        area *= np.minimum(high[of, k], axis[at[k] + 1]) - np.maximum(low[of, k], axis[at[k]])
        number = number * (len(axis) - 1) + at[k]
    return count, number.astype(np.int32), area / np.bincount(of, area, minlength=len(low))[of]


def _fill_bins(low, high, nx, ny, nz):
    """CSR of the bins [low, high] (M, 3) that each cell occupies: start (bins + 1,), cells."""
    span = high - low + 1
    count = span.prod(axis=1)
    cell = np.repeat(np.arange(len(low)), count)
    rank = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    sy, sz = span[cell, 1], span[cell, 2]
    i, j, k = low[cell, 0] + rank // (sy * sz), low[cell, 1] + rank // sz % sy, low[cell, 2] + rank % sz
    bin_of_entry = (i * ny + j) * nz + k
    order = np.argsort(bin_of_entry, kind="stable")
    start = np.concatenate([[0], np.cumsum(np.bincount(bin_of_entry, minlength=nx * ny * nz))])
    return start, cell[order].astype(np.uint32)


@inner
def smallest_barycentric(p, e, nodes, cells, g):
    """min_a λ_a of the point p (3,) in cell e: ≥ 0 inside; g (4, 3): work space."""
    gradient_rows(nodes, cells, e, g)
    lowest = 1.0
    last = 1.0
    for a in range(1, 4):
        lam = 0.0
        for k in range(3):
            lam += g[a, k] * (p[k] - nodes[cells[e, 0], k])
        last -= lam
        lowest = min(lowest, lam)
    return min(lowest, last)


@inner
def _bin_index(axis, x):
    low, high = 0, axis.shape[0] - 1
    while high - low > 1:
        middle = (low + high) // 2
        if axis[middle] <= x:
            low = middle
        else:
            high = middle
    return low


@kernel
def _locate(points, ax, ay, az, bin_start, bin_cells, nodes, cells):
    found, g = np.full(points.shape[0], -1, np.int64), np.empty((4, 3))
    for m in range(points.shape[0]):
        i, j, k = (_bin_index(ax, points[m, 0]), _bin_index(ay, points[m, 1]), _bin_index(az, points[m, 2]))
        b = (i * (ay.shape[0] - 1) + j) * (az.shape[0] - 1) + k
        _seek(points, m, b, bin_start, bin_cells, nodes, cells, g, found)
        if found[m] < 0:  # a point on a wall of the bins may belong to a cell that ends there
            for near in range(1, 8):
                p, q, r = near & 1, near >> 1 & 1, near >> 2
                on = (p == 0 or _on_wall(ax, i, points[m, 0])) and (q == 0 or _on_wall(ay, j, points[m, 1]))
                if on and (r == 0 or _on_wall(az, k, points[m, 2])) and found[m] < 0:
                    b = ((i - p) * (ay.shape[0] - 1) + j - q) * (az.shape[0] - 1) + k - r
                    _seek(points, m, b, bin_start, bin_cells, nodes, cells, g, found)
    return found


@inner
def _on_wall(axis, i, x):
    """Whether x is on the lower wall of bin i, up to round-off, and there is a bin before it."""
    return i > 0 and x - axis[i] <= 1e-9 * (axis[i] - axis[i - 1])


@inner
def _seek(points, m, b, bin_start, bin_cells, nodes, cells, g, found):
    """Set found[m] to the cell of bin b that contains point m, if there is one; g (4, 3): work space."""
    best = -1e-10  # round-off: a point on a shared face belongs to the first cell that holds it
    for s in range(bin_start[b], bin_start[b + 1]):
        lowest = smallest_barycentric(points[m], bin_cells[s], nodes, cells, g)
        if lowest >= best:
            found[m] = bin_cells[s]
            if lowest >= 0.0:
                break
            best = lowest
