"""G and its transpose as one short row for each pair of a pressure unknown and a body that it wets.

As a sparse matrix G (n_dofs, 6 n_bodies) reads an index for every number; here six numbers share one. With 1000 blocks
both products take a third of the time, and the pressure solve asks for them in every iteration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

Array = np.ndarray


@dataclass(frozen=True)
class Wetting:
    """dof, body (k,) of each pair · rows (k, 6) [m², m³], entries of G · size: (n_dofs, n_bodies)."""

    dof: Array
    body: Array
    rows: Array
    size: tuple[int, int]

    @classmethod
    def of(cls, coupling) -> Wetting:
        """From csr (n_dofs, 6 n_bodies)."""
        row = np.repeat(np.arange(coupling.shape[0]), np.diff(coupling.indptr))
        body, component = coupling.indices // 6, coupling.indices % 6
        n_bodies = coupling.shape[1] // 6
        key, pair = np.unique(row * n_bodies + body, return_inverse=True)
        rows = np.zeros((len(key), 6))
        rows[pair, component] = coupling.data
        return cls(key // max(1, n_bodies), key % max(1, n_bodies), rows, (coupling.shape[0], n_bodies))

    def on_bodies(self, p: Array) -> Array:
        """Gᵀ p (6 n_bodies,) of p (n_dofs,)."""
        return _gather(self.dof, self.body, self.rows, p, self.size[1]).ravel()

    def on_water(self, velocity: Array) -> Array:
        """G V (n_dofs,) of V (6 n_bodies,)."""
        return _scatter(self.dof, self.body, self.rows, velocity.reshape(-1, 6), self.size[0])


@njit(cache=True)
def _gather(dof, body, rows, p, n_bodies):
    out = np.zeros((n_bodies, 6))
    for k in range(len(dof)):
        value = p[dof[k]]
        for c in range(6):
            out[body[k], c] += rows[k, c] * value
    return out


@njit(cache=True)
def _scatter(dof, body, rows, velocity, n_dofs):
    out = np.zeros(n_dofs)
    for k in range(len(dof)):
        total = 0.0
        for c in range(6):
            total += rows[k, c] * velocity[body[k], c]
        out[dof[k]] += total
    return out
