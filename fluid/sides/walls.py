"""Sides of the tank: closed (u·n = 0 on their nodes and the water slips, or u = 0) or open (p = 0, water leaves).

Where u = 0 holds in the water, dry nodes let it slip: the edge of the water would never come forth along such a side
otherwise, nor water from above reach it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from array_types import Bools, Floats, Ints
from fluid.sides.open_parts import corner_opposite, faces_of, open_faces
from fluid.surface.level_set import drain_films
from kernels.decorators import ranged
from kernels.threads import over

_SAME_DIRECTION = 0.3
"""Normals of one node that span less than this (singular value over the largest) count as one direction."""

LYING_OVER = 0.7
"""Cosine between the outward normal of an open side and upwards from which the side lies over the water."""


@dataclass(frozen=True, kw_only=True)
class Walls:
    """nodes (n,) on closed sides · projector (n, 3, 3) onto the directions they leave free to water ·
    sticking (k,) rows of those where u = 0, slipping (k, 3, 3) onto the directions they leave free where they are dry ·
    open_node (N,) bool, p = 0; open_nodes (k,) their numbers, open_projector (k, 3, 3) onto their normals ·
    open_faces (F, 3) nodes, open_area (F, 3) [m²] outward area vectors of the parts that solids leave open, open_cell
    (F,) behind them · rough_faces (C, 3), rough_area (C, 3) [m²], rough_cell (C,): the same for closed sides with no
    slip or friction. Cells are those of the background mesh, or of a domain (`on_domain`)."""

    nodes: Ints
    projector: Floats
    sticking: Ints
    slipping: Floats
    open_node: Bools
    open_nodes: Ints
    open_projector: Floats
    open_faces: Ints
    open_area: Floats
    open_cell: Ints
    rough_faces: Ints
    rough_area: Floats
    rough_cell: Ints
    flowing: Ints
    """Nodes (k,) whose velocity an inflow gives."""

    @classmethod
    def of(cls, mesh, is_open=None, is_smooth=None, no_slip: bool = False, sides=None) -> Walls:
        """is_open: function of face normals (B, 3) and centres (B, 3) [m] → (B,) bool; None: all closed.
        is_smooth: a function like is_open, of the closed sides with free slip whatever the other walls have, or None.
        no_slip: u = 0 on the other closed sides · sides: `inflow.Sides` or None; seas are open, but their own rules
        govern the outflow there; inflows are neither open nor rough."""
        x = mesh.nodes[mesh.boundary_faces]
        area = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        opened, smooth = (
            np.zeros(len(x), bool) if chosen is None else chosen(mesh.boundary_normal, x.mean(axis=1))
            for chosen in (is_open, is_smooth)
        )
        sea, flowing = (_chosen(sides, mesh, x, of_sea) for of_sea in (True, False))
        opened = (opened | sea) & ~flowing
        open_node = np.zeros(len(mesh.nodes), bool)
        open_node[mesh.boundary_faces[opened]] = True
        open_node[mesh.boundary_faces[flowing]] = False
        open_nodes, tangential = _projectors(mesh.boundary_faces[opened], area[opened])
        faces, closed = mesh.boundary_faces, ~opened
        nodes, projector = _projectors(faces[closed], area[closed])
        rough = closed & ~smooth & ~flowing
        sticking = np.flatnonzero(np.isin(nodes, faces[rough]) & no_slip)
        slipping = projector[sticking]
        projector[sticking] = 0.0
        free = opened & ~sea
        return cls(
            nodes=nodes,
            projector=projector,
            sticking=sticking,
            slipping=slipping,
            open_node=open_node,
            open_nodes=open_nodes,
            open_projector=np.eye(3) - tangential,
            open_faces=faces[free],
            open_area=area[free],
            open_cell=mesh.boundary_cell[free],
            rough_faces=faces[rough],
            rough_area=area[rough],
            rough_cell=mesh.boundary_cell[rough],
            flowing=np.unique(faces[flowing]),
        )

    def on_domain(self, domain, mesh) -> Walls:
        """The same sides on a PhysicalDomain of the background mesh, whose nodes are copies of those of the mesh: faces
        in every cell of the domain beside them."""
        parent_node = domain.parent_node
        as_it_was = len(domain.cells) == len(mesh.cells) and not domain.is_cut.any()
        if as_it_was and np.array_equal(parent_node, np.arange(len(self.open_node))):
            return self
        copies, row = _copies(self.nodes, parent_node)
        open_copies, open_row = _copies(self.open_nodes, parent_node)
        sticking, sticking_row = _copies(self.sticking, row)
        opened = _faces_on(domain, mesh, self.open_faces, self.open_cell)
        rough = _faces_on(domain, mesh, self.rough_faces, self.rough_cell)
        return Walls(
            nodes=copies,
            projector=self.projector[row],
            sticking=sticking,
            slipping=self.slipping[sticking_row],
            open_node=self.open_node[parent_node],
            open_nodes=open_copies,
            open_projector=self.open_projector[open_row],
            open_faces=opened.nodes,
            open_area=opened.share[:, None] * self.open_area[opened.row],
            open_cell=opened.cell,
            rough_faces=rough.nodes,
            rough_area=rough.share[:, None] * self.rough_area[rough.row],
            rough_cell=rough.cell,
            flowing=_copies(self.flowing, parent_node)[0],
        )

    def restriction(self):
        """Nodes (n,) on sides and projectors (n, 3, 3) onto the velocities that stresses in the water may change there:
        those that closed sides leave free, and only the normal one on open sides."""
        place = np.searchsorted(self.nodes, self.open_nodes)
        place = np.minimum(place, max(len(self.nodes) - 1, 0))
        both = self.nodes[place] == self.open_nodes if len(self.nodes) else np.zeros(len(place), bool)
        projector = self.projector.copy()
        P = projector[place[both]]
        projector[place[both]] = P @ self.open_projector[both] @ P
        nodes = np.concatenate([self.nodes, self.open_nodes[~both]])
        projector = np.concatenate([projector, self.open_projector[~both]])
        projector[np.isin(nodes, self.flowing)] = 0.0
        return nodes, projector

    @cached_property
    def closed_row(self) -> Ints:
        """(N,) row of each node in `nodes`; -1 where it is on no closed side, or water flows through one there."""
        row = np.full(len(self.open_node), -1)
        row[self.nodes] = np.arange(len(self.nodes))
        row[self.flowing], row[self.open_node] = -1, -1
        return row

    @cached_property
    def when_dry(self) -> Floats:
        """`projector` (n, 3, 3) where no side holds the water."""
        projector = self.projector.copy()
        projector[self.sticking] = self.slipping
        return projector

    @cached_property
    def outward(self):
        """Nodes (k,) of the open faces and their unit normals (k, 3) out of the tank."""
        nodes, place = np.unique(self.open_faces, return_inverse=True)
        total = np.zeros((len(nodes), 3))
        for corner in place.reshape(-1, 3).T:
            np.add.at(total, corner, self.open_area)
        return nodes, total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)

    def admit_air(self, phi, u, dt: float, spacing, up) -> None:
        """Let air enter at the open sides: where u (N, 3) [m/s] points into the tank, the surface, which was at the
        side at most, lies at least |u·n| dt inside after dt [s]. φ (N,) [m], carried by paths, is raised to that, in
        place. At a side that lies over the water, up (3,) [-], surface and side are parallel, and φ within a cell of
        the surface is raised by that: the surface has gone on from where it was. At other sides the surface meets the
        side, and a motion along it does not lower it.

        Paths that come from outside end at the side, where they would find the water that has just left: a drop that
        falls back from an open top would never end, and would run down the wall faster and faster.  Nodes at least one
        cell below the surface are left alone, so that a full channel open at both ends keeps flowing."""
        nodes, normal = self.outward
        if len(nodes) == 0:
            return
        inward = -dt * np.einsum("ij,ij->i", u[nodes], normal)
        coming = (inward > 0.0) & (phi[nodes] > -spacing[nodes])
        over = (normal @ up > LYING_OVER) & (phi[nodes] < spacing[nodes])
        gone = np.where(over, np.maximum(phi[nodes], 0.0) + inward, np.maximum(phi[nodes], inward))
        phi[nodes[coming]] = gone[coming]
        level = phi[nodes]
        drain_films(level, spacing[nodes])  # water up to the brim, rounded
        phi[nodes] = level

    def wet(self, phi):
        """φ < 0 (N,) bool for `slip`; None where no side holds the water, since it is not needed there."""
        return phi < 0.0 if len(self.sticking) else None

    def slip(self, u, wet=None) -> None:
        """Remove the velocity into the closed sides from u (N, 3) [m/s], in place, and where u = 0 all of it, but for
        nodes that are not wet (N,) bool; None: all are."""
        dry = np.zeros(0, np.int64)
        if wet is not None and len(self.sticking):
            dry = np.flatnonzero(~wet[self.nodes[self.sticking]])
        nodes = self.nodes[self.sticking[dry]]
        kept = u[nodes]
        over(_project, len(self.nodes), self.nodes, self.projector, u)
        if len(nodes):
            u[nodes] = np.einsum("nij,nj->ni", self.slipping[dry], kept)


@ranged
def _project(first, last, nodes, projector, u):
    """u_i <- P_i u_i of the listed nodes, in place."""
    for s in range(first, last):
        i = nodes[s]
        x, y, z = u[i, 0], u[i, 1], u[i, 2]
        for k in range(3):
            u[i, k] = projector[s, k, 0] * x + projector[s, k, 1] * y + projector[s, k, 2] * z


def _chosen(sides, mesh, x, of_sea: bool):
    """(B,) bool: boundary faces of all seas, or of all inflows."""
    chosen = np.zeros(len(x), bool)
    for side in sides.every if sides is not None else ():
        if side.is_sea == of_sea:
            chosen |= side.chosen(mesh.boundary_normal, x.mean(axis=1))
    return chosen


class _Faces(NamedTuple):
    """Faces on a domain: nodes (n, 3) · row (n,) of each in the faces of the mesh · cell (n,) of the domain behind it ·
    share (n,) of the area that is open."""

    nodes: Ints
    row: Ints
    cell: Ints
    share: Floats


def _faces_on(domain, mesh, faces, cell) -> _Faces:
    """The faces (F, 3) of background cells (F,) in all cells of the domain beside them."""
    corner = corner_opposite(mesh.cells[cell], faces)
    row, element, share = open_faces(domain, cell, corner)
    return _Faces(faces_of(domain.cells[element], corner[row]), row, element, share)


def _copies(nodes, parent_node):
    """Copies (m,) of the background nodes, in order, and the row in `nodes` of each."""
    place = np.full(max(parent_node.max(initial=0), nodes.max(initial=0)) + 1, -1)
    place[nodes] = np.arange(len(nodes))
    copies = np.flatnonzero(place[parent_node] >= 0)
    return copies, place[parent_node[copies]]


def _projectors(faces, area):
    """I - Q Qᵀ at the nodes of the faces, Q: directions spanned by the normals of the faces around the node."""
    nodes = np.unique(faces)
    place = np.searchsorted(nodes, faces)
    outer = np.zeros((len(nodes), 3, 3))
    unit = area / np.linalg.norm(area, axis=1, keepdims=True)
    for corner in range(3):
        np.add.at(outer, place[:, corner], unit[:, :, None] * unit[:, None, :])
    value, vector = np.linalg.eigh(outer)
    blocked = value > _SAME_DIRECTION**2 * value[:, -1:]
    Q = vector * blocked[:, None, :]
    return nodes, np.eye(3) - Q @ Q.transpose(0, 2, 1)
