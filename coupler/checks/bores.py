"""Depth and velocity of a bore where it meets the structure, from theory: on level ground or up on a quay.

A bore of depth h₂ and velocity u₂ that meets a step of height z (a quay) sends a bore h₃ back, behind which the water
has the head for the flow over the edge, critical there (the depth on dry ground behind it is at most that of the edge):

    u₃ = u₂ - (h₃ - h₂) sqrt(g (h₂ + h₃) / (2 h₂ h₃)),    h₃ u₃ = q,    h₃ + u₃²/2g = z + 3/2 (q²/g)^(1/3)

A slower bore lowers the level in front of the edge instead, u₃ = u₂ + 2 (sqrt(g h₂) - sqrt(g h₃)); a faster one (u₂ >
sqrt(g h₂)) whose head is enough passes without a bore back, with its own q and head. Stopped by a wall, h₃ follows from
u₃ = 0. Stoker, Water Waves, 1957, 10.6 (shocks, drops); Henderson, Open Channel Flow, 1966, 2.5 (steps). On dry ground
there is no shock: the water thins out to a tip that runs at u + 2 sqrt(g h) (Ritter, Z. VDI 36, 1892, 947-954). The
theory has no friction or losses and assumes a structure as wide as the tank; it is an upper bound where water can flow
around."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from coupler.case.case import Case
from coupler.case.water import BoreInflow
from coupler.geometry.parts import parts_of
from coupler.geometry.solids import solids_of
from coupler.geometry.tank_mesh import mean_bed
from coupler.scene.build_water import bore_velocity

LEVEL = 0.02
"""Share of the depth of a bore by which ground may be higher and count as level."""


@dataclass(frozen=True)
class Bore:
    """side · depth [m], velocity [m/s] and speed of the front [m/s] where it comes in (on dry ground that of the tip,
    which runs ahead of the depth behind it) · at: name of the structure · step [m]: height of what the structure stands
    on over the bed · depth_there [m], velocity_there [m/s]: 0 where the step is too high · against_wall [m]: depth
    where a wall stops it · arrival [s]: of the front at the structure"""

    side: str
    depth: float
    velocity: float
    front: float
    at: str
    step: float
    depth_there: float
    velocity_there: float
    against_wall: float
    arrival: float

    def as_table(self) -> dict[str, Any]:
        """Plain data for run.json."""
        return asdict(self)


def bores(case: Case) -> Iterator[Bore]:
    """Every bore, on water or dry ground, where it meets the structure. There are none over terrain, whose bed changes
    a bore on its way."""
    if case.water is None or case.tank is None or not case.tank.is_box or case.structure is None:
        return
    found = structure_of(case)
    if found is None:
        return
    name, low, high = found
    g = case.case.gravity
    for spec in case.water.inflow:
        if spec.kind != "bore":
            continue
        axis, inward = "xyz".index(spec.side[0]), 1.0 if spec.side[1] == "-" else -1.0
        bed = mean_bed(case.tank, spec.side, spec.level)
        depth, velocity, front = at_side(case, spec)
        ahead = 0.0 if spec.ahead is None else spec.ahead - bed
        start = (case.tank.lower if inward > 0 else case.tank.upper)[axis]
        face = (low if inward > 0 else high)[axis]
        step = max(float(low[2]) - bed, 0.0)
        if (
            step <= ahead * (1.0 - LEVEL) or step <= LEVEL * depth
        ):  # it stands in the water or on the bed itself
            there, over, way = (depth, velocity), 0.0, inward * (face - start) / front
        else:
            edge = _edge(case, axis, inward, float(low[2]), face)
            there, over = over_step(depth, velocity, step, g), step
            on_top = there[1] + 2.0 * math.sqrt(g * there[0])
            way = inward * (edge - start) / front + (
                inward * (face - edge) / on_top if on_top > 0.0 else math.inf
            )
        yield Bore(
            side=spec.side,
            depth=depth,
            velocity=velocity,
            front=front,
            at=name,
            step=over,
            depth_there=there[0],
            velocity_there=there[1],
            against_wall=against_wall(*there, g) if there[0] > 0.0 else 0.0,
            arrival=way,
        )


def at_side(case: Case, spec: BoreInflow) -> tuple[float, float, float]:
    """Depth [m] and velocity [m/s] of a bore where it comes in, and speed [m/s] of its front over the bed there."""
    bed = mean_bed(case.tank, spec.side, spec.level)
    depth, velocity = spec.level - bed, bore_velocity(case, spec)
    ahead = 0.0 if spec.ahead is None else spec.ahead - bed
    if ahead > 0.0:
        return depth, velocity, velocity * depth / (depth - ahead)
    return depth, velocity, velocity + 2.0 * math.sqrt(case.case.gravity * depth)


def in_words(bore: Bore) -> str:
    """One line for `check` and the log of a run."""
    begins = (
        f"bore at {bore.side}: {bore.depth:.3g} m deep and {bore.velocity:.3g} m/s fast, "
        f"its front {bore.front:.3g} m/s"
    )
    if not bore.depth_there > 0.0:
        return f"{begins}; by theory it does not get onto the step of {bore.step:.3g} m before {bore.at}"
    over = f" on top of the step of {bore.step:.3g} m" if bore.step > 0.0 else ""
    return (
        f"{begins}; by theory (no friction) at {bore.at}{over} up to {bore.depth_there:.3g} m deep and "
        f"{bore.velocity_there:.3g} m/s fast, not before t = {bore.arrival:.2g} s, and {bore.against_wall:.3g} m "
        "deep where a wall across the tank stops it"
    )


def over_step(depth: float, velocity: float, step: float, g: float) -> tuple[float, float]:
    """Depth [m] and velocity [m/s] on top of a step [m] that a bore of this depth [m] and velocity [m/s] meets; zeros
    where the step holds it."""
    highest = against_wall(depth, velocity, g)
    if highest <= step:
        return 0.0, 0.0

    def excess(back: float) -> float:
        """Discharge that reaches the edge in excess of what can pass it, where the water before it is `back` deep."""
        u = _behind_back(depth, velocity, back, g)
        head = max(back + u * u / (2.0 * g) - step, 0.0)
        return back * u - math.sqrt(g) * (2.0 / 3.0 * head) ** 1.5

    if excess(depth) < 0.0 and velocity * velocity > g * depth:
        return _passing(depth, velocity, step, g)
    critical_before = ((velocity + 2.0 * math.sqrt(g * depth)) / 3.0) ** 2 / g
    low, high = (depth, highest) if excess(depth) >= 0.0 else (min(critical_before, depth), depth)
    back = _root(excess, low, high)
    passing = max(back * _behind_back(depth, velocity, back, g), 0.0)
    critical = (passing**2 / g) ** (1.0 / 3.0)
    return critical, math.sqrt(g * critical)


def against_wall(depth: float, velocity: float, g: float) -> float:
    """Depth [m] at a wall that stops water of this depth [m] and velocity [m/s]."""
    return _root(
        lambda back: _behind_back(depth, velocity, back, g), depth, depth + 4.0 * _rise(depth, velocity, g)
    )


def _rise(depth: float, velocity: float, g: float) -> float:
    return velocity * velocity / g + velocity * math.sqrt(depth / g)


def _behind_back(depth: float, velocity: float, back: float, g: float) -> float:
    """Velocity [m/s] where the bore, or the drop of the surface, that runs back has made the water `back` deep."""
    if back < depth:
        return velocity + 2.0 * (math.sqrt(g * depth) - math.sqrt(g * back))
    return velocity - (back - depth) * math.sqrt(g * (back + depth) / (2.0 * back * depth))


def _passing(depth: float, velocity: float, step: float, g: float) -> tuple[float, float]:
    """Depth [m] and velocity [m/s] of supercritical water over a step, with unchanged discharge and head."""
    q, head = depth * velocity, depth + velocity * velocity / (2.0 * g) - step
    critical = (q * q / g) ** (1.0 / 3.0)
    there = _root(lambda h: h + q * q / (2.0 * g * h * h) - head, 1e-6 * critical, critical)
    return there, q / there


def _root(value: Callable[[float], float], low: float, high: float) -> float:
    """Zero of a decreasing function, by bisection."""
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if value(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def structure_of(case: Case) -> tuple[str, np.ndarray, np.ndarray] | None:
    """Name, lower and upper corner (3,) [m] of the structure: the bodies that [verdict] names, else all that can
    move."""
    wanted = set(case.verdict.on)
    blocks = [
        (part.name, block)
        for part in parts_of(case)
        for block in part.blocks
        if not (block.fixed or block.driven) and (not wanted or {part.name, block.group, block.name} & wanted)
    ]
    if not blocks:
        return None
    names = list(dict.fromkeys(name for name, _ in blocks))
    corners = np.concatenate([block.world_vertices() for _, block in blocks])
    return names[0] if len(names) == 1 else "the structure", corners.min(axis=0), corners.max(axis=0)


def _edge(case: Case, axis: int, inward: float, top: float, face: float) -> float:
    """Coordinate [m] at which the ground at this height [m] begins, seen from the bore; without any, the structure's
    face."""
    ends = [
        solid.vertices[:, axis].min() if inward > 0 else solid.vertices[:, axis].max()
        for solid in solids_of(case)
        if abs(float(solid.vertices[:, 2].max()) - top) <= LEVEL * max(abs(top), 1.0)
    ]
    before = [end for end in ends if inward * (face - end) >= 0.0]
    return float(max(before, key=lambda end: inward * (face - end))) if before else face
