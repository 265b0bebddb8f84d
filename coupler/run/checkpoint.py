"""Checkpoints: the complete state from which a run is continued.

`checkpoints/<steps>.h5` contains the water, immersed solids, blocks with their joints and contacts, loads, the energy
balance, the lengths of the result files, figures and processor time, and identifies the case and the program.
"""

from __future__ import annotations

import json
import math
import time
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path

import numpy as np
from pydantic import BaseModel

from coupler.case.case import Case
from coupler.case.schedule import Schedule, next_multiple
from coupler.program.errors import ExitCode, SurgebreakError
from coupler.run.array_file import Damaged, read_arrays, write_arrays
from coupler.run.fingerprint import differences, file_digests, program, scene_parts

FOLDER = "checkpoints"
KEPT = 2
LONGEST = 600.0
"""Wall time [s] that a kill may take from a run whose case gives no interval: a tenth of a long run is hours."""
LAYOUT = 10
"""Number of the names, kinds and columns of the arrays; checkpoints of another one are refused."""
UNSET = (
    "structure/joints/failure_time",
    *(
        f"recorder/watch_{name}"
        for name in (
            "left_at",
            "pressure_time",
            "force_time",
            "push_time",
            "moment_time",
            "depth_time",
            "depth_at",
        )
    ),
)
"""Arrays in which NaN has a meaning."""


class OtherScene(SurgebreakError):
    """A checkpoint does not fit the scene that was built for it."""

    exit_code = ExitCode.BAD_CASE


@dataclass(frozen=True)
class Checkpoint:
    """A checkpoint that was read. path · arrays by name · about: the run that it belongs to, and values that are no
    arrays."""

    path: Path
    arrays: dict[str, np.ndarray]
    about: dict

    @classmethod
    def read(cls, path: Path) -> Checkpoint:
        """Raises Damaged."""
        arrays, text = read_arrays(path)
        try:
            about = json.loads(text)
            _About.model_validate(about)
            missing = [name for name in ALWAYS if name not in arrays]
            if missing:
                raise ValueError(f"no {missing[0]}")
        except (ValueError, RecursionError) as error:
            raise Damaged(f"{path} does not hold what a run writes: {str(error).splitlines()[0]}") from error
        return cls(path, arrays, about)

    def part(self, name: str) -> dict[str, np.ndarray]:
        """Arrays of one part: coupling, ledger, water, immersion, structure, recorder."""
        start = name + "/"
        return {key.removeprefix(start): a for key, a in self.arrays.items() if key.startswith(start)}

    @cached_property
    def time(self) -> float:
        """[s]"""
        return float(self.arrays["coupling/time"])

    def schedule(self, case: Case) -> Schedule:
        """Outputs of the run as it continues with a case: up to its end, and at multiples of its interval where that
        has changed since."""
        every = case.time.output_every
        if every is not None and every != self.about["case"].get("time", {}).get("output_every"):
            return Schedule(every, 1, case.time.end)
        return Schedule(*self.about["outputs"], end=case.time.end)


ALWAYS = ("coupling/time", "recorder/outputs")
"""Arrays that every checkpoint holds."""


class _Figures(BaseModel):
    steps: int
    substeps: int


class _About(BaseModel):
    """The text of a checkpoint, checked key by key, since an edited file may have a matching digest."""

    layout: int
    case: dict
    files: dict[str, str] = {}  # absent before layout 7, which is refused with that reason
    program: dict[str, str]
    scene: dict[str, str]
    outputs: tuple[float, int]
    figures: _Figures
    cpu_seconds: dict[str, float]


@dataclass(frozen=True)
class State:
    """The content of a checkpoint before it is written. time [s] · name of the file · arrays by name · about, as
    text"""

    time: float
    name: str
    arrays: dict[str, np.ndarray]
    about: str


class Checkpoints:
    """Writes the checkpoints of a run, of which the newest KEPT are kept.

    directory: of the run · every [s] of the run · case: effective · scene, recorder: what is saved ·
    longest: wall time [s] after which one is due anyway
    """

    def __init__(
        self,
        directory: Path,
        every: float,
        case: dict,
        schedule: Schedule,
        scene,
        recorder,
        longest: float = math.inf,
    ):
        self.folder = directory / FOLDER
        self.folder.mkdir(exist_ok=True)
        self.every, self.longest, self.scene, self.recorder = every, longest, scene, recorder
        self._about = {
            "layout": LAYOUT,
            "case": case,
            "files": file_digests(case),
            "program": program(),
            "scene": scene_parts(scene.coupling),
            "outputs": [schedule.span, schedule.count],
        }
        self._last = scene.coupling.time
        self._next = next_multiple(self._last, every)
        self._clock = time.monotonic()

    def due(self) -> bool:
        """Whether one of the intervals since the last checkpoint has passed."""
        if time.monotonic() - self._clock >= self.longest:
            return True
        return self.scene.coupling.time >= self._next * (1.0 - 1e-12)

    def write(self, figures: dict, cpu_seconds: dict[str, float]) -> None:
        """Write a checkpoint now, unless the last one is of this step.  Raises NotFinite, DiskFull."""
        if self.scene.coupling.time != self._last:
            self.put(self._state(figures, cpu_seconds))

    def hold(self, figures: dict, cpu_seconds: dict[str, float]) -> State:
        """The present state, for `put` if the next step is abandoned: copies but for the fields of the water, which a
        step replaces by new ones."""
        state = self._state(figures, cpu_seconds)
        own = {name: a if name.startswith("water/") else a.copy() for name, a in state.arrays.items()}
        return replace(state, arrays=own)

    def put(self, state: State) -> None:
        """Write a state, unless the last checkpoint is of the same step.  Raises NotFinite, DiskFull."""
        if state.time == self._last:
            return
        write_arrays(self.folder / state.name, state.arrays, state.about, UNSET)
        self._last = state.time
        self._next = next_multiple(state.time, self.every)
        self._clock = time.monotonic()
        for old in listed(self.folder)[KEPT:]:
            old.unlink()

    def _state(self, figures: dict, cpu_seconds: dict[str, float]) -> State:
        about = self._about | {
            "figures": figures,
            "cpu_seconds": cpu_seconds,
            "written": datetime.now(UTC).isoformat(timespec="seconds"),
        }
        arrays = _arrays(self.scene.coupling, self.recorder)
        name = f"{figures['steps']:08d}.h5"
        return State(self.scene.coupling.time, name, arrays, json.dumps(about, default=_plain))


def _arrays(coupling, recorder) -> dict[str, np.ndarray]:
    parts = {"coupling": coupling.save(), "ledger": coupling.ledger.save(), "recorder": recorder.save()}
    parts["momentum"] = coupling.momentum.save()
    if coupling.water is not None:
        from fluid.step import state

        parts["water"] = state.save(coupling.water)
        parts["immersion"] = coupling.immersion.save()
    if coupling.structure is not None:
        parts["structure"] = coupling.structure.save().arrays()
    return {f"{part}/{name}": np.asarray(a) for part, found in parts.items() for name, a in found.items()}


def restore(coupling, checkpoint: Checkpoint) -> None:
    """Put a coupling, built from the same case, into the state of a checkpoint.  Raises OtherScene."""
    wrong = differences(checkpoint.about["scene"], scene_parts(coupling))
    if wrong:
        raise OtherScene(
            f"{checkpoint.path} belongs to another scene: {'; '.join(wrong)}. Has a file that the case names changed?"
        )
    try:
        _restore_sides(coupling, checkpoint)
        coupling.restore(checkpoint.part("coupling"))
        coupling.ledger.restore(checkpoint.part("ledger"))
        coupling.momentum.restore(checkpoint.part("momentum"))
    except (LookupError, ValueError, TypeError) as error:
        raise OtherScene(f"{checkpoint.path} does not hold a state of this scene: {error!r}") from error


def _restore_sides(coupling, checkpoint: Checkpoint) -> None:
    if coupling.structure is not None:
        from yade_scripts.dynamics.state import StructureState

        coupling.structure.restore(StructureState.of(checkpoint.part("structure")))
    if coupling.water is not None:
        from fluid.step import state

        coupling.immersion.restore(checkpoint.part("immersion"))
        state.restore(coupling.water, coupling.immersion.domain, checkpoint.part("water"))


def listed(folder: Path) -> list[Path]:
    """Files of checkpoints, the newest first."""
    return sorted((path for path in folder.glob("[0-9]*.h5") if path.is_file()), reverse=True)


def _plain(value: object) -> object:
    """NumPy numbers as plain numbers for JSON."""
    return value.tolist()
