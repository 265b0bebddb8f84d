"""How a structure is divided for its verdict: into bodies (tables of the case), walls and floors, and storeys.

The names define the division. A block has the name of its wall followed by its place in the wall
(`house-wall0x--3-0-1`, `pier-4`); walls, floors and roofs of a building include their storey (`house-wall0x-`,
`house-floor0`). A single block belongs to its group. Names of tables are the user's own: they may end as those of walls
or blocks do, so that only what follows the name of the table is read.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from array_types import Array, Ints
from coupler.verdict.damage import NOWHERE

PLACE_IN_WALL = re.compile(r"(-\d+)+$")
OF_A_STOREY = re.compile(r"-(?P<kind>[a-z]+)(?P<storey>\d+)(?P<which>[a-z]?[+-]?\d*)")
"""-wall0x-, -floor1, -wall0n3 behind the name of the building: kind, number of the storey from 0, which of them."""


@dataclass(frozen=True)
class Division:
    """names of the groups in the order of their first block · label (n,): group of each block, NOWHERE for none."""

    names: tuple[str, ...]
    label: Ints

    @classmethod
    def of(cls, names: Iterable[str | None]) -> Division:
        """From the name of the group of each block, None for none."""
        known: dict[str, int] = {}
        label = [NOWHERE if name is None else known.setdefault(name, len(known)) for name in names]
        return cls(tuple(known), np.array(label, dtype=int))

    def rows(self, group: int) -> Array:
        """Rows of the blocks of a group."""
        return np.flatnonzero(self.label == group)


@dataclass(frozen=True)
class Divisions:
    """The divisions into bodies, members and storeys, and the names of all blocks."""

    blocks: tuple[str, ...]
    bodies: Division
    members: Division
    storeys: Division

    @classmethod
    def of(cls, parts: Sequence, n: int) -> Divisions:
        """parts: coupler.geometry.parts.Part, their blocks in the order of the rows · n: rows, solids last."""
        found = [(part, block) for part in parts for block in part.blocks]
        rest = [None] * (n - len(found))
        names = tuple(block.name for _, block in found)
        single = [part.path[1] == "block" for part, _ in found]
        bodies = [block.group if alone else part.name for (part, block), alone in zip(found, single)]
        members = [body if alone else member(name, body) for name, body, alone in zip(names, bodies, single)]
        return cls(
            names,
            Division.of([*bodies, *rest]),
            Division.of([*members, *rest]),
            Division.of([*map(storey, members, bodies), *rest]),
        )

    def rows_of(self, name: str) -> Array:
        """Rows of the blocks that a name stands for: of a body, a wall or floor, a storey, or a block."""
        rows: set[int] = set()
        for division in (self.bodies, self.members, self.storeys):
            if name in division.names:
                rows |= set(division.rows(division.names.index(name)).tolist())
        rows |= {row for row, block in enumerate(self.blocks) if block == name}
        return np.array(sorted(rows), dtype=int)

    def members_of(self, body: int) -> tuple[str, ...]:
        """Names of the walls, floors and parts of a body."""
        labels = dict.fromkeys(self.members.label[self.bodies.rows(body)].tolist())
        return tuple(self.members.names[label] for label in labels)


def member(block: str, body: str) -> str:
    """Wall, floor or part that a block of a body belongs to: the block's name without its place."""
    return body + PLACE_IN_WALL.sub("", block.removeprefix(body))


def storey(of: str, body: str) -> str | None:
    """The storey of a wall or floor of a body, None for what has none."""
    found = _of_a_storey(of, body)
    return None if found is None else f"{body}-storey{found['storey']}"


def _of_a_storey(of: str, body: str) -> re.Match[str] | None:
    return OF_A_STOREY.fullmatch(of.removeprefix(body)) if of.startswith(body) else None


def in_words(name: str, bodies: Collection[str]) -> str:
    """'wall x- of the ground storey' of house-wall0x-, 'floor of storey 2' of house-floor1, with the body behind where
    there are several; other names as they are. bodies: the names of all bodies."""
    matches = ((_of_a_storey(name, body), body) for body in bodies if name not in bodies)
    found, of = next(((match, body) for match, body in matches if match), (None, ""))
    if found is None:
        return name
    which = f" {found['which']}" if found["which"] else ""
    number = int(found["storey"])
    level = "the ground storey" if number == 0 else f"storey {number + 1}"
    reported = level if found["kind"] == "storey" else f"{found['kind']}{which} of {level}"
    return reported if len(bodies) < 2 else f"{reported} ({of})"
