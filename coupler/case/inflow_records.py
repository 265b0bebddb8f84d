"""Records of an inflow: level and velocity over time, in a CSV file or in the files of gauges of GeoClaw and Thetis.

CSV, one line a time: `time,level,velocity`; with a column `along` one line for each time and each place along the side,
and perhaps `sideways`. GeoClaw: `gaugeNNNNN.txt` (depth, two momenta and surface level in columns), ASCII. Thetis:
`diagnostic_NAME.hdf5` of its callbacks (`DetectorsCallback` with elev_2d and uv_2d, `TimeSeriesCallback2D` with elev).
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.case.paths import BadPath, check_file, read_text
from coupler.case.records import repeated
from coupler.case.water import RecordInflow
from coupler.program.errors import briefly, did_you_mean


class RecordError(ValueError):
    """The table of an inflow cannot be used; the message says why."""


COLUMNS = ("time", "level", "velocity")
ALONG, SIDEWAYS = "along", "sideways"
DRY = 1e-3
"""Depth [m] below which the momentum of a gauge is no velocity."""


@dataclass(frozen=True)
class Record:
    """time (t,) [s], increasing · along (k,) [m], increasing places along the side, one at 0 where the record holds for
    all of it · level (t, k) [m], z · velocity (t, k) [m/s] into the tank · sideways (t, k) [m/s] along the side, in the
    direction of the axis there."""

    time: Array
    along: Array
    level: Array
    velocity: Array
    sideways: Array

    @property
    def varies(self) -> bool:
        """Whether the record varies along the side."""
        return len(self.along) > 1

    def level_at(self, time: float) -> float:
        """Mean level z [m] over the side at a time; the ends are kept before and after."""
        return float(np.mean([np.interp(time, self.time, column) for column in self.level.T]))


def record_of(
    spec: RecordInflow, turn: float = 0.0, bed: float | None = None, gravity: float = 9.81
) -> Record:
    """The record of an inflow (`RecordInflow`) from its start on. turn [rad]: by which the axes of a gauge's file are
    turned in the tank · bed [m]: mean bed along the side, for velocity = "long-wave". Raises RecordError."""
    path = Path(spec.path)
    if path.suffix.lower() in (".h5", ".hdf5"):
        found = _thetis(path, spec, turn)
    elif _is_geoclaw(path):
        found = _geoclaw(path, spec, turn)
    else:
        found = _csv(spec.path, spec.velocity == "given")
    found = replace(found, time=found.time - spec.start, level=found.level - spec.zero)
    if spec.velocity == "long-wave":
        still = found.level_at(0.0) if spec.still is None else spec.still
        floor = still - 1.0 if bed is None else bed  # levels alone are asked for where no bed is given
        found = replace(found, velocity=_long_wave(found.level - floor, still - floor, gravity))
    return found


def _long_wave(depth: Array, still: float, gravity: float) -> Array:
    """u = 2 (sqrt(g h) - sqrt(g d)) [m/s], a long wave into still water (Stoker, Water Waves, 1957, 10.4)."""
    return 2.0 * (np.sqrt(gravity * np.maximum(depth, 0.0)) - np.sqrt(gravity * max(still, 0.0)))


# ---------------------------------------------------------------- CSV


def _csv(path: str, with_velocity: bool = True) -> Record:
    numbered = _written_lines(path)
    head = [name.strip() for name in numbered[0][1].split(",")] if numbered else []
    twice = repeated(head)
    if twice:
        raise RecordError(f"{path}: the column '{twice}' is there twice; rename or remove one")
    wanted = COLUMNS if with_velocity else COLUMNS[:2]
    missing = [name for name in wanted if name not in head]
    if missing:
        raise RecordError(
            f"{path}: no column {', '.join(missing)}; its first line must name "
            f"{', '.join(wanted)}, with commas between"
            + (
                '; for a record of levels alone write velocity = "long-wave"'
                if missing == ["velocity"]
                else ""
            )
        )
    table = np.array([_numbers(path, n, line, len(head)) for n, line in numbered[1:]]).reshape(-1, len(head))
    if not len(table):
        raise RecordError(f"{path}: no line of numbers below the names of the columns")

    def column(name: str) -> Array:
        return table[:, head.index(name)] if name in head else np.zeros(len(table))

    lines = [n for n, _ in numbered[1:]]
    values = [column(name) for name in ("level", "velocity", SIDEWAYS)]
    if ALONG not in head:
        time = column("time")
        _refuse_back(path, time, lines)
        return Record(time, np.zeros(1), *(v[:, None] for v in values))
    return _by_places(path, column("time"), column(ALONG), values, lines)


def _by_places(path: str, time: Array, along: Array, values: list[Array], lines: list[int]) -> Record:
    """Lines for each time and each place, those of a time together."""
    new = np.concatenate([[True], np.diff(time) != 0.0])
    count = int(np.argmax(new[1:]) + 1) if new[1:].any() else len(time)
    places = along[:count]
    if len(time) % count or not np.array_equal(np.flatnonzero(new), np.arange(0, len(time), count)):
        raise RecordError(
            f"{path}: every time needs the same {count} places, one line each, as the first one ({time[0]:g} s) has"
        )
    off = np.flatnonzero(along.reshape(-1, count) != places)
    if len(off):
        raise RecordError(
            f"{path}:{lines[off[0]]}: the places along the side must be the same at every time; expected "
            f"{places[off[0] % count]:g} m, got {along[off[0]]:g} m"
        )
    if (np.diff(places) <= 0.0).any():
        raise RecordError(f"{path}: the places along the side must increase within a time")
    _refuse_back(path, time[::count], lines[::count])
    return Record(time[::count], places, *(v.reshape(-1, count) for v in values))


def _refuse_back(path: str, time: Array, lines: list[int]) -> None:
    back = np.flatnonzero(np.diff(time) <= 0.0)
    if len(back):
        n, later = lines[back[0] + 1], time[back[0] + 1]
        raise RecordError(f"{path}:{n}: times must increase; {later:g} s comes after {time[back[0]]:g} s")


def levels_of(path: str) -> tuple[Array, Array]:
    """Columns time (t,) [s] and level (t,) [m] of a CSV file, for a tide. Raises RecordError."""
    found = _csv(path, with_velocity=False)
    if found.varies:
        raise RecordError(f"{path}: a sea has one level; leave the column {ALONG} out")
    return found.time, found.level[:, 0]


def _written_lines(path: str) -> list[tuple[int, str]]:
    """Lines with their numbers, without comments and empty ones; a byte-order mark of a spreadsheet is skipped."""
    try:
        text = read_text(Path(path))
    except BadPath as error:
        raise RecordError(f"{path}: {error}") from error
    return [
        (n, line) for n, line in enumerate(text.split("\n"), 1) if line.strip() and not line.startswith("#")
    ]


def _numbers(path: str, n: int, line: str, count: int) -> list[float]:
    """The numbers of line n, finite and one a column. Raises RecordError."""
    entries = line.strip().split(",")
    if len(entries) != count:
        raise RecordError(f"{path}:{n}: {len(entries)} values; every line needs {count}, one a column")
    found = []
    for entry in entries:
        try:
            found.append(float(entry))
        except ValueError:
            raise RecordError(f"{path}:{n}: {briefly(entry.strip())} is not a number") from None
    if not np.isfinite(found).all():
        raise RecordError(f"{path}:{n}: {briefly(line.strip())} is not finite")
    return found


# ---------------------------------------------------------------- gauges of other models


def _into(spec: RecordInflow, turn: float, u: Array, v: Array) -> tuple[Array, Array]:
    """Velocities into the tank and along its side, of velocities u, v along the axes of the file."""
    x, y = np.cos(turn) * u - np.sin(turn) * v, np.sin(turn) * u + np.cos(turn) * v
    across, along = (x, y) if spec.side[0] == "x" else (y, x)
    return (across if spec.side[1] == "-" else -across), along


def _as_record(
    path: Path, spec: RecordInflow, turn: float, time: Array, level: Array, u: Array, v: Array
) -> Record:
    """The record of one place; of a time that a model wrote twice, the last line counts."""
    last = np.concatenate([np.diff(time) > 0.0, [True]])
    if (np.diff(time) < 0.0).any():
        raise RecordError(f"{path}: its times run back; it holds two runs: keep one of them")
    time, level, u, v = (np.asarray(a, float)[last] for a in (time, level, u, v))
    if not np.isfinite([time, level, u, v]).all():
        raise RecordError(f"{path}: some of its values are not finite")
    into, along = _into(spec, turn, u, v)
    return Record(time, np.zeros(1), *(a[:, None] for a in (level, into, along)))


def _is_geoclaw(path: Path) -> bool:
    try:
        check_file(path)  # a pipe would wait for a writer
        with open(path, encoding="utf-8", errors="replace") as stream:
            head = stream.readline(200)
    except (BadPath, OSError):
        return False
    return bool(re.match(r"#+\s*gauge(_id=|\s+name)", head))


def _geoclaw(path: Path, spec: RecordInflow, turn: float) -> Record:
    """Columns level of refinement, time, h, hu, hv, surface, as GeoClaw writes them by default."""
    try:
        text = read_text(path)
    except BadPath as error:
        raise RecordError(f"{path}: {error}") from error
    head = [line for line in text.split("\n") if line.startswith("#")]
    if any("lagrangian" in line.lower() for line in head):
        raise RecordError(f"{path}: a gauge that moves with the water; a stationary one is needed")
    if any("binary" in line.lower() for line in head):
        raise RecordError(f"{path}: its numbers are in a binary file; let GeoClaw write gauges as ascii")
    header = re.search(r"q\[\s*([\d\s]*?)\]\s*,\s*eta", " ".join(head))
    if header is not None and header[1].split() != ["1", "2", "3"]:
        raise RecordError(
            f"{path}: it holds q[{' '.join(header[1].split())}]; depth and both momenta, q[1 2 3], and eta are needed"
        )
    rows = []
    for n, line in enumerate(text.split("\n"), 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            rows.append([float(word) for word in line.split()[:6]])
        except ValueError:
            raise RecordError(f"{path}:{n}: {briefly(line.strip())} is no row of numbers") from None
        if len(rows[-1]) < 6:
            raise RecordError(f"{path}:{n}: {len(rows[-1])} values; level, time, q[1 2 3] and eta are needed")
    if not rows:
        raise RecordError(f"{path}: no line of numbers")
    _, time, h, hu, hv, eta = np.array(rows).T
    wet = h > DRY
    u, v = (np.where(wet, q / np.where(wet, h, 1.0), 0.0) for q in (hu, hv))
    return _as_record(path, spec, turn, time, eta, u, v)


def _thetis(path: Path, spec: RecordInflow, turn: float) -> Record:
    """Elevation and velocity of a detector; of a time series of the elevation alone the velocity must be that of a
    long wave."""
    import h5py

    try:
        check_file(path)
        with h5py.File(path, "r") as file:
            sets = {name: np.array(data) for name, data in file.items()}
            attributes = {name: np.array(value) for name, value in file.attrs.items()}
    except (BadPath, OSError) as error:
        raise RecordError(f"{path}: cannot be read as a diagnostic file of Thetis ({error})") from error
    time = sets.pop("time", None)
    if time is None or not sets:
        raise RecordError(
            f"{path}: no dataset 'time' with others beside it, as a diagnostic file of Thetis has"
        )
    time = time.ravel()
    if "field_names" not in attributes:
        if "elev" not in sets:
            raise RecordError(f"{path}: no dataset 'elev'; there are {', '.join(sets)}")
        if spec.velocity == "given":
            raise RecordError(
                f'{path}: it holds levels alone; write velocity = "long-wave", or record a detector'
            )
        none = np.zeros(len(time))
        return _as_record(path, spec, turn, time, sets["elev"].ravel(), none, none)
    names = sorted(sets)
    name = spec.gauge or (names[0] if len(names) == 1 else None)
    if name is None:
        raise RecordError(f"{path}: several detectors, {', '.join(names)}; name one as gauge")
    if name not in sets:
        raise RecordError(f"{path}: no detector '{name}'{did_you_mean(name, names)}")
    fields = [
        value.decode() if isinstance(value, bytes) else str(value) for value in attributes["field_names"]
    ]
    first = dict(zip(fields, np.concatenate([[0], np.cumsum(attributes["field_dims"])])))
    for field in ("elev_2d", "uv_2d"):
        if field not in first and not (field == "uv_2d" and spec.velocity == "long-wave"):
            raise RecordError(f"{path}: its detectors have no field {field}; they have {', '.join(fields)}")
    data = sets[name]
    u, v = (data[:, first["uv_2d"] + k] if "uv_2d" in first else np.zeros(len(time)) for k in (0, 1))
    return _as_record(path, spec, turn, time, data[:, first["elev_2d"]], u, v)
