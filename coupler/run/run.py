"""A whole run: builds the scene, makes the steps, writes the results, and ends with a reason."""

from __future__ import annotations

from functools import partial
from shlex import quote

import numpy as np

from coupler.case.case import Case, effective
from coupler.case.schedule import Schedule, checkpoint_interval
from coupler.checks.bores import bores
from coupler.checks.remarks import remarks
from coupler.checks.thin_walls import thin_remarks
from coupler.checks.water import thin_water_remarks
from coupler.geometry.overlaps import deepest_overlap
from coupler.program.errors import ExitCode
from coupler.program.quantities import counted, signed_percent
from coupler.program.terminal import newtons
from coupler.results.recorder import Recorder
from coupler.results.tank_top import in_all, reached
from coupler.run import fast_openings
from coupler.run.clock import Clock
from coupler.run.left_out import imports, note_work
from coupler.run.pace import Calm, Fall
from coupler.run.within_step import LongSteps, StepLeft
from coupler.scene.build import Scene, build, limits_of
from coupler.step.limits import LimitReached, Limits, Stopped, check_air, check_defect, check_overlap
from coupler.step.observe import joint_counts, size
from coupler.step.step_limits import check_step, volume_error
from kernels.memory import keep_memory

MOST_CLOSED = 3
"""Parts of the water without a surface that are reported at the start."""


def run(case: Case, directory, reporter, checkpoint=None, each=None) -> ExitCode:
    """Run a case into a RunDirectory; its figures go into run.json however the run ends.

    checkpoint: Checkpoint of an earlier process from which the run continues ·
    each: called after every step with the CoupledStepper, the StepRecord, the figures so far and the values of the
    gauges.

    Raises SurgebreakError (or an error of the water or the structure) when the run ends early; results written
    until then are kept.
    """
    keep_memory()
    clock = Clock(checkpoint.about["cpu_seconds"] if checkpoint else None)
    figures: dict[str, float] = {"steps": 0, "substeps": 0}
    if checkpoint:
        figures |= checkpoint.about["figures"]
    try:
        scene = build(case, clock, from_start=checkpoint is None)
        try:
            if checkpoint:
                _restore(scene, checkpoint, clock)
            _describe(scene, reporter)
            if checkpoint is None:  # the size at the start
                directory.record(size=size(scene.coupling), notes=remarks(case))
                directory.record(bores=[bore.as_table() for bore in bores(case)])
            if scene.coupling.structure is not None:
                directory.record(laws=laws_of(scene.coupling.structure))
            _steps(case, scene, directory, reporter, clock, figures, checkpoint, each)
        finally:
            if scene.coupling.structure is not None:
                scene.coupling.structure.close()
    finally:
        directory.record(**figures, cpu_seconds=clock.split(), imports=imports())
    _report_fast_openings(case, figures, reporter)
    _report_split(clock, reporter)
    return ExitCode.DONE


def _report_fast_openings(case: Case, figures: dict, reporter) -> None:
    message = fast_openings.note(case, figures.get("largest_opening_rate", 0.0))
    if message:
        reporter.message(message)


def _restore(scene: Scene, checkpoint, clock: Clock) -> None:
    from coupler.run.checkpoint import restore

    with clock("set-up"):
        restore(scene.coupling, checkpoint)


def _report_split(clock: Clock, reporter) -> None:
    parts = ", ".join(f"{name} {seconds:.1f}" for name, seconds in clock.split().items())
    reporter.message(f"processor time {clock.total():.1f} s: {parts}")


def _describe(scene: Scene, reporter) -> None:
    c = scene.coupling
    if c.water is not None:
        d = c.water.domain
        divided = "; each side of one that a wall divides counts" if d.covers == "multiple" else ""
        reporter.message(
            f"water: {len(c.water.mesh.cells)} cells in the mesh, {len(d.cells)} outside the solids "
            f"({int(d.is_cut.sum())} cut{divided}), {c.water.volume():.6g} m3"
        )
        if d.is_cut.any():
            _describe_closed_off(c.water, reporter)
    if c.water is not None and c.water.air is not None:
        from coupler.run.trapped_air import described_air

        reporter.message(described_air(c.water))
    if c.structure is not None:
        limit, substep = c.structure.substep_limit(), c.structure.substep()
        joints = joint_counts(c.structure).intact
        held = f" ({int(c.structure.fixed.sum())} held or driven)" if c.structure.fixed.any() else ""
        reporter.message(
            f"structure: {counted(c.structure.n, 'block')}{held}, {counted(joints, 'joint')}, "
            f"substep {substep:.3g} s ({limit.what})"
        )
        if c.structure.sleeps is not None:
            reporter.message(f"sleep: {c.structure.sleeps.described()}")
        if limit.remark(substep):
            reporter.message(f"note: {limit.remark(substep)}")
        for what, law in laws_of(c.structure).items():
            reporter.message(f"{what}: {law}")


def _describe_closed_off(water, reporter) -> None:
    """Notes on water without a surface at the start, whose pressure anything that moves there sets."""
    from fluid.readings.closed_off import closed_off

    closes = water.domain.memory.connection is not None and water.domain.memory.connection.face > 0.0
    why = '; water.openings = "all" leaves narrow openings open, which may connect it' if closes else ""
    for part in closed_off(water)[:MOST_CLOSED]:
        at = ", ".join(f"{x:.3g}" for x in part.place)
        reporter.message(
            f"note: {part.volume:.3g} m3 of water around ({at}) m have no surface and no open side: the pressure there "
            f"follows from what moves beside them alone{why}"
        )


def laws_of(structure) -> dict[str, str]:
    """A description of the laws of contact and joints of a structure, on which all its results depend."""
    found = {}
    if structure.contact is not None:
        found["contact"] = structure.contact.described(structure.face_stiffness)
    if structure.joints is not None:
        found["joints"] = structure.joint_rules.described(structure.joints.laws)
    return found


def _steps(
    case: Case, scene: Scene, directory, reporter, clock: Clock, figures: dict, checkpoint=None, each=None
) -> None:
    coupling = scene.coupling
    limits = limits_of(case)
    schedule = checkpoint.schedule(case) if checkpoint else Schedule.of(case)
    kept = checkpoint.part("recorder") if checkpoint else None
    recorder = Recorder(
        directory.path, coupling, scene.gauges, scene.solids, scene.tank, kept, scene.watch, scene.maps
    )
    checkpoints = _checkpoints(case, scene, directory, recorder, schedule)
    way_on = f"; `surgebreak resume {quote(str(directory.path))}` goes on" if checkpoints is not None else ""
    long = _long_steps(coupling, limits, reporter, clock, figures, checkpoints)
    calm, fall = Calm(), Fall()
    try:
        if checkpoint is None:
            with clock("output"):
                recorder.fields(0.0)
        while not _reached(coupling.time, schedule.end):
            target = schedule.next_output(coupling.time)
            dt = coupling.step_size(target - coupling.time)
            record = long.around(partial(coupling.step, dt))
            with clock("output"):
                recorder.step(record)
            _note(coupling, record, figures)
            _note_top(case, recorder, coupling, figures, reporter)
            if coupling.water is not None and coupling.water.air is not None:
                _note_air(coupling, figures, reporter)
            reporter.expect(*_calm_and_broken(calm, fall, coupling, record))
            reporter.step(coupling.time, _reported(case, coupling, record, scene.watch))
            if each is not None:
                each(coupling, record, figures, recorder.readings)
            check_step(coupling, record, limits)
            check_defect(coupling.time, coupling.defects.mean, case.limits.defect)
            if coupling.structure is not None:
                depth = case.limits.overlap
                check_overlap(coupling.time, deepest_overlap(coupling.structure, depth), depth)
            check_air(coupling.time, coupling.water, case.limits.air_pressure)
            if _reached(coupling.time, target):
                with clock("output"):
                    recorder.fields(coupling.time)
                    directory.record(**figures, verdict=recorder.verdict())
            at_end = _reached(coupling.time, schedule.end)
            reason = None if at_end else _stop_reason(clock, limits, reporter)
            if checkpoints is not None and (reason or at_end or checkpoints.due()):
                _save(checkpoints, directory, figures, clock)
            if reason:
                raise _end(reporter)(reason + way_on)
    except StepLeft as left:
        before, structure = long.held
        if structure is not None:  # the verdict is that of the last complete step
            coupling.structure.restore(structure)
        if checkpoints is not None:
            with clock("output"):
                checkpoints.put(before)
        raise _end(reporter)(str(left) + way_on) from None
    finally:
        recorder.close()
        _report_verdict(
            case, recorder.verdict(), figures, schedule.end, directory, reporter, coupling.coupled
        )


def _note_top(case: Case, recorder: Recorder, coupling, figures: dict, reporter) -> None:
    """Record in the figures that water reached the top of the tank, and report it when this first happens."""
    if recorder.top is None:
        return
    is_new = recorder.top.step(coupling.water, coupling.time)
    found = recorder.top.reported("z+" in case.tank.open)
    if found is not None:
        figures["tank_top"] = found
    if is_new:
        reporter.message(f"note: {reached(found)}")


def _note_air(coupling, figures: dict, reporter) -> None:
    """Record in the figures which pockets opened to the atmosphere, and report them unless larger ones were."""
    from coupler.run.trapped_air import note_opened

    message = note_opened(coupling.water, coupling.time, figures)
    if message:
        reporter.message(message)


def _report_verdict(
    case: Case, reported: dict | None, figures: dict, end: float, directory, reporter, is_coupled: bool
) -> None:
    """Write the verdict to run.json and the log, however the run ends, with the reasons to doubt it and its loads."""
    from coupler.verdict.words import sentences, still_rising, unfinished, unreached, unsettled

    doubts = [*thin_remarks(case), *thin_water_remarks(case)]
    doubts += [in_all(figures["tank_top"])] if "tank_top" in figures else []
    if "air_opened" in figures:
        from coupler.run.trapped_air import opened_in_all

        doubts.append(opened_in_all(figures["air_opened"]))
    time = figures.get("time", 0.0)  # of the last complete step
    if reported is not None and not _reached(time, end):
        doubts.append(unfinished(time, end))
    elif reported is not None and figures["steps"]:
        found = [unreached(reported, time) if is_coupled else None]
        found += [unsettled(reported, time), still_rising(reported, time)]
        doubts += filter(None, found)
    directory.record(doubts=doubts)
    if reported is not None:
        directory.record(verdict=reported)
        for line in sentences(reported):
            reporter.message(line)
    for line in doubts:
        reporter.message(f"but: {line}")


def _long_steps(coupling, limits: Limits, reporter, clock: Clock, figures: dict, checkpoints) -> LongSteps:
    """The object that both solvers call within a long step, to abandon it where the run is to end. It holds the state
    before the step, None without checkpoints, and that of the structure for the verdict, None without one."""

    def hold():
        state = None if checkpoints is None else checkpoints.hold(figures, clock.split())
        return state, None if coupling.structure is None else coupling.structure.save()

    long = LongSteps(lambda: _stop_reason(clock, limits, reporter), hold)
    coupling.pause = long
    if coupling.structure is not None:
        coupling.structure.pause = long
    return long


def _end(reporter) -> type[LimitReached]:
    """The exception that ends a run early: for a request of the user, or else for a limit."""
    return Stopped if reporter.stop_requested() else LimitReached


def _reached(time: float, target: float) -> bool:
    return time >= target * (1.0 - 1e-12)


def _checkpoints(case: Case, scene: Scene, directory, recorder: Recorder, schedule: Schedule):
    """Checkpoints of the run; None if the case asks for none, and then their module is not loaded."""
    every = checkpoint_interval(case)
    if every == 0.0:
        return None
    from coupler.run.checkpoint import LONGEST, Checkpoints

    longest = LONGEST if case.time.checkpoint_every is None else np.inf
    return Checkpoints(directory.path, every, effective(case), schedule, scene, recorder, longest)


def _save(checkpoints, directory, figures: dict, clock: Clock) -> None:
    with clock("output"):
        checkpoints.write(figures, clock.split())
    directory.record(**figures, cpu_seconds=clock.split())


def _note(coupling, record, figures: dict) -> None:
    """Add the step to the figures of the run."""

    def largest(name: str, value: float) -> None:
        figures[f"largest_{name}"] = max(figures.get(f"largest_{name}", 0.0), float(value))

    balance = record.balance
    figures["time"] = coupling.time
    figures["steps"] += 1
    figures["substeps"] += record.substeps
    figures["energy_error"] = float(balance.energy_error)
    largest("energy_error", balance.energy_error)
    largest("momentum_error", record.momentum.error)
    if coupling.water is not None:
        figures["numerical_dissipation"] = float(
            balance.numerical_dissipation / max(balance.input_energy, 1e-300)
        )
        figures["numerical_impulse"] = record.momentum.scheme
        figures["volume_error"] = coupling.water.volume_error()
        largest("volume_error", abs(figures["volume_error"]))
        largest("water_force", np.linalg.norm(load_of_what_moves(coupling, record)))
    joints = None
    if coupling.structure is not None:
        joints = joint_counts(coupling.structure)
        figures["joints"], figures["joints_broken"] = joints.intact + joints.broken, joints.broken
        largest("defect", record.defect)
        if coupling.structure.sleeps is not None:
            figures["sleep"] = coupling.structure.sleeps.figures()
        largest("opening_rate", record.opening_rate)
    note_work(figures.setdefault("work", {}), coupling, record, joints, figures["steps"])


def load_of_what_moves(coupling, record) -> np.ndarray:
    """Force (3,) [N] of the water on the blocks that can move; where none can, on all bodies. Ground, quays and
    footings, which are held, would hide the load of a house by their much larger ones."""
    force = record.load[:, :3]
    if coupling.structure is not None:
        free = np.flatnonzero(~coupling.structure.fixed)
        force = force[free] if len(free) and len(force) else force
    return force.sum(axis=0)


def _calm_and_broken(calm: Calm, fall: Fall, coupling, record) -> tuple[bool, bool]:
    """Whether the event that will slow the run down is still to come, and whether it has begun: a joint has broken, or
    loose blocks without water have landed."""
    if coupling.structure is None:
        return False, False
    if not coupling.coupled:
        falls = coupling.structure.joints is None and fall.now(coupling.time, record.energies["kinetic"])
        return falls, fall.ended and not falls
    joints = joint_counts(coupling.structure)
    return calm.now(
        coupling.time, _has_arrived(coupling, record), joints.intact, joints.broken
    ), joints.broken > 0


ARRIVED = 1e-3
"""Force of the water on the blocks that can move, over their weight, from which it has arrived: footings in a harbour
are wet from the start."""


def _has_arrived(coupling, record) -> bool:
    structure = coupling.structure
    weight = structure.mass[~structure.fixed].sum() * np.linalg.norm(structure.gravity)
    return bool(record.wetted and np.linalg.norm(load_of_what_moves(coupling, record)) > ARRIVED * weight)


def _force(case: Case, record, watch) -> tuple[str, float]:
    """Name and force of the water [N] that a run reports as it goes on: those of the judged body with the largest
    force; without one, of all bodies."""
    strongest = None if watch is None else watch.strongest()
    if strongest is not None:
        return strongest
    whose = case.solid[0].name if len(case.solid) == 1 and case.structure is None else "all bodies"
    return whose, float(np.linalg.norm(record.load[:, :3].sum(axis=0)))


def _reported(case: Case, coupling, record, watch) -> dict[str, str]:
    reported = {"dt": f"{1e3 * record.dt:.3g} ms"}
    if coupling.structure is not None:
        joints = joint_counts(coupling.structure)
        reported["broken"] = f"{joints.broken}/{joints.intact + joints.broken}"
    if coupling.water is not None:
        if len(record.load):
            whose, force = _force(case, record, watch)
            reported[f"force on {whose}"] = newtons(force)
        reported["volume"] = signed_percent(volume_error(coupling))
    if coupling.coupled:
        reported["defect"] = f"{record.defect:.1e}"
    reported["energy"] = f"{record.balance.energy_error:.2%}"
    return reported


def _stop_reason(clock: Clock, limits: Limits, reporter) -> str | None:
    """The reason why the run is to end now, or None."""
    if limits.cpu_seconds is not None and clock.here() > limits.cpu_seconds:
        return (
            f"the run has used {clock.here():.1f} s of processor time; limit {limits.cpu_seconds:g} s "
            "(limits.cpu_seconds). Raise it, or use a coarser tank.cell"
        )
    return reporter.stop_requested()
