"""Pockets: connected parts of the air that reach no open side of the tank, nor one with a sea above its level.

Two dry nodes of one cell have air in common.  Nodes inside a solid connect only the nodes of their own cells, so that a
wall at least one cell thick separates the air on its two sides; thinner walls do so with multiple covers.  The volume
of a pocket is what the surface φ = 0 leaves of the fluid parts of its cells: exact for a φ that is linear in each cell.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from array_types import Array
from fluid.cut.parts_of_cell import root as find
from fluid.domain.moments import wet_fraction
from kernels.decorators import inner, kernel

NO_AIR, OPEN_AIR = -1, 0
"""Labels of nodes without air and of nodes that the open air reaches; the labels of pockets begin with 1."""
SLIVER = 0.1
"""Share of the volume of a pocket below which an overlap with another pocket, or with the open air, is neglected."""


def labelled(topology, phi, lets_air_out) -> tuple[Array, int]:
    """Label (N,) of the air at the nodes below the level set φ (N,) [m], and the number of pockets K.

    lets_air_out (N,) bool: nodes on open sides and on those with a sea. Pockets are numbered by their first node."""
    t = topology
    dry = (phi >= 0.0) & t.active
    root = _components(dry, t.covered, t.cells)
    label = np.full(len(phi), NO_AIR, np.int64)
    roots, first, place = np.unique(root[dry], return_index=True, return_inverse=True)
    outside = np.zeros(len(roots), bool)
    outside[place[lets_air_out[dry]]] = True
    number = np.zeros(len(roots), np.int64)
    closed = np.flatnonzero(~outside)
    number[closed[np.argsort(first[closed])]] = 1 + np.arange(len(closed))
    label[dry] = number[place]
    return label, len(closed)


@kernel
def _components(dry, covered, cells):
    """Root (N,) of the component of every dry node: nodes outside of solids joined across cells, then each of the
    others to the air of the first cell that it has in common with them, and to one another where there is none."""
    root, given = np.arange(dry.shape[0]), np.zeros(dry.shape[0], np.bool_)
    for inside in range(3):
        for e in range(cells.shape[0]):
            first = -1
            for a in range(4):
                i = cells[e, a]
                if dry[i] and (not covered[i] or inside == 2) and first < 0:
                    first = np.int64(i)
            if first < 0:
                continue
            for a in range(4):
                i = np.int64(cells[e, a])
                if not dry[i] or i == first:
                    continue
                if inside == 0 and not covered[i]:
                    _join(root, first, i)
                elif inside > 0 and covered[i] and not given[i]:
                    _join(root, first, i)
                    given[i] = True
    for i in range(root.shape[0]):
        root[i] = find(root, i)
    return root


@inner
def _join(root, i, j):
    a, b = find(root, i), find(root, j)
    if a < b:
        root[b] = a
    else:
        root[a] = b


def volumes(topology, phi, label, count: int) -> Array:
    """Volume (K,) [m³] of the pockets: what φ (N,) [m] leaves of the cells at their nodes."""
    t = topology
    cells = t.cells_around(label > OPEN_AIR)
    pocket = label[t.cells[cells]].max(axis=1)
    free = t.volume[cells] * (1.0 - wet_fraction(cells, phi, t.parts))
    return np.bincount(pocket - 1, free, minlength=count)[:count]


def bricks(topology, label, count: int) -> Array:
    """Mean volume (K,) [m³] of the bricks, of six cells each, around the nodes of the pockets.

    A cell counts for the pocket of each of its corners: nodes inside of solids may belong to pockets that have no cell
    to themselves."""
    t = topology
    cells = t.cells_around(label > OPEN_AIR)
    at_corners = label[t.cells[cells]]
    cell, corner = np.nonzero(at_corners > OPEN_AIR)
    pocket = at_corners[cell, corner] - 1
    total = np.bincount(pocket, t.size[cells[cell]] ** 3, minlength=count)[:count]
    return total / np.bincount(pocket, minlength=count)[:count]


def without(label, small) -> tuple[Array, int]:
    """Labels (N,) and number of the pockets that are left when those of small (K,) bool count as open air."""
    number = np.concatenate([[OPEN_AIR], np.where(small, OPEN_AIR, np.cumsum(~small))])
    return np.where(label > OPEN_AIR, number[np.maximum(label, 0)], label), int((~small).sum())


@dataclass(frozen=True)
class Descent:
    """The old pockets (O) from which the new pockets (K) come.

    share (O, K): share of the air of each old pocket that each new one holds · fresh (K,) [m³]: volume that belonged to
    the open air before · only (K,): the one old pocket that became this one, whole and without any other air; -1: none
    · opened (O,): share that the open air reaches now · gone (O,) bool: no volume is left."""

    share: Array
    fresh: Array
    only: Array
    opened: Array
    gone: Array

    @classmethod
    def of(cls, before, n_before: int, now, n_now: int, node_volume) -> Descent:
        """before, now (N,): labels on the same nodes; node_volume (N,) [m³]."""
        both = (before >= OPEN_AIR) & (now >= OPEN_AIR)
        common = np.zeros((n_before + 1, n_now + 1))
        np.add.at(common, (before[both], now[both]), node_volume[both])
        # cells newly cut by a moving wall may have nodes on its other side: no air passes there
        of_old, of_new = common.sum(axis=1, keepdims=True), common.sum(axis=0, keepdims=True)
        common[(common < SLIVER * of_old) & (common < SLIVER * of_new)] = 0.0
        common[1:, 0][common[1:, 0] < SLIVER * of_old[1:, 0]] = 0.0
        common[0, 1:][common[0, 1:] < SLIVER * of_new[0, 1:]] = 0.0
        total = common.sum(axis=1)
        share = common[1:] / np.maximum(total[1:], 1e-300)[:, None]
        gone = total[1:] == 0.0
        fresh = common[0, 1:]
        sole = (share > 0.0).sum(axis=0)
        parent = share.argmax(axis=0) if n_before else np.zeros(n_now + 1, np.int64)
        whole = np.array([n_before > 0 and share[parent[c], c] == 1.0 for c in range(n_now + 1)], bool)
        only = np.where((sole == 1) & whole, parent, -1)[1:]
        only[fresh > 0.0] = -1
        return cls(share[:, 1:], fresh, only, share[:, 0], gone)
