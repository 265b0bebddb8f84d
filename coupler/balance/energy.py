"""The energy balance of water, interface and structure.

Structure:  Δ(kinetic + gravity + joints stored + contacts stored) + dissipated = W_received        residual r_s
Interface:  W_given − W_received = r_i,  W_given = Σ dt F·V with the velocities V of the pressure solve,
            W_received = work of the same loads over the motion that the discrete elements made
Water:      Δ(kinetic + potential) + W_given + D_shear + D_vapour + D = E_sides − E_left
            U_air: recoverable energy of trapped air, and the part lost with air that escaped;
            D_vapour: work to separate water against its vapour pressure, which is below that of the air;
            D_shear: dissipated by viscosity and by friction of walls; D: the remainder, the numerical dissipation;
            E_sides: energy of the water that came in through inflows and seas, with the work of its pressure;
            E_left: energy of the water that fell out through open sides

A scheme that gains energy shows D < 0; dissipation D > 0 is numerical damping of the water and is reported, not
counted as an error. The energy error is (|r_s| + |r_i| + max(0, −D − E_left)) / E_in: the head of water at an open
side is not that of the water which the volume correction then takes off, within five cells of the side, so a gain is
distinguished from an outflow only beyond it. E_in is the energy that the scene puts in, whichever is the largest so
far: the potential energy of the water above its level state and what inflows and seas can bring, the potential energy
that water and blocks have given up together, kinetic energy, or work of imposed motions. Energy that a floating body
exchanges with the water is not in it, so the error of a small oscillation is relative to the energy of that
oscillation."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from array_types import Array

STORED = ("kinetic", "gravity", "joint_stored", "contact_stored")
DISSIPATED = ("joint_dissipated", "joint_damping", "dashpot", "friction")


NEGLIGIBLE = 1e-5
"""Share of the energy that water and blocks hold at the start below which no energy counts as input: the volume of the
water is corrected to 1e-6, which changes the energy by 5 % of this (a floating box in a tank)."""


@dataclass(frozen=True, kw_only=True)
class Balance:
    """The balance at one time: energies [J], and the two errors as fractions of the input energy."""

    water_kinetic: float = 0.0
    water_potential: float = 0.0
    numerical_dissipation: float = 0.0
    shear_dissipation: float = 0.0
    parting_work: float = 0.0
    air_energy: float = 0.0
    entered: float = 0.0
    left: float = 0.0
    work_given: float = 0.0
    work_received: float = 0.0
    structure_residual: float = 0.0
    input_energy: float = 0.0
    energy_error: float = 0.0
    step_error: float = 0.0
    """The error of the last step alone over the input energy."""

    @property
    def interface_residual(self) -> float:
        """Work that the water gave less what the blocks received [J] so far."""
        return self.work_given - self.work_received


@dataclass
class Ledger:
    """Accumulates the energy balance of a run. Either side may be absent (None)."""

    available: float = 0.0
    """Potential energy of the water above its level state at the start [J]."""
    coming: float = 0.0
    """The largest energy that inflows and seas could have brought so far [J]."""
    work_given: float = 0.0
    behind: float = 0.0
    """The part of it that the blocks receive half a substep later [J]."""
    entered: float = 0.0
    """Net energy that has entered through inflows and seas so far [J]."""
    left: float = 0.0
    """Energy of the water that fell out through open sides so far [J]."""
    shear: float = 0.0
    """Energy dissipated so far by viscosity and wall friction [J]."""
    air: float = 0.0
    """Recoverable energy of trapped air, and the energy that it has lost so far [J]."""
    parting: float = 0.0
    """Work done so far against the vapour pressure where water separates [J]."""
    _water_start: tuple[float, float] | None = None
    _structure_start: float | None = None
    _potential_start: float = 0.0
    _input: float = field(default=0.0)
    _before: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Residuals of structure and interface, and numerical dissipation plus outflow of the water, at the last balance
    [J]."""

    def start(self, water: tuple[float, float] | None, structure: dict[str, float] | None) -> None:
        """Fix the reference state: water (kinetic, potential) [J], structure energies by name [J]."""
        self._water_start = water
        self._structure_start = None if structure is None else _structure_total(structure)
        gravity = 0.0 if structure is None else structure["gravity"]
        self._potential_start = gravity + (0.0 if water is None else water[1])
        # a scene at perfect rest puts nothing in: then a small part of what it holds is the scale
        held = abs(sum(water or (0.0,))) + abs(gravity)
        thrown = 0.0 if structure is None else structure["kinetic"]
        self._input = max(self.available + self.coming, thrown, NEGLIGIBLE * held)

    def save(self) -> dict[str, Array]:
        """The state of the balance, by name."""
        return {name: np.array(value) for name, value in vars(self).items() if value is not None}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        for name, array in saved.items():
            value = array.tolist()
            setattr(self, name, tuple(value) if isinstance(value, list) else value)

    @property
    def input_energy(self) -> float:
        """The energy that the scene has put in so far [J], the scale of every error."""
        return self._input

    def give(self, work: float, behind: float = 0.0) -> None:
        """Add the work that the water gave to the bodies in a step [J]; behind: the part of it in the half substep
        by which the kinetic energy of the blocks and the work on them lag behind their positions."""
        self.work_given += work
        self.behind += behind

    def balance(self, water: tuple[float, float] | None, structure: dict[str, float] | None) -> Balance:
        """The balance with the present energies: water (kinetic, potential) [J], structure energies by name [J]."""
        kinetic, potential = water or (0.0, 0.0)
        dissipation, potential_now = 0.0, potential
        if water is not None and self._water_start is not None:
            change = kinetic + potential - sum(self._water_start)
            taken = self.work_given + self.shear + self.parting + self.air
            dissipation = self.entered - self.left - change - taken
        received = residual = 0.0
        if structure is not None and self._structure_start is not None:
            received = structure["load_work"] + self.behind
            driven = structure["driving_work"]
            residual = _structure_total(structure) - self._structure_start - structure["load_work"] - driven
            self._input = max(self._input, structure["kinetic"], abs(driven))
            potential_now = potential + structure["gravity"]
        released = self._potential_start - potential_now
        self._input = max(self._input, self.available + self.coming)
        self._input = max(self._input, abs(released), kinetic, abs(self.entered), abs(self.air))
        interface = self.work_given - received if water is not None and structure is not None else 0.0
        now = (residual, interface, dissipation + self.left)
        share, step = (self._share(*rows) for rows in (now, np.subtract(now, self._before).tolist()))
        self._before = now
        return Balance(
            water_kinetic=kinetic,
            water_potential=potential,
            numerical_dissipation=dissipation,
            shear_dissipation=self.shear,
            parting_work=self.parting,
            air_energy=self.air,
            entered=self.entered,
            left=self.left,
            work_given=self.work_given,
            work_received=received,
            structure_residual=residual,
            input_energy=self._input,
            energy_error=share,
            step_error=step,
        )

    def _share(self, structure: float, interface: float, lost: float) -> float:
        """The error over the input energy, from the residuals of structure and interface and the loss of the water
        [J]."""
        error = abs(structure) + max(0.0, -lost) + abs(interface)
        return error / self._input if self._input > 0.0 else 0.0


def _structure_total(energies: dict[str, float]) -> float:
    return sum(energies[name] for name in STORED + DISSIPATED)
