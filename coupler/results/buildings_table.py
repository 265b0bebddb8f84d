"""`buildings.csv`: one row for each body on the terrain, with the flood around it and its damage."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from array_types import Array
from coupler.results.history import Column, write_table
from coupler.results.maps import NEVER, Maps
from coupler.verdict.judge import verdict
from coupler.verdict.watch import Watch

AROUND = 1.5
"""Cells around its footprint within which the flood counts as that of a body."""

COLUMNS = tuple(
    Column(*c)
    for c in (
        ("name", "", "body: building, wall or group"),
        ("x", "m", "middle of its base"),
        ("y", "m", "middle of its base"),
        ("z", "m", "its foot"),
        ("state", "", "stands, damaged or collapsed, by the rules of [verdict]"),
        ("joints", "1", "its joints"),
        ("joints_broken", "1", "those that broke"),
        ("joints_torn", "1", "those that hold by a part of their face, the rest of which has failed"),
        ("area_broken", "1", "share of its joined area that broke"),
        ("weight_moved", "1", "share of its weight that left its place"),
        ("first_break", "s", "when the first joint broke; empty if none did"),
        ("walls", "", "walls and floors with broken joints, the first to break first: name broken/joints"),
        ("force", "N", "largest force of the water, uplift included"),
        ("force_time", "s", "when that was"),
        ("horizontal_force", "N", "largest horizontal force of the water"),
        ("impulse_x", "N s", "force of the water added up over the run"),
        ("impulse_y", "N s", "force of the water added up over the run"),
        ("moment", "N m", "largest overturning moment of the water about the middle of its base"),
        ("moment_time", "s", "when that was"),
        ("depth", "m", "largest depth around it"),
        ("speed", "m/s", "largest speed around it, mean over the depth"),
        ("flux", "m3/s2", "largest h v2 around it"),
        ("arrival", "s", "when the water came; empty where it was wet or stayed dry"),
    )
)


def write_buildings(path, structure, watch: Watch, maps: Maps) -> None:
    """Write the table as a whole, in place of the one before."""
    judged = verdict(structure, watch)
    rows = [_row(body, judged["members"], watch, maps) for body in judged["bodies"]]
    columns = [list(values) for values in zip(*rows)] if rows else [[] for _ in COLUMNS]
    write_table(path, "buildings: the flood around each, and its damage", COLUMNS, columns)


def _row(body: dict, members: list[dict], watch: Watch, maps: Maps) -> tuple:
    k = watch.divisions.bodies.names.index(body["name"])
    largest, first = body["largest"], body["first_break"]
    force, push, moment = (largest[name] or {} for name in ("force", "horizontal", "moment"))
    flood = _around(maps, watch, watch.divisions.bodies.rows(k))
    walls = _walls(body["name"], members, watch.divisions.members_of(k))
    nan = float("nan")
    return (
        body["name"], *watch.foot[k].tolist(), body["state"], body["joints"], body["joints_broken"],
        body["joints_torn"], body["area_broken"], body["weight_moved"], first["time"] if first else nan, walls,
        force.get("value", 0.0), force.get("time", nan), push.get("value", 0.0),
        *watch.impulse[k, :2].tolist(), moment.get("value", 0.0), moment.get("time", nan), *flood,
    )  # fmt: skip


def _walls(body: str, members: list[dict], own: Collection[str]) -> str:
    """The members of a body, by their names, that broke, in the order of their first breaks; a wall or column that is a
    body itself has none."""
    broken = [m for m in members if m["name"] in own and m["name"] != body and m["joints_broken"]]
    broken.sort(key=lambda m: m["first_break"]["time"])
    return " ".join(
        f"{m['name'].removeprefix(f'{body}-')} {m['joints_broken']}/{m['joints']}" for m in broken
    )


def _around(maps: Maps, watch: Watch, rows: Array) -> tuple[float, float, float, float]:
    """Largest depth, speed, h v² and first arrival at the columns around the blocks of a body."""
    fitted, f = maps.fitted, watch.facts
    X, Y = fitted.column_x, fitted.column_y
    low, high = f.lower[rows].min(axis=0)[:2], f.upper[rows].max(axis=0)[:2]
    reach = AROUND * max(_widest(axis, low[k], high[k]) for k, axis in enumerate((X, Y)))
    low, high = low - reach, high + reach
    near = ((low[0] <= X) & (high[0] >= X))[:, None] & ((low[1] <= Y) & (high[1] >= Y))
    near = near.ravel()
    arrival = maps.arrival[near][maps.arrival[near] != NEVER]
    first = float(arrival.min()) if len(arrival) else float("nan")
    depth, speed, flux = (float(of[near].max(initial=0.0)) for of in (maps.depth, maps.speed, maps.flux))
    return depth, speed, flux, first


def _widest(axis: Array, low: float, high: float) -> float:
    """The largest distance of two neighbouring columns [m] between which a part of the range lies."""
    first, last = np.clip(np.searchsorted(axis, [low, high], side="right") - 1, 0, len(axis) - 2)
    return float(np.diff(axis)[first : last + 1].max())
