"""Kernels on several threads, with the same bits at any number of them.

A kernel of this kind takes a range as its first arguments, releases the interpreter (`kernels.decorators.ranged`), and
writes to what belongs to the range only. Each thread gets one range or several; a single thread gets all of it and runs
the loop unchanged. The result of a row must not depend on where the ranges end. There are two forms:

- `over`: rows that may read everything and write only their own entries.
- `owning`: sums over cells, or along edges, into nodes. The range is one of nodes: every thread goes through the cells
  that have a node in its range, in their order, and adds to those nodes alone. So each node gets the same summands in
  the same order as from one loop, without a list of the cells around it; cells at the border of two ranges are visited
  twice. Runs of the list that reach no node of a range are skipped; these are most of the list where nearby places have
  nearby numbers.

Numba's own `prange` would take three times as long to compile and bring a second pool beside that of YADE's OpenMP.
The threads here wait in compiled code (`kernels/team.py`), and start when they are first needed; a process that is
forked off starts its own.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from array_types import Array
from kernels.decorators import inner, kernel, ranged, released
from kernels.in_a_row import LOGGED, NOT_WATCHED, Crew
from kernels.memory import OWN
from kernels.ranges import MOST, is_shared
from kernels.team import Team

LEAST_ROWS = 1_000
"""Least number of rows that is worth a thread: handing them over takes as long as two hundred of them."""
BLOCK = 256
"""Number of consecutive entries of a list that are skipped, or kept, together."""
CHUNK = 4_096
"""Number of entries that are summed as one chunk; shorter sums have one chunk."""
ROW, LAZY = 64, OWN
"""Numbers that are filled or passed by as one row, and bytes from which the C library returns pages that are zero
already and are allocated only when they are written to."""
PYTHON = 10
"""How many times as long as a compiled loop Python code takes to be handed over: for the interpreter, which one thread
has at a time."""
PIECES = 4
"""Number of ranges for each thread where there are enough rows: whoever is through takes the next one, since rows in
the air cost less than those in the water, and other programs may take the core of a thread."""
PASSED = 0.1
"""Cost of an entry of a mask, in usual rows."""
KEPT = 8
"""Number of lists whose reach is remembered: those of one step."""


class _Settings:
    """How many threads share a loop, and which calls are watched."""

    def __init__(self) -> None:
        self.size, self.least = 1, LEAST_ROWS
        self.calls: list[Call] | None = None


_team = Team()
_settings = _Settings()


def use(threads: int, least: int = LEAST_ROWS) -> None:
    """Set the number of threads of kernels in this process, at first 1. least: least number of rows of a range.

    Raises ValueError for fewer than one thread."""
    if threads < 1:
        raise ValueError(f"threads {threads}: at least 1")
    _settings.size, _settings.least = threads, least


def in_use() -> int:
    """Number of threads that kernels run on."""
    return _settings.size


class Call(NamedTuple):
    """A kernel that more threads would share, its rows, the processor time [s] of the process when it began on one
    thread, and that which it took."""

    name: str
    rows: int
    began: float
    seconds: float


@contextmanager
def watched() -> Iterator[list[Call]]:
    """Calls of kernels that more threads would share, while one does all the work: a list that grows."""
    _settings.calls = []
    try:
        yield _settings.calls
    finally:
        _settings.calls = None


def over(kernel: Callable, count: int, *args, weight: float = 1, pieces: int | None = None) -> list:
    """Run kernel(first, last, *args) on ranges that together cover 0 ... count; returns their results in order.

    kernel: `ranged` or `released`, or Python code · weight: cost of a row, in usual rows, which take some ten
    nanoseconds · pieces: number of ranges for each thread, more than one for rows of unequal cost; None: PIECES where
    each range has enough rows, one for Python code."""
    size, least = _settings.size, _settings.least
    if size == 1 and _settings.calls is None:
        return [kernel(0, count, *args)]
    shared = is_shared(kernel)
    rows = count * weight if shared else count * weight / PYTHON
    if count < 2 or rows < 2 * least:
        return [kernel(0, count, *args)]
    if size == 1:
        return [_alone(kernel, rows, (0, count, *args))]
    parts = min(size, MOST, count, int(rows) // least)
    if shared:
        if pieces is None:
            pieces = min(PIECES, int(rows) // (parts * least))
        found = _team.share(kernel, parts, min(parts * pieces, count, MOST), count, args)
        return [kernel(0, count, *args)] if found is None else found
    ends = [count * k // parts for k in range(parts + 1)]
    return _team.together([_call(kernel, (first, last), args) for first, last in pairwise(ends)])


def in_a_row(driver: Callable, *args) -> None:
    """Call a compiled driver(crew, *args), whose loops are shared one after the other (`kernels/in_a_row.py`)."""
    calls = _settings.calls
    log = NOT_WATCHED if calls is None else np.zeros((LOGGED + 2, 2), np.int64)
    _team.lead(lambda plan, threads: driver(Crew(plan, threads, _settings.least, log), *args), _settings.size)
    if calls is not None:
        times = 1e-9 * log[2 : 2 + log[0, 0]]
        calls.extend(Call(driver.__name__, 0, begin, end - begin) for begin, end in times.tolist())


def found_over(kernel: Callable, count: int, *args, weight: float = 1, pieces: int | None = None) -> Array:
    """The arrays that `over` returns, concatenated."""
    found = over(kernel, count, *args, weight=weight, pieces=pieces)
    return found[0] if len(found) == 1 else np.concatenate(found)


def joined(parts: list) -> tuple:
    """The arrays of several results of `over`, each a tuple of arrays, concatenated one by one."""
    return parts[0] if len(parts) == 1 else tuple(np.concatenate(each) for each in zip(*parts))


def owning(kernel: Callable, nodes: int, reach: Callable, count: int, *args, weight: float = 1) -> None:
    """Run kernel(first, last, runs, *args) on ranges that together cover the nodes 0 ... `nodes`.

    runs (k, 2): first and last + 1 of the stretches of a list of `count` entries that can have a node of the range.
    reach: () → `Reach` of the list; called on several threads only · weight: as in `over`."""
    parts = _parts(count * weight)
    if parts == 1:
        _alone(kernel, count * weight, (0, nodes, np.array([[0, count]]), *args))
        return
    ends, runs, cuts = reach().divided(nodes, parts, count)
    if not _team.share_runs(kernel, ends, runs, cuts, args):
        kernel(0, nodes, np.array([[0, count]]), *args)


@inner
def owns_any(first, last, cells, e):
    """Whether a node of cell e is in a range: asked first by kernels of `owning` that take long for a cell, since a
    list of few cells, those that hold the surface, has runs that reach everywhere."""
    some = False
    for a in range(4):
        some = some or first <= cells[e, a] < last
    return some


def summed(kernel: Callable, count: int, shape: tuple[int, ...], *args, weight: float = 1) -> Array:
    """Σ over 0 ... `count` of what kernel(first, last, *args, partial) adds to partial[c] (*shape) in each CHUNK c from
    `first` to before `last`: the sums of chunks, which do not depend on the threads, are added in their order.

    weight: as in `over`."""
    chunks = chunks_of(count)
    partial = np.zeros((chunks, math.prod(shape)))
    over(kernel, chunks, *args, partial.reshape(chunks, *shape), weight=weight * CHUNK, pieces=chunks)
    return np.add.accumulate(partial)[-1].reshape(shape)


def chunks_of(count: int) -> int:
    """Number of CHUNKs that 0 ... `count` has."""
    return max(1, -(-count // CHUNK))


@inner
def added_up(partial):
    """Sum of partial (c,) in its order: `summed` in compiled code."""
    total = partial[0]
    for c in range(1, len(partial)):
        total += partial[c]
    return total


def marked(mask) -> Array:
    """Numbers of the entries of a mask (n,) bool that are set, in order."""
    return found_over(_marked, len(mask), np.asarray(mask, bool), False, weight=PASSED)


def taken(mask) -> Array:
    """`marked`, and none is set any more."""
    return found_over(_marked, len(mask), mask, True, weight=PASSED)


@released
def _marked(first, last, mask, clear):
    """Entries are passed by ROW at a time where none of them is set. Elsewhere every number is written, and the next
    one over it if its entry is not set: no branch that is hard to foresee."""
    at, end = np.uint64(first), np.uint64(last)
    count, k = np.uint64(0), np.uint64(0)
    for i in range(at, end):
        count += np.uint64(mask[i])
    found = np.empty(np.int64(count) + 1, np.int64)
    while at < end:
        stop, some = min(at + np.uint64(ROW), end), np.uint64(0)
        for i in range(at, stop):
            some |= np.uint64(mask[i])
        if some:
            for i in range(at, stop):
                found[k] = i
                k += np.uint64(mask[i])
            if clear:
                for i in range(at, stop):
                    mask[i] = False
        at = stop
    return found[: np.int64(count)]


def zeros(shape: tuple[int, ...]) -> np.ndarray:
    """np.zeros(shape) of floats, filled by all threads where the C library would fill it on this thread alone."""
    count = math.prod(shape)
    if 8 * count >= LAZY:
        return np.zeros(shape)
    out = np.empty(shape)
    over(_fill, -(-count // ROW), out.reshape(-1))
    return out


@ranged
def _fill(first, last, out):
    for j in range(first * ROW, min(last * ROW, out.shape[0])):
        out[np.uint64(j)] = 0.0


def _parts(count: float) -> int:
    return max(1, min(_settings.size, MOST, math.ceil(count) // _settings.least))


def _alone(kernel, count, args):
    """kernel(*args) on this thread."""
    if _settings.calls is None or count < 2 * _settings.least:
        return kernel(*args)
    began = time.process_time()
    found = kernel(*args)
    _settings.calls.append(Call(kernel.__name__, count, began, time.process_time() - began))
    return found


def _call(kernel, span, args):
    return lambda: kernel(*span, *args)


class Reach:
    """Lowest and highest node (B,) of each BLOCK of a list."""

    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high = low, high
        self._known: dict[tuple[int, int], tuple[list[int], Array, list[int]]] = {}

    def divided(self, nodes: int, parts: int, count: int) -> tuple[list[int], Array, list[int]]:
        """Ends of as many ranges of 0 ... `nodes`, runs (k, 2) of the list of `count` entries that can have a node of
        a range, those of one range after those of the other, and where the runs of each begin and end."""
        if (nodes, parts) not in self._known:
            low = self.low
            places = [len(low) * k // parts for k in range(1, parts)]
            ends = np.array([0, *np.partition(low, places)[places], nodes])
            runs, cuts = _runs(low, self.high, ends, count)
            self._known[nodes, parts] = ends.tolist(), runs, cuts.tolist()
        return self._known[nodes, parts]


_reaches: list[tuple[tuple, Reach]] = []


def reach_of_cells(cell_list, cells) -> Callable:
    """`reach` for `owning`: the lowest and highest node of each block of the listed cells (n,)."""
    return lambda: _remembered((cell_list, cells), _cell_reach, len(cell_list), cell_list, cells)


def reach_of_rows(nodes, row, start, neighbour) -> Callable:
    """`reach` for `owning`, of the listed nodes (n,) and those at the other ends of their edges; row, start, neighbour:
    of a `graph.Graph`."""
    key = (nodes, row, start, neighbour)
    return lambda: _remembered(key, _row_reach, len(nodes), *key)


def _remembered(key, kernel, count, *args):
    """The reach of a list, made once for the same arrays."""
    for arrays, known in _reaches:
        if len(arrays) == len(key) and all(a is b for a, b in zip(arrays, key)):
            return known
    blocks = -(-count // BLOCK)
    low, high = np.empty(blocks, np.int64), np.empty(blocks, np.int64)
    over(kernel, blocks, *args, low, high, weight=BLOCK)
    _reaches.insert(0, (key, Reach(low, high)))
    del _reaches[KEPT:]
    return _reaches[0][1]


@ranged
def _cell_reach(first, last, cell_list, cells, low, high):
    for b in range(first, last):
        least, most = np.int64(cells[cell_list[b * BLOCK], 0]), np.int64(0)
        for s in range(b * BLOCK, min((b + 1) * BLOCK, cell_list.shape[0])):
            for a in range(4):
                i = np.int64(cells[cell_list[s], a])
                least, most = min(least, i), max(most, i)
        low[b], high[b] = least, most


@ranged
def _row_reach(first, last, nodes, row, start, neighbour, low, high):
    for b in range(first, last):
        least, most = np.int64(nodes[b * BLOCK]), np.int64(0)
        for s in range(b * BLOCK, min((b + 1) * BLOCK, nodes.shape[0])):
            i = np.int64(nodes[s])
            least, most = min(least, i), max(most, i)
            for t in range(start[row[i]], start[row[i] + 1]):
                j = np.int64(neighbour[t])
                least, most = min(least, j), max(most, j)
        low[b], high[b] = least, most


@kernel
def _runs(low, high, ends, count):
    """Joined blocks with a node from one of the ends to before the next, (k, 2): where each run begins and ends; and
    how many there are before each of the ends."""
    runs, cuts, k = np.empty((low.shape[0] + 1, 2), np.int64), np.zeros(ends.shape[0], np.int64), 0
    for part in range(ends.shape[0] - 1):
        for b in range(low.shape[0]):
            if low[b] >= ends[part + 1] or high[b] < ends[part]:
                continue
            begin, end = b * BLOCK, min((b + 1) * BLOCK, count)
            if k > cuts[part] and runs[k - 1, 1] == begin:
                runs[k - 1, 1] = end
                continue
            if k == runs.shape[0]:
                longer = np.empty((2 * k, 2), np.int64)
                longer[:k] = runs
                runs = longer
            runs[k, 0], runs[k, 1] = begin, end
            k += 1
        cuts[part + 1] = k
    return runs[:k].copy(), cuts
