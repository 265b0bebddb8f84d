"""The state of both sides and of their balances before a step, so that the step can be repeated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from coupler.step.sides import CoupledSides
    from yade_scripts.dynamics.state import StructureState


@dataclass(frozen=True, kw_only=True)
class StepStart:
    """The state that `of` stored; `restore` returns to it, bit for bit, any number of times."""

    time: float
    water: dict | None
    structure: StructureState | None
    ledger: dict
    momentum: dict | None

    @classmethod
    def of(cls, coupling: CoupledSides) -> StepStart:
        """Store the present state: references instead of copies where a step replaces the arrays that it changes."""
        water, structure, momentum = coupling.water, coupling.structure, coupling.momentum
        return cls(
            time=coupling.time,
            water=None if water is None else water.snapshot(),
            structure=None if structure is None else structure.save(),
            ledger=dict(vars(coupling.ledger)),
            momentum=None if momentum is None else vars(momentum) | {"lines": dict(momentum.lines)},
        )

    def restore(self, coupling: CoupledSides) -> None:
        """Return both sides and their balances to the start of the step."""
        coupling.time = self.time
        if self.water is not None:
            coupling.water.restore(self.water)
        if self.structure is not None:
            coupling.structure.restore(self.structure)
        vars(coupling.ledger).update(self.ledger)
        if self.momentum is not None:
            vars(coupling.momentum).update(self.momentum | {"lines": dict(self.momentum["lines"])})
