"""Multiple covers: every node gets one set of unknowns per connected component of its star minus the solids.

The finite cover method separates the mathematical mesh from the physical domain. Here the covers become an
ordinary mesh, the *virtual mesh*: elements are the whole fluid cells and each connected part of each cut
cell; corners of elements in neighbouring cells are the same virtual node if the two parts touch across
their common face. A wall thinner than a cell then separates the water on its two sides exactly.

Two parts touch across a face where their open polygons overlap by more than `Connection.face` of its area;
two pieces within a cell are one part where they touch over more than `Connection.inner` h^2. Thresholds
above zero cure the free edges of thin plates (an opening of any width would otherwise act as one about a
cell wide) at the price of force noise while bodies move, so they are off by default.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from fluid.cut import _polygon_area, _root, _shared_area, workspace

# Areas of contact below this share of h^2 are round-off.
NO_AREA = 1e-12
# Tolerance for clipping the open polygons, as a share of h.
CLIP = 1e-12


@dataclass(frozen=True)
class Connection:
    """When fluid parts are one: thresholds of the multiple covers.

    inner: pieces of a cell touch over more than inner h^2 (0.1 for thin plates with free edges)
    face: parts of two cells overlap by more than this share of the face (0.2 for thin plates)
    pocket: components of the water with less than pocket h^3 are dropped (they have no pressure of their
    own to speak of, and a closed one makes the pressure system singular)."""

    inner: float = 0.0
    face: float = 0.0
    pocket: float = 1e-3

    def link_area(self, spacing: float) -> float:
        """[m2] area over which two pieces of a cell must touch; spacing [m]."""
        return max(self.inner, NO_AREA) * spacing**2


def virtual_cells(mesh, parent, element_of_part, cuts, connection) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of the virtual elements.

    mesh: Background · parent (M,) background cell of each element, ascending · element_of_part (K,)
    cuts: Cuts with openings · connection: Connection -> cells (M, 4), parent_node (N,)."""
    part = np.full(len(parent), -1, dtype=np.int64)
    removed = np.flatnonzero(~cuts.part_whole)
    part[element_of_part[removed]] = removed
    start = np.searchsorted(parent, np.arange(len(mesh.cells) + 1))
    several = _nodes_with_choice(mesh, parent, part, start)
    order, open_start = _openings_by_face(cuts)
    label = _unite_corners(
        mesh.nodes, mesh.cells, mesh.neighbours, parent, part, start, several, order, open_start,
        cuts.open_start, cuts.open_x, connection.face, NO_AREA * mesh.spacing**2, CLIP * mesh.spacing,
        workspace(1, 0, 0),
    )  # fmt: skip
    return _numbered(mesh.cells, parent, several, label, len(mesh.nodes))


def components(cells, n_nodes: int) -> np.ndarray:
    """(M,) number of the connected component (by shared nodes) of each cell (M, 4)."""
    return _components(cells, n_nodes)


def without_pockets(cells, volume, n_nodes: int, least: float) -> np.ndarray:
    """(M,) bool: the cell belongs to a component of at least that volume [m3]; volume (M,) [m3]."""
    label = components(cells, n_nodes)
    total = np.bincount(label, volume)
    return total[label] >= least


def pick_old_nodes(old, new) -> np.ndarray:
    """(N_new,) old virtual node for each new one, -1 = none.

    Where the background node has one copy before and after, that one. Else each new element looks at the
    old element of the same background cell (several: the nearest centroid) and votes with
    min(V_old, V_new) for the old node at the same corner; most votes win."""
    n = len(old.memory.mesh.nodes)
    copies_old = np.bincount(old.parent_node, minlength=n)
    copies_new = np.bincount(new.parent_node, minlength=n)
    only = np.full(n, -1, dtype=np.int64)
    only[old.parent_node] = np.arange(len(old.nodes))
    plain = (copies_old <= 1) & (copies_new <= 1)
    source = np.where(plain[new.parent_node], only[new.parent_node], -1)
    voters = np.flatnonzero(~plain[new.parent_node[new.cells]].all(axis=1))
    elected = _elected(old, new, voters, plain)
    chosen = ~plain[new.parent_node]
    source[chosen] = elected[chosen]
    return source


def _elected(old, new, voters, plain):
    """Winner of the votes for every new node, -1 where nobody voted."""
    matched = _old_elements(old, new, voters)
    voters, matched = voters[matched >= 0], matched[matched >= 0]
    weight = np.minimum(old.volume[matched], new.volume[voters])
    to, frm = new.cells[voters].ravel(), old.cells[matched].ravel()
    key, inverse = np.unique(to * len(old.nodes) + frm, return_inverse=True)
    votes = np.bincount(inverse, np.repeat(weight, 4))
    order = np.lexsort((votes, key // len(old.nodes)))
    elected = np.full(len(new.nodes), -1, dtype=np.int64)
    elected[key[order] // len(old.nodes)] = key[order] % len(old.nodes)
    return elected


def _old_elements(old, new, chosen):
    """Old element in the same background cell nearest to each chosen new one, -1 where it was solid."""
    first = np.searchsorted(old.parent_cell, new.parent_cell[chosen])
    last = np.searchsorted(old.parent_cell, new.parent_cell[chosen], side="right")
    best, nearest = np.full(len(chosen), -1, dtype=np.int64), np.full(len(chosen), np.inf)
    for rank in range(int((last - first).max(initial=0))):
        at = np.minimum(first + rank, len(old.parent_cell) - 1)
        distance = ((old.centroid[at] - new.centroid[chosen]) ** 2).sum(axis=1)
        closer = (first + rank < last) & (distance < nearest)
        best[closer], nearest[closer] = at[closer], distance[closer]
    return best


def _openings_by_face(cuts):
    """Rows of the openings sorted by (part, face), and where each (part, face) starts."""
    key = cuts.open_part * 4 + cuts.open_face
    count = np.bincount(key, minlength=4 * len(cuts.part_cell))
    return np.argsort(key, kind="stable"), np.concatenate([[0], np.cumsum(count)]).astype(np.int64)


def _nodes_with_choice(mesh, parent, part, start):
    """Background nodes of cells that are cut or solid: only these can have other than one copy."""
    changed = np.diff(start) != 1
    changed[parent[part >= 0]] = True
    several = np.zeros(len(mesh.nodes), dtype=bool)
    several[mesh.cells[changed]] = True
    return several


def _numbered(cells, parent, several, label, n_nodes):
    """Number the copies by background node, then by first element -> cells (M, 4), parent_node (N,)."""
    copies, rank = _copies(cells, parent, several, label, n_nodes)
    first = np.cumsum(copies) - copies
    return first[cells[parent]] + rank, np.repeat(np.arange(n_nodes), copies)


@njit(cache=True)
def _copies(cells, parent, several, label, n_nodes):
    copies = np.zeros(n_nodes, dtype=np.int64)
    rank = np.zeros((len(parent), 4), dtype=np.int64)
    for e in range(len(parent)):
        for k in range(4):
            node = cells[parent[e], k]
            if not several[node]:
                copies[node] = 1
                continue
            root = _root(label, 4 * e + k)
            if root == 4 * e + k:
                rank[e, k] = copies[node]
                copies[node] += 1
            else:
                # Roots are the smallest corner of their set, hence numbered before.
                rank[e, k] = rank[root // 4, root % 4]
    return copies, rank


@njit(cache=True)
def _unite_corners(
    nodes, cells, neighbours, parent, part, start, several, order, open_start, polygon_start, polygon_x,
    share, least, tolerance, w,
):  # fmt: skip
    """Union-find over the corners 4 e + k of the elements, at nodes that may have several copies."""
    label = np.arange(4 * len(parent))
    for e in range(len(parent)):
        one = parent[e]
        if not (
            several[cells[one, 0]]
            or several[cells[one, 1]]
            or several[cells[one, 2]]
            or several[cells[one, 3]]
        ):
            continue
        for f in range(4):
            two = neighbours[one, f]
            if two < one:
                continue
            g = 0
            while neighbours[two, g] != one:
                g += 1
            for other in range(start[two], start[two + 1]):
                if (part[e] >= 0 or part[other] >= 0) and not _touching(
                    nodes, cells, one, f, part[e], g, part[other], order, open_start, polygon_start,
                    polygon_x, share, least, tolerance, w,
                ):  # fmt: skip
                    continue
                for k in range(4):
                    if k != f and several[cells[one, k]]:
                        for j in range(4):
                            if cells[two, j] == cells[one, k]:
                                a, b = _root(label, 4 * e + k), _root(label, 4 * other + j)
                                label[max(a, b)] = min(a, b)
    return label


@njit(cache=True)
def _load_opening(w, slot, row, polygon_start, polygon_x):
    first = polygon_start[row]
    w.corners[slot] = polygon_start[row + 1] - first
    for k in range(w.corners[slot]):
        for c in range(3):
            w.polygon[slot, k, c] = polygon_x[first + k, c]


@njit(cache=True)
def _open_area(w, key, order, open_start, polygon_start, polygon_x):
    area = 0.0
    for s in range(open_start[key], open_start[key + 1]):
        _load_opening(w, 0, order[s], polygon_start, polygon_x)
        area += _polygon_area(w, 0)
    return area


@njit(cache=True)
def _touching(
    nodes, cells, cell, f, part, g, other, order, open_start, polygon_start, polygon_x, share, least,
    tolerance, w,
):  # fmt: skip
    """Do two parts touch across the face opposite to corner f of `cell`? Part -1 is a whole cell."""
    w.corners[0] = 3
    for k in range(3):
        for c in range(3):
            w.polygon[0, k, c] = nodes[cells[cell, (f + 1 + k) % 4], c]
    ax, ay, az = w.polygon[0, 1] - w.polygon[0, 0]
    bx, by, bz = w.polygon[0, 2] - w.polygon[0, 0]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = np.sqrt(nx * nx + ny * ny + nz * nz)
    full, limit = twice / 2, max(share * twice / 2, least)
    if other < 0:
        return _open_area(w, 4 * part + f, order, open_start, polygon_start, polygon_x) > limit
    theirs = _open_area(w, 4 * other + g, order, open_start, polygon_start, polygon_x)
    if part < 0:
        return theirs > limit
    ours = _open_area(w, 4 * part + f, order, open_start, polygon_start, polygon_x)
    if min(ours, theirs) <= limit or max(ours, theirs) >= full * (1 - 1e-12):
        return min(ours, theirs) > limit
    # Both sides are partly closed, not necessarily in the same place.
    nx, ny, nz = nx / twice, ny / twice, nz / twice
    area = 0.0
    for s in range(open_start[4 * part + f], open_start[4 * part + f + 1]):
        for t in range(open_start[4 * other + g], open_start[4 * other + g + 1]):
            _load_opening(w, 0, order[s], polygon_start, polygon_x)
            _load_opening(w, 1, order[t], polygon_start, polygon_x)
            area += _shared_area(w, 0, 1, nx, ny, nz, tolerance)
            if area > limit:
                return True
    return False


@njit(cache=True)
def _components(cells, n_nodes):
    label = np.arange(n_nodes)
    for e in range(len(cells)):
        a = _root(label, cells[e, 0])
        for k in range(1, 4):
            b = _root(label, cells[e, k])
            if a != b:
                label[max(a, b)] = min(a, b)
                a = min(a, b)
    number = np.full(n_nodes, -1, dtype=np.int64)
    component = np.empty(len(cells), dtype=np.int64)
    found = 0
    for e in range(len(cells)):
        root = _root(label, cells[e, 0])
        if number[root] < 0:
            number[root] = found
            found += 1
        component[e] = number[root]
    return component
