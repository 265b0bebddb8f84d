"""The coupled step.

Cut → advect → pressure with the structure inside → YADE substeps → coupling residual, and once more from the pressure
where it is too large → correct → balances of energy and momentum.
A scene may lack either side: without water the structure runs alone, without a structure the water does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from typing import TYPE_CHECKING, cast

import numpy as np

from array_types import Array
from coupler.balance.energy import Ledger
from coupler.balance.momentum import add_step, momentum_ledger
from coupler.step.limits import Diverged, Limits, check_finite, check_pressure, no_room, pressure_to_start
from coupler.step.observe import fastest_points
from coupler.step.record import StepRecord
from coupler.step.residual import RETRIES, Defects
from coupler.step.step_limits import Attempt, attempt_of, attempt_to_keep, volume_error
from coupler.step.step_start import StepStart

if TYPE_CHECKING:
    from coupler.step.exchange import Exchange
    from coupler.step.immersion import Immersion
    from fluid.pressure.projection import PressureProblem
    from fluid.step.water import Water
    from yade_scripts.dynamics.structure import Structure


BLOCK_COURANT = 0.5
"""Share of a cell that the fastest block may cross in one step: its cells are cut once a step."""


class CoupledStepper:
    """The two sides and the state of their coupling; `step` advances both.

    water, structure, immersion: either side may be None (immersion only with water).
    rtol: relative tolerance of the pressure solve · step_max [s]: longest step · clock: a context manager by the name
    of a part, which counts its processor time (`coupler/run/clock.py`).
    passes: largest number of pressure solves in a step; after the first, the structure returns to the start of the step
    and takes it again as long as the defect is above `tolerance`.
    most_defect, limits: if a step exceeds a share of the first (`Defects`) or one of the others (`step_limits.py`), or
    if the pressure solver fails, both sides return to its start and take half of the step; without limits only results
    that are not finite count.
    coming: energy [J] that inflows and seas can bring by a time [s], a scale for errors; None: there are none.
    """

    def __init__(
        self,
        water: Water | None,
        structure: Structure | None,
        immersion: Immersion | None,
        *,
        rtol: float,
        step_max: float,
        clock: Callable[[str], AbstractContextManager[None]],
        passes: int = 1,
        tolerance: float = 0.02,
        most_defect: float = 0.5,
        limits: Limits | None = None,
        coming: Callable[[float], float] | None = None,
    ) -> None:
        self.passes, self.tolerance = passes, tolerance
        self.pause: Callable[[], None] | None = None
        """Called between the parts of a step; it ends the run by raising an exception."""
        self.defects = Defects(most_defect)
        self.limits = limits
        # None where the scene lacks that side; what needs one is called only where there is one.
        self.water, self.structure = cast("Water", water), cast("Structure", structure)
        self.immersion = cast("Immersion", immersion)
        self.rtol, self.step_max, self.clock = rtol, step_max, clock
        self.radius = np.zeros(0)
        if structure is not None:
            self.radius = np.array([np.linalg.norm(v, axis=1).max() for v in self.structure.shape_vertices])
        self.time = 0.0
        self.exchange = cast("Exchange", None)
        if self.coupled:
            from coupler.step.exchange import Exchange

            self.exchange = Exchange(
                self.water, self.structure, self.immersion, rtol=rtol, clock=clock, pause=self._pause
            )
        self.sheared = None
        if self.coupled and self.water.viscous is not None and self.water.parameters.walls == "no-slip":
            from coupler.step.shear import ShearedBlocks

            self.sheared = ShearedBlocks(self.structure, self.immersion.n_solids)
        self.ledger = Ledger()
        if self.coupled:
            self.water.leave_films_out(*self.immersion.films())
        if water is not None:
            self.ledger.available = water.available_energy()
        self._coming = coming
        self._look_ahead()
        self.ledger.start(self._water_energy(), self._structure_energies())
        self.momentum = momentum_ledger(water, structure)

    def save(self) -> dict[str, Array]:
        """The state of the coupling itself between two steps; both sides and the ledger save their own."""
        found = {"time": np.array(self.time), **self.defects.save()}
        if self.sheared is not None:
            found["sheared"] = self.sheared.accelerations.copy()
        return found

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        self.time = float(saved["time"])
        self.defects.restore(saved)
        if self.sheared is not None:
            self.sheared.accelerations = saved["sheared"].copy()

    @property
    def coupled(self) -> bool:
        """Whether there are both water and structure."""
        return self.water is not None and self.structure is not None

    def step_size(self, remaining: float) -> float:
        """The largest step [s] that water, blocks and the case allow, dividing `remaining` evenly."""
        dt = self.step_max
        if self.water is not None:
            dt = min(dt, self.water.stable_step())
        if self.coupled:
            speed = fastest_points(self.structure.velocity(), self.radius)
            for row, motion in self.structure.prescribed.items():
                speed[row] = max(speed[row], motion.fastest(self.time, self.time + dt))
            if speed.any():
                way = BLOCK_COURANT * self.immersion.cell_sizes()
                dt = min(dt, float((way / np.maximum(speed, 1e-300)).min()))
        dt *= self.defects.share
        return remaining / max(1, math.ceil(remaining / dt * (1.0 - 1e-9)))

    def step(self, dt: float) -> StepRecord:
        """Advance both sides by dt [s], or by the half of it, its half, ... where a whole one fails: `record.dt`.

        Raises Diverged, or the error of the pressure solver, if that does not help either."""
        record = StepRecord(time=self.time + dt, dt=dt)
        if self.water is None:
            self._take(record, None)
            return record
        if self.coupled:
            self._cut(record)
            before = self.structure.velocity()
        self._take_until_good(dt, record)
        if self.sheared is not None:
            self.sheared.note(before, record.shear_load[: self.structure.n], record.dt)
        self.defects.note(self.time, record)
        return record

    def _take_until_good(self, dt: float, record: StepRecord) -> None:
        """Take a step of dt [s], or of its half, and so on, as long as it has no solution or breaks a limit. If the
        shortest one breaks a limit too, the better of it and the longest is kept (`attempt_to_keep`); the caller
        decides whether the run ends there.

        Raises Diverged if none has a solution."""
        start, volume = self._start(), volume_error(self)
        tried: list[Attempt] = []
        for record.retries in range(RETRIES + 1):
            record.dt = dt / 2**record.retries
            try:
                self._take(record, start)
            except self._failures() as error:
                if record.retries == RETRIES and not tried:
                    raise _no_solution(self.time, error, record.dt) from error
            else:
                attempt = self._judge(record, volume)
                if not attempt.broken:
                    return
                tried.append(attempt)
                if record.retries >= self.defects.halvings:
                    break
            start.restore(self)
        record.bad = True
        self._keep(attempt_to_keep(tried), tried[-1], dt, record, start)

    def _keep(self, best: Attempt, last: Attempt, dt: float, record: StepRecord, start: StepStart) -> None:
        """Repeat the best attempt, unless both sides are already in its state."""
        if best is last and record.retries == last.retries:
            return
        start.restore(self)
        record.retries = best.retries
        record.dt = dt / 2**best.retries
        self._take(record, start)

    def _start(self) -> StepStart:
        with self.clock("water" if self.structure is None else "structure"):
            return StepStart.of(self)

    def _failures(self) -> tuple:
        """Exceptions of a step that a shorter step may avoid."""
        from fluid.numerics.solve import NotConverged

        if self.structure is None:
            return Diverged, NotConverged
        from yade_scripts.dynamics.structure import NotFinite

        return Diverged, NotConverged, NotFinite

    def _judge(self, record: StepRecord, volume_before: float) -> Attempt:
        """The limits that the last step breaks."""
        return attempt_of(self, record, self.limits, volume_before)

    def _take(self, record: StepRecord, start: StepStart | None) -> None:
        """Take one step of record.dt on both sides and in the balances. Raises the errors of the solvers, and
        Diverged."""
        dt = record.dt
        if self.coupled:
            self._coupled_step(dt, record, start)
        elif self.water is not None:
            self._water_step(dt, record)
        else:
            self._structure_step(dt, record)
        self.time += dt
        record.time = self.time
        self._check_finite(dt)
        if self.water is not None and self.water.sides is not None:
            self.ledger.entered = self.water.energy_through_sides()
        if self.water is not None:
            self.ledger.air = self.water.air_energy()
        self._look_ahead()
        energies = self._structure_energies()
        record.energies = energies or {}
        record.balance = self.ledger.balance(self._water_energy(), energies)
        record.momentum = add_step(
            self.momentum, self.water, self.structure, dt, record.load, record.impulses
        )

    def _look_ahead(self) -> None:
        """Update the largest energy that inflows and seas could have brought so far."""
        if self._coming is not None:
            self.ledger.coming = max(self.ledger.coming, self._coming(self.time))

    def _cut(self, record: StepRecord) -> None:
        """Update the domain outside of the bodies at their present positions, and their other effects on the water."""
        with self.clock("cut"):
            changed = self.immersion.update()
        with self.clock("carry over"):
            if changed:
                self.water.move_solids(self.immersion.domain)
            if self.water.slits is not None:
                self.water.set_cracks(self.immersion.cracks.cracks())
            record.bodies_cut = self.immersion.cut_again
            self.water.set_films(*self.immersion.films())
            self.water.moved_on = self.immersion.moved_on()
        if self.water.viscous is not None:
            self.water.body_velocity = self.exchange.padded(self.structure.velocity())
        if self.sheared is not None:
            self.water.free_bodies = self.sheared.now()

    def _coupled_step(self, dt: float, record: StepRecord, start: StepStart | None) -> None:
        n, before = self.structure.n, self.structure.velocity()
        with self.clock("water"):
            problem = self.water.predict(dt)
        with self._with_place(problem):
            found, moved, assumed = self.exchange.take(
                problem,
                record,
                start,
                now=self.time,
                most=self.passes,
                tolerance=self.tolerance,
                energy=self.ledger.input_energy,
            )
        self.water.farther = dt * (self.exchange.padded(moved) - self.water.pushed_by)
        self.water.moved_by_end = self.water.moved_on + dt * self.exchange.padded(moved)
        self.water.pushed_by = found.velocity
        with self.clock("water"):
            self.water.correct(found.problem, found.x, found.parting)
        record.load, record.unknowns = found.load, len(found.x)
        given = found.load[:n] * assumed
        gained = (self.structure.velocity() - before)[~self.structure.fixed]
        behind = 0.5 * record.substep * float(np.sum(found.load[:n][~self.structure.fixed] * gained))
        self.ledger.give(dt * float(np.sum(given)), behind)
        record.missed_work = dt * np.sum(given - found.load[:n] * moved, axis=1)
        self._note_loads(found.problem, record, self.exchange.padded(assumed))

    def _note_loads(self, problem: PressureProblem, record: StepRecord, velocity: Array) -> None:
        """Record the parts of the load and the energy that shear and outflow take from the water; velocity (n_bodies,
        6) of the bodies."""
        shear = problem.predicted.shear
        record.shear_load = np.zeros_like(record.load) if shear is None else shear.load
        record.surface_load = problem.other_load - record.shear_load
        if shear is not None:
            self.ledger.shear -= shear.energy + record.dt * float(np.sum(shear.load * velocity))
        report = self.water.report
        assert report is not None  # the water has just been corrected
        self.ledger.left += report.left_energy
        self.ledger.parting += report.bound.work

    def _pause(self) -> None:
        if self.pause is not None:
            self.pause()

    def _water_step(self, dt: float, record: StepRecord) -> None:
        from fluid.numerics.bounded import solve_pressure

        with self.clock("water"):
            problem = self.water.predict(dt)
        self._pause()
        with self.clock("pressure"), self._with_place(problem):
            result = solve_pressure(problem, self.rtol)
        with self.clock("water"):
            problem = problem.with_waterline_of(result.x)
            self.water.correct(problem, result.x, result.parting)
        record.load = problem.load(result.x)
        record.iterations += result.iterations
        record.passes, record.unknowns = 1, len(result.x)
        self._note_loads(problem, record, self.water.body_velocity)

    def _structure_step(self, dt: float, record: StepRecord) -> None:
        with self.clock("structure"):
            report = self.structure.advance(dt)
        record.substeps += report.substeps
        record.substep = report.dt_s
        record.opening_rate, record.impulses = report.opening_rate, report.impulses

    def _water_energy(self) -> tuple[float, float] | None:
        if self.water is None:
            return None
        return self.water.kinetic_energy(), self.water.potential_energy()

    def _structure_energies(self) -> dict[str, float] | None:
        return None if self.structure is None else self.structure.energies()

    def _driven_by(self) -> tuple[bool, bool, bool]:
        """Whether blocks move, driven or free, whether water enters through sides, and whether narrow openings are
        closed."""
        moves = self.structure is not None and any(not block.fixed for block in self.structure.blocks)
        connection = None
        if self.immersion is not None:
            connection = self.immersion.connection
        return moves, self.water.sides is not None, connection is not None and connection.face > 0.0

    @contextmanager
    def _with_place(self, problem: PressureProblem) -> Iterator[None]:
        """Add the place and the possible cause to the error of a pressure solve that fails."""
        from fluid.numerics.solve import NotConverged

        try:
            yield
        except NotConverged as error:
            if error.unknown is None:
                raise
            place = self.water.topology.nodes[problem.dofs[error.unknown]]
            text = f"{error} {no_room(place, *self._driven_by())}"
            raise NotConverged(text, error.history, error.unknown) from error

    def _check_finite(self, dt: float) -> None:
        if self.water is not None:
            check_finite(self.time, "the velocity of the water", self.water.velocity, "node")
            pressure, nodes = self.water.pressure, self.water.topology.nodes
            to_start = partial(pressure_to_start, self.water, dt)
            check_pressure(self.time, pressure, nodes, self._driven_by(), to_start)
        if self.structure is not None:
            check_finite(self.time, "the velocity of the structure", self.structure.velocity(), "block")


def _no_solution(time: float, error: Exception, dt: float) -> Diverged:
    at = "" if isinstance(error, Diverged) else f"t = {time:.4g} s: "
    return Diverged(f"{at}{error} Steps down to {dt:.3g} s did not help.")
