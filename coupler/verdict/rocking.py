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
    up, centre, label = _up(structure), structure.centre(), _pieces(structure)
    way, rises = _ways(structure, centre, label, up)
    for piece in np.flatnonzero(rises & (np.bincount(label[out], minlength=len(rises)) > 0)).tolist():
        rows = np.flatnonzero((label == piece) & ~structure.fixed)
        placed = centre, structure.rotation()
        found[rows] = out[rows] & _turns_back(structure, rows, reach, placed, way[piece], up)
    return found


def _ways(structure: Structure, centre: Array, label: Array, up: Array) -> tuple[Array, Array]:
    """Way (pieces, 3) [m] of the centre of mass of each piece, from centre (n, 3) [m] and label (n,), and whether it
    has risen (pieces,) bool: most pieces of a building that has come down have not, and need no further look."""
    start = np.array([block.centre for block in structure.blocks]).reshape(-1, 3)
    mass = np.where(structure.fixed, 0.0, structure.mass)
    moved = (mass[:, None] * (centre - start)).T
    whole = np.bincount(label, mass)
    way = (
        np.stack([np.bincount(label, m) for m in moved], axis=1) / np.where(whole > 0.0, whole, 1.0)[:, None]
    )
    return way, way @ up > 0.0


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
    structure: Structure, rows: Array, reach: Array, placed: tuple[Array, Array], way: Array, up: Array
) -> bool:
    """Whether a corner of the base of the piece `rows` is in its place, and its centre of mass, which has risen, before
    the last of those. placed: centres and rotations of all blocks · way (3,) [m] of its centre of mass."""
    centre, rotation = placed
    along = way - (way @ up) * up
    size = float(np.linalg.norm(along))
    if size == 0.0:
        return False
    blocks = [structure.blocks[i] for i in rows]
    mass = structure.mass[rows]
    mean = mass @ centre[rows] / mass.sum()
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
