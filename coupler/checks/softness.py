"""Checks of contact stiffness against the weight and the speed of the blocks, which are known before the run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.geometry.parts import Part, parts_of

STANDING = ("wall", "building", "column", "arch", "town")
"""Parts whose lower blocks carry those above."""


def softness_remarks(case: Case) -> Iterator[str]:
    """The block with the largest overlap relative to its thickness, if that is beyond `limits.overlap`.

    A weight W overlaps by W/K, and a mass m that lands with the speed v by v sqrt(m/K). The speed v is that at the
    start and of the free fall to the ground or the floor of the tank."""
    if case.structure is None or case.contact is None:
        return
    worst, limit = None, case.limits.overlap
    for part in parts_of(case):
        above = _carried(part)
        for block in part.blocks:
            K = _stiffness(case, block)
            if block.fixed or K is None:
                continue
            speed = float(
                np.sqrt(block.velocity @ block.velocity + 2.0 * case.case.gravity * _fall(case, part, block))
            )
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


def _fall(case: Case, part: Part, block) -> float:
    """Height [m] from which a block without support falls to the ground or the floor of the tank."""
    floors = [case.structure.ground.level] if case.structure.ground else []
    floors += [case.tank.lower[2]] if case.tank is not None else []
    if not floors or part.path[1] in STANDING or (case.joints is not None and part.path[1] != "rubble"):
        return 0.0
    return max(0.0, float(block.world_vertices()[:, 2].min()) - max(floors))
