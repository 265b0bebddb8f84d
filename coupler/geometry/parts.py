"""From the structure of a case to its blocks, part by part: single blocks, generators and files."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from coupler.case.case import Case
from coupler.case.paths import stamp
from coupler.case.types import KeyPath
from coupler.geometry.bodies import turned
from coupler.geometry.motions import MotionError, motion_of


@dataclass(frozen=True)
class Part:
    """The blocks of one table of the structure, with its key path and its name."""

    path: KeyPath
    name: str
    blocks: tuple


@dataclass(frozen=True)
class Recipe:
    """A part that is still to be made; make() raises BlockError or MeshFileError where it cannot be."""

    path: KeyPath
    name: str
    make: Callable[[], list]


def parts_of(case: Case) -> tuple[Part, ...]:
    """All parts with their blocks, in the order of the rows of the structure; empty without a structure.

    Kept for the next call: a case is checked, forecast and built from the same blocks, unless a file changed.
    """
    files = (*case.structure.file, *case.structure.drawing, *case.structure.town) if case.structure else ()
    files = (
        *files,
        *(motion for motion in case.motion if motion.path is not None and Path(motion.path).is_file()),
    )
    stamps = tuple(stamp(spec.path) for spec in files)
    return _made(case, stamps)


@lru_cache(maxsize=1)
def _made(case: Case, stamps: tuple) -> tuple[Part, ...]:
    return tuple(Part(r.path, r.name, tuple(r.make())) for r in recipes(case))


def recipes(case: Case) -> Iterator[Recipe]:
    """Recipes of all parts of the structure."""
    if case.structure is None:
        return
    driven = {motion.block: _told(motion) for motion in case.motion}
    for kind, make in _MAKERS.items():
        for i, spec in enumerate(getattr(case.structure, kind)):
            yield Recipe(
                ("structure", kind, i),
                spec.name,
                lambda spec=spec, make=make: _made_from(case, spec, make, driven),
            )
    for path, spec in town_houses(case):
        yield Recipe(path, spec.name, lambda spec=spec: _made_from(case, spec, _building, driven))


def standing_on_terrain(case: Case) -> Iterator[tuple[KeyPath, object]]:
    """Places and tables of the parts with on = "terrain"."""
    for kind in ("building", "wall"):
        for i, spec in enumerate(getattr(case.structure, kind) if case.structure else ()):
            if spec.on is not None:
                yield ("structure", kind, i), spec
    yield from town_houses(case)


def town_houses(case: Case) -> Iterator[tuple[KeyPath, object]]:
    """Places and tables of the houses of all towns; none without the ground that they stand on."""
    if case.structure is None or not case.structure.town or case.tank is None or case.tank.ground is None:
        return
    from coupler.geometry.footprints import FootprintError
    from coupler.geometry.town import houses_of

    for i, town in enumerate(case.structure.town):
        with suppress(FootprintError):  # reported with its reason by the checks, before anything is built
            for house in houses_of(case, town):
                yield ("structure", "town", i), house


def _made_from(case: Case, spec, make, driven: dict) -> list:
    """The blocks of one table, those with a prescribed motion driven."""
    common = {"density": spec.density or case.structure.density, "material": spec.material}
    if getattr(spec, "on", None) is not None:
        from coupler.geometry.terrain.standing import on_ground

        spec = on_ground(case, spec)
    blocks = make(spec, common)
    if getattr(spec, "turn", 0.0):
        blocks = turned_about(blocks, np.array(spec.lower) + 0.5 * np.array(spec.size), spec.turn)
    return [b.changed(driven=True, fixed=False, **driven[b.name]) if b.name in driven else b for b in blocks]


def _told(spec) -> dict:
    """What a table [[motion]] changes of its block: the velocity, at the start where it varies, and the motion."""
    try:
        motion = motion_of(spec)
    except MotionError:  # reported with its reason by the checks, before anything is built
        return {"velocity": np.zeros(3)}
    if motion is None:
        return {"velocity": np.array(spec.velocity)}
    return {"velocity": motion.velocities[0], "motion": motion}


def turned_about(blocks: list, middle, angle: float) -> list:
    """The blocks turned about the upright axis through a point (3,) [m], counter-clockwise [rad]."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return [b.changed(centre=middle + turn @ (b.centre - middle), rotation=turn @ b.rotation) for b in blocks]


def _single(spec, common: dict) -> list:
    from yade_scripts.blocks.block import Block

    more = common | {
        "rotation": turned(spec.rotation),
        "group": spec.group or spec.name,
        "fixed": spec.fixed,
        "velocity": np.array(spec.velocity),
        "spin": np.array(spec.spin),
    }
    if spec.size is not None:
        return [Block(spec.name, np.array(spec.centre), size=np.array(spec.size), **more)]
    if spec.diameter is not None:
        from yade_scripts.blocks.generators.sphere import sphere_vertices

        vertices = sphere_vertices(0.5 * spec.diameter, spec.faces or 80)
        return [Block(spec.name, np.array(spec.centre), vertices=vertices, **more)]
    block = Block.standing(spec.name, np.array(spec.vertices), **more)
    return [block if spec.centre is None else block.changed(centre=np.array(spec.centre))]


def _wall(spec, common: dict) -> list:
    from yade_scripts.blocks.generators.wall import wall_of_blocks

    return wall_of_blocks(
        spec.name, spec.lower, spec.size, spec.block, spec.bond, spec.along, group=spec.name, **common
    )


def _building(spec, common: dict) -> list:
    if spec.outline is not None:
        return _along_outline(spec, common)
    from yade_scripts.blocks.generators.building import Building, building_blocks

    lower, size = np.array(spec.lower), np.array(spec.size)
    return building_blocks(
        Building(
            lower=lower[:2],
            upper=lower[:2] + size[:2],
            height=size[2],
            thickness=spec.wall_thickness,
            floor_thickness=spec.floor_thickness,
            block=spec.block[0],
            course=spec.block[1],
            storeys=spec.storeys,
            roof=spec.roof,
            base=lower[2],
            openings=tuple(_opening(spec, o) for o in spec.opening),
            name=spec.name,
            **common,
        )
    )


def _along_outline(spec, common: dict) -> list:
    """A building whose walls follow an outline."""
    from coupler.geometry.outlines import outline_of
    from yade_scripts.blocks.generators.ring import Ring, ring_blocks

    return ring_blocks(
        Ring(
            outline=outline_of(spec),
            base=spec.lower[2],
            height=spec.size[2],
            thickness=spec.wall_thickness,
            block=spec.block[0],
            course=spec.block[1],
            floor_thickness=spec.floor_thickness or spec.wall_thickness,
            storeys=spec.storeys,
            roof=spec.roof,
            name=spec.name,
            **common,
        )
    )


def _opening(spec, opening):
    """A rectangle in a wall as a box through that wall."""
    from yade_scripts.blocks.generators.building import Opening

    lower, upper = np.array(spec.lower), np.add(spec.lower, spec.size)
    across = "xy".index(opening.wall[0])
    along = 1 - across
    box_low, box_high = lower.copy(), upper.copy()
    if opening.wall[1] == "-":
        box_high[across] = lower[across] + spec.wall_thickness
    else:
        box_low[across] = upper[across] - spec.wall_thickness
    for axis, start, length in zip((along, 2), opening.lower, opening.size):
        box_low[axis] = lower[axis] + start
        box_high[axis] = box_low[axis] + length
    return Opening(box_low, box_high)


def _column(spec, common: dict) -> list:
    from yade_scripts.blocks.generators.column import column_of_boxes, column_of_drums

    common = common | {"group": spec.name}
    if spec.size is not None:
        return column_of_boxes(spec.name, spec.foot, (*spec.size, spec.height), spec.drums, **common)
    return column_of_drums(
        spec.name, spec.foot, spec.radius, spec.height, spec.drums, spec.sides, spec.top_radius, **common
    )


def _arch(spec, common: dict) -> list:
    from yade_scripts.blocks.generators.arch import Arch, abutment_blocks, arch_blocks

    arch = Arch(
        name=spec.name,
        foot=np.array(spec.foot),
        span=spec.span,
        rise=spec.span / 2 if spec.rise is None else spec.rise,
        thickness=spec.thickness,
        width=spec.width,
        count=spec.voussoirs,
        along=spec.along,
        abutment=spec.abutment,
    )
    common = common | {"group": spec.name}
    return arch_blocks(arch, **common) + abutment_blocks(arch, fixed=spec.abutment_fixed, **common)


def _rubble(spec, common: dict) -> list:
    from yade_scripts.blocks.generators.rubble import rubble_blocks

    return rubble_blocks(
        spec.name, spec.lower, spec.size, spec.count, spec.diameter, spec.seed, spec.shape, spec.corners,
        group=spec.name, **common,
    )  # fmt: skip


def _file(spec, common: dict) -> list:
    from coupler.geometry.block_files import blocks_from_file

    return blocks_from_file(spec, fixed=spec.fixed, group=spec.name, **common)


def _drawing(spec, common: dict) -> list:
    from coupler.geometry.drawing.drawing import blocks_from_drawing

    return blocks_from_drawing(spec, fixed=spec.fixed, **common)


_MAKERS = {
    "block": _single,
    "wall": _wall,
    "building": _building,
    "column": _column,
    "arch": _arch,
    "rubble": _rubble,
    "file": _file,
    "drawing": _drawing,
}
PARTS = tuple(_MAKERS)
"""Tables of the structure that make blocks, in the order of their rows."""
