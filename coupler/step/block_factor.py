"""The factor L D Lᵀ of a sparse symmetric positive definite matrix with a row of 6×6 blocks for each body.

In every iteration for the pressure the structure answers a load (`pressure_with_structure.py`). Its matrix has entries
for pairs of bodies only that joints or contacts tie together, and all entries of such a pair: bodies are therefore
eliminated instead of unknowns, in the order of least degree (Tinney and Walker 1967, doi:10.1109/PROC.1967.6011): the
one with the fewest others tied to it goes first, and these are then tied to one another.  Blocks of fixed size need no
search for dense parts of the factor, as general solvers make it, and no permutation for the sake of accuracy is needed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from array_types import Array
from kernels.decorators import inner, kernel, plain


class BlockFactor(NamedTuple):
    """The factor over m of the bodies, in the order of their elimination.

    bodies (m,) · start (m + 1,), below: places of the bodies that each one is tied to when it is eliminated, in order ·
    own (m, 6, 6): unit lower triangle of the block of the body itself, and 1/D on its diagonal · beneath (.., 6, 6):
    blocks of L beneath it, rows of the other body."""

    bodies: Array
    start: Array
    below: Array
    own: Array
    beneath: Array

    @classmethod
    def of(cls, matrix: sp.csr_array, free: Array) -> BlockFactor:
        """Factor the rows and columns of the free (n,) bool bodies of a matrix (6n, 6n)."""
        given = (matrix.indptr, matrix.indices, matrix.data)
        bodies = np.flatnonzero(free)
        order, start, below = _order(*given, bodies, len(free))
        return cls(bodies[order], start, below, *_factored(*given, bodies[order], len(free), start, below))

    def solve(self, right: Array) -> Array:
        """The solution (6n,) for a right hand side (6n,); zero for the bodies that are not factored."""
        found = np.zeros_like(right)
        _solve(self, right, np.empty((len(self.bodies), 6)), found)
        return found


@kernel
def _order(indptr: Array, indices: Array, data: Array, bodies: Array, n: int) -> tuple[Array, Array, Array]:
    """Order (m,) in which the rows of `bodies` (m,) are eliminated; start (m + 1,), below: of `BlockFactor`."""
    m = len(bodies)
    row = np.full(n, -1, np.int64)
    for k in range(m):
        row[bodies[k]] = k
    tied, degree = np.zeros((m, m), np.bool_), np.zeros(m, np.int64)
    for k in range(m):
        for s in range(indptr[6 * bodies[k]], indptr[6 * bodies[k] + 6]):
            other = row[indices[s] // 6]
            if other >= 0 and other != k and data[s] != 0.0:
                _tie(tied, degree, k, other)
    order, place = np.empty(m, np.int64), np.full(m, -1, np.int64)
    start, below, beside = np.zeros(m + 1, np.int64), np.empty(4 * m, np.int64), np.empty(m, np.int64)
    for k in range(m):
        least = -1
        for r in range(m):
            if place[r] < 0 and (least < 0 or degree[r] < degree[least]):
                least = r
        order[k], place[least] = least, k
        count = 0
        for r in range(m if degree[least] > 0 else 0):
            if tied[least, r] and place[r] < 0:
                beside[count] = r
                count += 1
        for i in range(count):
            degree[beside[i]] -= 1
            for j in range(i):
                _tie(tied, degree, beside[i], beside[j])
        while start[k] + count > len(below):
            below = np.concatenate((below, np.empty_like(below)))
        below[start[k] : start[k] + count] = beside[:count]
        start[k + 1] = start[k] + count
    for k in range(m):
        for t in range(start[k], start[k + 1]):
            below[t] = place[below[t]]
        below[start[k] : start[k + 1]].sort()
    return order, start, below[: start[m]].copy()


@inner
def _tie(tied: Array, degree: Array, one: int, other: int) -> None:
    """Note that two bodies are tied, if they were not before."""
    if not tied[one, other]:
        tied[one, other] = tied[other, one] = True
        degree[one] += 1
        degree[other] += 1


@kernel
def _factored(
    indptr: Array, indices: Array, data: Array, bodies: Array, n: int, start: Array, below: Array
) -> tuple[Array, Array]:
    """own and beneath of `BlockFactor`, for `bodies` (m,) in the order of their elimination."""
    m = len(bodies)
    place, most = np.full(n, -1, np.int64), 0
    for k in range(m):
        place[bodies[k]] = k
        most = max(most, start[k + 1] - start[k])
    own, beneath = np.zeros((m, 6, 6)), np.zeros((len(below), 6, 6))
    for k in range(m):
        for r in range(6):
            line = 6 * bodies[k] + r
            for s in range(indptr[line], indptr[line + 1]):
                other, c = place[indices[s] // 6], indices[s] % 6
                if other == k:
                    own[k, r, c] += data[s]
                elif 0 <= other < k and data[s] != 0.0:
                    beneath[_found(below, start[other], k), r, c] += data[s]
    scaled = np.empty((most, 6, 6))
    for k in range(m):
        first, last = start[k], start[k + 1]
        _factor_own(own[k])
        for t in range(first, last):
            _divide(own[k], beneath[t], scaled[t - first])
        for t in range(first, last):
            column = below[t]
            _subtract(beneath[t], scaled[t - first], own[column])
            at = start[column]
            for later in range(t + 1, last):
                at = _found(below, at, below[later])
                _subtract(beneath[later], scaled[t - first], beneath[at])
    return own, beneath


@inner
def _found(below: Array, at: int, place: int) -> int:
    """Row of `below` from `at` on that names the place."""
    while below[at] != place:
        at += 1
    return at


@inner
def _factor_own(block: Array) -> None:
    """A symmetric block (6, 6) becomes its unit lower triangle L and 1/D on the diagonal."""
    for c in range(6):
        for r in range(c, 6):
            for e in range(c):
                block[r, c] -= block[r, e] * block[c, e] / block[e, e]
        pivot = block[c, c]
        block[c, c] = 1.0 / pivot
        for r in range(c + 1, 6):
            block[r, c] /= pivot


@inner
def _divide(own: Array, block: Array, scaled: Array) -> None:
    """A block beneath becomes that of L, and scaled (6, 6) the same times D."""
    for r in range(6):
        for c in range(6):
            value = block[r, c]
            for e in range(c):
                value -= scaled[r, e] * own[c, e]
            scaled[r, c] = value
        for c in range(6):
            block[r, c] = scaled[r, c] * own[c, c]


@inner
def _subtract(one: Array, other: Array, block: Array) -> None:
    """block -= one otherᵀ, each (6, 6)."""
    for r in range(6):
        for c in range(6):
            total = block[r, c]
            for e in range(6):
                total -= one[r, e] * other[c, e]
            block[r, c] = total


@plain
def _solve(factor: BlockFactor, right: Array, x: Array, found: Array) -> None:
    """Write the solution (6n,) of L D Lᵀ found = right; x (m, 6): work space."""
    bodies, start, below, own, beneath = factor
    for k in range(len(bodies)):
        for r in range(6):
            x[k, r] = right[6 * bodies[k] + r]
    for k in range(len(bodies)):
        for r in range(6):
            for c in range(r):
                x[k, r] -= own[k, r, c] * x[k, c]
        for t in range(start[k], start[k + 1]):
            _take_off(beneath[t], x[k], x[below[t]])
    for k in range(len(bodies) - 1, -1, -1):
        for r in range(6):
            x[k, r] *= own[k, r, r]
        for t in range(start[k], start[k + 1]):
            _take_off_transposed(beneath[t], x[below[t]], x[k])
        for r in range(5, -1, -1):
            for c in range(r + 1, 6):
                x[k, r] -= own[k, c, r] * x[k, c]
            found[6 * bodies[k] + r] = x[k, r]


@inner
def _take_off(block: Array, u: Array, v: Array) -> None:
    """v -= block u."""
    u0, u1, u2, u3, u4, u5 = u[0], u[1], u[2], u[3], u[4], u[5]
    for r in range(6):
        near = block[r, 0] * u0 + block[r, 1] * u1 + block[r, 2] * u2
        v[r] -= near + (block[r, 3] * u3 + block[r, 4] * u4 + block[r, 5] * u5)


@inner
def _take_off_transposed(block: Array, u: Array, v: Array) -> None:
    """v -= blockᵀ u."""
    u0, u1, u2, u3, u4, u5 = u[0], u[1], u[2], u[3], u[4], u[5]
    for c in range(6):
        near = block[0, c] * u0 + block[1, c] * u1 + block[2, c] * u2
        v[c] -= near + (block[3, c] * u3 + block[4, c] * u4 + block[5, c] * u5)
