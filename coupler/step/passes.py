"""The passes of a coupled step, and their relaxation.

A pass solves for the pressure with assumed velocities of the blocks, V = V_free + A⁻¹ (load), and moves the structure
under its load. If the velocities with which the blocks moved differ too much from the assumed ones, the next pass
starts from the former. Passes may oscillate instead of converging: joints hold while the water assumes that they
yield, and break under the load of water that assumes that they hold. The next pass then starts from the mean of the
two velocities, which is the relaxation of Aitken for passes that alternate (Küttler and Wall 2008,
doi:10.1007/s00466-008-0255-5).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from array_types import Array

if TYPE_CHECKING:
    from coupler.step.pressure_with_structure import CoupledSolution

OSCILLATING = 0.9
"""Share of the defect of the pass before above which passes oscillate instead of converging."""
RELAXED_PASSES = 2
"""Number of further passes in a step whose passes oscillate."""


@dataclass(frozen=True, kw_only=True)
class CouplingPass:
    """One pass: the solution for the pressure, the velocities (n, 6) [m/s, rad/s] that it assumed for the blocks, its
    defect, and whether joints broke in it."""

    solution: CoupledSolution
    assumed: Array
    defect: float
    breaks_joints: bool


class Passes:
    """The passes that a step has made so far, and whether another one follows.

    most: largest number of passes while they converge; RELAXED_PASSES more follow where they oscillate ·
    tolerance: largest defect of a pass that ends the step
    """

    def __init__(self, most: int, tolerance: float) -> None:
        self._most, self._permitted, self._tolerance = most, most, tolerance
        self._defect_before = math.inf
        self._breaking: CouplingPass | None = None
        self._last: CouplingPass | None = None
        self.number = 0

    @property
    def done(self) -> bool:
        """Whether the last pass is within the tolerance, or no further one is permitted."""
        last = self._last
        return last is not None and (last.defect <= self._tolerance or self.number >= self._permitted)

    def add(self, made: CouplingPass) -> None:
        """Take note of the pass that was just made."""
        self.number += 1
        before, self._last = self._last, made
        self._defect_before = math.inf if before is None else before.defect
        if not made.defect <= self._tolerance:
            if made.breaks_joints:
                self._breaking = made
            if self._oscillates():
                self._permitted = self._most + RELAXED_PASSES

    def next_start(self, assumed: Array, moved: Array) -> Array:
        """The velocities (..., 6) [m/s, rad/s] at which the next pass begins, from those that the last one assumed and
        those with which the blocks moved: the latter, or the mean of both where the passes oscillate."""
        return 0.5 * (assumed + moved) if self._oscillates() else moved

    def replacement(self) -> CouplingPass | None:
        """The pass whose load is applied instead of the load of the last one; None: that of the last one is.

        Where the last of the relaxed passes breaks no joint although one before it did, the load of the latter is
        applied, because it acted before anything moved."""
        assert self._last is not None  # a step makes one pass at least
        relaxed = self.number > self._most
        return self._breaking if relaxed and not self._last.breaks_joints else None

    def _oscillates(self) -> bool:
        assert self._last is not None
        holds_again = self._breaking is not None and not self._last.breaks_joints
        return holds_again or self._last.defect > OSCILLATING * self._defect_before
