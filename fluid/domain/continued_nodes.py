"""The old copy of a node or cell that each new copy continues when solids have moved through multiple covers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array
from fluid.domain.incidence import first_rows
from fluid.domain.moments import cells_touching
from kernels.decorators import inner, kernel


class Walled(NamedTuple):
    """Elements: centroid (M, 3) [m] · wall (M,) a body that each is wetted by, -1 = none."""

    centroid: Array
    wall: Array


class Placed(NamedTuple):
    """Where bodies are: centre (n, 3) [m] · rotation (n, 3, 3) body to world."""

    centre: Array
    rotation: Array


def pick_old_nodes(old, new) -> Array:
    """(N_new,) old virtual node for each new one, -1 = none.

    Away from the bodies a node has one copy before and after. Near them each new element votes with
    min(V_old, V_new) for the node at the same corner of an old element of the same background cell; most
    votes win. Water moves with a wall: the search for the old element starts at the point from which the wall has
    carried the new centroid, takes the nearest element first, and never crosses the wall."""
    n = len(new.memory.mesh.nodes)
    near = _near_bodies(old) | _near_bodies(new)
    only = np.full(n, -1, dtype=np.int64)
    only[old.parent_node] = np.arange(len(old.nodes))
    source = only[new.parent_node]
    voters = cells_touching(near[new.parent_node], new.cells)
    matched = _old_elements(old, new, voters)
    chosen = near[new.parent_node]
    copies = np.searchsorted(old.parent_node, np.arange(n + 1))
    elected = _elected(voters, matched, new.cells, old.cells, new.volume, old.volume, new.parent_node, copies)
    source[chosen] = elected[chosen]
    return source


def pick_old_cells(old, new, source) -> Array:
    """(M_new,) row of the old cell of the same background cell that each new one continues: the copy with the most
    corners in common, and of those the largest; -1 = none.

    source (N_new,): old node of each new one (`pick_old_nodes`). A copy may be a sliver between two blocks, whose water
    is fast and next to nothing in volume."""
    start = first_rows(old.parent_cell, len(old.memory.mesh.cells))
    return _continued_cells(source, new.cells, new.parent_cell, old.cells, old.volume, start)


@kernel
def _continued_cells(source, cells, parent, old_cells, old_volume, start):
    found = np.full(len(cells), -1, np.int64)
    for e in range(len(cells)):
        most, largest = 0, 0.0
        for o in range(start[parent[e]], start[parent[e] + 1]):
            common = 0
            for a in range(4):
                common += source[cells[e, a]] == old_cells[o, a]
            if common > most or (common == most and common > 0 and old_volume[o] > largest):
                most, largest, found[e] = common, old_volume[o], o
    return found


def _near_bodies(domain):
    """(background nodes,) bool: nodes of cells that a body meets."""
    memory = domain.memory
    near = np.zeros(len(memory.mesh.nodes), dtype=bool)
    near[memory.mesh.cells[memory.pair_cell]] = True
    return near


@kernel
def _elected(voters, matched, cells, old_cells, volume, old_volume, parent_node, copies):
    """Winner of the votes for every new node, -1 where nobody voted.

    copies (nodes + 1,): first old copy of each background node; these copies are the candidates."""
    start = np.zeros(len(parent_node) + 1, np.int64)
    for i in range(len(parent_node)):
        start[i + 1] = start[i] + copies[parent_node[i] + 1] - copies[parent_node[i]]
    votes = np.full(start[-1], -1.0)
    for s in range(len(voters)):
        e, o = voters[s], matched[s]
        if o < 0:
            continue
        weight = min(old_volume[o], volume[e])
        for k in range(4):
            i = cells[e, k]
            slot = start[i] + old_cells[o, k] - copies[parent_node[i]]
            votes[slot] = max(votes[slot], 0.0) + weight
    elected = np.full(len(parent_node), -1, np.int64)
    for i in range(len(parent_node)):
        most = 0.0
        for slot in range(start[i], start[i + 1]):
            if votes[slot] >= most:
                most = votes[slot]
                elected[i] = copies[parent_node[i]] + slot - start[i]
    return elected


def _old_elements(old, new, chosen):
    """Old element in the same background cell for each chosen new one, -1 where there is none."""
    cell = new.parent_cell[chosen]
    start = first_rows(old.parent_cell, len(old.memory.mesh.cells))
    first, last = start[cell], start[cell + 1]
    before, after = (Placed(d.memory.bodies.centre, d.memory.bodies.rotation) for d in (old, new))
    sought = Walled(new.centroid_of(chosen), _wall_of(new)[chosen])
    rows = _joined(first, last, len(old.cells))
    known = Walled(old.centroid_of(rows), _wall_of(old)[rows])
    place = np.searchsorted(rows, first)
    found = _same_side(place, place + last - first, sought, known, before, after, old.memory.bodies.planes())
    return np.where(found >= 0, np.append(rows, -1)[found], -1)


@kernel
def _joined(first, last, n):
    """All numbers below n from one of the `first` (k,) to before the `last` (k,) of its range, in order."""
    within = np.zeros(n, np.bool_)
    for k in range(len(first)):
        for i in range(first[k], last[k]):
            within[i] = True
    return np.flatnonzero(within)


def _wall_of(domain):
    """(M,) a body that each element is wetted by, -1 = none."""
    wall = np.full(len(domain.cells), -1, dtype=np.int64)
    wall[domain.face_cell] = domain.face_body
    return wall


@kernel
def _same_side(first, last, sought, old, before, after, planes):
    point, wall = sought
    centroid, old_wall = old
    centre, rotation = before
    new_centre, new_rotation = after
    normals, offsets, plane_start = planes
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
    """x <- centre + rotation new_rotation^T (x - new_centre): the earlier place of a point fixed to the body."""
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
    """Whether the segment from a to b passes through the body with planes start:end."""
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
