"""Maps of a flood over terrain: largest depth, speed and h v², and the arrival of the water, at the columns of the
mesh.

    h: wet length of a column · v: mean of its horizontal velocity over h · arrival: h passes FILM where it was dry

Written as ESRI ASCII grids, `maps/depth.asc`, `speed.asc`, `flux.asc` (h v²), `arrival.asc`, `bed.asc`, in the
coordinates of the terrain file where the tank is not turned against it, else of the tank. Such a grid is even: columns
that are stretched are written on a raster as fine as the finest of them (`even_raster.py`).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from array_types import Array
from coupler.results.even_raster import even_raster

FILM = 0.1
"""Depth in layers of the mesh from which a place counts as wet; the speed of thinner films is not resolved."""
UNKNOWN = -9999.0
NEVER = -1.0
"""Value in place of a time of arrival, since checkpoints hold finite numbers."""
DIGITS = 7
"""Significant digits of a value: millimetres of a bed some thousand metres above the zero of its map."""
KEPT = ("depth", "speed", "flux", "arrival")


class Maps:
    """Maps of a run. fitted: `FittedMesh` that the water is on · ground: `HeightMap` that it ends on."""

    def __init__(self, water, fitted, ground):
        self.fitted, self.ground = fitted, ground
        self.film = FILM * fitted.layer
        self._shape = fitted.bed.shape
        self._low, self._high, self._length, self._column = _pairs(water.mesh.nodes, fitted)
        self._node = np.arange(len(water.mesh.nodes))
        size = int(np.prod(self._shape))
        self.depth, self.speed, self.flux = (np.zeros(size) for _ in range(3))
        self.arrival = np.full(size, NEVER)
        self._dry = self._now(water)[0] <= self.film
        """Columns that were dry at the start."""

    def _now(self, water) -> tuple[Array, Array]:
        """Depth [m] and speed [m/s] of all columns."""
        phi, u = self._on_mesh(water)
        a, b = phi[self._low], phi[self._high]
        wet = np.where((a < 0.0) & (b < 0.0), 1.0, 0.0)
        parted = (a < 0.0) != (b < 0.0)
        both = np.abs(a[parted]) + np.abs(b[parted])
        wet[parted] = np.maximum(-np.minimum(a[parted], b[parted]), 0.0) / np.where(both > 0.0, both, 1.0)
        wet *= self._length
        size = len(self.depth)
        depth = np.bincount(self._column, wet, size)
        lower, upper = u[self._low], u[self._high]
        mean = np.where((b < 0.0)[:, None], 0.5 * (lower + upper), lower)
        flow = [np.bincount(self._column, wet * mean[:, k], size) for k in range(2)]
        speed = np.hypot(*flow) / np.where(depth > self.film, depth, np.inf)
        return depth, speed

    def _on_mesh(self, water) -> tuple[Array, Array]:
        """Level set (N,), dry at nodes that water cannot reach, and horizontal velocity (N, 2) at the nodes of the
        mesh; of several copies of a node, the one with the lowest level set."""
        phi, u = np.full(len(self._node), np.inf), np.zeros((len(self._node), 2))
        parent = water.domain.parent_node
        own = np.where(water.topology.active, water.level_set, np.inf)
        order = np.argsort(-own, kind="stable")
        phi[parent[order]], u[parent[order]] = own[order], water.velocity[order, :2]
        return np.where(np.isfinite(phi), phi, 1e300), u

    def step(self, water, time: float) -> None:
        """Update the maps with the present state of the water."""
        depth, speed = self._now(water)
        np.maximum(self.depth, depth, out=self.depth)
        np.maximum(self.speed, speed, out=self.speed)
        np.maximum(self.flux, depth * speed**2, out=self.flux)
        self.arrival[self._dry & (self.arrival == NEVER) & (depth > self.film)] = time

    def save(self) -> dict[str, Array]:
        """Copies of the maps so far."""
        return {name: getattr(self, name).copy() for name in KEPT} | {"dry": self._dry.copy()}

    def restore(self, saved: dict[str, Array]) -> None:
        """Restore the state that `save` returned."""
        for name in KEPT:
            setattr(self, name, saved[name].copy())
        self._dry = saved["dry"].copy()

    def write(self, directory: Path) -> None:
        """Write all maps; each file replaces the one before."""
        directory.mkdir(exist_ok=True)
        land = ~np.isfinite(self.fitted.bed)
        wet = (self.depth > self.film).reshape(self._shape)
        shown = {
            "bed": (np.where(land, np.nan, self.fitted.bed), "bed of the water [m]"),
            "depth": (np.where(wet, self._grid("depth"), np.nan), "largest depth [m]"),
            "speed": (np.where(wet, self._grid("speed"), np.nan), "largest speed, mean over the depth [m/s]"),
            "flux": (np.where(wet, self._grid("flux"), np.nan), "largest h v2 [m3/s2]"),
            "arrival": (
                np.where(self._grid("arrival") == NEVER, np.nan, self._grid("arrival")),
                "time of arrival where it was dry [s]",
            ),
        }
        x, y, even = even_raster(
            self.fitted.column_x, self.fitted.column_y, *(values for values, _ in shown.values())
        )
        for (name, (_, what)), values in zip(shown.items(), even):
            self._write(directory / f"{name}.asc", x, y, values, what)

    def _grid(self, name: str) -> Array:
        return getattr(self, name).reshape(self._shape)

    def _write(self, path: Path, x: Array, y: Array, z: Array, what: str) -> None:
        """Write one map, z (nx, ny) at evenly spaced x (nx,) and y (ny,) [m]."""
        frame = "the tank"
        x0, y0 = x[0], y[0]
        if self.ground.turn == 0.0:
            (x0, y0), frame = self.ground.in_file(x0, y0), "the terrain file, in metres"
        dx, dy = x[1] - x[0], y[1] - y[0]
        even = abs(dx - dy) <= 1e-6 * dx
        size = [f"cellsize {dx:.10g}"] if even else [f"dx {dx:.10g}", f"dy {dy:.10g}"]
        head = [f"# {what}; coordinates of {frame}", f"ncols {len(x)}", f"nrows {len(y)}"]
        head += [f"xllcenter {x0:.10g}", f"yllcenter {y0:.10g}", *size, f"NODATA_value {UNKNOWN:g}"]
        rows = np.where(np.isfinite(z), z, UNKNOWN).T[::-1]
        lines = [" ".join(f"{value:.{DIGITS}g}" for value in row) for row in rows]
        new = path.with_suffix(".new")
        new.write_text("\n".join([*head, *lines]) + "\n", encoding="utf-8")
        new.replace(path)


@dataclass(frozen=True)
class Map:
    """x (nx,), y (ny,) [m] in the coordinates of `frame` · z (ny, nx), from south to north, NaN where there is no value
    · what: its meaning, without the unit"""

    x: Array
    y: Array
    z: Array
    what: str
    frame: str


def read_map(path: Path) -> Map:
    """A map of a run. Raises OSError, ValueError or LookupError of a file that is not what `Maps` writes."""
    head: dict[str, float] = {}
    rows: list[list[str]] = []
    what = ""
    for line in path.read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            what = line[1:].strip()
            continue
        words = line.split()
        if words[0][0].isalpha():
            head[words[0].lower()] = float(words[1])
        else:
            rows.append(words)
    z = np.array(rows, float)[::-1]
    z[z == head["nodata_value"]] = np.nan
    dx, dy = (head[name] if name in head else head["cellsize"] for name in ("dx", "dy"))
    x, y = (
        head[f"{a}llcenter"] + d * np.arange(n) for a, d, n in (("x", dx, z.shape[1]), ("y", dy, z.shape[0]))
    )
    what, _, frame = what.partition("; coordinates of ")
    return Map(x, y, z, what.rpartition(" [")[0], frame)


@dataclass(frozen=True)
class RunUp:
    """The highest ground that the water reached and that was dry: z [m] and time of arrival [s] there, x, y [m] in the
    coordinates of `frame` · area [m²] of all ground that it reached"""

    z: float
    time: float
    x: float
    y: float
    frame: str
    area: float


def run_up(maps: Path) -> RunUp | None:
    """Of the maps of a run; None where the water reached no dry ground. Raises as `read_map`."""
    bed, arrival = read_map(maps / "bed.asc"), read_map(maps / "arrival.asc")
    reached = np.where(np.isfinite(arrival.z), bed.z, np.nan)
    if not np.isfinite(reached).any():
        return None
    row, column = np.unravel_index(int(np.nanargmax(reached)), reached.shape)
    of_one = (bed.x[1] - bed.x[0]) * (bed.y[1] - bed.y[0])
    return RunUp(
        float(reached[row, column]),
        float(arrival.z[row, column]),
        float(bed.x[column]),
        float(bed.y[row]),
        bed.frame,
        float(of_one * np.isfinite(reached).sum()),
    )


def _pairs(nodes: Array, fitted) -> tuple[Array, Array, Array, Array]:
    """Pairs of neighbouring nodes in the columns of the lattice: lower (p,), upper (p,), distance (p,) [m] and number
    of the column (p,). Nodes between the columns, of a mesh that is finer in parts, are left out."""
    X, Y = fitted.column_x, fitted.column_y
    i, j = (_nearest(axis, nodes[:, k]) for k, axis in enumerate((X, Y)))
    slack = 1e-6 * min(np.diff(X).min(), np.diff(Y).min())
    on = np.flatnonzero((np.abs(X[i] - nodes[:, 0]) < slack) & (np.abs(Y[j] - nodes[:, 1]) < slack))
    column = i[on] * len(Y) + j[on]
    order = np.lexsort((nodes[on, 2], column))
    on, column = on[order], column[order]
    same = np.flatnonzero(column[1:] == column[:-1])
    low, high = on[same], on[same + 1]
    return low, high, nodes[high, 2] - nodes[low, 2], column[same]


def _nearest(axis: Array, value: Array) -> Array:
    at = np.clip(np.searchsorted(axis, value), 1, len(axis) - 1)
    return np.where(value - axis[at - 1] < axis[at] - value, at - 1, at)
