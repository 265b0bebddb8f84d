"""Whether a step is to be taken again: which limit it broke, looked at once it is complete.

A step is bad where its momentum or volume breaks the limit at which a run stops, and where it alone puts more energy
out of balance than a share of what a whole run may: a wall that fell once lost in one step all that its run was
allowed, with the blocks missing the motion that the water was given by less than their own limit. What built up over
many steps no shorter step cures.
"""

from __future__ import annotations

from coupler.limits import Limits, check_balance, check_momentum

STEP_SHARE = 0.25
"""Share of `limits.energy_error` that a single step may put out of balance."""


def check_step(coupling, record, limits: Limits) -> None:
    """Raises Diverged with the limit that the step broke, or the run with it."""
    volume = 0.0 if coupling.water is None else coupling.water.volume_error()
    where = worst_place(coupling, record)
    check_balance(record.time, volume, record.balance.energy_error, limits, where)
    if record.momentum is not None:
        check_momentum(record.time, record.momentum.error, limits.momentum_error)


def is_bad(coupling, record, limits: Limits) -> bool:
    """Whether this step is to be taken again."""
    volume = 0.0 if coupling.water is None else coupling.water.volume_error()
    momentum = 0.0 if record.momentum is None else record.momentum.error
    kept = (
        abs(volume) <= limits.volume_error
        and momentum <= limits.momentum_error
        and record.balance.step_error <= STEP_SHARE * limits.energy_error
    )
    return not kept


def worst_place(coupling, record) -> str:
    """Where to look when the energy does not balance: the block that missed the most work in the last step, and where
    the water is fastest. "" where there is neither."""
    parts = []
    if len(record.missed_work) and abs(record.missed_work).max() > 0.0:
        worst = int(abs(record.missed_work).argmax())
        name = coupling.structure.names[worst]
        parts.append(
            f"block '{name}' missed {abs(record.missed_work[worst]):.3g} J of the water's work in this step"
        )
    if coupling.water is not None:
        speed, place = coupling.water.fastest_place()
        at = ", ".join(f"{x:.3g}" for x in place)
        parts.append(f"the water is fastest, {speed:.3g} m/s, at ({at}) m")
    return "; ".join(parts)
