"""Results for other programs: what they read is what the run stored; ParaView 5.11 opens it where it is installed."""

import json
import shutil
import subprocess
import xml.etree.ElementTree as ET

import meshio
import numpy as np
import pytest
import trimesh
from scipy.io import netcdf_file
from typer.testing import CliRunner

from coupler.commands.cli import app
from coupler.commands.export.command import CannotExport, export
from coupler.commands.export.netcdf import FILL, write_netcdf
from coupler.commands.export.stored import stored
from coupler.results.history import HistoryTable, read_history
from coupler.results.vtkhdf import read_step, read_tetrahedra, read_times
from tests.coupler.fake_runs import SUMMARY
from tests.coupler.synthetic_run import write_run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    path = write_run(tmp_path_factory.mktemp("run") / "run", cell=4.0, times=np.linspace(0.0, 2.0, 4))
    reported = {
        "status": "done",
        "exit_reason": "reached the end",
        "figures": {},
        "case": {"case": {"title": "made up"}},
    }
    (path / "run.json").write_text(json.dumps(SUMMARY | reported))
    return path


@pytest.fixture(scope="module")
def exported(run, tmp_path_factory):
    to = tmp_path_factory.mktemp("export")
    export(run, ["vtk", "netcdf", "gltf"], to, 0.0, np.inf, tell=lambda text: None)
    return to


def files_of(pvd):
    """Time and file of each entry of a .pvd."""
    return [(float(d.get("timestep")), pvd.parent / d.get("file")) for d in ET.parse(pvd).iter("DataSet")]


def test_every_stored_state_of_the_water_is_there_value_for_value(run, exported):
    found = files_of(exported / "water.pvd")
    assert [time for time, _ in found] == read_times(run / "fields.vtkhdf").tolist()
    for k, (_, path) in enumerate(found):
        mesh = meshio.read(path)
        points, nodal, cellwise = read_step(run / "fields.vtkhdf", k)
        np.testing.assert_array_equal(mesh.points, points)
        np.testing.assert_array_equal(mesh.cells_dict["tetra"], read_tetrahedra(run / "fields.vtkhdf", k))
        for name, values in nodal.items():
            np.testing.assert_array_equal(mesh.point_data[name], values)
        np.testing.assert_array_equal(mesh.cell_data["fluid_fraction"][0], cellwise["fluid_fraction"])


def test_blocks_keep_their_numbers_though_their_faces_are_sorted_by_corners(run, exported):
    series = stored(run / "blocks.vtkhdf")
    points, cells, _, data = series.step(3)
    mesh = meshio.read(files_of(exported / "blocks.pvd")[3][1])
    np.testing.assert_array_equal(mesh.points, points)
    for block, own, (_, rows, order) in zip(mesh.cells, mesh.cell_data["block"], cells):
        np.testing.assert_array_equal(block.data, rows)
        np.testing.assert_array_equal(own, data["block"][order])


def test_exporting_again_adds_only_what_is_new(run, tmp_path):
    reported = []
    export(run, ["vtk"], tmp_path, 0.0, 1.0, tell=reported.append)
    old = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*.vtu")}
    export(run, ["vtk"], tmp_path, 0.0, np.inf, tell=reported.append)
    assert {path: path.stat().st_mtime_ns for path in old} == old
    assert len(files_of(tmp_path / "water.pvd")) == 4
    assert not list(tmp_path.glob(".*.part"))


def test_files_of_another_run_are_not_taken_for_those_of_this_one(run, tmp_path):
    export(run, ["vtk"], tmp_path / "out", 0.0, np.inf, tell=lambda text: None)
    other = write_run(tmp_path / "other", cell=4.0, times=np.linspace(0.0, 2.0, 4))
    summary = json.loads((run / "run.json").read_text())
    summary["case"]["case"]["title"] = "another"
    (other / "run.json").write_text(json.dumps(summary))
    with pytest.raises(CannotExport, match="another run"):
        export(other, ["vtk"], tmp_path / "out", 0.0, np.inf)


def test_states_are_written_again_after_the_run_was_resumed(run, tmp_path):
    """It went back to a checkpoint: states after that may be others, with --any-version or other limits."""
    own = shutil.copytree(run, tmp_path / "run")
    export(own, ["vtk", "gltf"], tmp_path / "out", 0.0, np.inf, tell=lambda text: None)
    old = {path: path.stat().st_mtime_ns for path in (tmp_path / "out").glob("*_0*")}
    summary = json.loads((own / "run.json").read_text())
    (own / "run.json").write_text(json.dumps(summary | {"resumed": [{"at": "now", "time": 1.0}]}))
    export(own, ["vtk", "gltf"], tmp_path / "out", 0.0, np.inf, tell=lambda text: None)
    assert len(old) > 8
    assert all(path.stat().st_mtime_ns > before for path, before in old.items())


def test_all_scenes_have_one_scale_of_colours(run, tmp_path, monkeypatch):
    """Those of a run in progress had that of the speeds until then."""
    from coupler.commands.export import gltf

    with monkeypatch.context() as patched:
        patched.setattr(gltf, "_fastest", lambda water: 100.0)
        export(run, ["gltf"], tmp_path, 0.0, 1.0, tell=lambda text: None)
    export(run, ["gltf"], tmp_path, 0.0, np.inf, tell=lambda text: None)
    export(run, ["gltf"], tmp_path / "once", 0.0, np.inf, tell=lambda text: None)
    scenes = sorted((tmp_path / "once").glob("*.glb"))
    assert len(scenes) == 4
    assert all(scene.read_bytes() == (tmp_path / scene.name).read_bytes() for scene in scenes)


def test_histories_say_their_units(run, exported):
    source = sorted((run / "history").glob("*.csv"))[0]
    table = read_history(source)
    with netcdf_file(exported / f"{source.stem}.nc", mmap=False) as file:
        for column in table.columns:
            np.testing.assert_array_equal(file.variables[column.name][:], table[column.name])
            assert file.variables[column.name].units.decode() == column.unit
        assert file.Conventions.startswith(b"CF-")


@pytest.mark.parametrize("rows", [4, 3])
def test_loads_of_each_block_are_over_time_and_block(tmp_path, rows):
    """Two blocks at two times; a run that was killed may lack the last row."""
    (tmp_path / "history").mkdir()
    columns = [("time", "s", "t"), ("block", "", "name of the block"), ("over", "s", "o"), ("f_x", "N", "f")]
    with HistoryTable(tmp_path / "history" / "loads_wall_blocks.csv", columns) as table:
        for time, block, force in [
            (0.1, "wall-ä", 1.0),
            (0.1, "b", 2.0),
            (0.2, "wall-ä", 3.0),
            (0.2, "b", 4.0),
        ][:rows]:
            table.append(time=time, block=block, over=0.1, f_x=force)
    (made,) = write_netcdf(tmp_path, tmp_path, "a wall")
    with netcdf_file(made, mmap=False) as file:
        assert file.variables["time"][:].tolist() == [0.1, 0.2]
        assert file.variables["f_x"].dimensions == ("time", "block")
        assert file.variables["f_x"][:].tolist() == [[1.0, 2.0], [3.0, 4.0 if rows == 4 else FILL]]
        names = [b"".join(row).rstrip(b"\0").decode() for row in file.variables["block"][:]]
        assert names == ["wall-ä", "b"]


def test_every_block_is_an_object_of_its_name(run, exported):
    scene = trimesh.load_scene(exported / "scene_00003.glb")
    with_blocks = {name: g for name, g in scene.geometry.items() if name != "water"}
    points, _, _, data = stored(run / "blocks.vtkhdf").step(3)
    assert len(with_blocks) == data["block"].max() + 1
    assert {"water"} <= set(scene.geometry)
    low, high = points.min(axis=0), points.max(axis=0)
    turned = [trimesh.transform_points(g.vertices, scene.graph[name][0]) for name, g in with_blocks.items()]
    every = np.concatenate(turned)
    np.testing.assert_allclose(every.min(axis=0), [low[0], low[2], -high[1]], atol=1e-5)  # y is up there


def test_a_window_without_a_state_is_refused_and_histories_are_whole_in_any(run, tmp_path):
    """It wrote a collection of no files, and ParaView shows nothing."""
    for window in ((1.5, 0.5), (3.0, 4.0), (0.1, 0.2)):
        with pytest.raises(CannotExport, match="no state in between; there are 4, from 0 to 2 s"):
            export(run, ["vtk"], tmp_path / "out", *window)
        export(run, ["netcdf"], tmp_path / "tables", *window, tell=lambda text: None)
    assert not (tmp_path / "out").exists()


def test_an_unknown_format_is_refused(run, tmp_path):
    with pytest.raises(CannotExport, match="there are vtk, netcdf, gltf"):
        export(run, ["alembic"], tmp_path, 0.0, 1.0)
    assert (
        CliRunner().invoke(app, ["export", str(run), "--format", "netcdf", "--to", str(tmp_path)]).exit_code
        == 0
    )


PVBATCH = """
import sys
from paraview.simple import *
for name, array in (("water", "pressure"), ("blocks", "block")):
    reader = OpenDataFile(sys.argv[1] + "/" + name + ".pvd")
    times = list(reader.TimestepValues)
    reader.UpdatePipeline(times[-1])
    info = reader.GetDataInformation()
    arrays = list(reader.PointData.keys()) + list(reader.CellData.keys())
    assert array in arrays, arrays
    print(name, len(times), info.GetNumberOfCells(), GetParaViewVersion())
"""


@pytest.mark.nightly
@pytest.mark.skipif(shutil.which("pvbatch") is None, reason="ParaView is not installed")
def test_paraview_opens_it(run, exported, tmp_path):
    script = tmp_path / "open.py"
    script.write_text(PVBATCH)
    done = subprocess.run(["pvbatch", script, exported], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = dict(
        line.split(" ", 1) for line in done.stdout.splitlines() if line.startswith(("water ", "blocks "))
    )
    assert lines["water"].startswith(f"4 {len(read_tetrahedra(run / 'fields.vtkhdf', 3))} ")
    assert lines["blocks"].startswith("4 ")
