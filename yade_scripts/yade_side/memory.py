"""Where YADE's objects keep their numbers, so that arrays can be read from them and written to them.

YADE's Python interface makes an object of every number that it hands over: to give 215 blocks their forces and to read
their states takes four times as long as YADE's own step. Its objects keep the same numbers as doubles, in the same
place as long as they live. A Python object of Boost.Python leads to the object of YADE:

    address of the Python object + HELD → holder,   holder + OBJECT → object of YADE

How far into it a number lies is found by setting it to one that occurs nowhere else. All of this is read through
/proc/self/mem, where a wrong address is an error and not the end of the process, and compared with what YADE's own
interface gives. Where anything differs (another build of YADE or Boost, no /proc), `NotFound` is raised, and the
interface serves instead; the bits are the same.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import BinaryIO

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from array_types import Array, Ints
from kernels.decorators import plain
from yade_scripts.yade_side.engine import Engine

HELD, OBJECT = 40, 16
"""Bytes: `instance.objects` of Boost.Python, behind the head of an object, its `__dict__` and its weak references; and
what a holder holds, behind its virtual table and the next holder."""
LONGEST = 1024
"""Bytes of an object among which a number is looked for."""
SIGN, TURN = (1.0 / 3.0, -1.0 / 7.0, 1.0 / 11.0), (-0.5, 0.5, 0.5, 0.5)
"""Numbers that are looked for, and an orientation (x y z w)."""


class NotFound(Exception):
    """The numbers of YADE's objects are not where they are looked for."""


@dataclass(frozen=True)
class Layout:
    """Bytes from the beginning of an object to its numbers: state (16,) of a body, which are position 3, velocity 3,
    angular velocity 3, orientation 4 (x y z w) and angular momentum 3; force of a ForceEngine, moment of a
    TorqueEngine."""

    state: Ints
    force: int
    moment: int


@cache
def layout(engine: Engine) -> Layout:
    """Of the classes of `engine`. Raises NotFound."""
    w = engine.wrapper
    vector, turn = engine.Vector3(*SIGN), engine.Quaternion(TURN[3], *TURN[:3])
    state, push, twist = w.State(), w.ForceEngine(), w.TorqueEngine()
    with _memory() as memory:

        def place(held, name: str, value, numbers: tuple) -> int:
            """Where in an object the numbers of its attribute lie, which is set to a value of these."""
            setattr(held, name, value)
            at = _read(memory, _address(memory, held), LONGEST).find(
                struct.pack(f"{len(numbers)}d", *numbers)
            )
            if at < 0 or at % 8:
                raise NotFound(f"{type(held).__name__}.{name}")
            setattr(held, name, 0.0 * value if value is vector else engine.Quaternion.Identity)
            return at

        starts = [(place(state, name, vector, SIGN), 3) for name in ("pos", "vel", "angVel")]
        starts += [(place(state, "ori", turn, TURN), 4), (place(state, "angMom", vector, SIGN), 3)]
        numbers = np.concatenate([start + 8 * np.arange(count) for start, count in starts])
        return Layout(numbers, place(push, "force", vector, SIGN), place(twist, "moment", vector, SIGN))


class BodyMemory:
    """An `Exchange` (`exchange.py`) with the memory of the bodies of all rows. One engine of YADE gives each body its
    force and another one its moment; those of the bodies that are pushed stand before the engines of the scene.

    Raises NotFound."""

    def __init__(self, engine: Engine, bodies: list) -> None:
        w, at = engine.wrapper, layout(engine)
        self._O, self._engines = engine.O, list(engine.O.engines)
        self._states = [body.state for body in bodies]
        sign = engine.Vector3(*SIGN)
        self._pushes = [w.ForceEngine(ids=[body.id], force=sign) for body in bodies]
        self._twists = [w.TorqueEngine(ids=[body.id], moment=sign) for body in bodies]
        self._pushed = np.zeros(0, np.int64)
        self._places = at.state
        with _memory() as memory:
            self._state = _addresses(memory, self._states)
            self._force = _addresses(memory, self._pushes) + at.force
            self._moment = _addresses(memory, self._twists) + at.moment
            for state, address in zip(self._states, self._state.tolist()):
                _check(_numbers(memory, address, at.state), _numbers_of(state))
            for address in np.concatenate([self._force, self._moment]).tolist():
                _check(_numbers(memory, address, np.arange(0, 24, 8)), list(SIGN))

    def reading(self, rows: Array) -> Callable[[], Array]:
        """See `Exchange`."""
        address, places = self._state[rows], self._places[:-3]
        out = np.empty((len(rows), len(places)))

        def read() -> Array:
            _gather(address, places, out)
            return out

        return read

    def pushing(self, rows: Array) -> Callable[[Array], None]:
        """See `Exchange`."""
        if not np.array_equal(rows, self._pushed):
            pushed = [each[row] for each in (self._pushes, self._twists) for row in rows.tolist()]
            self._O.engines = pushed + self._engines
            self._pushed = rows
        force, moment = self._force[rows], self._moment[rows]
        return lambda F: _put(rows, F, force, moment)

    def states(self, rows: Array) -> Array:
        """See `Exchange`."""
        out = np.empty((len(rows), len(self._places)))
        _gather(self._state[rows], self._places, out)
        return out


def _memory() -> BinaryIO:
    try:
        return open("/proc/self/mem", "rb", buffering=0)
    except OSError as error:
        raise NotFound(str(error)) from error


def _read(memory: BinaryIO, address: int, size: int) -> bytes:
    """At most `size` bytes from an address on. Raises NotFound where there is no memory."""
    try:
        memory.seek(address)
        return memory.read(size)
    except (OSError, OverflowError, ValueError) as error:
        raise NotFound(f"no memory at {address:#x}") from error


def _word(memory: BinaryIO, address: int) -> int:
    found = _read(memory, address, 8)
    if len(found) < 8:
        raise NotFound(f"no memory at {address:#x}")
    return struct.unpack("Q", found)[0]


def _address(memory: BinaryIO, held) -> int:
    """Address of the object of YADE that a Python object holds."""
    return _word(memory, _word(memory, id(held) + HELD) + OBJECT)


def _addresses(memory: BinaryIO, held: list) -> Ints:
    return np.array([_address(memory, one) for one in held], np.int64)


def _numbers(memory: BinaryIO, address: int, places: Ints) -> list[float]:
    """The doubles at some places behind an address."""
    found = _read(memory, address, LONGEST)
    if len(found) < places.max() + 8:
        raise NotFound(f"no memory at {address:#x}")
    return [struct.unpack_from("d", found, place)[0] for place in places.tolist()]


def _numbers_of(state) -> list[float]:
    """What YADE's interface gives of a state."""
    turn = state.ori
    return [*state.pos, *state.vel, *state.angVel, turn[0], turn[1], turn[2], turn[3], *state.angMom]


def _check(found: list[float], known: list[float]) -> None:
    if found != known:
        raise NotFound("numbers are not where they are in another object of their class")


@intrinsic
def _number_at(typingctx, address):
    def code(context, builder, signature, args):
        return builder.load(builder.inttoptr(args[0], ir.DoubleType().as_pointer()))

    return types.float64(types.int64), code


@intrinsic
def _set_number(typingctx, address, value):
    def code(context, builder, signature, args):
        builder.store(args[1], builder.inttoptr(args[0], ir.DoubleType().as_pointer()))
        return context.get_dummy_value()

    return types.void(types.int64, types.float64), code


@plain
def _gather(address, places, out):
    """out (k, m) <- the doubles at `places` (m,) bytes from each address (k,)."""
    for i in range(len(address)):
        for k in range(len(places)):
            out[i, k] = _number_at(address[i] + places[k])


@plain
def _put(rows, F, force, moment):
    """Store F (n, 6) of the rows (k,) at the addresses force (k,) and moment (k,)."""
    for i in range(len(rows)):
        for k in range(3):
            _set_number(force[i] + 8 * k, F[rows[i], k])
            _set_number(moment[i] + 8 * k, F[rows[i], 3 + k])
