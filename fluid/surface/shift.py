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


def diffused_shift(band, place, edges, c, residual, kappa, spacing, tolerance, most):
    """ψ (n,) on the band nodes (n,) by conjugate gradients.

    place (N,): their places in the band, -1 elsewhere · κ = kappa times the spacing (N,) [m] · at most `most`
    iterations, until the residual has fallen by the tolerance."""
    n, diagonal = len(band), c.copy()
    first = np.zeros(n + 1, np.uint32)
    over(_length_of_rows, n, band, place, edges, first[1:])
    accumulate(first)
    made = MadeRows(first, np.empty(first[-1], np.uint32), np.empty(first[-1]), diagonal)
    over(_rows_of_shift, n, band, place, edges, kappa, spacing, made)
    return _shift(first, made.column, made.entry, diagonal, residual, tolerance, most)


class MadeRows(NamedTuple):
    """The matrix c + κ K that is filled: first (n + 1,) entry of each row, column, entry, diagonal (n,)."""

    first: np.ndarray
    column: np.ndarray
    entry: np.ndarray
    diagonal: np.ndarray


@ranged
def _length_of_rows(begin, end, band, place, edges, found):
    """Edges that conduct within the band (n,), of each of its nodes."""
    graph_row, start, neighbour, stiffness = edges
    for r in range(begin, end):
        row = graph_row[band[r]]
        for s in range(start[row], start[row + 1]):
            if place[neighbour[s]] >= 0 and stiffness[s] < 0.0:
                found[r] += 1


@ranged
def _rows_of_shift(begin, end, band, place, edges, kappa, spacing, made):
    """κ K of the edges within the band that conduct, and c - Σ κ K on the diagonal, in place."""
    graph_row, start, neighbour, stiffness = edges
    first, column, entry, diagonal = made
    for r in range(begin, end):
        row, k = graph_row[band[r]], first[r]
        for s in range(start[row], start[row + 1]):
            q = place[neighbour[s]]
            if q >= 0 and stiffness[s] < 0.0:
                column[k] = q
                both = kappa * spacing[band[r]] + kappa * spacing[neighbour[s]]
                entry[k] = 0.5 * both * stiffness[s]
                diagonal[r] -= entry[k]
                k += 1


def _shift(first, column, entry, diagonal, residual, tolerance, most):
    """x (n,) of the rows first[r]:first[r + 1] of (column, entry) with their diagonal, which is overwritten."""
    n = len(diagonal)
    x, r, z, Ap = np.zeros(n), residual.copy(), np.empty(n), np.empty(n)
    rz, sums = _first_way(diagonal, r, z), np.empty(chunks_of(n))
    in_a_row(_iterated, (first, column, entry, diagonal), (x, r, z, z.copy(), Ap, sums), rz, tolerance, most)
    return x


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


@kernel
def _first_way(diagonal, r, z):
    """z = r/diagonal in place → r·z."""
    typical = diagonal.mean() if len(diagonal) > 0 else 1.0
    for i in range(len(diagonal)):
        if diagonal[i] <= 1e-9 * typical:  # nothing to shift there and nobody to pass it to
            diagonal[i], r[i] = typical, 0.0
        z[i] = r[i] / diagonal[i]
    return np.dot(r, z)


@ranged
def _product(begin, end, first, column, entry, diagonal, p, Ap, partial):
    """A p (n,), and p·A p."""
    for c in range(begin, end):
        dot = 0.0
        for r in range(c * CHUNK, min((c + 1) * CHUNK, p.shape[0])):
            total = diagonal[r] * p[r]
            for s in range(first[r], first[r + 1]):
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
