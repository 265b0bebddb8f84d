"""Boxes and beds with regions of finer cells: the regions, and the resulting mesh.

mesh = refined_mesh(box_mesh((0, 0, 0), (8, 4, 4), 0.5), [InBox((3, 1, 0), (5, 3, 2), levels=2)])
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from array_types import Array
from fluid.mesh.arrays import Boxes, Planes
from fluid.mesh.background import Background, MeshError, bin_of
from fluid.mesh.bisection import MOST_LEVELS, Tetrahedra, refined
from kernels.decorators import kernel

MOST_ENTRIES = 6
"""Largest mean number of bins in which a cell is listed."""
SAMPLED = 200
"""Sample points along each side of a tank at which a bed is read to estimate the size of a region."""
TOUCH = 1e-9
"""Overlap with a region, as a share of the cell, up to which the cell only touches it and is not refined."""


@dataclass(frozen=True)
class InBox:
    """Cells that reach into the box from lower to upper (3,) [m] are halved `levels` times in every direction."""

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]
    levels: int

    def cells(self, mesh: Tetrahedra, level: int) -> Array:
        """(M,) bool: cells of the mesh that are to have this level."""
        low, high = _boxes_of(mesh)
        touch = TOUCH * (high - low)
        return ((low + touch < self.upper) & (high - touch > self.lower)).all(axis=1)

    def volume_in(self, lower, upper) -> float:
        """Approximate volume [m³] of the region in the box from lower to upper."""
        return _common(self.lower, self.upper, lower, upper)


@dataclass(frozen=True)
class NearBodies:
    """Cells within a margin [m] of convex bodies are halved `levels` times in every direction.

    normals (P, 3), unit, outward, and offsets (P,) [m] of their planes n·x = d · start (n + 1,): the planes of each ·
    lower, upper (n, 3) [m]: boxes around the bodies · margin: one number [m]; within twice the margin cells have one
    level less, and so on, so that sizes change gradually."""

    normals: Array
    offsets: Array
    start: Array
    lower: Array
    upper: Array
    margin: float
    levels: int

    def cells(self, mesh: Tetrahedra, level: int) -> Array:
        """(M,) bool: cells of the mesh that are to have this level."""
        margin = self.margin * 2.0 ** (self.levels - level)
        low, high = _boxes_of(mesh)
        planes, boxes = Planes(self.normals, self.offsets, self.start), Boxes(self.lower, self.upper)
        return _near(mesh.nodes, mesh.cells, Boxes(low, high), planes, boxes, margin)

    def volume_in(self, lower, upper) -> float:
        """Approximate volume [m³] of the region in the box from lower to upper."""
        m = self.margin
        return sum(_common(low - m, high + m, lower, upper) for low, high in zip(self.lower, self.upper))


@dataclass(frozen=True)
class OnBed:
    """Cells up to a height [m] above a bed where the bed lies between two elevations: a shore, the ground of a town.
    A cell counts if part of the bed under it lies between them, also where none of its nodes does.

    bed(x, y) → z [m] at (n,), (n,) [m] · lowest, highest [m] · height [m] · levels as above."""

    bed: Callable[[Array, Array], Array]
    lowest: float
    highest: float
    height: float
    levels: int

    def cells(self, mesh: Tetrahedra, level: int) -> Array:
        """(M,) bool: cells of the mesh that are to have this level."""
        x = mesh.nodes
        z = np.asarray(self.bed(x[:, 0], x[:, 1]), float)
        above = np.fmin.reduce((x[:, 2] - z)[mesh.cells], axis=1)
        return self._reaches(z[mesh.cells]) & (above <= self.height * (1.0 + TOUCH))

    def volume_in(self, lower, upper) -> float:
        """Approximate volume [m³] of the region in the box from lower to upper."""
        x, y = np.meshgrid(*(np.linspace(lower[k], upper[k], SAMPLED) for k in range(2)))
        z = np.asarray(self.bed(x.ravel(), y.ravel()), float).reshape(x.shape)
        corners = np.stack([z[:-1, :-1], z[:-1, 1:], z[1:, :-1], z[1:, 1:]], axis=-1)
        share = self._reaches(corners.reshape(-1, 4)).mean()
        return float(share * self.height * (upper[0] - lower[0]) * (upper[1] - lower[1]))

    def _reaches(self, z: Array) -> Array:
        """(n,) bool: whether the bed between places of heights z (n, k) [m] reaches into the elevations; places
        without ground are NaN and do not count."""
        return (np.fmin.reduce(z, axis=1) <= self.highest) & (np.fmax.reduce(z, axis=1) >= self.lowest)


@dataclass(frozen=True)
class Either:
    """Cells of any of some regions, halved `levels` times."""

    regions: tuple
    levels: int

    def cells(self, mesh: Tetrahedra, level: int) -> Array:
        """(M,) bool: cells of the mesh that are to have this level."""
        return np.any([region.cells(mesh, level) for region in self.regions], axis=0)

    def volume_in(self, lower, upper) -> float:
        """Approximate volume [m³] of the region in the box from lower to upper."""
        return sum(region.volume_in(lower, upper) for region in self.regions)


def refined_mesh(mesh: Background, regions, lattice=None) -> Background:
    """A mesh with finer cells in regions (InBox, NearBodies, OnBed, or others with `levels` and `cells`).

    lattice (N, 3): places of the nodes in bricks of edge 1; None: derived here from the mesh, a box or any tetrahedra.
    Raises MeshError for levels out of 1 to MOST_LEVELS."""
    regions = list(regions)
    levels = max((region.levels for region in regions), default=0)
    if any(not 1 <= region.levels <= MOST_LEVELS for region in regions):
        raise MeshError(f"levels of refinement must be from 1 to {MOST_LEVELS}")
    start = Tetrahedra.coarse(mesh.nodes, mesh.cells, _lattice(mesh) if lattice is None else lattice)

    def chosen(now, level):
        found = np.zeros(len(now.cells), bool)
        for region in regions:
            if region.levels >= level:
                found |= region.cells(now, level)
        return found

    cells = refined(start, chosen, levels)
    if len(cells.cells) == len(mesh.cells):
        return mesh
    walls = _bin_walls(mesh.axes, cells)
    return Background.from_arrays(cells.nodes, cells.cells, walls, straddling=True, lattice=cells.lattice)


def _common(low, high, lower, upper) -> float:
    return float(np.prod(np.maximum(np.minimum(high, upper) - np.maximum(low, lower), 0.0)))


def _lattice(mesh: Background):
    """Places (N, 3) of the nodes in bricks of edge 1 where the bins are bricks; None for other meshes."""
    at = [np.searchsorted(axis, mesh.nodes[:, k]) for k, axis in enumerate(mesh.axes)]
    at = [np.minimum(a, len(axis) - 1) for a, axis in zip(at, mesh.axes)]
    if any((axis[a] != mesh.nodes[:, k]).any() for k, (a, axis) in enumerate(zip(at, mesh.axes))):
        return None
    return np.column_stack(at).astype(float)


def _boxes_of(mesh: Tetrahedra):
    x = mesh.nodes[mesh.cells]
    return x.min(axis=1), x.max(axis=1)


def _bin_walls(axes, mesh: Tetrahedra):
    """Axes of bins about as small as the smallest cells across them, unless cells would be listed in too many bins."""
    low, high = _boxes_of(mesh)
    for share in (1.0, 2.0, 4.0, 8.0, 16.0):
        found = tuple(_divided(axis, low[:, k], high[:, k], share) for k, axis in enumerate(axes))
        listed = np.ones(len(low))
        for k, axis in enumerate(found):
            listed *= 1.0 + bin_of(axis, high[:, k]) - bin_of(axis, low[:, k])
        if listed.mean() <= MOST_ENTRIES:
            break
    return found


def _divided(axis, low, high, share):
    """The axis with each interval divided so that the smallest cell that starts in it covers about `share` parts."""
    least = np.full(len(axis) - 1, np.inf)
    np.minimum.at(least, bin_of(axis, 0.5 * (low + high)), high - low)
    parts = np.maximum(1.0, np.rint(np.diff(axis) / (least * share))).astype(int)
    return np.concatenate(
        [np.linspace(a, b, n, endpoint=False) for a, b, n in zip(axis, axis[1:], parts)] + [axis[-1:]]
    )


@kernel
def _near(nodes, cells, boxes, planes, body_boxes, margin):
    """(M,) bool: cells that neither the bounding box of some body nor any of its planes, moved out by the margin,
    separates from it."""
    low, high = boxes
    normals, offsets, start = planes
    body_low, body_high = body_boxes
    found = np.zeros(cells.shape[0], np.bool_)
    for e in range(cells.shape[0]):
        for b in range(start.shape[0] - 1):
            apart = False
            for k in range(3):
                apart = apart or low[e, k] > body_high[b, k] + margin or high[e, k] < body_low[b, k] - margin
            if apart:
                continue
            for p in range(start[b], start[b + 1]):
                beyond = True
                for a in range(4):
                    d = 0.0
                    for k in range(3):
                        d += normals[p, k] * nodes[cells[e, a], k]
                    beyond = beyond and d - offsets[p] > margin
                apart = apart or beyond
            if not apart:
                found[e] = True
                break
    return found
