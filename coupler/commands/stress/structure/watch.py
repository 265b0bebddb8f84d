"""Energy and positions of a structure, recorded as it moves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from coupler.commands.stress.registry import Measure
from yade_scripts.dynamics.structure import Structure

HELD = ("kinetic", "gravity", "joint_stored", "contact_stored")
TAKEN = ("joint_dissipated", "joint_damping", "dashpot", "friction")
GIVEN = ("load_work", "driving_work")
GAIN, BALANCE = 1e-3, 0.005
"""Shares of the energy in play that a scene may gain, and that its account may miss."""


class Watch:
    """Advances a structure and records the history of its energy. scale [J]: a typical energy

    gain: largest energy above that of the start, less what was put in · drift: largest error of the account [J]
    fastest_opening: largest growth of λ/δ_f in a substep.
    """

    def __init__(self, structure: Structure, scale: float):
        self.structure, self.scale = structure, scale
        self.gain = self.drift = self.fastest_opening = 0.0
        self._start = self._now()

    def _now(self) -> tuple[float, float]:
        """(held less given, with what was taken) [J]"""
        e = self.structure.energies()
        held = sum(e[name] for name in HELD) - sum(e[name] for name in GIVEN)
        return held, held + sum(e[name] for name in TAKEN)

    def advance(self, time: float, looks: int = 50, substep: float | None = None) -> None:
        """Advance by `time` [s], recording `looks` times."""
        for _ in range(looks):
            report = self.structure.advance(time / looks, substep)
            self.fastest_opening = max(self.fastest_opening, report.opening_rate)
            held, whole = self._now()
            self.gain = max(self.gain, held - self._start[0])
            self.drift = max(self.drift, abs(whole - self._start[1]))

    def measures(self, what: str = "", gain: float = GAIN, balance: float = BALANCE) -> Iterator[Measure]:
        """Gain and balance as shares of the energy in play."""
        after = f", {what}" if what else ""
        yield Measure(f"energy gained{after}", self.gain / self.scale, gain)
        yield Measure(f"balance of energy{after}", self.drift / self.scale, balance)


def speed(structure: Structure) -> float:
    """Largest speed of a centre [m/s]."""
    return float(np.linalg.norm(structure.velocity()[:, :3], axis=1).max())


def lowest(structure: Structure) -> float:
    """Height of the lowest corner of any block [m]."""
    return float(corners(structure)[:, 2].min())


def corners(structure: Structure) -> np.ndarray:
    """All corners (k, 3) [m] where they are now."""
    places = zip(structure.centre(), structure.rotation(), structure.shape_vertices)
    return np.concatenate([x + v @ R.T for x, R, v in places])
