"""Kernels on several threads, with the same bits at any number of them.

A kernel of this kind takes a range as its first arguments, releases the interpreter (`kernel_decorators.ranged`), and
writes to what belongs to the range only. Each thread gets one range; a single thread gets all of it and runs the loop
unchanged. The result of a row must not depend on where the ranges end. There are two forms:

- `over`: rows that may read everything and write only their own entries.
- `owning`: sums over cells, or along edges, into nodes. The range is one of nodes: every thread goes through the cells
  that have a node in its range, in their order, and adds to those nodes alone. So each node gets the same summands in
  the same order as from one loop, without a list of the cells around it; cells at the border of two ranges are visited
  twice. Runs of the list that reach no node of a range are skipped; these are most of the list where nearby places have
  nearby numbers.

Numba's own `prange` would take three times as long to compile and bring a second pool beside that of YADE's OpenMP.
The threads here are those of Python, wait without using the processor, and start when they are first needed; a process
that is forked off starts its own.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from array_types import Array
from kernel_decorators import kernel, ranged

LEAST_ROWS = 2_000
"""Least number of rows that is worth a thread: waking one takes as long as some hundred rows."""
BLOCK = 256
"""Number of consecutive entries of a list that are skipped, or kept, together."""
CHUNK = 16_384
"""Number of entries that are summed as one chunk; shorter sums have one chunk."""
FILLED, LAZY = 64, 32 << 20
"""Numbers that are filled as one row, and bytes from which the C library returns pages that are zero already and are
allocated only when they are written to."""
STRETCH, PLAIN = 8_192, 8
"""Rows that `field` takes at a time, whose temporary arrays stay in the caches, and how many of them take as long as
one usual row."""
KEPT = 8
"""Number of lists whose reach is remembered: those of one step."""


class _Worker:
    """A thread that waits for work."""

    def __init__(self) -> None:
        self._given, self._done = threading.Lock(), threading.Lock()
        self._given.acquire()
        self._done.acquire()
        self._job: Callable[[], Any] = _nothing
        self._result: Any = None
        self._failure: BaseException | None = None
        threading.Thread(target=self._work, daemon=True, name="surgebreak-kernels").start()

    def _work(self) -> None:
        while True:
            self._given.acquire()
            try:
                self._result, self._failure = self._job(), None
            except BaseException as failure:
                self._result, self._failure = None, failure
            self._job = _nothing
            self._done.release()

    def begin(self, job: Callable[[], Any]) -> None:
        self._job = job
        self._given.release()

    def end(self) -> tuple[Any, BaseException | None]:
        """Return the result of the job, or raise its exception; waits for it even if Ctrl-C is pressed meanwhile."""
        interruption = None
        while True:
            try:
                self._done.acquire()
                break
            except BaseException as caught:
                interruption = caught
        found, self._result = (self._result, interruption or self._failure), None
        return found


def _nothing() -> None:
    return None


class _Team:
    """The threads of this process; one caller at a time uses them, others work on their own thread alone."""

    def __init__(self) -> None:
        self.size, self.least = 1, LEAST_ROWS
        self.calls: list[Call] | None = None
        self.forget()

    def forget(self) -> None:
        """Drop all threads, which a process that has just been forked off does not have."""
        self.workers: list[_Worker] = []
        self.at_work = threading.Lock()

    def together(self, jobs: Sequence[Callable[[], Any]]) -> list:
        """Results of the jobs, of which one runs on this thread and the others beside it."""
        if len(jobs) == 1 or not self.at_work.acquire(blocking=False):
            return [job() for job in jobs]
        try:
            while len(self.workers) < len(jobs) - 1:
                self.workers.append(_Worker())
            return self._run(jobs)
        finally:
            self.at_work.release()

    def _run(self, jobs) -> list:
        busy = self.workers[: len(jobs) - 1]
        for worker, job in zip(busy, jobs[1:]):
            worker.begin(job)
        own, failure = None, None
        try:
            own = jobs[0]()
        except BaseException as caught:
            failure = caught
        ended = [worker.end() for worker in busy]
        failure = failure or next((raised for _, raised in ended if raised is not None), None)
        if failure is not None:
            raise failure
        return [own, *(result for result, _ in ended)]


_team = _Team()
os.register_at_fork(after_in_child=_team.forget)


def use(threads: int, least: int = LEAST_ROWS) -> None:
    """Set the number of threads of kernels in this process, at first 1. least: least number of rows of a range.

    Raises ValueError for fewer than one thread."""
    if threads < 1:
        raise ValueError(f"threads {threads}: at least 1")
    _team.size, _team.least = threads, least


def in_use() -> int:
    """Number of threads that kernels run on."""
    return _team.size


class Call(NamedTuple):
    """A kernel that more threads would share, its rows, and the processor time [s] that it took on one."""

    name: str
    rows: int
    seconds: float


@contextmanager
def watched() -> Iterator[list[Call]]:
    """Calls of kernels that more threads would share, while one does all the work: a list that grows."""
    _team.calls = []
    try:
        yield _team.calls
    finally:
        _team.calls = None


def over(kernel: Callable, count: int, *args, weight: int = 1) -> list:
    """Run kernel(first, last, *args) on ranges that together cover 0 ... count; returns their results in order.

    weight: cost of a row, in usual rows, which take some ten nanoseconds."""
    parts = min(_parts(count * weight), max(count, 1))
    if parts == 1:
        return [_alone(kernel, count * weight, (0, count, *args))]
    ends = [count * k // parts for k in range(parts + 1)]
    return _team.together([_call(kernel, (first, last), args) for first, last in pairwise(ends)])


def found_over(kernel: Callable, count: int, *args) -> Array:
    """The arrays that `over` returns, concatenated."""
    found = over(kernel, count, *args)
    return found[0] if len(found) == 1 else np.concatenate(found)


def owning(kernel: Callable, nodes: int, reach: Callable, count: int, *args, weight: int = 1) -> None:
    """Run kernel(first, last, runs, *args) on ranges that together cover the nodes 0 ... `nodes`.

    runs (k, 2): first and last + 1 of the stretches of a list of `count` entries that can have a node of the range.
    reach: () → lowest and highest node (B,) of each BLOCK of the list; called on several threads only · weight: as in
    `over`."""
    parts = _parts(count * weight)
    if parts == 1:
        _alone(kernel, count * weight, (0, nodes, np.array([[0, count]]), *args))
        return
    low, high = reach()
    middle = np.sort(low)[[len(low) * k // parts for k in range(1, parts)]]
    ends = [0, *(int(end) for end in middle), nodes]
    _team.together(
        [
            _call(kernel, (first, last, _runs(low, high, first, last, count)), args)
            for first, last in pairwise(ends)
        ]
    )


def summed(kernel: Callable, count: int, shape: tuple[int, ...], *args) -> Array:
    """Σ over 0 ... `count` of what kernel(first, last, *args, partial) adds to partial[c] (*shape) in each CHUNK c from
    `first` to before `last`: the sums of chunks, which do not depend on the threads, are added in their order."""
    chunks = max(1, -(-count // CHUNK))
    partial = np.zeros((chunks, *shape))
    over(kernel, chunks, *args, partial, weight=CHUNK)
    total = partial[0]
    for part in partial[1:]:
        total += part
    return total


def by_stretches(action: Callable[[slice], Any], out) -> None:
    """Call action(rows) for stretches of the rows of `out`, which it writes to: for NumPy on whole fields."""
    over(_stretches, -(-len(out) // STRETCH), action, out, weight=STRETCH // PLAIN)


def _stretches(first, last, action, out):
    for begin in range(first * STRETCH, min(last * STRETCH, len(out)), STRETCH):
        action(slice(begin, min(begin + STRETCH, len(out))))


def field(
    count: int, expression: Callable[[slice], Any], shape: tuple[int, ...] = (), dtype=float
) -> np.ndarray:
    """Array (count, *shape) of expression(rows), which is evaluated for stretches of its rows."""
    out = np.empty((count, *shape), dtype)

    def evaluate(rows):
        out[rows] = expression(rows)

    by_stretches(evaluate, out)
    return out


def copied(array) -> np.ndarray:
    """A copy of an array, made by all threads."""
    return field(len(array), array.__getitem__, array.shape[1:], array.dtype)


def marked(mask) -> Array:
    """Numbers of the entries of a mask (n,) bool that are set, in order."""
    return found_over(_marked, len(mask), mask)


def _marked(first, last, mask):
    found = np.flatnonzero(mask[first:last])
    return found + first if first else found


def zeros(shape: tuple[int, ...]) -> np.ndarray:
    """np.zeros(shape) of floats, filled by all threads where the C library would fill it on this thread alone."""
    count = math.prod(shape)
    if 8 * count >= LAZY:
        return np.zeros(shape)
    out = np.empty(shape)
    over(_fill, -(-count // FILLED), out.reshape(-1))
    return out


@ranged
def _fill(first, last, out):
    for i in range(first * FILLED, min(last * FILLED, out.shape[0])):
        out[i] = 0.0


def _parts(count: int) -> int:
    return max(1, min(_team.size, count // _team.least))


def _alone(kernel, count, args):
    """kernel(*args) on this thread."""
    if _team.calls is None or count < 2 * _team.least:
        return kernel(*args)
    began = time.process_time()
    found = kernel(*args)
    _team.calls.append(Call(kernel.__name__, count, time.process_time() - began))
    return found


def _call(kernel, span, args):
    return lambda: kernel(*span, *args)


_reaches: list[tuple[tuple, tuple[Array, Array]]] = []


def reach_of_cells(cell_list, cells) -> Callable:
    """`reach` for `owning`: the lowest and highest node of each block of the listed cells (n,)."""
    return lambda: _remembered((cell_list, cells), _cell_reach, len(cell_list), cell_list, cells)


def reach_of_rows(nodes, row, start, neighbour) -> Callable:
    """`reach` for `owning`, of the listed nodes (n,) and those at the other ends of their edges; row, start, neighbour:
    of a `topology.Graph`."""
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
    _reaches.insert(0, (key, (low, high)))
    del _reaches[KEPT:]
    return low, high


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
def _runs(low, high, first, last, count):
    """Joined blocks with a node from `first` to before `last`, (k, 2): where each run begins and ends."""
    runs, k = np.empty((low.shape[0] + 1, 2), np.int64), 0
    for b in range(low.shape[0]):
        if low[b] >= last or high[b] < first:
            continue
        begin, end = b * BLOCK, min((b + 1) * BLOCK, count)
        if k > 0 and runs[k - 1, 1] == begin:
            runs[k - 1, 1] = end
        else:
            runs[k, 0], runs[k, 1] = begin, end
            k += 1
    return runs[:k].copy()
