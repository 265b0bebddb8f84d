"""Local refinement by bisection of tetrahedra: conforming, and the same in every run.

A cell is halved through the middle of its longest edge, measured in the lattice that the mesh was made from; where two
edges are equally long, the numbers of their ends decide.  This is one order of all edges, so a neighbour that has the
halved edge can always follow: it halves its own longest edges first until it comes to this one (Rivara, Int. J. Numer.
Methods Eng. 20 (1984) 745).  In Kuhn's six tetrahedra of a brick the longest edge is the diagonal of the brick, then
that of a side, then an edge of the brick: these are the cells of Maubach (SIAM J. Sci. Comput. 16 (1995) 210), three
shapes up to scale, with dihedral angles of 45 to 120 degrees in a cube whatever the number of bisections.  Three
bisections halve all edges of a brick: one *level*, after which the cells inside are split bricks again, without obtuse
angles.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from array_types import Array
from kernels.decorators import helper, inner, kernel

PER_LEVEL = 3
"""Bisections that halve all edges of a brick."""
MOST_LEVELS = 8
"""Most levels; beyond them the sizes of cells differ more than the arithmetic of the flow allows for."""


@dataclass(frozen=True)
class Tetrahedra:
    """nodes (N, 3) [m] · lattice (N, 3), their places in bricks of edge 1 · cells (M, 4) · depth (M,) bisections that
    each cell comes from."""

    nodes: Array
    lattice: Array
    cells: Array
    depth: Array

    @classmethod
    def coarse(cls, nodes, cells, lattice) -> Tetrahedra:
        """The mesh before any bisection; lattice (N, 3), or None: edges are then measured between the nodes
        themselves."""
        nodes = np.ascontiguousarray(nodes, float)
        lattice = nodes if lattice is None else np.ascontiguousarray(lattice, float)
        return cls(nodes, lattice, np.ascontiguousarray(cells, np.int64), np.zeros(len(cells), np.int64))


def refined(mesh: Tetrahedra, chosen: Callable[[Tetrahedra, int], Array], levels: int) -> Tetrahedra:
    """The mesh with all chosen cells halved in every direction, and again, `levels` times; around them cells are halved
    only as far as conforming faces require.

    chosen(mesh, level) → (M,) bool: cells that are to have at least this level, 1 to `levels`.  Cells are in the order
    of those that they were cut from, nodes in the order of the cells.  Raises ValueError for levels out of 0 to
    MOST_LEVELS."""
    if not 0 <= levels <= MOST_LEVELS:
        raise ValueError(f"levels = {levels}: must be from 0 to {MOST_LEVELS}")
    for level in range(1, levels + 1):
        wanted = np.asarray(chosen(mesh, level), bool) & (mesh.depth < PER_LEVEL * level)
        if wanted.any():
            mesh = _halved(mesh, wanted, PER_LEVEL * level)
    return mesh


def _halved(mesh: Tetrahedra, wanted, depth: int) -> Tetrahedra:
    """The mesh with the wanted cells (M,) bool brought to a depth, and with the neighbours that have to follow."""
    found = _bisect(mesh.nodes, mesh.lattice, mesh.cells, mesh.depth, wanted, depth)
    nodes, lattice, cells, reached, root = found
    order = np.argsort(root, kind="stable")
    cells, reached = cells[order], reached[order]
    first = _first_seen(cells, len(nodes))
    number = np.full(len(nodes), -1)
    number[first] = np.arange(len(first))
    return Tetrahedra(nodes[first], lattice[first], number[cells], reached)


@kernel
def _first_seen(cells, n):
    """Nodes (k,), of n, in the order in which the cells name them; nodes of no cell are left out."""
    out, seen, k = np.empty(n, np.int64), np.zeros(n, np.bool_), 0
    for e in range(cells.shape[0]):
        for a in range(4):
            i = cells[e, a]
            if not seen[i]:
                seen[i] = True
                out[k] = i
                k += 1
    return out[:k]


@kernel
def _bisect(nodes, lattice, cells, depth, wanted, deep):
    """Bisect all wanted cells of less than the depth `deep`, and those that have to follow → nodes, lattice, cells,
    depth, and the original cell (M,) that each new one comes from."""
    n_nodes, n = nodes.shape[0], cells.shape[0]
    root = np.arange(n)
    wanted = wanted.copy()
    touched = np.zeros(n_nodes, np.bool_)
    keys, middle, held = np.full(1 << 12, -1, np.int64), np.empty(1 << 12, np.int64), 0
    changed = True
    while changed:
        changed = False
        e = 0
        while e < n:
            while (wanted[e] and depth[e] < deep) or _has_halved(cells[e], touched, keys, middle):
                changed = True
                a, b = _longest(cells[e], lattice)
                i, j = min(cells[e, a], cells[e, b]), max(cells[e, a], cells[e, b])
                at = _slot(keys, (i << 32) + j)
                if keys[at] < 0:
                    if n_nodes == nodes.shape[0]:
                        nodes, lattice = _grown(nodes), _grown(lattice)
                        touched = _grown_flags(touched)
                    for k in range(3):
                        nodes[n_nodes, k] = 0.5 * (nodes[i, k] + nodes[j, k])
                        lattice[n_nodes, k] = 0.5 * (lattice[i, k] + lattice[j, k])
                    touched[i] = touched[j] = True
                    keys[at], middle[at] = (i << 32) + j, n_nodes
                    n_nodes += 1
                    held += 1
                    if 2 * held > keys.shape[0]:
                        keys, middle = _rehashed(keys, middle)
                        at = _slot(keys, (i << 32) + j)
                m = middle[at]
                if n == cells.shape[0]:
                    cells = _grown_ints(cells)
                    depth, root = _grown_numbers(depth), _grown_numbers(root)
                    wanted = _grown_flags(wanted)
                for k in range(4):
                    cells[n, k] = cells[e, k]
                cells[n, a], cells[e, b] = m, m
                depth[e] += 1
                depth[n], root[n], wanted[n] = depth[e], root[e], wanted[e]
                n += 1
            e += 1
    return (
        nodes[:n_nodes].copy(),
        lattice[:n_nodes].copy(),
        cells[:n].copy(),
        depth[:n].copy(),
        root[:n].copy(),
    )


@inner
def _longest(corners, lattice):
    """Corners a, b of the longest edge; of equally long ones, that with the smallest numbers."""
    best, one, other, low, high = -1.0, 0, 1, 0, 0
    for a in range(4):
        for b in range(a + 1, 4):
            length = 0.0
            for k in range(3):
                length += (lattice[corners[b], k] - lattice[corners[a], k]) ** 2
            i, j = min(corners[a], corners[b]), max(corners[a], corners[b])
            if length > best or (length == best and (i < low or (i == low and j < high))):
                best, one, other, low, high = length, a, b, i, j
    return one, other


@inner
def _has_halved(corners, touched, keys, middle):
    """Whether some edge of a cell has a node in its middle."""
    for a in range(4):
        if touched[corners[a]]:
            for b in range(a + 1, 4):
                if touched[corners[b]]:
                    i, j = min(corners[a], corners[b]), max(corners[a], corners[b])
                    if keys[_slot(keys, (i << 32) + j)] >= 0:
                        return True
    return False


@inner
def _slot(keys, key):
    """Place of a key in the table, or the free one where it belongs."""
    mask = keys.shape[0] - 1
    at = ((key ^ (key >> 29)) * 0x9E3779B1 >> 7) & mask
    while keys[at] >= 0 and keys[at] != key:
        at = (at + 1) & mask
    return at


@helper
def _rehashed(keys, middle):
    wider, values = np.full(2 * keys.shape[0], -1, np.int64), np.empty(2 * keys.shape[0], np.int64)
    for s in range(keys.shape[0]):
        if keys[s] >= 0:
            at = _slot(wider, keys[s])
            wider[at], values[at] = keys[s], middle[s]
    return wider, values


@helper
def _grown(rows):
    out = np.empty((2 * rows.shape[0], rows.shape[1]))
    out[: rows.shape[0]] = rows
    return out


@helper
def _grown_ints(rows):
    out = np.empty((2 * rows.shape[0], rows.shape[1]), np.int64)
    out[: rows.shape[0]] = rows
    return out


@helper
def _grown_numbers(values):
    out = np.empty(2 * values.shape[0], np.int64)
    out[: values.shape[0]] = values
    return out


@helper
def _grown_flags(flags):
    out = np.zeros(2 * flags.shape[0], np.bool_)
    out[: flags.shape[0]] = flags
    return out
