"""The conservative volume of water at the nodes, and the level set corrected towards it.

A level set alone loses thin sheets (in one dam break the losses added up to the whole volume).  Therefore (after Kees,
Akkerman, Farthing and Bazilevs, J. Comput. Phys. 230 (2011) 4536, lumped) the volume W_i = ∫_{φ<0} N_i dV of the step
before is carried by the fluxes of the projected velocity u_e, which balance exactly at wholly wet nodes,

    q_ij = -Σ_e |e| (∇N_i·∇N_j) (x_j - x_i)·u_e,      Σ_j q_ij = -Σ_e |e| ∇N_i·u_e = (G V)_i,              (1)

along the edges (`volume_transport.py`): what goes through the cell borders that stand upright on the edge, half way;
in split bricks along the sides of the bricks only, whatever the lengths of these. A cell with an obtuse dihedral angle,
where this may run against the water, passes it along the sides of the brick that it is a part of, too, if it is known
(`mesh/brick_sides.py`): so do the sheared bricks of a mesh that follows a bed.  Other obtuse cells, such as those
between bricks of two sizes, give |e|/4 (∇N_j - ∇N_i)·u_e, through the planes of their medians.  In split bricks that
sends a third of the flow across, along diagonals and back along sides. Where the surface slopes less comes back than
goes: a dam break in a tank 0.5 m wide ran 7 cm farther along one side than along the other, on any cells. In flat
bricks the diagonals exchange water, and with it momentum, between the layers, so that the slow layer on a rough bed is
mixed with the stream above it, and a solitary wave on flat cells lost a seventh of its height over 30 depths; in tall
ones a tenth to a third of the water had to be brought back by the last shift in a dam break, a twentieth at most with
(1).

Then φ takes the shift ψ that brings its own volume there,

    (c + κ K) ψ = W - ∫_{φ<0} N dV,        c_i = d/dψ ∫_{φ<ψ} N_i dV,                                       (2)

which spreads over a length of the order of κ. That evens out splashes, but of what paths and volumes differ by in a
long wave a step corrects only a part, and a surface that lags behind its water feeds the wave (2 % of its amplitude a
period at 28 cells a length and κ = 5 h): κ falls to h in calm water. Where some water is fast, the same equation then
acts a second time on what W still differs by, with the same c: in the jet of two cells that meets a plate, the first
leaves 0.3 to 1 of what flows in to the last shift. What the total volume is off after that is corrected by a last shift
(`last_shift.py`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from array_types import Floats, Ints
from fluid.domain.cell_vectors import CellVectors
from fluid.domain.graph import PAIR, Graph
from fluid.domain.layers import WORK
from fluid.domain.moments import nodal_water, part_moments
from fluid.mesh.brick_sides import ALL, BEYOND, NONE
from fluid.numerics.fields import added, copied, marks_of, places_of
from fluid.numerics.sums import total
from fluid.surface.last_shift import LAST_SHIFTS, lower, met_total
from fluid.surface.level_set import drain_films
from fluid.surface.shift import rows_of_shift
from kernels.decorators import ranged, released
from kernels.threads import found_over, over, owning, owns_any, reach_of_cells

BAND_WIDTH = 3.0
LARGEST_SHIFT = 0.3
ANCHOR = 1e-3
VOLUME_TOLERANCE = 1e-6
SOLVED = (1e-2, 40)
"""By how much the residual of (2) falls, within how many iterations."""
AHEAD, SAME_STEP = 2.0, 1e-9
"""Most steps like the last one for which its change of the velocity goes on in one; difference of two steps over their
length that counts as round-off."""
_PROBE = 0.05
"""Half width of the band of (2), limit of its shift and step of the difference for c, in cell sizes; share of V/h added
to c, so that regions without surface stay where they are; relative tolerance of the total volume."""


@dataclass(frozen=True, kw_only=True)
class Flux:
    """Volume flux along the edges of the listed nodes (n,): rate [m³/s] out of each, on the edges of `graph`;
    velocity (M, 3) [m/s] of the cells that it comes from; water (N,) and capacity (N,) [m³]: what every node holds and
    could hold on the same domain; room (N,) [m³]: `Topology.room` of it."""

    nodes: Ints
    graph: Graph
    rate: Floats
    velocity: Floats
    water: Floats
    capacity: Floats
    room: Floats


@dataclass(frozen=True, kw_only=True)
class FluxAhead:
    """What the flux of a step is made of once its length is known: the listed nodes (n,) with their graph; now:
    velocity of the cells around them when the last step ended, before (k, 3) [m/s]: at its beginning, or now where no
    velocity was; dt [s]: its length, 0 where the flux lies ahead of nothing; water and capacity of `Flux`, the latter
    to tell the domain that they belong to."""

    nodes: Ints
    graph: Graph
    now: CellVectors
    before: Floats
    dt: float
    water: Floats
    capacity: Floats

    def over(self, topology, dt: float) -> Flux:
        """The flux half of a step of dt [s] ahead, on the topology that the velocity belongs to. Its change in the last
        step goes on at its rate, but within a step for no longer than AHEAD steps like the last one: the rest of a step
        that was cut short by an impact would go on with its acceleration."""
        share = min(dt / self.dt, AHEAD) if self.dt > 0.0 else 0.0
        share = 1.0 if abs(share - 1.0) < SAME_STEP else share
        velocity = np.empty((len(topology.cells), 3))
        over(_half_ahead, len(self.now.cells), self.now.cells, self.now.values, self.before, share, velocity)
        return edge_flux(topology, self.graph, self.nodes, velocity, self.water)


@ranged
def _half_ahead(first, last, cells, now, before, share, out):
    """u + ½ share (u - u_before) (M, 3) [m/s] of the listed cells (n,); other cells are not written to."""
    for j in range(first, last):
        s = np.uint64(j)
        e = np.uint64(cells[s])
        for k in range(3):
            if before[s, k] == now[s, k]:
                out[e, k] = now[s, k]
            else:
                out[e, k] = (1.0 + 0.5 * share) * now[s, k] - 0.5 * share * before[s, k]


OTHERS = PAIR.astype(np.uint8)
"""`PAIR`, unsigned."""


@released
def _edge_rates(first, last, listed, edges, u_cell, nodes, fluid, products, around, rate):
    graph_row, start, neighbour = edges.row, edges.start, edges.neighbour
    cells, parent, g = fluid.cells, fluid.parent, fluid.gradients
    volume, along = fluid.volume, fluid.along
    slot, out = np.empty(nodes.shape[0], np.uint32), np.empty(4)
    node_start, node_cells = around
    for place in range(first, last):
        i = np.uint64(listed[place])
        r = np.uint64(graph_row[i])
        xi, yi, zi = nodes[i, 0], nodes[i, 1], nodes[i, 2]
        for s in range(start[r], start[r + np.uint64(1)]):
            slot[neighbour[s]], rate[s] = s, 0.0
        for t in range(node_start[i], node_start[i + np.uint64(1)]):
            e = node_cells[t]
            p, own = parent[e], np.uint64(0)
            x, y, z = volume[e] * u_cell[e, 0], volume[e] * u_cell[e, 1], volume[e] * u_cell[e, 2]
            while cells[e, own] != i:
                own += np.uint64(1)
            way = along[p]
            if way == ALL:
                for other in range(1, 4):
                    a = own ^ np.uint64(other)
                    slopes = products[p, OTHERS[own, a]]
                    if slopes != 0.0:  # it is zero along half of the edges of a split brick
                        j = cells[e, a]
                        rate[slot[j]] -= slopes * (
                            (nodes[j, 0] - xi) * x + (nodes[j, 1] - yi) * y + (nodes[j, 2] - zi) * z
                        )
                continue
            if way != NONE:
                for a in range(4):
                    out[a] = g[p, a, 0] * x + g[p, a, 1] * y + g[p, a, 2] * z
                for a in range(4):
                    behind = BEYOND[way, own, a]
                    for b in range(4):
                        if behind >> b & 1:
                            rate[slot[cells[e, a]]] -= out[b]
                continue
            gx, gy, gz = g[p, own, 0], g[p, own, 1], g[p, own, 2]
            for a in range(4):
                if a != own:
                    rate[slot[cells[e, a]]] += 0.25 * (
                        (g[p, a, 0] - gx) * x + (g[p, a, 1] - gy) * y + (g[p, a, 2] - gz) * z
                    )


def edge_flux(topology, graph, listed, u_cell, water) -> Flux:
    """Equation (1) on the edges of the listed nodes (n,); u_cell (M, 3) [m/s] projected velocity of the cells,
    water (N,) [m³] volume at the nodes."""
    return Flux(
        nodes=listed,
        graph=graph,
        rate=edge_rates(topology, graph, listed, u_cell),
        velocity=u_cell,
        water=water,
        capacity=topology.node_volume,
        room=topology.room,
    )


def edge_rates(topology, graph, listed, u_cell):
    """q (edges,) [m³/s] of (1) out of the listed nodes (n,) along the edges of the graph; u_cell (M, 3) [m/s]. Edges of
    other nodes hold anything."""
    t, rate = topology, np.empty(len(graph.neighbour))
    mesh = (t.nodes, t.fluid_cells, t.products, (t.node_start, t.node_cells))
    over(_edge_rates, len(listed), listed, graph.edges, u_cell, *mesh, rate, weight=WORK)
    return rate


@dataclass(frozen=True)
class Shift:
    """ψ of (2): value (n,) [m] at the nodes of the band (n,), with κ = kappa times the spacing (N,) [m].

    place (N,): places of nodes in the band, -1 elsewhere."""

    band: Ints
    place: Ints
    value: Floats
    kappa: float
    spacing: Floats


@dataclass(frozen=True, kw_only=True)
class VolumeCorrection:
    """level_set (N,) · nodal_water (N,) [m³] of it, and `uncorrected_water` before · reinserted [m³] moved by the
    last shift (3) · shift: ψ of (2)."""

    level_set: Floats
    nodal_water: Floats
    uncorrected_water: Floats
    reinserted: float
    shift: Shift


def correct_volume(
    topology, graph, listed, phi, carried, target: float, kappa: float, spacing, again: float = 0.0
):
    """Equations (2) and (3). φ (N,), carried W (N,) [m³], target total [m³] → VolumeCorrection.

    kappa in cell sizes · spacing (N,) [m]: size of the cells at each node · again: share of what the first solution of
    (2) leaves that a second one corrects ·
    listed (n,) nodes of the graph to look at, all with water and |φ| small among them."""
    n, seen = len(phi), marks_of(listed, len(phi))
    inner, near = _parted(topology, seen, phi, LARGEST_SHIFT + LAST_SHIFTS[0], spacing)
    own = added(inner, nodal_water(near, 0.0, phi, topology.parts, n))
    slope = _volume_slope(topology, near, phi, spacing, seen)
    band = found_over(_in_band, len(listed), listed, phi, spacing)
    place = places_of(band, n)
    c, residual = np.empty(len(band)), np.empty(len(band))
    over(_equation, len(band), band, slope, topology.node_volume, spacing, (carried, own), c, residual)
    rows = rows_of_shift(band, place, graph.edges, c, kappa, spacing)
    shift = rows.shift(residual, *SOLVED)
    moved = copied(phi)
    over(lower, len(band), band, phi, shift, LARGEST_SHIFT, spacing, moved)
    if again > 0.0:
        at_first = added(inner, nodal_water(near, 0.0, moved, topology.parts, n))
        over(
            _equation, len(band), band, slope, topology.node_volume, spacing, (carried, at_first), c, residual
        )
        residual *= again
        shift = shift + rows.shift(residual, *SOLVED)
        over(lower, len(band), band, phi, shift, LARGEST_SHIFT, spacing, moved)
    tolerance = VOLUME_TOLERANCE * abs(target)
    for most in LAST_SHIFTS:
        if most > LAST_SHIFTS[0]:
            inner, near = _parted(topology, seen, phi, LARGEST_SHIFT + most, spacing)
        left = target - total(inner)
        shifted, of_near, volume, reinserted = met_total(
            topology, near, moved, (band, slope, shift), (carried, inner, left), tolerance, most, spacing
        )
        if abs(left - volume) <= tolerance:
            break
    if drain_films(shifted, spacing):
        of_near = nodal_water(near, 0.0, shifted, topology.parts, n)
    return VolumeCorrection(
        level_set=shifted,
        nodal_water=added(inner, of_near),
        uncorrected_water=own,
        reinserted=reinserted,
        shift=Shift(band, place, shift, kappa, spacing),
    )


@released
def _in_band(first, last, listed, phi, spacing):
    """Those of the listed nodes near the surface, in order."""
    found, n = np.empty(last - first, np.int64), 0
    for s in range(first, last):
        i = listed[s]
        if abs(phi[i]) < BAND_WIDTH * spacing[i]:
            found[n] = i
            n += 1
    return found[:n].copy()


@ranged
def _equation(first, last, band, slope, capacity, spacing, water, c, residual):
    """c and the right hand side (n,) of (2); water (N,): carried, and of φ itself."""
    carried, own = water
    for s in range(first, last):
        i = np.uint64(band[s])
        c[s] = slope[i] + ANCHOR * capacity[i] / spacing[i]
        residual[s] = carried[i] - own[i]


def _parted(t, seen, phi, most, spacing):
    """Volume (N,) [m³] at the nodes of those cells around the nodes `seen` (N,) bool that are all water whatever shift
    within ± most times the spacing (N,) φ takes, and the numbers of those that a surface can reach.

    A node that has only such cells around it has its whole volume: the same sum as over these cells."""
    n = len(phi)
    inner, beside = np.empty(n), np.empty(n, bool)
    mesh = (t.node_start, t.node_cells, t.fluid_cells, t.node_volume)
    over(_inside, n, phi, most, spacing, seen, t.around, mesh, inner, beside, weight=0.3 * WORK)
    return inner, _in_reach(t.cells_around(beside), phi, t.cells, most, spacing, seen)


@ranged
def _inside(first, last, phi, most, spacing, seen, around, mesh, inner, beside):
    """The volume of `_parted`, and the nodes (N,) bool within reach of the surface, or under it and beside such."""
    start, neighbours = around
    node_start, node_cells, fluid, capacity = mesh
    cells, volume, share, share_row = fluid.cells, fluid.volume, fluid.share, fluid.share_row
    for k in range(first, last):
        i = np.uint64(k)
        reach = most * spacing[i]
        inner[i], beside[i] = 0.0, phi[i] < reach
        if not phi[i] < -reach:
            continue
        whole = True
        for t in range(start[i], start[i + np.uint64(1)]):
            j = neighbours[t]
            if not phi[j] < -most * spacing[j]:
                whole = False
                break
        beside[i] = not whole
        if whole and seen[i]:
            inner[i] = capacity[i]
            continue
        for t in range(node_start[i], node_start[i + np.uint64(1)]):
            e, own, under, near = node_cells[t], np.uint64(0), True, False
            for a in range(4):
                j = cells[e, a]
                under, near = under and phi[j] < -most * spacing[j], near or seen[j]
                own = np.uint64(a) if j == i else own
            if under and near:
                inner[i] += volume[e] * share[share_row[e], own]


def _in_reach(cell_list, phi, cells, most, spacing, seen):
    """Those of the listed cells around the nodes `seen` (N,) bool that a surface can reach, in order, whatever shift
    within ± most times the spacing (N,) φ takes."""
    return found_over(_reached, len(cell_list), cell_list, phi, cells, most, spacing, seen)


@released
def _reached(first, last, cell_list, phi, cells, most, spacing, seen):
    found, n = np.empty(last - first, np.int64), 0
    for s in range(first, last):
        e = np.uint64(cell_list[s])
        under, beyond, near = True, True, False
        for a in range(4):
            i = cells[e, a]
            reach = most * spacing[i]
            under, beyond = under and phi[i] < -reach, beyond and phi[i] >= reach
            near = near or seen[i]
        if near and not under and not beyond:
            found[n] = e
            n += 1
    return found[:n].copy()


def _volume_slope(t, near, phi, spacing, seen):
    """c (N,) [m²] by a central difference over the cells that the surface can reach."""
    cut = _in_reach(near, phi, t.cells, _PROBE, spacing, seen)
    held = np.empty((2, len(phi)))
    reach = reach_of_cells(cut, t.cells)
    owning(_probed, len(phi), reach, len(cut), cut, phi, spacing, t.parts, held)
    return held[0]


@released
def _probed(first, last, runs, cell_list, phi, spacing, parts, held):
    """Volumes held (2, N) of the nodes with φ half a step lower and higher, and, in place of the first, their slope.

    One array for both: to go through a tuple of two counts references to them in every turn, and a count that all
    threads change at once made two take half as long again as one."""
    local, out = np.empty(4), np.empty(4)
    cells = parts.cells
    held[:, first:last] = 0.0
    for run in range(runs.shape[0]):
        for s in range(runs[run, 0], runs[run, 1]):
            e = np.uint64(cell_list[s])
            if not owns_any(first, last, cells, e):
                continue
            i, j, k, m = cells[e, 0], cells[e, 1], cells[e, 2], cells[e, 3]
            for side in range(2):
                way = (2 * side - 1) * _PROBE
                at = (
                    phi[i] + way * spacing[i],
                    phi[j] + way * spacing[j],
                    phi[k] + way * spacing[k],
                    phi[m] + way * spacing[m],
                )
                x, y, z, w = part_moments(e, at, parts, local, out)
                if first <= i < last:
                    held[side, i] += x
                if first <= j < last:
                    held[side, j] += y
                if first <= k < last:
                    held[side, k] += z
                if first <= m < last:
                    held[side, m] += w
    for i in range(first, last):
        if held[0, i] != held[1, i]:
            # in slivers beside solids the last corner to get wet moves water between nodes: no slope may be negative
            held[0, i] = max((held[0, i] - held[1, i]) / (2 * (_PROBE * spacing[i])), 0.0)
        else:
            held[0, i] = 0.0


def nodal_volume(topology, phi):
    """∫_{φ<0} N_i dV (N,) [m³]."""
    return nodal_water(topology.cells_around(phi < 0.0), 0.0, phi, topology.parts, len(topology.nodes))


def room_of_heirs(topology, phi, source):
    """Volume (N,) [m³] in proportion to which new nodes share the water of the old one that they continue, source (N,):
    what copies of a node that splits hold below the surface φ (N,) [m], or can hold where none of them is wet. Shared
    by what they can hold alone, the water below a plate that floats came to lie on it where such a node split."""
    t, room = topology, topology.node_volume
    some = source >= 0
    splits = np.zeros(len(room), bool)
    splits[some] = (np.bincount(source[some]) > 1)[source[some]]
    if not splits.any():
        return room
    held = nodal_water(t.cells_around(splits), 0.0, phi, t.parts, len(room))
    of_old = np.bincount(source[splits], held[splits], minlength=source.max() + 1)
    room = room.copy()
    splits[splits] = of_old[source[splits]] > 0.0
    room[splits] = held[splits]
    return room


def renumbering(source, old_parent, new_parent, new_volume) -> sp.csr_array:
    """T (N_new, N_old), which passes the volume of every old node on to its copies: W_new = T W_old, columns sum to 1.

    source (N_new,): old node that each new one continues, -1 none · parents (N,): background node of each copy ·
    new_volume (N_new,) [m³], `room_of_heirs`, in proportion to which several successors share.  The water of a node
    without a successor goes to the first copy of its background node; if there is no copy, the last shift (3) restores
    it."""
    heir = np.flatnonzero(source >= 0)
    weight = np.maximum(new_volume[heir], 1e-300)
    total = np.bincount(source[heir], weight, minlength=len(old_parent))
    orphan = np.flatnonzero(total == 0.0)
    first = np.full(max(old_parent.max(), new_parent.max()) + 1, -1)
    first[new_parent[::-1]] = np.arange(len(new_parent))[::-1]
    orphan = orphan[first[old_parent[orphan]] >= 0]
    rows = np.concatenate([heir, first[old_parent[orphan]]])
    columns = np.concatenate([source[heir], orphan])
    share = np.concatenate([weight / total[source[heir]], np.ones(len(orphan))])
    return sp.csr_array((share, (rows, columns)), shape=(len(new_parent), len(old_parent)))
