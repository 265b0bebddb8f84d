"""What carries the blocks at the start: joined blocks that hang over the ground, and a ground that is not the floor of
the water."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.case.types import Problem
from coupler.checks.joints import joined_faces
from coupler.checks.softness import STANDING, bed_at
from coupler.geometry.parts import Part, parts_of
from coupler.geometry.solid_ground import tops_below
from coupler.geometry.solids import obstacle_blocks
from coupler.geometry.tank_mesh import is_measured
from coupler.program.quantities import length

INSIDE = 1e-3
"""Share of the way to its middle from which the corners of an underside are looked at, so that they lie on what ends
at the same edge."""


def ground_problems(case: Case) -> Iterator[Problem]:
    """A plane ground below the floor of the tank, which it takes the place of: blocks fall out of the water."""
    tank, ground = case.tank, case.structure.ground
    if tank is None or ground is None or not tank.is_box or not is_measured(tank) or "z-" in tank.open:
        return
    if ground.level < tank.lower[2] - 1e-6 * tank.cell:
        yield (
            ("structure", "ground", "level"),
            f"z = {ground.level:g} m lies below the floor of the tank (z = {tank.lower[2]:g} m), which it replaces for "
            f"blocks: they would fall through that floor; write level = {tank.lower[2]:g}, or leave the section out",
        )


def support_remarks(case: Case) -> Iterator[str]:
    """Blocks over water that the ground carries, and parts that begin without any support."""
    if case.structure is None or case.case.gravity == 0.0:
        return
    parts = parts_of(case)
    yield from _over_water(case, parts)
    yield from _hanging(case, parts)


def _over_water(case: Case, parts: list[Part]) -> Iterator[str]:
    """Blocks on a plane ground above the floor of the tank, with room for water between the two."""
    tank, ground = case.tank, case.structure.ground
    if case.water is None or tank is None or ground is None or not tank.is_box:
        return
    slack = 1e-6 * tank.cell
    if ground.level <= tank.lower[2] + slack:
        return
    blocks = [block for part in parts for block in part.blocks if not block.fixed]
    on_ground = [b for b in blocks if abs(b.world_vertices()[:, 2].min() - ground.level) <= slack]
    if not on_ground:
        return
    places = np.array([block.centre[:2] for block in on_ground])
    held = [block for part in parts for block in part.blocks if block.fixed] + obstacle_blocks(case)
    under = tops_below(
        np.full(len(places), tank.lower[2]), places, np.full(len(places), ground.level + slack), held
    )
    loose = np.flatnonzero(under < ground.level - slack)
    if len(loose):
        yield (
            f"'{on_ground[loose[0]].name}' stands on [structure.ground] at z = {ground.level:g} m, which is ground for "
            f"blocks alone: water reaches down to z = {under[loose[0]]:g} m and flows under it; write tank.lower[2] = "
            f"{ground.level:g}, or put a [[solid]] under it"
        )


def _hanging(case: Case, parts: list[Part]) -> Iterator[str]:
    """Parts that neither a joint nor anything below holds, told once for the lowest gap of each."""
    bodies = [block for part in parts for block in part.blocks] + obstacle_blocks(case)
    name_of = {id(block): part.name for part in parts for block in part.blocks}
    told = set()
    for group in _unheld(case, parts):
        own = {id(block) for block in group.blocks}
        name = name_of[id(group.blocks[0])]
        if name in told or _afloat(case, group):
            continue
        gap, foot = _gap(case, group, [body for body in bodies if id(body) not in own])
        if gap > group.slack:
            told.add(name)
            below = f"{length(gap)} above what lies below it (z = {foot - gap:.6g} m)"
            where = below if np.isfinite(gap) else "over nothing"
            yield (
                f"'{name}' hangs {where}, and no joint holds it: it falls as the run begins. A joint needs faces that "
                "touch" + (f"; to stand there it comes {length(gap)} lower" if np.isfinite(gap) else "")
            )


@dataclass(frozen=True)
class _Group:
    """Blocks that joints hold together, or that are one part · slack [m]: gap up to which faces touch"""

    blocks: list
    slack: float


def _unheld(case: Case, parts: list[Part]) -> Iterator[_Group]:
    """Groups of blocks that no joint holds to the ground or to a body that is held: joined ones, and without joints the
    parts that stand."""
    from yade_scripts.blocks.faces import GAP

    driven = {motion.block for motion in case.motion}
    if case.joints is None:
        for part in parts:
            if part.path[1] in STANDING and not any(b.fixed or b.name in driven for b in part.blocks):
                yield _Group(list(part.blocks), GAP * max(b.radius for b in part.blocks))
        return
    blocks, _, faces, laws = joined_faces(case, parts)
    held = np.array([block.fixed or block.name in driven for block in blocks] + [True])
    ends = [
        (face.a, face.b if face.b >= 0 else len(blocks)) for face, law in zip(faces, laws) if law is not None
    ]
    label = _groups(len(blocks) + 1, np.array(ends, int).reshape(-1, 2))
    for k in np.unique(label):
        rows = np.flatnonzero(label == k)
        if len(rows) > 1 and not held[rows].any():
            own = [blocks[row] for row in rows]
            yield _Group(own, GAP * max(b.radius for b in own))


def _groups(count: int, ends: Array) -> Array:
    """Number of the group (count,) of each of so many things that pairs (k, 2) join."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(ends)), (ends[:, 0], ends[:, 1])), shape=(count, count))
    return connected_components(graph, directed=False)[1]


def _gap(case: Case, group: _Group, others: list) -> tuple[float, float]:
    """Smallest height [m] of the undersides of a group over what lies below them, and the z [m] of that underside."""
    places, heights = [], []
    for block in group.blocks:
        corners = block.world_vertices()
        low = corners[corners[:, 2] <= corners[:, 2].min() + group.slack]
        middle = low.mean(axis=0)
        found = np.vstack([middle, low + INSIDE * (middle - low)])
        places.append(found[:, :2])
        heights.append(found[:, 2])
    x, z = np.concatenate(places), np.concatenate(heights)
    gaps = z - tops_below(bed_at(case, x), x, z + group.slack, others)
    best = int(gaps.argmin())
    return float(gaps[best]), float(z[best])


def _afloat(case: Case, group: _Group) -> bool:
    """Whether a group lighter than water dips into the water of the start."""
    if case.water is None:
        return False
    mass, volume = (sum(getattr(block, name) for block in group.blocks) for name in ("mass", "volume"))
    if mass >= case.water.density * volume:
        return False
    x = np.concatenate([block.world_vertices() for block in group.blocks])
    low, high = x.min(axis=0), x.max(axis=0)
    return any((low < fill.upper).all() and (high > fill.lower).all() for fill in case.water.fill)
