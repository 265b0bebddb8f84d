"""Arrays for the loops over joints and their points, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from array_types import Array, Floats, Ints
from kernels.lanes import LANES

UNIT, DF, BETA, KC, K0, MU = range(6)
"""Columns of the law of a joint (J, 6): T_max/δ_f [Pa/m], δ_f [m], β, k_c [Pa/m], k_0 [Pa/m], μ where it has failed."""
WORK, PULL, LAST, OLDER = 0, 1, 2, 3
"""Columns of `paid` (P, 4): work taken [J/m²], traction of the last substep [Pa], NOT_GROWING before, δ_n in the last
substep and in the one before it [m]."""
NOT_GROWING = -1.0
SLOW = 0.005
"""Below Δ = SLOW δ_f the weight is under 0.2 %: the traction is T itself, which saves the account."""


class JointPoints(NamedTuple):
    """What never changes of the joints: a, b (J,) rows of the blocks, b = -1 for a fixed point · start (J+1,) first
    point of each; xi_a, xi_b (P, 3) [m] of the points in the blocks · weight (P,) [m²] · normal (J, 2, 3) in block a
    and in b · law (J, 6) · peak: λ/δ_f of the largest traction · fours (g, 7, 4): xi_a, xi_b and weight of four points
    at a time, of which the last of a joint stands for those that are missing · first_four (J,) the first of each."""

    a: Ints
    b: Ints
    start: Ints
    xi_a: Floats
    xi_b: Floats
    weight: Floats
    normal: Floats
    law: Floats
    peak: float
    fours: Floats
    first_four: Ints


class PointMemory(NamedTuple):
    """History of the points: largest (P,) λ [m] · paid (P, 4), columns WORK, PULL, LAST and OLDER · rub (P, 3) [m]:
    where failed points stick, in the frame of a."""

    largest: Floats
    paid: Floats
    rub: Floats


class Placement(NamedTuple):
    """Blocks: x (n, 3) [m] centres · v (n, 6) [m/s, rad/s] · R (n, 3, 3) from the frame of the block."""

    x: Floats
    v: Floats
    R: Floats


class Taken(NamedTuple):
    """What joints took (J,) [J]: damped by their dashpots, rubbed by friction of failed points."""

    damped: Floats
    rubbed: Floats


def in_fours(start: Array, xi_a: Array, xi_b: Array, weight: Array) -> tuple[Array, Array]:
    """`JointPoints.fours` and `first_four` of points that begin at start (J+1,)."""
    count = -(-np.diff(start) // LANES)
    first = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    joint = np.repeat(np.arange(len(count)), count)
    begin = start[joint] + LANES * (np.arange(len(joint)) - first[joint])
    points = np.minimum(begin[:, None] + np.arange(LANES), start[joint + 1][:, None] - 1)
    table = np.concatenate([xi_a, xi_b, weight[:, None]], axis=1)
    return np.ascontiguousarray(table[points].transpose(0, 2, 1)), first[:-1]
