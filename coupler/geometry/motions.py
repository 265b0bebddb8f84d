"""The motion over time that [[motion]] tells a block: from its table, or from its file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, check_file
from coupler.case.records import NoSuchData, read_record
from coupler.program.errors import did_you_mean

if TYPE_CHECKING:
    from yade_scripts.blocks.prescribed import Prescribed

TIME = "time"
VELOCITIES = ("velocity_x", "velocity_y", "velocity_z")
DISPLACEMENTS = ("displacement_x", "displacement_y", "displacement_z")
"""Columns of the file."""
KEYS = ("velocity", "times", "velocities", "displacements", "path")
"""Keys of [[motion]] that say how the block moves."""
TOGETHER = (["velocity"], ["times", "velocities"], ["times", "displacements"], ["path"])
"""Those of them that belong together."""


class MotionError(ValueError):
    """A motion that cannot be followed. key: of [[motion]] · the message says why."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.key = key


def motion_of(spec) -> Prescribed | None:
    """The motion over time of a table [[motion]]; None where it is one velocity for the whole run.

    Raises MotionError."""
    given = [key for key in KEYS if getattr(spec, key) not in (None, ())]
    if given not in TOGETHER:
        has = f"it has {' and '.join(given)}" if given else "it has none of them"
        raise MotionError(
            given[0] if given else "block",
            f"'{spec.block}' moves with velocity, by times with velocities or displacements, or by the file path: "
            f"{has}",
        )
    if spec.velocity is not None:
        return None
    if spec.path is not None:
        return _from_file(spec.path)
    kind = given[1]
    values = getattr(spec, kind)
    if len(spec.times) != len(values):
        raise MotionError(kind, f"{len(values)} {kind} for {len(spec.times)} times; each time needs one")
    return _made(("times", kind), "", np.array(spec.times, float), np.array(values, float))


def _from_file(path: str) -> Prescribed:
    try:
        check_file(Path(path))
        columns = read_record(Path(path))
    except BadPath as error:
        raise MotionError("path", f"{path}: {error}") from error
    except NoSuchData as error:
        raise MotionError("path", " ".join(error.lines)) from error
    allowed = (TIME, *VELOCITIES, *DISPLACEMENTS)
    for name in columns:
        if name not in allowed:
            hint = did_you_mean(name, allowed)
            raise MotionError(
                "path", f"{path}: unknown column '{name}'{hint}; known are {', '.join(allowed)}"
            )
    kinds = {"velocities": VELOCITIES, "displacements": DISPLACEMENTS}
    there = [kind for kind, names in kinds.items() if any(name in columns for name in names)]
    if TIME not in columns or len(there) != 1:
        raise MotionError(
            "path",
            f"{path}: it needs the column {TIME}, and either one at least of {', '.join(VELOCITIES)} or one at least "
            f"of {', '.join(DISPLACEMENTS)}",
        )
    times, kind = columns[TIME], there[0]
    values = np.column_stack([columns.get(name, np.zeros(len(times))) for name in kinds[kind]])
    return _made(("path", "path"), f"{path}: ", times, values, kind)


def _made(keys: tuple[str, str], where: str, times: Array, values: Array, kind: str = "") -> Prescribed:
    """keys: of the times and of the values (k, 3) · kind: velocities or displacements, unless the key says it.

    Raises MotionError unless the times begin at 0 and increase, and displacements begin at zero."""
    from yade_scripts.blocks.prescribed import Prescribed, PrescribedWay

    key, kind = keys[0], kind or keys[1]
    if len(times) < 2:
        raise MotionError(
            key, f"{where}{len(times)} times; a motion over time needs two at least, or write velocity"
        )
    if times[0] != 0.0:
        raise MotionError(key, f"{where}the first time is {times[0]:g} s; it must be 0, the start of the run")
    back = np.flatnonzero(np.diff(times) <= 0.0)
    if len(back):
        k = int(back[0]) + 1
        raise MotionError(
            key,
            f"{where}time {k + 1} of {len(times)} is {times[k]:g} s, not after {times[k - 1]:g} s; times increase",
        )
    if kind == "velocities":
        return Prescribed(times, values)
    if values[0].any():
        raise MotionError(
            keys[1],
            f"{where}the first displacement is {values[0].tolist()} m; it must be zero, the place at the start",
        )
    return PrescribedWay.through(times, values)
