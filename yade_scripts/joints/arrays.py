"""Arrays for the loops over joints and their points, as kernels take them."""

from __future__ import annotations

from typing import NamedTuple

from array_types import Floats, Ints


class JointPoints(NamedTuple):
    """What never changes of the joints: a, b (J,) rows of the blocks, b = -1 for a fixed point · start (J+1,) first
    point of each; xi_a, xi_b (P, 3) [m] of the points in the blocks · weight (P,) [m²] · normal (J, 2, 3) in block a
    and in b · law (J, 6) · peak: λ/δ_f of the largest traction."""

    a: Ints
    b: Ints
    start: Ints
    xi_a: Floats
    xi_b: Floats
    weight: Floats
    normal: Floats
    law: Floats
    peak: float


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
