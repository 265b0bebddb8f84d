"""Temporal VTKHDF files: one HDF5 file that grows by one step at a time and can be read after every step.

Layout (VTKHDF 2.0, https://docs.vtk.org, "VTKHDF file format"): flat arrays under /VTKHDF; the group
/VTKHDF/Steps says where each step begins in each of them. What does not change is written once and pointed at
again. Three rules keep a file readable whose writer is killed at any moment:

* an array of a step begins at a chunk border, so no chunk that holds older data is ever written again;
* the small tables (one number a step) are not compressed, so they are renewed in place;
* the count of steps, `NSteps`, is written after everything else has reached the file; only the time of the step
  comes later still, because VTK 9.7 writes past the end of its memory if a file has more times than steps.

The file is opened, extended and closed for each step, without a lock: a viewer that reads at the same time cannot stop
the run.

Two HDF5 layouts are combined on purpose. The file itself has the oldest one (superblock 0), because newer ones are
marked "open for writing" when their writer is killed, and VTK then refuses them. The arrays have the layout of HDF5
1.10, whose chunk index only grows; the older index splits its nodes about every 50th step, and a kill in just that
moment loses the whole array. Nothing newer: the HDF5 1.14 inside VTK must read it.
"""

from contextlib import contextmanager

import h5py
import numpy as np

from coupler.results.storage import claim

FILE_LAYOUT = ("earliest", "v110")
ARRAY_LAYOUT = ("v110", "v110")
COMPRESSION = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
TABLE_CHUNK = 256
HEADROOM = 1 << 18  # [bytes] for HDF5's own tables when a step is added


@contextmanager
def opened(path, mode="r+"):
    """The HDF5 file at `path`, unlocked, in the layouts that survive a kill and that VTK reads."""
    with h5py.File(path, mode, libver=FILE_LAYOUT if mode == "w" else ARRAY_LAYOUT, locking=False) as file:
        yield file


def create(path, kind, origin):
    """Start a file of `kind` ("UnstructuredGrid" or "PolyData"); its coordinates are relative to origin (3,) [m].

    Float32 has 7 digits: near zero that is 1 µm over 10 m, at map coordinates only 0.5 m.
    Raises FileExistsError (results are never overwritten) and DiskFull.
    """
    claim(path, HEADROOM)
    with opened(path, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = np.array([2, 0], dtype=np.int64)
        root.attrs["Type"] = np.bytes_(kind)
        scene = file.create_group("scene")
        scene.attrs["origin"] = np.asarray(origin, dtype=float)
        scene.attrs["units"] = "SI; points are metres relative to origin"


def create_steps(root, cell_kinds):
    """The empty /VTKHDF/Steps group; `cell_kinds` is 1 for an unstructured grid and 4 for polygonal data."""
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(0)
    table(steps, "Values", np.float64)
    for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
        table(steps, name)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        table(steps, name, width=cell_kinds)
    for name in ("PointDataOffsets", "CellDataOffsets"):
        steps.create_group(name)


def table(group, name, dtype=np.int64, width=None):
    """A growing column (steps,) or (steps, width), uncompressed, so that it is renewed in place."""
    tail = () if width is None else (width,)
    return group.create_dataset(
        name, shape=(0, *tail), maxshape=(None, *tail), chunks=(TABLE_CHUNK, *tail), dtype=dtype
    )


def growing(group, name, first, chunk=None):
    """A compressed growing array shaped and typed like `first` (n, ...); chunk: rows that one holds, None: n."""
    tail = first.shape[1:]
    chunk = max(1, len(first)) if chunk is None else chunk
    return group.create_dataset(
        name,
        shape=(0, *tail),
        maxshape=(None, *tail),
        chunks=(chunk, *tail),
        dtype=first.dtype,
        **COMPRESSION,
    )


def extend(array, values, start=None):
    """Put `values` (n, ...) behind the array at the next chunk border (or at `start`); return the row it begins at."""
    if start is None:
        chunk = array.chunks[0]
        start = -(-len(array) // chunk) * chunk
    array.resize(start + len(values), axis=0)
    array[start:] = values
    return start


def set_row(column, row, value):
    """Set one row of a table, growing it as needed (rows in between are zero)."""
    if len(column) <= row:
        column.resize(row + 1, axis=0)
    column[row] = value


def count(root):
    """Number of complete steps; none before the first one, when the arrays are not there either."""
    if "Steps" not in root:
        return 0
    return min(int(root["Steps"].attrs["NSteps"]), len(root["Steps"]["Values"]))


def write_offsets(steps, k, part, point, cell, connectivity):
    """Row k of /VTKHDF/Steps: where the geometry of this step begins."""
    set_row(steps["NumberOfParts"], k, 1)
    set_row(steps["PartOffsets"], k, part)
    set_row(steps["PointOffsets"], k, point)
    set_row(steps["CellOffsets"], k, cell)
    set_row(steps["ConnectivityIdOffsets"], k, connectivity)


def write_data(root, kind, k, values, again=(), chunk=None):
    """Append the arrays of one step to /VTKHDF/PointData or CellData (`kind`), and note where they begin.

    Names in `again` are the same as in the step before: what that one points at is pointed at again. chunk: see
    `growing`.
    """
    offsets = root["Steps"][kind + "Offsets"]
    for name, array in values.items():
        if name not in root[kind]:
            growing(root[kind], name, array, chunk)
            table(offsets, name)
        known = name in again and k > 0
        set_row(offsets[name], k, offsets[name][k - 1] if known else extend(root[kind][name], array))


def publish(file, k, time):
    """Make step k at `time` [s] visible; all its data must be in the file before the count includes it."""
    steps = file["VTKHDF"]["Steps"]
    file.flush()
    steps.attrs.modify("NSteps", np.int64(k + 1))
    file.flush()
    set_row(steps["Values"], k, time)


def cut_back(path, steps):
    """Remove all but the first `steps` steps; the rows that they left in the arrays stay unused.

    The times go first, because a reader must never find more of them than steps are counted."""
    with opened(path) as file:
        found = file["VTKHDF"]["Steps"]
        if len(found["Values"]) > steps:
            found["Values"].resize(steps, axis=0)
            file.flush()
        found.attrs.modify("NSteps", np.int64(steps))


def single(array):
    """Floats as float32 (results are not accurate to more than 7 digits), whole numbers as they are."""
    array = np.asarray(array)
    return np.ascontiguousarray(array, dtype=np.float32 if array.dtype.kind == "f" else array.dtype)


UNREADABLE = (OSError, KeyError, RuntimeError, AttributeError, TypeError, ValueError, IndexError)
"""Errors from reading a file that no run wrote: an incomplete file, another kind of file, a folder."""


def read_times(path):
    """Times (steps,) [s] of the complete steps of a file, also while it is being written."""
    with opened(path, "r") as file:
        root = file["VTKHDF"]
        steps = count(root)
        return root["Steps"]["Values"][:steps] if steps else np.empty(0)


def read_step(path, k):
    """Step k: points (n, 3), and the arrays of its points and of its cells by name; cells are read apart."""
    with opened(path, "r") as file:
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        part, start = steps["PartOffsets"][k], steps["PointOffsets"][k]
        n = root["NumberOfPoints"][part]
        m = root["NumberOfCells" if "NumberOfCells" in root else "Polygons/NumberOfCells"][part]
        points = root["Points"][start : start + n]
        return points, _read_data(root, "PointData", k, n), _read_data(root, "CellData", k, m)


def _read_data(root, kind, k, rows):
    offsets = root["Steps"][kind + "Offsets"]
    return {name: root[kind][name][offsets[name][k] : offsets[name][k] + rows] for name in root[kind]}


def read_tetrahedra(path, k):
    """Tetrahedra (m, 4) of step k of an unstructured grid."""
    with opened(path, "r") as file:
        root, steps = file["VTKHDF"], file["VTKHDF/Steps"]
        start = steps["ConnectivityIdOffsets"][k, 0]
        size = root["NumberOfConnectivityIds"][steps["PartOffsets"][k]]
        return root["Connectivity"][start : start + size].reshape(-1, 4)


def read_polygons(path):
    """Polygons of a file of faces: rows of the points one after the other, and where each polygon ends."""
    with opened(path, "r") as file:
        group = file["VTKHDF/Polygons"]
        return group["Connectivity"][:], group["Offsets"][1:]
