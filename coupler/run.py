"""A whole run: build the scene, step to the end, write, and end with a reason."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from coupler.build import Scene, build
from coupler.case import Case, modules
from coupler.clock import Clock
from coupler.errors import SurgebreakError
from coupler.limits import LimitReached, Limits, check_balance
from coupler.recorder import Recorder


@dataclass
class Summary:
    """Figures of a run for `run.json` and the closing lines."""

    time: float = 0.0
    steps: int = 0
    substeps: int = 0
    figures: dict[str, float] = field(default_factory=dict)
    cpu_seconds: dict[str, float] = field(default_factory=dict)


def run(case: Case, directory, reporter) -> Summary:
    """Run a case into an existing, empty run directory (a Path).

    Raises SurgebreakError when the run ends before its time; what was written until then stays. The summary so
    far travels with the error as its attribute `summary`.
    """
    clock = Clock()
    summary = Summary()
    on = modules(case)
    reporter.message("modules on: " + ", ".join(k for k, v in on.items() if v))
    reporter.message("modules off: " + (", ".join(k for k, v in on.items() if not v) or "none"))
    try:
        scene = build(case, clock)
        try:
            _describe(scene, reporter)
            _steps(case, scene, directory, reporter, clock, summary)
        finally:
            if scene.coupling.structure is not None:
                scene.coupling.structure.close()
    except SurgebreakError as error:
        error.summary = summary
        raise
    finally:
        summary.cpu_seconds = clock.split()
    return summary


def _describe(scene: Scene, reporter) -> None:
    c = scene.coupling
    if c.water is not None:
        d = c.water.domain
        reporter.message(
            f"water: {len(c.water.mesh.cells)} cells in the mesh, {len(d.cells)} outside the solids "
            f"({int(d.is_cut.sum())} cut), {c.water.volume():.6g} m3"
        )
    if c.structure is not None:
        substep, pair = c.structure.stable_substep()
        reporter.message(
            f"structure: {c.structure.n} blocks, {c.structure.n_joints} joints, substep {substep:.3g} s ({pair})"
        )


def _steps(case: Case, scene: Scene, directory, reporter, clock: Clock, summary: Summary) -> None:
    coupling = scene.coupling
    limits = Limits(case.limits.volume_error, case.limits.energy_error, case.limits.cpu_seconds)
    every = case.time.output_every or case.time.end / 100
    outputs = max(1, round(case.time.end / every))
    recorder = Recorder(directory, coupling, scene.gauges, scene.solids, scene.tank)
    try:
        with clock("output"):
            recorder.fields(0.0)
        for output in range(1, outputs + 1):
            target = case.time.end * output / outputs
            while coupling.time < target * (1 - 1e-12):
                record = coupling.step(coupling.step_size(target - coupling.time))
                with clock("output"):
                    recorder.step(record)
                _note(coupling, record, summary)
                reporter.step(coupling.time, _told(coupling, record))
                check_balance(coupling.time, _volume_error(coupling), record.balance.energy_error, limits)
                _check_budget(clock, limits, reporter)
            with clock("output"):
                recorder.fields(coupling.time)
    finally:
        recorder.close()


def _note(coupling, record, summary: Summary) -> None:
    f = summary.figures
    summary.time = coupling.time
    summary.steps += 1
    summary.substeps += record.substeps
    f["energy_error"] = record.balance.energy_error
    f["numerical_dissipation_share"] = (
        record.balance.numerical_dissipation / record.balance.input_energy
        if record.balance.input_energy > 0.0
        else 0.0
    )
    f["largest_energy_error"] = max(f.get("largest_energy_error", 0.0), record.balance.energy_error)
    if coupling.water is not None:
        error = coupling.water.volume_error()
        f["volume_error"] = error
        f["largest_volume_error"] = max(f.get("largest_volume_error", 0.0), abs(error))
        f["largest_force_N"] = max(
            f.get("largest_force_N", 0.0), float(np.linalg.norm(record.load[:, :3].sum(axis=0)))
        )
    if coupling.structure is not None:
        joints = coupling.structure.joint_summary()
        f["joints"], f["joints_broken"] = coupling.structure.n_joints, joints.broken
        f["largest_defect"] = max(f.get("largest_defect", 0.0), record.defect)
        f["largest_opening_rate"] = max(f.get("largest_opening_rate", 0.0), record.opening_rate)


def _told(coupling, record) -> dict[str, str]:
    told = {"dt": f"{1e3 * record.dt:.3g} ms"}
    if coupling.structure is not None:
        joints = coupling.structure.joint_summary()
        told["broken"] = f"{joints.broken}/{coupling.structure.n_joints}"
    if coupling.water is not None:
        told["force"] = f"{np.linalg.norm(record.load[:, :3].sum(axis=0)) / 1e3:.4g} kN"
        told["volume"] = f"{_volume_error(coupling):+.2%}"
    if coupling.coupled:
        told["defect"] = f"{record.defect:.1e}"
    told["energy"] = f"{record.balance.energy_error:.2%}"
    return told


def _volume_error(coupling) -> float:
    return 0.0 if coupling.water is None else coupling.water.volume_error()


def _check_budget(clock: Clock, limits: Limits, reporter) -> None:
    reason = reporter.stop_requested()
    if reason:
        raise LimitReached(reason)
    if limits.cpu_seconds is not None and clock.total() > limits.cpu_seconds:
        raise LimitReached(
            f"the run has used {clock.total():.0f} s of processor time; limit {limits.cpu_seconds:.0f} s "
            "(limits.cpu_seconds). Raise it, or use a coarser tank.cell."
        )
