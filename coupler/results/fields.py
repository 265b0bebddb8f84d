"""The fields of a run: water on tetrahedra, blocks as moving polyhedra, and the solids that never move.

`fields.vtkhdf`  points, tetrahedra; per node level_set [m], velocity [m/s], pressure [Pa] and, where air is trapped,
                 pocket, its number for life (0: none); per cell fluid_fraction [-]
`blocks.vtkhdf`  the faces of the blocks at their present place; per face block, group and further values of the run
`solids.vtkhdf`  fixed solids and the tank box
All three state the origin [m] that their float32 coordinates are relative to.
"""

from pathlib import Path

import numpy as np

from coupler.results import vtkhdf
from coupler.results.storage import finite, reserve, rows

TETRAHEDRON = 10  # VTK's cell type
GROWTH = 16
"""A mesh around blocks that come apart gains a fiftieth of its cells; where it needs a second chunk, that is compressed
whole for a few rows."""
NO_CELLS = (
    "Vertices",
    "Lines",
    "Strips",
)  # kinds of polygonal data that a file must name even if it has none


class WaterWriter:
    """Water fields in time, on a mesh that may stay the same (written once) or change (written again) from step to
    step.

    keep: steps after which an existing file is continued.
    """

    def __init__(self, path, origin=(0.0, 0.0, 0.0), keep=None):
        self.path = Path(path)
        self.origin = np.asarray(origin, dtype=float)
        self._geometry = None
        self._place = None
        self._last_time = None
        self._of_cells = {}
        if keep is None:
            vtkhdf.create(self.path, "UnstructuredGrid", self.origin)
        else:
            vtkhdf.cut_back(self.path, keep)
            self._place, self._geometry = _last_grid(self.path, keep)
            self._last_time = last_time(self.path)

    def append(self, time, nodes, cells, point_data, cell_data):
        """Write one step.

        time [s] · nodes (n, 3) [m] · cells (m, 4) rows of nodes · point_data {name: (n,) or (n, 3)} ·
        cell_data {name: (m,) or (m, 3)}; the same names at every step. An array of cells that is the same object as in
        the step before is not written again.
        Raises NotFinite, WrongShape or DiskFull; the steps written before stay readable in each case.
        """
        where = f"{self.path} at t = {time:.6g} s"
        again = [a for a, values in cell_data.items() if values is self._of_cells.get(a)]
        nodes, cells = rows("nodes", nodes, len(nodes), where), np.asarray(cells)
        point = {
            a: vtkhdf.single(finite(a, rows(a, v, len(nodes), where), where)) for a, v in point_data.items()
        }
        cell = {
            a: v if a in again else vtkhdf.single(finite(a, rows(a, v, len(cells), where), where))
            for a, v in cell_data.items()
        }
        finite("nodes", nodes, where)
        changed = self._changed(nodes, cells)
        size = sum(a.nbytes for a in (*point.values(), *cell.values())) + changed * (
            12 * nodes.size + 25 * len(cells)
        )
        reserve(self.path, size + vtkhdf.HEADROOM, readable(self._last_time))
        with vtkhdf.opened(self.path) as file:
            root = file["VTKHDF"]
            if "Steps" not in root:
                _create_grid(root, nodes, cells)
            if changed:
                self._place = _write_grid(root, nodes - self.origin, cells)
            k = vtkhdf.count(root)
            vtkhdf.write_offsets(root["Steps"], k, **self._place)
            of_points, of_cells = root["Points"].chunks[0], root["Types"].chunks[0]
            vtkhdf.write_data(root, "PointData", k, point, chunk=of_points)
            vtkhdf.write_data(root, "CellData", k, cell, again, chunk=of_cells)
            vtkhdf.publish(file, k, time)
        self._geometry, self._last_time, self._of_cells = (nodes, cells), time, dict(cell_data)

    def _changed(self, nodes, cells):
        """Whether the mesh differs from that of the last step, as far as the file can tell (the same arrays need no
        comparison)."""
        if self._geometry is None:
            return True
        old_nodes, old_cells = self._geometry
        if nodes is not old_nodes and not np.array_equal(self._in_file(nodes), self._in_file(old_nodes)):
            return True
        return cells is not old_cells and not np.array_equal(cells, old_cells)

    def _in_file(self, nodes):
        """Coordinates as stored in the file; those that were read from it are returned unchanged."""
        return nodes if nodes.dtype == np.float32 else (nodes - self.origin).astype(np.float32)


def _last_grid(path, steps):
    """Start of the last step's grid in the arrays, and its points (float32) and cells."""
    with vtkhdf.opened(path, "r") as file:
        found = file["VTKHDF/Steps"]
        k = steps - 1
        place = {
            "part": int(found["PartOffsets"][k]),
            "point": int(found["PointOffsets"][k]),
            "cell": int(found["CellOffsets"][k, 0]),
            "connectivity": int(found["ConnectivityIdOffsets"][k, 0]),
        }
    return place, (vtkhdf.read_step(path, k)[0], vtkhdf.read_tetrahedra(path, k))


def last_time(path):
    """Time [s] of the last complete step, None before the first."""
    times = vtkhdf.read_times(path)
    return float(times[-1]) if len(times) else None


def _create_grid(root, nodes, cells):
    """Empty arrays of an unstructured grid; a chunk holds a mesh larger than the first one by 1/GROWTH, and a still
    larger mesh takes several."""
    n, m = (max(1, rows + rows // GROWTH) for rows in (len(nodes), len(cells)))
    vtkhdf.growing(root, "Points", np.empty((0, 3), np.float32), n)
    vtkhdf.growing(root, "Connectivity", np.empty(0, np.int32), 4 * m)
    vtkhdf.growing(root, "Types", np.empty(0, np.uint8), m)
    vtkhdf.growing(root, "Offsets", np.empty(0, np.int32), m + 1)
    for name in ("NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"):
        vtkhdf.table(root, name)
    root.create_group("PointData")
    root.create_group("CellData")
    vtkhdf.create_steps(root, 1)


def _write_grid(root, points, cells):
    """Append one mesh; return where it begins.

    A reader looks for the Offsets of a part at (row of its first cell + index of the part). Numbering the parts by
    the chunk they begin in, empty parts in between, puts that at a chunk border of Offsets as well.
    """
    cell = vtkhdf.extend(root["Types"], np.full(len(cells), TETRAHEDRON, np.uint8))
    part = cell // root["Types"].chunks[0]
    point = vtkhdf.extend(root["Points"], points.astype(np.float32))
    connectivity = vtkhdf.extend(root["Connectivity"], cells.ravel().astype(np.int32))
    vtkhdf.extend(root["Offsets"], np.arange(0, cells.size + 1, 4, dtype=np.int32), start=cell + part)
    vtkhdf.set_row(root["NumberOfPoints"], part, len(points))
    vtkhdf.set_row(root["NumberOfCells"], part, len(cells))
    vtkhdf.set_row(root["NumberOfConnectivityIds"], part, cells.size)
    return {"part": part, "point": point, "cell": cell, "connectivity": connectivity}


class BlockWriter:
    """Blocks in time: faces of rigid polyhedra, x = centre + rotation @ vertex."""

    def __init__(self, path, shape_vertices, shape_faces, names, groups, origin=(0.0, 0.0, 0.0), keep=None):
        """shape_vertices: per block (k, 3) [m] about its centre · shape_faces: per block lists of rows of them ·
        names, groups: per block, text · keep: steps after which an existing file is continued."""
        self.path = Path(path)
        self.origin = np.asarray(origin, dtype=float)
        self._vertices = np.concatenate([np.asarray(v, dtype=float) for v in shape_vertices])
        self._block_of_vertex = np.repeat(np.arange(len(names)), [len(v) for v in shape_vertices])
        self._faces = joined_faces(shape_vertices, shape_faces)
        self._block_of_face = np.repeat(np.arange(len(names), dtype=np.int32), [len(f) for f in shape_faces])
        self._n = len(names)
        self._last_time = None
        group_names, group_of_block = np.unique(np.asarray(groups, dtype=str), return_inverse=True)
        self._group_of_face = group_of_block.astype(np.int32)[self._block_of_face]
        if keep is None:
            self._create(names, group_names)
        else:
            vtkhdf.cut_back(self.path, keep)
            self._last_time = last_time(self.path)

    def _create(self, names, group_names):
        vtkhdf.create(self.path, "PolyData", self.origin)
        with vtkhdf.opened(self.path) as file:
            _create_faces(file["VTKHDF"], len(self._vertices), self._faces)
            vtkhdf.create_steps(file["VTKHDF"], 4)
            file["scene"]["names"] = np.char.encode(np.asarray(names, dtype=str), "utf-8")
            file["scene"]["group_names"] = np.char.encode(group_names, "utf-8")

    def append(self, time, centre, rotation, block_data):
        """Write one step.

        time [s] · centre (n, 3) [m] · rotation (n, 3, 3) body → world · block_data {name: (n,) or (n, 3)}, for
        instance damage [-] and speed [m/s]; the same names at every step. Raises NotFinite, WrongShape, DiskFull.
        """
        where = f"{self.path} at t = {time:.6g} s"
        centre = finite("centre", rows("centre", centre, self._n, where), where)
        rotation = finite("rotation", rows("rotation", rotation, self._n, where), where)
        data = {a: vtkhdf.single(finite(a, rows(a, v, self._n, where), where)) for a, v in block_data.items()}
        points = self._placed(centre, rotation).astype(np.float32)
        faces = {"block": self._block_of_face, "group": self._group_of_face}
        faces |= {name: values[self._block_of_face] for name, values in data.items()}
        size = points.nbytes + sum(a.nbytes for a in faces.values())
        reserve(self.path, size + vtkhdf.HEADROOM, readable(self._last_time))
        with vtkhdf.opened(self.path) as file:
            root = file["VTKHDF"]
            k = vtkhdf.count(root)
            point = vtkhdf.extend(root["Points"], points)
            vtkhdf.write_offsets(root["Steps"], k, part=0, point=point, cell=0, connectivity=0)
            vtkhdf.write_data(root, "CellData", k, faces, again=("block", "group"))
            vtkhdf.publish(file, k, time)
        self._last_time = time

    def _placed(self, centre, rotation):
        """World coordinates (V, 3) of all vertices, relative to the origin."""
        owner = self._block_of_vertex
        return (centre - self.origin)[owner] + np.einsum("vij,vj->vi", rotation[owner], self._vertices)


def write_solids(path, vertices, faces, tank=None, origin=(0.0, 0.0, 0.0), basin=None):
    """Write the parts that do not move: fixed solids (per solid (k, 3) [m] world and faces), the tank (lower, upper)
    [m] and, of one that is no box, the ends (n, 2, 3) [m] of its edges."""
    origin = np.asarray(origin, dtype=float)
    vtkhdf.create(path, "PolyData", origin)
    points = (
        np.concatenate([np.asarray(v, dtype=float) for v in vertices]) if len(vertices) else np.empty((0, 3))
    )
    polygons = joined_faces(vertices, faces)
    with vtkhdf.opened(path) as file:
        root = file["VTKHDF"]
        _create_faces(root, len(points), polygons)
        vtkhdf.extend(root["Points"], (points - origin).astype(np.float32))
        solid = np.repeat(np.arange(len(vertices), dtype=np.int32), [len(f) for f in faces])
        vtkhdf.extend(vtkhdf.growing(root["CellData"], "solid", solid), solid)
        if tank is not None:
            file["scene"].attrs["tank"] = np.asarray(tank, dtype=float)
        if basin is not None:
            file["scene"]["basin"] = np.asarray(basin, dtype=float)


def joined_faces(vertices, faces):
    """Faces of several polyhedra as one list of rows of their concatenated vertices."""
    start = np.concatenate([[0], np.cumsum([len(v) for v in vertices], dtype=int)])
    return [np.asarray(face, dtype=int) + first for first, own in zip(start, faces) for face in own]


def _create_faces(root, n_points, faces):
    """Polygonal data: fixed polygons over `n_points` points that are still to be written."""
    sizes = np.array([len(face) for face in faces], dtype=np.int64)
    root["NumberOfPoints"] = np.array([n_points], dtype=np.int64)
    vtkhdf.growing(root, "Points", np.empty((n_points, 3), np.float32))
    _write_cells(root, "Polygons", np.concatenate(faces) if faces else np.empty(0, int), np.cumsum(sizes))
    for kind in NO_CELLS:
        _write_cells(root, kind, np.empty(0, int), np.empty(0, int))
    root.create_group("PointData")
    root.create_group("CellData")


def _write_cells(root, kind, connectivity, ends):
    """One kind of cells of polygonal data, in one part."""
    group = root.create_group(kind)
    group["NumberOfCells"] = np.array([len(ends)], dtype=np.int64)
    group["NumberOfConnectivityIds"] = np.array([len(connectivity)], dtype=np.int64)
    group["Connectivity"] = connectivity.astype(np.int64)
    group["Offsets"] = np.concatenate([[0], ends]).astype(np.int64)


def readable(last_time):
    """The readable content of a file, for messages."""
    return "but holds no step yet" if last_time is None else f"up to t = {last_time:.6g} s"
