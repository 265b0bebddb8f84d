"""The verdict of a run, as plain data for run.json, from the quantities that were followed and the state of the
joints."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np

from array_types import Array
from coupler.verdict.attitude import OVER, UPRIGHT, shift_of, tilt_of
from coupler.verdict.damage import Blocks, Damage, Joints, damage
from coupler.verdict.divisions import Division
from coupler.verdict.rocking import rocking
from coupler.verdict.watch import HIT_COLUMNS, Peaks, Watch

if TYPE_CHECKING:
    from yade_scripts.dynamics.structure import Structure

MOST_LISTED = 25
"""Blocks that left their place, and hits, that are listed one by one; tables hold them all."""

LEAVING = 0.1
"""Share of the way to where a block has left its place from which it is followed as one that leaves it."""


def verdict(structure: Structure, watch: Watch) -> dict:
    """The whole verdict; times in s, places in m, forces in N, SI throughout; None where there is no value.

    structure: with its present joint table."""
    away, rocks = _out_of_place(structure, watch)
    blocks = Blocks(structure.mass, watch.facts.thickness, watch.moved, away & ~rocks)
    joints = joints_of(structure)
    places = places_of(structure)

    def of(division: Division) -> list[dict]:
        label = np.where(structure.fixed, -1, division.label)
        found = damage(label, division.names, blocks, joints, watch.rules)
        return [_reported(d, structure, places) for d in found if d.blocks]

    judged = np.where(watch.judged, 0, -1)
    (whole,) = damage(judged, ["structure"], blocks, joints, watch.rules)
    bodies = of(watch.divisions.bodies)
    _complete(bodies, watch)
    members = of(watch.divisions.members)
    return _reported(whole, structure, places) | {
        "rules": asdict(watch.rules),
        "largest": _largest(watch, len(watch.divisions.bodies.names), judged=True),
        "bodies": bodies,
        "members": members,
        "storeys": of(watch.divisions.storeys),
        "order": [m["name"] for m in sorted(_broken(members), key=lambda m: m["first_break"]["time"])],
        "displaced": _displaced(structure, watch, away, rocks),
        "leaving": _leaving(structure, watch),
        "rising": watch.trend.rising(_weight(structure, watch)),
        "hits": _hits(structure, watch),
    }


def _weight(structure: Structure, watch: Watch) -> float:
    """Weight [N] of the blocks that the verdict is about."""
    return float(structure.mass[watch.judged].sum() * np.linalg.norm(structure.gravity))


def _out_of_place(structure: Structure, watch: Watch) -> tuple[Array, Array]:
    """(n,) bool: blocks that are out of their place now, and those of them that rock."""
    reach = watch.rules.moved * watch.facts.thickness
    away = np.linalg.norm(structure.centre() - watch.facts.centre, axis=1) > reach
    return away, rocking(structure, away, reach)


def joints_of(structure: Structure) -> Joints:
    """The joints as input of `damage`; a joint is broken when it carries no load any more."""
    table = structure.joint_table()
    if table is None:
        return Joints.none()
    return Joints(table.a, table.b, table.area, np.where(table.alive, np.nan, table.failure_time), table.torn)


def places_of(structure: Structure) -> Array:
    """Centre of each joint at the start (J, 3) [m]."""
    corners, start = structure.joint_polygons(at_start=True)
    count = np.diff(start)
    sums = np.add.reduceat(corners, start[:-1], axis=0) if len(count) else np.zeros((0, 3))
    return sums / count[:, None]


def _reported(found: Damage, structure: Structure, places: Array) -> dict:
    first = None
    if found.first_joint >= 0:
        first = {"time": found.first_break, "place": places[found.first_joint].tolist()}
        first["blocks"] = _pair(structure, found.first_joint)
    farthest = structure.names[found.farthest_block] if found.farthest_block >= 0 else None
    return {
        "name": found.name,
        "state": found.state.word,
        "word": found.word,
        "rule": found.rule,
        "blocks": found.blocks,
        "blocks_moved": found.blocks_moved,
        "blocks_out": found.blocks_out,
        "joints": found.joints,
        "joints_broken": found.joints_broken,
        "joints_torn": found.joints_torn,
        "area_broken": found.area_broken,
        "area_torn": found.area_torn,
        "weight_moved": found.weight_moved,
        "weight_out": found.weight_out,
        "farthest": {"block": farthest, "way": found.farthest},
        "first_break": first,
    }


def _pair(structure: Structure, joint: int) -> list[str]:
    assert structure.joints is not None  # one of them broke
    a, b = int(structure.joints.a[joint]), int(structure.joints.b[joint])
    return [structure.names[a], structure.names[b] if b >= 0 else "ground"]


def _broken(groups: list[dict]) -> list[dict]:
    return [group for group in groups if group["first_break"]]


def _complete(bodies: list[dict], watch: Watch) -> None:
    """Add to each body its largest loads, and whether the verdict is about any of its blocks."""
    for body in bodies:
        k = watch.divisions.bodies.names.index(body["name"])
        body["largest"] = _largest(watch, k)
        body["judged"] = bool(watch.judged[watch.divisions.bodies.label == k].any())


def _largest(watch: Watch, k: int, judged: bool = False) -> dict:
    """Largest force, horizontal force and overturning moment of the water, and depth beside it; None for values that
    never occurred.

    Of several judged bodies the moment is that of the one with the largest: about a point amid the houses of a town,
    the uplift of a single one would count with the width of a street as its lever."""
    own = np.unique(watch.divisions.bodies.label[watch.judged]) if judged else np.array([k])
    own = own[own >= 0]
    turned = int(own[np.argmax(watch.moment.value[own])]) if len(own) > 1 else k
    force, push, moment = _peak(watch.force, k), _peak(watch.push, k), _peak(watch.moment, turned)
    if force:
        force["direction"] = watch.direction[k].tolist()
    if moment:
        moment["about"] = watch.foot[turned].tolist()
        if len(own) > 1:
            moment["of"] = watch.divisions.bodies.names[turned]
    if judged:
        k = int(own[np.argmax(watch.depth.value[own])]) if len(own) else 0
    depth = _peak(watch.depth, k) if len(watch.depth.value) else None
    if depth:
        depth["place"] = watch.depth_at[k].tolist()
    return {"force": force, "horizontal": push, "moment": moment, "depth": depth}


def _peak(peaks: Peaks, k: int) -> dict | None:
    if not peaks.value[k] > 0.0:
        return None
    return {"value": float(peaks.value[k]), "time": float(peaks.time[k])}


def _displaced(structure: Structure, watch: Watch, away: Array, rocks: Array) -> dict:
    """Blocks that left their place, those that went farthest first; how many of them came back, and how many rock; how
    many are upright, lean and have overturned at the end."""
    gone = np.flatnonzero(~np.isnan(watch.left_at) & watch.judged)
    order = gone[np.argsort(-watch.moved[gone], kind="stable")]
    shift, tilt = shift_of(structure), tilt_of(structure)
    reported = [
        {
            "block": structure.names[i],
            "way": float(watch.moved[i]),
            "left_at": float(watch.left_at[i]),
            "shift": shift[i].tolist(),
            "tilt": float(tilt[i]),
        }
        for i in order[:MOST_LISTED]
    ]
    over, upright = tilt[gone] > OVER, tilt[gone] <= UPRIGHT
    return {
        "blocks": len(gone),
        "back": int((~away[gone]).sum()),
        "rocking": int(rocks[gone].sum()),
        "upright": int(upright.sum()),
        "leaning": int((~upright & ~over).sum()),
        "overturned": int(over.sum()),
        "first": float(watch.left_at[gone].min()) if len(gone) else None,
        "list": reported,
    }


def _leaving(structure: Structure, watch: Watch) -> dict | None:
    """The judged block that leaves its place next at its present speed away from it: its way [m], that speed [m/s] and
    the time [s] until then. None while none is farther out than ever and has gone LEAVING of the way to where it has
    left: the rest swings or trembles."""
    limit = watch.rules.moved * watch.facts.thickness
    way = structure.centre() - watch.facts.centre
    gone = np.linalg.norm(way, axis=1)
    away = np.einsum("ni,ni->n", structure.velocity()[:, :3], way) / np.where(gone > 0.0, gone, 1.0)
    going = (
        watch.judged
        & np.isnan(watch.left_at)
        & (gone > LEAVING * limit)
        & (gone >= watch.moved)
        & (away > 0.0)
    )
    if not going.any():
        return None
    left = np.where(going, (limit - gone) / np.where(going, away, 1.0), np.inf)
    i = int(left.argmin())
    return {
        "block": structure.names[i],
        "way": float(gone[i]),
        "speed": float(away[i]),
        "within": float(left[i]),
    }


def _hits(structure: Structure, watch: Watch) -> dict:
    found = [dict(zip(HIT_COLUMNS, row)) for row in watch.hits.tolist()]
    reported = [
        {
            "time": hit["time"],
            "block": structure.names[int(hit["block"])],
            "other": structure.names[int(hit["other"])],
            "place": [hit["x"], hit["y"], hit["z"]],
            **{name: hit[name] for name in ("speed", "impulse", "force")},
        }
        for hit in found
    ]
    return {"pairs": len(reported), "list": reported[:MOST_LISTED]}
