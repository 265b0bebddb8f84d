"""The shift ψ of the surface that brings the volume of the nodes to what it is to be, spread along the surface:

    (c + κ K) ψ = W - ∫_{φ<0} N dV

(`volume.py`, 2; again with what passes on in fast water and around jumps, `transport/passed_on.py`), by conjugate
gradients with the diagonal as preconditioner. Their loops are short, some thirty times three of them a step, and follow
one another in compiled code.

Of K only the edges with K_ij < 0 take part, which are all where no cell has an obtuse angle. Opposite an obtuse angle
K_ij is positive. The matrix of whole cells is positive semidefinite in spite of that, but neither the part of it
between the nodes of the band, nor one in which each edge has a κ of its own: on a bed of the mesh with flat cells,
halved twice at the shore (P61), its least eigenvalue was -2.3, scaled to a unit diagonal, and conjugate gradients
now and then gave a shift of more than two cells for volumes that were missing nowhere. With the negative entries alone
it is diagonally dominant, and what one node lacks lowers the surface nowhere."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fluid.numerics.fields import PLAIN, accumulate
from kernels.decorators import kernel, nogil, ranged
from kernels.in_a_row import done, handed, through
from kernels.threads import CHUNK, added_up, chunks_of, in_a_row, over

DIVIDED = 0.3
"""Cost of a row of a vector that is divided by the diagonal, in usual rows."""
IDLE = 1e-9
"""Share of the mean of the diagonal up to which a row is idle."""
NOBODY = np.zeros(0, np.int64)


class ShiftRows(NamedTuple):
    """The matrix c + κ K: first (n + 1,) entry of each row, column, entry, diagonal (n,), and idle (k,): rows in which
    there is nothing to shift and nobody to pass it to."""

    first: np.ndarray
    column: np.ndarray
    entry: np.ndarray
    diagonal: np.ndarray
    idle: np.ndarray

    def shift(self, residual, tolerance, most):
        """ψ (n,) for the right hand side (n,), by at most `most` iterations, until the residual has fallen by the
        tolerance."""
        n, r = len(residual), residual.copy()
        r[self.idle] = 0.0
        (z, p, Ap), x = np.empty((3, n)), np.zeros(n)
        over(_first_way, n, self.diagonal, r, z, p, weight=DIVIDED)
        vectors = (x, r, z, p, Ap, np.empty(chunks_of(n)))
        in_a_row(_iterated, self[:4], vectors, _dot(r, z), tolerance, most)
        return x


def rows_of_shift(band, place, edges, c, kappa, spacing) -> ShiftRows:
    """The matrix on the band nodes (n,).

    place (N,): their places in the band, -1 elsewhere · κ = kappa times the spacing (N,) [m]."""
    n, diagonal = len(band), np.empty(len(band))
    first = np.zeros(n + 1, np.uint32)
    over(_length_of_rows, n, band, place, edges, first[1:])
    accumulate(first)
    rows = (first, np.empty(first[-1], np.uint32), np.empty(first[-1]), diagonal)
    ends = over(_rows_of_shift, n, band, place, edges, c, kappa, spacing, rows)
    idle = NOBODY
    if min(least for least, _ in ends) <= 2.0 * IDLE * max(
        largest for _, largest in ends
    ):  # otherwise there is none
        typical = _mean(diagonal)
        idle = np.flatnonzero(diagonal <= IDLE * typical)
        diagonal[idle] = typical
    return ShiftRows(*rows, idle)


@ranged
def _length_of_rows(begin, end, band, place, edges, found):
    """Edges that conduct within the band (n,), of each of its nodes."""
    graph_row, start, neighbour, stiffness = edges
    for k in range(begin, end):
        r = np.uint64(k)
        row, count = np.uint64(graph_row[np.uint64(band[r])]), np.uint32(0)
        for s in range(start[row], start[row + np.uint64(1)]):
            count += np.uint32(place[neighbour[s]] >= 0 and stiffness[s] < 0.0)
        found[r] = count


@ranged
def _rows_of_shift(begin, end, band, place, edges, c, kappa, spacing, made):
    """κ K of the edges within the band that conduct, and c - Σ κ K on the diagonal; → its least and largest value."""
    graph_row, start, neighbour, stiffness = edges
    first, column, entry, diagonal = made
    least, largest = np.inf, 0.0
    for j in range(begin, end):
        r = np.uint64(j)
        i = np.uint64(band[r])
        row, k, total, own = np.uint64(graph_row[i]), np.uint64(first[r]), c[r], kappa * spacing[i]
        for s in range(start[row], start[row + np.uint64(1)]):
            q = place[neighbour[s]]
            if q >= 0 and stiffness[s] < 0.0:
                coupling = 0.5 * (own + kappa * spacing[neighbour[s]]) * stiffness[s]
                column[k], entry[k] = q, coupling
                total -= coupling
                k += np.uint64(1)
        diagonal[r] = total
        least, largest = min(least, total), max(largest, total)
    return least, largest


@nogil
def _iterated(crew, matrix, vectors, rz, tolerance, most):
    """Conjugate gradients from x = 0; vectors: x, r, z, direction p, A p, sums of chunks."""
    first, column, entry, diagonal = matrix
    x, r, z, p, Ap, sums = vectors
    goal, n, chunks = tolerance * tolerance * rz, len(x), len(sums)
    for _ in range(most):
        if rz <= goal or rz <= 0.0:
            break
        share = handed(crew, chunks, CHUNK, chunks)
        through(_product, share, chunks, (first, column, entry, diagonal, p, Ap, sums))
        done(crew)
        alpha = rz / added_up(sums)
        share = handed(crew, chunks, DIVIDED * CHUNK, chunks)
        through(_stepped, share, chunks, (alpha, diagonal, Ap, r, z, sums))
        done(crew)
        new = added_up(sums)
        # as much of the last step as a line to the goal would take: taken as a whole, one step more or less by the last
        # digit of r·z changes x by the tolerance
        taken = alpha if new >= goal else alpha * (rz - goal) / (rz - new)
        through(_turned, handed(crew, n, PLAIN, 1), n, (taken, z, new / rz, x, p))
        done(crew)
        rz = new


@ranged
def _first_way(begin, end, diagonal, r, z, p):
    """z = r/diagonal, and the first direction p."""
    for k in range(begin, end):
        i = np.uint64(k)
        z[i] = r[i] / diagonal[i]
        p[i] = z[i]


@kernel
def _dot(r, z):
    return np.dot(r, z)


@kernel
def _mean(diagonal):
    return diagonal.mean()


@ranged
def _product(begin, end, first, column, entry, diagonal, p, Ap, partial):
    """A p (n,), and p·A p."""
    for c in range(begin, end):
        dot = 0.0
        for k in range(c * CHUNK, min((c + 1) * CHUNK, p.shape[0])):
            r = np.uint64(k)
            total = diagonal[r] * p[r]
            for s in range(first[r], first[r + np.uint64(1)]):
                total += entry[s] * p[column[s]]
            Ap[r] = total
            dot += p[r] * total
        partial[c] = dot


@ranged
def _stepped(begin, end, share, diagonal, Ap, r, z, partial):
    """r - share Ap and z = r/diagonal of conjugate gradients, in place, and r·z."""
    for c in range(begin, end):
        dot = 0.0
        for k in range(c * CHUNK, min((c + 1) * CHUNK, r.shape[0])):
            i = np.uint64(k)
            r[i] -= share * Ap[i]
            z[i] = r[i] / diagonal[i]
            dot += r[i] * z[i]
        partial[c] = dot


@ranged
def _turned(first, last, taken, z, share, x, p):
    """x + taken p, and the direction z + share p, in place."""
    for k in range(first, last):
        i = np.uint64(k)
        x[i] += taken * p[i]
        p[i] = z[i] + share * p[i]
