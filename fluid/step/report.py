"""What one step of the water did, in numbers."""

from __future__ import annotations

from dataclasses import dataclass

from fluid.pressure.pressure_bound import BoundMet
from fluid.step.momentum import MomentumChange


@dataclass(frozen=True, kw_only=True)
class StepReport:
    """What the last step did.

    volume [m³] of water · volume_error, (volume - conserved) / conserved · reinserted [m³] moved by the last
    shift (signed) · clipped: nodes at the speed limit · unknowns of the pressure · wet_cells: cells with a node in the
    water · work_on_bodies [J] ·
    energy_change [J]: change of kinetic + potential energy by stage (transport and gravity, volume correction,
    pressure, damping and limit) · momentum: what changed it · left [m³], left_energy [J]: through open sides ·
    bound: where the pressure met its lower bound."""

    dt: float
    volume: float
    volume_error: float
    reinserted: float
    clipped: int
    unknowns: int
    wet_cells: int
    work_on_bodies: float
    energy_change: dict[str, float]
    momentum: MomentumChange
    left: float
    left_energy: float
    bound: BoundMet
