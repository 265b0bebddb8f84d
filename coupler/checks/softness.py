"""Checks of contact stiffness against the weight and the speed of the blocks, which are known before the run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.geometry.parts import Part, parts_of
from coupler.geometry.solid_ground import raised_by
from coupler.geometry.solids import obstacle_blocks
from coupler.geometry.tank_mesh import bed_under, mesh_of

STANDING = ("wall", "building", "column", "arch", "town")
"""Parts whose lower blocks carry those above."""


def softness_remarks(case: Case) -> Iterator[str]:
    """The block with the largest overlap relative to its thickness, if that is beyond `limits.overlap`.

    A weight W overlaps by W/K, and a mass m that lands with the speed v by v sqrt(m/K). The speed v is that at the
    start and of the free fall to what lies below, onto which what floats does not fall."""
    if case.structure is None or case.contact is None:
        return
    worst, limit, parts = None, case.limits.overlap, parts_of(case)
    falls = _falls(case, parts)
    for part in parts:
        above = _carried(part)
        for block in part.blocks:
            K = _stiffness(case, block)
            if block.fixed or K is None:
                continue
            fallen = 2.0 * case.case.gravity * falls.get(block.name, 0.0)
            speed = float(np.sqrt(block.velocity @ block.velocity + fallen))
            weight = above * block.mass * case.case.gravity
            thickness = 2.0 * float(block.planes[1].min())
            share = (weight / K + speed * np.sqrt(block.mass / K)) / thickness
            if worst is None or share > worst[0]:
                needed = weight / (limit * thickness) + block.mass * (speed / (limit * thickness)) ** 2
                worst = share, block.name, thickness, speed, needed, K
    if worst is not None and worst[0] > limit:
        share, name, thickness, speed, needed, K = worst
        yield (
            f"contacts of {K:.3g} N/m are too soft for '{name}', {thickness:.3g} m thick: its weight and a landing at "
            f"{speed:.3g} m/s press it in by {share:.2g} of that, beyond limits.overlap = {limit:g}, where the run "
            f"stops; contact.stiffness should be {needed:.2g} N/m or more"
        )


def _carried(part: Part) -> float:
    """Weight on the lowest blocks over their own: that of the whole part over its footprint."""
    if part.path[1] not in STANDING:
        return 1.0
    low = np.array([block.world_vertices().min(axis=0) for block in part.blocks])
    high = np.array([block.world_vertices().max(axis=0) for block in part.blocks])
    foot = low[:, 2] < low[:, 2].min() + 1e-6 * np.ptp(high[:, 2], axis=0) + 1e-9
    mass = np.array([block.mass for block in part.blocks])
    return float(mass.sum() / mass[foot].sum())


def _stiffness(case: Case, block) -> float | None:
    """K [N/m] of a face of a block as the run will use it; None where nothing determines it."""
    if case.contact.stiffness is not None:
        return case.contact.stiffness
    j = case.joints
    if j is None:
        return None
    from coupler.scene.build import joint_parameters
    from yade_scripts.blocks.polyhedra import face_areas

    areas = np.linalg.norm(face_areas(block.vertices, block.faces), axis=1)
    return joint_parameters(j).closing_stiffness * float(areas.mean())


def _falls(case: Case, parts: list[Part]) -> dict[str, float]:
    """Heights [m] from which blocks without support fall, by their names: to the ground, the bed of the tank, or what
    stands there below their centres, fixed solids and blocks at rest at the start. What floats does not fall."""
    loose = [
        block
        for part in parts
        if part.path[1] not in STANDING and (case.joints is None or part.path[1] == "rubble")
        for block in part.blocks
        if not _floats(case, block)
    ]
    if not loose or (case.structure.ground is None and case.tank is None):
        return {}
    places = np.array([block.centre[:2] for block in loose])
    bodies = [block for part in parts for block in part.blocks] + obstacle_blocks(case)
    found = raised_by(bed_at(case, places), places, [(b.world_vertices(), b.faces) for b in bodies])
    lowest = np.array([block.world_vertices()[:, 2].min() for block in loose])
    return {block.name: fall for block, fall in zip(loose, np.maximum(lowest - found, 0.0).tolist())}


def bed_at(case: Case, places) -> Array:
    """Heights z (n,) [m] of the ground or the bed of the tank, whichever is higher, at places (n, 2) [m]."""
    tank, found = case.tank, np.full(len(places), -np.inf)
    if tank is not None:
        found = np.full(len(places), tank.lower[2])
        if not tank.is_box:
            found = np.fmax(found, bed_under(mesh_of(tank), places))
    ground = case.structure.ground
    return found if ground is None else np.maximum(found, ground.level)


def _floats(case: Case, block) -> bool:
    """Whether a block lighter than water has the middle of its underside in the water of the start."""
    if case.water is None or block.density >= case.water.density:
        return False
    corners = block.world_vertices()
    foot = np.array([*(0.5 * (corners.min(axis=0) + corners.max(axis=0)))[:2], corners[:, 2].min()])
    return any((foot >= fill.lower).all() and (foot <= fill.upper).all() for fill in case.water.fill)
