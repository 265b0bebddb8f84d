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

from fluid.cut import root as find
from fluid.jit import inner
from fluid.pieces import workspace
from fluid.polygons import polygon_area, shared_area

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

    Away from the bodies a node has one copy before and after. Near them each new element votes with
    min(V_old, V_new) for the node at the same corner of an old element of the same background cell; most
    votes win. Water moves with a wall: the old element is sought from where the wall has carried the new
    centroid from, nearest first, and never across the wall."""
    near = _near_bodies(old) | _near_bodies(new)
    only = np.full(len(near), -1, dtype=np.int64)
    only[old.parent_node] = np.arange(len(old.nodes))
    chosen = near[new.parent_node]
    source = only[new.parent_node]
    voters = np.flatnonzero(near[new.parent_node[new.cells]].any(axis=1))
    source[chosen] = _elected(old, new, voters)[chosen]
    return source


def _near_bodies(domain):
    """(background nodes,) bool: nodes of cells that a body meets."""
    memory = domain.memory
    near = np.zeros(len(memory.mesh.nodes), dtype=bool)
    near[memory.mesh.cells[memory.pair_cell]] = True
    return near


def _elected(old, new, voters):
    """Winner of the votes for every new node, -1 where nobody voted."""
    matched = _old_elements(old, new, voters)
    voters, matched = voters[matched >= 0], matched[matched >= 0]
    weight = np.minimum(old.volume[matched], new.volume[voters])
    to, frm = new.cells[voters].ravel(), old.cells[matched].ravel()
    key, inverse = np.unique(to * len(old.nodes) + frm, return_inverse=True)
    votes = np.bincount(inverse, np.repeat(weight, 4), minlength=len(key))
    order = np.lexsort((votes, key // len(old.nodes)))
    elected = np.full(len(new.nodes), -1, dtype=np.int64)
    elected[key[order] // len(old.nodes)] = key[order] % len(old.nodes)
    return elected


def _old_elements(old, new, chosen):
    """Old element in the same background cell for each chosen new one, -1 where there is none."""
    cell = new.parent_cell[chosen]
    first = np.searchsorted(old.parent_cell, cell)
    last = np.searchsorted(old.parent_cell, cell, side="right")
    before, after = old.memory.bodies, new.memory.bodies
    return _same_side(
        first, last, new.centroid[chosen], _wall_of(new)[chosen], old.centroid, _wall_of(old),
        before.centre, before.rotation, after.centre, after.rotation,
        before.normals, before.cut_offsets(), before.plane_start,
    )  # fmt: skip


def _wall_of(domain):
    """(M,) a body that each element is wetted by, -1 = none."""
    wall = np.full(len(domain.cells), -1, dtype=np.int64)
    wall[domain.face_cell] = domain.face_body
    return wall


@njit(cache=True)
def _same_side(
    first, last, point, wall, centroid, old_wall, centre, rotation, new_centre, new_rotation, normals,
    offsets, plane_start,
):  # fmt: skip
    found = np.full(len(first), -1, dtype=np.int64)
    x, local = np.empty(3), np.empty(3)
    for e in range(len(first)):
        nearest = np.inf
        for o in range(first[e], last[e]):
            body = wall[e] if wall[e] >= 0 else old_wall[o]
            for c in range(3):
                x[c] = point[e, c]
            if body >= 0:
                _carry_back(x, centre[body], rotation[body], new_centre[body], new_rotation[body], local)
            distance = 0.0
            for c in range(3):
                distance += (x[c] - centroid[o, c]) ** 2
            if distance >= nearest:
                continue
            if body < 0 or not blocked(
                x, centroid[o], normals, offsets, plane_start[body], plane_start[body + 1]
            ):
                nearest = distance
                found[e] = o
    return found


@inner
def _carry_back(x, centre, rotation, new_centre, new_rotation, local):
    """x <- centre + rotation new_rotation^T (x - new_centre): where a point fixed to the body came from."""
    for i in range(3):
        local[i] = 0.0
        for j in range(3):
            local[i] += new_rotation[j, i] * (x[j] - new_centre[j])
    for i in range(3):
        x[i] = centre[i]
        for j in range(3):
            x[i] += rotation[i, j] * local[j]


@inner
def blocked(a, b, normals, offsets, start, end):
    """Does the segment from a to b pass through the body with planes start:end?"""
    enter, leave = 0.0, 1.0
    for g in range(start, end):
        d_a, d_b = -offsets[g], -offsets[g]
        for c in range(3):
            d_a += normals[g, c] * a[c]
            d_b += normals[g, c] * b[c]
        if d_a >= 0.0 and d_b >= 0.0:
            return False
        if d_a > 0.0:
            enter = max(enter, d_a / (d_a - d_b))
        elif d_b > 0.0:
            leave = min(leave, d_a / (d_a - d_b))
    return enter < leave


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
            root = find(label, 4 * e + k)
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
    """Union-find over the corners 4 e + k of the elements, at nodes that may have several copies.

    With a threshold, groups of cut parts that it has left without a whole cell are then joined across their
    widest opening, until nothing changes: a threshold closes openings, it makes no pockets."""
    label = np.arange(4 * len(parent))
    group = np.arange(len(parent))
    anchored = part < 0
    widest = np.zeros(len(parent))
    # With thresholds areas are compared, so they must be the true ones.
    enough = 1.0 if share > 0.0 else 1e-6
    joined, sweep = True, 0
    while joined:
        joined = False
        for e in range(len(parent)):
            one = parent[e]
            choice = False
            for k in range(4):
                choice = choice or several[cells[one, k]]
            if not choice:
                continue
            for f in range(4):
                two = neighbours[one, f]
                if two < one:
                    continue
                g = 0
                while neighbours[two, g] != one:
                    g += 1
                for other in range(start[two], start[two + 1]):
                    a, b = find(group, e), find(group, other)
                    if sweep > 0 and (a == b or (anchored[a] and anchored[b])):
                        continue
                    area, full = 1.0, 0.0
                    if part[e] >= 0 or part[other] >= 0:
                        area, full = _contact_area(
                            nodes, cells, one, f, part[e], g, part[other], order, open_start, polygon_start,
                            polygon_x, tolerance, enough, w,
                        )  # fmt: skip
                        if area <= least:
                            continue
                    if sweep % 2 == 1:
                        # Odd sweeps find the widest opening of each group, even ones connect it.
                        widest[a] = max(widest[a], area)
                        widest[b] = max(widest[b], area)
                        joined = True
                    elif area > share * full or (
                        sweep > 0
                        and (
                            (area == widest[a] and not anchored[a]) or (area == widest[b] and not anchored[b])
                        )
                    ):
                        _unite_face(cells, one, two, f, e, other, several, label)
                        group[max(a, b)] = min(a, b)
                        anchored[min(a, b)] = anchored[a] or anchored[b]
                        widest[min(a, b)] = 0.0
                        joined = True
        sweep += 1
        joined = joined and share > 0.0
        if sweep % 2 == 1:
            widest[:] = 0.0
    return label


@inner
def _unite_face(cells, one, two, f, e, other, several, label):
    """Make the three nodes of a face common to elements e (cell `one`, face f) and other (cell `two`)."""
    for k in range(4):
        if k == f or not several[cells[one, k]]:
            continue
        for j in range(4):
            if cells[two, j] == cells[one, k]:
                a, b = find(label, 4 * e + k), find(label, 4 * other + j)
                label[max(a, b)] = min(a, b)


@inner
def _load_opening(w, slot, row, polygon_start, polygon_x):
    first = polygon_start[row]
    w.corners[slot] = polygon_start[row + 1] - first
    for k in range(w.corners[slot]):
        for c in range(3):
            w.polygon[slot, k, 4 + c] = polygon_x[first + k, c]


@inner
def _open_area(w, key, order, open_start, polygon_start, polygon_x):
    area = 0.0
    for s in range(open_start[key], open_start[key + 1]):
        _load_opening(w, 0, order[s], polygon_start, polygon_x)
        area += polygon_area(w, 0)
    return area


@inner
def _contact_area(
    nodes, cells, cell, f, part, g, other, order, open_start, polygon_start, polygon_x, tolerance, enough, w
):
    """Area over which two parts touch across the face opposite to corner f of `cell`, area of the face.

    Part -1 is a whole cell; at most one of the two is. A lower bound of the area serves where it exceeds
    the share `enough` of the face."""
    w.corners[0] = 3
    for k in range(3):
        for c in range(3):
            w.polygon[0, k, 4 + c] = nodes[cells[cell, (f + 1 + k) % 4], c]
    o, a, b = w.polygon[0, 0], w.polygon[0, 1], w.polygon[0, 2]
    ax, ay, az = a[4] - o[4], a[5] - o[5], a[6] - o[6]
    bx, by, bz = b[4] - o[4], b[5] - o[5], b[6] - o[6]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    twice = np.sqrt(nx * nx + ny * ny + nz * nz)
    full = twice / 2
    if other < 0:
        return _open_area(w, 4 * part + f, order, open_start, polygon_start, polygon_x), full
    theirs = _open_area(w, 4 * other + g, order, open_start, polygon_start, polygon_x)
    if part < 0:
        return theirs, full
    ours = _open_area(w, 4 * part + f, order, open_start, polygon_start, polygon_x)
    if min(ours, theirs) == 0.0 or max(ours, theirs) >= full * (1 - 1e-12):
        return min(ours, theirs), full
    # Both sides are partly closed, not necessarily in the same place; they share at least this much.
    if ours + theirs > (1 + enough) * full:
        return ours + theirs - full, full
    nx, ny, nz = nx / twice, ny / twice, nz / twice
    area = 0.0
    for s in range(open_start[4 * part + f], open_start[4 * part + f + 1]):
        for t in range(open_start[4 * other + g], open_start[4 * other + g + 1]):
            _load_opening(w, 0, order[s], polygon_start, polygon_x)
            _load_opening(w, 1, order[t], polygon_start, polygon_x)
            area += shared_area(w, 0, 1, nx, ny, nz, tolerance)
    return area, full


@njit(cache=True)
def _components(cells, n_nodes):
    label = np.arange(n_nodes)
    for e in range(len(cells)):
        a = find(label, cells[e, 0])
        for k in range(1, 4):
            b = find(label, cells[e, k])
            if a != b:
                label[max(a, b)] = min(a, b)
                a = min(a, b)
    number = np.full(n_nodes, -1, dtype=np.int64)
    component = np.empty(len(cells), dtype=np.int64)
    found = 0
    for e in range(len(cells)):
        root = find(label, cells[e, 0])
        if number[root] < 0:
            number[root] = found
            found += 1
        component[e] = number[root]
    return component
