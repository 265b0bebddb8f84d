"""Sides of the tank through which water comes and goes: inflow with a given velocity, or the level of a still sea.

Inflow: u and the level are given.  On its nodes u = u_in (all components) and φ = z - level; the flow that enters,

    q_i = -∮_wet N_i u·n dA,                                                                    (1)

with n outward, joins the conservative volume and the ledger.  Where a solid stands in the side, the integral is over
the part that it leaves open: the faces that its cell's tetrahedra (`fans.py`) have there.  The mass balance of the
pressure takes cells that the surface cuts whole, and so it takes their faces,

    q_i = -∮ N_i u·n dA,                                                                        (1a)

as it does with the polygons of bodies: a stream of one velocity then passes the side as it is.  With (1) the uppermost
wet nodes let out less than such a stream brings; it was dammed up and slowed down there, and since the velocity of the
side is given, so that it still left with it, it gained up to 3 % of the energy that left.  No air comes with the water:
what of (1a) lies above the surface is taken off the balance of the pocket of trapped air there.
Beyond the surface the pressure goes on with the weight, p = -ρ g φ, on the nodes of an inflow: its work is that of a
pressure that ends at the surface, and not of one that ends at the dry nodes.
Sea: φ = z - level on its nodes and there

    p = ρ g (level - z) - ½ ρ min(u·n, 0)²,    -u·n ≤ sqrt(2 g depth)                           (2)

(Bernoulli, since the water that enters was at rest; it enters along the normal, and no faster than by a fall through
the depth of the sea.  With the static pressure alone, water that oscillates through the side gains energy at every
reversal.  The last term uses the velocity before the step: without the limit a long first step made a thin sheet on a
dry floor 2.3 to 2.8 times as fast as that fall, and the next one threw it out again).  Equation (1) holds with the
water's own velocity, of either sign.  A sea is meant for sides far from waves: it partly reflects the waves that reach
it, as any side does.

In the steps of the start, and with implicit Euler, the water that the pressure of a sea sets in motion enters half a
step later.  Its work is booked ahead then,

    E += Σ_i p_i (V_i + δ (q_i' - q_i)),                                                                 (3)

V_i the volume that enters during the step of dt, q and q' of equation (1) at its beginning and its end, δ = dt/2 there
and zero else: water is carried half a step ahead, and V_i is what keeps the level at the side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from array_types import Array, Floats, Ints
from fluid.domain.moments import nodal_water
from fluid.sides.open_parts import corner_opposite, faces_of, open_triangles
from kernels.decorators import kernel


@dataclass(frozen=True)
class Flow:
    """The flow at an inflow: level(time) → z of the surface [m]; velocity(points (n, 3) [m], time) → (n, 3) [m/s]."""

    level: Callable
    velocity: Callable
    absorber: object = None
    """`Absorber` that the flow follows, None for a flow that is prescribed for all times."""
    varying: Callable | None = None
    """Levels at points (n, 3) [m] and a time → (n,) [m], where they differ along the side; `level` is their mean."""

    def level_at(self, points, time: float):
        """z [m] of the surface over points (n, 3) [m]: one number, or (n,)."""
        return self.level(time) if self.varying is None else self.varying(points, time)


@dataclass(frozen=True, kw_only=True)
class Side:
    """A part of the boundary with its nodes on a domain.

    chosen: face normals (B, 3), centres (B, 3) [m] → (B,) bool · flow: Flow, or None for a sea · level(time) [m] ·
    cell (F,) of each face, element (F,) its row on the domain, corner (F,) of the cell opposite to it, faces (F, 3) its
    nodes; on a domain a face that a solid cuts is replaced by its open triangles: hats (F, 3, 3), values at each corner
    (row) of the hats of the nodes, and area (F, 3) [m²] outward · nodes (n,), place (n, 3) [m], normal (n, 3)
    outward."""

    chosen: Callable
    flow: Flow | None
    level: Callable
    cell: Ints
    element: Ints
    corner: Ints
    faces: Ints
    hats: Floats
    area: Floats
    nodes: Ints
    place: Floats
    normal: Floats

    @classmethod
    def of(cls, mesh, chosen: Callable, flow: Flow | None = None, level: Callable | None = None) -> Side:
        """An inflow with its flow, or a sea with its level."""
        x = mesh.nodes[mesh.boundary_faces]
        there = chosen(mesh.boundary_normal, x.mean(axis=1))
        area = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        faces = mesh.boundary_faces[there]
        nodes, row = np.unique(faces, return_inverse=True)
        normal = np.zeros((len(nodes), 3))
        np.add.at(normal, row.reshape(faces.shape), area[there][:, None])
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        cell = mesh.boundary_cell[there]
        corner = corner_opposite(mesh.cells[cell], faces)
        return cls(
            chosen=chosen,
            flow=flow,
            level=flow.level if flow else cast("Callable", level),
            cell=cell,
            element=cell,
            corner=corner,
            faces=faces_of(mesh.cells[cell], corner),
            hats=np.broadcast_to(np.eye(3), (len(cell), 3, 3)),
            area=area[there],
            nodes=nodes,
            place=mesh.nodes[nodes],
            normal=normal,
        )

    def on_domain(self, domain, active) -> Side:
        """The same side on a domain, with the copies of its nodes and the open parts of its faces; active (N,) bool."""
        row = np.full(max(domain.parent_node.max(initial=-1), self.nodes.max(initial=-1)) + 1, -1)
        row[self.nodes] = np.arange(len(self.nodes))
        row = row[domain.parent_node]
        nodes = np.flatnonzero(row >= 0)
        face, element, hats, share = open_triangles(domain, self.cell, self.corner)
        faces = faces_of(domain.cells[element], self.corner[face])
        kept = active[faces].all(axis=1)
        return replace(
            self,
            cell=self.cell[face[kept]],
            element=element[kept],
            corner=self.corner[face[kept]],
            faces=faces[kept],
            hats=hats[kept],
            area=self.area[face[kept]] * share[kept, None],
            nodes=nodes,
            place=self.place[row[nodes]],
            normal=self.normal[row[nodes]],
        )

    @property
    def is_sea(self) -> bool:
        """Whether the side is a sea and not an inflow."""
        return self.flow is None

    def hold(self, u, time: float, gravity: float) -> None:
        """Impose u (N, 3) [m/s] on the nodes of an inflow, in place; water that enters from a sea moves along the
        normal, as in (2)."""
        if self.flow is not None:
            u[self.nodes] = self.flow.velocity(self.place, time)
            return
        across = np.einsum("nk,nk->n", u[self.nodes], self.normal)
        coming = across < 0.0
        depth = (self.level(time) - self.place[:, 2]).max(initial=0.0)
        across = np.maximum(across, -np.sqrt(2.0 * gravity * depth))
        u[self.nodes[coming]] = across[coming, None] * self.normal[coming]

    def surface(self, phi, time: float) -> None:
        """Impose φ (N,) [m] of the given level on the nodes, in place."""
        level = self.level(time) if self.flow is None else self.flow.level_at(self.place, time)
        phi[self.nodes] = self.place[:, 2] - level

    def pressure(self, density: float, gravity: float, u, time: float):
        """Equation (2) at the nodes (n,) [Pa], u (N, 3) [m/s]; the hydrostatic part continues above the level, which is
        exact at rest."""
        coming = np.minimum(np.einsum("nk,nk->n", u[self.nodes], self.normal), 0.0)
        return density * (gravity * (self.level(time) - self.place[:, 2]) - 0.5 * coming**2)

    def rate(self, phi, u):
        """q (N,) [m³/s] of equation (1), the inflow at each node; phi (N,), u (N, 3) [m/s]."""
        return self._rate(u, wet_shares(np.einsum("fca,fa->fc", self.hats, phi[self.faces])))

    def drive(self, u, void):
        """q (N,) [m³/s] of equation (1a), with the faces of all cells but the listed ones (k,); u (N, 3) [m/s]."""
        counted = ~np.isin(self.element, void)
        return self._rate(u, np.repeat(counted[:, None] / 3.0, 3, axis=1))

    def drive_of_air(self, phi, u, void):
        """What of `drive` passes above the surface of φ (N,) [m], at the dry nodes of each face: (N,) [m³/s]."""
        counted = ~np.isin(self.element, void)
        wet = wet_shares(np.einsum("fca,fa->fc", self.hats, phi[self.faces]))
        share = np.einsum("fca,fc->fa", self.hats, counted[:, None] * (1.0 / 3.0 - wet))
        above = -np.einsum("fa,fak,fk->f", share, u[self.faces], self.area)
        dry, q = phi[self.faces] >= 0.0, np.zeros(len(u))
        np.add.at(q, self.faces, dry * (above / np.maximum(dry.sum(axis=1), 1))[:, None])
        return q

    def _rate(self, u, wet):
        """q (N,) [m³/s] with ∫ N_a dA over what counts of each triangle, wet (F, 3), over its area."""
        q = np.zeros(len(u))
        share = np.einsum("fca,fc->fa", self.hats, wet)
        inward = -np.einsum("fak,fk->fa", u[self.faces], self.area)
        np.add.at(q, self.faces, share * inward)
        return q


@kernel
def wet_shares(phi):
    """∫_{φ<0} N_a dA over the area of each triangle (F, 3); φ (F, 3) at its corners."""
    out = np.zeros(phi.shape)
    for f in range(phi.shape[0]):
        n_wet = 0
        for a in range(3):
            n_wet += phi[f, a] < 0.0
        if n_wet == 3:
            out[f] = 1.0 / 3.0
        elif n_wet > 0:
            single = 0
            while (phi[f, single] < 0.0) != (n_wet == 1):
                single += 1
            b, c = (single + 1) % 3, (single + 2) % 3
            tb = phi[f, single] / (phi[f, single] - phi[f, b])
            tc = phi[f, single] / (phi[f, single] - phi[f, c])
            out[f, single] = tb * tc * (3.0 - tb - tc) / 3.0
            out[f, b], out[f, c] = tb * tb * tc / 3.0, tb * tc * tc / 3.0
            if n_wet == 2:
                for a in range(3):
                    out[f, a] = 1.0 / 3.0 - out[f, a]
    return out


class Sides:
    """All inflows and seas of a tank, as the step uses them.

    entered, left [m³]: water that has entered and left through them so far · energy [J] that they brought: kinetic,
    potential, and the work of the pressure, equation (3)."""

    def __init__(self, sides):
        self.every = tuple(sides)
        self.now = self.every
        self.entered = self.left = self.energy = 0.0

    def absorbers(self) -> list:
        """The absorbing sides."""
        return [s.flow.absorber for s in self.every if s.flow is not None and s.flow.absorber is not None]

    @property
    def absorbed(self) -> Array:
        """(k, 2) corrections to the level [m] and to the velocity inwards [m/s] of each absorbing side: what the side
        holds until its next update, wherever a body moves in between."""
        return np.array([(a.height, a.speed) for a in self.absorbers()]).reshape(-1, 2)

    @absorbed.setter
    def absorbed(self, corrections: Array) -> None:
        for absorber, (height, speed) in zip(self.absorbers(), corrections.tolist()):
            absorber.height, absorber.speed = height, speed

    def place(self, domain, active) -> None:
        """Follow a domain; active (N,) bool: its nodes with fluid around."""
        self.now = tuple(side.on_domain(domain, active) for side in self.every)

    def hold(self, u, time: float, gravity: float) -> None:
        """Impose the velocities of the sides on (N, 3), in place."""
        for side in self.now:
            side.hold(u, time, gravity)

    def surface(self, phi, time: float) -> None:
        """Impose the level sets of all sides on phi (N,) [m], in place."""
        for side in self.now:
            side.surface(phi, time)

    def pressure(self, density: float, gravity: float, u, time: float):
        """(N,) [Pa] on the nodes of seas, zero elsewhere; u (N, 3) [m/s]."""
        p = np.zeros(len(u))
        for side in self.now:
            if side.is_sea:
                p[side.nodes] = side.pressure(density, gravity, u, time)
        return p

    def through(self, phi, u, dt: float, carried):
        """Volume (N,) [m³] that enters at the inflows over dt [s] (negative: leaves, at most the water carried (N,)
        [m³])."""
        return np.maximum(dt * self.flow_rate(phi, u), -np.maximum(carried, 0.0))

    def drive(self, u, void):
        """q (N,) [m³/s] of equation (1a) at the inflows, for the mass balance of the pressure, which leaves out the
        cells `void` (k,); u (N, 3) [m/s]."""
        return self._summed(len(u), False, lambda side: side.drive(u, void))

    def drive_of_air(self, phi, u, void):
        """What of `drive` passes above the surface of φ (N,) [m], at dry nodes: (N,) [m³/s]. No air comes with it, so
        that pockets have to do without it."""
        return self._summed(len(u), False, lambda side: side.drive_of_air(phi, u, void))

    def flow_rate(self, phi, u):
        """q (N,) [m³/s] of equation (1) at the nodes of the inflows; phi (N,), u (N, 3) [m/s]."""
        return self._summed(len(phi), False, lambda side: side.rate(phi, u))

    def exchanged(self, topology, phi, carried):
        """Volume (N,) [m³] that enters from the seas (negative: leaves): the water at their nodes below the level set φ
        (N,) [m] with their levels, less the water carried there (N,) [m³]."""
        found = np.zeros(len(phi))
        for side in self.now:
            if side.is_sea:
                ours = np.zeros(len(phi), bool)
                ours[side.nodes] = True
                held = nodal_water(topology.cells_around(ours), 0.0, phi, topology.parts, len(phi))
                found[side.nodes] = held[side.nodes] - carried[side.nodes]
        return found

    def sea_rate(self, phi, u):
        """q (N,) [m³/s] of equation (1) at the nodes of the seas; phi (N,), u (N, 3) [m/s]."""
        return self._summed(len(phi), True, lambda side: side.rate(phi, u))

    def _summed(self, n: int, seas: bool, rate: Callable):
        """(n,) sum of what `rate` gives for each sea, or for each inflow."""
        total = np.zeros(n)
        for side in self.now:
            if side.is_sea == seas:
                total += rate(side)
        return total

    def add_step(self, volume, head, phi, weight, ahead) -> None:
        """Add the water that entered at the nodes in a step to the totals.

        volume (N,) [m³] · head (N,) [J/m³]: its energy and pressure, continued in place with the weight ρ g [N/m³]
        beyond the surface of φ (N,) [m] at the inflows · ahead [J]: work of the pressure of seas beyond it, equation
        (3)."""
        dry = self.flowing()
        dry = dry[phi[dry] > 0.0]
        head[dry] -= weight * phi[dry]
        self.entered += float(volume[volume > 0.0].sum())
        self.left -= float(volume[volume < 0.0].sum())
        self.energy += float(volume @ head) + ahead

    def given(self, phi, velocities, mass, impulse) -> float:
        """What a change of the velocity of inflows adds to the energy that comes in [J]: that of the water at their
        nodes, half a cell, which is given its velocity without a force, less half of the work of the pressure on the
        change, since it acts while the velocity changes,

            ½ Σ M_i Δ|u_i|² - ½ Σ dt p_i Δq_i.

        phi (N,) [m] · velocities (N, 3) [m/s] before and after a step dt · mass M (N,) [kg] · impulse dt p (N,)
        [Pa s]."""
        at = self.flowing()
        before, after = (u[at] for u in velocities)
        if np.array_equal(before, after):
            return 0.0
        gained = 0.5 * float(mass[at] @ ((after**2).sum(axis=1) - (before**2).sum(axis=1)))
        rates = [float(self.flow_rate(phi, u) @ impulse) for u in velocities]
        return gained - 0.5 * (rates[1] - rates[0])

    def flowing(self) -> Array:
        """Nodes (n,) of the inflows."""
        found = [side.nodes for side in self.now if not side.is_sea]
        return np.unique(np.concatenate(found)) if found else np.zeros(0, np.int64)

    def nodes(self) -> Array:
        """Nodes (n,) of all sides."""
        return np.concatenate([side.nodes for side in self.now])
