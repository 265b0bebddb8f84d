"""The ledger: energy over water, interface and structure, and the volume of the water.

Structure:  Δ(kinetic + gravity + joints stored + contacts stored) + dissipated = W_received        residual r_s
Interface:  W_given − W_received = r_i,  W_given = Σ dt F·V with the velocities V of the pressure solve,
            W_received = work of the same loads over the motion that the discrete elements made
Water:      Δ(kinetic + potential) + W_given + D_shear + D_vapour + D = E_sides − E_left
            D_vapour: spent on parting water from its vapour, whose pressure lies below that of the air;
            D_shear: taken by viscosity and by friction of walls; D: what is missing, the dissipation of the numerics;
            E_sides: energy of the water that came in through inflows and seas, with the work of its pressure;
            E_left: energy of the water that fell out through open sides

A scheme that gains energy shows D < 0; dissipation D > 0 is damping of the water by the numerics and is reported, not
counted as an error. The energy error is (|r_s| + |r_i| + max(0, −D − E_left)) / E_in: the head of water at an open
side is not that of the water which the volume correction then takes off, within five cells of the side, so a gain is
told from an outflow only beyond it. E_in is the energy that the scene puts in: the potential energy of the water
above its level state and what inflows and seas can bring, the potential energy the blocks give up, kinetic energy, or
work of imposed motions, whichever is the largest so far.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

STORED = ("kinetic", "gravity", "joint_stored", "contact_stored")
DISSIPATED = ("joint_dissipated", "joint_damping", "dashpot", "friction")


NEGLIGIBLE = 1e-6
"""Share of the energy that water and blocks hold at the start below which nothing counts as put in."""


@dataclass(frozen=True)
class Balance:
    """One line of the ledger, all in joules but the last, a share of the input energy."""

    water_kinetic: float = 0.0
    water_potential: float = 0.0
    numerical_dissipation: float = 0.0
    shear_dissipation: float = 0.0
    parting_work: float = 0.0
    entered: float = 0.0
    left: float = 0.0
    work_given: float = 0.0
    work_received: float = 0.0
    structure_residual: float = 0.0
    input_energy: float = 0.0
    energy_error: float = 0.0
    step_error: float = 0.0
    """What the last step alone put out of balance, over the input energy."""

    @property
    def interface_residual(self) -> float:
        return self.work_given - self.work_received


@dataclass
class Ledger:
    """Accumulates the balances of a run. Either side may be absent (None)."""

    available: float = 0.0
    """Potential energy of the water above its level state at the start, and what inflows and seas can bring [J]."""
    work_given: float = 0.0
    entered: float = 0.0
    """Energy that came with water through inflows and seas so far, less what left there [J]."""
    left: float = 0.0
    """Energy of the water that fell out through open sides so far [J]."""
    shear: float = 0.0
    """Energy that viscosity and friction of walls took out of the water so far [J]."""
    parting: float = 0.0
    """Energy spent so far on parting water from its vapour [J]."""
    _water_start: tuple[float, float] | None = None
    _structure_start: float | None = None
    _input: float = field(default=0.0)
    _before: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Residuals of structure and interface, and what the water lost beyond the outflow, at the last balance [J]."""

    def start(self, water: tuple[float, float] | None, structure: dict[str, float] | None) -> None:
        """Fix the reference state: water (kinetic, potential) [J], structure energies by name [J]."""
        self._water_start = water
        self._structure_start = None if structure is None else _structure_total(structure)
        self._gravity_start = None if structure is None else structure["gravity"]
        # a scene at perfect rest puts nothing in: then a small part of what it holds is the scale
        held = abs(sum(water or (0.0,))) + abs(self._gravity_start or 0.0)
        self._input = max(self.available, NEGLIGIBLE * held)

    def save(self) -> dict[str, np.ndarray]:
        """Everything that it holds, by name."""
        return {name: np.array(value) for name, value in vars(self).items() if value is not None}

    def restore(self, saved: dict[str, np.ndarray]) -> None:
        """Back to what was saved."""
        for name, array in saved.items():
            value = array.tolist()
            setattr(self, name, tuple(value) if isinstance(value, list) else value)

    @property
    def input_energy(self) -> float:
        """What the scene has put in so far [J], the scale of every error."""
        return self._input

    def give(self, work: float) -> None:
        """Add the work that the water gave to the bodies in a step [J]."""
        self.work_given += work

    def balance(self, water: tuple[float, float] | None, structure: dict[str, float] | None) -> Balance:
        """The ledger now."""
        kinetic, potential = water or (0.0, 0.0)
        dissipation = 0.0
        if water is not None:
            change = kinetic + potential - sum(self._water_start)
            taken = self.work_given + self.shear + self.parting
            dissipation = self.entered - self.left - change - taken
        received = residual = 0.0
        if structure is not None:
            received = structure["load_work"]
            driven = structure["driving_work"]
            residual = _structure_total(structure) - self._structure_start - received - driven
            released = self._gravity_start - structure["gravity"]
            self._input = max(self._input, abs(released), structure["kinetic"], abs(driven))
        self._input = max(self._input, kinetic, abs(self.work_given), abs(self.entered))
        interface = self.work_given - received if water is not None and structure is not None else 0.0
        now = (residual, interface, dissipation + self.left)
        share, step = (self._share(*rows) for rows in (now, np.subtract(now, self._before).tolist()))
        self._before = now
        return Balance(
            kinetic,
            potential,
            dissipation,
            self.shear,
            self.parting,
            self.entered,
            self.left,
            self.work_given,
            received,
            residual,
            self._input,
            share,
            step,
        )

    def _share(self, structure: float, interface: float, lost: float) -> float:
        """Residuals of structure and interface and what the water lost [J] → the error over the input energy."""
        error = abs(structure) + max(0.0, -lost) + abs(interface)
        return error / self._input if self._input > 0.0 else 0.0


def _structure_total(energies: dict[str, float]) -> float:
    return sum(energies[name] for name in STORED + DISSIPATED)
