"""The pockets of air at the start of a run, in words and as a row of the forecast."""

from __future__ import annotations

from coupler.case.case import Case
from coupler.geometry.solids import solids_of
from coupler.program.terminal import Row

NONE_YET = "no pocket is closed off yet; those that the water closes are followed"


def described_air(water) -> str:
    """The pockets of trapped air at the start, in words, with the weight that they could carry."""
    count, remark = _pockets(water)
    pockets = "one pocket" if count == 1 else f"{count} pockets"
    return f"air: {pockets}, {remark}" if count else f"air: {remark}"


def air_row(case: Case, structure) -> Row:
    """The same for a forecast; cuts the cells by the solids and by the structure, or None, as it stands."""
    from coupler.scene.build_water import water_of

    solids = [] if structure else [(solid.vertices, solid.faces) for solid in solids_of(case)]
    count, remark = _pockets(water_of(case, structure, solids)[0])
    return Row("trapped air", count, "", remark)


def _pockets(water) -> tuple[int, str]:
    """Number of the pockets, and a description of their volume and largest possible lift."""
    volume = water.pocket_volumes()
    if len(volume) == 0:
        return 0, NONE_YET
    p = water.parameters
    mass = p.density * float(volume.sum())
    largest = f", the largest {volume.max():.4g} m3" if len(volume) > 1 else ""
    lift = f"{1e-3 * mass * p.gravity:.4g} kN, the weight of {1e-3 * mass:.4g} t"
    return len(volume), f"{volume.sum():.4g} m3 in all{largest}: wholly under water they would lift {lift}"
