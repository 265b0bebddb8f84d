"""Loads on a group of blocks or on each of them, split by their origin: tables `history/loads_NAME.csv`.

Part        force on a block, mean over the step                          absent without
pressure    -∫ p n dA over its wetted faces                               [water]
friction    viscous stress and friction of the water along its faces      [water]
contact     of other blocks, held ones and solids too, of ground and tank [contact]
joint       joints with other blocks and the ground                       [joints]
weight      m g                                                           [structure]

Moments are about one fixed point.  The sum of the parts over a step is the change of momentum, and of angular momentum
about that point, of blocks that move freely, to round-off; for held blocks it is the load on their supports.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from array_types import Array
from coupler.results.gauge_windows import Windows

PARTS = {
    "pressure": "pressure of the water",
    "friction": "viscosity and friction of the water along the faces",
    "contact": "contact with other blocks, solids, ground and tank",
    "joint": "joints with other blocks and the ground",
    "weight": "weight",
}
WHOLE_RUN = (0.0, np.inf)


def loads(coupling, record, rows: Array, point: Array) -> dict[str, Array]:
    """Mean over the step of each part of the loads on the bodies `rows` (k,): name → (k, 6) [N, N m], moments about
    `point` (3,)."""
    n = 0 if coupling.structure is None else coupling.structure.n
    blocks, solids = rows[rows < n], rows[rows >= n]
    found = {name: np.zeros((len(rows), 6)) for name in PARTS}
    for name, load in _of_water(coupling, record).items():
        found[name][rows >= n] = _about(point, load[solids], _centre(coupling, solids))
        if len(blocks):
            found[name][rows < n] = record.impulses.of_held(load[:n], point)[blocks] / record.dt
    if len(blocks):
        J, s = record.impulses, coupling.structure
        acting = (J.about(point, J.contact), J.about(point, J.joint), J.of_weight(s.gravity_force(), point))
        for name, impulse in zip(("contact", "joint", "weight"), acting):
            found[name][rows < n] = impulse[blocks] / record.dt
    return found


def _of_water(coupling, record) -> dict[str, Array]:
    if coupling.water is None:
        return {}
    return {"pressure": record.load - record.shear_load, "friction": record.shear_load}


def _centre(coupling, rows: Array) -> Array:
    return coupling.water.domain.body_centre[rows] if len(rows) else np.zeros((0, 3))


def _about(point: Array, load: Array, centre: Array) -> Array:
    """Loads (k, 6) about their centres (k, 3), with moments about a point."""
    moment = load[:, 3:] + np.cross(centre - point, load[:, :3])
    return np.concatenate([load[:, :3], moment], axis=1)


def _vectors(prefix: str, meaning: str, about: str) -> list[tuple[str, str, str]]:
    force = [(f"{prefix}_force_{a}", "N", f"force of {meaning}") for a in "xyz"]
    return force + [(f"{prefix}_moment_{a}", "N m", f"its moment about {about}") for a in "xyz"]


class GroupLoads:
    """The loads on a group, a row a step. rows (k,) · point (3,) [m] · parts: names that the case has · impulse: window
    [s] of the impulses, None for the whole run · mean_over [s] of means and peaks, None for none."""

    def __init__(self, rows, point, parts: list[str], impulse=None, mean_over=None):
        self.rows, self.point = np.asarray(rows), np.asarray(point, float)
        self.names = [*parts, "total"]
        self.windows = {name: Windows(impulse or WHOLE_RUN, mean_over) for name in self.names}
        self._columns = [name for name, *_ in self.columns()]

    def columns(self) -> list[tuple[str, str, str]]:
        """Name, unit, meaning of what `read` gives, time first."""
        about = "({:g}, {:g}, {:g})".format(*self.point)
        listed = [("time", "s", "time at the end of the step; forces are means over the step")]
        for name in self.names:
            listed += _vectors(name, PARTS.get(name, "all parts"), about)
            listed += self.windows[name].columns(name, "N", ("_x", "_y", "_z"))
        return listed

    def read(self, coupling, record) -> list[dict[str, float]]:
        """The row of this step."""
        found = loads(coupling, record, self.rows, self.point)
        sums = {name: found[name].sum(axis=0) for name in self.names if name != "total"}
        sums["total"] = sum(sums.values())
        values = [record.time]
        for name in self.names:
            values += [*sums[name], *self.windows[name].add(record.time, record.dt, sums[name][:3])]
        return [{name: float(v) for name, v in zip(self._columns, values)}]

    def save(self) -> dict[str, Array]:
        """What has been accumulated."""
        return {f"{n}_{key}": a for n, w in self.windows.items() for key, a in w.save().items()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        for name, window in self.windows.items():
            start = f"{name}_"
            own = {k.removeprefix(start): a for k, a in saved.items() if k.startswith(start)}
            window.restore(own)


@dataclass
class BlockLoads:
    """The loads on each block of a group: a row a block whenever `every` [s] has passed (None: every step), means since
    the row before. Moments are about the centres that the blocks had at the start, centres (k, 3).

    rows (k,) · names (k,) of the blocks · parts: names that the case has."""

    rows: Array
    names: list[str]
    centres: Array
    parts: list[str]
    every: float | None = None
    _impulse: dict[str, Array] = field(default_factory=dict)
    _since: float = 0.0

    def __post_init__(self):
        self._start(0.0)

    def _start(self, time: float) -> None:
        self._impulse = {name: np.zeros((len(self.rows), 6)) for name in self.parts}
        self._since = time

    def columns(self) -> list[tuple[str, str, str]]:
        """Name, unit, meaning of what `read` gives, time first."""
        listed = [("time", "s", "time at the end of the interval"), ("block", "", "name of the block")]
        listed.append(("over", "s", "length of the interval that the means are over"))
        for name in self.parts:
            listed += _vectors(name, PARTS[name], "the centre of the block at the start")
        return listed

    def read(self, coupling, record) -> list[dict]:
        """The rows that are due: none, or one for each block."""
        found = loads(coupling, record, self.rows, np.zeros(3))
        for name in self.parts:
            force, moment = found[name][:, :3], found[name][:, 3:]
            own = np.concatenate([force, moment - np.cross(self.centres, force)], axis=1)
            self._impulse[name] += record.dt * own
        if self.every is not None and not _passed(self._since, record.time, self.every):
            return []
        span = record.time - self._since
        names = [name for name, *_ in self.columns()]
        rows = [
            dict(
                zip(
                    names,
                    [record.time, block, span, *(v for p in self.parts for v in self._impulse[p][k] / span)],
                )
            )
            for k, block in enumerate(self.names)
        ]
        self._start(record.time)
        return rows

    def save(self) -> dict[str, Array]:
        """What has been accumulated."""
        return {"since": np.array(self._since)} | {n: a.copy() for n, a in self._impulse.items()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Return to what `save` gave."""
        self._since = float(saved["since"])
        self._impulse = {name: saved[name].copy() for name in self.parts}


def _passed(since: float, now: float, every: float) -> bool:
    """Whether a multiple of `every` [s] lies in (since, now]; a time that is early by rounding alone counts as
    equal."""
    return np.floor(now / every * (1.0 + 1e-9)) > np.floor(since / every * (1.0 + 1e-9))
