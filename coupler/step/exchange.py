"""The exchange between water and structure within a step.

Pressure with the structure inside → YADE substeps under its load → how far the blocks moved otherwise than the pressure
solve assumed, and once more from the pressure where that is too much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from array_types import Array
from coupler.step.coupling_rows import Wetting
from coupler.step.observe import joint_counts
from coupler.step.passes import CouplingPass, Passes
from coupler.step.pressure_with_structure import (
    CoupledSolution,
    StructureResponse,
    corrected_free_velocity,
    defect,
    defect_floor,
    impulse_energy,
    mass_matrix,
    solve_coupled,
    start_of_water,
)
from coupler.step.record import StepRecord
from coupler.step.step_start import StepStart
from fluid.numerics.bounded import solve_bounded
from fluid.pressure.waterline import hydrostatic_stiffness

if TYPE_CHECKING:
    from coupler.step.immersion import Immersion
    from fluid.pressure.projection import PressureProblem
    from fluid.step.water import Water
    from yade_scripts.dynamics.structure import AdvanceReport, Structure


class Exchange:
    """The exchange of one scene, which keeps nothing between two steps.

    rtol: of the pressure · clock: as in `CoupledStepper` · pause: called before each pressure solve; it ends the run by
    raising an exception."""

    def __init__(
        self,
        water: Water,
        structure: Structure,
        immersion: Immersion,
        *,
        rtol: float,
        clock: Callable[[str], AbstractContextManager[None]],
        pause: Callable[[], None],
    ) -> None:
        self.water, self.structure, self.immersion = water, structure, immersion
        self.rtol, self.clock, self.pause = rtol, clock, pause

    def take(
        self,
        problem: PressureProblem,
        record: StepRecord,
        start: StepStart | None,
        *,
        now: float,
        most: int,
        tolerance: float,
        energy: float,
    ) -> tuple[CoupledSolution, Array, Array]:
        """Solve for the pressure with the structure inside and move the structure under it, as often as the passes
        permit; once if no block is wetted.

        record: of the step, told what the passes took · start: the state to which the structure returns between them ·
        now [s]: time at the start of the step · most: passes · tolerance: residual above which a further one is made ·
        energy [J]: put in so far, a scale for the residual.
        Returns the solution, and the mean velocities (n, 6) with which the blocks moved and were assumed to move.
        Raises NotConverged, or NotFinite of the structure."""
        structure, solve = self.structure, partial(solve_bounded, kept=[])
        with self.clock("structure in pressure"):
            problem, afloat = self._afloat(problem)
            mass, response, v_free = self._response(problem, now, afloat)
            wetting = Wetting.of(problem.coupling)
        record.wetted = problem.coupling.nnz > 0
        before, free = self.padded(structure.velocity()), ~structure.still
        found, water_from = None, before
        whole = self._joints_broken()
        passes = Passes(most if record.wetted else 1, tolerance)
        while not passes.done:
            self.pause()
            with self.clock("pressure"):
                found = solve_coupled(problem, response, v_free, solve, self.rtol, found, wetting)
            report = self._advance(problem.dt, found, start if passes.number > 0 else None)
            record.iterations += found.iterations
            record.substeps += report.substeps
            lead = response.lead(found.velocity, water_from, report.dt_s)
            assumed = (found.velocity - lead)[: structure.n]
            if record.wetted:
                floor = self._defect_floor(found.load, problem.dt, free, energy)
                record.defect = defect(mass, assumed, report.mean_velocity, floor)
            breaks = self._joints_broken() != whole
            passes.add(
                CouplingPass(solution=found, assumed=assumed, defect=record.defect, breaks_joints=breaks)
            )
            if not passes.done:
                moved = passes.next_start(self.padded(assumed), self.padded(report.mean_velocity))
                response = self._answer(mass, now, problem.dt, before, afloat)
                water_from = start_of_water(response.mass, before, self.water.pushed_by, moved)
                after = response.at_end(moved, water_from, report.dt_s)
                v_free = corrected_free_velocity(response, after, found.x, problem.coupling)
        record.passes = passes.number
        assert found is not None  # there is one pass at least
        instead = passes.replacement()
        if instead is not None:
            found, assumed, record.defect = instead.solution, instead.assumed, instead.defect
            report = self._advance(problem.dt, found, start)
            record.substeps += report.substeps
        record.substep, record.opening_rate = report.dt_s, report.opening_rate
        record.impulses = report.impulses
        return found, report.mean_velocity, assumed

    def _defect_floor(self, load: Array, dt: float, free: Array, energy: float) -> float:
        """`defect_floor` of the blocks that water touches, under its load (n_bodies, 6) and their weight over dt [s].

        free (n,) bool: blocks that could move at the start of the step. Blocks that fall asleep in it count as well:
        the pressure solve assumed that they answer to the load."""
        structure, load = self.structure, load[: self.structure.n]
        touched = free & load.any(axis=1)
        mass, inertia = structure.mass[touched], structure.inertia()[touched]
        forces = load[touched], structure.weight_now()[touched]
        impulse = sum(impulse_energy(mass, inertia, force, dt) for force in forces)
        return defect_floor(impulse, energy)

    def _joints_broken(self) -> int:
        return 0 if self.structure.joints is None else joint_counts(self.structure).broken

    def _advance(self, dt: float, found: CoupledSolution, start: StepStart | None) -> AdvanceReport:
        """Advance the structure by dt [s] under the load of a solution; start: the state to which it returns before."""
        with self.clock("structure"):
            if start is not None and start.structure is not None:
                self.structure.restore(start.structure)
            self.structure.set_load(found.load[: self.structure.n])
            return self.structure.advance(dt)

    def _response(
        self, problem: PressureProblem, now: float, afloat: Array | None
    ) -> tuple[sp.csr_array, StructureResponse, Array]:
        """Mass of the blocks, the response of all bodies to forces, and V_free of the first pass."""
        structure = self.structure
        mass = mass_matrix(structure.mass, structure.inertia())
        velocity = self.padded(structure.velocity())
        response = self._answer(mass, now, problem.dt, velocity, afloat)
        known = problem.load(0.0)
        force = structure.weight_now() + structure.internal_force()
        return mass, response, response.free_velocity(velocity, self.padded(force) + known)

    def _answer(
        self, mass: sp.csr_array, now: float, dt: float, driven_velocity: Array, afloat: Array | None
    ) -> StructureResponse:
        """The response of all bodies to forces, with the springs of the present joints and contacts."""
        structure = self.structure
        of_bodies, stiffness, damping = self._with_solids(mass, *structure.tangent())
        driven_velocity, driven_lead = self._prescribed(driven_velocity, now, dt)
        return StructureResponse(
            mass=of_bodies,
            stiffness=stiffness,
            damping=damping,
            dt=dt,
            driven=np.append(structure.still, np.ones(self.immersion.n_solids, bool)),
            driven_velocity=driven_velocity,
            driven_lead=driven_lead,
            afloat=afloat,
            substep=0.0 if afloat is None else dt / structure.count_substeps(dt),
        )

    def _prescribed(self, velocity: Array, now: float, dt: float) -> tuple[Array, Array | None]:
        """velocity (n, 6) with that at the end of the step, at now + dt [s], for blocks that are told a motion over
        time, and how much more (n, 6) that is than their mean over the step; None where no block is."""
        if not self.structure.prescribed:
            return velocity, None
        velocity, lead = velocity.copy(), np.zeros_like(velocity)
        for row, motion in self.structure.prescribed.items():
            velocity[row, :3] = motion.velocity(now + dt)
            lead[row, :3] = velocity[row, :3] - motion.mean_velocity(now, dt)
        return velocity, lead

    def _afloat(self, problem: PressureProblem) -> tuple[PressureProblem, Array | None]:
        """The problem with the bodies at their present positions instead of those where the cells were cut, and the
        hydrostatic stiffness (n, 3, 3) of the free bodies that the surface cuts; None if there are none."""
        driven = np.append(self.structure.still, np.ones(self.immersion.n_solids, bool))
        stiffness = hydrostatic_stiffness(self.water, problem.predicted.level_set, ~driven)
        if stiffness is None:
            return problem, None
        load = problem.other_load.copy()
        load[:, 2:5] -= np.einsum("nij,nj->ni", stiffness, self.water.moved_on[:, 2:5])
        return replace(problem, other_load=load), stiffness

    def padded(self, values: Array) -> Array:
        """Rows of zeros appended for the fixed solids: (n, 6) → (n + m, 6)."""
        return np.concatenate([values, np.zeros((self.immersion.n_solids, 6))])

    def _with_solids(self, *matrices: sp.csr_array) -> Sequence[sp.csr_array]:
        """Sparse (6n, 6n) matrices with empty rows for the fixed solids."""
        size = 6 * self.immersion.n_solids
        if size == 0:
            return matrices
        empty = sp.csr_array((size, size))
        return tuple(sp.block_diag([m, empty], format="csr") for m in matrices)
