"""Quantities that a run follows for its verdict: displacements of blocks, largest loads, impacts of debris, depths.

They cost little compared with a step, do not affect it, and are stored in checkpoints, so that a continued run has the
same verdict.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array, Floats
from coupler.verdict.damage import Rules
from coupler.verdict.divisions import Divisions
from coupler.verdict.pressed import Pressed
from coupler.verdict.trend import Trend

if TYPE_CHECKING:
    from coupler.step.coupled_step import CoupledStepper
    from coupler.step.record import StepRecord
    from fluid.step.water import Water
    from yade_scripts.blocks.block import Block
    from yade_scripts.dynamics.structure import Structure


FALL = 0.01
"""Share of a block's thickness: a hit must cost the block the speed of a fall of this height in a step, by default.
A container of 2.6 m must lose 0.7 m/s, a crate of 0.4 m 0.3 m/s. With a tenth it was 2.3 m/s, faster than many currents
that carry containers; smaller losses are those of debris that settles."""
ANSWERS = 0.2
"""Least share of the impulse on a block that another block must have received in reverse to count as the one hit."""
HIT_COLUMNS = ("time", "block", "other", "speed", "impulse", "force", "x", "y", "z")
"""Of a hit: [s] · rows · speed [m/s] lost in the step · impulse [N s] and its mean over the step [N] · place [m]."""


@dataclass
class Peaks:
    """The largest of a quantity for each of k groups: value (k,), time (k,) [s], NaN before the first."""

    value: Floats
    time: Floats

    @classmethod
    def none(cls, k: int) -> Peaks:
        """No value yet, for k rows: zeros at no time (NaN)."""
        return cls(np.zeros(k), np.full(k, np.nan))

    def take(self, value: Array, time: float) -> Array:
        """Keep the larger values; returns (k,) bool, where the new value was larger."""
        larger = value > self.value
        self.value[larger], self.time[larger] = value[larger], time
        return larger


@dataclass(frozen=True)
class Facts:
    """Data of the blocks at the start, fixed solids included, one row each: centre (n, 3) [m] · thickness (n,) [m] ·
    radius (n,) [m] · lower, upper (n, 3) [m]: their extents"""

    centre: Floats
    thickness: Floats
    radius: Floats
    lower: Floats = field(repr=False)
    upper: Floats = field(repr=False)

    @classmethod
    def of(cls, blocks: list[Block]) -> Facts:
        """blocks: yade_scripts Block."""
        world = [block.world_vertices() for block in blocks]
        return cls(
            centre=np.array([block.centre for block in blocks]),
            thickness=2.0 * np.array([block.planes[1].min() for block in blocks]),
            radius=np.array([np.linalg.norm(x - b.centre, axis=1).max() for x, b in zip(world, blocks)]),
            lower=np.array([x.min(axis=0) for x in world]),
            upper=np.array([x.max(axis=0) for x in world]),
        )


@dataclass(frozen=True)
class _Blow:
    """change (n, 3) [m/s] of the velocity of each block in a time dt [s] · impulse (n, 3) [N s] of its contacts"""

    change: Floats
    impulse: Floats
    dt: float

    @property
    def size(self) -> Floats:
        """(n,) [N s]"""
        return np.linalg.norm(self.impulse, axis=1)

    @property
    def lost(self) -> Floats:
        """(n,) [m/s] speed that each block lost against its contacts; zero without one."""
        size = self.size
        along = np.einsum("ni,ni->n", self.change, self.impulse)
        return np.divide(along, size, out=np.zeros(len(size)), where=size > 0.0)

    def strikes(self, mass: Array, speed: Array) -> Array:
        """(n,) bool: blocks of these masses [kg] whose contacts took at least this speed [m/s]."""
        size = self.size
        return (size > 0.0) & (self.lost >= speed) & (size >= mass * speed)


class Watch:
    """structure: yade_scripts Structure · divisions: of its blocks · rules of the verdict · judged (n,) bool: blocks
    that it is about · hit_speed [m/s] or None"""

    def __init__(
        self,
        structure: Structure,
        divisions: Divisions,
        rules: Rules,
        judged: Array,
        hit_speed: float | None = None,
    ) -> None:
        self.divisions, self.rules, self.judged = divisions, rules, np.asarray(judged, bool)
        n, bodies = structure.n, len(divisions.bodies.names)
        self.facts = Facts.of(structure.blocks)
        self._pressed = Pressed.of(structure.blocks, divisions.members.label)
        self.foot = self._feet()
        self.moved = np.zeros(n)
        self.left_at = np.full(n, np.nan)
        self.pressure = Peaks.none(n)
        self.force, self.push, self.moment = (Peaks.none(bodies + 1) for _ in range(3))
        self.trend = Trend.none()
        self._force_now: Array | None = None
        self.direction, self.impulse = np.zeros((bodies + 1, 3)), np.zeros((bodies + 1, 3))
        self.depth = Peaks.none(bodies)
        self.depth_at = np.full((bodies, 2), np.nan)
        self._before = structure.velocity()[:, :3]
        g = float(np.linalg.norm(structure.gravity))
        fall = np.sqrt(2.0 * g * FALL * self.facts.thickness)
        self._hit_speed = fall if hit_speed is None else np.full(n, hit_speed)
        self._hits: dict[tuple[int, int], tuple[float, ...]] = {}
        self._blow = _Blow(np.zeros((n, 3)), np.zeros((n, 3)), 0.0)
        self._never_joined = ~joined(structure)

    def _feet(self) -> Array:
        """Centre of the base of each body, and last that of all judged blocks (bodies + 1, 3) [m]."""
        label, f = self.divisions.bodies.label, self.facts
        groups = [label == k for k in range(len(self.divisions.bodies.names))]
        return np.array([_foot(f.lower[rows], f.upper[rows]) for rows in [*groups, self.judged]])

    # ---- every step

    def step(self, coupling: CoupledStepper, record: StepRecord) -> None:
        """Update all quantities after a coupled step."""
        s = coupling.structure
        velocity = s.velocity()[:, :3]
        way = np.linalg.norm(s.centre() - self.facts.centre, axis=1)
        in_place = np.isnan(self.left_at)
        self._hit(s, record, velocity, in_place)
        np.maximum(self.moved, way, out=self.moved)
        self.left_at[in_place & (way > self.rules.moved * self.facts.thickness)] = record.time
        if len(record.load):
            self._loads(coupling, record, np.isnan(self.left_at))
        self._before = velocity

    def _loads(self, coupling: CoupledStepper, record: StepRecord, in_place: Array) -> None:
        """Force and overturning moment of the water on each body; pressure across blocks that are in their place.

        The levers of the moment are those at the start: the buoyancy of a block that is carried off would count with
        its way, however little the water tilts it."""
        n = coupling.structure.n
        load, centre = record.load[:n], self.facts.centre[:n]
        self.pressure.take(np.where(in_place, self._pressed.pressure(load[:, :3]), 0.0), record.time)
        label = self.divisions.bodies.label
        of_body = np.array([label == k for k in range(len(self.divisions.bodies.names))] + [self.judged])
        force = of_body @ load[:, :3]
        self.impulse += record.dt * force
        self._force_now = np.linalg.norm(force, axis=1)
        larger = self.force.take(self._force_now, record.time)
        self.direction[larger] = force[larger]
        push = np.linalg.norm(force[:, :2], axis=1)
        self.push.take(push, record.time)
        self.trend.take(np.array([push[-1], self._force_now[-1]]), record.time, record.dt)
        about_zero = of_body @ (load[:, 3:] + np.cross(centre, load[:, :3]))
        overturning = about_zero - np.cross(self.foot, force)
        self.moment.take(np.linalg.norm(overturning[:, :2], axis=1), record.time)

    def strongest(self) -> tuple[str, float] | None:
        """The judged body on which the force of the water is the largest now, and that force [N]; None without one."""
        own = np.unique(self.divisions.bodies.label[self.judged])
        own = own[own >= 0]
        if self._force_now is None or not len(own):
            return None
        k = int(own[np.argmax(self._force_now[own])])
        return self.divisions.bodies.names[k], float(self._force_now[k])

    def _hit(self, s: Structure, record: StepRecord, velocity: Array, in_place: Array) -> None:
        """Record debris that lost speed in a contact in this step, or in this and the one before together, and the
        block that it hit."""
        if record.impulses is None:
            return
        debris = (self._never_joined | ~in_place) & ~s.fixed
        now = _Blow(velocity - self._before, record.impulses.contact[:, :3].copy(), record.dt)
        before, self._blow = self._blow, now
        struck = debris & now.strikes(s.mass, self._hit_speed)
        self._hits_among(s, record.time, now, struck, in_place)
        split = (
            debris
            & ~struck
            & ~before.strikes(s.mass, self._hit_speed)
            & (now.lost > 0.0)
            & (before.lost > 0.0)
        )
        both = _Blow(now.change + before.change, now.impulse + before.impulse, now.dt + before.dt)
        self._hits_among(s, record.time, both, split & both.strikes(s.mass, self._hit_speed), in_place)

    def _hits_among(self, s: Structure, time: float, blow: _Blow, struck: Array, in_place: Array) -> None:
        """Keep the hits of the blocks that struck (n,) bool something, where what they hit is found."""
        J, size = blow.impulse, blow.size
        hits = np.flatnonzero(struck)
        x = s.centre() if len(hits) else np.zeros((0, 3))
        for i in hits.tolist():
            near = np.linalg.norm(x - x[i], axis=1) <= self.facts.radius + self.facts.radius[i]
            answer = np.where(near, -(J @ J[i]) / size[i], 0.0)
            answer[i] = 0.0
            j = int(np.argmax(answer))
            if answer[j] >= ANSWERS * size[i] and (in_place[j] or self._other_body(i, j)):
                self._note_hit(i, j, time, blow, x[i])

    def _other_body(self, i: int, j: int) -> bool:
        label = self.divisions.bodies.label
        return label[i] != label[j]

    def _note_hit(self, i: int, j: int, time: float, blow: _Blow, place: Array) -> None:
        """Keep the hit of a pair that has the largest impulse."""
        old, lost, impulse = self._hits.get((i, j)), float(blow.lost[i]), float(blow.size[i])
        if old is None or impulse > old[4]:
            self._hits[i, j] = (time, i, j, lost, impulse, impulse / blow.dt, *map(float, place))

    @property
    def hits(self) -> Array:
        """(k, 9) the hit of each pair with the largest impulse, columns HIT_COLUMNS, largest first."""
        rows = np.array(list(self._hits.values())).reshape(-1, len(HIT_COLUMNS))
        return rows[np.argsort(-rows[:, 4], kind="stable")]

    # ---- at the written states

    def look(self, water: Water, time: float) -> None:
        """The depth of the water around each body."""
        from coupler.verdict.depths import depths_around

        depth, place = depths_around(water, self.divisions.bodies, self.facts.lower, self.facts.upper)
        larger = self.depth.take(depth, time)
        self.depth_at[larger] = place[larger]

    # ---- checkpoints

    def save(self) -> dict[str, Array]:
        """Copies of the quantities so far."""
        peaks = {
            f"{name}_{part}": getattr(getattr(self, name), part).copy()
            for name in _PEAKS
            for part in ("value", "time")
        }
        own = {name: getattr(self, name).copy() for name in _OWN}
        blow = {"change": self._blow.change.copy(), "contact": self._blow.impulse.copy()}
        blow["contact_time"] = np.array(self._blow.dt)
        return {
            **peaks,
            **own,
            **blow,
            "before": self._before.copy(),
            "hits": self.hits,
            "trend": self.trend.array(),
        }

    def restore(self, saved: dict[str, Array]) -> None:
        """Restore the state that `save` returned."""
        for name in _PEAKS:
            setattr(self, name, Peaks(saved[f"{name}_value"].copy(), saved[f"{name}_time"].copy()))
        for name in _OWN:
            setattr(self, name, saved[name].copy())
        self._before = saved["before"].copy()
        self.trend = Trend.of(saved["trend"])
        self._blow = _Blow(saved["change"].copy(), saved["contact"].copy(), float(saved["contact_time"]))
        self._hits = {(int(row[1]), int(row[2])): tuple(row.tolist()) for row in saved["hits"]}


_PEAKS = ("pressure", "force", "push", "moment", "depth")
_OWN = ("moved", "left_at", "direction", "impulse", "depth_at")


def joined(structure: Structure) -> Array:
    """(n,) bool: blocks that had a joint at the start."""
    found = np.zeros(structure.n, bool)
    if structure.joints is not None:
        for side in (structure.joints.a, structure.joints.b):
            found[side[side >= 0]] = True
    return found


def _foot(lower: Array, upper: Array) -> Array:
    """(3,) [m] centre of the blocks' extent in plan, at the level of the lowest block."""
    if not len(lower):
        return np.zeros(3)
    low, high = lower.min(axis=0), upper.max(axis=0)
    return np.array([*(0.5 * (low + high))[:2], low[2]])
