"""The time limit of a job of a batch system: read in the notation of that system, passed to the job, and checked there.

Batch systems end a job at its limit without warning. A job therefore knows this time (`VARIABLE`) and has its run write
a checkpoint shortly before; the run is continued in another job.
"""

from __future__ import annotations

import math
import os
import time

VARIABLE = "SURGEBREAK_JOB_ENDS"
"""Seconds since 1970 at which the job is ended; absent where it has no limit."""
MARGIN, LARGEST_SHARE = 90.0, 0.25
"""[s] before the end at which a run is asked to stop, at most this share of the limit."""
LAST_UNIT = {"lsf": 60.0, "slurm": 60.0, "oar": 3600.0}
"""[s] of a limit that is one number; 1 elsewhere."""


def seconds(kind: str, text: str) -> float:
    """A limit as `kind` (pbs, slurm, sge, lsf, oar) writes it: hours:minutes:seconds, minutes:seconds (LSF:
    hours:minutes), days-hours:minutes:seconds, or one number (see LAST_UNIT). Raises ValueError."""
    days, dash, rest = text.rpartition("-")
    parts = rest.split(":")
    units = {3: (3600.0, 60.0, 1.0), 2: (3600.0, 60.0) if kind == "lsf" else (60.0, 1.0)}
    units[1] = (LAST_UNIT.get(kind, 1.0),)
    if len(parts) not in units or not all(part.isdecimal() for part in (*parts, *([days] if dash else []))):
        raise ValueError(f"walltime={text}: write it as {'hours:minutes' if kind == 'lsf' else '01:30:00'}")
    whole = sum(unit * int(part) for unit, part in zip(units[len(parts)], parts))
    return whole + (86400.0 * int(days) if dash else 0.0)


def lines(limit: float) -> list[str]:
    """Of a job script: the moment at which a run is to stop, reckoned from when the job begins."""
    left = limit - min(MARGIN, LARGEST_SHARE * limit)
    return [f"export {VARIABLE}=$(( $(date +%s) + {math.floor(left)} ))"]


def left() -> float:
    """Seconds that this job has for runs; infinite without a limit."""
    ends = os.environ.get(VARIABLE)
    return math.inf if ends is None else float(ends) - time.time()
