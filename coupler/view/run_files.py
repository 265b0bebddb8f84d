"""The files of a run as VTK data sets, also while the run still writes them."""

import os
from dataclasses import dataclass
from pathlib import Path

# A reader's lock would be in the way of the run that still writes; HDF5 reads this when it is loaded.
os.environ.setdefault("HDF5_USE_FILE_LOCKING", "FALSE")

import h5py
import numpy as np
import pyvista as pv
from vtkmodules.vtkIOHDF import vtkHDFReader

from coupler.errors import ExitCode, SurgebreakError
from coupler.vtkhdf import read_times


class NothingToShow(SurgebreakError):
    """The directory is no run, or the run has written no fields yet."""

    exit_code = ExitCode.BAD_CASE


class Series:
    """One temporal VTKHDF file: times (steps,) [s], and the data set of each step."""

    def __init__(self, path):
        self.path = Path(path)
        self.times = read_times(path)
        self._reader = vtkHDFReader()
        self._reader.SetFileName(str(path))
        self._reader.UpdateInformation()

    def at(self, time):
        """The data set of the stored step nearest to `time` [s]."""
        self._reader.SetStep(int(np.argmin(np.abs(self.times - time))))
        self._reader.Update()
        return pv.wrap(self._reader.GetOutputDataObject(0)).copy(deep=False)


@dataclass(frozen=True)
class RunFiles:
    """What a run has to show; absent parts are None. tank (2, 3) [m] relative to the origin."""

    directory: Path
    water: Series | None
    blocks: Series | None
    solids: object
    tank: np.ndarray | None
    times: np.ndarray

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
    water, blocks = (_series(directory / name) for name in ("fields.vtkhdf", "blocks.vtkhdf"))
    if water is None and blocks is None:
        raise NothingToShow(
            f"{directory}: neither fields.vtkhdf nor blocks.vtkhdf holds a step; the run has not reached its first "
            "output yet, or writes none (time.output_every)"
        )
    solids, tank = _solids(directory / "solids.vtkhdf")
    return RunFiles(directory, water, blocks, solids, tank, (water or blocks).times)


def _series(path):
    """The series at `path`, None if it is absent or holds no step."""
    if not path.exists() or len(read_times(path)) == 0:
        return None
    return Series(path)


def _solids(path):
    """Fixed solids and tank corners relative to the origin, None where absent."""
    if not path.exists():
        return None, None
    with h5py.File(path, "r", locking=False) as file:
        scene = file["scene"].attrs
        tank = scene["tank"] - scene["origin"] if "tank" in scene else None
        empty = len(file["VTKHDF/Points"]) == 0
    if empty:
        return None, tank
    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.Update()
    return pv.wrap(reader.GetOutputDataObject(0)), tank
