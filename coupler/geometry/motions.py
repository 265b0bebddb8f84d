"""The motion over time that [[motion]] tells a block: from its table, or from its file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, check_file
from coupler.case.records import NoSuchData, read_record
from coupler.program.errors import did_you_mean
from yade_scripts.blocks.prescribed import Prescribed

TIME, VELOCITIES = "time", ("velocity_x", "velocity_y", "velocity_z")
"""Columns of the file."""


class MotionError(ValueError):
    """A motion that cannot be followed. key: of [[motion]] · the message says why."""

    def __init__(self, key: str, text: str) -> None:
        super().__init__(text)
        self.key = key


def motion_of(spec) -> Prescribed | None:
    """The motion over time of a table [[motion]]; None where it is one velocity for the whole run.

    Raises MotionError."""
    given = [
        key for key in ("velocity", "times", "velocities", "path") if getattr(spec, key) not in (None, ())
    ]
    if given not in (["velocity"], ["times", "velocities"], ["path"]):
        has = f"it has {' and '.join(given)}" if given else "it has none of them"
        raise MotionError(
            given[0] if given else "block",
            f"'{spec.block}' moves with velocity, by times and velocities, or by the file path: {has}",
        )
    if spec.velocity is not None:
        return None
    if spec.path is not None:
        return _from_file(spec.path)
    if len(spec.times) != len(spec.velocities):
        raise MotionError(
            "velocities",
            f"{len(spec.velocities)} velocities for {len(spec.times)} times; each time needs one",
        )
    return _checked("times", "", np.array(spec.times), np.array(spec.velocities))


def _from_file(path: str) -> Prescribed:
    try:
        check_file(Path(path))
        columns = read_record(Path(path))
    except BadPath as error:
        raise MotionError("path", f"{path}: {error}") from error
    except NoSuchData as error:
        raise MotionError("path", " ".join(error.lines)) from error
    allowed = (TIME, *VELOCITIES)
    for name in columns:
        if name not in allowed:
            raise MotionError(
                "path",
                f"{path}: unknown column '{name}'{did_you_mean(name, allowed)}; known are {', '.join(allowed)}",
            )
    if TIME not in columns or len(columns) < 2:
        raise MotionError(
            "path", f"{path}: it needs the column {TIME} and one at least of {', '.join(VELOCITIES)}"
        )
    time = columns[TIME]
    zero = np.zeros(len(time))
    return _checked(
        "path", f"{path}: ", time, np.column_stack([columns.get(name, zero) for name in VELOCITIES])
    )


def _checked(key: str, where: str, times: Array, velocities: Array) -> Prescribed:
    """Raises MotionError unless the times begin at 0 and increase."""
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
    return Prescribed(times.astype(float), velocities.astype(float))
