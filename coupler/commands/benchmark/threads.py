"""Speed-up of a step of the water by threads, and its kernels against memory bandwidth: `part.py threads NODES`, and
`part.py roofline NODES`.

Speed-ups are ratios of wall times, the least of REPEATS with the numbers of threads in turn, all from one state.
The serial share is the part of the processor time of one thread that is spent outside of the threaded kernels, each of
them and each piece between two of them by the least of REPEATS, less what it takes to watch them; Amdahl's law gives
the speed-up with more cores from it. Bytes are the least that a kernel must read and write, each once, of
the parts of the arrays that it uses; bandwidth is that of a triad a = b + s c in the same process.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

import numpy as np

from coupler.commands.benchmark.water import BEFORE, dam_break, step
from coupler.program.threads import cores

REPEATS, STEPS = 5, 3
WATCHED, MOST_TOLD = 500, 12
"""How often an empty kernel is watched, to know what that takes; number of kinds of pieces that are told."""
MORE = (8, 16, 64)
TRIAD = 8_000_000
"""Numbers in each array of the triad: far more than caches hold."""
ROWS_OF_CELLS = ("_nodal_water", "_wet_fraction", "_cell_velocity", "_inflow", "_with_ghosts", "_cell_gradient",
    "_nodal_mean", "_push_of_divergence", "_mean_gradients", "_average", "_hat_forces", "_leave",
    "_carry_remainder", "_cells_of_flux", "_unlike", "_surface_cells", "_touching_among")  # fmt: skip
"""Kernels that go over cells; the others go over nodes."""
SUMS = ("_hat_forces", "_momenta", "_squares_of")
"""Kernels whose range is one of chunks."""
WHOLE = ("_product", "_stepped", "_dots", "_powers", "_counted_water")
"""Kernels whose range is one of chunks of arrays that they go through from end to end."""


def amdahl(serial: float, n: int) -> float:
    """Speed-up on n cores where a share is serial."""
    return 1.0 / (serial + (1.0 - serial) / n)


def numbers() -> list[int]:
    """Numbers of threads to measure: 1, 2, 4 ... and all cores of this process."""
    most = cores()
    return sorted({n for n in (1, 2, 4, 8, 16, 32, 64) if n < most} | {1, most})


def started(nodes: int):
    """The dam break while the water runs through the tank."""
    from kernels.threads import use

    use(cores())
    scene = dam_break(nodes)
    while scene.time < BEFORE:
        step(scene)
    return scene


def threads(nodes: int) -> dict:
    """Wall time [s] of a step by number of threads, processor time [s] of a step on one thread, and of that outside of
    the threaded kernels, its share, the size of the scene, and what threads give on this machine (`machine.py`)."""
    from coupler.commands.benchmark.machine import machine
    from kernels.threads import use

    scene = started(nodes)
    start, wall = scene.snapshot(), {n: np.inf for n in numbers()}
    for _ in range(REPEATS):
        for n in wall:
            use(n)
            began = time.perf_counter()
            _steps(scene, start)
            wall[n] = min(wall[n], (time.perf_counter() - began) / STEPS)
    use(1)
    shared, pieces = least_times(lambda: _steps(scene, start))
    outside = sum(piece.seconds for piece in pieces)
    return {
        "nodes": len(scene.mesh.nodes),
        "cells": len(scene.mesh.cells),
        "wall": {str(n): seconds for n, seconds in wall.items()},
        "step": (shared + outside) / STEPS,
        "outside": outside / STEPS,
        "serial": outside / (shared + outside),
        "pieces": largest(pieces),
        "machine": machine(numbers()),
    }


class Piece(NamedTuple):
    """What lies between two threaded kernels: their names, None at either end of a measurement, and its processor
    seconds."""

    after: str | None
    before: str | None
    seconds: float


def least_times(work: Callable[[], None]) -> tuple[float, list[Piece]]:
    """Processor seconds of work() on one thread in the threaded kernels, and what lies between two of them: the least
    of REPEATS for each of them and each piece. Other programs lengthen now one piece, now another.

    Repeats that call fewer or more kernels than the last one, which fill what is kept, do not count."""
    from kernels.threads import watched

    found = []
    for _ in range(REPEATS):
        with watched() as calls:
            first = time.process_time()
            work()
            last = time.process_time()
        begin, spent = (np.array([getattr(call, name) for call in calls]) for name in ("began", "seconds"))
        found.append((spent, np.append(begin, last) - np.append(first, begin + spent)))
    alike = [pair for pair in found if len(pair[0]) == len(found[-1][0])]
    shared, outside = (np.min(times, axis=0) for times in zip(*alike))
    of_python, of_driver = watching()
    of_each = np.array([of_python if call.rows else of_driver for call in calls])
    outside[:-1] = np.maximum(outside[:-1] - of_each, 0.0)
    names = [None, *(call.name for call in calls), None]
    return float(shared.sum()), [Piece(*piece) for piece in zip(names, names[1:], outside.tolist())]


def watching() -> tuple[float, float]:
    """Processor seconds that it takes to watch a kernel beyond those that count as its own: one that Python calls, and
    one that a driver does (`kernels/in_a_row.py`), for which it is the time to read the clock."""
    from coupler.commands.benchmark.machine import _empty
    from kernels.threads import over, watched

    out, usual, seen, read = np.zeros(1), np.inf, np.inf, np.inf
    for _ in range(WATCHED):
        begun = time.process_time()
        read = min(read, time.process_time() - begun)
    for _ in range(REPEATS):
        begun = time.process_time()
        for _ in range(WATCHED):
            over(_empty, 1, out, weight=1e9)
        usual = min(usual, time.process_time() - begun)
        with watched():
            begun = time.process_time()
            for _ in range(WATCHED):
                over(_empty, 1, out, weight=1e9)
            seen = min(seen, time.process_time() - begun)
    return max((seen - usual) / WATCHED - read, read), read


def largest(pieces: list[Piece]) -> list[tuple[str | None, str | None, float, float]]:
    """The names, number in a step and seconds of a step of those kinds of pieces that take longest, MOST_TOLD of them;
    pieces between the same two kernels are of one kind."""
    kinds: dict[tuple[str | None, str | None], list[float]] = {}
    for piece in pieces:
        kinds.setdefault((piece.after, piece.before), []).append(piece.seconds)
    longest = sorted(kinds.items(), key=lambda kind: -sum(kind[1]))[:MOST_TOLD]
    return [(*names, len(times) / STEPS, sum(times) / STEPS) for names, times in longest]


def _steps(scene, start) -> None:
    scene.restore(start)
    for _ in range(STEPS):
        step(scene)


def bandwidth() -> float:
    """Bytes a second of a triad of one thread, the best of REPEATS."""
    from numba import njit

    @njit
    def triad(a, b, c, s):
        for i in range(a.shape[0]):
            a[i] = b[i] + s * c[i]

    a, b, c = (np.full(TRIAD, float(k)) for k in range(3))
    triad(a, b, c, 1.5)
    best = np.inf
    for _ in range(REPEATS):
        began = time.process_time()
        triad(a, b, c, 1.5)
        best = min(best, time.process_time() - began)
    return 3.0 * a.nbytes / best


def roofline(nodes: int) -> dict:
    """Bandwidth [B/s]; by kernel: seconds and bytes a step; seconds of a step."""
    from kernels.threads import use

    scene = started(nodes)
    use(1)
    start, t = scene.snapshot(), scene.topology
    least: dict[str, list[float]] = {}
    spent = np.inf
    for _ in range(REPEATS):
        with _traffic(len(t.nodes), len(t.cells)) as found:
            began = time.process_time()
            _steps(scene, start)
            spent = min(spent, (time.process_time() - began) / STEPS)
        for name, (seconds, moved) in found.items():
            before = least.get(name, [np.inf, 0.0])[0]
            least[name] = [min(before, seconds / STEPS), moved / STEPS]
    return {
        "cells": len(t.cells),
        "nodes": len(t.nodes),
        "bandwidth": bandwidth(),
        "step": spent,
        "kernels": least,
    }


@contextmanager
def _traffic(nodes: int, cells: int) -> Iterator[dict[str, list[float]]]:
    """Seconds and bytes of every shared kernel that Python calls meanwhile, by its name; those that compiled code hands
    out one after the other (`kernels/in_a_row.py`) are left out."""
    import kernels.threads as team

    found: dict[str, list[float]] = {}
    given = team._alone

    def alone(kernel, count, args):
        began = time.process_time()
        result = given(kernel, count, args)
        sums = found.setdefault(kernel.__name__, [0.0, 0.0])
        sums[0] += time.process_time() - began
        names = getattr(kernel, "py_func", kernel).__code__.co_names
        sums[1] += _bytes(kernel.__name__, args, nodes, cells, names)
        return result

    team._alone = alone
    try:
        yield found
    finally:
        team._alone = given


def _bytes(name: str, args, nodes: int, cells: int, read=()) -> float:
    """Bytes of the arrays among the arguments, of those of the whole mesh the share that the rows are of it; read:
    names that the kernel uses, by which it takes what it reads out of a bundle of arrays."""
    arrays = [a for arg in args for a in _arrays(arg, read)]
    if name in WHOLE:
        return float(sum(a.nbytes for a in arrays))
    rows = _rows(name, args)
    whole = cells if name in ROWS_OF_CELLS else nodes
    share = min(1.0, rows / whole)
    return float(sum(a.nbytes * (1.0 if len(a) <= rows else share) for a in arrays))


def _arrays(arg, read) -> list[np.ndarray]:
    """An array, or those of a tuple: of a named one the fields that are read, all where none is read by its name."""
    if isinstance(arg, tuple):
        named = [getattr(arg, field) for field in getattr(arg, "_fields", ()) if field in read]
        return [a for part in (named or arg) for a in _arrays(part, read)]
    return [arg] if isinstance(arg, np.ndarray) else []


def _rows(name: str, args) -> int:
    """How many rows a kernel goes over: those of its range, of its runs, or of the chunks that it sums."""
    third = args[2]
    if name in SUMS:
        return len(third[0] if isinstance(third, tuple) else third)
    if isinstance(third, np.ndarray) and third.shape[1:] == (2,):
        return int(third[:, 1].max())
    return args[1] - args[0]
