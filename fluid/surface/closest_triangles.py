"""Squared distances of nodes from the triangles of a surface, handed on from layer to layer.

The corners of the cells that the surface passes through test the triangles of these cells. A node of a farther layer
tests those that its neighbours hold as their closest, in two sweeps over its layer: in the first, neighbours of earlier
layers and those before it in its own; in the second, neighbours of its own layer that hold another triangle than it has
tested. So each node depends on those before it in its layer. What is handed on need not be the closest of all; nodes
that are told to (`Descent`) go on from there through cells with a common node, unless they stand right above the
triangle.

Threads share a sweep nevertheless, and find what one thread finds, bit for bit. Each takes a part of the layer and does
without the neighbours in the parts before it, and marks the nodes that have any. These few are then done again in the
order of the layer, with all neighbours; where one finds another triangle now, so are its neighbours after it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Floats, Integers, Ints
from fluid.domain.layers import WORK, Layers
from kernels.decorators import inlined, inner, kernel, plain, ranged, released
from kernels.threads import over, owning, reach_of_cells

TESTED = 64
"""Number of places in which the triangles that a node has tested are noted."""
NOTED = 256
"""The same of the cells that a descent has gone through."""
FIRST, SECOND = 0, 1
BESIDE = 1e-6
"""Share by which a squared distance may exceed that from the plane of the triangle and still count as the same."""
TESTS = 5
"""Cost of a node and a sweep, in visits of its neighbours."""


@plain
def squared_distance(p, t):
    """Squared distance [m²] from the point p (3,) to the triangle t (3, 3) (Ericson, Real-Time Collision
    Detection (2005), 5.1.5).  It uses scalars only, since it is called millions of times a second."""
    abx, aby, abz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    acx, acy, acz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    apx, apy, apz = p[0] - t[0, 0], p[1] - t[0, 1], p[2] - t[0, 2]
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    ab2 = abx * abx + aby * aby + abz * abz
    ac2 = acx * acx + acy * acy + acz * acz
    abac = abx * acx + aby * acy + abz * acz
    d3, d4, d5, d6 = d1 - ab2, d2 - abac, d1 - abac, d2 - ac2
    va, vb, vc = d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2
    v, w = 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        v = 1.0
    elif d6 >= 0.0 and d5 <= d6:
        w = 1.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0 and ab2 > 0.0:
        v = _ratio(d1, d1 - d3)
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0 and ac2 > 0.0:
        w = _ratio(d2, d2 - d6)
    elif va <= 0.0 and d4 >= d3 and d5 >= d6:
        w = _ratio(d4 - d3, (d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        v, w = _ratio(vb, va + vb + vc), _ratio(vc, va + vb + vc)
    x, y, z = apx - v * abx - w * acx, apy - v * aby - w * acy, apz - v * abz - w * acz
    return x * x + y * y + z * z


@inner
def _ratio(part, whole):
    """part / whole; 0 for an edge or a triangle without extent."""
    return part / whole if whole > 0.0 else 0.0


class Surface(NamedTuple):
    """triangles (T, 3, 3) [m] · owner (T,) the cell of each; those of a cell follow each other."""

    triangles: Floats
    owner: Ints


class Descent(NamedTuple):
    """Places (k,) in layers of the nodes that go on from the triangle handed to them to the closest of all, and the
    cells of each node: start (N + 1,), cells."""

    places: Ints
    node_start: Integers
    node_cells: Integers


class Nearest(NamedTuple):
    """What the nodes in layers hold, by their places: closest (n,) number of a triangle, -1 none · square (n,) [m²] its
    squared distance, ∞ for none."""

    closest: Array
    square: Array


def squared_distances(layers: Layers, surface: Surface, mesh, around, descent: Descent | None) -> Floats:
    """Squared distance [m²] of each node in layers from the closest triangle that was handed to it (n,), ∞ where there
    is none.

    mesh: Corners · around: start (N + 1,), neighbours of each node · descent: nodes that go on from there."""
    n = len(layers.order)
    once, known = (Nearest(np.empty(n, np.int32), np.empty(n)) for _ in range(2))
    first = layers.start[1]
    known.closest[:first], known.square[:first] = -1, np.inf
    reach, count = reach_of_cells(surface.owner, mesh.cells), len(surface.owner)
    owning(_of_corners, len(mesh.nodes), reach, count, surface, mesh, layers.place, known, weight=WORK)
    behind = np.empty(n, bool)
    for layer, count in enumerate(np.diff(layers.start).tolist()[1:], 1):
        for sweep in (FIRST, SECOND):
            rows = (layer, sweep, layers, surface.triangles, mesh.nodes, around, once, known, behind)
            starts = over(_sweep, count, *rows, weight=TESTS * WORK, pieces=1)
            if len(starts) > 1:
                _mend(starts[1], count, *rows)
    if descent is not None:
        triangle_of, count = np.empty(len(mesh.cells), np.int32), len(descent.places)
        over(_first_triangles, len(surface.owner), surface.owner, triangle_of)
        over(_descended, count, layers.order, surface, triangle_of, mesh, descent, known, weight=TESTS * WORK)
    return known.square


@ranged
def _of_corners(first, last, runs, surface, mesh, place, known):
    """Nodes of a range test the triangles of their own cells."""
    triangles, owner = surface
    nodes, cells = mesh
    for run in range(runs.shape[0]):
        for t in range(runs[run, 0], runs[run, 1]):
            for a in range(4):
                i = cells[owner[t], a]
                if first <= i < last:
                    d, s = squared_distance(nodes[i], triangles[t]), place[i]
                    if d < known.square[s]:
                        known.square[s], known.closest[s] = d, t


@released
def _sweep(first, last, layer, sweep, layers, triangles, nodes, around, once, known, behind):
    """Sweep over a part of a layer; → where it begins. behind (n,) bool: places of nodes with neighbours in the parts
    before."""
    tested = np.full(TESTED, -1)
    _swept(first, last, layer, sweep, layers, triangles, nodes, around, once, known, behind, tested)
    return first


@inner
def _swept(first, last, layer, sweep, layers, triangles, nodes, around, once, known, behind, tested):
    out, begin = once if sweep == FIRST else known, layers.start[layer]
    for s in range(begin + first, begin + last):
        out.closest[s], out.square[s], behind[s] = _tested(
            s, begin + first, layer, sweep, layers, triangles, nodes, around, once, known, tested
        )


@kernel
def _mend(first, last, layer, sweep, layers, triangles, nodes, around, once, known, behind):
    """Do those nodes of a layer again, from its node `first` on, that have neighbours in the parts before, and those
    that come after one that finds something else now."""
    tested = np.full(TESTED, -1)
    _mended(first, last, layer, sweep, layers, triangles, nodes, around, once, known, behind, tested)


@inner
def _mended(first, last, layer, sweep, layers, triangles, nodes, around, once, known, behind, tested):
    out = once if sweep == FIRST else known
    order, of_layers, place = layers
    start, neighbours = around
    begin, end = of_layers[layer], of_layers[layer + 1]
    for s in range(begin + first, begin + last):
        if not behind[s]:
            continue
        closest, square, _ = _tested(
            s, begin, layer, sweep, layers, triangles, nodes, around, once, known, tested
        )
        if closest != out.closest[s] or square != out.square[s]:
            out.closest[s], out.square[s] = closest, square
            for t in range(start[order[s]], start[order[s] + 1]):
                p = place[neighbours[t]]
                if s < p < end:
                    behind[p] = True


@inlined
def _tested(s, part, layer, sweep, layers, triangles, nodes, around, once, known, tested):
    """Number of the closest triangle that the node at place s finds, and the squared distance; and whether it has
    neighbours in its layer before the place `part`, which are left out.

    once, known: Nearest after the first sweep and after both · tested: what was tested is noted here, since most
    neighbours hold the same triangles."""
    order, of_layers, place = layers
    begin, end = of_layers[layer], of_layers[layer + 1]
    start, neighbours = around
    i, behind = np.uint64(order[s]), False
    closest, square = np.int32(-1), np.inf
    if sweep == SECOND:
        closest, square = once.closest[s], once.square[s]
    for t in range(start[i], start[i + np.uint64(1)]):
        p = np.int64(place[neighbours[t]])
        if p < 0:
            continue
        q = np.uint64(p)
        if p < begin:
            if sweep == SECOND:
                continue
            c = known.closest[q]
        elif p < s:
            if p < part:
                behind = True
                continue
            c = once.closest[q] if sweep == FIRST else known.closest[q]
            if sweep == SECOND and c == once.closest[q]:
                continue
        elif sweep == FIRST or p >= end:
            continue
        else:
            c = once.closest[q]
        if c < 0:
            continue
        mark, note = s * triangles.shape[0] + c, np.uint64(c % TESTED)
        if tested[note] == mark:
            continue
        tested[note] = mark
        d = squared_distance(nodes[i], triangles[np.uint64(c)])
        if d < square:
            square, closest = d, c
    return closest, square, behind


@released
def _descended(first, last, order, surface, triangle_of, mesh, descent, known):
    _descend_all(first, last, order, surface, triangle_of, mesh, descent, known, np.full(NOTED, -1))


@inner
def _descend_all(first, last, order, surface, triangle_of, mesh, descent, known, noted):
    """The loop over places in the descent; noted (NOTED,): work space."""
    for k in range(first, last):
        s = descent.places[k]
        x, closest, square = mesh.nodes[order[s]], known.closest[s], known.square[s]
        if closest >= 0 and not _above(x, surface.triangles[closest], square):
            of_nodes = (descent.node_start, descent.node_cells)
            known.square[s] = _descend(
                x, k, closest, square, surface, triangle_of, mesh.cells, of_nodes, noted
            )


@inner
def _above(p, t, square):
    """Whether the squared distance [m²] of the point p (3,) from the triangle t (3, 3) is that from its plane."""
    abx, aby, abz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    acx, acy, acz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    nx, ny, nz = aby * acz - abz * acy, abz * acx - abx * acz, abx * acy - aby * acx
    height = (p[0] - t[0, 0]) * nx + (p[1] - t[0, 1]) * ny + (p[2] - t[0, 2]) * nz
    return square * (nx * nx + ny * ny + nz * nz) <= (1.0 + BESIDE) * height * height


@ranged
def _first_triangles(first, last, owner, found):
    """The first triangle of each cell that has one, in `found` (n_cells,); the others hold anything."""
    for k in range(first, last):
        if k == 0 or owner[k - 1] != owner[k]:
            found[owner[k]] = k


@inlined
def _descend(x, own, closest, best, surface, first, cells, cells_of_nodes, noted):
    """Squared distance [m²] of x (3,) to the closest triangle that can be reached from `closest`, at the squared
    distance `best`, through cells with a common node, always coming closer.

    first (n_cells,): the first triangle of each cell that has one; others hold anything · noted: places where cells
    that were gone through are noted, with the number `own` of x."""
    triangles, owner = surface
    node_start, node_cells = cells_of_nodes
    before = -1
    while closest != before:
        before = closest
        for a in range(4):
            i = np.uint64(cells[owner[before], a])
            for s in range(node_start[i], node_start[i + np.uint64(1)]):
                e = np.int64(node_cells[s])
                mark, note = own * first.shape[0] + e, np.uint64(e % NOTED)
                if noted[note] == mark:
                    continue
                noted[note] = mark
                t = np.int64(first[np.uint64(e)])
                if not 0 <= t < owner.shape[0] or owner[t] != e:
                    continue
                while t < owner.shape[0] and owner[t] == e:
                    d = squared_distance(x, triangles[t])
                    if d < best:
                        best, closest = d, t
                    t += 1
    return best
