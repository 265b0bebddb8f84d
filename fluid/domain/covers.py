"""Multiple covers: every node gets one set of unknowns per connected component of its star minus the solids.

The finite cover method separates the mathematical mesh from the physical domain. Here the covers become an
ordinary mesh, the *virtual mesh*: elements are the whole fluid cells and each connected part of each cut
cell; corners of elements in neighbouring cells are the same virtual node if the two parts touch across
their common face. A wall thinner than a cell then separates the water on its two sides exactly.

Two parts touch across a face where their open polygons overlap by more than `Connection.face` of its area;
two pieces within a cell are one part where they touch over more than `Connection.inner` h^2. Thresholds
above zero cure the free edges of thin plates (an opening of any width would otherwise act as one about a
cell wide) and close openings narrower than about a cell, so they are off by default. They do not count between
parts that lie on faces of solids of the same direction: a wall a third of a cell behind a layer of nodes leaves the
cells slivers that share a tenth of their faces. Apart from the water before them, slivers carried pressure along the
wall in the way of a pipe: a sheet of water on a plate pushed 2 to 7 % too hard, the longer it was.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from array_types import Array, Bools, Floats, Ints
from fluid.cut.parts_of_cell import root as find
from kernels.decorators import inner, kernel

# Areas of contact below this share of h^2 are round-off.
NO_AREA = 1e-12
# Cosine of the angle within which the normals of polygons belong to one face.
ONE_SIDE = 0.5
# Share of the area of a part's polygons that may look another way.
TURNED = 0.01


@dataclass(frozen=True)
class Connection:
    """Thresholds of the multiple covers: when touching fluid parts count as one.

    inner: pieces of a cell touch over more than inner h^2 (see WIDE_OPENINGS)
    face: parts of two cells overlap by more than this share of the face (0.2 for thin plates)
    spares: any area counts beside slits, where a face of a solid lies opposite to another one or to a side of the tank
    within this number of cell sizes; 0: nowhere
    pocket: components of the water with less than pocket h^3 are dropped (their own pressure is insignificant, and a
    closed one makes the pressure system singular)."""

    inner: float = 0.0
    face: float = 0.0
    spares: float = 0.0
    pocket: float = 1e-3

    @property
    def enough(self) -> float:
        """Share of a face above which a lower bound of the area suffices; areas that are compared must be exact."""
        return 1.0 if self.face > 0.0 else 1e-6

    def link_area(self, spacing):
        """[m2] area over which two pieces of a cell must touch; spacing [m], its size, one or (n,)."""
        return max(self.inner, NO_AREA) * spacing**2

    def link_area_in_slits(self, spacing):
        """`link_area` beside slits [m2]."""
        return NO_AREA * spacing**2


WIDE_OPENINGS = Connection(inner=0.35, face=0.35)
"""For thin plates with free edges: added mass of a plate 0.3 h thick and 2.8, 5.6, 8 h wide 0.8, 0.93, 1.0 of theory
(0.1, 0.4, 0.6 without thresholds), load beside a free edge off by 0.003 of rho g b (0.027 at h = 1/8); openings of thin
walls that are narrower than about a cell are closed."""
EDGES_APART = Connection(inner=0.35, face=0.35, spares=1.0)
"""Thresholds as above beside free edges, while slits between solids and films under blocks stay open."""
OPENINGS = {"all": Connection(), "wide": WIDE_OPENINGS, "edges": EDGES_APART}
"""The thresholds by the names that a case file uses."""


class VirtualElements(NamedTuple):
    """parent (M,) background cell of each element, ascending · part (M,) row of its cut part, -1 whole · start
    (cells + 1,) first element of each cell · in_slit (M,) bool: its contacts count over any area · beside (M, 3): of
    `lies_on`; both are read where thresholds count alone, and empty elsewhere."""

    parent: Ints
    part: Ints
    start: Ints
    in_slit: Bools
    beside: Floats


def virtual_cells(mesh, elements, contacts, connection, part_in_slit, part_beside) -> tuple[Array, Array]:
    """Nodes of the virtual elements.

    mesh: Background · elements: `physical_domain.Elements` · contacts: Contacts · connection: Connection
    part_in_slit (K,) bool: cut parts beside slits, whose contacts count over any area
    part_beside (K, 3): normal of the face that each cut part lies on, zero beside an edge (`lies_on`)
    -> cells (M, 4), parent_node (N,)."""
    several = _nodes_with_choice(mesh.cells, elements.part, elements.start, len(mesh.nodes))
    in_slit, beside = np.zeros(0, bool), np.zeros((0, 3))
    if connection.face > 0.0:  # without a threshold all contacts count alike
        in_slit = np.append(part_in_slit, False)[elements.part]
        beside = np.append(part_beside, np.zeros((1, 3)), axis=0)[elements.part]
    virtual = VirtualElements(elements.parent, elements.part, elements.start, in_slit, beside)
    least = NO_AREA * mesh.spacing**2
    label = _unite_corners(mesh.cells, mesh.neighbours, virtual, several, contacts, connection.face, least)
    return _numbered(mesh.cells, elements.parent, several, label, len(mesh.nodes))


def lies_on(part, normal, area, n_parts: int) -> Array:
    """(K, 3): mean normal of the wetted polygons of each cut part where all but TURNED of their area lies within 60
    degrees of it, else zero.

    part (S,) row of the part of each polygon, normal (S, 3), area (S,) [m2]."""
    mean = np.zeros((n_parts, 3))
    for k in range(3):
        mean[:, k] = np.bincount(part, area * normal[:, k], minlength=n_parts)
    mean /= np.maximum(np.linalg.norm(mean, axis=1), 1e-300)[:, None]
    turned = np.einsum("sk,sk->s", normal, mean[part]) < ONE_SIDE
    away = np.bincount(part[turned], area[turned], minlength=n_parts)
    mean[away > TURNED * np.bincount(part, area, minlength=n_parts)] = 0.0
    return mean


def components(cells, n_nodes: int) -> Array:
    """(M,) number of the connected component (by shared nodes) of each cell (M, 4)."""
    return _components(cells, n_nodes)


def without_pockets(cells, volume, n_nodes: int, least) -> Array:
    """(M,) bool: the cell belongs to a component of at least that volume [m3]; volume (M,) [m3], least [m3]
    one or (M,): that of the largest cell of the component counts.

    A cell that reaches the volume alone keeps all its neighbours, so only smaller cells are joined into components."""
    keep = volume >= least
    small = np.flatnonzero(~keep)
    least = np.broadcast_to(least, volume.shape)
    if len(small):
        label, kept = _small_components(cells, small, keep, n_nodes)
        total = np.bincount(label, volume[small], minlength=len(kept))
        needed = np.zeros(len(kept))
        np.maximum.at(needed, label, least[small])
        keep[small] = (kept | (total >= needed))[label]
    return keep


@kernel
def _nodes_with_choice(cells, part, start, n_nodes):
    """(nodes,) bool: nodes of cells that are cut or solid; only these can have other than one copy."""
    several = np.zeros(n_nodes, np.bool_)
    for one in range(len(cells)):
        if start[one + 1] - start[one] != 1 or part[start[one]] >= 0:
            for k in range(4):
                several[cells[one, k]] = True
    return several


@kernel
def _numbered(cells, parent, several, label, n_nodes):
    """Number the copies by background node, then by first element -> cells (M, 4), parent_node (N,)."""
    copies = np.zeros(n_nodes, np.int64)
    number = np.zeros((len(parent), 4), np.uint32)
    for e in range(len(parent)):
        for k in range(4):
            node = cells[parent[e], k]
            if not several[node]:
                copies[node] = 1
                continue
            root = find(label, 4 * e + k)
            if root == 4 * e + k:
                number[e, k] = copies[node]
                copies[node] += 1
            else:
                # Roots are the smallest corner of their set, hence numbered before.
                number[e, k] = number[root // 4, root % 4]
    last = np.cumsum(copies)
    parent_node = np.empty(last[-1], np.int64)
    for node in range(n_nodes):
        parent_node[last[node] - copies[node] : last[node]] = node
    for e in range(len(parent)):
        for k in range(4):
            node = cells[parent[e], k]
            number[e, k] += np.uint32(last[node] - copies[node])
    return number, parent_node


@kernel
def _unite_corners(cells, neighbours, elements, several, contacts, share, least):
    """Union-find over the corners 4 e + k of the elements, at nodes that may have several copies.

    elements: VirtualElements · contacts: Contacts of cut parts, in the order of this search.
    With a threshold, groups of cut parts without a whole cell are then joined across their widest opening, until
    nothing changes: a threshold closes openings but creates no pockets."""
    parent, part, start, slit, beside = elements
    areas, fulls = contacts.area, contacts.full
    label = np.arange(4 * len(parent))
    group = np.arange(len(parent) if share > 0.0 else 0)
    anchored = part < 0
    widest = np.zeros(len(group))
    joined, sweep = True, 0
    while joined:
        joined, contact = False, 0
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
                for other in range(start[two], start[two + 1]):
                    area, full = 1.0, 0.0
                    if part[e] >= 0 or part[other] >= 0:
                        area, full = areas[contact], fulls[contact]
                        contact += 1
                        if area <= least:
                            continue
                    if share <= 0.0:
                        _unite_face(cells, one, two, f, e, other, several, label)
                        continue
                    a, b = find(group, e), find(group, other)
                    if sweep > 0 and (a == b or (anchored[a] and anchored[b])):
                        continue
                    if sweep % 2 == 1:
                        # Odd sweeps find the widest opening of each group, even ones connect it.
                        widest[a] = max(widest[a], area)
                        widest[b] = max(widest[b], area)
                        joined = True
                    elif area > (
                        0.0 if slit[e] or slit[other] or _same_side(beside, e, other) else share
                    ) * full or (
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
        if sweep % 2 == 1:
            widest[:] = 0.0
    return label


@inner
def _same_side(beside, e, other):
    """True if both elements lie on faces of solids that look the same way; beside (M, 3)."""
    along = 0.0
    for k in range(3):
        along += beside[e, k] * beside[other, k]
    return along > ONE_SIDE


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


@kernel
def _small_components(cells, small, keep, n_nodes):
    """Component of each of the small cells (n,) among themselves, and whether each touches a kept cell."""
    beside = np.zeros(n_nodes, np.bool_)
    for e in range(len(cells)):
        if keep[e]:
            for k in range(4):
                beside[cells[e, k]] = True
    label = np.arange(len(small))
    first = np.full(n_nodes, -1, np.int64)
    for s in range(len(small)):
        for k in range(4):
            node = cells[small[s], k]
            if first[node] < 0:
                first[node] = s
            a, b = find(label, s), find(label, first[node])
            label[max(a, b)] = min(a, b)
    kept = np.zeros(len(small), np.bool_)
    for s in range(len(small)):
        label[s] = find(label, s)
        for k in range(4):
            kept[label[s]] |= beside[cells[small[s], k]]
    return label, kept


@kernel
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
