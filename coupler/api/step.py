"""The record that a callback receives after every step of a run: numbers, and copies of the positions of the blocks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from array_types import Floats
from coupler.step.observe import block_damage, joint_counts


@dataclass(frozen=True, kw_only=True)
class Blocks:
    """The present state of all blocks, including held ones, as copies that later steps do not change.

    names, groups: one text per block · centre (n, 3) [m] · rotation (n, 3, 3), body to world · velocity (n, 6) [m/s
    and
    rad/s] of the centre · force (n, 6) [N and N m] of the water in this step · damage (n,): 0 whole, 1 all joints
    broken
    """

    names: list[str]
    groups: list[str]
    centre: Floats
    rotation: Floats
    velocity: Floats
    force: Floats
    damage: Floats


class Step:
    """One step of a run in progress, in SI units; quantities that a case does not have are zero.

    number: steps so far · time [s] at its end · dt [s] · substeps of YADE · passes: number of pressure solves
    """

    def __init__(
        self, coupling: Any, record: Any, figures: dict[str, Any], readings: dict[str, float | None]
    ):
        self._coupling, self._record = coupling, record
        self.number: int = figures["steps"]
        self.time: float = float(record.time)
        self.dt: float = float(record.dt)
        self.substeps: int = int(record.substeps)
        self.passes: int = int(record.passes)
        self.gauges: dict[str, float | None] = dict(readings)
        """Columns of history/gauges.csv; None where there was nothing to measure."""
        self.figures: dict[str, Any] = dict(figures)
        """Figures of the run so far, as run.json has them at its end."""

    @property
    def joints(self) -> int:
        """Number of intact joints."""
        return 0 if self._coupling.structure is None else joint_counts(self._coupling.structure).intact

    @property
    def joints_broken(self) -> int:
        """Number of joints that have failed so far."""
        return 0 if self._coupling.structure is None else joint_counts(self._coupling.structure).broken

    @property
    def water_volume(self) -> float:
        """Volume of the water [m3]."""
        return 0.0 if self._coupling.water is None else float(self._coupling.water.volume())

    @property
    def water_force(self) -> Floats:
        """Force (3,) [N] of the water on all bodies together, mean over the step."""
        return np.asarray(self._record.load, float)[:, :3].sum(axis=0)

    @property
    def blocks(self) -> Blocks:
        """The state of the blocks. Raises AttributeError in a case without a structure."""
        s = self._coupling.structure
        if s is None:
            raise AttributeError("blocks: this case has no section [structure]")
        load = np.zeros((s.n, 6))
        load[: len(self._record.load)] = self._record.load[: s.n]
        return Blocks(
            names=list(s.names),
            groups=list(s.groups),
            centre=np.array(s.centre()),
            rotation=np.array(s.rotation()),
            velocity=np.array(s.velocity()),
            force=load,
            damage=np.zeros(s.n) if s.joints is None else block_damage(s),
        )

    def __repr__(self) -> str:
        return f"<surgebreak.Step {self.number}, t = {self.time:.6g} s, dt = {self.dt:.3g} s>"
