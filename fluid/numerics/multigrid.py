"""Multigrid by aggregation: a preconditioner that is cheap enough to be rebuilt in every step for its wet nodes.

Pairs of pairs of pairs of the most strongly coupled unknowns (Notay, Electron. Trans. Numer. Anal. 37 (2010) 123)
become one unknown of the coarser level: blocks of 2 x 2 x 2 nodes on a lattice, flat ones where cells are flat, and
never across a thin wall, since nothing couples its two sides. With the piecewise constant transfer P the matrix of the
coarser level is s Pᵀ A P. Constants overestimate the energy of smooth functions by about two; s < 1 makes up for it
(Braess, Computing 55 (1995) 379). One cycle: a forward Gauss-Seidel sweep, the coarser level, a backward sweep. It is
symmetric and positive definite, and the same in every run.

Sweeps of large levels go by blocks, which threads share: within a block they are Gauss-Seidel sweeps, and from other
blocks they use the values before the sweep. The blocks depend on the number of unknowns alone, so the result does not
depend on the threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Floats, Integers
from kernels.decorators import kernel, nogil, plain, ranged, released
from kernels.in_a_row import done, handed, through
from kernels.threads import in_a_row, over

PAIRINGS = 3
"""Pairs of pairs of pairs: about eight unknowns become one."""
SCALE = 0.55
"""The factor s of the coarser matrix."""
COARSEST = 100
"""Most unknowns of a level that is solved by its inverse."""
LEAST_GAIN = 0.8
"""A level is the last one where the next would keep more than this share of its unknowns."""
SWEEPS = 4
"""Double sweeps on a last level that is too large for its inverse."""
BLOCK, MOST_BLOCKS = 4096, 64
"""Least number of unknowns in a block of a sweep, and largest number of blocks."""
SHARED = 2048
"""Least number of unknowns of a level of one block of which threads share what is left after its forward sweep."""
COARSE_ROW, AGGREGATE = 20, 4
"""Cost of summing a row of a coarser level, and the values of an aggregate, in rows of a loop."""
ROW = 10
"""Cost of going through a row of the matrix twice."""
SAME = 0.99
"""Share of the strongest coupling from which one counts as equally strong: round-off must not choose the pairs."""


class Matrix(NamedTuple):
    """A symmetric matrix with the fields of `Level`, except those that its sweeps need."""

    start: Integers
    middle: Integers
    column: Integers
    entry: Floats
    diagonal: Floats


class Level(NamedTuple):
    """Rows of A: start[i]:middle[i] of (column, entry) lie left of the diagonal, middle[i]:start[i+1] right of it.

    diagonal (n,) and its inverse · aggregate (n,) unknown of the coarser level, -1 none (an unknown without
    neighbours, which one sweep solves) · first, member: unknowns of each aggregate, as `_members` gives them · start,
    middle, column: unsigned, see `topology.py`."""

    start: Integers
    middle: Integers
    column: Integers
    entry: Floats
    diagonal: Floats
    inverse: Floats
    aggregate: Integers
    first: Integers
    member: Integers

    def blocks(self) -> Array:
        """Where the blocks of its sweeps begin and end (b + 1,)."""
        n = len(self.diagonal)
        count = max(1, min(MOST_BLOCKS, n // BLOCK))
        return np.array([n * k // count for k in range(count + 1)])


def unsigned(A) -> tuple[Array, Array]:
    """indptr and indices of A: csr as uint32, see `topology.py`; scipy keeps them in 32 bits or, after sums, in 64."""
    return tuple(k.view(np.uint32) if k.itemsize == 4 else k.astype(np.uint32) for k in (A.indptr, A.indices))


class Multigrid:
    """Preconditioner of A: csr (n, n), symmetric positive definite."""

    def __init__(self, A):
        self.levels: list[Level] = []
        parts = _split(*unsigned(A), A.data)
        while len(parts[-1]) > COARSEST:
            aggregate, count = _aggregates(parts)
            if count > LEAST_GAIN * len(aggregate):
                break
            members = _members(aggregate, count)
            self.levels.append(Level(*parts, 1.0 / parts[-1], aggregate, *members))
            parts = _split(*_galerkin(Matrix(*parts), aggregate, members, SCALE))
        n = len(parts[-1])
        none = np.zeros(1, np.uint32)
        self._last = Level(*parts, 1.0 / parts[-1], np.full(n, -1, np.int32), none, none[:0])
        self._dense = _dense_inverse(self._last) if n <= COARSEST else None
        self._blocks = [level.blocks() for level in self.levels]

    def __call__(self, r) -> Array:
        """M⁻¹ r (n,)."""
        return self._cycle(0, r)

    def _cycle(self, depth: int, r):
        """M⁻¹ r (n,) of a level and those below it; large levels go by blocks."""
        if depth == len(self.levels):
            return self._at_the_bottom(r)
        at = self.levels[depth]
        below = self.levels[depth + 1] if depth + 1 < len(self.levels) else self._last
        n, n_coarse, bounds = len(r), len(below.diagonal), self._blocks[depth]
        rows = (at.start, at.column, at.entry, at.inverse, at.aggregate)
        whole = len(bounds) == 2
        if whole and n < SHARED:
            x, coarse = _down(*rows, at.middle, n_coarse, r)
        else:
            (x, spare), coarse = np.empty((2, n)), np.empty(n_coarse)
            in_a_row(_shared_down, bounds, at, r, x, spare, coarse)
        coarse = self._cycle(depth + 1, coarse)
        if whole:
            _up(*rows, coarse, r, x)
        else:
            in_a_row(_shared_up, bounds, at, coarse, r, spare, x)
        return x

    def _at_the_bottom(self, r):
        if self._dense is not None:
            return self._dense @ r
        at, x = self._last, np.zeros(len(r))
        for _ in range(SWEEPS):
            _forward(at.start, at.column, at.entry, at.inverse, r, x)
        for _ in range(SWEEPS):
            _backward(at.start, at.column, at.entry, at.inverse, r, x)
        return x


def _dense_inverse(level: Level):
    A = np.diag(level.diagonal)
    row = np.repeat(np.arange(len(A)), np.diff(level.start))
    A[row, level.column] = level.entry
    return np.linalg.inv(A)


def _split(indptr, indices, data):
    """start, middle, column, entry, diagonal of Level from the rows of a csr matrix."""
    n, most = len(indptr) - 1, max(len(indices) - len(indptr) + 1, 0)
    start, middle, diagonal = np.empty(n + 1, np.uint32), np.empty(n, np.uint32), np.empty(n)
    column, entry = np.empty(most, np.uint32), np.empty(most)
    start[0] = 0
    if all(over(_parted, n, indptr, indices, data, start[1:], middle, column, entry, diagonal, weight=ROW)):
        return start, middle, column, entry, diagonal
    return _split_any(indptr, indices, data)


@ranged
def _parted(first, last, indptr, indices, data, end, middle, column, entry, diagonal):
    """Rows of `_split`, each of which has one entry on the diagonal; → whether that is so."""
    for row in range(first, last):
        i, one = np.uint64(row), np.uint64(1)
        begin, below, right = np.int64(indptr[i]) - row, np.int64(0), np.int64(0)
        for s in range(indptr[i], indptr[i + one]):
            below += indices[s] < i
            right += indices[s] > i
        wrong = below + right + 1 != np.int64(indptr[i + one]) - np.int64(indptr[i])
        if wrong or begin < 0 or begin + below + right > column.shape[0]:
            return False
        middle[i], end[i] = begin + below, begin + below + right
        k, after = np.uint64(begin), np.uint64(begin + below)
        for s in range(indptr[i], indptr[i + one]):
            if indices[s] < i:
                column[k], entry[k] = indices[s], data[s]
                k += one
            elif indices[s] > i:
                column[after], entry[after] = indices[s], data[s]
                after += one
            else:
                diagonal[i] = data[s]
    return True


@kernel
def _split_any(indptr, indices, data):
    """`_split` where a row may have several entries on the diagonal, or none."""
    n = len(indptr) - 1
    start, middle = np.zeros(n + 1, np.uint32), np.empty(n, np.uint32)
    column, entry = np.empty(len(indices), np.uint32), np.empty(len(indices))
    diagonal = np.zeros(n)
    k = 0
    for i in range(n):
        for s in range(indptr[i], indptr[i + 1]):
            if indices[s] < i:
                column[k], entry[k] = indices[s], data[s]
                k += 1
            elif indices[s] == i:
                diagonal[i] += data[s]
        middle[i] = k
        for s in range(indptr[i], indptr[i + 1]):
            if indices[s] > i:
                column[k], entry[k] = indices[s], data[s]
                k += 1
        start[i + 1] = k
    return start, middle, column[:k], entry[:k], diagonal


def _aggregates(parts):
    """aggregate (n,) of every unknown, -1 for one without any coupling, and how many aggregates there are."""
    aggregate, *members = _matched(*parts)
    pairs = aggregate
    for _ in range(PAIRINGS - 1):
        parts = _split(*_galerkin(Matrix(*parts), pairs, members, 1.0))
        pairs, *members = _matched(*parts)
        aggregate = _chained(aggregate, pairs)
    return aggregate, len(members[0]) - 1


@kernel
def _matched(start, middle, column, entry, diagonal):
    """Number of the pair of every unknown (n,), -1 without any coupling, and the unknowns of every pair, as `_members`
    gives them. Each unknown in turn takes the free one that is coupled to it most strongly, of equals the first, or
    stays alone. That one comes after it: those before are taken."""
    n = len(diagonal)
    pair, count = np.full(n, -1, np.int32), 0
    first, member, m = np.empty(n + 1, np.uint32), np.empty(n, np.uint32), 0
    first[0] = 0
    for i in range(n):
        if pair[i] >= 0 or start[i + 1] == start[i]:
            continue
        strongest, partner = 0.0, -1
        for s in range(middle[i], start[i + 1]):
            if pair[column[s]] < 0:
                strongest = max(strongest, -entry[s])
        for s in range(middle[i], start[i + 1]):
            j = column[s]
            if pair[j] < 0 and -entry[s] >= SAME * strongest > 0.0 and (partner < 0 or j < partner):
                partner = j
        pair[i], member[m] = count, i
        m += 1
        if partner >= 0:
            pair[partner], member[m] = count, partner
            m += 1
        count += 1
        first[count] = m
    return pair, first[: count + 1].copy(), member[:m].copy()


@kernel
def _chained(first, second):
    """second[first] (n,), -1 where either is."""
    out = np.full(len(first), -1, np.int32)
    for i in range(len(first)):
        if first[i] >= 0:
            out[i] = second[first[i]]
    return out


def _galerkin(fine: Matrix, aggregate, members, scale):
    """scale Pᵀ A P as csr (indptr, indices, data), the diagonal first in every row; members: those of `_members`."""
    n = len(members[0]) - 1
    rows = (*members, fine, aggregate, n, scale)
    parts = over(_coarse_rows, n, *rows, weight=COARSE_ROW, pieces=1)
    if len(parts) == 1:
        return parts[0]
    lengths, indices, data = zip(*parts)
    before = np.cumsum([0, *(length[-1] for length in lengths)])
    indptr = np.concatenate([lengths[0][:1], *(length[1:] + k for length, k in zip(lengths, before))])
    return indptr.astype(np.uint32), np.concatenate(indices), np.concatenate(data)


@kernel
def _members(aggregate, n):
    """first (n + 1,), member: the unknowns of every aggregate, listed consecutively."""
    first = np.zeros(n + 1, np.uint32)
    for i in range(len(aggregate)):
        if aggregate[i] >= 0:
            first[aggregate[i] + 1] += 1
    for k in range(n):
        first[k + 1] += first[k]
    filled, member = first[:-1].copy(), np.empty(first[-1], np.uint32)
    for i in range(len(aggregate)):
        if aggregate[i] >= 0:
            member[filled[aggregate[i]]] = i
            filled[aggregate[i]] += 1
    return first, member


@released
def _coarse_rows(begin_row, end_row, first, member, fine, aggregate, n, scale):
    """Rows of `_galerkin`: indptr from 0, indices, data."""
    start, column, entry, diagonal = fine.start, fine.column, fine.entry, fine.diagonal
    room = end_row - begin_row
    for t in range(first[begin_row], first[end_row]):
        room += np.int64(start[member[t] + 1]) - np.int64(start[member[t]])
    slot, indptr = np.full(n, -1, np.int64), np.zeros(end_row - begin_row + 1, np.uint32)
    indices, data = np.empty(room, np.uint32), np.empty(room)
    k = 0
    for at in range(begin_row, end_row):
        row, begin, own = np.uint64(at), k, 0.0
        slot[row], indices[np.uint64(k)] = k, at
        k += 1
        for t in range(first[row], first[row + np.uint64(1)]):
            i = np.uint64(member[t])
            own += scale * diagonal[i]
            for s in range(start[i], start[i + np.uint64(1)]):
                c = np.uint64(aggregate[column[s]])
                if c == row:
                    own += scale * entry[s]
                elif slot[c] < begin:
                    slot[c], indices[np.uint64(k)], data[np.uint64(k)] = k, c, 0.0 + scale * entry[s]
                    k += 1
                else:
                    data[np.uint64(slot[c])] += scale * entry[s]
        data[np.uint64(begin)] = own
        indptr[np.uint64(at - begin_row + 1)] = k
    return indptr, indices[:k].copy(), data[:k].copy()


@plain
def _from_zero(start, middle, column, entry, inverse, r, x):
    """Forward sweep from zero → x."""
    for k in range(len(r)):
        i = np.uint64(k)
        total = r[i]
        for s in range(start[i], middle[i]):
            total -= entry[s] * x[column[s]]
        x[i] = total * inverse[i]


@ranged
def _right_over(first, last, at, x, left):
    """r - A x after `_from_zero`: what lies right of the diagonal."""
    start, middle, column, entry = at.start, at.middle, at.column, at.entry
    for k in range(first, last):
        i = np.uint64(k)
        total = 0.0
        for s in range(middle[i], start[i + np.uint64(1)]):
            total -= entry[s] * x[column[s]]
        left[i] = total


@nogil
def _shared_down(crew, bounds, at, r, x, left, coarse):
    """Forward sweep from zero, as one block or by blocks → x, and Pᵀ (r - A x); left (n,): r - A x."""
    n, count, n_coarse = len(r), len(bounds) - 1, len(coarse)
    if count == 1:
        _from_zero(at.start, at.middle, at.column, at.entry, at.inverse, r, x)
        through(_right_over, handed(crew, n, ROW, 1), n, (at, x, left))
    else:
        through(_down_blocks, handed(crew, count, BLOCK, count), count, (bounds, at, r, x))
        done(crew)
        through(_left_over, handed(crew, count, BLOCK, count), count, (bounds, at, x, left))
    done(crew)
    through(_restricted, handed(crew, n_coarse, AGGREGATE, 1), n_coarse, (at.first, at.member, left, coarse))
    done(crew)


@nogil
def _shared_up(crew, bounds, at, coarse, r, before, x):
    """x + P coarse, then backward sweeps of blocks, in place; before (n,): work space."""
    n, count = len(r), len(bounds) - 1
    through(_onto, handed(crew, n, 1.0, 1), n, (at.aggregate, coarse, x, before))
    done(crew)
    through(_up_blocks, handed(crew, count, BLOCK, count), count, (bounds, at, r, before, x))
    done(crew)


@kernel
def _down(start, column, entry, inverse, aggregate, middle, n_coarse, r):
    """Forward sweep from zero → x, and Pᵀ (r - A x), for which only the entries right of the diagonal are needed."""
    n = len(r)
    x, coarse = np.empty(n), np.zeros(n_coarse)
    _from_zero(start, middle, column, entry, inverse, r, x)
    for k in range(n):
        i = np.uint64(k)
        left = 0.0
        for s in range(middle[i], start[i + np.uint64(1)]):
            left -= entry[s] * x[column[s]]
        if aggregate[i] >= 0:
            coarse[np.uint64(aggregate[i])] += left
    return x, coarse


@plain
def _up(start, column, entry, inverse, aggregate, coarse, r, x):
    """x + P coarse, then the backward sweep, in place."""
    for k in range(len(x)):
        i = np.uint64(k)
        if aggregate[i] >= 0:
            x[i] += coarse[np.uint64(aggregate[i])]
    _backward(start, column, entry, inverse, r, x)


@ranged
def _down_blocks(first, last, bounds, at, r, x):
    """Forward sweeps of blocks from zero → x."""
    start, middle, column, entry, inverse = at.start, at.middle, at.column, at.entry, at.inverse
    for b in range(first, last):
        low = bounds[b]
        for k in range(low, bounds[b + 1]):
            i = np.uint64(k)
            total = r[i]
            for s in range(start[i], middle[i]):
                if column[s] >= low:
                    total -= entry[s] * x[column[s]]
            x[i] = total * inverse[i]


@ranged
def _left_over(first, last, bounds, at, x, left):
    """r - A x after `_down_blocks`: left of the diagonal only columns of other blocks count."""
    start, middle, column, entry = at.start, at.middle, at.column, at.entry
    for b in range(first, last):
        low = bounds[b]
        for k in range(low, bounds[b + 1]):
            i = np.uint64(k)
            total = 0.0
            for s in range(start[i], middle[i]):
                if column[s] < low:
                    total -= entry[s] * x[column[s]]
            for s in range(middle[i], start[i + np.uint64(1)]):
                total -= entry[s] * x[column[s]]
            left[i] = total


@ranged
def _restricted(begin, end, first, member, left, coarse):
    """Pᵀ left."""
    for j in range(begin, end):
        k = np.uint64(j)
        total = 0.0
        for t in range(first[k], first[k + np.uint64(1)]):
            total += left[member[t]]
        coarse[k] = total


@ranged
def _onto(first, last, aggregate, coarse, x, out):
    """x + P coarse."""
    for j in range(first, last):
        i = np.uint64(j)
        k = aggregate[i]
        out[i] = x[i] + coarse[np.uint64(k)] if k >= 0 else x[i]


@ranged
def _up_blocks(first, last, bounds, at, r, before, x):
    """Backward sweeps of blocks → x; before (n,): what they begin with, which the other blocks see."""
    start, middle, column, entry, inverse = at.start, at.middle, at.column, at.entry, at.inverse
    for b in range(first, last):
        low, high = bounds[b], bounds[b + 1]
        for k in range(high - 1, low - 1, -1):
            i = np.uint64(k)
            total = r[i]
            for s in range(start[i], middle[i]):
                total -= entry[s] * before[column[s]]
            for s in range(middle[i], start[i + np.uint64(1)]):
                j = column[s]
                total -= entry[s] * (x[j] if j < high else before[j])
            x[i] = total * inverse[i]


@kernel
def _forward(start, column, entry, inverse, r, x):
    for i in range(len(r)):
        total = r[i]
        for s in range(start[i], start[i + 1]):
            total -= entry[s] * x[column[s]]
        x[i] = total * inverse[i]


@plain
def _backward(start, column, entry, inverse, r, x):
    for k in range(len(r) - 1, -1, -1):
        i = np.uint64(k)
        total = r[i]
        for s in range(start[i], start[i + np.uint64(1)]):
            total -= entry[s] * x[column[s]]
        x[i] = total * inverse[i]
