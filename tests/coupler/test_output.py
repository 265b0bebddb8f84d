"""The result files: what VTK reads back is what was written, and nothing that goes wrong harms what is there already.

A long run dies by a kill, a full disk or a diverged step; its results up to then are all one has.
"""

import os
import resource
import signal
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import h5py
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupler.results import storage, vtkhdf
from coupler.results.fields import BlockWriter, WaterWriter, write_solids
from coupler.results.storage import DiskFull, NotFinite, WrongShape
from tests.coupler.synthetic_run import BOX_FACES, box_vertices, rotations, tank_mesh

pytestmark = pytest.mark.before_yade

HERE = Path(__file__).parent
TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])


def read_with_vtk(path):
    """Arrays of all steps as VTK sees them (VTK and YADE cannot share a process, so it runs apart)."""
    if find_spec("vtkmodules") is None:  # not imported here: YADE refuses to follow it into a process
        pytest.skip("the extra `view` is not installed")
    result = Path(path).with_suffix(".npz")
    subprocess.run([sys.executable, str(HERE / "read_with_vtk.py"), str(path), str(result)], check=True)
    return np.load(result)


def fields(seed, n, m):
    """Random point and cell fields."""
    rng = np.random.default_rng(seed)
    point = {
        "level_set": rng.normal(size=n),
        "velocity": rng.normal(size=(n, 3)),
        "pressure": 1e5 * rng.random(n),
    }
    return point, {"fluid_fraction": rng.random(m)}


def write_steps(writer, sizes):
    """Steps on the first `size` tetrahedra of a small mesh; returns what was written, as float32."""
    nodes, cells = tank_mesh((2.0, 1.0, 1.0), 0.5)
    written = []
    for step, size in enumerate(sizes):
        mine = cells[:size]
        own = nodes[: mine.max() + 1]
        point, cell = fields(step, len(own), size)
        writer.append(0.1 * step, own, mine, point, cell)
        written.append((own, mine, point | cell))
    return written


def assert_same(found, written, origin):
    """Every array of every step, to the digits of float32."""
    assert int(found["steps"]) == len(written)
    for step, (nodes, cells, values) in enumerate(written):
        assert found[f"{step}/time"] == pytest.approx(0.1 * step)
        np.testing.assert_array_equal(found[f"{step}/cells"], cells.ravel())
        np.testing.assert_array_equal(found[f"{step}/ends"], np.arange(0, cells.size + 1, 4))
        np.testing.assert_array_equal(found[f"{step}/points"], (nodes - origin).astype(np.float32))
        for name, value in values.items():
            np.testing.assert_array_equal(found[f"{step}/{name}"], value.astype(np.float32))


@pytest.mark.parametrize("sizes", [[96, 96, 96], [10, 96, 7, 7, 50, 10, 21], [50, 49, 50]])
def test_vtk_reads_back_the_water_on_a_still_and_on_a_changing_mesh(tmp_path, sizes):
    """A mesh that grows over several chunks, shrinks and repeats: each a different branch of the offsets."""
    origin = np.array([0.25, -0.5, 1.0])
    written = write_steps(WaterWriter(tmp_path / "fields.vtkhdf", origin), sizes)
    assert_same(read_with_vtk(tmp_path / "fields.vtkhdf"), written, origin)


def test_a_still_mesh_is_stored_once(tmp_path):
    """Geometry is most of a step; a hundred steps of the same mesh must not hold it a hundred times."""
    write_steps(WaterWriter(tmp_path / "fields.vtkhdf"), [96] * 5)
    with h5py.File(tmp_path / "fields.vtkhdf") as file:
        assert len(file["VTKHDF/Types"]) == 96
        assert len(file["VTKHDF/PointData/pressure"]) > 4 * len(file["VTKHDF/Points"])


def test_a_mesh_that_grows_a_little_keeps_to_one_chunk_a_step(tmp_path):
    """Cells around blocks that come apart become two: every further chunk is compressed whole for a few rows."""
    write_steps(WaterWriter(tmp_path / "fields.vtkhdf"), [80, 84, 85, 81])
    with h5py.File(tmp_path / "fields.vtkhdf") as file:
        for name in ("Points", "Connectivity", "Types", "Offsets", "PointData/pressure"):
            array = file["VTKHDF"][name]
            assert array.id.get_num_chunks() == 4, name


def test_a_field_of_cells_that_stays_is_stored_once(tmp_path):
    """The share of cells outside of solids at rest is the same array in every state; one that is new is stored, and
    every state reads back its own."""
    path = tmp_path / "fields.vtkhdf"
    nodes, cells = tank_mesh((2.0, 1.0, 1.0), 0.5)
    writer = WaterWriter(path)
    shares = [fields(seed, 1, len(cells))[1]["fluid_fraction"] for seed in (7, 8)]
    written = [shares[0], shares[0], shares[1], shares[1], shares[0]]
    for k, share in enumerate(written):
        writer.append(0.1 * k, nodes, cells, fields(k, len(nodes), 1)[0], {"fluid_fraction": share})
    for k, share in enumerate(written):
        found = vtkhdf.read_step(path, k)[2]["fluid_fraction"]
        np.testing.assert_array_equal(found, share.astype(np.float32))
    with h5py.File(path, "r") as file:
        assert file["VTKHDF/CellData/fluid_fraction"].id.get_num_chunks() == 3


def test_vtk_reads_back_the_blocks(tmp_path):
    """Placed vertices are centre + rotation @ vertex; block data come back on each face of the block."""
    rng = np.random.default_rng(3)
    shapes, faces = (
        [box_vertices((2, 2, 1)), TETRAHEDRON],
        [BOX_FACES, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]],
    )
    writer = BlockWriter(tmp_path / "blocks.vtkhdf", shapes, faces, ["käfer", "b"], ["wall", "roof"])
    steps = [(rng.normal(size=(2, 3)), rotations(rng.normal(size=(2, 3))), rng.random(2)) for _ in range(3)]
    for k, (centre, rotation, damage) in enumerate(steps):
        writer.append(0.1 * k, centre, rotation, {"damage": damage})
    found = read_with_vtk(tmp_path / "blocks.vtkhdf")
    for k, (centre, rotation, damage) in enumerate(steps):
        placed = [c + v @ r.T for c, r, v in zip(centre, rotation, shapes)]
        np.testing.assert_allclose(found[f"{k}/points"], np.concatenate(placed), atol=1e-6)
        np.testing.assert_array_equal(found[f"{k}/damage"], np.repeat(damage, [6, 4]).astype(np.float32))
        np.testing.assert_array_equal(found[f"{k}/block"], [0] * 6 + [1] * 4)
        np.testing.assert_array_equal(found[f"{k}/group"], [1] * 6 + [0] * 4)
        np.testing.assert_array_equal(found[f"{k}/cells"][-3:], [8, 11, 10])


@pytest.mark.parametrize("number", [0, 2])
def test_vtk_reads_back_the_solids(tmp_path, number):
    """Also a tank without any solid in it is a file that VTK opens without a complaint."""
    vertices = [box_vertices((1, 1, 1)) + 5 * i for i in range(number)]
    write_solids(
        tmp_path / "solids.vtkhdf", vertices, [BOX_FACES] * number, ((0, 0, 0), (9, 9, 9)), (1, 0, 0)
    )
    with h5py.File(tmp_path / "solids.vtkhdf") as file:
        assert len(file["VTKHDF/Points"]) == 8 * number
        np.testing.assert_array_equal(file["scene"].attrs["tank"], [[0, 0, 0], [9, 9, 9]])
        np.testing.assert_array_equal(file["scene"].attrs["origin"], [1, 0, 0])


def test_map_coordinates_keep_their_millimetres(tmp_path):
    """At 5 000 km, float32 steps by 0.5 m; relative to the origin the millimetre survives."""
    origin = np.array([5e6, 5e6, 0.0])
    writer = WaterWriter(tmp_path / "fields.vtkhdf", origin)
    writer.append(0.0, TETRAHEDRON * 1e-3 + origin, [[0, 1, 2, 3]], {"level_set": np.zeros(4)}, {})
    with h5py.File(tmp_path / "fields.vtkhdf") as file:
        np.testing.assert_allclose(file["VTKHDF/Points"], TETRAHEDRON * 1e-3, rtol=1e-5, atol=1e-9)


@given(data=st.data())
@settings(max_examples=20, deadline=None)
def test_one_bad_number_anywhere_is_refused_by_name_and_row(tmp_path_factory, data):
    """The message leads to the place: which field, which row, at what time; and the step is not there."""
    name, component = data.draw(st.sampled_from([("level_set", ()), ("velocity", (2,)), ("pressure", ())]))
    row, bad = data.draw(st.integers(0, 3)), data.draw(st.sampled_from([np.nan, np.inf, -np.inf]))
    path = tmp_path_factory.mktemp("bad") / "fields.vtkhdf"
    writer = WaterWriter(path)
    point, cell = fields(0, 4, 1)
    writer.append(0.0, TETRAHEDRON, [[0, 1, 2, 3]], point, cell)
    point[name][(row, *component)] = bad
    with pytest.raises(NotFinite, match=rf"t = 0.25 s: {name}\[{', '.join(map(str, (row, *component)))}\]"):
        writer.append(0.25, TETRAHEDRON, [[0, 1, 2, 3]], point, cell)
    np.testing.assert_array_equal(vtkhdf.read_times(path), [0.0])


def test_a_field_of_the_wrong_length_is_refused(tmp_path):
    """A cell field handed over as a point field would shift every later step."""
    writer = WaterWriter(tmp_path / "fields.vtkhdf")
    with pytest.raises(WrongShape, match=r"pressure has shape \(3,\); expected 4 rows"):
        writer.append(0.0, TETRAHEDRON, [[0, 1, 2, 3]], {"pressure": np.zeros(3)}, {})


def test_results_are_never_overwritten(tmp_path):
    """A second run must not eat the files of the first."""
    WaterWriter(tmp_path / "fields.vtkhdf")
    with pytest.raises(FileExistsError):
        WaterWriter(tmp_path / "fields.vtkhdf")


def test_a_viewer_that_holds_the_file_does_not_stop_the_run(tmp_path):
    """HDF5 locks files by default; a reader with the lock must not make the next step fail."""
    path = tmp_path / "fields.vtkhdf"
    writer = WaterWriter(path)
    write_steps(writer, [96])
    hold = (
        "import h5py, sys; f = h5py.File(sys.argv[1], 'r', locking=True); print('held', flush=True); input()"
    )
    pipe = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen([sys.executable, "-c", hold, str(path)], **pipe) as viewer:
        assert viewer.stdout.readline() == b"held\n"
        write_steps(writer, [96])
        viewer.communicate(b"\n")
    np.testing.assert_allclose(vtkhdf.read_times(path), [0.0, 0.0])


KILLED = """
import sys, numpy as np
from coupler.results.fields import WaterWriter
from tests.coupler.synthetic_run import tank_mesh
nodes, cells = tank_mesh((6.0, 6.0, 6.0), 1.0)
writer, rng = WaterWriter(sys.argv[1]), np.random.default_rng(0)
for k in range(100000):
    part = cells[: 600 + 97 * (k % 7)] if sys.argv[2] == "changing" else cells
    writer.append(k, nodes, part, {"level_set": k + rng.random(len(nodes))}, {"fluid_fraction": rng.random(len(part))})
    if k == 1:  # VTK gives a file of one step no time
        print("two steps", flush=True)
"""


@pytest.mark.parametrize("mesh", ["still", "changing"])
@pytest.mark.parametrize("moment", [0.02, 0.13, 0.4])
def test_a_killed_writer_leaves_all_its_complete_steps(tmp_path, mesh, moment):
    """SIGKILL in a loop that does nothing but write: every step that the file counts must be whole."""
    path = tmp_path / "fields.vtkhdf"
    command = [sys.executable, "-c", KILLED, str(path), mesh]
    with subprocess.Popen(command, cwd=HERE.parents[1], stdout=subprocess.PIPE) as writer:
        writer.stdout.readline()
        time.sleep(moment)
        writer.send_signal(signal.SIGKILL)
    found = read_with_vtk(path)
    assert int(found["steps"]) >= 1
    for k in range(int(found["steps"])):
        assert np.all(found[f"{k}/level_set"] >= k)
        assert np.all(found[f"{k}/level_set"] <= k + 1)
        assert len(found[f"{k}/fluid_fraction"]) == len(found[f"{k}/cells"]) / 4


@pytest.fixture
def small_files():
    """A limit of 400 kB per file: the kernel refuses to grow a file further, as a full disk or a quota does."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


def write_forever(writer, nodes, cells):
    """Step after step until something stops it."""
    for k in range(1000):
        writer.append(k, nodes, cells, *fields(k, len(nodes), len(cells)))


def test_a_full_disk_is_named_and_harms_nothing(tmp_path, small_files):
    """The message says which file and what it still holds; the file opens and has exactly those steps."""
    path = tmp_path / "fields.vtkhdf"
    nodes, cells = tank_mesh((6.0, 6.0, 6.0), 1.0)
    writer = WaterWriter(path)
    with pytest.raises(DiskFull, match=r"fields.vtkhdf: no room .* up to t = \d+ s; free some space"):
        write_forever(writer, nodes, cells)
    done = len(vtkhdf.read_times(path))
    assert done > 2
    with h5py.File(path) as file:
        last = file["VTKHDF/PointData/level_set"][-len(nodes) :]
    np.testing.assert_array_equal(
        last, fields(done - 1, len(nodes), len(cells))[0]["level_set"].astype(np.float32)
    )


def test_a_disk_that_is_full_from_the_start_leaves_no_file_behind(tmp_path, small_files, monkeypatch):
    """The error is the named one, and a second try is not stopped by a file that the first one left."""
    monkeypatch.setattr(vtkhdf, "HEADROOM", 500_000)
    with pytest.raises(DiskFull, match=r"no room for the next 0.5 MB"):
        WaterWriter(tmp_path / "fields.vtkhdf")
    assert list(tmp_path.iterdir()) == []


def test_claiming_room_leaves_the_file_as_it_was(tmp_path):
    """Room is claimed and given back, so that the size on disk is what was written."""
    path = tmp_path / "some"
    path.write_bytes(b"x" * 1000)
    storage.reserve(path, 10_000_000, "now")
    assert path.read_bytes() == b"x" * 1000
    assert os.stat(path).st_blocks * 512 < 100_000
