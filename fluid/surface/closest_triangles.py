"""Squared distances of nodes from the triangles of a surface, handed on from layer to layer.

The corners of the cells that the surface passes through test the triangles of these cells. A node of a farther layer
tests those that its neighbours hold as their closest, in two sweeps over its layer: in the first, neighbours of earlier
layers and those before it in its own; in the second, neighbours of its own layer that hold another triangle than it has
tested. So each node depends on those before it in its layer. What is handed on need not be the closest of all; nodes
that are told to go on from there through cells with a common node, unless they stand right above the triangle.

Threads share a sweep nevertheless, and find what one thread finds, bit for bit. Each takes a part of the layer and does
without the neighbours in the parts before it, and marks the nodes that have any. These few are then done again in the
order of the layer, with all neighbours; where one finds another triangle now, so are its neighbours after it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Floats, Ints
from fluid.domain.layers import WORK, Layers
from kernels.decorators import inlined, inner, kernel, ranged, released
from kernels.threads import over, owning, reach_of_cells

TESTED = 64
"""Number of places in which the triangles that a node has tested are noted."""
NOTED = 256
"""The same of the triangles, and of the nodes, that a descent has gone through."""
FIRST, SECOND = 0, 1
BESIDE = 1e-6
"""Share by which a squared distance may exceed that from the plane of the triangle and still count as the same; and
that by which the one from its box must exceed the least one so far, before the triangle cannot be closer."""
TESTS = 5
"""Cost of a node and a sweep, in visits of its neighbours."""


@inlined
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


class Nearest(NamedTuple):
    """What the nodes in layers hold, by their places: closest (n,) number of a triangle, -1 none · square (n,) [m²] its
    squared distance, ∞ for none."""

    closest: Array
    square: Array


def squared_distances(layers: Layers, surface: Surface, mesh, around, descending: Ints | None) -> Floats:
    """Squared distance [m²] of each node in layers from the closest triangle that was handed to it (n,), ∞ where there
    is none.

    mesh: Corners · around: start (N + 1,), neighbours of each node · descending (k,): places in layers of the nodes
    that go on from there to the closest of all."""
    n = len(layers.order)
    once, known = (Nearest(np.empty(n, np.int32), np.empty(n)) for _ in range(2))
    first = layers.start[1]
    known.closest[:first], known.square[:first] = -1, np.inf
    reach, count, found = (
        reach_of_cells(surface.owner, mesh.cells),
        len(surface.owner),
        np.zeros(first, np.int64),
    )
    owning(_of_corners, len(mesh.nodes), reach, count, surface, mesh, layers.place, known, found, weight=WORK)
    behind = np.empty(n, bool)
    for layer, count in enumerate(np.diff(layers.start).tolist()[1:], 1):
        for sweep in (FIRST, SECOND):
            rows = (layer, sweep, layers, surface.triangles, mesh.nodes, around, once, known, behind)
            starts = over(_sweep, count, *rows, weight=TESTS * WORK, pieces=1)
            if len(starts) > 1:
                _mend(starts[1], count, *rows)
    if descending is not None:
        near, boxes = _triangles_around(layers, surface, mesh, found), np.empty((len(surface.owner), 2, 3))
        over(_box, len(boxes), surface.triangles, boxes)
        places = (descending, layers.order, layers.place)
        over(_descended, len(descending), *places, surface, boxes, near, mesh, known, weight=TESTS * WORK)
    return known.square


@ranged
def _of_corners(first, last, runs, surface, mesh, place, known, found):
    """Nodes of a range test the triangles of their own cells; how many these are is added to `found`, by place."""
    triangles, owner = surface
    nodes, cells = mesh
    for run in range(runs.shape[0]):
        for t in range(runs[run, 0], runs[run, 1]):
            for a in range(4):
                i = cells[owner[t], a]
                if first <= i < last:
                    d, s = squared_distance(nodes[i], triangles[t]), place[i]
                    found[s] += 1
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


class Around(NamedTuple):
    """Triangles of the cells around each node of layer 0, in ascending order: start (n + 1,) by the place of the node,
    triangle."""

    start: Ints
    triangle: Ints


def _triangles_around(layers: Layers, surface: Surface, mesh, found) -> Around:
    """found (n,): how many there are around each node of layer 0."""
    start = np.zeros(len(found) + 1, np.int64)
    np.cumsum(found, out=start[1:])
    filled, triangle = start[:-1].copy(), np.empty(start[-1], np.int32)
    reach, count = reach_of_cells(surface.owner, mesh.cells), len(surface.owner)
    rows = (surface.owner, mesh.cells, layers.place, filled, triangle)
    owning(_listed_around, len(mesh.nodes), reach, count, *rows)
    return Around(start, triangle)


@ranged
def _listed_around(first, last, runs, owner, cells, place, filled, triangle):
    for run in range(runs.shape[0]):
        for t in range(runs[run, 0], runs[run, 1]):
            for a in range(4):
                i = cells[owner[t], a]
                if first <= i < last:
                    s = place[i]
                    triangle[filled[s]] = t
                    filled[s] += 1


@ranged
def _box(first, last, triangles, boxes):
    """Least and largest coordinates (2, 3) of each triangle."""
    for t in range(first, last):
        for k in range(3):
            a, b, c = triangles[t, 0, k], triangles[t, 1, k], triangles[t, 2, k]
            boxes[t, 0, k], boxes[t, 1, k] = min(min(a, b), c), max(max(a, b), c)


@released
def _descended(first, last, descending, order, place, surface, boxes, near, mesh, known):
    noted = np.full(NOTED, -1), np.full(NOTED, -1)
    _descend_all(first, last, descending, order, place, surface, boxes, near, mesh, known, noted)


@inner
def _descend_all(first, last, descending, order, place, surface, boxes, near, mesh, known, noted):
    """The loop over the places `descending` (k,); noted: work space, twice (NOTED,)."""
    for k in range(first, last):
        s = np.uint64(descending[k])
        x, closest, square = mesh.nodes[np.uint64(order[s])], np.int64(known.closest[s]), known.square[s]
        if closest >= 0 and not _above(x, surface.triangles[closest], square):
            known.square[s] = _descend(x, k, closest, square, place, surface, boxes, near, mesh, noted)


@inner
def _above(p, t, square):
    """Whether the squared distance [m²] of the point p (3,) from the triangle t (3, 3) is that from its plane; one
    without area has none."""
    abx, aby, abz = t[1, 0] - t[0, 0], t[1, 1] - t[0, 1], t[1, 2] - t[0, 2]
    acx, acy, acz = t[2, 0] - t[0, 0], t[2, 1] - t[0, 1], t[2, 2] - t[0, 2]
    nx, ny, nz = aby * acz - abz * acy, abz * acx - abx * acz, abx * acy - aby * acx
    height = (p[0] - t[0, 0]) * nx + (p[1] - t[0, 1]) * ny + (p[2] - t[0, 2]) * nz
    area = nx * nx + ny * ny + nz * nz
    return area > 0.0 and square * area <= (1.0 + BESIDE) * height * height


@inlined
def _descend(x, own, closest, best, place, surface, boxes, near, mesh, noted):
    """Squared distance [m²] of x (3,) to the closest triangle that can be reached from `closest`, at the squared
    distance `best`, through cells with a common node, always coming closer.

    A triangle whose box (2, 3) is farther than `best` is passed by · noted: places where the triangles and nodes that
    were gone through are noted, with the number `own` of x."""
    (triangles, owner), (start, around), (tested, visited) = surface, near, noted
    n_triangles, n_nodes = triangles.shape[0], mesh.nodes.shape[0]
    x0, x1, x2 = x[0], x[1], x[2]
    before, limit = np.int64(-1), best * (1.0 + BESIDE)
    while closest != before:
        before = closest
        for a in range(4):
            i = np.int64(mesh.cells[owner[before], a])
            mark, note = own * n_nodes + i, np.uint64(i % NOTED)
            if visited[note] == mark:
                continue
            visited[note] = mark
            q = np.uint64(place[np.uint64(i)])
            for s in range(start[q], start[q + np.uint64(1)]):
                t = np.uint64(around[np.uint64(s)])
                mark, note = own * n_triangles + np.int64(t), t % np.uint64(NOTED)
                if tested[note] == mark:
                    continue
                tested[note] = mark
                dx = max(max(boxes[t, 0, 0] - x0, x0 - boxes[t, 1, 0]), 0.0)
                dy = max(max(boxes[t, 0, 1] - x1, x1 - boxes[t, 1, 1]), 0.0)
                dz = max(max(boxes[t, 0, 2] - x2, x2 - boxes[t, 1, 2]), 0.0)
                if dx * dx + dy * dy + dz * dz > limit:
                    continue
                d = squared_distance(x, triangles[t])
                if d < best:
                    best, closest, limit = d, np.int64(t), d * (1.0 + BESIDE)
    return best
