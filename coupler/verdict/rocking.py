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
    out = out & ~structure.fixed
    if not out.any():
        return out
    label = _pieces(structure)
    pieces = np.zeros(int(label.max()) + 1, bool)
    pieces[label[out]] = True
    return out & _turning_back(structure, label, pieces, reach)[label]


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


def _turning_back(structure: Structure, label: Array, pieces: Array, reach: Array) -> Array:
    """(p,) bool: which of the `pieces` (p,) bool have a corner of their base in its place, and their centre of mass,
    which has risen, before the last of those. label (n,): piece of each block; none of `pieces` holds a held block."""
    up, centre, rotation = _up(structure), structure.centre(), structure.rotation()
    start = np.array([block.centre for block in structure.blocks])
    mean, way = (_means(label, structure.mass, x) for x in (centre, centre - start))
    along = way - (way @ up)[:, None] * up
    size = np.linalg.norm(along, axis=1)
    along /= np.where(size > 0.0, size, 1.0)[:, None]
    looked_at = pieces & (way @ up > 0.0) & (size > 0.0)
    rows = np.flatnonzero(looked_at[label])
    if not len(rows):
        return looked_at
    before = np.concatenate([structure.blocks[i].world_vertices() for i in rows])
    vertices = [np.asarray(structure.blocks[i].vertices) for i in rows]
    block = np.repeat(rows, [len(v) for v in vertices])
    now = centre[block] + np.einsum("kij,kj->ki", rotation[block], np.concatenate(vertices))
    piece, height = label[block], before @ up
    least, last = np.full(len(pieces), np.inf), np.full(len(pieces), -np.inf)
    np.minimum.at(least, piece, height)
    kept = height <= least[piece] + reach[block]
    kept &= np.linalg.norm(now - before, axis=1) <= reach[block]
    np.maximum.at(last, piece[kept], np.einsum("ki,ki->k", now[kept], along[piece[kept]]))
    return looked_at & (np.einsum("pi,pi->p", mean, along) < last)


def _means(label: Array, mass: Array, places: Array) -> Array:
    """Means (p, 3) [m] of places (n, 3) over each piece by mass (n,); zero for pieces without mass."""
    whole = np.bincount(label, mass)
    sums = np.stack([np.bincount(label, mass * x) for x in places.T], axis=1)
    return sums / np.where(whole > 0.0, whole, 1.0)[:, None]
