"""Joints that open faster than the substeps follow: what `check` says before a run, and a run at its end.

The work of separation of mixed mode 'effective' is kept at any speed; that of 'needleman' only while an opening grows
by less than a tenth of opening_at_failure in a substep (theory 1.2, Fast opening)."""

from __future__ import annotations

import math

import numpy as np

from coupler.case.case import Case
from coupler.program.terminal import Row

FAST_OPENING = 0.25
"""Growth of λ/δ_f in a substep from which tearing counts as averaged over it."""
FAST_OPENING_NEEDLEMAN = 0.1
"""The same for laws in which shear pushes the faces apart; the error of the work of separation is 0.5 % there."""


def laws_with_potential(case: Case) -> list:
    """The section [joints] and those of its pairs, complete, that have the mixed mode 'needleman'."""
    from coupler.scene.build import of_pair

    joints = case.joints
    if joints is None:
        return []
    every = [joints, *(of_pair(joints, pair) for pair in joints.pair if pair.joined)]
    return [law for law in every if law.mixed_mode == "needleman"]


def note(case: Case, rate: float) -> str:
    """What to say of the largest growth of λ/δ_f in a substep; "" where it was slow enough."""
    is_coupled = bool(laws_with_potential(case))
    if not rate > (FAST_OPENING_NEEDLEMAN if is_coupled else FAST_OPENING):
        return ""
    work = "is kept"
    if is_coupled:
        work = "is off by more than a per cent (mixed_mode 'needleman' keeps it in slow tearing only)"
    return (
        f"note: a joint opened by {rate:.2g} of joints.opening_at_failure in one substep: its work of "
        f"separation {work}, its softening is not resolved in time. Reduce structure.substep where that matters"
    )


def resolved_row(case: Case, structure, substep: float, water_fall: float) -> Row | None:
    """The fastest opening [m/s] that the substep [s] resolves where a joint has a potential, beside the speeds that are
    known before the run: of the blocks at the start and of water that falls by water_fall [m] (0 without); None where
    no joint has a potential."""
    laws, joints = laws_with_potential(case), structure.joints
    if not laws or joints is None or len(joints.df) == 0:
        return None
    smallest = min(law.opening_at_failure or float(joints.df.min()) for law in laws)
    resolved = FAST_OPENING_NEEDLEMAN * smallest / substep
    falling = math.sqrt(2.0 * case.case.gravity * water_fall)
    thrown = max(
        float(np.linalg.norm(b.velocity) + np.linalg.norm(b.spin) * b.radius) for b in structure.blocks
    )
    what, speed = ("water that falls from its highest level", falling)
    if thrown > falling:
        what, speed = ("a block at the start", thrown)
    remark = "mixed_mode 'needleman' keeps the work of separation up to here"
    if speed > resolved:
        remark += (
            f"; {what} has {speed:.3g} m/s, and joints that open as fast take another work: write "
            f"structure.substep = {FAST_OPENING_NEEDLEMAN * smallest / speed:.2g} or mixed_mode = 'effective'"
        )
    return Row("fastest opening", resolved, "m/s", remark)
