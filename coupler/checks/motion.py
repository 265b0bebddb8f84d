"""Checks of prescribed motions: a block has one motion, and where a driven block is at the end of the run is known
before it begins."""

from __future__ import annotations

from collections.abc import Iterator

from coupler.case.case import Case
from coupler.case.toml_lines import shown
from coupler.case.types import KeyPath, Problem
from coupler.geometry.bodies import Body
from coupler.geometry.parts import Part, recipes

THROUGH = 1e-3
"""Share of its thickness by which a driven block may enter a wall: what rounding of speeds and times leaves."""


def motion_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Blocks that are told two motions, and driven blocks that pass through a closed side of the tank, or through the
    ground, before the end."""
    yield from _held_with_a_start(case)
    yield from _driven_twice(case)
    yield from _driven_and_held(case, parts)
    blocks = {block.name: block for part in parts for block in part.blocks}
    walls = list(_walls(case))
    for i, motion in enumerate(case.motion):
        if motion.block in blocks:
            body = Body.of_block(blocks[motion.block])
            yield from _passed(case, ("motion", i, "velocity"), motion, body, walls)


def _held_with_a_start(case: Case) -> Iterator[Problem]:
    """Single blocks that are held and have a velocity at the start."""
    for i, block in enumerate(case.structure.block):
        given = _start(block)
        if block.fixed and given:
            yield (
                ("structure", "block", i, given),
                f"'{block.name}' has fixed = true as well, and a block that is held does not move; leave {given} out, "
                "leave fixed out for a block that moves freely, or write [[motion]] in place of both for one that "
                "moves as prescribed",
            )


def _driven_twice(case: Case) -> Iterator[Problem]:
    """Blocks with two prescribed motions, or with one and a motion at the start."""
    starts = {block.name: (i, _start(block)) for i, block in enumerate(case.structure.block)}
    seen: dict[str, int] = {}
    for i, motion in enumerate(case.motion):
        first = seen.setdefault(motion.block, i)
        row, given = starts.get(motion.block, (0, ""))
        if first != i:
            yield (
                ("motion", i, "block"),
                f"the motion of '{motion.block}' is given by motion[{first}] already; leave one out",
            )
        elif given:
            yield (
                ("motion", i, "velocity"),
                f"'{motion.block}' has a {given} at the start as well (structure.block[{row}].{given}), but it moves "
                "with the velocity of this motion from the start on, without turning; leave one of them out",
            )


def _driven_and_held(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Prescribed motions of blocks that are held. Abutments of arches are held unless the case says otherwise, and a
    motion is what says otherwise."""
    rows = {motion.block: i for i, motion in reversed(list(enumerate(case.motion)))}
    still = case.model_copy(update={"motion": ()})
    driven = {
        (part.path, part.name): [block.name for block in part.blocks if block.name in rows] for part in parts
    }
    for recipe in recipes(still) if rows else ():
        names = driven.get((recipe.path, recipe.name), [])
        if not names or recipe.path[1] == "arch":
            continue
        held = {block.name for block in recipe.make() if block.fixed}
        for name in (name for name in names if name in held):
            yield (
                ("motion", rows[name], "block"),
                f"'{name}' of {shown(recipe.path)} is held in place for the whole run, so that it cannot move as "
                "prescribed; leave this motion out, or the key fixed where it holds the block",
            )


def _start(block) -> str:
    """The key of a single block by which it moves at the start, or nothing."""
    return next((key for key in ("velocity", "spin") if any(getattr(block, key))), "")


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
