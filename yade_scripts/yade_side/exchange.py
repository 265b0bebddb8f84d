"""States of bodies out of YADE and forces into it: through its Python interface, or where its objects keep them
(`memory.py`), with the same bits."""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Callable
from typing import Protocol

import numpy as np

from array_types import Array
from yade_scripts.yade_side.engine import Engine
from yade_scripts.yade_side.memory import BodyMemory, NotFound

PLACED = 13
"""Numbers of a body that place it and say how it moves: position 3, velocity 3, angular velocity 3, orientation 4
(x y z w). Angular momentum 3 follows where all are asked for."""


class Exchange(Protocol):
    """Exchange with the bodies of all rows."""

    def reading(self, rows: Array) -> Callable[[], Array]:
        """A function that reads the PLACED of the bodies `rows` (k,), (k, PLACED)."""

    def pushing(self, rows: Array) -> Callable[[Array], None]:
        """A function that gives the bodies `rows` (k,) their forces and moments of F (n, 6) for the next step. One such
        list of rows is in use at a time."""

    def states(self, rows: Array) -> Array:
        """All numbers of the bodies `rows` (k,), (k, 16)."""


def exchange_of(engine: Engine, bodies: list) -> Exchange:
    """By memory where that is found. The engines of the scene must have been set."""
    try:
        return BodyMemory(engine, bodies)
    except NotFound:
        return Interface(engine, bodies)


class Interface:
    """An `Exchange` of lists, through YADE's Python interface.

    Lists of ids persist between readings, because YADE leaks a reference for each fresh item that it is handed."""

    def __init__(self, engine: Engine, bodies: list) -> None:
        self._forces, self._bodies = engine.O.forces, bodies
        self._subdomain = engine.wrapper.Subdomain()
        self._ids = [body.id for body in bodies]

    def _ids_of(self, rows: Array) -> list[int]:
        return [self._ids[row] for row in rows.tolist()]

    def reading(self, rows: Array) -> Callable[[], Array]:
        """See `Exchange`."""
        ids, count = self._ids_of(rows), PLACED * len(rows)
        buffer, get = bytearray(8 * count), self._subdomain.getStateValuesFromIds

        def read() -> Array:
            struct.pack_into(f"{count}d", buffer, 0, *get(ids))
            return np.frombuffer(buffer, float, count).reshape(-1, PLACED)

        return read

    def pushing(self, rows: Array) -> Callable[[Array], None]:
        """See `Exchange`. Permanent forces are not used: YADE's integrator aborts when bodies are added after one was
        set."""
        ids, forces = self._ids_of(rows), self._forces

        def push(F: Array) -> None:
            deque(map(forces.addF, ids, F[rows, :3].tolist()), maxlen=0)
            deque(map(forces.addT, ids, F[rows, 3:].tolist()), maxlen=0)

        return push

    def states(self, rows: Array) -> Array:
        """See `Exchange`."""
        spins = np.array([tuple(self._bodies[row].state.angMom) for row in rows.tolist()])
        return np.concatenate([self.reading(rows)(), spins.reshape(-1, 3)], axis=1)
