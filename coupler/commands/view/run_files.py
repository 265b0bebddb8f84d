"""The files of a run, read step by step, also while the run still writes them.

HDF5 reads them, not VTK: VTK's reader may crash on a file that grows while it is read.
"""

import time as clock
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np
import pyvista as pv

from coupler.commands.view.flood_map import in_tank
from coupler.program.errors import ExitCode, SurgebreakError
from coupler.results import vtkhdf
from coupler.results.maps import read_map

TRIES, PAUSE = 20, 0.1  # a step that is just being added takes milliseconds


class NothingToShow(SurgebreakError):
    """The directory is no run, or the run has written no fields yet."""

    exit_code = ExitCode.BAD_CASE


@dataclass(frozen=True)
class Water:
    """The water at one time: nodes (n, 3) [m], cells (m, 4), level_set (n,) [m], velocity (n, 3) [m/s], fraction (m,)
    of each cell outside solids; pocket (n,) number of the trapped air at the nodes, 0: none, with its pressure (n,)
    [Pa] there."""

    nodes: np.ndarray
    cells: np.ndarray
    level_set: np.ndarray
    velocity: np.ndarray
    fraction: np.ndarray
    pocket: np.ndarray
    pressure: np.ndarray


class Series:
    """The complete steps of one file: times (steps,) [s]."""

    def __init__(self, path):
        self.path = Path(path)
        self.times = patiently(vtkhdf.read_times, path)

    def step(self, time):
        """Number of the step nearest to `time` [s]."""
        return int(np.argmin(np.abs(self.times - time)))


class WaterSeries(Series):
    """fields.vtkhdf"""

    def at(self, time):
        """Water of the step nearest to `time` [s]."""
        k = self.step(time)
        nodes, values, of_cells = patiently(vtkhdf.read_step, self.path, k)
        cells = patiently(vtkhdf.read_tetrahedra, self.path, k).astype(np.int64)
        velocity = values.get("velocity", np.zeros_like(nodes))
        fraction = of_cells.get("fluid_fraction", np.ones(len(cells)))
        none = np.zeros(len(nodes))
        return Water(
            nodes=nodes.astype(float),
            cells=cells,
            level_set=values["level_set"].astype(float),
            velocity=velocity,
            fraction=fraction,
            pocket=values.get("pocket", none).astype(int),
            pressure=values.get("pressure", none),
        )


class BlockSeries(Series):
    """blocks.vtkhdf"""

    def __init__(self, path):
        super().__init__(path)
        self._faces = faces_for_vtk(*patiently(vtkhdf.read_polygons, path))

    def at(self, time):
        """The blocks as a surface mesh with their data on the faces, at the step nearest to `time` [s]."""
        points, _, values = patiently(vtkhdf.read_step, self.path, self.step(time))
        mesh = pv.PolyData(points, self._faces)
        for name, array in values.items():
            mesh.cell_data[name] = array
        return mesh


def patiently(read, *given):
    """Call `read`; try again after a moment if the run is changing the file at the same time."""
    for left in reversed(range(TRIES)):
        try:
            return read(*given)
        except vtkhdf.UNREADABLE as error:
            if left == 0:
                raise NothingToShow(f"{given[0]}: not what a run writes: {error}") from error
            clock.sleep(PAUSE)
    raise AssertionError("the last try returns or raises")


def faces_for_vtk(connectivity, ends):
    """Polygons in the order size, corners, size, corners, …"""
    sizes = np.diff(ends, prepend=0)
    return np.insert(connectivity, ends - sizes, sizes)


@dataclass(frozen=True)
class RunFiles:
    """The files of a run; absent parts are None. tank (2, 3) and the edges of one that is no box, basin (k, 2, 3),
    [m] relative to the origin · bed: of a terrain, a surface."""

    directory: Path
    water: WaterSeries | None
    blocks: BlockSeries | None
    solids: object
    tank: np.ndarray | None
    times: np.ndarray
    basin: np.ndarray | None = None
    bed: object = None

    def check(self, time) -> None:
        """Raise NothingToShow for a time [s] that no stored step is near to; None is the last one."""
        near = np.diff(self.times).max(initial=0.0)
        if time is not None and not self.times[0] - near <= time <= self.times[-1] + near:
            first, last = self.times[0], self.times[-1]
            raise NothingToShow(
                f"--time {time:g}: {self.directory} has states from {first:g} s to {last:g} s"
            )

    def nearest(self, time):
        """The stored time nearest to `time`; the last one for None."""
        return self.times[-1] if time is None else self.times[np.argmin(np.abs(self.times - time))]


def open_run(directory):
    """Open a run directory; raise NothingToShow with what is missing and what to do."""
    directory = Path(directory)
    if not directory.is_dir():
        raise NothingToShow(
            f"{directory}: no such run directory; `surgebreak run CASE` makes one under runs/"
        )
    water = _series(WaterSeries, directory / "fields.vtkhdf")
    blocks = _series(BlockSeries, directory / "blocks.vtkhdf")
    if water is None and blocks is None:
        if (directory / "case.toml").is_file() and not (directory / "run.json").exists():
            raise NothingToShow(f"{directory}: a case; name one of its runs, in {directory / 'runs'}/")
        raise NothingToShow(
            f"{directory}: neither fields.vtkhdf nor blocks.vtkhdf holds a step; the run has not reached its first "
            "output yet, or it was stopped before"
        )
    solids, tank, basin = _solids(directory / "solids.vtkhdf")
    bed = _bed(directory)
    return RunFiles(
        directory=directory,
        water=water,
        blocks=blocks,
        solids=solids,
        tank=tank,
        times=(water or blocks).times,
        basin=basin,
        bed=bed,
    )


def _bed(directory):
    """The ground of a run over terrain as a surface, None without one."""
    path = directory / "maps" / "bed.asc"
    if not path.exists():
        return None
    found = read_map(path)
    x, y = np.meshgrid(*in_tank(directory, found))
    z = np.asarray(found.z, float)
    return pv.StructuredGrid(x, y, np.where(np.isfinite(z), z, np.nanmin(z))).extract_surface(
        algorithm="dataset_surface"
    )


def _series(kind, path):
    """The series at `path`, None if it is absent or holds no step."""
    if not path.exists() or len(patiently(vtkhdf.read_times, path)) == 0:
        return None
    return kind(path)


def _solids(path):
    """Fixed solids (None without any), tank corners (None without a tank) and its edges where it is no box, relative
    to the origin."""
    if not path.exists():
        return None, None, None
    with h5py.File(path, "r", locking=False) as file:
        scene, points, number = (
            file["scene"].attrs,
            file["VTKHDF/Points"][:],
            file["VTKHDF/CellData/solid"][:],
        )
        tank = scene["tank"] - scene["origin"] if "tank" in scene else None
        basin = file["scene/basin"][:] - scene["origin"] if "basin" in file["scene"] else None
    faces = faces_for_vtk(*vtkhdf.read_polygons(path))
    if len(points) == 0:
        return None, tank, basin
    solids = pv.PolyData(points, faces)
    solids.cell_data["solid"] = number
    return solids, tank, basin
