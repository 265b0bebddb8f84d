"""Checks of prescribed motions: the position of a driven block at the end of the run is known before it begins."""

from __future__ import annotations

from collections.abc import Iterator

from coupler.case.case import Case
from coupler.case.types import KeyPath, Problem
from coupler.geometry.bodies import Body
from coupler.geometry.parts import Part

THROUGH = 1e-3
"""Share of its thickness by which a driven block may enter a wall: what rounding of speeds and times leaves."""


def motion_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Driven blocks that pass through a closed side of the tank, or through the ground, before the end."""
    blocks = {block.name: block for part in parts for block in part.blocks}
    walls = list(_walls(case))
    for i, motion in enumerate(case.motion):
        if motion.block in blocks:
            body = Body.of_block(blocks[motion.block])
            yield from _passed(case, ("motion", i, "velocity"), motion, body, walls)


def _passed(case: Case, path: KeyPath, motion, body: Body, walls) -> Iterator[Problem]:
    low, high = body.bounds()
    for what, axis, sign, place in walls:
        speed = sign * motion.velocity[axis]
        room = sign * (place - (high if sign > 0.0 else low)[axis])
        if speed > 0.0 and speed * case.time.end > room + THROUGH * body.thickness():
            yield (
                path,
                f"'{motion.block}' reaches {what} ({'xyz'[axis]} = {place:g} m) at t = {max(0.0, room) / speed:.4g} s "
                f"and would pass through it until the end ({case.time.end:g} s): nothing stops a prescribed motion; "
                "end the run before, or change the velocity or the place",
            )


def _walls(case: Case) -> Iterator[tuple[str, int, float, float]]:
    """Boundaries that blocks cannot pass: name, axis normal to it, sign of the outward direction, and position [m]."""
    if case.structure.ground is not None:
        yield "the ground", 2, -1.0, case.structure.ground.level
    for axis, letter in enumerate("xyz" if case.tank is not None else ""):
        for sign, corner in ((-1.0, case.tank.lower), (1.0, case.tank.upper)):
            side = f"{letter}{'+' if sign > 0.0 else '-'}"
            if side not in case.tank.open and not (side == "z-" and case.structure.ground is not None):
                yield f"the closed side {side} of the tank", axis, sign, corner[axis]
