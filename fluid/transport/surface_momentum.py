"""Velocity in fast water and around jumps of the surface: it follows the momentum that the volume carries.

A path that ends at a node at rest began at that node: semi-Lagrangian transport leaves the node ahead of a bore at rest
while the bore pours its water in, and the momentum of that water is lost.  A jet that meets a plate and a sheet that
runs up a wall lose momentum in the same way, and the more, the fewer cells they are thick.  There the velocity is

    u = (1 - w) u_paths + w u_volume                                                                        (1)

where u_volume is carried by the fluxes of the volume (`volume_transport.py`).  The level set that is then corrected
towards the volume contains other volumes at the nodes than the fluxes brought: what one node has too much, others
receive, and its momentum with it (`passed_on.py`).

In fast water w = R(|u|/√(g h); 1, 3), h the size of the cells and R(x; b, c) = (x - b)/(c - b) kept within 0 and 1:
where water is faster than the shallow-water wave of one cell, its motion within a cell is governed by momentum.  Slower
water conserves its head, and its waves are not damped by fluxes that are of first order at their crests.  The fluxes
act like a viscosity |u| h/2.  In liquids whose viscosity ν is not far below that, semi-Lagrangian transport loses no
momentum within a cell that viscosity would not have diffused: while the liquid crosses a cell, in h/|u|, viscosity
spreads momentum over sqrt(ν h/|u|). There w is multiplied with R(|u| h/ν; 10, 30), from a third of a cell down to a
fifth; it is 1 for water on cells of a millimetre and more.

In slow water w is 0 deeper than 3 h and within two layers around cut cells, where pressure is what stops water, and in
full between the surface and 2 h, within RINGS nodes around a jump: a node with water s V, less fast than the water that
flows into it, u_up with acceleration a_up,

    R(d/√(g h); 0.1, 0.3) R(η; 0.5, 0.9) R(s; 0.25, 0.75),    d = |u_up| - |u|,
    η = 1 + (h (a + a_up)·u_up/|u_up| - |u|²) / |u_up|²                                                     (2)

η is the share of the head that is lost between the two nodes and not spent against pressure and weight. To conserve
momentum where water slows down in jumps, and head elsewhere, is the rule of Stelling and Duinmeijer (Int. J. Numer.
Methods Fluids 43 (2003) 1329).  The rings matter: where neighbouring nodes follow different laws, neither momentum nor
head is conserved, and the speed of a bore varies by a tenth with the step; with the rings it varies by a hundredth.

Nodes above the surface hold the water of cells that it cuts.  Around a jump they keep the momentum of that water, and
what the pressure adds to it, instead of the velocity that is extrapolated from the water around them (`corrector.py`):
in cells wider than high the closest water of a node in the face of a bore is the slow one that the bore runs over."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from array_types import Array
from fluid.domain.graph import Graph
from fluid.domain.topology import NO_WATER, Topology
from fluid.numerics.fields import copied
from fluid.surface.volume import Flux
from fluid.transport.passed_on import pass_on
from fluid.transport.volume_transport import carry_volume
from kernels.decorators import inner, ranged, released
from kernels.threads import over, zeros

SHALLOW, DEEP = 2.0, 3.0
"""Depths in cell sizes down to which momentum counts in full, and at all."""
RINGS = 4
FAST = (1.0, 3.0)
"""Speeds in √(g h) between which velocity goes over to the momentum of the volume anywhere."""
RESOLVED = (10.0, 30.0)
"""|u| h/ν between which that sets in. Up to 100, the tip of a column of a thick liquid followed the paths, and gained
energy as that of water does without the momentum of the volume."""
DROP, LOST, FULL = (0.1, 0.3), (0.5, 0.9), (0.25, 0.75)
"""Where the ramps of (2) begin and end."""


@dataclass(frozen=True)
class Carried:
    """Result of the fluxes of a step at the nodes: water (N,) [m³], that of the fluxes along the edges, and swept (N,)
    [m³] what the surface brings beyond that (`swept_volume.py`); velocity (N, 3) [m/s], the weight w (N,) of it
    around jumps before it is cut off at depth, and that in fast water (N,); None where there is neither. jumps (N,):
    the weight around jumps alone, whatever `weight` contains · near_fast (N,): the largest `fast` of a node and those
    around it, of which some that are dry have none."""

    water: np.ndarray
    velocity: np.ndarray | None = None
    weight: np.ndarray | None = None
    fast: np.ndarray | None = None
    swept: np.ndarray | None = None
    jumps: np.ndarray | None = None
    near_fast: np.ndarray | None = None

    @classmethod
    def by(
        cls, flux: Flux, dt: float, velocity, acceleration, gravity, viscosity, spacing
    ) -> tuple[Carried, Array]:
        """After dt [s] by the flux, and the volume (edges,) [m³] as in `carry_volume`; velocity (N, 3) [m/s] before,
        which is overwritten, acceleration (N, 3) [m/s²] then, gravity [m/s²], viscosity: kinematic [m²/s], spacing (N,)
        [m]: size of the cells."""
        edges = flux.graph.edges
        n, size = len(flux.nodes), len(velocity)
        weight = zeros((size,))
        state = (flux.rate, flux.water, flux.capacity, velocity, acceleration, gravity, spacing)
        jumps = sum(over(_jumps, n, flux.nodes, edges, *state, weight))
        if jumps:
            for _ in range(RINGS):
                before, weight = weight, copied(weight)
                over(_wider, n, flux.nodes, edges, before, weight)
        fast = zeros((size,))
        n_fast = by_speed(flux.nodes, velocity, gravity, viscosity, spacing, fast)
        if not jumps and not n_fast:
            volume, moved = carry_volume(flux, dt)
            return cls(volume), moved
        near_fast = copied(fast)
        if n_fast:
            over(_wider, n, flux.nodes, edges, fast, near_fast)
        volume, moved = carry_volume(flux, dt, velocity)
        return cls(volume, velocity, weight, fast, jumps=weight, near_fast=near_fast), moved

    def near_the_surface(self) -> Carried:
        """The same with the velocity of fast water, too, only where that around jumps counts."""
        if self.velocity is None:
            return self
        assert self.weight is not None  # they are given with the velocity
        assert self.fast is not None
        none = np.zeros_like(self.fast)
        return replace(self, weight=np.maximum(self.weight, self.fast), fast=none, near_fast=none)

    def handed_on(self, heirs) -> Carried:
        """The same with another numbering of the nodes; heirs (N_new, N): from `volume.renumbering`."""
        water, swept = heirs @ self.water, heirs @ self.swept
        if self.velocity is None:
            return Carried(water, swept=swept)
        held = np.maximum(self.water, 0.0)[:, None]
        given = (self.velocity, self.weight, self.fast, self.jumps)
        fields = np.column_stack([np.asarray(field) for field in given])
        fields = (heirs @ (held * fields)) / np.maximum(heirs @ held, 1e-300)
        weight, fast, jumps = (fields[:, k].copy() for k in (3, 4, 5))
        near_fast = np.minimum(heirs @ self.near_fast, 1.0)  # dry nodes have it, too
        return Carried(water, fields[:, :3].copy(), weight, fast, swept, jumps, near_fast)

    def into(self, u, nodes, phi, graph: Graph, correction, held, t: Topology, on_open_side) -> Array:
        """Equation (1) for u (N, 3) [m/s] at the listed nodes (n,) that hold water, in place; φ (N,) [m].
        → share (N,) to which water at nodes above the surface keeps its own momentum.

        correction: `volume.VolumeCorrection` of what the nodes held (N,) [m³] · on_open_side (N,) bool: nodes that
        water leaves through: what the fluxes bring there is not yet all that came. Only where some water is fast, or
        there is a jump; `velocity` is overwritten."""
        jumps, share = np.empty(len(phi)), np.empty(len(phi))
        over(_shares, len(phi), self.jumps, self.near_fast, t.near_solids, on_open_side, jumps, share)
        gained = (correction.nodal_water, held, self.swept)
        pass_on(graph, correction.shift, gained, share, self.water, t.node_volume, self.velocity)
        at_surface = (phi, t.node_size, t.near_solids)
        state = ((self.water, t.node_volume), (self.weight, self.fast), at_surface, on_open_side)
        over(_mixed, len(nodes), nodes, *state, self.velocity, u)
        return jumps


def by_speed(nodes, velocity, gravity: float, viscosity: float, spacing, weight) -> int:
    """w in fast water at the listed nodes, in `weight` (N,), and at how many it is not zero.

    velocity (N, 3) [m/s] · gravity [m/s²] · viscosity: kinematic [m²/s] · spacing (N,) [m]: size of the cells"""
    return sum(over(_by_speed, len(nodes), nodes, velocity, gravity, viscosity, spacing, weight))


def share_of_fast(speed: float) -> float:
    """R(x; FAST) of a speed in √(g h)."""
    return min(1.0, max(0.0, (speed - FAST[0]) / (FAST[1] - FAST[0])))


@ranged
def _mixed(first, last, nodes, volumes, weights, at_surface, on_open_side, carried, u):
    """Equation (1) in place at the listed nodes that hold water.

    volumes (N,) [m³]: what nodes hold, and could hold · weights (N,): around jumps, and in fast water · at_surface
    (N,): φ and size of the cells [m], near solids bool."""
    (water, capacity), (around_jumps, fast), (phi, spacing, near_solids) = volumes, weights, at_surface
    for s in range(first, last):
        i = np.uint64(nodes[s])
        depth = (phi[i] / spacing[i] + DEEP) / (DEEP - SHALLOW)
        weight = 0.0 if near_solids[i] else around_jumps[i] * min(max(depth, 0.0), 1.0)
        weight = max(weight, 0.0 if on_open_side[i] else fast[i])
        if water[i] <= NO_WATER * capacity[i]:
            weight = 0.0
        for k in range(3):
            u[i, k] += weight * (carried[i, k] - u[i, k])


@ranged
def _shares(first, last, weight, fast, near_solids, on_open_side, jumps, larger):
    """The weight around jumps (N,), zero near solids and on open sides, and the larger of that and the one in fast
    water (N,), which counts on open sides, too: what the correction brings from there is then handed on."""
    for j in range(first, last):
        i = np.uint64(j)
        out = 0.0 if near_solids[i] or on_open_side[i] else weight[i]
        jumps[i], larger[i] = out, max(out, fast[i])


@released
def _jumps(first, last, nodes, edges, rate, water, capacity, u, a, gravity, spacing, weight):
    """Equation (2), (N,), in `weight`, zero at first, and at how many nodes it is not zero."""
    n_jumps = 0
    row, start, neighbour = edges.row, edges.start, edges.neighbour
    up, push = np.empty(3), np.empty(3)
    for place in range(first, last):
        i = np.uint64(nodes[place])
        r = np.uint64(row[i])
        came = 0.0
        up[:] = 0.0
        push[:] = 0.0
        for s in range(start[r], start[r + np.uint64(1)]):
            j = neighbour[s]
            if rate[s] < 0.0 and water[j] > 0.0:
                part = -rate[s] * min(water[j] / max(capacity[j], 1e-300), 1.0)
                came += part
                for k in range(3):
                    up[k] += part * u[j, k]
                    push[k] += part * (a[j, k] + a[i, k])
        if came > 0.0:
            speed, own = _size(up) / came, _size(u[i])
            drop = _ramp((speed - own) / np.sqrt(gravity * spacing[i]), DROP)
            if drop > 0.0:
                work = (up[0] * push[0] + up[1] * push[1] + up[2] * push[2]) / (came * came * speed)
                lost = 1.0 + (spacing[i] * work - own * own) / (speed * speed)
                weight[i] = drop * _ramp(lost, LOST) * _ramp(water[i] / max(capacity[i], 1e-300), FULL)
                n_jumps += weight[i] != 0.0
    return n_jumps


@ranged
def _by_speed(first, last, nodes, u, gravity, viscosity, spacing, weight):
    """(N,): R(|u|/√(g h); FAST), times R(|u| h/ν; RESOLVED) where ν > 0, at the listed nodes; at how many it is not
    zero."""
    n_fast = 0
    for s in range(first, last):
        i = nodes[s]
        speed = _size(u[i])
        weight[i] = _ramp(speed / np.sqrt(gravity * spacing[i]), FAST)
        if viscosity > 0.0:
            weight[i] *= _ramp(speed / (viscosity / spacing[i]), RESOLVED)
        n_fast += weight[i] != 0.0
    return n_fast


@ranged
def _wider(first, last, nodes, edges, weight, wider):
    """The largest weight (N,) of each node and those around it."""
    row, start, neighbour = edges.row, edges.start, edges.neighbour
    for place in range(first, last):
        i = np.uint64(nodes[np.uint64(place)])
        r, largest = np.uint64(row[i]), wider[i]
        for s in range(start[r], start[r + np.uint64(1)]):
            largest = max(largest, weight[neighbour[s]])
        wider[i] = largest


@inner
def _size(v):
    return np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])


@inner
def _ramp(x, ends):
    return min(1.0, max(0.0, (x - ends[0]) / (ends[1] - ends[0])))
