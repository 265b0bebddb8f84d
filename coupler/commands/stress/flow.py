"""Limits for scenes with water: volume, energy, and the coupling residual, checked in every step."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from coupler.commands.stress.registry import Measure
from coupler.step.limits import Limits, check_balance, check_defect
from coupler.step.step_limits import energy_advice

ENERGY, VOLUME = 0.02, 1e-3
"""Shares that a scene may miss of the energy put in (both residuals of the ledger, and what the water gained), and of
the volume of the water."""


STOPS = Limits(volume_error=0.02, energy_error=0.05, cpu_seconds=None)
DEFECT = 0.5
"""Largest defect, at which a run of a case stops by default."""


class Flow:
    """Advances a CoupledStepper as a run does, with the same limits, and keeps the largest errors.

    energy: largest error of the ledger · volume: largest error of the volume · fastest [m/s]: fastest water ·
    defect: largest one · retries: steps that were halved · lost: share of the energy put in that the numerics took
    """

    def __init__(self, coupling, limited: bool = True):
        self.coupling, self.limited = coupling, limited
        if limited:
            coupling.limits = STOPS
        self.energy = self.volume = self.fastest = self.defect = self.lost = 0.0
        self.retries = self.steps = 0
        self.record = None

    def run(self, time: float, dt: float | None = None, each=None) -> Flow:
        """Advance by `time` [s] in steps of dt [s], shorter after those that were halved, or in those that the coupling
        chooses; each(record) is called after each step."""
        c = self.coupling
        end = c.time + time
        while c.time < end * (1.0 - 1e-12):
            left = end - c.time
            self.step(c.step_size(left) if dt is None else min(dt * c.defects.share, left))
            if each is not None:
                each(self.record)
        return self

    def step(self, dt: float):
        """One step; its record. Raises Diverged where a run would stop."""
        self.record = record = self.coupling.step(dt)
        water, balance = self.coupling.water, record.balance
        self.steps += 1
        self.retries += record.retries
        self.energy = max(self.energy, balance.energy_error)
        self.volume = max(self.volume, abs(water.volume_error()))
        self.fastest = max(self.fastest, water.fastest())
        self.defect = max(self.defect, record.defect)
        self.lost = balance.numerical_dissipation / max(balance.input_energy, 1e-300)
        if self.limited:
            check_balance(
                record.time,
                water.volume_error(),
                balance.energy_error,
                STOPS,
                partial(energy_advice, self.coupling, record),
            )
            check_defect(record.time, self.coupling.defects.mean, DEFECT)
        return record

    def measures(self, what: str = "", energy: float | None = ENERGY) -> Iterator[Measure]:
        """Measures of energy, volume and passes."""
        after = f", {what}" if what else ""
        yield Measure(f"error of the energy{after}", self.energy, energy)
        yield Measure(f"error of the volume{after}", self.volume, VOLUME)
        if self.coupling.coupled:
            yield Measure(f"largest defect{after}", self.defect, None)
            yield Measure(f"steps halved{after}", float(self.retries), None)

    def at_rest(self, scale: float, what: str = "", limit: float = 1e-6) -> Iterator[Measure]:
        """Measures of water that should stay at rest: its largest speed over scale [m/s], and its volume."""
        after = f", {what}" if what else ""
        yield Measure(f"fastest water / sqrt(g h){after}", self.fastest / scale, limit)
        yield Measure(f"error of the volume{after}", self.volume, VOLUME)


def speed(structure) -> float:
    """Largest speed of a centre [m/s]."""
    return float(np.linalg.norm(structure.velocity()[:, :3], axis=1).max())
