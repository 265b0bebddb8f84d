"""Remarks on a case: what is allowed, but should be known before the run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.case.case import Case
from coupler.case.materials import material_remarks
from coupler.checks.arrivals import arrival_remarks
from coupler.checks.fronts import front_remarks
from coupler.checks.gaps import gap_remarks
from coupler.checks.gauges import gauge_remarks
from coupler.checks.insides import inside_remarks
from coupler.checks.on_land import land_remarks
from coupler.checks.sides import side_remarks
from coupler.checks.softness import softness_remarks
from coupler.checks.supports import support_remarks
from coupler.checks.thin_walls import thin_remarks
from coupler.checks.unit_slips import unit_remarks
from coupler.checks.water import water_remarks
from coupler.geometry.parts import parts_of
from coupler.geometry.tank_mesh import mesh_remarks
from coupler.geometry.town import town_remarks

FALLEN = 0.01
"""Share of its strength that a law may carry at the opening at failure without a remark."""


def remarks(case: Case) -> list[str]:
    """Remarks on what is allowed but should be known before the run."""
    found = [
        *thin_remarks(case),
        *gap_remarks(case),
        *inside_remarks(case),
        *_contact_remarks(case),
        *_pass_remarks(case),
        *softness_remarks(case),
        *support_remarks(case),
        *water_remarks(case),
        *front_remarks(case),
        *arrival_remarks(case),
        *land_remarks(case),
        *material_remarks(case),
        *_joint_remarks(case),
        *_loose_remarks(case),
        *side_remarks(case),
        *_ramp_remarks(case),
        *town_remarks(case),
        *_drawing_remarks(case),
    ]
    found += mesh_remarks(case.tank) if case.tank is not None else []
    return [
        *found,
        *unit_remarks(case),
        *gauge_remarks(case),
    ]


def _drawing_remarks(case: Case) -> Iterator[str]:
    """Those of drawings, whose modules are loaded only where there is one."""
    if case.structure is not None and case.structure.drawing:
        from coupler.geometry.drawing.drawing import drawing_remarks

        yield from drawing_remarks(case)


def _joint_remarks(case: Case) -> Iterator[str]:
    j = case.joints
    if j is None:
        return
    from yade_scripts.blocks.quadrature import enough

    if j.points != "auto" and j.points < len(enough(j.closing_ratio, 3)):
        yield (
            f"joints.points = {j.points} with joints.closing_ratio = {j.closing_ratio:g}: too few for the strength in "
            f"bending (3 are 8 % weak at 10, 16 % at 100); 'auto' takes {len(enough(j.closing_ratio, 3))} or more"
        )
    yield from _law_remarks(case)


def _law_remarks(case: Case) -> Iterator[str]:
    """Laws from outside that do not fall to zero before a joint lets go."""
    from yade_scripts.joints import laws
    from yade_scripts.joints.outside_laws import carried_at_failure

    j = case.joints
    used = {j.law: j.peak} | {pair.law: pair.peak for pair in j.pair if pair.law}
    own = laws.shipped()
    for name, peak in used.items():
        carried = 0.0 if name in own else carried_at_failure(laws.find(name), peak)
        if carried > FALLEN:
            yield (
                f"law '{name}' does not fall to zero: at opening_at_failure it still carries {carried:.0%} of its "
                "strength, which is gone at once there: the energy that the joint took until then is counted, but the "
                "drop strikes its blocks. Let secant(1, p) be 0"
            )


def _loose_remarks(case: Case) -> Iterator[str]:
    """Joints that are absent: walls and buildings are rarely meant to be dry-laid."""
    if case.structure is None or case.joints is not None:
        return
    for part in (*case.structure.wall, *case.structure.building):
        yield f"the blocks of '{part.name}' lie loose on one another; a section [joints] glues them"


def _ramp_remarks(case: Case) -> Iterator[str]:
    """Loose blocks under water without their weight: the voussoirs of an arch that stands flew apart within 0.12 s of a
    ramp of 1 s."""
    if (
        case.structure is None
        or case.structure.start != "ramp"
        or case.joints is not None
        or case.water is None
    ):
        return
    fills = [(np.asarray(fill.lower), np.asarray(fill.upper)) for fill in case.water.fill]
    for part in parts_of(case):
        free = [block.world_vertices() for block in part.blocks if not block.fixed]
        if any(
            (x.min(axis=0) < upper).all() and (x.max(axis=0) > lower).all()
            for x in free
            for lower, upper in fills
        ):
            yield (
                f"loose blocks of '{part.name}' begin in water, which lifts them in full from the start, while "
                f"start = 'ramp' gives them their weight over {case.structure.ramp:g} s: they rise, and the part comes "
                "apart; write start = 'sudden'"
            )


def _contact_remarks(case: Case) -> Iterator[str]:
    if case.structure is not None and case.contact is None:
        yield (
            "there is no section [contact]: blocks whose joints break pass through one another, the ground and the "
            "sides of the tank; with [joints] an empty section [contact] will do"
        )


def _pass_remarks(case: Case) -> Iterator[str]:
    """One pass where blocks are lighter than the water: P58 has the growth of their vibration."""
    if case.structure is None or case.water is None or case.coupling.passes > 1:
        return
    driven = {motion.block for motion in case.motion}
    free = [b for part in parts_of(case) for b in part.blocks if not b.fixed and b.name not in driven]
    lightest = min(free, key=lambda block: block.density, default=None)
    if lightest is not None and lightest.density < case.water.density:
        yield (
            f"coupling.passes = 1 with '{lightest.name}' of {lightest.density:g} kg/m3, lighter than the water "
            f"({case.water.density:g} kg/m3): with a single pass such blocks miss the water's work, their vibration "
            "can grow, and limits.energy_error may end the run; leave coupling.passes at 2, which is stable, or give "
            "a short time.step_max"
        )
