"""Sides of the tank: closed (u·n = 0 on their nodes and the water slips, or u = 0) or open (p = 0, the water leaves)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_SAME_DIRECTION = 0.3
"""Normals of one node that span less than this (singular value over the largest) count as one direction."""


@dataclass(frozen=True)
class Walls:
    """nodes (n,) on closed sides · projector (n, 3, 3) onto the directions they leave free ·
    open_node (N,) bool, p = 0 · open_faces (F, 3) nodes, open_area (F, 3) [m²] outward area vectors ·
    closed_faces (C, 3), closed_area (C, 3) [m²], closed_cell (C,) background cell: the same of the closed sides."""

    nodes: np.ndarray
    projector: np.ndarray
    open_node: np.ndarray
    open_faces: np.ndarray
    open_area: np.ndarray
    closed_faces: np.ndarray
    closed_area: np.ndarray
    closed_cell: np.ndarray

    @classmethod
    def of(cls, mesh, is_open=None, no_slip: bool = False) -> Walls:
        """is_open: function of face normals (B, 3) and centres (B, 3) [m] → (B,) bool; None: all closed.
        no_slip: closed sides hold the water, u = 0."""
        x = mesh.nodes[mesh.boundary_faces]
        area = 0.5 * np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])
        opened = np.zeros(len(x), bool) if is_open is None else is_open(mesh.boundary_normal, x.mean(axis=1))
        open_node = np.zeros(len(mesh.nodes), bool)
        open_node[mesh.boundary_faces[opened]] = True
        faces, closed = mesh.boundary_faces, ~opened
        nodes, projector = _projectors(faces[closed], area[closed])
        if no_slip:
            projector = np.zeros_like(projector)
        of_closed = (faces[closed], area[closed], mesh.boundary_cell[closed])
        return cls(nodes, projector, open_node, faces[opened], area[opened], *of_closed)

    def on_copies(self, parent_node) -> Walls:
        """The same sides for nodes that are copies of background nodes, parent_node (N,)."""
        if np.array_equal(parent_node, np.arange(len(self.open_node))):
            return self
        place = np.full(len(self.open_node), -1)
        place[self.nodes] = np.arange(len(self.nodes))
        copies = np.flatnonzero(place[parent_node] >= 0)
        projector = self.projector[place[parent_node[copies]]]
        first = np.full(len(self.open_node), -1)
        first[parent_node[::-1]] = np.arange(len(parent_node))[::-1]
        faces, closed = first[self.open_faces], first[self.closed_faces]
        kept, left = (faces >= 0).all(axis=1), (closed >= 0).all(axis=1)
        return Walls(
            copies,
            projector,
            self.open_node[parent_node],
            faces[kept],
            self.open_area[kept],
            closed[left],
            self.closed_area[left],
            self.closed_cell[left],
        )

    def slip(self, u) -> None:
        """Take the part into the closed sides off u (N, 3), in place."""
        u[self.nodes] = np.einsum("nij,nj->ni", self.projector, u[self.nodes])


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
