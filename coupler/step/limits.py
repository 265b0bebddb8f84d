"""Reasons to end a run early: balances that are violated, values that are not finite, and exceeded limits of the
case."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from coupler.program.errors import ExitCode, SurgebreakError

if TYPE_CHECKING:
    from coupler.geometry.overlaps import Overlap
    from fluid.step.water import Water


class Diverged(SurgebreakError):
    """The state is not finite or violates a balance; later results must not be used."""

    exit_code = ExitCode.DIVERGED


class LimitReached(SurgebreakError):
    """A budget of the case is used up; the results so far are valid."""

    exit_code = ExitCode.STOPPED


class Stopped(LimitReached):
    """The user asked the run to stop: Ctrl-C, a file named `stop`, a script."""


@dataclass(frozen=True)
class Limits:
    """Shares of the reference quantity beyond which a run stops (volume, energy, momentum), and its budget [CPU s]."""

    volume_error: float
    energy_error: float
    cpu_seconds: float | None
    momentum_error: float = 1e-8


def check_balance(
    time: float, volume_error: float, energy_error: float, limits: Limits, advice: Callable[[], str] = str
) -> None:
    """Stop a run whose water volume or energy no longer balances.

    advice: gives the sentences on which part of the energy is off, where to look, and what to try.
    Raises Diverged with the quantity, its value, its limit and the remedy.
    """
    if not math.isfinite(volume_error) or abs(volume_error) > limits.volume_error:
        raise Diverged(
            f"the water volume is off by {100 * volume_error:+.3g} % at t = {time:.4g} s; limit "
            f"{100 * limits.volume_error:.3g} % (limits.volume_error). Reduce time.cfl or tank.cell."
        )
    if not math.isfinite(energy_error) or energy_error > limits.energy_error:
        sentences = (
            f"the energy balance is off by {100 * energy_error:.3g} % of the input energy at t = {time:.4g} s; limit "
            f"{100 * limits.energy_error:.3g} % (limits.energy_error).",
            advice(),
            "See history/energy.csv for the line that grows.",
        )
        raise Diverged(" ".join(filter(None, sentences)))


def check_momentum(time: float, momentum_error: float, limit: float) -> None:
    """Stop a run whose forces no longer balance its momentum. Raises Diverged."""
    if not math.isfinite(momentum_error) or momentum_error > limit:
        raise Diverged(
            f"the lines of momentum miss {momentum_error:.2g} of the impulses of the step at t = {time:.4g} s; limit "
            f"{limit:.2g} (limits.momentum_error). They close to round-off wherever solids cut the cells; look in "
            "history/momentum.csv from when the residual grows, and for blocks or solids that overlap there."
        )


def check_defect(time: float, mean_defect: float, limit: float) -> None:
    """Stop a run in which the blocks move differently from what the pressure solve assumed.

    mean_defect: mean over the last steps, since a joint that breaks gives a single step a large one. Raises Diverged.
    """
    if not math.isfinite(mean_defect) or mean_defect > limit:
        raise Diverged(
            f"the blocks miss the motion that the pressure solve assumed by {100 * mean_defect:.3g} % on the mean of "
            f"the last steps, t = {time:.4g} s; limit {100 * limit:.3g} % (limits.defect). Reduce time.step_max to a "
            "tenth of the period of the structure, raise coupling.passes to 2, or raise joints.damping."
        )


def check_misses(time: float, defects: list[float], most: int, limit: float, dt: float) -> None:
    """Stop if the defects of the last `most` steps exceed the limit although the steps were halved as often as
    permitted.

    Raises Diverged.
    """
    if len(defects) < most or min(defects) <= limit:
        return
    raise Diverged(
        f"the blocks miss the motion that the pressure solve assumed by {100 * defects[-1]:.3g} % at t = {time:.4g} s, "
        f"in {most} steps in a row, the last of {dt:.3g} s; limit {100 * limit:.3g} % (limits.defect). A shorter step "
        "does not help: raise coupling.passes or joints.damping, or use a larger tank.cell or heavier blocks."
    )


def check_overlap(time: float, found: Overlap | None, limit: float) -> None:
    """Stop if blocks overlap each other or the ground by more than a contact between solids can.

    found: Overlap (`coupler.geometry.overlaps`) or None. Raises Diverged.
    """
    if found is None:
        return
    over = found.share / limit
    if found.joined:  # loaded by weight and water: the closing goes with 1/K
        advice = (
            "The joint between them is too soft in compression for what presses on it: try a joints.closing_ratio "
            f"about {max(2.0, over):.2g} times as high, or thicker blocks."
        )
    else:  # hit: a block goes in by v sqrt(m/K)
        advice = (
            "What holds them apart is too soft for the weight or the speed of the blocks: try a contact.stiffness "
            f"(absent: by joints.closing_ratio) about {max(2.0, over**2):.2g} times as high, or thicker or slower "
            "blocks."
        )
    raise Diverged(
        f"'{found.block}' is {found.depth:.3g} m deep in {found.other} at t = {time:.4g} s, {found.share:.2g} of the "
        f"thickness of the thinner one ({found.depth / found.share:.3g} m); limit {limit:g} (limits.overlap). {advice}"
    )


def check_air(time: float, water: Water | None, limit: float) -> None:
    """Stop if trapped air is compressed or expanded beyond the range of validity of its law. Raises Diverged."""
    if water is None or water.air is None or len(water.air) == 0:
        return
    k = int(np.abs(water.air.mean_pressure).argmax())
    found = water.air.mean_pressure[k]
    if abs(found) <= limit:
        return
    low, high = water.pocket_bounds(k)
    volume = water.pocket_volumes()[k]
    box = f"({', '.join(f'{x:.3g}' for x in low)}) to ({', '.join(f'{x:.3g}' for x in high)})"
    raise Diverged(
        f"a pocket of trapped air between {box} m, {volume:.3g} m3, has {found:.4g} Pa at t = {time:.4g} s; limit "
        f"{limit:g} Pa (limits.air_pressure). Give it a way out ([[water.air.vent]]), use a larger tank.cell if it is "
        "smaller than a few cells, or raise the limit if such a pressure is what the scene is about."
    )


HIGHEST_PRESSURE = 1e8
"""[Pa], which exceeds that of any impact: water hammer at 70 m/s."""


def no_room(place: Array, blocks: bool, sides: bool, closes: bool = False) -> str:
    """A message for a place (3,) [m] at which no pressure can be found, with the possible cause: moving blocks, sides
    through which water enters, or neither; closes: whether the case closes narrow openings (`water.openings`)."""
    causes = ["a block closes or makes smaller"] * blocks + ["an inflow or a sea fills"] * sides
    at = ", ".join(f"{x:.3g}" for x in place)
    if causes:
        remedy = f"look for a full chamber that {' or '.join(causes)}, and leave it an opening or some air"
        if closes:
            remedy += ', or take water.openings = "all", which closes no narrow opening'
    else:
        remedy = (
            "nothing moves or flows in, so look at the mesh and for slivers of water between solids there, and move "
            "them or change tank.cell a little"
        )
    return f"Water has no room to go at ({at}) m: {remedy}."


def check_pressure(
    time: float, pressure: Array, nodes: Array, causes: tuple[bool, bool, bool], to_start: Callable[[], float]
) -> None:
    """Stop if the water cannot keep its volume, because a driven body reduces a chamber without a free surface.

    pressure (N,) [Pa] at nodes (N, 3) [m]; causes: the last arguments of `no_room` · to_start(): `pressure_to_start`,
    asked where the pressure is beyond that of any impact. Raises Diverged.
    """
    worst = int(np.argmax(np.abs(pressure))) if len(pressure) else 0
    if len(pressure) == 0 or abs(pressure[worst]) <= HIGHEST_PRESSURE:
        return
    limit = max(HIGHEST_PRESSURE, to_start())
    if abs(pressure[worst]) <= limit:
        return
    raise Diverged(
        f"the pressure is {pressure[worst]:.3g} Pa at t = {time:.4g} s; limit {limit:.0e} Pa. "
        f"{no_room(nodes[worst], *causes)}"
    )


def pressure_to_start(water: Water, dt: float) -> float:
    """ρ U L / dt [Pa]: what sets the water of the whole tank, L [m] across, going at its largest speed U [m/s] within
    one step dt [s]. An inflow or a body at full speed from the start has to do that in the first step."""
    across = float(np.linalg.norm(np.diff(water.mesh.bounds, axis=0)))
    return water.parameters.density * water.fastest() * across / dt


def check_finite(time: float, what: str, values: Array, item: str) -> None:
    """Stop at the first NaN or infinity, naming the quantity and the item (node, block) that holds it.

    Raises Diverged.
    """
    values = np.asarray(values)
    if np.isfinite(values).all():
        return
    bad = int(np.argwhere(~np.isfinite(values))[0][0])
    raise Diverged(
        f"{what} is not finite at {item} {bad}, t = {time:.6g} s. The last written step is sound; "
        "reduce time.step_max or time.cfl, or look for a very light or very stiff block there."
    )
