"""The reference of a quantity, of one kind for all its runs: exact, measured, or the finest run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupler.case.formula import evaluate
from coupler.case.records import column as table_column
from coupler.case.records import read_record
from coupler.case.study import Quantity
from coupler.commands.study.reading import Curve, NotRecorded, taken
from coupler.program.errors import BadCase
from coupler.results.expected import lacking


@dataclass(frozen=True)
class Reading:
    """A quantity in one run: value, what it was compared with, error (a share), band (a share; 0 without); why there is
    no value (NaN)."""

    value: float
    reference: float
    error: float
    band: float = 0.0
    why: str = ""


def against_number(q: Quantity, value: float, reference: float, place: str) -> Reading:
    """|value - reference| over the scale: |reference| unless the quantity has one. Raises BadCase for a scale of 0."""
    scale = abs(reference) if q.scale is None else abs(q.scale)
    if scale == 0.0:
        raise BadCase(
            [
                f"{place}: the reference is 0, so an error has no share of it; give scale, what it counts against"
            ]
        )
    band = half_band(q) / scale if q.against == "measured" else 0.0
    return Reading(value, reference, abs(value - reference) / scale, band)


def against_curve(q: Quantity, found: Curve) -> Reading:
    """Root mean square distance from the reference curve, over its root mean square (or the scale).

    Both are compared at the times of the reference that lie in the window, of all of which the run has to tell. Raises
    NotRecorded.
    """
    reference = _part_of_file(q)
    if missing := lacking(found.time, reference.time[0], reference.time[-1]):
        raise NotRecorded(
            f"the run has nothing {missing} of the reference {q.path}; give a window to compare a part of it"
        )
    inside = (reference.time >= found.time[0]) & (reference.time <= found.time[-1])
    time, values = reference.time[inside], reference.values[inside]
    if len(time) < 2:
        raise NotRecorded(
            f"{len(time)} points of {q.path} lie in the time of the run; a curve has two or more"
        )
    difference = rms(time, np.interp(time, found.time, found.values) - values)
    scale = rms(time, values) if q.scale is None else abs(q.scale)
    band = 0.0
    if q.band is not None:
        band = q.band / scale
    elif q.band_columns is not None:
        low, high = (_part_of_file(q, name) for name in q.band_columns)
        band = rms(low.time, 0.5 * (high.values - low.values)) / scale
    return Reading(difference, 0.0, difference / scale, band)


def _part_of_file(q: Quantity, column: str | None = None) -> Curve:
    """The part of a reference curve in the window, of two points or more. Raises NotRecorded."""
    whole = file_curve(q, column)
    if len(whole.time) < 2:
        raise NotRecorded(f"{q.path} has one point; a curve has two or more")
    try:
        return whole.within(q.window)
    except NotRecorded as error:
        raise NotRecorded(f"{q.path}: {error}") from error


def rms(time, values) -> float:
    """(1/T ∫ v² dt)^(1/2)"""
    return float(np.sqrt(np.trapezoid(values**2, time) / (time[-1] - time[0])))


def fixed_reference(q: Quantity, case: dict) -> float:
    """The exact or measured number of a quantity, for a run with this effective case."""
    return evaluate(q.value, case) if q.value is not None else _of_file(q)


def _of_file(q: Quantity, column: str | None = None) -> float:
    """What the quantity takes from the reference file. Raises NotRecorded."""
    try:
        return taken(q, file_curve(q, column))
    except NotRecorded as error:
        raise NotRecorded(f"{q.path}: {str(error).replace('the run has', 'there is')}") from error


def half_band(q: Quantity) -> float:
    """Half the scatter of a measured number; for two curves, of the numbers that are taken from them."""
    if q.band is not None:
        return abs(q.band)
    low, high = (_of_file(q, name) for name in q.band_columns)
    return 0.5 * abs(high - low)


def file_curve(q: Quantity, column: str | None = None) -> Curve:
    """Columns of the reference file: time and value, or time and another one. Raises NoSuchData."""
    table = read_record(Path(q.path))
    return Curve(*(table_column(table, name, q.path) for name in (q.columns[0], column or q.columns[1])))
