"""The interface that the parts of a coupled step use: the two sides, their balances, and the defects of the last
steps."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from coupler.balance.energy import Ledger
    from coupler.balance.momentum import MomentumLedger
    from coupler.step.residual import Defects
    from fluid.step.water import Water
    from yade_scripts.dynamics.structure import Structure


class CoupledSides(Protocol):
    """Water and structure with the state of their coupling, as `CoupledStepper` has them.

    water, structure: either may be None, as the case has it · time [s] · ledger: of energy · momentum: of momentum ·
    defects: of the last steps."""

    time: float
    water: Water
    structure: Structure
    ledger: Ledger
    momentum: MomentumLedger
    defects: Defects
