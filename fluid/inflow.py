"""Sides of the tank through which water comes and goes: inflow with a given velocity, or the level of a still sea.

Inflow: u and the level are given.  On its nodes u = u_in (all components) and φ = z - level; what enters,

    q_i = -∮_wet N_i u·n dA,                                                                    (1)

n outward, joins the mass balance of the pressure, the conservative volume and the ledger.
Sea: φ = z - level on its nodes and there

    p = ρ g (level - z) - ½ ρ min(u·n, 0)²                                                     (2)

(what comes in was at rest: Bernoulli; it comes in straight.  With the static pressure alone, water that goes to and fro
through the side gains energy at every turn).  Equation (1) holds with the water's own velocity, both signs.  For water
far from waves: what reaches a sea partly comes back, as from any side.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numba import njit


@dataclass(frozen=True)
class Flow:
    """What an inflow brings: level(time) → z of the surface [m]; velocity(points (n, 3) [m], time) → (n, 3) [m/s]."""

    level: Callable
    velocity: Callable


@dataclass(frozen=True)
class Side:
    """A part of the boundary with its nodes on a domain.

    chosen: face normals (B, 3), centres (B, 3) [m] → (B,) bool · flow: Flow, or None for a sea · level(time) [m] ·
    faces (F, 3), area (F, 3) [m²] outward · nodes (n,), place (n, 3) [m], normal (n, 3) outward."""

    chosen: Callable
    flow: Flow | None
    level: Callable
    faces: np.ndarray
    area: np.ndarray
    nodes: np.ndarray
    place: np.ndarray
    normal: np.ndarray

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
        return cls(
            chosen, flow, flow.level if flow else level, faces, area[there], nodes, mesh.nodes[nodes], normal
        )

    def on_copies(self, first, active) -> Side:
        """The same side where first (N_mesh,) is the first copy of each background node, -1 none, and active (N,)."""
        faces = first[self.faces]
        kept = (faces >= 0).all(axis=1)
        kept[kept] = active[faces[kept]].all(axis=1)
        nodes = first[self.nodes]
        there = nodes >= 0
        return replace(
            self,
            faces=faces[kept],
            area=self.area[kept],
            nodes=nodes[there],
            place=self.place[there],
            normal=self.normal[there],
        )

    @property
    def is_sea(self) -> bool:
        return self.flow is None

    def hold(self, u, time: float) -> None:
        """u (N, 3) on the nodes of an inflow, in place; what comes in from a sea goes along the normal."""
        if self.flow is not None:
            u[self.nodes] = self.flow.velocity(self.place, time)
            return
        across = np.einsum("nk,nk->n", u[self.nodes], self.normal)
        coming = across < 0.0
        u[self.nodes[coming]] = across[coming, None] * self.normal[coming]

    def surface(self, phi, time: float) -> None:
        """φ (N,) of the given level on the nodes, in place."""
        phi[self.nodes] = self.place[:, 2] - self.level(time)

    def pressure(self, density: float, gravity: float, u, time: float):
        """Equation (2) at the nodes (n,) [Pa], u (N, 3) [m/s]; the weight goes on above the level: exact at rest."""
        coming = np.minimum(np.einsum("nk,nk->n", u[self.nodes], self.normal), 0.0)
        return density * (gravity * (self.level(time) - self.place[:, 2]) - 0.5 * coming**2)

    def rate(self, phi, u):
        """q (N,) [m³/s] of equation (1): what enters at each node; phi (N,), u (N, 3) [m/s]."""
        q = np.zeros(len(phi))
        share = wet_shares(phi[self.faces])
        inward = -np.einsum("fak,fk->fa", u[self.faces], self.area)
        np.add.at(q, self.faces, share * inward)
        return q


@njit(cache=True)
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
    """All inflows and seas of a tank: what the step asks of them.

    entered, left [m³]: water that came in and went out through them so far · energy [J] that they brought: kinetic,
    potential, and the work of the pressure."""

    def __init__(self, sides):
        self.every = tuple(sides)
        self.now = self.every
        self.entered = self.left = self.energy = 0.0

    def place(self, parent_node, n_background: int, active) -> None:
        """Follow the nodes of a domain: parent_node (N,), active (N,) bool."""
        first = np.full(n_background, -1)
        first[parent_node[::-1]] = np.arange(len(parent_node))[::-1]
        self.now = tuple(side.on_copies(first, active) for side in self.every)

    def hold(self, u, time: float) -> None:
        """Velocities of the inflows, in place."""
        for side in self.now:
            side.hold(u, time)

    def surface(self, phi, time: float) -> None:
        """Level sets of all sides, in place."""
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
        """Volume (N,) [m³] that comes in over dt [s] (negative: leaves, at most what is carried (N,) [m³]), and its
        rate at the inflows (N,) [m³/s], which the pressure must know."""
        rate, volume = np.zeros(len(phi)), np.zeros(len(phi))
        for side in self.now:
            q = side.rate(phi, u)
            volume += dt * q
            if not side.is_sea:
                rate += q
        return np.maximum(volume, -np.maximum(carried, 0.0)), rate

    def book(self, volume, head) -> None:
        """Add what came in at the nodes in a step: volume (N,) [m³], head (N,) [J/m³] its energy and pressure."""
        self.entered += float(volume[volume > 0.0].sum())
        self.left -= float(volume[volume < 0.0].sum())
        self.energy += float(volume @ head)

    def nodes(self) -> np.ndarray:
        """Nodes (n,) of all sides."""
        return np.concatenate([side.nodes for side in self.now])
