"""Remarks on records of inflows: what of them comes in during the run, where they begin, and how fast they are."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from coupler.case.case import Case
from coupler.case.inflow_records import Record, RecordError, record_of
from coupler.geometry.tank_mesh import floor_along
from coupler.scene.build_water import fills_beside

STILL = 0.1
"""Share of a cell by which the water of the start may miss the level at a side, without a remark."""

QUIET = 0.1
"""Share of the range of its level that a record covers during the run without a remark."""

FASTEST = 4.0
"""Speed over sqrt(g h) of its largest depth above which no record is likely. The tip of a surge behind which the depth
stays h runs at 3 (Ritter, Z. VDI 36, 1892, 947)."""


def record_remarks(case: Case, spec) -> Iterator[str]:
    """Everything that should be known of a record before the run; spec: its inflow."""
    try:
        found = record_of(spec)
    except RecordError:
        return
    name = Path(spec.path).name
    yield from _held_ends(case, found, name)
    yield from step_at_start(case, spec.side, f"{name} begins", found.level_at(0.0))
    yield from _quiet(case, spec, found, name)
    if spec.velocity == "given":
        yield from _too_fast(case, spec, found, name)


def step_at_start(case: Case, side: str, begins: str, level: float) -> Iterator[str]:
    """Water of the start that stands at another level z [m] than its side; begins: what the side does there."""
    beside = [fill for fill in fills_beside(case, side) if fill.slope is None and fill.surface is None]
    floor = floor_along(case.tank, side)
    there = max((fill.upper[2] for fill in beside if fill.upper[2] > floor), default=level)
    if abs(there - level) > STILL * case.tank.cell:
        yield (
            f"{begins} at z = {level:.4g} m, but [[water.fill]] reaches z = {there:g} m beside it at {side}: this step "
            "starts a wave at once"
        )


def _held_ends(case: Case, found: Record, name: str) -> Iterator[str]:
    """Records that do not cover the run: their ends are held."""
    first, last = float(found.time[0]), float(found.time[-1])
    if first > 0.0:
        yield f"{name} begins at {first:g} s of the run: its first level and velocity are held from 0 to then"
    if last < case.time.end:
        level, velocity = float(found.level[-1].mean()), float(found.velocity[-1].mean())
        yield (
            f"{name} ends at {last:g} s, before the run does ({case.time.end:g} s): its last level ({level:.4g} m) and "
            f"velocity ({velocity:.4g} m/s) are held from then on"
        )


def _quiet(case: Case, spec, found: Record, name: str) -> Iterator[str]:
    """Records whose wave comes after the end of the run, or came before its start."""
    mean = found.level.mean(axis=1)
    inside = (found.time >= 0.0) & (found.time <= case.time.end)
    levels = [found.level_at(0.0), found.level_at(case.time.end), *mean[inside]]
    during, whole = float(np.ptp(levels)), float(np.ptp(mean))
    if during < QUIET * whole:
        farthest = float(found.time[np.abs(mean - levels[0]).argmax()])
        yield (
            f"the level of {name} changes by {during:.3g} m during the run (0 to {case.time.end:g} s), by {whole:.3g} "
            f"m in all, most at {farthest:g} s of the run ({farthest + spec.start:g} s of the record): its wave does "
            "not come in; set start or time.end, or look at the unit of its times"
        )


def _too_fast(case: Case, spec, found: Record, name: str) -> Iterator[str]:
    """Velocities that no wave of this depth has."""
    depth = float(found.level.max()) - floor_along(case.tank, spec.side)
    fastest = float(np.abs(found.velocity).max())
    wave = math.sqrt(case.case.gravity * max(depth, 0.0))
    if fastest > FASTEST * wave > 0.0:
        yield (
            f"{name} has velocities of {fastest:.3g} m/s, {fastest / wave:.2g} times sqrt(g h) of its largest depth "
            f"({depth:.3g} m): are they in m/s?"
        )
