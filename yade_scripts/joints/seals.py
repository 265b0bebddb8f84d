"""Faces that rest on one another without a joint and keep water out as long as they do.

A pair of faces that touched at the start is closed while its outline has opened by less than `OPENED` of its size and
slid by less than `SLID` of it. Contact forces move blocks that rest on one another by far less than that.
"""

from __future__ import annotations

import numpy as np

from array_types import Array
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import TouchingFaces, to_body

OPENED, SLID = 0.01, 0.5
"""Shares of the square root of the common area."""


class Seals:
    """Pairs of touching faces (coordinates of the scene), followed as the blocks move; they have no state of their
    own."""

    def __init__(self, blocks: list[Block], faces: list[TouchingFaces]):
        self.a = np.array([f.a for f in faces], np.int64)
        self.b = np.array([max(f.b, -1) for f in faces], np.int64)
        self.face_a = np.array([f.face_a for f in faces], np.int64)
        self.face_b = np.array([f.face_b for f in faces], np.int64)
        self._size = np.sqrt([f.area for f in faces])
        self._start = np.concatenate([[0], np.cumsum([len(f.polygon) for f in faces])]).astype(np.int64)
        self._of = np.repeat(np.arange(len(faces)), np.diff(self._start))
        centre = np.array([b.centre for b in blocks]).reshape(-1, 3)
        R = np.array([b.rotation for b in blocks]).reshape(-1, 3, 3)
        corners = np.concatenate([f.polygon for f in faces])
        self._in_a = to_body(corners, self.a[self._of], centre, R)
        self._in_b = to_body(corners, self.b[self._of], centre, R)
        self._normal = np.einsum("nji,nj->ni", R[self.a], np.array([f.normal for f in faces]))

    def closed_faces(self, x: Array, R: Array) -> tuple[Array, Array, Array]:
        """Both faces of each closed pair: block (m,), face (m,), half of the largest opening (m,) [m]; x (n, 3) [m] and
        R (n, 3, 3): places of the blocks."""
        opened, on = self._opened(x, R)
        return both_faces(self, on, 0.5 * opened[on])

    def closed(self, x: Array, R: Array) -> Array:
        """Numbers (k,) of the closed pairs."""
        return self._opened(x, R)[1]

    def _opened(self, x: Array, R: Array) -> tuple[Array, Array]:
        """Largest opening (pairs,) [m], and the numbers (k,) of the closed ones."""
        apart = _in_world(self._in_b, self.b[self._of], x, R) - _in_world(self._in_a, self.a[self._of], x, R)
        normal = np.einsum("nij,nj->ni", R[self.a], self._normal)[self._of]
        opening = np.einsum("ci,ci->c", apart, normal)
        sliding = np.linalg.norm(apart - opening[:, None] * normal, axis=1)
        opened, slid = (np.maximum.reduceat(values, self._start[:-1]) for values in (opening, sliding))
        return opened, np.flatnonzero((opened < OPENED * self._size) & (slid < SLID * self._size))

    def middles(self, on) -> Array:
        """A point of each of the faces that `both_faces` lists, in the frame of its block (m, 3) [m]."""
        first, count = self._start[:-1], np.diff(self._start)[:, None]
        in_a, in_b = (np.add.reduceat(local, first) / count for local in (self._in_a, self._in_b))
        return np.concatenate([in_a[on], in_b[on][self.b[on] >= 0]])


def both_faces(pairs, on, values) -> tuple[Array, Array, Array]:
    """Both faces of some of the pairs of blocks, `on` (k,), with values (k,) of theirs: block (m,), face (m,), value
    (m,). pairs: has a, b, face_a and face_b of each; b < 0: no block."""
    inner = pairs.b[on] >= 0
    return (
        np.concatenate([pairs.a[on], pairs.b[on][inner]]),
        np.concatenate([pairs.face_a[on], pairs.face_b[on][inner]]),
        np.concatenate([values, values[inner]]),
    )


def _in_world(local: Array, row: Array, x: Array, R: Array) -> Array:
    """Points (c, 3) of the blocks `row`; those of row -1 are in the world already."""
    world, on = local.copy(), row >= 0
    world[on] = x[row[on]] + np.einsum("cij,cj->ci", R[row[on]], local[on])
    return world
