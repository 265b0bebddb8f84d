"""Numbers of a run: columns of histories and formulas of them, figures of run.json, shares of joints, ways of
blocks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.formula import BadFormula, evaluate_columns
from coupler.case.sweep import Sweep, SweepQuantity
from coupler.case.sweep_names import PLAIN, plain_figure
from coupler.commands.study.plan import fingerprint
from coupler.commands.study.reading import Curve, NotRecorded, read, taken
from coupler.program.errors import BadCase, NoRun, SurgebreakError, did_you_mean
from coupler.results import vtkhdf
from coupler.results.history import BadTable, read_history
from coupler.run.summary import read_summary

SAME_COURSE = 0.1
"""Share of the height of the blocks by which those that stand at one height may differ: files hold seven digits."""


class NoReading(SurgebreakError):
    """A run does not have what a quantity is read from; the message says why."""


@dataclass(frozen=True)
class Reading:
    """value: NaN where there is none, then why says why · of: tells one definition of the quantity from another ·
    unit: that of the column or figure it was taken from, "" where that has none"""

    value: float
    why: str
    of: str
    unit: str = ""


def asked(sweep: Sweep) -> tuple[SweepQuantity, ...]:
    """The quantities of a sweep; without any, the plain figures of run.json and of its verdict."""
    if sweep.quantity:
        return sweep.quantity
    return tuple(
        SweepQuantity(name=name, what=what, unit=unit, figure=plain_figure(name))
        for name, (what, unit) in PLAIN.items()
    )


def is_derived(q: SweepQuantity) -> bool:
    """Whether the quantity is computed from other columns instead of the files of a run."""
    return q.formula is not None and q.table is None


def definition(q: SweepQuantity) -> str:
    """A text that distinguishes definitions that give different numbers."""
    return fingerprint(q.model_dump(mode="json", exclude={"name", "what", "unit", "source"}))


def read_quantity(run: Path, q: SweepQuantity) -> Reading:
    """The number that a run has for a quantity that is not derived."""
    unit = ""
    try:
        value, unit = _value(run, q), _unit(run, q)
        why = "" if np.isfinite(value) else f"take = '{q.take}' finds no number"
    except (BadCase, NoReading, NoRun, NotRecorded, BadTable, BadFormula) as error:
        value, why = np.nan, str(error)
    return Reading(float(value), why, definition(q), unit)


def _unit(run: Path, q: SweepQuantity) -> str:
    """The unit of what `take` makes of a column of a history, or of a plain figure; "" of anything else."""
    if q.figure is not None:
        return PLAIN.get(q.figure, ("", ""))[1]
    if q.take in ("period", "arrival"):
        return "s"
    if q.table is None or q.column is None or q.formula is not None:
        return ""
    unit = next(c.unit for c in read_history(run / q.table).columns if c.name == q.column)
    if q.take != "integral":
        return unit
    return unit.removesuffix("/s") if unit.endswith("/s") else f"{unit} s".removeprefix("1 ")


def _value(run: Path, q: SweepQuantity) -> float:
    if q.damage == "joints":
        return joints_broken(run, q.of)
    if q.damage is not None:
        return drift(run, q) if q.damage == "drift" else drop(run, q)
    if q.formula is not None:
        return taken(q, _formula(run, q))
    return read(run, q, q.name)


def _formula(run: Path, q: SweepQuantity) -> Curve:
    path = run / q.table
    if not path.exists():
        raise NoReading(f"no {q.table}")
    columns = read_history(path).values
    numbers = {name: values for name, values in columns.items() if values.dtype.kind == "f"}
    if not len(columns["time"]):
        raise NoReading(f"{q.table} has no rows")
    return Curve(columns["time"], evaluate_columns(q.formula, numbers))


def joints_broken(run: Path, of: str | None) -> float:
    """Share of the joints that broke, of those with a block of the group at one end or both."""
    path = run / "cracks.csv"
    if not path.exists():
        raise NoReading("no cracks.csv: the run has no joints, or did not begin")
    found = read_history(path)
    counted = np.ones(len(found["intact"]), bool)
    if of is not None:
        own = _rows_of(run, of)
        counted = own[found["a"].astype(int)] | (own[found["b"].astype(int)] & (found["b"] >= 0))
    if not counted.any():
        raise NoReading(f"no joints at '{of}'" if of else "no joints")
    return float(np.mean(found["intact"][counted] == 0))


def drift(run: Path, q: SweepQuantity) -> float:
    """Largest drift ratio: difference of the lateral displacements at the two heights over their distance. Level ground
    does not move; at a lower end under the blocks that count are those that they stand on."""
    path = run / "blocks.vtkhdf"
    middle = middles(path)
    own = _rows_of(run, q.of) if q.of else np.ones(middle.shape[1], bool)
    slack = SAME_COURSE * float(np.median(heights(path)[own]))
    upper = _way(middle, own, q.upper, slack)
    if q.lower <= _ground(run) + slack:
        lower = np.zeros_like(upper)
    else:
        lower = _way(middle, _own_or_under(middle, own, q.lower, slack), q.lower, slack)
    return float(np.linalg.norm((upper - lower)[:, :2], axis=1).max() / (q.upper - q.lower))


def _ground(run: Path) -> float:
    """Height [m] of the level ground that the structure stands on: that of structure.ground, or the floor of a tank
    without terrain; -inf where there is none. Raises NoRun."""
    case = read_summary(run)["case"]
    ground, tank = (case.get("structure") or {}).get("ground"), case.get("tank") or {}
    if ground:
        return float(ground["level"])
    return -np.inf if case.get("terrain") or not tank.get("lower") else float(tank["lower"][2])


def _own_or_under(middle: Array, own: Array, height: float, slack: float) -> Array:
    """Blocks (n,) bool of which some stood at a height: the own ones, and below the lowest of them also the others that
    stood within their extent in plan, on which they may stand."""
    start = middle[0]
    if height >= start[own, 2].min() - slack:
        return own
    low, high = start[own, :2].min(axis=0) - slack, start[own, :2].max(axis=0) + slack
    return own | ((start[:, :2] >= low) & (start[:, :2] <= high)).all(axis=1)


def _way(middle: Array, counted: Array, height: float, slack: float) -> Array:
    """Mean displacement (steps, 3) [m] of those of the counted blocks that stood nearest to a height, within slack
    [m]."""
    distance = np.where(counted, np.abs(middle[0, :, 2] - height), np.inf)
    near = distance <= distance.min() + slack
    return (middle[:, near] - middle[0, near]).mean(axis=1)


def drop(run: Path, q: SweepQuantity) -> float:
    """Mean fall at the end of the blocks that stood between two heights, over their distance."""
    middle = middles(run / "blocks.vtkhdf")
    own = _rows_of(run, q.of) if q.of else np.ones(middle.shape[1], bool)
    start = middle[0, :, 2]
    between = own & (start >= q.lower) & (start <= q.upper)
    if not between.any():
        raise NoReading(f"no block between the heights {q.lower:g} and {q.upper:g} m")
    return float((start - middle[-1, :, 2])[between].mean() / (q.upper - q.lower))


@lru_cache(maxsize=2)
def middles(path: Path) -> Array:
    """Middle of the corners of every block at every written state (steps, n, 3) [m]."""
    corners, owner = _corners(path)
    number = np.bincount(owner).astype(float)
    return np.stack(
        [[np.bincount(owner, weights=step[:, axis]) / number for axis in range(3)] for step in corners]
    ).transpose(0, 2, 1)


@lru_cache(maxsize=2)
def heights(path: Path) -> Array:
    """Vertical extent (n,) [m] of every block at the first written state."""
    corners, owner = _corners(path, states=1)
    low, high = np.full(owner.max() + 1, np.inf), np.full(owner.max() + 1, -np.inf)
    np.minimum.at(low, owner, corners[0, :, 2])
    np.maximum.at(high, owner, corners[0, :, 2])
    return high - low


def _corners(path: Path, states: int | None = None) -> tuple[Array, Array]:
    """Corners (steps, m, 3) [m] of all blocks at the first written states (all of them without a number), and the block
    (m,) that each is of. Raises NoReading."""
    try:
        with vtkhdf.opened(path, "r") as file:
            root = file["VTKHDF"]
            steps, corners = vtkhdf.count(root), int(root["NumberOfPoints"][0])
            steps = steps if states is None else min(steps, states)
            points = root["Points"][: steps * corners].reshape(steps, corners, 3).astype(float)
            points += file["scene"].attrs["origin"]
            ends = root["Polygons/Offsets"][1:]
            owner = np.zeros(corners, int)
            faces = np.repeat(root["CellData/block"][: len(ends)], np.diff(ends, prepend=0))
            owner[root["Polygons/Connectivity"][: len(faces)]] = faces
    except vtkhdf.UNREADABLE as error:
        raise NoReading(f"{path.name} cannot be read: {error}") from error
    if not steps:
        raise NoReading(f"{path.name} holds no state")
    return points, owner


def _rows_of(run: Path, name: str) -> Array:
    """(n,) bool: the blocks of a group or of that name."""
    path = run / "blocks.vtkhdf"
    try:
        with vtkhdf.opened(path, "r") as file:
            scene, root = file["scene"], file["VTKHDF"]
            names = [text.decode() for text in scene["names"][:]]
            groups = [text.decode() for text in scene["group_names"][:]]
            faces = len(root["Polygons/Offsets"]) - 1
            group = np.zeros(len(names), int)
            group[root["CellData/block"][:faces]] = root["CellData/group"][:faces]
    except vtkhdf.UNREADABLE as error:
        raise NoReading(f"{path.name} cannot be read: {error}") from error
    if name in groups:
        return group == groups.index(name)
    if name in names:
        return np.array([other == name for other in names])
    known = [*groups, *names]
    raise NoReading(f"no group or block '{name}'{did_you_mean(name, known)}; there are {', '.join(groups)}")
