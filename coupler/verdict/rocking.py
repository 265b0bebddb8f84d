"""Blocks that are out of their place and come back by themselves: they rock.

Blocks that live joints tie together are one piece. A piece that tilts turns about an edge of its base. As long as that
edge is in its place and the centre of mass of the piece has risen and is before it, seen in the direction in which
this has moved, the weight turns the piece back; beyond the edge it overturns. A piece that slid or was carried off has
no corner of its base left in its place, and the centre of one that lost a support has fallen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from array_types import Array

if TYPE_CHECKING:
    from yade_scripts.dynamics.structure import Structure


def rocking(structure: Structure, out: Array, reach: Array) -> Array:
    """(n,) bool: blocks out of their place whose piece its weight turns back.

    out (n,) bool: blocks whose centre is out of its place now · reach (n,) [m]: farthest that a corner of each block
    may have moved and still be in its place."""
    found, out = np.zeros(structure.n, bool), out & ~structure.fixed
    if not out.any():
        return found
    up = _up(structure)
    centre, rotation = structure.centre(), structure.rotation()
    label = _pieces(structure)
    for piece in np.unique(label[out]):
        rows = np.flatnonzero((label == piece) & ~structure.fixed)
        found[rows] = out[rows] & _turns_back(structure, rows, reach, (centre, rotation), up)
    return found


def _up(structure: Structure) -> Array:
    """(3,) unit vector against gravity; zero where there is none, and nothing turns back then."""
    g = np.asarray(structure.gravity, float)
    size = float(np.linalg.norm(g))
    return -g / size if size > 0.0 else np.zeros(3)


def _pieces(structure: Structure) -> Array:
    """(n,) number of the piece of each block: blocks without a live joint are pieces of their own, and held blocks tie
    nothing together."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    n, table = structure.n, structure.joint_table()
    if table is None:
        return np.arange(n)
    a, b = np.asarray(table.a), np.asarray(table.b)
    ties = np.asarray(table.alive) & (a >= 0) & (b >= 0)
    ties[ties] &= ~structure.fixed[a[ties]] & ~structure.fixed[b[ties]]
    graph = sp.coo_array((np.ones(int(ties.sum())), (a[ties], b[ties])), shape=(n, n))
    return connected_components(graph, directed=False)[1]


def _turns_back(
    structure: Structure, rows: Array, reach: Array, placed: tuple[Array, Array], up: Array
) -> bool:
    """Whether a corner of the base of the piece `rows` is in its place, and its centre of mass, which has risen, before
    the last of those."""
    centre, rotation = placed
    blocks = [structure.blocks[i] for i in rows]
    start = np.array([block.centre for block in blocks])
    mass = structure.mass[rows]
    mean, way = mass @ centre[rows] / mass.sum(), mass @ (centre[rows] - start) / mass.sum()
    along = way - (way @ up) * up
    size = float(np.linalg.norm(along))
    if size == 0.0 or not way @ up > 0.0:
        return False
    corners = [block.world_vertices() for block in blocks]
    now = [centre[i] + np.asarray(b.vertices) @ rotation[i].T for i, b in zip(rows, blocks)]
    least = min(float((x @ up).min()) for x in corners)
    pivots = []
    for i, before, after in zip(rows, corners, now):
        base = before @ up <= least + reach[i]
        kept = base & (np.linalg.norm(after - before, axis=1) <= reach[i])
        pivots.append(after[kept])
    edge = np.concatenate(pivots) @ (along / size)
    return bool(len(edge)) and float(mean @ along) / size < float(edge.max())
