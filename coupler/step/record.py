"""What one coupled step did, in numbers: for histories, limits and the verdict."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from array_types import Floats
from coupler.balance.energy import Balance
from coupler.balance.momentum import MomentumBalance

if TYPE_CHECKING:
    from yade_scripts.dynamics.impulses import Impulses


@dataclass(kw_only=True)
class StepRecord:
    """What one step did, for the histories. Absent sides leave zeros."""

    time: float
    dt: float
    iterations: int = 0
    passes: int = 0
    defect: float = 0.0
    substeps: int = 0
    substep: float = 0.0
    opening_rate: float = 0.0
    """Largest v dt_s / d_f of a substep: 1 and more means that a joint opened within one substep."""
    unknowns: int = 0
    bodies_cut: int = 0
    retries: int = 0
    """Times that the step was halved, and dt with it, because it failed or broke a limit."""
    bad: bool = False
    """Whether it stays although it breaks a limit, since shorter ones do so too."""
    wetted: bool = False
    """Whether water touched a body in this step."""
    load: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    shear_load: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    """The part of `load` that walls of bodies take by viscosity and friction."""
    surface_load: Floats = field(default_factory=lambda: np.zeros((0, 6)))
    """The part of `load` that corrects the pressure where the surface passes through the cells of a body, and the
    weight of the films of water beside it (`fluid.pressure.films`)."""
    missed_work: Floats = field(default_factory=lambda: np.zeros(0))
    """Work of the load on each block (n,) [J] that the blocks got less than the water gave."""
    impulses: Impulses | None = None
    """What contacts and joints gave to the blocks; None without a structure."""
    balance: Balance = field(default_factory=Balance)
    momentum: MomentumBalance | None = None
    energies: dict[str, float] = field(default_factory=dict)
    """Of the structure [J], by name (`Structure.energies`); empty without one."""
