"""Loops that compiled code hands to the threads one after the other, without Python between them.

Conjugate gradients go through some dozens of short loops, and Python takes as long between two of them as the loops
themselves. A driver is a compiled function of a `Crew` and of what it works on. It writes

    through(kernel, handed(crew, count, weight, pieces), count, (a, b, ...))
    done(crew)

for `over(kernel, count, a, b, ..., weight=weight, pieces=pieces)`: the kernel is shared (`kernels.decorators.ranged`)
and returns nothing. `kernels.threads.in_a_row` calls a driver. A single thread runs each loop as one range, so that the
bits do not depend on the threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from array_types import Array
from kernels.decorators import inner
from kernels.ranges import MOST, SHARED, Plan
from kernels.team import loaded, stored

PROCESS_TIME = 2
"""Number of the clock for the processor time of a process."""
LOGGED = 2_000
"""Most loops of a driver that are watched."""


class Crew(NamedTuple):
    """The threads at hand: the address of their `Plan`, of which one caller at a time has the use, 0 without threads ·
    how many there are · least number of rows of a range · log (k + 2, 2): in its first row how many loops there were
    that more threads would share, then room for the time, then the processor time [ns] of the process when each of them
    began and ended; of length 0: nobody watches."""

    plan: int
    threads: int
    least: int
    log: Array


NOT_WATCHED = np.zeros((0, 2), np.int64)

_free = types.ExternalFunction("free", types.void(types.int64))
_clock = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.int64))


@intrinsic
def through(typingctx, kernel, first, last, arguments):
    """Call the entry of a shared kernel (`kernels/ranges.py`) with a range, or with a plan and the number of rows, and
    a tuple of arguments."""
    if not isinstance(kernel, types.Dispatcher):
        raise TypeError(f"{kernel}: must be a kernel")
    given = (types.int64, types.int64, *(types.unliteral(kind) for kind in arguments.types))
    kernel.dispatcher.compile(given)
    made = kernel.dispatcher.overloads[given]
    if made.signature.return_type != types.none:
        raise TypeError(f"{kernel}: must return nothing")

    def code(context, builder, signature, args):
        _, first, last, packed = args
        values = cgutils.unpack_tuple(builder, packed, len(arguments.types))
        values = [context.cast(builder, *each) for each in zip(values, arguments.types, given[2:])]
        context.add_linking_libs([made.library])
        convention, fndesc = context.call_conv, made.fndesc
        kind = convention.get_function_type(fndesc.restype, fndesc.argtypes)
        entry = cgutils.get_or_insert_function(builder.module, kind, fndesc.llvm_func_name + SHARED)
        status, _ = convention.call_function(
            builder, entry, fndesc.restype, fndesc.argtypes, [first, last, *values]
        )
        with cgutils.if_unlikely(builder, status.is_error):
            convention.return_status_propagate(builder, status)
        return context.get_dummy_value()

    return types.void(kernel, types.int64, types.int64, arguments), code


@inner
def handed(crew, count, weight, pieces):
    """What stands for the range 0 ... count in the call of a kernel: minus the address of the plan that says how it is
    shared, or 0 if it is not worth sharing. weight, pieces: as in `kernels.threads.over`."""
    if crew.log.shape[0] > 0 and count * weight >= 2 * crew.least:
        _note(crew.log, 0)
    if crew.plan == 0:
        return np.int64(0)
    stored(crew.plan + 8 * Plan.results, 0)  # what lies there was given back by those who had the plan before
    threads = min(crew.threads, min(MOST, count), np.int64(np.ceil(count * weight)) // crew.least)
    if threads <= 1:
        return np.int64(0)
    stored(crew.plan + 8 * Plan.threads, threads)
    stored(crew.plan + 8 * Plan.parts, min(threads * pieces, min(MOST, count)))
    stored(crew.plan + 8 * Plan.uneven, 0)
    return -np.int64(crew.plan)


@inner
def done(crew):
    """To be called after each loop: what the entry has set aside for results is given back."""
    if crew.plan != 0:
        results = loaded(crew.plan + 8 * Plan.results)
        if results != 0:
            _free(results)
            stored(crew.plan + 8 * Plan.results, 0)
    row = crew.log[0, 0] + 2 if crew.log.shape[0] > 0 else 0
    if row < crew.log.shape[0] and crew.log[row, 0] > 0:
        _note(crew.log, 1)
        crew.log[0, 0] += 1


@inner
def _note(log, end):
    """Write down when a loop began or ended."""
    row, room = log[0, 0] + 2, np.int64(log.ctypes.data) + 16
    if row < log.shape[0]:
        _clock(PROCESS_TIME, room)
        log[row, end] = 1_000_000_000 * loaded(room) + loaded(room + 8)
