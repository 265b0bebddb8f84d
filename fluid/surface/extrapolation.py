"""Extrapolation of values from the water to the nodes around it, layer by layer.

u_i = Σ_j n_ij [u_j + ∇u_j·(x_i - x_j)] / d_ij² / Σ_j n_ij / d_ij²  over the neighbours j in earlier layers, n_ij: how
many cells they share.  The first two layers use the gradient (a constant continuation costs 1.4 % of the sloshing
frequency at 32 cells a length), farther ones do not.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Bools, Floats, Ints
from fluid.domain.layers import WORK, layers_around
from fluid.domain.moments import touching_among
from fluid.numerics.fields import copied_at, marks_of
from kernels.decorators import inlined, inner, ranged, released
from kernels.threads import marked as numbers_of
from kernels.threads import over, owning, reach_of_cells

LINEAR_LAYERS = 2
SPACE, ENTRIES = 3, 9
"""Components of a velocity, and of its gradient: loops of a length that the compiler knows take half the time."""
SWEEPS = 3
"""Averages of the slope that the velocity is continued with, in calm water; one more takes off what they flatten."""
BAND = 5
"""Layers of nodes outside the water that carry a velocity."""
WAVE_SLACK = 0.05
"""Share by which velocity in calm water may be continued beyond what the forces make of it: below that, waves lose
0.5 % of their height a period."""
AHEAD = 0.5
"""Sine of the angle ahead of a node within which the speed of a neighbour ceases to count as that of one beside."""
_NO_LIMIT, _NO_SLOPE = np.zeros(0), np.zeros((1, 3, 3))


class Continued(NamedTuple):
    """Field that is filled: value (N, m) · gradient (N, m, 3) · done (N,) bool: nodes whose value is known ·
    least (N,), or of length 0, as in `continue_outward`."""

    value: Floats
    gradient: Floats
    done: Bools
    least: Floats


def continue_outward(order, layer_start, linear_layers, f, gradient, nodes, around, done, least):
    """Fill f (N, m) in place on layers 1.. of `order` from layer 0; gradient (N, m, 3) read where linear.

    around: `Topology.around_by_cells` · done (N,) bool: nodes whose f is known; extended in place, layer by layer.
    least (N,): no filled |f| is larger than its own `least` or what the neighbours allow (`_shorten`), f a velocity;
    of length 0: no limit."""
    field = Continued(f, gradient, done, least)
    for layer in range(1, len(layer_start) - 1):
        nodes_of_it = order[layer_start[layer] : layer_start[layer + 1]]
        linear = layer <= linear_layers
        over(_one_layer, len(nodes_of_it), nodes_of_it, linear, field, nodes, around, weight=WORK)
        done[nodes_of_it] = True


@released
def _one_layer(first, last, layer, linear, field, nodes, around):
    m = field.value.shape[1]
    if m == SPACE:
        _continue(first, last, SPACE, layer, linear, field, nodes, around, np.empty(m))
    else:
        _continue(first, last, m, layer, linear, field, nodes, around, np.empty(m))


@inlined
def _continue(first, last, m, layer, linear, field, nodes, around_by_cells, total):
    """The loop of `continue_outward` over the nodes of a layer; total (m,): work space."""
    f, gradient, done, least = field
    start, around, shared = around_by_cells
    for s in range(first, last):
        i = np.uint64(layer[s])
        weight = 0.0
        for k in range(m):
            total[k] = 0.0
        for t in range(start[i], start[i + np.uint64(1)]):
            j = around[t]
            if not done[j]:
                continue
            dx = nodes[i, 0] - nodes[j, 0]
            dy = nodes[i, 1] - nodes[j, 1]
            dz = nodes[i, 2] - nodes[j, 2]
            w = shared[t] / (dx * dx + dy * dy + dz * dz)
            weight += w
            for k in range(m):
                value = f[j, k]
                if linear:
                    value += gradient[j, k, 0] * dx + gradient[j, k, 1] * dy + gradient[j, k, 2] * dz
                total[k] += w * value
        for k in range(m):
            # nothing known around: a side where water is yet to come in
            f[i, k] = total[k] / weight if weight > 0.0 else 0.0
        if least.shape[0] > 0 and _square(f[i]) > least[i] * least[i]:
            _shorten(i, least[i], f, nodes, around_by_cells, done)
        if linear:
            _pass_gradient(i, m, gradient, start, around, shared, done)


@inner
def _shorten(i, least, f, nodes, around_by_cells, done):
    """Shorten row i of f (N, 3) [m/s] to what its neighbours allow: the most of `least`, m and m + w (|f_j| - m), with
    the mean m of what all known neighbours have in its direction, and w of the neighbour j: 1 where it lies behind or
    beside, 0 where it lies ahead, farther from beside than by the angle whose sine is AHEAD, in between in between."""
    start, around, shared = around_by_cells
    length = np.sqrt(_square(f[i]))
    mean, weight = 0.0, 0.0
    for t in range(start[i], start[i + np.uint64(1)]):
        j = around[t]
        if not done[j]:
            continue
        along, square = 0.0, 0.0
        for k in range(3):
            dx = nodes[i, k] - nodes[j, k]
            along += f[j, k] * f[i, k]
            square += dx * dx
        weight += shared[t] / square
        mean += shared[t] / square * along
    mean /= max(weight * length, 1e-300)
    most = max(least, mean)
    for t in range(start[i], start[i + np.uint64(1)]):
        j = around[t]
        if not done[j]:
            continue
        behind, square = 0.0, 0.0
        for k in range(3):
            dx = nodes[i, k] - nodes[j, k]
            behind += dx * f[i, k]
            square += dx * dx
        counts = 1.0 + behind / (AHEAD * np.sqrt(square) * length)
        if counts > 0.0:
            most = max(most, mean + min(counts, 1.0) * (np.sqrt(_square(f[j])) - mean))
    for k in range(3):
        f[i, k] *= min(1.0, most / length)


@inner
def _square(v):
    """Square of the length of v."""
    total = 0.0
    for k in range(v.shape[0]):
        total += v[k] * v[k]
    return total


@inlined
def _pass_gradient(i, m, gradient, start, around, shared, done):
    """The gradient of a filled node: the mean of the known ones around it, each as often as they share cells."""
    count = 0
    for k in range(m):
        for d in range(3):
            gradient[i, k, d] = 0.0
    for t in range(start[i], start[i + np.uint64(1)]):
        j = around[t]
        if done[j]:
            count += shared[t]
            for k in range(m):
                for d in range(3):
                    gradient[i, k, d] += shared[t] * gradient[j, k, d]
    for k in range(m):
        for d in range(3):
            gradient[i, k, d] /= max(count, 1)


def mean_gradients(cell_list, marked, f, fluid, there):
    """Volume-weighted mean (N, m, 3) of ∇f over the cells around each node whose corners are all marked.

    f (N, m), marked (N,) bool · fluid: FluidCells · there (N,) bool: the nodes of the listed cells, at least. Where
    there is no such cell it is zero; other nodes hold anything."""
    n = len(f)
    weight, gradient = np.empty(n), np.empty((*f.shape, 3))
    reach = reach_of_cells(cell_list, fluid.cells)
    owning(_mean_gradients, n, reach, len(cell_list), cell_list, (marked, there), f, fluid, weight, gradient)
    return gradient


@released
def _mean_gradients(first, last, runs, cell_list, marks, f, fluid, weight, gradient):
    m, (marked, there) = f.shape[1], marks
    for j in range(first, last):
        i = np.uint64(j)
        weight[i] = 0.0
        if there[i]:
            for k in range(m):
                for d in range(3):
                    gradient[i, k, d] = 0.0
    if m == SPACE:
        _add_slopes(first, last, runs, cell_list, marked, f, fluid, weight, gradient)
    else:
        _add_gradients(first, last, m, runs, cell_list, marked, f, fluid, np.empty((m, 3)), weight, gradient)
    for j in range(first, last):
        i = np.uint64(j)
        if weight[i] > 0.0:
            for k in range(m):
                for d in range(3):
                    gradient[i, k, d] /= weight[i]


@inlined
def _add_gradients(first, last, m, runs, cell_list, marked, f, fluid, local, weight, gradient):
    """The loop of `mean_gradients`; local (m, 3): work space."""
    cells, parent, g, volume = fluid.cells, fluid.parent, fluid.gradients, fluid.volume
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[s])
            if not (
                marked[cells[e, 0]] and marked[cells[e, 1]] and marked[cells[e, 2]] and marked[cells[e, 3]]
            ):
                continue
            p = parent[e]
            for k in range(m):
                for d in range(3):
                    local[k, d] = 0.0
            for a in range(4):
                i = cells[e, a]
                for k in range(m):
                    for d in range(3):
                        local[k, d] += f[i, k] * g[p, a, d]
            for k in range(m):
                for d in range(3):
                    local[k, d] *= volume[e]
            for a in range(4):
                i = cells[e, a]
                if first <= i < last:
                    weight[i] += volume[e]
                    for k in range(m):
                        for d in range(3):
                            gradient[i, k, d] += local[k, d]


@inlined
def _add_slopes(first, last, runs, cell_list, marked, f, fluid, weight, gradient):
    """`_add_gradients` of a velocity, whose gradient stays in registers."""
    cells, parent, g, volume = fluid.cells, fluid.parent, fluid.gradients, fluid.volume
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[s])
            if not (
                marked[cells[e, 0]] and marked[cells[e, 1]] and marked[cells[e, 2]] and marked[cells[e, 3]]
            ):
                continue
            p, size = parent[e], volume[e]
            ux, uy, uz, vx, vy, vz, wx, wy, wz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for a in range(4):
                i = cells[e, a]
                u, v, w, x, y, z = f[i, 0], f[i, 1], f[i, 2], g[p, a, 0], g[p, a, 1], g[p, a, 2]
                ux, uy, uz = ux + u * x, uy + u * y, uz + u * z
                vx, vy, vz = vx + v * x, vy + v * y, vz + v * z
                wx, wy, wz = wx + w * x, wy + w * y, wz + w * z
            ux, uy, uz, vx, vy, vz = ux * size, uy * size, uz * size, vx * size, vy * size, vz * size
            wx, wy, wz = wx * size, wy * size, wz * size
            for a in range(4):
                i = cells[e, a]
                if first <= i < last:
                    weight[i] += size
                    at = gradient[i]
                    at[0, 0], at[0, 1], at[0, 2] = at[0, 0] + ux, at[0, 1] + uy, at[0, 2] + uz
                    at[1, 0], at[1, 1], at[1, 2] = at[1, 0] + vx, at[1, 1] + vy, at[1, 2] + vz
                    at[2, 0], at[2, 1], at[2, 2] = at[2, 0] + wx, at[2, 1] + wy, at[2, 2] + wz


def smoothed_slope(topology, cell_list, marked, u, calm: float, wanted=None):
    """∇u (N, 3, 3) of `mean_gradients` for u (N, 3), averaged over the corners of the cells around a node, each cell
    counts, at the marked nodes of listed cells that are not all marked; zero at other marked nodes, anything at nodes
    that are not marked, or not `wanted` (n,), None: all are. Once in fast water, calm = 0; (SWEEPS + 1) Aⁿ - SWEEPS
    Aⁿ⁺¹ at rest, calm = 1, with the average A and n = SWEEPS; between, in between. A wave of many cells passes with an
    error of the second order of what an average takes off it, one of a few cells as little as through Aⁿ, which alone
    took the slope a cell too deep: 2.5 % of the energy of waves of 14 cells a period.

    Only nodes of listed cells whose corners are all marked have a field, over which the averages run. Waves of a few
    cells, whose slope the continuation carries to the surface many times too large, grow without averages: by 0.01 to
    0.02 a step where the surface lies just below a layer of nodes, by 0.005 after one sweep. More than one slows a bore
    into two cells of water by 15 %."""
    return _slope_there(topology, _where_sloped(topology, cell_list, marked, calm, wanted), u)


class _Sloped(NamedTuple):
    """Where `smoothed_slope` finds slopes, whatever the field: marked (N,) bool · calm · has (N,) bool: nodes that have
    one · order, start: layers of them around the cells that are not all marked, of which each average reads one more ·
    cells (n,) around these · wanted (k,) nodes · kept (N,) bool: those that get a slope."""

    marked: Bools
    calm: float
    has: Bools
    order: Ints
    start: Ints
    cells: Ints
    wanted: Ints
    kept: Bools


def _where_sloped(t, cell_list, marked, calm: float, wanted) -> _Sloped:
    n, sweeps = len(marked), SWEEPS + 1 if calm > 0.0 else 1
    has, beside = _with_field(cell_list, marked, t.cells)
    # each sweep reads one layer of nodes farther in than it is to be right on
    order, start, _ = layers_around(beside & has, sweeps, t.around[0], t.around[1], has)
    # values are also continued from marked nodes whose other cells with dry corners are not listed
    wanted = numbers_of(marked) if wanted is None else wanted
    cells, kept = _cells_of(order, cell_list, t.cells, n), marks_of(order[: start[1]], n)
    return _Sloped(marked, calm, has, order, start, cells, wanted, kept)


def _slope_there(t, where: _Sloped, u):
    """The slope (N, 3, 3) of `smoothed_slope` of a field u (N, 3)."""
    order, start, sweeps = where.order, where.start, len(where.start) - 2
    found = [mean_gradients(where.cells, where.marked, u, t.fluid_cells, where.has)]
    for k in range(sweeps):
        found.append(_averaged(order[: start[sweeps - k]], where.has, found[-1], t))
    once, before, slope = found[1], *found[-2:]
    if sweeps > 1:
        over(_combined, start[1], order, where.calm, once, before, slope)
    over(_clear_unless, len(where.wanted), where.wanted, where.kept, where.marked, once.reshape(len(u), -1))
    return once


def _cells_of(nodes, cell_list, cells, n):
    """Those of the listed cells that have one of these nodes, of 0 ... n."""
    return touching_among(cell_list, marks_of(nodes, n), cells)


@ranged
def _clear_unless(first, last, wanted, kept, marked, field):
    """field (N, 9) ← 0 at those of the listed nodes that are marked and not kept, (N,) bool."""
    for s in range(first, last):
        i = np.uint64(wanted[np.uint64(s)])
        if marked[i] and not kept[i]:
            for k in range(ENTRIES):
                field[i, k] = 0.0


@ranged
def _combined(first, last, nodes, calm, once, before, slope):
    """once (N, 3, 3) + calm (before + SWEEPS (before - slope) - once) in place at these nodes."""
    for s in range(first, last):
        i = np.uint64(nodes[np.uint64(s)])
        for k in range(SPACE):
            for d in range(SPACE):
                ahead = before[i, k, d] + SWEEPS * (before[i, k, d] - slope[i, k, d])
                once[i, k, d] = once[i, k, d] + calm * (ahead - once[i, k, d])


def _with_field(cell_list, marked, cells):
    """Nodes (N,) bool of listed cells whose corners are all marked, and of the others."""
    has, beside = np.zeros(len(marked), bool), np.zeros(len(marked), bool)
    over(_mark_field, len(cell_list), cell_list, marked, cells, has, beside)
    return has, beside


@ranged
def _mark_field(first, last, cell_list, marked, cells, has, beside):
    for s in range(first, last):
        e = np.uint64(cell_list[s])
        inside = marked[cells[e, 0]] and marked[cells[e, 1]] and marked[cells[e, 2]] and marked[cells[e, 3]]
        for a in range(4):
            if inside:
                has[cells[e, a]] = True
            else:
                beside[cells[e, a]] = True


def _averaged(nodes, has, field, topology):
    """Mean (N, 3, 3) of the field (N, 3, 3) over the corners that have one, has (N,) bool, of the cells around each of
    these nodes, which have one too; other nodes hold anything."""
    t, n, mean = topology, len(field), np.empty(field.shape)
    flat = (field.reshape(n, -1), mean.reshape(n, -1))
    over(_average, len(nodes), nodes, has, t.node_start, t.around_by_cells, *flat, weight=WORK)
    return mean


@ranged
def _average(first, last, nodes, has, node_start, around_by_cells, field, mean):
    start, around, shared = around_by_cells
    for s in range(first, last):
        i = np.uint64(nodes[np.uint64(s)])
        count = float(node_start[i + np.uint64(1)] - node_start[i])
        own = field[i]
        a, b, c = count * own[0], count * own[1], count * own[2]
        d, e, f = count * own[3], count * own[4], count * own[5]
        g, h, q = count * own[6], count * own[7], count * own[8]
        for t in range(start[i], start[i + np.uint64(1)]):
            j = around[t]
            if has[j]:
                weight, other = float(shared[t]), field[j]
                count += weight
                a, b, c = a + weight * other[0], b + weight * other[1], c + weight * other[2]
                d, e, f = d + weight * other[3], e + weight * other[4], f + weight * other[5]
                g, h, q = g + weight * other[6], h + weight * other[7], q + weight * other[8]
        out = mean[i]
        out[0], out[1], out[2] = a / count, b / count, c / count
        out[3], out[4], out[5] = d / count, e / count, f / count
        out[6], out[7], out[8] = g / count, h / count, q / count


def _own_speed(nodes, factor, forced):
    """factor |forced| (N,) at the listed nodes, which alone are read; anything elsewhere."""
    out = np.empty(len(forced))
    over(_speed_of, len(nodes), nodes, factor, forced, out)
    return out


@ranged
def _speed_of(first, last, nodes, factor, forced, out):
    for s in range(first, last):
        out[nodes[s]] = factor * np.sqrt(_square(forced[nodes[s]]))


def _clear_outside(order, u, a):
    """u, a (N, 3) ← 0 at the nodes that are not in the list, in place."""
    over(_clear, len(u), marks_of(order, len(u)), u, a)


@ranged
def _clear(first, last, kept, u, a):
    for i in range(first, last):
        if not kept[i]:
            for k in range(3):
                u[i, k], a[i, k] = 0.0, 0.0


def fill_missing(topology, known, *fields):
    """Continue each field (N, m) into the active nodes that are not `known`, layer after layer, in place."""
    missing = topology.active & ~known
    while missing.any():
        before = missing.sum()
        seed = known & topology.active
        # from the known nodes beside missing ones alone: most are far from any
        beside = np.zeros(len(seed), bool)
        over(_beside, len(seed), missing, seed, topology.around, beside)
        order, start, _ = layers_around(beside, 4, *topology.around, missing | beside)
        for f in fields:
            _fill(topology, order, start, 0, f, np.zeros((1, f.shape[1], 3)), seed.copy(), _NO_LIMIT)
        known = known.copy()
        known[order] = True
        missing = topology.active & ~known
        if missing.sum() == before:  # a pocket without any known node: it starts at rest
            return


@ranged
def _beside(first, last, missing, seed, around, found):
    """found (N,) bool ← the seeds, seed (N,) bool, around the missing nodes; several threads may mark one node."""
    start, neighbours = around
    for j in range(first, last):
        i = np.uint64(j)
        if missing[i]:
            for t in range(start[i], start[i + np.uint64(1)]):
                if seed[neighbours[t]]:
                    found[neighbours[t]] = True


def _fill(t, order, start, linear, f, gradient, done, least):
    continue_outward(order, start, linear, f, gradient, t.nodes, t.around_by_cells, done, least)


def continued(topology, layers, u, wanted):
    """u (N, 3) at the wanted nodes (n,) of layers (order, start), continued with its slope from layer 0, no faster than
    the neighbours allow; anything at others.

    A node takes values and slopes from the layer before, and those of layer 0 come from the nodes around it: what lies
    farther off than that has no part in it."""
    t, n, (order, start) = topology, len(u), layers
    last = len(start) - 2
    near, steps, _ = layers_around(marks_of(wanted, n), last + 1, *t.around, marks_of(order, n))
    wet = marks_of(order[: start[1]], n)
    at_rim = near[wet[near]]
    found, least = copied_at(near, u), np.empty(n)
    slope = smoothed_slope(t, t.cells_around(marks_of(at_rim, n)), wet, u, 0.0, at_rim)
    filled, ends = [], [0, 0]
    for layer in range(1, last + 1):
        within = near[: steps[last - layer + 1]]
        filled.append(within[marks_of(order[start[layer] : start[layer + 1]], n)[within]])
        ends.append(ends[-1] + len(filled[-1]))
    filled = np.concatenate(filled)
    least[filled] = 0.0
    _fill(t, filled, ends, LINEAR_LAYERS, found, slope, wet, least)
    return found


def extend_velocity(topology, layers, wet, wet_cells, u, a, calm: float, forced, rubbed=None):
    """Continue u and a (linear, then constant; a with its slope times calm), each (N, 3), over layers (order, start),
    in place; calm as in `smoothed_slope`. rubbed (N,) bool: nodes on walls that rub or hold the water, None: there are
    none.

    No slope is taken from cells beside such walls: the shear of the layer along a bed, extrapolated through the surface
    of a film, made the air above it 1.6 times as fast as the water, so that its tip ran ahead of one without friction.

    forced (N, 3) [m/s]: velocity of the water at these nodes under the forces alone.  These nodes hold water of cells
    that the surface cuts, and extrapolating the slope of the velocity beyond a front would accelerate it: by 2 to 8 %
    of the energy of a dam break.  Extrapolated speeds are therefore limited by their own or, where that is more, by
    the speed of the fastest neighbour that a front runs ahead of or beside; where they follow, by what the mean of the
    known neighbours has in their direction.  Limited by the fastest neighbour, wherever that one was, water two cells
    deep that spreads under what falls on it pulled the rest down 1.5 times as fast as it fell: 8 % of the energy in one
    step, however short.

    The next step begins with u + (1 - θ) dt a.  With a constant a beyond the surface, cells that it cuts late received
    less of a wave's acceleration there than of its velocity, which fed the wave: by up to 1.2 % of its amplitude per
    period with 28 cells a wavelength and 45 steps a period, the more, the fuller these cells are.

    Nodes outside the layers are set to zero."""
    t, (order, start) = topology, layers
    if rubbed is not None:
        wet_cells = wet_cells[~rubbed[t.cells[wet_cells]].any(axis=1)]
    sloped = _where_sloped(t, wet_cells, wet, calm, order[: start[1]])
    gradient = _slope_there(t, sloped, u)
    least = _own_speed(order[start[1] :], 1.0 + WAVE_SLACK * calm, forced)
    _clear_outside(order, u, a)
    _fill(t, order, start, LINEAR_LAYERS, u, gradient, wet.copy(), least)
    linear, slope = 0, _NO_SLOPE
    if calm > 0.0:
        linear, slope = LINEAR_LAYERS, _slope_there(t, sloped, calm * a)
    _fill(t, order, start, linear, a, slope, wet.copy(), _NO_LIMIT)
