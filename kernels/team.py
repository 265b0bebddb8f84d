"""Threads that wait for work in compiled code, and share the range of a kernel without the interpreter.

The thread that calls puts the work into a box of each other thread, does its own part, takes back what no other thread
has begun yet, and waits for the rest. Of more parts than threads, each takes the next one when it is through. A thread
without work looks at its box for a while (SPIN), which takes 1 µs to notice, and then sleeps, which takes some 20 to
50 µs to end; it sleeps at once where others have used its core meanwhile. So it costs nothing where nothing is shared,
and a thread that has to wait for a core delays nobody. A part that is Python code sends its thread back to the
interpreter.

A box has the states of BOX; each change from one to the next is one atomic operation, so that either side of it wins:
begun by its thread or taken back, asleep or given work.
"""

from __future__ import annotations

import atexit
import ctypes
import functools
import os
import platform
import threading
from collections.abc import Callable, Sequence
from typing import Any

from llvmlite import ir
from numba import cfunc, types
from numba.core import cgutils
from numba.extending import intrinsic

from kernels.decorators import inner, nogil
from kernels.ranges import Plan

IDLE, GIVEN, BEGUN, ASLEEP, OVER = range(5)
"""States of a thread's box. IDLE: its thread looks at it; GIVEN: work lies in it; OVER: the thread is to end."""
PENDING, DONE, AWAITED = range(3)
"""States of what was given. AWAITED: the thread that gave it sleeps until it is done."""
STATE, FINISHED, WAKE, ANSWER, PLAN, PART, CLOCK = 0, 8, 16, 24, 32, 33, 40
"""Places in a box, in numbers of 64 bits: both states, each on a line of the cache of its own, two semaphores, the
plan and the part of it that is given, and room for the time."""
BOX, LINE = 48, 64
"""Length of a box, in numbers of 64 bits, and bytes of a line of the cache."""
SPIN = 200_000
"""Nanoseconds for which a thread looks before it sleeps: longer than what lies between most loops."""
BRIEF = 5_000
"""Nanoseconds from which a thread that looks lets others have its core, who may be waiting for it."""
CROWDED = 20_000
"""Nanoseconds after which a core that was let to others has been needed there."""
BETWEEN = 16
"""How often a thread looks between two glances at the clock."""
PATIENCE = 1.0
"""Seconds for which the end of the process waits for a thread."""

_wait = types.ExternalFunction("sem_wait", types.int32(types.int64))
_post = types.ExternalFunction("sem_post", types.int32(types.int64))
_clock = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.int64))
_yield = types.ExternalFunction("sched_yield", types.int32())
MONOTONIC = 1


def _pointer(builder, address):
    return builder.inttoptr(address, ir.IntType(64).as_pointer())


@intrinsic
def loaded(typingctx, address):
    """The number at an address, and all that was written before it was stored there."""

    def code(context, builder, signature, args):
        return builder.load_atomic(_pointer(builder, args[0]), "seq_cst", 8)

    return types.int64(types.int64), code


@intrinsic
def stored(typingctx, address, value):
    """Store a number at an address, after all that was written before."""

    def code(context, builder, signature, args):
        builder.store_atomic(args[1], _pointer(builder, args[0]), "seq_cst", 8)
        return context.get_dummy_value()

    return types.void(types.int64, types.int64), code


@intrinsic
def _swap(typingctx, address, value):
    """Store a number; → the one before."""

    def code(context, builder, signature, args):
        return builder.atomic_rmw("xchg", _pointer(builder, args[0]), args[1], "seq_cst")

    return types.int64(types.int64, types.int64), code


@intrinsic
def counted(typingctx, address):
    """Count the number at an address up, whichever threads do so at once; → the number before."""

    def code(context, builder, signature, args):
        return builder.atomic_rmw("add", _pointer(builder, args[0]), ir.IntType(64)(1), "seq_cst")

    return types.int64(types.int64), code


@intrinsic
def _replace(typingctx, address, expected, value):
    """Store a number where the expected one is; → whether it was."""

    def code(context, builder, signature, args):
        pointer, expected, value = _pointer(builder, args[0]), args[1], args[2]
        return builder.extract_value(builder.cmpxchg(pointer, expected, value, "seq_cst", "seq_cst"), 1)

    return types.boolean(types.int64, types.int64, types.int64), code


@intrinsic
def _call(typingctx, body, part, pack):
    """body(part, pack) of a C function at an address."""

    def code(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [ir.IntType(64)] * 2)
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.int64, types.int64, types.int64), code


@intrinsic
def _pause(typingctx):
    """Tell the core that this is a loop that waits."""

    def code(context, builder, signature, args):
        if platform.machine() == "x86_64":
            nothing = ir.FunctionType(ir.VoidType(), [])
            builder.call(cgutils.get_or_insert_function(builder.module, nothing, "llvm.x86.sse2.pause"), [])
        return context.get_dummy_value()

    return types.void(), code


@inner
def _now(clock):
    """Nanoseconds of a clock that only goes forward; clock: address of room for two numbers."""
    _clock(MONOTONIC, clock)
    return 1_000_000_000 * loaded(clock) + loaded(clock + 8)


@inner
def _look(place, value, spin, clock):
    """Look at a place until something else than `value` is there, for at most `spin` nanoseconds, and no longer once
    others have used the core meanwhile: where there are more of them than cores, looking takes time from them."""
    for _ in range(BETWEEN):
        if loaded(place) != value:
            return
        _pause()
    begun = _now(clock)
    while loaded(place) == value:
        passed = _now(clock) - begun
        if passed > spin:
            return
        if passed > BRIEF:
            _yield()
            if _now(clock) - begun - passed > CROWDED:
                return
        for _ in range(BETWEEN):
            if loaded(place) != value:
                return
            _pause()


@nogil
def _serve(box, spin):
    """Do what is put into a box, until it is Python code (→ True) or the thread is to end (→ False)."""
    while True:
        _look(box, IDLE, spin, box + 8 * CLOCK)
        if loaded(box) == OVER:
            return False
        if _replace(box, GIVEN, BEGUN):
            plan = loaded(box + 8 * PLAN)
            body = loaded(plan + 8 * Plan.body)
            if body == 0:
                return True
            _work(plan, body, loaded(box + 8 * PART), loaded(plan + 8 * Plan.pack))
            _finish(box)
        elif _replace(box, IDLE, ASLEEP):
            while loaded(box) == ASLEEP:
                _wait(box + 8 * WAKE)


@inner
def _work(plan, body, part, pack):
    """Do a part, and others for as long as there are any."""
    parts = loaded(plan + 8 * Plan.parts)
    while part < parts:
        _call(body, part, pack)
        part = counted(plan + 8 * Plan.next)


@inner
def _finish(box):
    stored(box, IDLE)
    if _swap(box + 8 * FINISHED, DONE) == AWAITED:
        _post(box + 8 * ANSWER)


@nogil
def _finished(box):
    """Tell the thread that gave Python code that it is done."""
    _finish(box)


@inner
def _give(plan, spin):
    """Put a part into each box: part k into that of thread k, of which the first is the one that calls."""
    threads = loaded(plan + 8 * Plan.threads)
    stored(plan + 8 * Plan.next, threads)
    for k in range(1, threads):
        box = loaded(plan + 8 * (Plan.boxes + k - 1))
        if loaded(box) == BEGUN:  # of a call that Ctrl-C ended before it had waited
            _await(plan, box, spin)
        stored(box + 8 * PLAN, plan)
        stored(box + 8 * PART, k)
        stored(box + 8 * FINISHED, PENDING)
        if _swap(box, GIVEN) == ASLEEP:
            _post(box + 8 * WAKE)


@inner
def _await(plan, box, spin):
    """Wait until the thread of a box has done what it has begun."""
    _look(box + 8 * FINISHED, PENDING, spin, plan + 8 * Plan.clock)
    if _replace(box + 8 * FINISHED, PENDING, AWAITED):
        while loaded(box + 8 * FINISHED) != DONE:
            _wait(box + 8 * ANSWER)


@nogil
def _begin(plan, spin):
    """Give parts that are Python code."""
    stored(plan + 8 * Plan.body, 0)
    _give(plan, spin)


@nogil
def _took_back(plan, k):
    """Whether thread k has not begun its part, and shall not."""
    box = loaded(plan + 8 * (Plan.boxes + k - 1))
    if _replace(box, GIVEN, IDLE):
        stored(box + 8 * FINISHED, DONE)
        return True
    return False


@nogil
def _end(plan, spin):
    """Wait for all parts that were given."""
    for k in range(1, loaded(plan + 8 * Plan.threads)):
        _await(plan, loaded(plan + 8 * (Plan.boxes + k - 1)), spin)


@nogil
def _dismiss(box):
    """Have the thread of a box end."""
    if _swap(box, OVER) == ASLEEP:
        _post(box + 8 * WAKE)


@functools.cache
def _run():
    """Address of the function that runs a plan, and the function, which must be kept."""

    @cfunc(types.void(types.int64, types.int64, types.int64), cache=True)
    def run(plan, body, pack):
        stored(plan + 8 * Plan.body, body)
        stored(plan + 8 * Plan.pack, pack)
        _give(plan, SPIN)
        _work(plan, body, 0, pack)
        threads = loaded(plan + 8 * Plan.threads)
        for k in range(threads - 1, 0, -1):
            if _took_back(plan, k):
                _call(body, k, pack)
        for k in range(1, threads):
            _await(plan, loaded(plan + 8 * (Plan.boxes + k - 1)), SPIN)

    return run.address, run


def _numbers(count: int) -> ctypes.Array:
    """Room for numbers of 64 bits, all zero, which no other line of the cache shares. It stays until the process ends,
    since a thread may look at it to the last."""
    size = -(-8 * count // LINE) * LINE
    address = _library.aligned_alloc(ctypes.c_size_t(LINE), ctypes.c_size_t(size))
    if not address:
        raise MemoryError(f"{size} bytes for threads")
    ctypes.memset(address, 0, size)
    return (ctypes.c_int64 * count).from_address(address)


_library = ctypes.CDLL(None)
_library.aligned_alloc.restype = ctypes.c_void_p


class _Worker:
    """A thread that waits for work, and does what is Python code itself."""

    def __init__(self) -> None:
        self.box = ctypes.addressof(_numbers(BOX))
        for semaphore in (WAKE, ANSWER):
            _library.sem_init(ctypes.c_void_p(self.box + 8 * semaphore), 0, 0)
        self.job: Callable[[], Any] = _nothing
        self.found: tuple[Any, BaseException | None] = None, None
        self.thread = threading.Thread(target=self._work, daemon=True, name="surgebreak-kernels")
        self.thread.start()

    def _work(self) -> None:
        while _serve(self.box, SPIN):
            self.found = _outcome(self.job)
            self.job = _nothing
            _finished(self.box)


def _nothing() -> None:
    return None


def _outcome(job: Callable[[], Any]) -> tuple[Any, BaseException | None]:
    """What a job returns, and the exception that it ends with instead."""
    try:
        return job(), None
    except BaseException as failure:
        return None, failure


class Team:
    """The threads of this process; one caller at a time uses them, others work on their own thread alone."""

    def __init__(self) -> None:
        self.forget()
        os.register_at_fork(after_in_child=self.forget)
        atexit.register(self.end)

    def forget(self) -> None:
        """Drop all threads, which a process that has just been forked off does not have."""
        self.workers: list[_Worker] = []
        self._at_work = threading.Lock()
        self._plan: Any = None

    def end(self) -> None:
        """End all threads, before the interpreter takes away the code that they run."""
        workers, self.workers = self.workers, []
        for worker in workers:
            _dismiss(worker.box)
        for worker in workers:
            worker.thread.join(PATIENCE)

    def _take(self, threads: int) -> Any:
        """The plan of that many threads, until `_at_work` is released; None while another caller has it."""
        if not self._at_work.acquire(blocking=False):
            return None
        try:
            plan = self._plan
            if plan is None:
                plan = self._plan = _numbers(Plan.size)
                plan[Plan.run] = _run()[0]
            while len(self.workers) < threads - 1:
                self.workers.append(_Worker())
                plan[Plan.boxes + len(self.workers) - 1] = self.workers[-1].box
            plan[Plan.threads] = threads
        except BaseException:
            self._at_work.release()
            raise
        return plan

    def lead(self, driver: Callable, threads: int) -> None:
        """Call driver(address of the plan, number of threads), which shares loops itself; (0, 1) while another caller
        has the threads."""
        plan = self._take(threads) if threads > 1 else None
        if plan is None:
            driver(0, 1)
            return
        try:
            driver(ctypes.addressof(plan), threads)
        finally:
            self._at_work.release()

    def share(self, kernel: Callable, threads: int, parts: int, count: int, args: tuple) -> list | None:
        """What a kernel of a shared range returns for each of as many equal parts of 0 ... count, at least one for
        each thread; None while another caller has the threads."""
        plan = self._take(threads)
        if plan is None:
            return None
        try:
            plan[Plan.parts], plan[Plan.uneven] = parts, 0
            return kernel(-ctypes.addressof(plan), count, *args)
        finally:
            self._at_work.release()

    def share_runs(self, kernel: Callable, ends: list[int], runs, cuts: list[int], args: tuple) -> bool:
        """Run a kernel on ranges with given ends, each with its part of the runs; False while another caller has the
        threads."""
        plan = self._take(len(ends) - 1)
        if plan is None:
            return False
        try:
            plan[Plan.parts], plan[Plan.uneven] = len(ends) - 1, 1
            plan[Plan.ends : Plan.ends + len(ends)] = ends
            plan[Plan.cuts : Plan.cuts + len(cuts)] = cuts
            kernel(-ctypes.addressof(plan), ends[-1], runs, *args)
            return True
        finally:
            self._at_work.release()

    def together(self, jobs: Sequence[Callable[[], Any]]) -> list:
        """Results of Python code, of which one runs on this thread and the others beside it."""
        plan = self._take(len(jobs))
        if plan is None:
            return [job() for job in jobs]
        try:
            return self._together(ctypes.addressof(plan), jobs)
        finally:
            self._at_work.release()

    def _together(self, plan: int, jobs) -> list:
        busy = self.workers[: len(jobs) - 1]
        for worker, job in zip(busy, jobs[1:]):
            worker.job = job
        try:
            _begin(plan, SPIN)
            own = jobs[0]()
            for k, worker in enumerate(busy, 1):
                if _took_back(plan, k):
                    worker.found = _outcome(worker.job)
        finally:
            _end(plan, SPIN)
        for _, failure in (worker.found for worker in busy):
            if failure is not None:
                raise failure
        return [own, *(worker.found[0] for worker in busy)]
