"""`blocks.csv`: one row per block with its initial position, displacement, time of leaving its place and largest
pressure."""

from __future__ import annotations

import numpy as np

from array_types import Array
from coupler.results.history import Column, write_table
from coupler.verdict.attitude import shift_of, tilt_of
from coupler.verdict.judge import joints_of
from coupler.verdict.watch import Watch

COLUMNS = tuple(
    Column(*c)
    for c in (
        ("block", "1", "row of the block"),
        ("name", "", "name of the block"),
        ("body", "", "table or group of the case that it belongs to"),
        ("member", "", "wall, floor or part that it is in"),
        ("storey", "", "its storey; empty without one"),
        ("x", "m", "centre at the start"),
        ("y", "m", "centre at the start"),
        ("z", "m", "centre at the start"),
        ("mass", "kg", "its mass"),
        ("thickness", "m", "smallest width across a face"),
        ("moved", "m", "how far its centre has been from its start, the farthest so far"),
        ("shift_x", "m", "displacement of its centre as of the last output"),
        ("shift_y", "m", "displacement of its centre as of the last output"),
        ("shift_z", "m", "displacement of its centre as of the last output, upwards"),
        ("tilt", "rad", "angle of its upright axis with the vertical, then"),
        ("left_at", "s", "when it left its place; empty if it did not"),
        ("first_break", "s", "when the first of its joints broke; empty if none did"),
        ("broken", "1", "share of its joined area that is broken; empty without joints"),
        ("pressure", "Pa", "largest net pressure of the water across wall, floor or sides, while in place"),
        ("pressure_time", "s", "when that was; empty if no water pressed"),
    )
)


def write_blocks(path, structure, watch: Watch) -> None:
    """Write the table as a whole, in place of the one before."""
    d, f = watch.divisions, watch.facts
    rows = np.arange(len(d.blocks))
    first, broken = breaks(structure)

    def words(division):
        return [division.names[k] if k >= 0 else "" for k in division.label[rows]]

    write_table(
        path,
        "blocks: what became of each",
        COLUMNS,
        [
            rows, list(d.blocks), words(d.bodies), words(d.members), words(d.storeys), *f.centre[rows].T,
            structure.mass[rows], f.thickness[rows], watch.moved[rows],
            *shift_of(structure)[rows].T, tilt_of(structure)[rows], watch.left_at[rows], first[rows], broken[rows],
            watch.pressure.value[rows], watch.pressure.time[rows],
        ],
    )  # fmt: skip


def breaks(structure) -> tuple[Array, Array]:
    """Time of the first break of each block (n,) [s], NaN without one, and the broken share of its joined area (n,)."""
    joints = joints_of(structure)
    first, area, gone = np.full(structure.n, np.inf), np.zeros(structure.n), np.zeros(structure.n)
    time = np.where(np.isnan(joints.broken), np.inf, joints.broken)
    for side in (joints.a, joints.b):
        inner = side >= 0
        np.minimum.at(first, side[inner], time[inner])
        np.add.at(area, side[inner], joints.area[inner])
        np.add.at(gone, side[inner], np.where(np.isfinite(time), joints.area, 0.0)[inner])
    share = np.divide(gone, area, out=np.full(structure.n, np.nan), where=area > 0.0)
    return np.where(np.isfinite(first), first, np.nan), share
