"""The pockets of air at the start of a run, in words and as a row of the forecast, and those that it loses."""

from __future__ import annotations

from typing import Any

import numpy as np

from coupler.case.case import Case
from coupler.geometry.solids import solids_of
from coupler.program.quantities import counted, moment_of, quantity
from coupler.program.terminal import Row

NONE_YET = (
    "no pocket is closed off yet; those that the water closes are followed, if the lips around them are a cell or more "
    "under it"
)
LARGER = 2.0
"""A pocket that opens is reported where it holds so many times as much as all that were reported before."""


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


def note_opened(water, time: float, figures: dict[str, Any]) -> str:
    """Add the pockets that opened to the atmosphere in the last step, at a time [s], to figures["air_opened"]; return
    what to say of the largest of them, "" where there is none or a similar one was reported."""
    opened = () if water is None or water.air is None else water.air.opened
    if not opened:
        return ""
    most = max(opened, key=lambda one: one.volume)
    found = figures.setdefault("air_opened", {"number": 0, "volume": 0.0, "largest": 0.0, "reported": 0.0})
    found["number"] += len(opened)
    found["volume"] += sum(one.volume for one in opened)
    if most.volume > found["largest"]:
        cell = float(water.mesh.size_at(np.atleast_2d(most.place))[0])
        place = [*map(float, most.place)]
        found |= {
            "largest": most.volume,
            "time": time,
            "place": place,
            "pressure": most.pressure,
            "cell": cell,
        }
    if most.volume <= LARGER * found["reported"]:
        return ""
    found["reported"] = most.volume
    return f"note: {_largest(found)}{_why(found)}"


def opened_in_all(found: dict[str, Any]) -> str:
    """The message at the end of the run: how many pockets opened to the atmosphere, and the largest of them."""
    if found["number"] == 1:
        return f"{_largest(found)}{_why(found)}"
    return (
        f"{counted(found['number'], 'time')} a pocket of trapped air opened to the atmosphere, "
        f"{found['volume']:.4g} m3 in all. The largest: {_largest(found)}{_why(found)}"
    )


def _largest(found: dict[str, Any]) -> str:
    x, y, z = found["place"]
    return (
        f"at t = {moment_of(found['time'])} a pocket of trapped air around ({x:.3g}, {y:.3g}, {z:.3g}) m, "
        f"{found['largest']:.4g} m3 at {quantity(found['pressure'], 'Pa')}, opened to the atmosphere and lost its air"
    )


def _why(found: dict[str, Any]) -> str:
    return (
        f". Air under a lip that is less than a cell ({quantity(found['cell'], 'm')}) under water cannot be "
        "kept closed off: if that is the cause, use smaller cells or a deeper lip"
    )


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
