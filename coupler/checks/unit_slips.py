"""Implausible values, for which most likely another unit was meant: allowed, but remarked on before the run."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from pydantic import BaseModel

from coupler.case.case import Case
from coupler.case.keys import keys
from coupler.case.toml_lines import shown
from coupler.case.types import KeyPath
from coupler.checks.softness import STANDING
from coupler.geometry.parts import parts_of

LIGHTEST, HEAVIEST = 5.0, 25e3
"""Densities [kg/m3] between which solids and liquids lie: foam and platinum."""
WEIGHTS = 15.0, 30.0
"""Unit weights [kN/m3] of masonry and concrete, reinforced or not."""
WEAKEST = 1.0
"""Strength [Pa] below which a joint holds nothing: a millimetre of stone weighs more."""
ROUGHEST = 3.0
"""Friction coefficient above which no dry faces are: that of an angle of friction of 72 degrees."""
TURN = 2.0 * np.pi * (1.0 + 1e-9)
"""Angle [rad] beyond which a rotation is more than a full turn."""


def unit_remarks(case: Case) -> Iterator[str]:
    """Densities, strengths, openings, friction and angles that look like numbers in another unit."""
    blocks = [block for part in parts_of(case) for block in part.blocks]
    for block in blocks:
        if not LIGHTEST <= block.density <= HEAVIEST:
            yield f"the density of '{block.name}' is {block.density:g} kg/m3; other units are text, \"2.4 g/cm3\""
            break
    yield from _weight_remarks(case)
    if case.water is not None and not LIGHTEST <= case.water.density <= HEAVIEST:
        yield f'water.density is {case.water.density:g} kg/m3; other units are text, "1 t/m3"'
    j = case.joints
    if j is not None and j.strength < WEAKEST:
        yield f'joints.strength is {j.strength:g} Pa, next to nothing; "1 MPa" is a million, "1 mPa" a thousandth'
    if j is not None and blocks:
        from coupler.geometry.bodies import Body

        thinnest = min(Body.of_block(block).thickness() for block in blocks)
        if j.opening_at_failure > 0.5 * thinnest:
            yield (
                f"joints.opening_at_failure is {j.opening_at_failure:g} m, more than half the thinnest block "
                f'({thinnest:g} m); millimetres are text, "1 mm"'
            )
    yield from _friction_remarks(case)
    yield from _angle_remarks(case)


def _weight_remarks(case: Case) -> Iterator[str]:
    """Densities of what stands, or is joined, that are as light as foam and as large as unit weights; once for the
    first."""
    for part in parts_of(case):
        if case.joints is None and part.path[1] not in STANDING:
            continue
        for block in part.blocks:
            if WEIGHTS[0] <= block.density <= WEIGHTS[1]:
                yield (
                    f"the density of '{block.name}' is {block.density:g} kg/m3, that of foam; a unit weight of "
                    f"{block.density:g} kN/m3 is a density of {1000.0 * block.density / 9.81:.0f} kg/m3"
                )
                return


def _friction_remarks(case: Case) -> Iterator[str]:
    """Friction coefficients that look like angles of friction."""
    if case.contact is None:
        return
    given = [("contact.friction", case.contact.friction)]
    given += [(f"contact.pair[{i}].friction", pair.friction) for i, pair in enumerate(case.contact.pair)]
    for key, friction in given:
        if friction is not None and friction > ROUGHEST:
            meant = f"an angle of {friction:g} degrees is {np.tan(np.radians(friction)):.2g}"
            yield (
                f"{key} is {friction:g}, rougher than any dry faces; it is the tangential over the normal force"
                + (f", which for {meant}" if friction < 90.0 else "")
            )


def _angle_remarks(case: Case) -> Iterator[str]:
    """Rotations by more than a turn, reported once for the first: degrees without a unit count as radians."""
    known = {key.path for key in keys() if key.unit == "rad"}
    found = next(((path, angle) for path, angle in _angles(case, (), known) if abs(angle) > TURN), None)
    if found is not None:
        path, angle = found
        yield f'{shown(path)} is {angle:g} rad, more than a full turn; degrees are text, "30 deg"'


def _angles(section: BaseModel, above: KeyPath, known: set[str]) -> Iterator[tuple[KeyPath, float]]:
    """Every angle [rad] in a section and those below it, with its place; known: the names of all angles."""
    for name, value in section:
        path = (*above, name)
        if isinstance(value, BaseModel):
            yield from _angles(value, path, known)
        elif isinstance(value, tuple):
            for i, item in enumerate(value):
                if isinstance(item, BaseModel):
                    yield from _angles(item, (*path, i), known)
        elif isinstance(value, float) and ".".join(part for part in path if isinstance(part, str)) in known:
            yield path, value
