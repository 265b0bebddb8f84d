"""Gauges of a case: quantities that are read in every step, as columns of `history/gauges.csv` or as a separate table.

At a place inside a block or solid there is no water to measure: the cell of the table stays empty, nothing is added to
impulses, and running means and peaks cover the time in which the place was free.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from array_types import Array, Floats
from coupler.results.gauge_windows import Windows
from coupler.results.loads import BlockLoads, GroupLoads


@dataclass(frozen=True)
class Gauge:
    """columns: (name, unit, meaning) · read(coupling, record) → {name: value} · windows: what it has accumulated, with
    `save` and `restore`

    table: name of a table of its own, None for `gauges`; then the columns begin with the time, and read gives a list of
    rows."""

    columns: tuple[tuple[str, str, str], ...]
    read: Callable
    windows: Windows | GroupLoads | BlockLoads | Followed | None = None
    table: str | None = None


@dataclass(frozen=True)
class Bodies:
    """The bodies that gauges can refer to, in the rows of the load table: names, centre (k, 3) [m] at the start, mass
    (k,) [kg] (1 for solids); rows_of: rows for each name of a block, group, part or solid · parts: of the loads that
    there are."""

    names: list[str]
    centre: Floats
    mass: Floats
    rows_of: dict[str, Array]
    parts: list[str]


def make_gauges(spec, bodies: Bodies) -> list[Gauge]:
    """The gauges of one entry of a case, one for each table that it fills."""
    if spec.kind != "loads":
        return [make_gauge(spec, bodies.rows_of)]
    rows = bodies.rows_of[spec.on]
    mass = bodies.mass[rows]
    point = mass @ bodies.centre[rows] / mass.sum() if spec.about is None else np.array(spec.about)
    tables: dict[str, GroupLoads | BlockLoads] = {}
    tables[f"loads_{spec.name}"] = GroupLoads(rows, point, bodies.parts, spec.impulse, spec.mean_over)
    if spec.each_block:
        names = [bodies.names[row] for row in rows]
        each = BlockLoads(rows, names, bodies.centre[rows], bodies.parts, spec.every)
        tables[f"loads_{spec.name}_blocks"] = each
    return [Gauge(tuple(found.columns()), found.read, found, name) for name, found in tables.items()]


def make_gauge(spec, rows_of: dict[str, Array]) -> Gauge:
    """A gauge in the common table. rows_of: rows of the load table for each name of a block, group or solid."""
    makers = {
        "level": _level,
        "pressure": _pressure,
        "patch": _patch,
        "air": _air,
        "velocity": _velocity,
        "flux": _flux,
        "volume": _volume,
        "motion": _motion,
        "force": _force,
        "reaction": _reaction,
    }
    return makers[spec.kind](spec, rows_of)


def _scalar(spec, unit: str, meaning: str, value: Callable) -> Gauge:
    name = f"{spec.name}_{spec.kind}"
    return Gauge(((name, unit, meaning),), lambda coupling, record: {name: value(coupling)})


def _vector(prefix: str, unit: str, meaning: str):
    return tuple((f"{prefix}_{axis}", unit, f"{meaning}, {axis}") for axis in "xyz")


def _named(columns, values) -> dict[str, float]:
    return {name: float(v) for (name, *_), v in zip(columns, values)}


def _measured(columns, values) -> dict[str, float | None]:
    """The same value, or None if there was nothing to measure (NaN)."""
    return {name: None if np.isnan(v) else v for name, v in _named(columns, values).items()}


def _level(spec, rows_of) -> Gauge:
    at, lines = np.array(spec.at), None

    def value(coupling):
        from fluid.readings.gauges import Lines

        nonlocal lines
        if lines is None or lines.domain is not coupling.water.domain:
            lines = Lines.of(coupling.water, [at])
        return float(lines.depths(coupling.water)[0])

    return _in_time(spec, "level", "m", f"depth of water over (x, y) = {spec.at}", value)


def _pressure(spec, rows_of) -> Gauge:
    at, places, domain = np.array(spec.at), None, None

    def value(coupling):
        from fluid.readings.gauges import Places, pressure_at

        nonlocal places, domain
        if domain is not coupling.water.domain:
            places, domain = Places.of(coupling.water, at), coupling.water.domain
        return float(pressure_at(coupling.water, places)[0])

    return _in_time(spec, "pressure", "Pa", f"pressure at {spec.at}, zero in the air", value)


def _patch(spec, rows_of) -> Gauge:
    points = patch_points(spec)
    windows = Windows(spec.impulse, spec.mean_over)
    columns = (
        (f"{spec.name}_pressure", "Pa", f"mean pressure over the free part of the patch at {spec.at}"),
        (
            f"{spec.name}_covered",
            "1",
            "share of the patch inside blocks or solids; at 1 there is no pressure",
        ),
        *windows.columns(spec.name, "Pa", ("",)),
    )

    def read(coupling, record):
        from fluid.readings.gauges import pressure

        mean, covered = free_mean(pressure(coupling.water, points))
        return _measured(columns, [mean, covered, *windows.add(record.time, record.dt, mean)])

    return Gauge(columns, read, windows)


def _air(spec, rows_of) -> Gauge:
    columns = (
        (f"{spec.name}_pressure", "Pa", f"pressure of the pocket of air at {spec.at} over the step"),
        (f"{spec.name}_volume", "m3", f"volume of the pocket of air at {spec.at}"),
    )
    followed = Followed()

    def read(coupling, record):
        return _measured(columns, followed.read(coupling.water, np.array(spec.at, float)))

    return Gauge(columns, read, followed)


class Followed:
    """The pocket of air that was first found at a place; it is followed wherever it moves. Where it is lost, the next
    one that is found at the place takes its turn."""

    def __init__(self):
        self.name = 0

    def read(self, water, place) -> tuple[float, float]:
        """Pressure [Pa] over the last step and volume [m³] of the pocket; NaN while there is none."""
        from fluid.readings.gauges import pocket_at

        air = water.air
        there = np.flatnonzero(air.name == self.name)
        k = pocket_at(water, place) if len(there) == 0 else int(there[0])
        if k is None:
            self.name = 0
            return np.nan, np.nan
        self.name = int(air.name[k])
        return float(air.mean_pressure[k]), float(water.pocket_volumes()[k])

    def save(self) -> dict[str, Array]:
        """The state for `restore`."""
        return {"name": np.array(self.name)}

    def restore(self, saved: dict[str, Array]) -> None:
        """Restore the state that `save` returned."""
        self.name = int(saved["name"])


def free_mean(values) -> tuple[float, float]:
    """Mean of values (m,) at places of equal area, NaN inside bodies, over those outside, and the share inside; the
    mean is NaN where all are inside."""
    free = np.isfinite(values)
    return float(values[free].mean()) if free.any() else np.nan, float(1.0 - free.mean())


def _in_time(spec, what: str, unit: str, meaning: str, value: Callable) -> Gauge:
    """A scalar gauge with the windows that the case asks for."""
    windows = Windows(getattr(spec, "impulse", None), spec.mean_over)
    name = f"{spec.name}_{what}"
    columns = ((name, unit, meaning), *windows.columns(spec.name, unit, ("",)))

    def read(coupling, record):
        now = value(coupling)
        return _measured(columns, [now, *windows.add(record.time, record.dt, now)])

    return Gauge(columns, read, windows)


PATCH_POINTS = 6
"""Points along each edge of a patch, and rings of a disc."""


def patch_points(spec) -> Array:
    """(m, 3) [m] middles of parts of equal area of a patch gauge: a parallelogram (edges), or a disc."""
    return parallelogram(spec.at, spec.edges) if spec.edges else disc(spec.at, spec.radius, spec.normal)


def parallelogram(centre, edges, points: int = PATCH_POINTS) -> Array:
    """(points², 3) [m] middles of equal parts of the parallelogram with these edges (2, 3)."""
    s = (np.arange(points) + 0.5) / points - 0.5
    u, v = np.meshgrid(s, s, indexing="ij")
    return np.asarray(centre) + np.column_stack([u.ravel(), v.ravel()]) @ np.asarray(edges, float)


def disc(centre, radius: float, normal, rings: int = PATCH_POINTS) -> Array:
    """Points (m, 3) [m] of parts of a disc with equal area: ring k has 6 k - 3 points at the radius sqrt(mean r²)."""
    n = np.asarray(normal, float) / np.linalg.norm(normal)
    first = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    first /= np.linalg.norm(first)
    second = np.cross(n, first)
    found = []
    for k in range(1, rings + 1):
        r = radius * np.sqrt(((k - 1) ** 2 + k**2) / 2.0) / rings
        angle = 2 * np.pi * (np.arange(6 * k - 3) + 0.5 * (k % 2)) / (6 * k - 3)
        found.append(r * (np.outer(np.cos(angle), first) + np.outer(np.sin(angle), second)))
    return np.asarray(centre) + np.concatenate(found)


def _flux(spec, rows_of) -> Gauge:
    def value(coupling):
        from fluid.readings.gauges import flux

        return flux(coupling.water, spec.at, spec.edges)

    return _in_time(spec, "flux", "m3/s", f"water through the patch at {spec.at}", value)


def _velocity(spec, rows_of) -> Gauge:
    windows = Windows(None, spec.mean_over)
    columns = _vector(f"{spec.name}_velocity", "m/s", f"velocity of the water at {spec.at}")
    columns += windows.columns(f"{spec.name}_velocity", "m/s", ("_x", "_y", "_z"))

    def read(coupling, record):
        from fluid.readings.gauges import velocity

        now = velocity(coupling.water, np.array(spec.at))
        return _measured(columns, [*now, *windows.add(record.time, record.dt, now)])

    return Gauge(columns, read, windows)


def _volume(spec, rows_of) -> Gauge:
    def value(coupling):
        from fluid.readings.gauges import volume_in_box

        return volume_in_box(coupling.water, np.array(spec.lower), np.array(spec.upper))

    return _scalar(spec, "m3", f"water between {spec.lower} and {spec.upper}", value)


def _motion(spec, rows_of) -> Gauge:
    (row,) = rows_of[spec.of]
    columns = (
        *_vector(f"{spec.name}_centre", "m", f"centre of block '{spec.of}'"),
        *_vector(f"{spec.name}_velocity", "m/s", f"velocity of block '{spec.of}'"),
        *_vector(f"{spec.name}_tilt", "rad", f"rotation vector of block '{spec.of}' since the start"),
        *_vector(f"{spec.name}_spin", "rad/s", f"angular velocity of block '{spec.of}', world axes"),
    )

    def read(coupling, record):
        s = coupling.structure
        tilt = _rotation_vector(s.rotation()[row] @ s.blocks[row].rotation.T)
        velocity = s.velocity()[row]
        return _named(columns, np.concatenate([s.centre()[row], velocity[:3], tilt, velocity[3:]]))

    return Gauge(columns, read)


def _rotation_vector(R) -> Array:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_rotvec()


FORCE_PARTS = {
    "pressure": "pressure, taken over all of every cell that water reaches",
    "surface": "correction of it where the surface of the water passes through the cells; weight of films",
    "friction": "viscosity and friction along the faces",
}


def _force(spec, rows_of) -> Gauge:
    rows = rows_of[spec.on]
    windows = Windows(spec.impulse, spec.mean_over)
    columns = _force_columns(spec, spec.name, f"force of the water on '{spec.on}'")
    for part, meaning in FORCE_PARTS.items() if spec.parts else ():
        columns += _force_columns(spec, f"{spec.name}_{part}", f"on '{spec.on}': {meaning}")
    columns += windows.columns(spec.name, "N", ("_x", "_y", "_z"))

    def read(coupling, record):
        def summed(load):
            return _force_values(spec, coupling, rows, load[rows])

        values = summed(record.load)
        force = values[:3]
        if spec.parts:
            pressure = record.load - record.surface_load - record.shear_load
            for load in (pressure, record.surface_load, record.shear_load):
                values += summed(load)
        return _named(columns, [*values, *windows.add(record.time, record.dt, force)])

    return Gauge(columns, read, windows)


def _force_columns(spec, name: str, meaning: str):
    columns = _vector(f"{name}_force", "N", meaning)
    if spec.about is not None:
        columns += _vector(f"{name}_moment", "N m", f"its moment about {spec.about}")
    return columns


def _force_values(spec, coupling, rows, load) -> list[float]:
    """Sum of loads (k, 6) on the bodies `rows`, with the moment about the point of the gauge if it has one."""
    values = list(load[:, :3].sum(axis=0))
    if spec.about is not None:
        arm = coupling.water.domain.body_centre[rows] - np.array(spec.about)
        values += list((load[:, 3:] + np.cross(arm, load[:, :3])).sum(axis=0))
    return values


def _reaction(spec, rows_of) -> Gauge:
    rows = rows_of[spec.on]
    columns = _vector(f"{spec.name}_reaction", "N", f"force that holds '{spec.on}' to its prescribed motion")

    def read(coupling, record):
        return _named(columns, coupling.structure.reaction()[rows, :3].sum(axis=0))

    return Gauge(columns, read)
