"""Checks of prescribed motions: a block has one motion, and where a driven block is at the end of the run is known
before it begins."""

from __future__ import annotations

from collections.abc import Iterator

from coupler.case.case import Case
from coupler.case.toml_lines import shown
from coupler.case.types import KeyPath, Problem
from coupler.geometry.bodies import Body
from coupler.geometry.motions import KEYS, MotionError, motion_of
from coupler.geometry.parts import Part, recipes

THROUGH = 1e-3
"""Share of its thickness by which a driven block may enter a wall: what rounding of speeds and times leaves."""
HALVINGS = 40
"""Halvings of the time until a motion reaches a wall."""


def motion_problems(case: Case, parts: list[Part]) -> Iterator[Problem]:
    """Motions that cannot be followed, blocks that are told two, and driven blocks that pass through a closed side of
    the tank, or through the ground, before the end."""
    yield from _held_with_a_start(case)
    yield from _driven_twice(case)
    yield from _driven_and_held(case, parts)
    blocks = {block.name: block for part in parts for block in part.blocks}
    walls = list(_walls(case))
    for i, motion in enumerate(case.motion):
        try:
            motion_of(motion)
        except MotionError as error:
            yield ("motion", i, error.key), str(error)
            continue
        if motion.block in blocks:
            yield from _passed(case, ("motion", i, _key(motion)), blocks[motion.block], walls)


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
                ("motion", i, _key(motion)),
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


def _key(motion) -> str:
    """The key by which a motion is given."""
    return next(key for key in (*KEYS, "block") if getattr(motion, key) not in (None, ()))


def _passed(case: Case, path: KeyPath, block, walls) -> Iterator[Problem]:
    """block: driven, with its motion."""
    body, motion = Body.of_block(block), block.motion
    low, high = body.bounds()
    for what, axis, sign, place in walls:
        speed = sign * block.velocity[axis]
        room = sign * (place - (high if sign > 0.0 else low)[axis])
        allowed = room + THROUGH * body.thickness()
        if motion is None:
            reached = max(0.0, room) / speed if speed > 0.0 and speed * case.time.end > allowed else None
        else:
            turns = motion.turning_times(axis, case.time.end)
            beyond = [t for t in turns.tolist() if sign * motion.way(t)[axis] > allowed]
            reached = _reached(motion, axis, sign, max(0.0, room), beyond[0]) if beyond else None
        if reached is not None:
            yield (
                path,
                f"'{block.name}' reaches {what} ({'xyz'[axis]} = {place:g} m) at t = {reached:.4g} s "
                f"and would pass through it until the end ({case.time.end:g} s): nothing stops a prescribed motion; "
                "end the run before, or change the velocity or the place",
            )


def _reached(motion, axis: int, sign: float, room: float, beyond: float) -> float:
    """Time [s] at which a motion has gone as far as `room` [m], before the time `beyond` at which it is farther."""
    before = 0.0
    for _ in range(HALVINGS):
        middle = 0.5 * (before + beyond)
        farther = sign * motion.way(middle)[axis] > room
        before, beyond = (before, middle) if farther else (middle, beyond)
    return beyond


def _walls(case: Case) -> Iterator[tuple[str, int, float, float]]:
    """Boundaries that blocks cannot pass: name, axis normal to it, sign of the outward direction, and position [m]."""
    if case.structure.ground is not None:
        yield "the ground", 2, -1.0, case.structure.ground.level
    for axis, letter in enumerate("xyz" if case.tank is not None else ""):
        for sign, corner in ((-1.0, case.tank.lower), (1.0, case.tank.upper)):
            side = f"{letter}{'+' if sign > 0.0 else '-'}"
            if side not in case.tank.open and not (side == "z-" and case.structure.ground is not None):
                yield f"the closed side {side} of the tank", axis, sign, corner[axis]
