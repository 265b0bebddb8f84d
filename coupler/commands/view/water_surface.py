"""The skin of the water: the free surface level set = 0, closed by the walls, so that the water looks like a volume.

Linear functions on tetrahedra make this exact: the water in a tetrahedron is cut off by one plane, the water on a wall
triangle by one line. Every corner of the skin lies on an edge (i, j) of the mesh, at the share w = φ_i / (φ_i − φ_j)
of the way from i to j, or on a node (i = j). All triangles are counter-clockwise seen from outside the water.
"""

from dataclasses import dataclass

import numpy as np

# Even permutations keep a right-handed tetrahedron right-handed: one per first corner, one per first two corners.
ONE_FIRST = np.array([[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]])
TWO_FIRST = np.array([[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]])
FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])


@dataclass(frozen=True)
class Skin:
    """t triangles, the first `free` of them on the free surface.

    pair (t, 3, 2): nodes i, j of each corner · share (t, 3): w, the value there is (1 - w) v_i + w v_j.
    """

    pair: np.ndarray
    share: np.ndarray
    free: int

    def of(self, values):
        """Nodal values (n, ...) at the corners of the triangles (t, 3, ...)."""
        w = self.share.reshape(self.share.shape + (1,) * (np.ndim(values) - 1))
        return (1 - w) * values[self.pair[..., 0]] + w * values[self.pair[..., 1]]

    def of_triangles(self, kept):
        """The skin of the triangles that are kept (t,) bool."""
        return Skin(self.pair[kept], self.share[kept], int(np.count_nonzero(kept[: self.free])))


def skin(nodes, cells, level_set, fraction=None, tank=None):
    """Skin of {level set < 0} on nodes (n, 3), tetrahedra cells (m, 4), level_set (n,) [m].

    fraction (m,): share of each cell outside solids, and tank (2, 3) [m]: with both, faces of cut cells that do not lie
    on a side of the tank are left out: they are inside a body, or stick out of one that is thinner than a cell."""
    kept = some((level_set < 0)[cells])
    wet = right_handed(nodes, cells[kept])
    free = free_triangles(wet, level_set)
    outer, owner = outer_faces(wet, len(nodes))
    if fraction is not None and tank is not None:
        outer = outer[(fraction[kept][owner] > WHOLE) | on_sides(nodes, outer, tank)]
    pair = np.concatenate([free, clipped(outer, level_set)])
    i, j = level_set[pair[..., 0]], level_set[pair[..., 1]]
    share = np.where(pair[..., 0] == pair[..., 1], 0.0, i / np.where(i == j, 1.0, i - j))
    return Skin(pair, share, len(free))


def surfaces_of_pockets(nodes, cells, level_set, pocket, pressure):
    """Number, gauge pressure [Pa] and triangles (t, 3, 3) [m] of the water's surface below each pocket of trapped air,
    the one of most triangles first; none where all air is open.

    pocket (n,): number of the pocket at each node, 0: none · pressure (n,) [Pa]: at such nodes that of the pocket."""
    if not pocket.any():
        return []
    found = skin(nodes, cells, level_set)
    number = pocket[found.pair[: found.free]].max(axis=(1, 2))
    corners = found.of(nodes)[: found.free]
    known = sorted((int(k) for k in np.unique(number) if k > 0), key=lambda k: -int((number == k).sum()))
    return [(k, float(pressure[pocket == k][0]), corners[number == k]) for k in known]


def facing(corners, eye):
    """(t,) bool: triangles (t, 3, 3) [m] whose front is seen from the eye (3,) [m]."""
    a, b, c = np.moveaxis(corners, 1, 0)
    return np.einsum("ti,ti->t", eye - a, np.cross(b - a, c - a)) > 0.0


def some(flags):
    """(m,) bool: rows of flags (m, k) with one that is true; an `any` along short rows is slow."""
    return np.logical_or.reduce([column for column in flags.T])


def right_handed(nodes, cells):
    """The same tetrahedra, with positive volume."""
    a, b, c = np.moveaxis(nodes[cells[:, 1:]] - nodes[cells[:, :1]], 1, 0)
    negative = np.einsum("mi,mi->m", a, np.cross(b, c)) < 0
    return np.where(negative[:, None], cells[:, [0, 2, 1, 3]], cells)


def free_triangles(cells, level_set):
    """Corner pairs (t, 3, 2) of the free surface in right-handed tetrahedra: one triangle, two for two wet nodes."""
    wet = level_set[cells] < 0
    count = wet.sum(axis=1)
    a, b, c, d = _ordered(cells[count == 1], wet[count == 1].argmax(axis=1), ONE_FIRST)
    one = _pairs((a, b), (a, c), (a, d))
    a, b, c, d = _ordered(cells[count == 3], wet[count == 3].argmin(axis=1), ONE_FIRST)
    three = _pairs((a, b), (a, d), (a, c))
    two = count == 2
    case = np.argmax([wet[two][:, p[0]] & wet[two][:, p[1]] for p in TWO_FIRST], axis=0)
    a, b, c, d = _ordered(cells[two], case, TWO_FIRST)
    return np.concatenate([one, three, _pairs((a, c), (a, d), (b, d)), _pairs((a, c), (b, d), (b, c))])


def clipped(triangles, level_set):
    """Corner pairs (t, 3, 2) of the wet parts of triangles (k, 3)."""
    wet = level_set[triangles] < 0
    count = wet.sum(axis=1)
    turn = np.array([[0, 1, 2], [1, 2, 0], [2, 0, 1]])
    a, b, c = triangles[count == 3].T
    whole = _pairs((a, a), (b, b), (c, c))
    a, b, c = _ordered(triangles[count == 1], wet[count == 1].argmax(axis=1), turn)
    one = _pairs((a, a), (a, b), (a, c))
    a, b, c = _ordered(triangles[count == 2], wet[count == 2].argmin(axis=1), turn)
    return np.concatenate([whole, one, _pairs((a, b), (b, b), (c, c)), _pairs((a, b), (c, c), (a, c))])


WHOLE = 1.0 - 1e-6
"""Share of a cell outside solids from which no solid cuts it."""


def on_sides(nodes, faces, tank):
    """(k,) bool: faces (k, 3) that lie in a side of the tank (2, 3) [m]."""
    x = nodes[faces]
    near = 1e-5 * np.ptp(tank, axis=0).max()
    return np.any([(np.abs(x - corner) <= near).all(axis=1) for corner in tank], axis=0).any(axis=1)


def outer_faces(cells, n_nodes):
    """Faces (k, 3) that belong to one of the right-handed tetrahedra only, counter-clockwise from outside, and the
    tetrahedron of each (k,)."""
    faces = cells[:, FACES].reshape(-1, 3)
    low, middle, high = np.sort(faces, axis=1).T
    key = (low * n_nodes + middle) * n_nodes + high
    order = np.argsort(key)
    key = key[order]
    new = np.ones(len(key) + 1, dtype=bool)
    new[1:-1] = key[1:] != key[:-1]
    alone = order[new[:-1] & new[1:]] if len(key) else order
    return faces[alone], alone // 4


def nodal_slope(nodes, cells, values):
    """Gradient (n, 3) of a P1 function at its nodes, times a positive number: volume-weighted over the cells of each.

    Only cells around the zero level count; elsewhere it is zero.
    """
    at_surface = np.zeros(len(nodes), dtype=bool)
    wet = (values < 0)[cells]
    at_surface[cells[some(wet) & some(~wet)]] = True
    cells = right_handed(nodes, cells[some(at_surface[cells])])
    a, b, c = np.moveaxis(nodes[cells[:, 1:]] - nodes[cells[:, :1]], 1, 0)
    rise = values[cells[:, 1:]] - values[cells[:, :1]]
    # gradient = (rise_a b×c + rise_b c×a + rise_c a×b) / det, and weighting with the volume drops det
    weighted = rise[:, :1] * np.cross(b, c) + rise[:, 1:2] * np.cross(c, a) + rise[:, 2:] * np.cross(a, b)
    return np.stack([np.bincount(cells.ravel(), np.repeat(w, 4), len(nodes)) for w in weighted.T], axis=1)


def shading_normals(found, nodes, cells, level_set):
    """Unit normals (t, 3, 3) at the corners: the slope of the level set on the free surface, the wall's own elsewhere.

    The slope is smooth where the small triangles of a cut are not.
    """
    x = found.of(nodes)
    flat = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
    normal = np.repeat(flat[:, None], 3, axis=1)
    normal[: found.free] = found.of(nodal_slope(nodes, cells, level_set))[: found.free]
    size = np.linalg.norm(normal, axis=2, keepdims=True)
    return normal / np.where(size > 0, size, 1.0)


def _ordered(items, case, orders):
    """Columns of `items` (k, c), each row put in the order of its case."""
    return np.take_along_axis(items, orders[case], axis=1).T


def _pairs(*corners):
    """Corner pairs (k, 3, 2) from three pairs of columns."""
    return np.stack([np.stack(pair, axis=-1) for pair in corners], axis=1)
