"""Speed-up of a step of the water by threads, and its kernels against memory bandwidth: `part.py threads NODES`, and
`part.py roofline NODES`.

Speed-ups are ratios of wall times, the least of REPEATS with the numbers of threads in turn, all from one state.
The serial share is the part of the processor time of one thread that is spent outside of the threaded kernels, each of
them and each piece between two of them by the least of REPEATS; Amdahl's law gives the speed-up with more cores from
it. Bytes are the least that a kernel must read and write, each once, of
the parts of the arrays that it uses; bandwidth is that of a triad a = b + s c in the same process.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from coupler.commands.benchmark.water import BEFORE, dam_break, step
from coupler.program.threads import cores

REPEATS, STEPS = 5, 3
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
    shared, outside = least_times(lambda: _steps(scene, start))
    return {
        "nodes": len(scene.mesh.nodes),
        "cells": len(scene.mesh.cells),
        "wall": {str(n): seconds for n, seconds in wall.items()},
        "step": (shared + outside) / STEPS,
        "outside": outside / STEPS,
        "serial": outside / (shared + outside),
        "machine": machine(numbers()),
    }


def least_times(work: Callable[[], None]) -> tuple[float, float]:
    """Processor seconds of work() on one thread in and outside of the threaded kernels: the least of REPEATS for each
    of them and for each piece between two of them, added up. Other programs lengthen now one piece, now another.

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
    shared, outside = (np.min(times, axis=0).sum() for times in zip(*alike))
    return float(shared), float(outside)


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
