"""The fixed solids of a case as convex bodies in space: boxes, hulls of points, bodies of files.

For the water they are bodies that never move; in a case with a structure they are its last blocks, which are held.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from coupler.case.case import Case
from coupler.case.paths import stamp
from coupler.case.types import KeyPath, Rotation
from coupler.geometry.bodies import Body, turned

BOX_CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]],
    float,
)
DENSITY = 2400.0
"""[kg/m³] of solids without one, as of concrete and rock, whatever the blocks have: crates say nothing of a quay."""
BOX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))


@dataclass(frozen=True)
class FixedSolid:
    """One convex body: path of its table, name, vertices (k, 3) [m] and faces in space, the same for checks."""

    path: KeyPath
    name: str
    vertices: np.ndarray
    faces: tuple
    body: Body


def solids_of(case: Case) -> tuple[FixedSolid, ...]:
    """All fixed bodies in the order of their rows; a file may hold several.

    Raises BlockError or MeshFileError where a table gives no convex body. Kept for the next call unless a file
    changed."""
    solids = _made(case.solid, tuple(stamp(s.path) for s in case.solid if s.path))
    return solids + tuple(_as_solid(path, block) for path, block in _footings(case))


def obstacle_blocks(case: Case) -> list:
    """The fixed solids as held blocks, in the order of `solids_of`: blocks may touch them, and joints may
    glue blocks to them."""
    solids = [block for spec in case.solid for block in _held(spec)]
    return solids + [block for _, block in _footings(case)]


def _footings(case: Case) -> Iterator[tuple[KeyPath, object]]:
    """Held boxes under the parts that stand on the terrain, with the places of their tables."""
    from coupler.geometry.parts import standing_on_terrain

    for path, spec in (
        standing_on_terrain(case) if case.tank is not None and case.tank.ground is not None else ()
    ):
        from coupler.geometry.terrain.standing import footing_box
        from yade_scripts.blocks.block import Block

        centre, size = footing_box(case, spec)
        turn = turned(Rotation(axis=(0.0, 0.0, 1.0), angle=spec.turn))
        name, density = f"{spec.name}-footing", spec.density or case.structure.density
        more = {"density": density, "material": "ground", "group": name, "fixed": True}
        if getattr(spec, "outline", None) is None or spec.pad > 0.0:
            yield path, Block(name, centre, size=size, rotation=turn, **more)
            continue
        from coupler.geometry.outlines import outline_of
        from coupler.geometry.parts import turned_about
        from yade_scripts.blocks.generators.ring import prisms

        low, high = centre[2] - 0.5 * size[2], centre[2] + 0.5 * size[2]
        for block in turned_about(prisms(name, outline_of(spec), low, high, **more), centre, spec.turn):
            yield path, block


def _as_solid(path: KeyPath, block) -> FixedSolid:
    return FixedSolid(path, block.name, block.world_vertices(), block.faces, Body.of_block(block))


def _held(spec) -> list:
    """Blocks of one table; those of a file are numbered, and all are a group of its name."""
    density = spec.density or DENSITY
    return _blocks(spec, density=density, material=spec.material, group=spec.name, fixed=True)


def refused_solids(case: Case) -> Iterator[tuple[KeyPath, str]]:
    """Tables that give no solid, with the reasons."""
    for i, spec in enumerate(case.solid):
        path = ("solid", i)
        ways = [spec.centre is not None or spec.size is not None, spec.vertices is not None, bool(spec.path)]
        if sum(ways) != 1:
            yield path, "give centre and size (a box), vertices (their hull) or path (a file), one of them"
        elif ways[0] and (spec.centre is None or spec.size is None):
            yield path, f"{'centre' if spec.centre is None else 'size'}: missing; a box needs centre and size"
        elif not ways[0]:
            yield from _refused(path, spec)


def _refused(path: KeyPath, spec) -> Iterator[tuple[KeyPath, str]]:
    from coupler.geometry.mesh_files import MeshFileError
    from yade_scripts.blocks.polyhedra import BlockError

    try:
        list(_bodies(path, spec))
    except (BlockError, MeshFileError) as error:
        yield path, str(error)


@lru_cache(maxsize=1)
def _made(specs, stamps) -> tuple[FixedSolid, ...]:
    return tuple(solid for i, spec in enumerate(specs) for solid in _bodies(("solid", i), spec))


def _bodies(path: KeyPath, spec) -> Iterator[FixedSolid]:
    if spec.size is not None:
        turn = turned(spec.rotation)
        corners = np.array(spec.centre) + (0.5 * np.array(spec.size) * BOX_CORNERS) @ turn.T
        yield FixedSolid(path, spec.name, corners, BOX_FACES, Body.box(spec.centre, spec.size, turn))
        return
    if spec.vertices is not None and not spec.path:
        yield replace(_hull(spec.name, tuple(map(tuple, spec.vertices))), path=path)
        return
    for block in _blocks(spec):
        yield FixedSolid(path, spec.name, block.world_vertices(), block.faces, Body.of_block(block))


@lru_cache(maxsize=8192)
def _hull(name: str, points: tuple) -> FixedSolid:
    """The hull of points (k, 3) [m], kept because one command checks a case several times; its path is set by the
    caller. Raises BlockError."""
    from yade_scripts.blocks.block import Block

    return _as_solid((), Block.standing(name, hull_corners(np.array(points))))


def _blocks(spec, **common) -> list:
    from coupler.geometry.block_files import blocks_from_file
    from yade_scripts.blocks.block import Block

    if spec.path:
        return blocks_from_file(spec, **common)
    if spec.size is not None:
        size, turn = np.array(spec.size), turned(spec.rotation)
        return [Block(spec.name, np.array(spec.centre), size=size, rotation=turn, **common)]
    return [Block.standing(spec.name, hull_corners(np.array(spec.vertices)), **common)]


def hull_corners(points: np.ndarray) -> np.ndarray:
    """The points (n, 3) that are corners of their convex hull, in their order; all of them where they span none."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return points[np.sort(ConvexHull(points - points.mean(axis=0)).vertices)]
    except (QhullError, ValueError):
        return points  # refused with its reason when the body is made
