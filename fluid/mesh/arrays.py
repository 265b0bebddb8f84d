"""Arrays that belong together, in the form for kernels: one argument, whose parts have names.

A kernel that makes arrays takes the parts out before its loops, since inside them each access would count
references."""

from __future__ import annotations

from typing import NamedTuple

from array_types import Floats, Integers, Ints


class Planes(NamedTuple):
    """Planes of convex bodies, n·x = o: normal (P, 3) unit, outward · offset (P,) [m] · start (n + 1,): those of body b
    are start[b]:start[b + 1]."""

    normal: Floats
    offset: Floats
    start: Ints


class Boxes(NamedTuple):
    """Boxes along the axes, from low to high (n, 3): [m], or numbers of bins."""

    low: Ints
    high: Ints


class Corners(NamedTuple):
    """Tetrahedra by their corners: nodes (N, 3) [m] · cells (M, 4)."""

    nodes: Floats
    cells: Integers


class Bins(NamedTuple):
    """Cells that reach into each brick of a lattice of ny by nz bricks in its last two directions: brick
    (i ny + j) nz + k has cells[start[b]:start[b + 1]]."""

    start: Ints
    cells: Ints
    ny: int
    nz: int


class Hats(NamedTuple):
    """Linear functions of cells: cells (M, 4) nodes · parent (M,) row of their gradients (.., 4, 3) [1/m]."""

    cells: Integers
    parent: Integers
    gradients: Floats


class FluidCells(NamedTuple):
    """`Hats` of a domain with the fluid part of its cells: volume (M,) [m³] · share (K + 1, 4) mean of each function
    over it, 1/4 in the first row, that of all whole cells · share_row (M,) row of each cell · size (M,) [m] · along
    (rows of the gradients,) uint8: see `Background.along`."""

    cells: Integers
    parent: Integers
    gradients: Floats
    volume: Floats
    share: Floats
    share_row: Integers
    size: Floats
    along: Integers


class Paths(NamedTuple):
    """Arrays for following a path through a mesh: nodes (N, 3) [m] · cells (M, 4), their nodes · parent (M,) row of the
    gradients (.., 4, 3) [1/m] of their linear functions · neighbours (M, 4): cell behind the face opposite each
    corner, -1 none · node_start (N + 1,), node_cells: the cells around node i are
    node_cells[node_start[i]:node_start[i + 1]]."""

    nodes: Floats
    cells: Integers
    parent: Integers
    gradients: Floats
    neighbours: Integers
    node_start: Integers
    node_cells: Integers


class Edges(NamedTuple):
    """Edges of listed nodes: row (N,) place of a node in the list, -1 if it is not there · start (n + 1,), neighbour,
    stiffness [m] of each."""

    row: Ints
    start: Integers
    neighbour: Integers
    stiffness: Floats


class WettedPolygons(NamedTuple):
    """cell (S,), body (S,) · area (S,) [m²] · normal (S, 3) out of the body · points (S, 3, 3) [m], each with a third
    of the area."""

    cell: Ints
    body: Ints
    area: Floats
    normal: Floats
    points: Floats
