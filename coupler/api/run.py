"""A run that is read back from the files in its directory, also while it is in progress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from array_types import Floats, Ints
from coupler.api.execution import resume
from coupler.api.step import Step
from coupler.program.errors import NoRun, SurgebreakError, UnknownName, did_you_mean
from coupler.program.extras import need
from coupler.program.process import run_module, status_of, trouble
from coupler.results import vtkhdf
from coupler.results.history import History, read_history
from coupler.run.summary import read_summary

if TYPE_CHECKING:
    import pandas


TABLES = ("blocks", "buildings", "cracks")
"""Tables beside the histories: a row for each block, building and joint."""


class NotDrawn(SurgebreakError):
    """The process that makes pictures or the report did not end well."""


@dataclass(frozen=True, kw_only=True)
class WaterState:
    """The water at a stored time [s].

    nodes (n, 3) [m] · cells (m, 4) rows of nodes · level_set (n,) [m], negative in the water · velocity (n, 3) [m/s] ·
    pressure (n,) [Pa] · fluid_fraction (m,), share of a cell outside the solids
    """

    time: float
    nodes: Floats
    cells: Ints
    level_set: Floats
    velocity: Floats
    pressure: Floats
    fluid_fraction: Floats

    def mesh(self) -> Any:
        """A `pyvista.UnstructuredGrid`. Raises NotInstalled, and CrashesAfterYade in a process that has loaded
        YADE."""
        pv = _pyvista()
        cells = np.insert(self.cells, 0, 4, axis=1).ravel()
        found = pv.UnstructuredGrid(cells, np.full(len(self.cells), pv.CellType.TETRA), self.nodes)
        for name in ("level_set", "velocity", "pressure"):
            found.point_data[name] = getattr(self, name)
        found.cell_data["fluid_fraction"] = self.fluid_fraction
        return found


@dataclass(frozen=True, kw_only=True)
class BlockState:
    """The blocks at a stored time [s], as faces.

    points (k, 3) [m] · faces: per face the rows of its corners, in order · block (f,): number of the block of a face ·
    names, groups: one text per block · speed (n,) [m/s] of the centres · damage (n,): 0 whole, 1 all joints broken
    """

    time: float
    points: Floats
    faces: list[Ints]
    block: Ints
    names: list[str]
    groups: list[str]
    speed: Floats
    damage: Floats

    def corners(self, block: int | str) -> Floats:
        """Corners (k, 3) [m] of a block, by number or name. Raises UnknownName."""
        if isinstance(block, str):
            if block not in self.names:
                raise UnknownName(f"{block}: no such block{did_you_mean(block, self.names)}")
            block = self.names.index(block)
        rows = [face for face, owner in zip(self.faces, self.block) if owner == block]
        return self.points[np.unique(np.concatenate(rows))]

    def mesh(self) -> Any:
        """A `pyvista.PolyData`, damage and speed on the faces. Raises as `WaterState.mesh`."""
        faces = np.concatenate([np.insert(face, 0, len(face)) for face in self.faces])
        found = _pyvista().PolyData(self.points, faces)
        for name, values in (("damage", self.damage), ("speed", self.speed)):
            found.cell_data[name] = values[self.block]
        found.cell_data["block"] = self.block
        return found


class Run:
    """A run, read from its directory; returned by `surgebreak.open` and `Case.run`."""

    def __init__(self, directory: Path | str):
        """Raises NoRun if the directory contains no run."""
        self.directory = Path(directory)
        self.summary: dict[str, Any] = read_summary(self.directory)
        """run.json: status, figures, versions, machine, the case with every default."""

    def __repr__(self) -> str:
        return f"<surgebreak.Run {str(self.directory)!r}, {self.status}>"

    def reload(self) -> Run:
        """Read run.json again, for a run that is in progress in another process; returns the run itself."""
        self.summary = read_summary(self.directory)
        return self

    @property
    def status(self) -> str:
        """done, running, killed, stopped, diverged, crashed or bad_case."""
        return status_of(self.summary)

    @property
    def reason(self) -> str:
        """The reason for its end, in words; empty while it runs."""
        return self.summary["exit_reason"] or ""

    @property
    def figures(self) -> dict[str, Any]:
        """Figures of the run: steps, joints, joints_broken, energy_error, cpu_seconds by part, and others."""
        return dict(self.summary["figures"])

    @property
    def case(self) -> dict[str, Any]:
        """The case of the run, with all values in SI units, including defaults."""
        return dict(self.summary["case"])

    # ------------------------------------------------------------ tables

    @property
    def histories(self) -> list[str]:
        """Names of the history tables."""
        return sorted(path.stem for path in (self.directory / "history").glob("*.csv"))

    def history(self, name: str) -> History:
        """A history table by its name: `run.history("water")["volume"]` (rows,), NaN where a cell is empty; `columns`
        gives units and meanings. Also "blocks", "buildings" and "cracks", with a row for each of them as of the last
        stored time, where the run has them. Raises UnknownName, BadTable."""
        known = {path.stem: path for path in (self.directory / "history").glob("*.csv")}
        known |= {path.stem: path for path in (self.directory / f"{n}.csv" for n in TABLES) if path.exists()}
        if name not in known:
            near = did_you_mean(name, known) or "."
            why = " (it has no joints)" if name == "cracks" else ""
            raise UnknownName(
                f"{name}: {self.directory} has no such table{why}{near} It has {', '.join(sorted(known))}"
            )
        return read_history(known[name])

    def frame(self, name: str) -> pandas.DataFrame:
        """The same as a pandas table (the extra `pandas`); `attrs["units"]` gives the unit of each column."""
        return _frame(self.history(name))

    @property
    def cracks(self) -> History:
        """One row per joint at the last stored time: its blocks, its position, the time of its failure, its dissipated
        energy.

        Raises UnknownName for a run without joints."""
        return self.history("cracks")

    def cracks_frame(self) -> pandas.DataFrame:
        """The same as a pandas table."""
        return _frame(self.cracks)

    # ------------------------------------------------------------ fields

    @property
    def times(self) -> Floats:
        """Times [s] of the stored states, (k,)."""
        for name in ("fields.vtkhdf", "blocks.vtkhdf"):
            if (self.directory / name).exists():
                return np.asarray(vtkhdf.read_times(self.directory / name), float)
        return np.zeros(0)

    def water(self, time: float | None = None) -> WaterState:
        """The water at the stored time nearest to `time` [s]; None: the last one. Raises NoRun if no state is
        stored."""
        path, k, found = self._stored("fields.vtkhdf", "the case has no water", time)
        points, at_nodes, in_cells = vtkhdf.read_step(path, k)
        return WaterState(
            time=found,
            nodes=points + _scene(path)[0],
            cells=np.asarray(vtkhdf.read_tetrahedra(path, k), np.int64),
            level_set=np.asarray(at_nodes["level_set"], float),
            velocity=np.asarray(at_nodes["velocity"], float),
            pressure=np.asarray(at_nodes["pressure"], float),
            fluid_fraction=np.asarray(in_cells["fluid_fraction"], float),
        )

    def blocks(self, time: float | None = None) -> BlockState:
        """The blocks at the stored time nearest to `time` [s]; None: the last one. Raises NoRun if no state is
        stored."""
        path, k, found = self._stored("blocks.vtkhdf", "the case has no structure", time)
        points, _, on_faces = vtkhdf.read_step(path, k)
        origin, names, group_names = _scene(path)
        block = np.asarray(on_faces["block"], np.int64)
        first = np.unique(block, return_index=True)[1]  # a face of each block
        zeros = np.zeros(len(block))
        return BlockState(
            time=found,
            points=points + origin,
            faces=np.split(*_polygons(path)),
            block=block,
            names=names,
            groups=[group_names[g] for g in np.asarray(on_faces["group"], int)[first]],
            speed=np.asarray(on_faces["speed"], float)[first],
            damage=np.asarray(on_faces.get("damage", zeros), float)[first],
        )

    def _stored(self, name: str, absent: str, time: float | None) -> tuple[Path, int, float]:
        path = self.directory / name
        times = np.asarray(vtkhdf.read_times(path), float) if path.exists() else np.zeros(0)
        if len(times) == 0:
            raise NoRun(f"{path}: no state is stored there; {absent}, or its first output is still to come")
        k = len(times) - 1 if time is None else int(np.argmin(np.abs(times - time)))
        return path, k, float(times[k])

    # ------------------------------------------------------------ pictures, going on

    def picture(self, time: float | None = None, **options: Any) -> Path:
        """A still at the stored time nearest to `time` [s] as PNG, made in a separate process (needs the extra
        `view`).

        options: those of `surgebreak render`, for instance azimuth=-110, elevation=30, size="1280x720".
        Raises NotDrawn, NotInstalled.
        """
        return self.render("still", time=time, **options)[0]

    def render(self, *what: str, **options: Any) -> list[Path]:
        """Pictures as `surgebreak render` makes them: "still", "film", "plots"; without names, all of them. Returns
        the paths of the files.

        Raises NotDrawn, NotInstalled.
        """
        need("view")
        folder = Path(options.pop("to", None) or self.directory / "pictures")
        before = _written(folder)
        words = [f"--{name}" for name in what]
        for name, value in options.items():
            words += [] if value is None else [f"--{name.replace('_', '-')}={value}"]
        done = run_module(
            "coupler.commands.view", self.directory, *words, "--to", folder, capture_output=True, text=True
        )
        if done.returncode:
            raise NotDrawn(
                f"{self.directory}: no pictures: {trouble(done.returncode, done.stdout + done.stderr)}"
            )
        after = _written(folder)
        return sorted(path for path, stamp in after.items() if before.get(path) != stamp)

    def report(self, pictures: bool = True) -> Path:
        """Write report.html, one page about the run, and return its path. Raises NotDrawn."""
        words = [] if pictures else ["--no-pictures"]
        done = run_module(
            "coupler.commands.cli", "report", self.directory, *words, capture_output=True, text=True
        )
        if done.returncode:
            raise NotDrawn(
                f"{self.directory}: no report: {trouble(done.returncode, done.stdout + done.stderr)}"
            )
        return self.directory / "report.html"

    def resume(
        self,
        changes: tuple[str, ...] | list[str] = (),
        callback: Callable[[Step], object] | None = None,
        stop: Callable[[Step], object] | None = None,
        quiet: bool = True,
        any_version: bool = False,
    ) -> Run:
        """Continue from the newest checkpoint, as `surgebreak resume` does, and return the `Run`.

        changes: `KEY=VALUE`, for instance "time.end=4 s" · the other arguments as in `Case.run`. Raises CannotResume,
        Busy, and
        what `Case.run` raises.
        """
        resume(self.directory, changes, callback, stop, quiet, any_version)
        return Run(self.directory)


def _written(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.glob("*")} if folder.is_dir() else {}


def _polygons(path: Path) -> tuple[Ints, Ints]:
    """Rows of points of all faces one after the other, and where each but the last ends."""
    rows, ends = vtkhdf.read_polygons(path)
    return np.asarray(rows, np.int64), np.asarray(ends, np.int64)[:-1]


def _scene(path: Path) -> tuple[Floats, list[str], list[str]]:
    """Origin (3,) [m], names of the blocks and of their groups."""
    with h5py.File(path, "r", locking=False) as file:
        scene = file["scene"]
        texts = [
            [text.decode() for text in scene[name][:]] if name in scene else []
            for name in ("names", "group_names")
        ]
        return np.asarray(scene.attrs["origin"], float), texts[0], texts[1]


def _frame(table: History) -> pandas.DataFrame:
    need("pandas")
    import pandas

    found = pandas.DataFrame(table.values)
    found.attrs["title"] = table.title
    found.attrs["units"] = {column.name: column.unit for column in table.columns}
    found.attrs["meanings"] = {column.name: column.meaning for column in table.columns}
    return found


def _pyvista() -> Any:
    need("view")
    import importlib

    return importlib.import_module("pyvista")
