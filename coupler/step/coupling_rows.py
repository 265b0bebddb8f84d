"""G and its transpose as one short row for each pair of a pressure unknown and a body that it wets.

As a sparse matrix G (n_dofs, 6 n_bodies) reads an index for every number; here six numbers share one. With 1000 blocks
both products take a third of the time, and the pressure solve asks for them in every iteration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from array_types import Array, Floats, Ints
from kernels.decorators import kernel


@dataclass(frozen=True)
class Wetting:
    """dof, body (k,) of each pair · rows (k, 6) [m², m³], entries of G · n_dofs · start (n_bodies + 1,): pairs of each
    body in own_dof (k,) and own_rows (k, 6), the same ordered by bodies: read in order, both products are faster."""

    dof: Ints
    body: Ints
    rows: Floats
    n_dofs: int
    start: Ints
    own_dof: Ints
    own_rows: Floats

    @classmethod
    def of(cls, coupling: sp.csr_matrix) -> Wetting:
        """From csr (n_dofs, 6 n_bodies)."""
        dof, body, rows = _pairs(coupling.indptr, coupling.indices, coupling.data)
        by_body = _by_body(dof, body, rows, coupling.shape[1] // 6)
        return cls(dof, body, rows, coupling.shape[0], *by_body)

    def on_bodies(self, p: Array) -> Array:
        """Gᵀ p (6 n_bodies,) of p (n_dofs,)."""
        return _gather(self.start, self.own_dof, self.own_rows, p).ravel()

    def on_water(self, velocity: Array) -> Array:
        """G V (n_dofs,) of V (6 n_bodies,)."""
        return _scatter(self.dof, self.body, self.rows, velocity.reshape(-1, 6), self.n_dofs)


@kernel
def _pairs(indptr: Array, indices: Array, data: Array) -> tuple[Array, Array, Array]:
    """dof, body (k,), rows (k, 6) of the entries. Each body is sought among the few that its row had before."""
    dof, body = np.empty(len(indices), np.int64), np.empty(len(indices), np.int64)
    rows = np.zeros((len(indices), 6))
    count = 0
    for i in range(len(indptr) - 1):
        first = count
        for s in range(indptr[i], indptr[i + 1]):
            b = indices[s] // 6
            k = count - 1
            while k >= first and body[k] != b:
                k -= 1
            if k < first:
                k = count
                dof[k], body[k] = i, b
                count += 1
            rows[k, indices[s] % 6] += data[s]
    return dof[:count].copy(), body[:count].copy(), rows[:count].copy()


@kernel
def _by_body(dof: Array, body: Array, rows: Array, n_bodies: int) -> tuple[Array, Array, Array]:
    """start (n_bodies + 1,), dof (k,) and rows (k, 6) of the pairs, body by body."""
    start = np.zeros(n_bodies + 1, np.int64)
    for b in body:
        start[b + 1] += 1
    for b in range(n_bodies):
        start[b + 1] += start[b]
    place = start[:-1].copy()
    own_dof, own_rows = np.empty_like(dof), np.empty_like(rows)
    for k in range(len(dof)):
        at = place[body[k]]
        own_dof[at] = dof[k]
        for c in range(6):
            own_rows[at, c] = rows[k, c]
        place[body[k]] += 1
    return start, own_dof, own_rows


@kernel
def _gather(start: Array, dof: Array, rows: Array, p: Array) -> Array:
    out = np.zeros((len(start) - 1, 6))
    for b in range(len(start) - 1):
        f0 = f1 = f2 = f3 = f4 = f5 = 0.0  # six sums in registers: an array costs twice as much
        for k in range(start[b], start[b + 1]):
            value = p[dof[k]]
            f0 += rows[k, 0] * value
            f1 += rows[k, 1] * value
            f2 += rows[k, 2] * value
            f3 += rows[k, 3] * value
            f4 += rows[k, 4] * value
            f5 += rows[k, 5] * value
        out[b, 0], out[b, 1], out[b, 2] = f0, f1, f2  # by numbers: a row as a whole takes 2 s to compile
        out[b, 3], out[b, 4], out[b, 5] = f3, f4, f5
    return out


@kernel
def _scatter(dof: Array, body: Array, rows: Array, velocity: Array, n_dofs: int) -> Array:
    out = np.zeros(n_dofs)
    for k in range(len(dof)):
        total = 0.0
        for c in range(6):
            total += rows[k, c] * velocity[body[k], c]
        out[dof[k]] += total
    return out
