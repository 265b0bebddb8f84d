"""From an offshore file to a record for a side of the case at the coast."""

from __future__ import annotations

import tempfile
import tomllib
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.case import Case
from coupler.case.inflow_records import ALONG, COLUMNS, DRY, SIDEWAYS, record_of
from coupler.case.paths import BadPath, read_text
from coupler.checks.read_case import load
from coupler.commands.offshore.file import Offshore, read
from coupler.geometry.terrain.grids import read_grid
from coupler.geometry.terrain.height_map import HeightMap
from coupler.geometry.terrain.site import terrain_of
from coupler.program import terminal
from coupler.program.errors import BadCase
from coupler.program.extras import NotInstalled, missing
from coupler.program.process import run_module, trouble
from coupler.program.terminal import Row

FOR_EVER = 1e9
"""Time [s] beyond the end of any run."""


class OffshoreFailed(BadCase):
    """ANUGA ended with an error."""


def offshore(path: Path) -> Path:
    """Run the sea of an offshore file and write the record; returns its path. Raises BadCase, TerrainError,
    RecordError, NotInstalled."""
    absent = missing("offshore")
    if absent:
        raise NotInstalled(absent)
    found = read(path)
    case = _case_at_the_coast(found)
    places = _places(found, case, str(path))
    given = _arrays(found, case, str(path)) | {"places": places - np.array(found.sea.lower)}
    with tempfile.TemporaryDirectory() as folder:
        there, out = Path(folder) / "sea.npz", Path(folder) / "at_the_side.npz"
        np.savez(there, **given)
        done = run_module("coupler.commands.offshore.in_anuga", there, out, cwd=folder, stderr=-1, text=True)
        if done.returncode != 0:
            raise OffshoreFailed([f"{path}: ANUGA: {trouble(done.returncode, done.stderr)}"])
        with np.load(out) as file:
            computed = {name: file[name] for name in file.files}
    return _written(found, case, computed, path)


def _case_at_the_coast(found: Offshore) -> Case:
    """The case that the record is for. Before the first call it names a file that is not there yet: still water takes
    its place, which is as good for the place of the side."""
    place, record = Path(found.near.case), Path(found.near.record).resolve()
    if record.exists():
        return load(place).case
    file = place / "case.toml" if place.is_dir() else place
    with tempfile.TemporaryDirectory() as folder:
        still = Path(folder) / "still.csv"
        rows = "".join(f"{time:g},{found.sea.level!r},0\n" for time in (-FOR_EVER, FOR_EVER))
        still.write_text(f"{','.join(COLUMNS)}\n{rows}", encoding="utf-8")
        sets = [f"water.inflow[{i}].path={still}" for i in _inflows_with(file, record)]
        return load(place, sets).case


def _inflows_with(file: Path, record: Path) -> list[int]:
    """Numbers of the inflows of a case file that name a record; none where the file is no case."""
    try:
        water = tomllib.loads(read_text(file)).get("water", {})
    except (BadPath, ValueError):  # told by `load`
        return []
    inflows = water.get("inflow", []) if isinstance(water, dict) else []
    paths = [spec.get("path") if isinstance(spec, dict) else None for spec in inflows]
    return [
        i
        for i, path in enumerate(paths)
        if isinstance(path, str) and (file.parent / path).resolve() == record
    ]


def _places(found: Offshore, case, name: str) -> Array:
    """Places (k, 2) [m] along the side of the near tank, at its middle for a single one."""
    near, tank = found.near, case.tank
    if tank is None:
        raise BadCase([f"{name}: near.case: {near.case} has no section [tank]"])
    axis = "xy".index(near.side[0])
    low, high = tank.lower[1 - axis], tank.upper[1 - axis]
    places = np.empty((near.points, 2))
    places[:, axis] = (tank.upper if near.side[1] == "+" else tank.lower)[axis]
    places[:, 1 - axis] = [0.5 * (low + high)] if near.points == 1 else np.linspace(low, high, near.points)
    beside = (places < found.sea.lower) | (places > found.sea.upper)
    if beside.any():
        x, y = places[beside.any(axis=1)][0]
        sea = f"{_point(found.sea.lower)} to {_point(found.sea.upper)} m"
        what = f"the side {near.side} of the tank of {near.case} lies beside the sea at ({x:.6g}, {y:.6g}) m"
        raise BadCase([f"{name}: sea: {what}; the sea goes from {sea} in the coordinates of that tank"])
    return places


def _point(place) -> str:
    return f"({place[0]:.6g}, {place[1]:.6g})"


def _arrays(found: Offshore, case, name: str) -> dict:
    """Arrays for the process of ANUGA, whose coordinates begin at the lower corner of the sea."""
    sea = found.sea
    size = np.subtract(sea.upper, sea.lower)
    count = np.maximum(1, np.rint(size / sea.cell)).astype(int)
    x, y = (np.linspace(0.0, size[k], 2 * count[k] + 1) for k in (0, 1))
    X, Y = (a.ravel() for a in np.meshgrid(x + sea.lower[0], y + sea.lower[1], indexing="ij"))
    shape = (len(x), len(y))
    ground = None if found.terrain is None else terrain_of(found.terrain)
    bed = np.full(len(X), sea.floor, float) if ground is None else ground(X, Y)
    unknown = ~np.isfinite(bed)
    if unknown.any():
        raise BadCase(
            [
                f"{name}: terrain: it has no height under {unknown.mean():.1%} of the sea, for instance at "
                f"({X[unknown][0]:.6g}, {Y[unknown][0]:.6g}) m: a smaller sea, another place, or fill = true"
            ]
        )
    given = {
        "size": size, "count": count, "x": x, "y": y, "bed": bed.reshape(shape), "level": sea.level,
        "moved": _moved(found, ground, X, Y).reshape(shape), "manning": sea.manning, "end": sea.end,
        "every": sea.every, "open": np.array(sea.open, "U2"),
    }  # fmt: skip
    turn = found.terrain.turn if found.terrain is not None else 0.0
    for spec in found.inflow:
        axis, end = "xy".index(spec.side[0]), -1 if spec.side[1] == "+" else 0
        edge = given["bed"][end] if axis == 0 else given["bed"][:, end]
        floor = float(np.minimum(edge, sea.level).mean())
        record = record_of(spec, turn, floor, case.case.gravity)
        depth = np.maximum(record.level[:, 0] - floor, 0.0)
        inward = (1.0 if spec.side[1] == "-" else -1.0) * depth * record.velocity[:, 0]
        along = depth * record.sideways[:, 0]
        momenta = (inward, along) if axis == 0 else (along, inward)
        given[f"record {spec.side}"] = np.column_stack([record.time, record.level[:, 0], *momenta])
    return given


def _moved(found: Offshore, ground: HeightMap | None, X: Array, Y: Array) -> Array:
    """Initial elevation (n,) [m] of the surface above still water."""
    moved = np.zeros(len(X))
    for spec in found.source:
        if spec.kind == "hump":
            (x, y), (a, b) = spec.centre, spec.width
            moved += spec.height * np.exp(-0.5 * (((X - x) / a) ** 2 + ((Y - y) / b) ** 2))
            continue
        grid = read_grid(Path(spec.path))
        scale = found.terrain.scale if found.terrain is not None else 1.0
        place = (
            {} if ground is None else {"pivot": ground.pivot, "origin": ground.origin, "turn": ground.turn}
        )
        (west, east), (south, north) = grid.reach
        reach = (scale * west, scale * east), (scale * south, scale * north)
        here = HeightMap(scale * grid.x, scale * grid.y, grid.z, reach=reach, **place)(X, Y)
        moved += np.where(np.isfinite(here), here, 0.0)
    return moved


def _written(found: Offshore, case, computed: dict, path: Path) -> Path:
    """The record, level and velocities in the coordinates of the near tank, and a table of what came."""
    near = found.near
    axis = "xy".index(near.side[0])
    low, high = case.tank.lower[1 - axis], case.tank.upper[1 - axis]
    along = [0.0] if near.points == 1 else np.linspace(low, high, near.points)
    depth = computed["stage"] - computed["elevation"]
    wet = depth > DRY
    if not wet.any():
        what = f"{near.side} of {near.case} is dry land in the sea for the whole run"
        raise BadCase([f"{path}: near.side: {what}: check the datum"])
    u, v = (np.where(wet, computed[k] / np.where(wet, depth, 1.0), 0.0) for k in ("xmomentum", "ymomentum"))
    across, sideways = (u, v) if axis == 0 else (v, u)
    velocity = across if near.side[1] == "-" else -across
    out = Path(near.record)
    lines = [
        f"# written by surgebreak offshore from {path.name}: side {near.side} of {Path(near.case).name}, "
        f"{int(computed['triangles'])} triangles of ANUGA"
    ]
    single = near.points == 1
    lines.append(",".join(COLUMNS) if single else ",".join((COLUMNS[0], ALONG, *COLUMNS[1:], SIDEWAYS)))
    for n, t in enumerate(computed["time"]):
        for k, place in enumerate(along):
            values = (computed["stage"][n, k], velocity[n, k])
            row = (t, *values) if single else (t, place, *values, sideways[n, k])
            lines.append(",".join(f"{value:.9g}" for value in row))
    try:
        out.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise BadCase([f"{path}: near.record: {out}: {error.strerror}"]) from error
    level = computed["stage"] - found.sea.level
    first = int(np.argmax(np.abs(level).max(axis=1) > 0.05 * np.abs(level).max()))
    terminal.table(
        str(out),
        [
            Row("sea", int(computed["triangles"]), "triangles", f"{found.sea.end:g} s"),
            Row("highest level", float(level.max() + found.sea.level), "m", "z"),
            Row("lowest level", float(level.min() + found.sea.level), "m", "z"),
            Row("largest velocity", float(np.abs(velocity).max()), "m/s", "across the side"),
            Row(
                "arrival",
                float(computed["time"][first]),
                "s",
                "of a twentieth of the largest level; cut by start",
            ),
        ],
    )
    return out
