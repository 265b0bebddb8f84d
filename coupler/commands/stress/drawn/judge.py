"""Judging a random scene from its result files alone: physical quantities and their limits."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

from coupler.case.case import Case
from coupler.commands.stress.registry import Measure
from coupler.geometry.bodies import Body, overlap_depth
from coupler.results import vtkhdf
from coupler.results.history import read_history

ENERGY = 0.05
"""Share of the energy put in by which water and blocks may hold more than that."""
VOLUME = 0.02
MOMENTUM = 1e-6
"""Share of the largest line of momentum that the lines may miss in sum."""
STILL = 1e-6
"""Limit of the mean speed over sqrt(g H) of water that should stay at rest."""
OVERLAP = 0.1
"""Share of the thinner block by which two bodies may overlap, or a block may reach through a wall."""
VAPOUR = -98e3
"""Gauge pressure [Pa] below which water away from air separates."""
PULL_SLACK = 1e-2
"""Share of it that the tolerance of the solver leaves."""
LOOKED_AT = 4
"""Written states in which bodies are compared with one another."""
HELD_STILL = 1e-6
"""Shares of their size by which bodies may have moved that count as held: two of them overlap as they were drawn."""

EMPTY = {
    "air": ("pressure", "volume"),
    "pressure": ("pressure", "mean"),
    "patch": ("pressure", "mean"),
    "velocity": tuple(f"velocity_{what}" for what in ("x", "y", "z", "mean_x", "mean_y", "mean_z")),
}
"""Columns of gauges, by their kind, whose cells are empty while there is nothing to measure: at a place inside a block
or solid, or without a pocket of air. Over dry ground the depth of water is 0, as is the flow through a covered patch.
"""


def measures(directory: Path, still: bool) -> Iterator[Measure]:
    """All figures of a run directory, of a run that ended or stopped at its budget; still: the water should
    stay at rest."""
    summary = json.loads((directory / "run.json").read_text(encoding="utf-8"))
    case = Case.model_validate(summary["case"])
    history = directory / "history"
    tables = {path.stem: read_history(path).values for path in sorted(history.glob("*.csv"))}
    yield from _finite(tables, case)
    yield from _energy(tables["energy"])
    yield from _momentum(tables["momentum"])
    if "water" in tables:
        yield from _water(tables["water"], case)
    if still:
        yield _stillness(tables, case)
    if (directory / "blocks.vtkhdf").exists():
        yield from _bodies(directory, case)


def _finite(tables: dict, case: Case) -> Iterator[Measure]:
    """The number of values in all histories that are not finite; cells of gauges that may find nothing to measure may
    be empty."""
    empty = {f"{gauge.name}_{what}" for gauge in case.gauge for what in EMPTY.get(gauge.kind, ())}
    wrong = sum(
        int((~np.isfinite(values)).sum())
        for title, table in tables.items()
        for name, values in table.items()
        if values.dtype.kind == "f" and not (title == "gauges" and name in empty)
    )
    yield Measure("numbers that are not finite", float(wrong), 0.0)


def _energy(energy: dict) -> Iterator[Measure]:
    """What water and blocks hold beyond the first row and what came in since; what left is not asked back."""
    names = (
        "water_kinetic",
        "water_potential",
        "air_energy",
        "blocks_kinetic",
        "blocks_gravity",
        "joint_stored",
        "contact_stored",
    )
    held = sum(energy[name] for name in names)
    put_in = energy["entered"] + energy["driving_work"]
    scale = np.maximum(energy["input_energy"], 1e-300)
    gained = (held - held[:1]) - (put_in - put_in[:1])
    yield Measure("energy above what was put in", _largest(gained / scale), ENERGY)
    yield Measure("error of the energy", _largest(energy["energy_error"]), ENERGY)


def _momentum(momentum: dict) -> Iterator[Measure]:
    """Water and free blocks against the sum of all lines, over the largest of these along any axis."""
    lines = [v for name, v in momentum.items() if name != "time" and not name.startswith("residual")]
    scale = max(max(_largest(np.abs(v)) for v in lines), 1e-300)
    for axis in "xyz":
        missed = _largest(np.abs(momentum[f"residual_{axis}"]))
        yield Measure(f"momentum missed along {axis}", missed / scale, MOMENTUM)


def _water(water: dict, case: Case) -> Iterator[Measure]:
    """Conservation of volume, within the volume of the tank; no suction beyond that at which the water separates."""
    held = water["volume"] + water["left"] - water["entered"]
    scale = np.maximum(held[:1] + np.maximum(water["entered"], 0.0), 1e-300)
    yield Measure("error of the volume", _largest(np.abs(held - held[:1]) / scale), VOLUME)
    yield Measure("error of the volume as reported", _largest(np.abs(water["volume_error"])), VOLUME)
    tank = np.prod(np.subtract(case.tank.upper, case.tank.lower))
    yield Measure("water over the room in the tank", _largest(water["volume"]) / float(tank), 1.0 + 1e-9)
    yield Measure("pull over that of vapour", _largest(water["lowest_pressure"] / VAPOUR), 1.0 + PULL_SLACK)


def _stillness(tables: dict, case: Case) -> Measure:
    """Root mean square speed over sqrt(g H)."""
    mass = case.water.density * tables["water"]["volume"]
    speed = np.sqrt(2.0 * np.maximum(tables["energy"]["water_kinetic"], 0.0) / np.maximum(mass, 1e-300))
    height = case.tank.upper[2] - case.tank.lower[2]
    return Measure("speed of still water", _largest(speed) / (case.case.gravity * height) ** 0.5, STILL)


def _bodies(directory: Path, case: Case) -> Iterator[Measure]:
    """Blocks against one another, the solids, the closed sides of the tank and the ground."""
    states, names = _states(directory / "blocks.vtkhdf")
    solids = _shapes(directory / "solids.vtkhdf", "solid")[0] if case.solid else []
    fixed = [Body(*_hull(points, faces)) for points, faces in solids]
    worst, where = 0.0, ""
    out, beyond = 0.0, ""
    at_start = states[0][1]
    for time, bodies in states:
        for depth, what in _overlaps(bodies, at_start, fixed, names):
            worst, where = max((worst, where), (depth, f"{what}, t = {time:.4g} s"))
        for depth, what in _outside(bodies, case, names):
            out, beyond = max((out, beyond), (depth, f"{what}, t = {time:.4g} s"))
    yield Measure(f"overlap over the thinner body{_of(where)}", worst, OVERLAP)
    yield Measure(f"reach through a wall over the thickness{_of(beyond)}", out, OVERLAP)


def _of(what: str) -> str:
    return f" ({what})" if what else ""


def _states(path: Path) -> tuple[list, list[str]]:
    """Some of the written states, the first and last among them: (time, bodies); names of the blocks."""
    with vtkhdf.opened(path, "r") as file:
        names = [name.decode() for name in file["scene/names"][()]]
        times = file["VTKHDF/Steps/Values"][: vtkhdf.count(file["VTKHDF"])]
        offsets = file["VTKHDF/Steps/PointOffsets"][()]
        everything = file["VTKHDF/Points"][()].astype(float) + file["scene"].attrs["origin"]
    shapes, rows = _shapes(path, "block")
    chosen = np.unique(np.linspace(0, len(times) - 1, LOOKED_AT).round().astype(int))
    states = []
    for k in chosen:
        points = everything[offsets[k] :]
        states.append(
            (float(times[k]), [Body(*_hull(points[own], faces)) for own, (_, faces) in zip(rows, shapes)])
        )
    return states, names


def _shapes(path: Path, owner: str) -> tuple[list, list]:
    """Of each body in the first written state: (points, faces as rows of them); rows of its points in the file."""
    with vtkhdf.opened(path, "r") as file:
        root = file["VTKHDF"]
        polygons = root["Polygons"]
        connectivity, ends = polygons["Connectivity"][()], polygons["Offsets"][()]
        of_face = root["CellData"][owner][: len(ends) - 1]
        points = root["Points"][: int(connectivity.max()) + 1].astype(float) + file["scene"].attrs["origin"]
    faces: dict[int, list] = {}
    for number, (start, end) in zip(of_face, pairwise(ends)):
        faces.setdefault(int(number), []).append(connectivity[start:end])
    shapes, rows = [], []
    for number in sorted(faces):
        own = np.unique(np.concatenate(faces[number]))
        shapes.append((points[own], [np.searchsorted(own, face) for face in faces[number]]))
        rows.append(own)
    return shapes, rows


def _hull(points, faces):
    """Vertices, normals of the faces and directions of the edges of a convex body."""
    normals, edges = [], []
    for face in faces:
        corners = points[face]
        around = np.roll(corners, -1, axis=0)
        normal = np.cross(corners, around).sum(axis=0)
        normals.append(normal / max(np.linalg.norm(normal), 1e-300))
        edges.append(around - corners)
    along = np.concatenate(edges)
    along = along / np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    kept: list = []
    for edge in along:
        if all(np.linalg.norm(np.cross(edge, other)) > 1e-6 for other in kept):
            kept.append(edge)
    return points, np.array(normals), np.array(kept)


def _overlaps(bodies, at_start, fixed, names) -> Iterator[tuple[float, str]]:
    """Overlap over the thickness of the thinner one, for pairs of which one has moved."""
    from yade_scripts.blocks.faces import touching_bounds

    everything = [*bodies, *fixed]
    labels = [*names, *(f"solid {k}" for k in range(len(fixed)))]
    still = [_is_still(body, before) for body, before in zip(bodies, at_start)] + [True] * len(fixed)
    bounds = np.array([body.bounds() for body in everything])
    for i, j in touching_bounds(bounds[:, 0], bounds[:, 1], 0.0).tolist():
        a, b = everything[i], everything[j]
        if still[i] and still[j]:
            continue
        thinner = min(a.thickness(), b.thickness())
        depth = overlap_depth(a, b, 0.1 * OVERLAP * thinner)
        if depth > 0.0:
            yield depth / thinner, f"{labels[i]} and {labels[j]}"


def _is_still(body: Body, before: Body) -> bool:
    return bool(np.abs(body.vertices - before.vertices).max() <= HELD_STILL * before.thickness())


def _outside(bodies, case: Case, names) -> Iterator[tuple[float, str]]:
    """How far blocks reach through closed sides of the tank and into the ground, over their thickness."""
    ground = case.structure.ground
    for body, name in zip(bodies, names):
        low, high = body.bounds()
        thickness, middle = body.thickness(), body.vertices.mean(axis=0)
        if case.tank is not None and not _gone(middle, case):
            for axis, letter in enumerate("xyz"):
                for sign, reach in (
                    ("-", case.tank.lower[axis] - low[axis]),
                    ("+", high[axis] - case.tank.upper[axis]),
                ):
                    if letter + sign not in case.tank.open:
                        yield reach / thickness, f"{name} at {letter}{sign}"
        if ground is not None:
            yield (ground.level - low[2]) / thickness, f"{name} in the ground"


def _gone(middle, case: Case) -> bool:
    """Whether a block has left the tank through an open side."""
    return any(
        middle["xyz".index(side[0])] * (1.0 if side[1] == "+" else -1.0)
        > (case.tank.upper if side[1] == "+" else case.tank.lower)["xyz".index(side[0])]
        * (1.0 if side[1] == "+" else -1.0)
        for side in case.tank.open
    )


def _largest(values) -> float:
    """Largest of the values, 0 without any; NaN stays NaN, which exceeds every limit."""
    return float(np.max(values)) if len(values) else 0.0
