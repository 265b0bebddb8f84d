"""The level set φ [m], negative in the water: the signed distance to the surface, maintained only near it.

Nodes of cells that the surface passes through keep φ: their zero is the surface, and moving them by the true
closest point pulls the surface off the walls (0.2 m/s in a tilted tank at rest).  Only where the mean |∇φ| around
such a node has left [0.9, 1.1] is φ divided by it, and not at dry nodes of a bed (see below).  All other nodes take the
distance to the closest polygon of the surface, which is passed on from layer to layer; beyond the layers φ = ±FAR h.

A node takes over the closest polygon of a neighbour, which may lie some polygons away from its own closest one. There φ
is too large by 0.02 h to 0.15 h. Where cells are obtuse, its gradient in the cells above and below the surface then
deviates so much from the normal that velocity along still water lifts the surface (growth of 0.005 a step). And which
polygon a neighbour hands on, of two that are as close to it, is a matter of the last digit: two dam breaks that
differed by 1e-16 m differed by 0.02 h in the step after. The nodes of the first layers therefore search the polygons
around the one taken over until none is closer, unless they stand right above it. On a surface that is nearly flat over
a cell, this finds the closest of all.

A surface that meets a solid goes on inside it as far as cells reach that the solid cuts. Where a bed that climbs passes
a layer of nodes these cells end, and the first node of the next layer, inside the bed, is a cell or more from the last
polygon, though the plane of the surface passes a tenth of a cell from it. With that distance the surface cannot go on:
the tongue of a run-up stood upright there. In water slower than the wave of a cell such a node takes φ from that plane
(`_past_the_last_polygon`); the surface of a splash is not that of the plane a cell farther on.

So it is ahead of a tongue on a sloping bed of the mesh. The first dry node along the bed is a cell from the
last polygon, and a fifth of that or less from its plane. With the distance, the surface between the last wet node of a
thin tongue and that node stands upright beside the wet one: the tip is a wall of water as high as the tongue, is driven
by its pressure, runs ahead and breaks up. So φ goes on with the slope of the tip from the line where it meets the bed
(Xu and Ren, Commun. Comput. Phys. 20 (2016) 1163). It is taken no flatter than LEAST_SLOPE: it only tells how far a tip
reaches into its cell, and with a flatter one the smallest shift of the surface wets the next cell by a film. Dividing
such a node by its mean slope undoes this: a node too high beside thin water has a slope below one, grows each time, and
the tip stops before it (72 mm at 0.1 m from water 7 mm deep).
"""

from __future__ import annotations

import numpy as np

from fluid.domain.layers import layers_around
from fluid.mesh.arrays import Corners
from fluid.numerics.fields import copied
from fluid.surface.closest_triangles import Surface, squared_distances
from fluid.surface.extrapolation import continue_outward, mean_gradients
from kernels.decorators import ranged, released
from kernels.threads import found_over, joined, over, owning, reach_of_cells

LAYERS = 6
EXACT_LAYERS = 2
"""Layers that look for their own closest polygon: those next to the surface, which transport reads in a step."""
FAR = 7.0
LEAST_SLOPE = 0.05
"""Least share of its distance from the last polygon that a dry node on a sloping bed of the mesh keeps."""
FILM = 1e-7
FLATTEST, STEEPEST = 0.9, 1.1
"""Mean slopes around a node between which φ is not divided by them."""
LEAST_LEFT = 0.05
"""Share of the distance of two nodes at a start that φ keeps on either side of the surface between them."""
EDGES = np.array([(a, b) for a in range(4) for b in range(a)])


def drain_films(phi, spacing) -> int:
    """Water thinner than FILM h at a node counts as none in φ (N,), in place, since its pressure at the surface would
    be 0/0; at how many nodes there is such water. spacing (N,) [m]: h at each node."""
    return sum(over(_drain, len(phi), phi, spacing))


@ranged
def _drain(first, last, phi, spacing):
    count = 0
    for j in range(first, last):
        i = np.uint64(j)
        if phi[i] < 0.0 and phi[i] > -FILM * spacing[i]:
            phi[i] = 0.0
            count += 1
    return count


def surface_cells(phi, t):
    """Numbers of the cells with water, φ (N,) < 0, on one corner and air on another, in order."""
    shore = np.empty(len(phi), bool)
    over(_beside_air, len(phi), phi, *t.around, shore)
    cell_list = t.cells_around(shore)
    return found_over(_surface_cells, len(cell_list), phi, cell_list, t.cells)


@ranged
def _beside_air(first, last, phi, start, neighbours, shore):
    """Nodes (N,) bool with water beside nodes without."""
    for k in range(first, last):
        i = np.uint64(k)
        shore[i] = False
        if phi[i] < 0.0:
            for t in range(start[i], start[i + np.uint64(1)]):
                if not phi[neighbours[t]] < 0.0:
                    shore[i] = True
                    break


@released
def _surface_cells(first, last, phi, cell_list, cells):
    found = np.empty(last - first, np.int64)
    n = 0
    for s in range(first, last):
        e = cell_list[s]
        wet = 0
        for a in range(4):
            wet += phi[cells[e, a]] < 0.0
        if 0 < wet < 4:
            found[n] = e
            n += 1
    return found[:n].copy()


def surface_triangles(cut, phi, nodes, cells):
    """φ = 0 in the cut cells as triangles (T, 3, 3) [m] and the cell of each (T,)."""
    return joined(over(_surface_triangles, len(cut), cut, phi, nodes, cells))


@released
def _surface_triangles(first, last, cut, phi, nodes, cells):
    triangles = np.empty((2 * (last - first), 3, 3))
    owner = np.empty(2 * (last - first), np.int64)
    crossing = np.empty((4, 3))
    wet, dry = np.empty(4, np.uint64), np.empty(4, np.uint64)
    n = 0
    for s in range(first, last):
        e = np.uint64(cut[s])
        n_wet, n_dry = 0, 0
        for a in range(4):
            if phi[cells[e, a]] < 0.0:
                wet[n_wet] = cells[e, a]
                n_wet += 1
            else:
                dry[n_dry] = cells[e, a]
                n_dry += 1
        count = 0
        for w in range(n_wet):
            for d in range(n_dry):
                i = wet[w]
                # the second wet corner runs backwards so that the four crossings go round the quadrilateral
                j = dry[n_dry - 1 - d] if w == 1 and n_wet == 2 else dry[d]
                t = phi[i] / (phi[i] - phi[j])
                for k in range(3):
                    crossing[count, k] = nodes[i, k] + t * (nodes[j, k] - nodes[i, k])
                count += 1
        for a in range(3):
            for k in range(3):
                triangles[n, a, k] = crossing[a, k]
        owner[n] = e
        n += 1
        if count == 4:
            for k in range(3):
                triangles[n, 0, k] = crossing[0, k]
                triangles[n, 1, k] = crossing[2, k]
                triangles[n, 2, k] = crossing[3, k]
            owner[n] = e
            n += 1
    return triangles[:n], owner[:n]


@ranged
def _far(first, last, phi, size, out):
    """±FAR·size [m] with the sign of φ (N,)."""
    for j in range(first, last):
        i = np.uint64(j)
        out[i] = np.copysign(FAR * size[i], phi[i])


@ranged
def _signed(first, last, layers, square, phi, out):
    """√square (n,) [m] with the sign of φ (N,) at the nodes in layers, in `out` (N,) where it is less than the length
    there; φ itself in layer 0."""
    order, start, _ = layers
    for s in range(first, last):
        i = np.uint64(order[s])
        size = min(np.sqrt(square[s]), abs(out[i]))
        out[i] = phi[i] if s < start[1] else np.copysign(size, phi[i])


def _mean_slope(t, cut, phi):
    """Mean |∇φ| over the cut cells (n,) around each node, (N,); zero elsewhere."""
    total, count = np.empty(len(phi)), np.empty(len(phi))
    reach = reach_of_cells(cut, t.cells)
    owning(_slopes, len(phi), reach, len(cut), cut, phi, t.hats, total, count)
    return total


@ranged
def _slopes(first, last, runs, cut, phi, hats, total, count):
    """The means of `_mean_slope` in `total`; count (N,): work space."""
    cells, parent, g = hats.cells, hats.parent, hats.gradients
    for i in range(first, last):
        total[i], count[i] = 0.0, 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = cut[s]
            square = 0.0
            for k in range(3):
                slope = 0.0
                for a in range(4):
                    slope += phi[cells[e, a]] * g[parent[e], a, k]
                square += slope * slope
            for a in range(4):
                if first <= cells[e, a] < last:
                    total[cells[e, a]] += np.sqrt(square)
                    count[cells[e, a]] += 1.0
    for i in range(first, last):
        total[i] /= max(count[i], 1.0)


def redistance(topology, phi, spacing, rescale: bool, motion=None):
    """φ (N,) as a signed distance near its zero, ±FAR·spacing elsewhere; the zero itself does not move.

    spacing [m]: size of the cells at each node (N,), or one for all.

    rescale: also divide by the mean slope at the nodes of cut cells where it left [0.9, 1.1] ·
    motion: velocity (N, 3) [m/s] and gravity [m/s²], None: no surface goes on beyond its last cells at solids and
    beds."""
    t = topology
    cut, far = surface_cells(phi, t), np.empty(len(phi))
    over(_far, len(phi), phi, np.full(len(phi), spacing) if np.ndim(spacing) == 0 else spacing, far)
    if len(cut) == 0:
        return far
    front = np.zeros(len(phi), bool)
    over(_mark_nodes, len(cut), cut, t.cells, front)
    layers = layers_around(front, LAYERS, *t.around)
    surface, mesh = Surface(*surface_triangles(cut, phi, t.nodes, t.cells)), Corners(t.nodes, t.cells)
    exact = np.arange(layers.start[1], layers.start[EXACT_LAYERS + 1])
    square = squared_distances(layers, surface, mesh, t.around, exact)
    over(_signed, len(layers.order), layers, square, phi, far)
    if rescale:
        corners, slope = layers.order[: layers.start[1]], _mean_slope(t, cut, phi)
        at = slope[corners]
        off = corners[((at > STEEPEST) | (at < FLATTEST)) & (at > 0.0)]
        if motion is not None:
            off = np.setdiff1d(off, _slow(off[t.sloping_bed[off] & (phi[off] > 0.0)], t, motion))
        far[off] /= slope[off]
    if motion is not None:
        beside = layers.order[layers.start[1] : layers.start[2]]
        _past_the_last_polygon(t, cut, front, beside, motion, far)
    return far


@ranged
def _mark_nodes(first, last, cell_list, cells, marked):
    for s in range(first, last):
        for a in range(4):
            marked[cells[cell_list[s], a]] = True


def no_steeper(topology, phi, given):
    """φ (N,) of a start, with smaller sizes where those of two corners of a cell on both sides of the surface add up to
    more than STEEPEST times their distance; the signs stay, and so does what is a distance. given (N,) bool: nodes of
    sides that give φ; it stays there and beside them, where the depth of a sea over a dry bed may well be steep.

    What lies beyond a solid is dry at the start, and what ends at one is wet, however near the surface; φ is as large
    there as it takes to say so. Copies of such nodes can share a cell with others (between stones). Left as steep as
    that, the first `redistance` with `rescale` would change the volume of these cells."""
    t = topology
    cut = t.cells[surface_cells(phi, t)].astype(np.int64)
    one, other = cut[:, EDGES[:, 0]].ravel(), cut[:, EDGES[:, 1]].ravel()
    apart = ((phi[one] < 0.0) != (phi[other] < 0.0)) & ~given[one] & ~given[other]
    one, other = one[apart], other[apart]
    one, other = np.concatenate([one, other]), np.concatenate([other, one])
    length = np.linalg.norm(t.nodes[one] - t.nodes[other], axis=1)
    size = np.abs(phi)
    steep = size[one] > STEEPEST * length
    np.minimum.at(size, one[steep], length[steep])
    steep = (size[one] + size[other] > STEEPEST * length) & (size[one] >= size[other])
    left = np.maximum(length - size[other], LEAST_LEFT * length)
    np.minimum.at(size, one[steep], left[steep])
    return np.where(size < np.abs(phi), np.copysign(size, phi), phi)


def _slow(nodes, t, motion):
    """Those of the nodes (n,) whose velocity is below that of the wave of a cell; motion as in `redistance`."""
    velocity, gravity = motion
    return nodes[(velocity[nodes] ** 2).sum(axis=1) < gravity * t.node_size[nodes]]


def _past_the_last_polygon(t, cut, front, beside, motion, phi) -> None:
    """φ (N,) in place at those of the nodes `beside` the cut cells that lie dry inside a solid or on a sloping bed of
    the mesh, in slow water: continued with its slope in the cut cells, to no larger distance than that to the closest
    polygon; inside a solid to either side of the surface, on a bed no flatter than LEAST_SLOPE. A node of which a thin
    wall leaves several copies stays dry: the cells beside the edge of the wall have the slope of the water on its other
    side, too, and a plate afloat on a layer of nodes was wetted from below through its edges.

    front (N,) bool: corners of the cut cells. Not inside solids on meshes with obtuse cells, where the paths of such
    nodes are continued (`paths_in_solids.py`)."""
    ahead = t.sloping_bed if t.is_obtuse else t.sloping_bed | t.covered
    found = _slow(beside[ahead[beside] & (phi[beside] > 0.0)], t, motion)
    if len(found) == 0:
        return
    value = copied(phi).reshape(-1, 1)
    slope = mean_gradients(cut, front, value, t.fluid_cells, front)
    layers, no_limit = np.array([0, 0, len(found)]), np.zeros(0)
    continue_outward(found, layers, 1, value, slope, t.nodes, t.around_by_cells, front.copy(), no_limit)
    least = np.where(t.sloping_bed[found], LEAST_SLOPE, np.where(t.divided[found], 0.0, -1.0))
    phi[found] = np.clip(value[found, 0], least * phi[found], phi[found])
