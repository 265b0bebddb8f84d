"""The parts of the sides of the tank that solids leave open, in every cell of the domain beside them.

Where a thin wall divides a background cell, several cells of the domain lie beside one of its faces, each with nodes of
its own; where a solid cuts a cell, the open part of the face is made of the faces that its tetrahedra (`fans.py`) have
there.
"""

from __future__ import annotations

import numpy as np

from array_types import Array, Ints
from fluid.cut.fans import tetrahedra_of

ON_FACE = 1e-9
"""Hat value below which a corner of a tetrahedron lies on the face of its cell."""


def corner_opposite(cells, faces) -> Array:
    """Corner (F,), 0 to 3, of cells (F, 4) that is none of the nodes of their faces (F, 3)."""
    return np.argmin((cells[:, :, None] == faces[:, None, :]).any(axis=2), axis=1)


def faces_of(cells, corner) -> Array:
    """Nodes (F, 3) of the faces of cells (F, 4) opposite to a corner (F,)."""
    return np.take_along_axis(cells.astype(np.int64), beside_corner(corner), axis=1)


def open_faces(domain, cell, corner) -> tuple[Ints, Ints, Array]:
    """The faces opposite to corner (F,) of background cells (F,) in the cells of a domain beside them: number (n,) of
    the face, element (n,) of the domain, share (n,) of the area of the face that is open there."""
    face, element, _, share = open_triangles(domain, cell, corner)
    first = np.ones(len(face), bool)
    first[1:] = (face[1:] != face[:-1]) | (element[1:] != element[:-1])
    return face[first], element[first], np.bincount(np.cumsum(first) - 1, share, int(first.sum()))


def open_triangles(domain, cell, corner):
    """Faces opposite to corner (F,) of background cells (F,) as triangles in the fluid: number (n,) of the face,
    element (n,) of the domain, hats (n, 3, 3), share (n,) of the area of the face; a whole face is one triangle."""
    low = np.searchsorted(domain.parent_cell, cell, "left")
    count = np.searchsorted(domain.parent_cell, cell, "right") - low
    face = np.repeat(np.arange(len(cell)), count)
    element = np.repeat(low - np.concatenate([[0], np.cumsum(count)[:-1]]), count) + np.arange(len(face))
    cut = domain.is_cut[element]
    whole = (face[~cut], element[~cut], np.broadcast_to(np.eye(3), (int((~cut).sum()), 3, 3)))
    parts = [(*whole, np.ones(len(whole[0])))]
    if cut.any():
        parts.append(_on_faces(domain, face[cut], element[cut], corner[face[cut]]))
    joined = [np.concatenate(arrays) for arrays in zip(*parts)]
    order = np.argsort(joined[0], kind="stable")
    return tuple(array[order] for array in joined)


def _on_faces(domain, face, element, corner):
    """The same for cut elements: the faces of their tetrahedra on which the hat function of the corner is zero."""
    which, number = tetrahedra_of(domain.fan_start, element)
    corners = domain.fan_corners[number]  # (T, corner of the tetrahedron, hat of the cell)
    off = np.abs(np.take_along_axis(corners, corner[which][:, None, None], axis=2)[:, :, 0]) > ON_FACE
    there = off.sum(axis=1) == 1
    which, corners = which[there], corners[there]
    of_tet, of_cell = beside_corner(np.argmax(off[there], axis=1)), beside_corner(corner[which])
    hats = np.take_along_axis(
        np.take_along_axis(corners, of_tet[:, :, None], axis=1), of_cell[:, None, :], axis=2
    )
    return face[which], element[which], hats, np.abs(np.linalg.det(hats))


def beside_corner(corner):
    """The three corners (F, 3) of a cell beside corner (F,), in order."""
    every = np.broadcast_to(np.arange(4), (len(corner), 4))
    return every[every != corner[:, None]].reshape(-1, 3)
