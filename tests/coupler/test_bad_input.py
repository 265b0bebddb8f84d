"""Input that nobody means: each is refused with its file and key, in a moment, and never with a traceback."""

import math
import os
import time
from importlib.util import find_spec

import meshio
import numpy as np
import pytest

from coupler.case.formula import BadFormula, evaluate
from coupler.case.paths import BadPath, read_text
from coupler.case.records import NoSuchData, read_record
from coupler.checks.read_case import load
from coupler.checks.tables import column_names
from coupler.geometry.mesh_files import MeshFileError, read_mesh, readable
from coupler.geometry.solids import solids_of
from coupler.program.errors import BadCase, briefly
from coupler.run.forecast import forecast
from fluid.mesh.background import MeshError, box_mesh
from tests.coupler.test_case_file import BLOCKS, WATER, mistakes, write

DRY = '[case]\ntitle = "x"\n[time]\nend = 1\n[contact]\nstiffness = 1e6\n'
BLOCK = '[[structure.block]]\nname = "b"\ncentre = [0, 0, 0.5]\nsize = [1, 1, 1]\n'
LONG = "9" * 400


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        (
            f"[structure]\ndensity = {LONG}\n" + BLOCK,
            "case.toml:8: structure.density: a whole number of about 40",
        ),
        (
            "[structure]\ndensity = 1e-200\n" + BLOCK,
            "1e-200 is outside the range of the computation: write 0, or a num",
        ),
        (f"[structure]\ndensity = {'9' * 5000}\n", "case.toml: not valid TOML: Exceeds the limit"),
        (f"[structure]\ndensity = 0x{'f' * 9000}\n", "case.toml: a whole number of thousands of digits"),
        (f'[structure]\ndensity = "1 {"kg*" * 5000}kg"\n', "case.toml:8: structure.density: '1 kg*kg*"),
        ('[structure]\ndensity = "1 km^999/km^998"\n', "case.toml:8: structure.density: '1 km^999/km^998'"),
        (
            f"[structure]\ndensity = {'[' * 900}{']' * 900}\n",
            "case.toml: more than 20 lists or sections inside",
        ),
        (
            f"[structure]\ndensity = {'[' * 30}{']' * 30}\n",
            "case.toml: more than 20 lists or sections inside",
        ),
        ("[structure]\n" + "a." * 3000 + "b = 1\n", "case.toml: more than 20 lists or sections inside"),
        (
            '[[structure.file]]\npath = "~nosuchuser/x.stl"\n',
            "case.toml:8: structure.file[0].path: '~nosuchuser/x.",
        ),
        (
            '[[structure.file]]\npath = "a\\u0000.stl"\n',
            "case.toml:8: structure.file[0].path: 'a\\x00.stl' is no path",
        ),
        (f'[[structure.file]]\npath = "{"x" * 300}.stl"\n', "stl' is no path here: File name too long"),
        ('[[structure.file]]\npath = "circle/x.stl"\n', "'circle/x.stl' leads nowhere: Symlink loop"),
        (
            '[[structure.file]]\npath = "."\n',
            "structure.file[0].path: FOLDER: is a directory, not a regular file",
        ),
    ],
)
def test_values_and_paths_that_no_reader_can_hold(tmp_path, text, reported):
    (tmp_path / "circle").symlink_to("circle")
    lines = [line.replace(str(tmp_path), "FOLDER") for line in mistakes(tmp_path, DRY + text)]
    assert any(reported in line for line in lines), lines
    assert all(len(line) < 1000 for line in lines)


@pytest.mark.parametrize(
    ("override", "reported"),
    [
        (f"time.end={LONG}", "time.end: a whole number of about 40"),
        (f"time.end={'[' * 900}{']' * 900}", "more than 20 lists or sections"),
        ("a." * 3000 + "b=1", "more than 20 lists or sections"),
        ("case.title=\udcff", "no text in UTF-8"),
        (f"water.{'x' * 100_000}=1", "unknown name"),
    ],
    ids=range(5),
)
def test_overrides_that_no_reader_can_hold(tmp_path, override, reported):
    lines = mistakes(tmp_path, WATER, override)
    assert any(reported in line for line in lines), lines


def test_a_place_that_is_no_utf_8_is_refused(tmp_path):
    """Results hold it as text; so it must be one."""
    folder = tmp_path / os.fsdecode(b"\xff")
    folder.mkdir()
    write(folder, WATER)
    with pytest.raises(BadCase, match="no path in UTF-8"):
        load(folder)
    with pytest.raises(BadCase, match="no such case: File name too long"):
        load("x" * 300)


def test_long_values_are_cut_in_messages():
    assert briefly(10**59) == "1" + "0" * 59
    assert len(briefly(["x" * 1000] * 1000)) < 1000
    assert briefly({"a": 10**400}) == "{'a': a whole number of about 401 digits}"


# ---------------------------------------------------------------- how many, how small


@pytest.mark.parametrize(
    ("text", "reported"),
    [
        (
            "wall]]\nlower = [0, 0, 0]\nsize = [1, 1, 1]\nblock = [1e-10, 1, 1e-10]\n",
            "'wall' would have 1e+20 blocks",
        ),
        (
            "wall]]\nlower = [0, 0, 0]\nsize = [1, 1, 1]\nblock = [1e-3, 1e-3, 1e-3]\n",
            "would have 1e+09 blocks",
        ),
        (
            "building]]\nlower = [0, 0, 0]\nsize = [9, 9, 3]\nwall_thickness = 0.3\nblock = [1e-3, 1e-3]\n",
            "'building' would have 1.75e+08 blocks, at most 20000",
        ),
        (
            "rubble]]\nlower = [0, 0, 0]\nsize = [9, 9, 9]\ncount = 100_000\ndiameter = [0.1, 0.1]\n",
            "structure.rubble[0].count: 100000 is out of range; must be at most 20000",
        ),
    ],
)
def test_more_blocks_than_a_scene_can_have_are_refused_before_they_are_made(tmp_path, text, reported):
    start = time.process_time()
    lines = mistakes(tmp_path, f"{DRY}[[structure.{text}")
    assert any(reported in line for line in lines), lines
    assert time.process_time() - start < 5.0


@pytest.mark.parametrize("cell", ["1e-3", "1e-19", "4e-19", "1e-30"])
def test_cells_of_any_smallness_are_too_many(tmp_path, cell):
    """Their number passes 64 bits below 4e-19 of a side; then it must not become one."""
    (line,) = mistakes(tmp_path, WATER, f"tank.cell={cell}")
    assert f"cells of {float(cell):g} m need about" in line
    with pytest.raises(MeshError, match="bricks"):
        box_mesh((0, 0, 0), (4, 2, 2), float(cell))


# ---------------------------------------------------------------- files


@pytest.mark.parametrize("device", ["/dev/zero", "pipe", "/dev", "nothing"])
def test_what_is_not_a_regular_file_is_not_opened(tmp_path, device):
    """A pipe would wait for a writer, a device has no end."""
    os.mkfifo(tmp_path / "pipe")
    path = tmp_path / device
    with pytest.raises(BadPath, match=r"not a regular file|no such file"):
        read_text(path)
    with pytest.raises(MeshFileError, match=r"not a regular file|no such file"):
        read_mesh(path)
    with pytest.raises(NoSuchData):
        read_record(path)
    inflow = f'[[water.inflow]]\nkind = "record"\nside = "x-"\npath = "{path}"\n'
    assert any("water.inflow[0].path" in line for line in mistakes(tmp_path, WATER + inflow))


def test_a_text_is_read_up_to_a_limit(tmp_path):
    (tmp_path / "a").write_text("x" * 100, encoding="utf-8")
    assert read_text(tmp_path / "a", most=100) == "x" * 100
    with pytest.raises(BadPath, match="at most 0 MB are read"):
        read_text(tmp_path / "a", most=99)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.ply", b"ply\n"),  # its reader looks for the end of the header for ever
        ("a.node", b"1\n"),
        ("a.bdf", b"x"),
        ("a.vol", b"x"),
        ("a.post", b"x"),
        (
            "a.vtk",
            b"# vtk DataFile Version 5.1\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 99999999999999 double\n",
        ),
        ("a.exo", b"x"),
    ],
)
def test_torn_meshes_are_refused_whatever_their_reader_does(tmp_path, monkeypatch, name, content):
    monkeypatch.setattr("coupler.geometry.mesh_files.PATIENCE", 0.3)
    (tmp_path / name).write_bytes(content)
    start = time.process_time()
    with pytest.raises(MeshFileError, match=f"{name}: meshio cannot read it"):
        read_mesh(tmp_path / name)
    assert time.process_time() - start < 5.0


def test_only_formats_that_can_be_read_here_are_listed():
    """Exodus needs a package that only an extra installs, SVG can only be written."""
    assert {".stl", ".vtu", ".msh", ".med"} <= set(readable())
    assert (".exo" in readable()) == (find_spec("netCDF4") is not None)
    assert ".svg" not in readable()


@pytest.mark.parametrize(
    ("rows", "reported"),
    [
        ("5,1,0\n6,1,0\n", "its times go from 5 to 6 s, all after the run (0 to 2 s); move them by start"),
        ("-5,1,0\n-4,1,0\n", "its times go from -5 to -4 s, all before the run"),
        ("0,1,0\n1e400,1,0\n", "is not finite"),
    ],
)
def test_records_beside_the_run(tmp_path, rows, reported):
    (tmp_path / "r.csv").write_text("time,level,velocity\n" + rows, encoding="utf-8")
    inflow = '[[water.inflow]]\nkind = "record"\nside = "x-"\npath = "r.csv"\n'
    (line,) = mistakes(tmp_path, WATER + inflow)
    assert reported in line


def test_columns_of_one_name(tmp_path):
    (tmp_path / "r.csv").write_text("time,level,velocity,level\n0,1,0,2\n", encoding="utf-8")
    inflow = '[[water.inflow]]\nkind = "record"\nside = "x-"\npath = "r.csv"\n'
    assert "the column 'level' is there twice" in mistakes(tmp_path, WATER + inflow)[0]
    with pytest.raises(NoSuchData, match="the column 'level' is there twice"):
        read_record(tmp_path / "r.csv")


@pytest.mark.parametrize(
    "formula",
    [
        "9**9**9**9",
        "9**9**9",
        "(" * 300 + "1" + ")" * 300,
        "1" + "+1" * 5000,
        "1\0",
        "(-1)**0.5",
        LONG,
    ],
    ids=range(7),
)
def test_formulas_that_cannot_be_computed(formula):
    with pytest.raises(BadFormula):
        evaluate(formula, {})


def test_powers_of_formulas():
    assert evaluate("2**10 - 2**-1", {}) == 1023.5


# ---------------------------------------------------------------- names, joints, motions


def gauge(kind, name, **more):
    return f'[[gauge]]\nkind = "{kind}"\nname = "{name}"\n' + "".join(f"{k} = {v}\n" for k, v in more.items())


@pytest.mark.parametrize(
    ("gauges", "reported"),
    [
        (
            gauge("loads", "a", on='"a"', each_block="true") + gauge("loads", "a_blocks", on='"a"'),
            "gauge[1].name: 'a_blocks' of kind loads would fill history/loads_a_blocks.csv, which gauge[0] fills",
        ),
        (
            gauge("motion", "g", of='"a"') + gauge("velocity", "g", at="[0.1, 0.1, 0.1]"),
            "gauge[1].name: 'g' of kind velocity would fill the column g_velocity_x of history/gauges.csv",
        ),
        (
            gauge("pressure", "g", at="[0.1, 0.1, 0.1]")
            + gauge("patch", "g", at="[0.1, 0.1, 0.1]", radius=0.01, normal="[1, 0, 0]"),
            "'g' of kind patch would fill the column g_pressure of",
        ),
        (
            gauge("force", "g", on='"a"', parts="true") + gauge("force", "g_pressure", on='"a"'),
            "'g_pressure' of kind force would fill the column g_pressure_force_x of",
        ),
        (gauge("level", "g", at="[1, 1]") + gauge("level", "g", at="[1, 1]"), "'g' is taken by gauge[0]"),
    ],
)
def test_gauges_that_would_fill_the_same_place(tmp_path, gauges, reported):
    (line,) = mistakes(tmp_path, WATER + BLOCKS + gauges)
    assert reported in line


def test_a_name_that_several_kinds_have_is_explained_as_that_of_the_kind_in_the_file(tmp_path):
    """A level gauge stands at x, y, while a patch has its centre in space."""
    gauges = gauge("level", "a") + gauge("flux", "b", edges="[[0, 1, 0], [0, 0, 1]]") + gauge("velocity", "c")
    at_level, at_flux, at_point = mistakes(tmp_path, WATER + gauges)
    assert "gauge[0].at: missing; place (x, y) [m]" in at_level
    assert "gauge[1].at: missing; centre of the patch [m]" in at_flux
    assert "gauge[2].at: missing; point (x, y, z) [m]" in at_point


def test_a_missing_table_that_may_be_repeated_is_named_in_double_brackets(tmp_path):
    """[study.quantity], as it was named, is refused again."""
    quantity, ladder = mistakes(tmp_path, WATER + "[study]\n")
    assert "study.quantity: missing; write a section [[study.quantity]]: what is measured" in quantity
    assert "study.ladder: missing; write a section [[study.ladder]]: what is varied" in ladder


def test_gauges_of_different_columns_may_share_a_name(tmp_path):
    gauges = gauge("level", "g", at="[1, 1]") + gauge("motion", "g", of='"a"') + gauge("loads", "g", on='"a"')
    case = load(write(tmp_path, WATER + BLOCKS + gauges)).case
    assert column_names(case.gauge[0]) == ["g_level"]


GLUE = '[joints]\nstrength = "1 MPa"\nopening_at_failure = "1 mm"\n'
TWO = BLOCK + BLOCK.replace('"b"', '"c"').replace("0.5]", "1.5]")


def test_joints_without_faces_give_no_stiffness(tmp_path):
    text = DRY.replace("stiffness = 1e6", "friction = 0.5") + BLOCK + GLUE
    (line,) = mistakes(tmp_path, text)
    assert (
        "case.toml:11: joints: no two faces touch, so there is no joint and no stiffness for [contact]"
        in line
    )
    assert load(write(tmp_path, text + "[structure.ground]\n"))


def test_joints_without_faces_are_settled_without_any(tmp_path):
    """Rubble that its joints do not reach: the forecast has a row of no joint, and none of the damage at rest."""
    case = load(write(tmp_path, DRY + BLOCK + GLUE)).case
    assert case.structure.start == "settled"
    rows = {row.name: row.value for row in forecast(case, False, tmp_path).rows}
    assert rows["joints"] == 0
    assert "damage at rest" not in rows


def test_contact_is_asked_for_only_where_blocks_lie_loose(tmp_path):
    bonded = DRY.partition("[contact]")[0] + TWO + GLUE
    assert load(write(tmp_path, bonded)).case.contact is None
    third = BLOCK.replace('"b"', '"d"').replace("[0, 0, 0.5]", "[5, 0, 0.5]")
    (line,) = mistakes(tmp_path, bonded + third)
    assert "structure: 'd' has no joint, and 0 more: blocks without joints need a section [contact]" in line
    assert load(write(tmp_path, bonded + third + "fixed = true\n"))
    (line,) = mistakes(tmp_path, bonded.replace(GLUE, ""))
    assert "blocks need [joints], which hold them together, or [contact]" in line


def driven(velocity, *more):
    return WATER + BLOCKS + f'[[motion]]\nblock = "a"\nvelocity = {velocity}\n' + "".join(more)


@pytest.mark.parametrize(
    ("velocity", "reported"),
    [
        (
            "[-1, 0, 0]",
            "'a' reaches the closed side x- of the tank (x = 0 m) at t = 1.5 s and would pass through it",
        ),
        ("[0, 0, -0.1]", "'a' reaches the closed side z- of the tank (z = 0 m) at t = 0 s"),
    ],
)
def test_a_driven_block_that_would_pass_through_a_wall(tmp_path, velocity, reported):
    (line,) = mistakes(tmp_path, driven(velocity))
    assert f"case.toml:23: motion[0].velocity: {reported}" in line


@pytest.mark.parametrize("velocity", ["[0.74, 0, 0]", "[0, 0, 5]", "[0, 0.25, 0]"])
def test_a_driven_block_may_reach_a_wall_and_leave_by_an_open_side(tmp_path, velocity):
    assert load(write(tmp_path, driven(velocity)))


def test_a_driven_block_stops_at_the_ground(tmp_path):
    (line,) = mistakes(tmp_path, driven("[0, 0, -0.1]", "[structure.ground]\n"))
    assert "'a' reaches the ground (z = 0 m)" in line
    assert math.isfinite(load(write(tmp_path, driven("[0, 0, 0]", "[structure.ground]\n"))).case.time.end)


def test_a_solid_is_the_hull_of_its_points(tmp_path):
    """Points inside and on its faces change nothing, as the page of the case says."""
    corners = [[2, 0, 0], [3, 0, 0], [2, 1, 0], [2, 0, 1]]
    more = [*corners, [2.2, 0.2, 0.2], [2.5, 0, 0], [2.2, 0.2, 0]]
    bodies = [
        solids_of(load(write(tmp_path, WATER + f"[[solid]]\nvertices = {points}\n")).case)[0]
        for points in (corners, more)
    ]
    assert bodies[0].vertices.tolist() == bodies[1].vertices.tolist()
    flat = [[2, 0, 0], [3, 0, 0], [2, 1, 0], [3, 1, 0]]
    assert "span no volume" in mistakes(tmp_path, WATER + f"[[solid]]\nvertices = {flat}\n")[0]


def test_a_block_that_was_driven_out_already_is_reported_once(tmp_path):
    """Its velocity along an axis may be zero."""
    lines = mistakes(tmp_path, driven("[0, 0, 0]").replace("centre = [2, 1, 0.5]", "centre = [20, 1, 0.5]"))
    assert ["reaches 16.5 m beyond the side x+" in line for line in lines] == [True]


def test_of_many_blocks_those_that_reach_out_of_the_tank_are_named(tmp_path):
    """A file of a thousand wedges says which one is wrong only by its number."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    cells = [[0, 1, 2, 3], [4, 5, 6, 7]]
    meshio.Mesh(np.concatenate([points, np.add(points, [3.5, 0, 0])]), [("tetra", cells)]).write(
        tmp_path / "two.vtu"
    )
    text = (
        WATER
        + DRY.partition("[contact]")[1]
        + "\nstiffness = 1e6\n"
        + '[[structure.file]]\npath = "two.vtu"\n'
    )
    (line,) = mistakes(tmp_path, text)
    assert "'file' reaches 0.5 m beyond the side x+ of the tank" in line
    assert line.endswith("(1 of its 2 blocks: file-1)")


def test_an_open_surface_names_the_key_of_its_own_table(tmp_path):
    """A solid has a weld too, not only a file of blocks."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    meshio.Mesh(points, [("triangle", [[0, 2, 1], [0, 1, 3], [1, 2, 3]])]).write(tmp_path / "open.stl")
    (line,) = mistakes(tmp_path, WATER + '[[solid]]\npath = "open.stl"\n')
    assert "case.toml:14: solid[0]: open.stl: open surface" in line
    assert "weld of this table sets that" in line
    assert "structure.file" not in line


def test_a_file_that_ends_within_a_face_has_the_faces_before(tmp_path):
    """Its reader returns the torn one as a list of its own, without entries."""
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf ", encoding="utf-8")
    _, cells, _ = read_mesh(tmp_path / "a.obj")
    assert {kind: rows.tolist() for kind, rows in cells.items()} == {"triangle": [[0, 1, 2]]}


def test_a_path_from_the_wrong_directory_is_told_where_paths_are_from(tmp_path):
    """`mine/house.stl` in mine/case.toml means mine/mine/house.stl."""
    from coupler.case.paths import BadPath, check_file

    (tmp_path / "house.stl").write_text("solid")
    with pytest.raises(BadPath, match=r"did you mean 'house.stl'. Paths are from the directory of the case"):
        check_file(tmp_path / "mine" / "house.stl")
    with pytest.raises(BadPath, match=r"^no such file$"):
        check_file(tmp_path / "mine" / "other.stl")
