"""Gauges of a case: what is read every step, as columns of `history/gauges.csv`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Gauge:
    """columns: (name, unit, meaning) · read(coupling, record) → {name: value}"""

    columns: tuple[tuple[str, str, str], ...]
    read: Callable


def make_gauge(spec, rows_of: dict[str, np.ndarray]) -> Gauge:
    """The gauge that a case asks for. rows_of: rows of the load table for each name of a block, group or solid."""
    makers = {
        "level": _level,
        "pressure": _pressure,
        "velocity": _velocity,
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


def _level(spec, rows_of) -> Gauge:
    at = np.array(spec.at)

    def value(coupling):
        from fluid.gauges import level

        return level(coupling.water, at)

    return _scalar(spec, "m", f"depth of water over (x, y) = {spec.at}", value)


def _pressure(spec, rows_of) -> Gauge:
    at = np.array(spec.at)

    def value(coupling):
        from fluid.gauges import pressure

        return pressure(coupling.water, at)

    return _scalar(spec, "Pa", f"pressure at {spec.at}, zero in the air", value)


def _velocity(spec, rows_of) -> Gauge:
    columns = _vector(f"{spec.name}_velocity", "m/s", f"velocity of the water at {spec.at}")

    def read(coupling, record):
        from fluid.gauges import velocity

        return _named(columns, velocity(coupling.water, np.array(spec.at)))

    return Gauge(columns, read)


def _volume(spec, rows_of) -> Gauge:
    def value(coupling):
        from fluid.gauges import volume_in_box

        return volume_in_box(coupling.water, np.array(spec.lower), np.array(spec.upper))

    return _scalar(spec, "m3", f"water between {spec.lower} and {spec.upper}", value)


def _motion(spec, rows_of) -> Gauge:
    (row,) = rows_of[spec.of]
    columns = (
        *_vector(f"{spec.name}_centre", "m", f"centre of block '{spec.of}'"),
        *_vector(f"{spec.name}_velocity", "m/s", f"velocity of block '{spec.of}'"),
        *_vector(f"{spec.name}_tilt", "rad", f"rotation vector of block '{spec.of}' since the start"),
    )

    def read(coupling, record):
        s = coupling.structure
        tilt = _rotation_vector(s.rotation()[row] @ s.blocks[row].rotation.T)
        return _named(columns, np.concatenate([s.centre()[row], s.velocity()[row, :3], tilt]))

    return Gauge(columns, read)


def _rotation_vector(R) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    return Rotation.from_matrix(R).as_rotvec()


def _force(spec, rows_of) -> Gauge:
    rows = rows_of[spec.on]
    columns = _vector(f"{spec.name}_force", "N", f"force of the water on '{spec.on}'")
    return Gauge(columns, lambda coupling, record: _named(columns, record.load[rows, :3].sum(axis=0)))


def _reaction(spec, rows_of) -> Gauge:
    rows = rows_of[spec.on]
    columns = _vector(f"{spec.name}_reaction", "N", f"force that holds '{spec.on}' to its prescribed motion")

    def read(coupling, record):
        return _named(columns, coupling.structure.reaction()[rows, :3].sum(axis=0))

    return Gauge(columns, read)
