"""Tanks from mesh files: the same flow as on the same mesh made here, basins of any shape, refusals with the place."""

import csv
import re
import subprocess
import sys

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.geometry.tank_mesh import basin_edges, bed_along, floor_along, mean_bed, mesh_of, on_side
from coupler.program.errors import BadCase
from coupler.program.provenance import ROOT
from coupler.results.expected import verdicts
from coupler.run.checkpoint import FOLDER, OtherScene, listed
from coupler.run.forecast import forecast
from coupler.scene.build import build
from fluid.mesh.background import box_mesh
from fluid.readings.gauges import level
from tests.coupler.basins import cylinder, write
from tests.coupler.resumed import begin, check_same, directory_of, go_on
from tests.fakes import no_clock
from tests.fluid.scenes import advance

ROUND = ROOT / "cases" / "sloshing_cylinder"

COLUMN = """\
[case]
title = "a column falls"
[time]
end = "0.3 s"
step_max = "20 ms"
output_every = "0.1 s"
checkpoint_every = "0.1 s"
[tank]
TANK
[[water.fill]]
lower = [0, 0, 0]
upper = [0.4, 0.4, 0.6]
[[gauge]]
kind = "level"
name = "wall"
at = [0.9, 0.2]
"""
BLOCK = """\
[structure]
[[structure.block]]
name = "box"
size = [0.1, 0.1, 0.1]
centre = [0.7, 0.2, 0.06]
[contact]
stiffness = "1 MN/m"
"""
LOWER, UPPER, CELL = (0.0, 0.0, 0.0), (1.0, 0.4, 0.8), 0.1


def bricks():
    """Nodes and cells of the box that all these tests use."""
    mesh = box_mesh(LOWER, UPPER, CELL)
    return mesh.nodes, mesh.cells


def case_text(tank='mesh = "box.vtu"', *more):
    return COLUMN.replace("TANK", tank) + "\n".join(more)


def loaded(place, text=None, overrides=()):
    return load(directory_of(place, case_text() if text is None else text), overrides).case


def refusals(place, text=None):
    with pytest.raises(BadCase) as refusal:
        loaded(place, text)
    return "\n".join(refusal.value.lines)


def columns(run, table):
    lines = (run / "history" / table).read_text(encoding="utf-8").splitlines()
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    return {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}


# ---------------------------------------------------------------- the flow


def test_a_file_of_the_same_cells_gives_the_same_flow(tmp_path):
    """Only which of two neighbours a point on their face is found in may differ: round-off of a falling column."""
    write(tmp_path / "box.vtu", *bricks()[:1], tetra=bricks()[1])
    ours = begin(
        tmp_path / "ours", case_text("lower = [0, 0, 0]\nupper = [1, 0.4, 0.8]\ncell = 0.1"), tmp_path / "a"
    )
    file = begin(tmp_path / "file", case_text('mesh = "../box.vtu"'), tmp_path / "b")
    for table in ("water.csv", "gauges.csv", "energy.csv"):
        one, two = columns(ours, table), columns(file, table)
        for name in one:
            scale = max(np.abs(one[name]).max(), 1e-9 if name != "volume_error" else 1e-6)
            np.testing.assert_allclose(two[name], one[name], atol=1e-6 * scale, err_msg=f"{table} {name}")


def sloping():
    """A beach of 1:4 under a flat top, meshed by stretched bricks: no plane of the box below."""
    mesh = box_mesh((0, 0, 0), (1.6, 0.4, 0.8), 0.1)
    nodes = mesh.nodes.copy()
    bed = 0.25 * nodes[:, 0]
    nodes[:, 2] = bed + nodes[:, 2] * (0.8 - bed) / 0.8
    return nodes, mesh.cells


@pytest.mark.parametrize("shape", ["beach", "cylinder"])
def test_water_in_a_basin_of_another_shape_stays_still(tmp_path, shape):
    """Boundary faces at any angle carry the weight of the water: nothing moves, to round-off."""
    nodes, cells = sloping() if shape == "beach" else cylinder(0.5, 0.75, 4, 6)
    write(tmp_path / "box.vtu", nodes, tetra=cells)
    text = case_text().replace("upper = [0.4, 0.4, 0.6]", "upper = [9, 9, 0.43]")
    text = text.replace("lower = [0, 0, 0]", "lower = [-9, -9, -9]").replace(
        "at = [0.9, 0.2]", "at = [0.3, 0.1]"
    )
    water = build(loaded(tmp_path, text), no_clock).coupling.water
    for _ in range(30):
        advance(water)
    assert water.fastest() < 1e-8
    bed = 0.25 * 0.3 if shape == "beach" else 0.0
    assert level(water, (0.3, 0.1)) == pytest.approx(0.43 - bed, abs=0.25 * water.mesh.spacing)


def test_the_period_of_a_round_tank(tmp_path):
    """First mode of a cylinder, ω² = g k tanh(k h), k R = 1.841: within 3 % on eight cells over the radius."""
    run = begin(tmp_path / "case", (ROUND / "case.toml").read_text(encoding="utf-8"), tmp_path / "run",
                f"tank.mesh={ROUND / 'cylinder.vtu'}", "time.end=3")  # fmt: skip
    found = verdicts(run, ROUND / "expected.toml")
    assert all(verdict.kept for verdict in found), [str(verdict) for verdict in found]


def test_the_mesh_of_the_round_tank_is_the_one_that_is_made_here():
    mesh = mesh_of(load(ROUND).case.tank)
    nodes, _ = cylinder(0.5, 0.75, 8, 12)
    np.testing.assert_allclose(mesh.nodes, nodes, atol=1e-12)
    assert (ROUND / "cylinder.vtu").stat().st_size < 300e3


def test_pictures_show_the_rims_of_a_round_tank_and_the_box_of_a_box():
    """Twice 48 edges around floor and top; the edges between the facets of the wall are blunt."""
    edges = basin_edges(mesh_of(load(ROUND).case.tank))
    assert len(edges) == 2 * 48
    np.testing.assert_allclose(np.linalg.norm(edges[:, :, :2], axis=2), 0.5, rtol=1e-12)
    assert basin_edges(box_mesh(LOWER, UPPER, CELL)) is None


# ---------------------------------------------------------------- going on


def test_a_run_on_a_file_goes_on_to_the_last_digit_unless_the_file_changed(tmp_path):
    nodes, cells = bricks()
    path = write(tmp_path / "box.vtu", nodes, tetra=cells)
    whole = begin(tmp_path / "case", case_text('mesh = "../box.vtu"'), tmp_path / "whole")
    run = begin(tmp_path / "case", case_text('mesh = "../box.vtu"'), tmp_path / "run")
    listed(run / FOLDER)[0].unlink()
    go_on(run)
    check_same(whole, run)
    inner = np.all((nodes > 1e-9) & (nodes < np.array(UPPER) - 1e-9), axis=1)
    write(path, np.where(inner[:, None], nodes + 1e-3, nodes), tetra=cells)
    listed(run / FOLDER)[0].unlink()
    with pytest.raises(
        OtherScene, match=r"mesh: was 495 nodes, 1920 cells \(\w+\), is 495 nodes, 1920 cells"
    ):
        go_on(run)
    write(path, *cylinder(0.5, 0.75, 4, 6)[:1], tetra=cylinder(0.5, 0.75, 4, 6)[1])
    with pytest.raises((OtherScene, BadCase)):
        go_on(run)


# ---------------------------------------------------------------- what a file may hold


@pytest.mark.parametrize("name", ["m.msh", "m.vtu", "m.vtk", "m.inp", "m.xdmf"])
def test_any_format_units_and_turn_of_cells(tmp_path, name):
    """Triangles and lines of the boundary and points of no cell are left out; cells of either orientation, metres
    made of millimetres, places moved."""
    nodes, cells = bricks()
    more = np.vstack([nodes[:5], nodes])  # the first five belong to no cell
    turned = cells.copy() + 5
    turned[::2] = turned[::2, [1, 0, 2, 3]]
    write(tmp_path / name, 1e3 * more - 500.0, triangle=turned[:7, :3], tetra=turned, line=turned[:3, :2])
    tank = f'mesh = "{name}"\nscale = "1 mm"\noffset = [0.5, 0.5, 0.5]'
    case = loaded(tmp_path, case_text(tank))
    mesh = mesh_of(case.tank)
    np.testing.assert_allclose(mesh.nodes, nodes, atol=1e-6)
    assert len(mesh.cells) == len(cells)
    np.testing.assert_allclose([case.tank.lower, case.tank.upper], [LOWER, UPPER], atol=1e-6)
    assert case.tank.cell == pytest.approx(CELL)


def test_single_precision_counts_as_the_wall(tmp_path):
    """A box of water that ends at 0.4 reaches the wall at 0.4 + 6e-9: no surface stands before it."""
    nodes, cells = bricks()
    write(tmp_path / "box.vtu", nodes.astype(np.float32), tetra=cells)
    case = loaded(tmp_path)
    assert case.tank.upper != UPPER
    water = build(case, no_clock).coupling.water
    assert water.volume() == pytest.approx(0.4 * 0.4 * 0.6, rel=0.03)
    assert (water.level_set[(np.abs(water.mesh.nodes - [0.1, 0.4, 0.1]) < 1e-3).all(axis=1)] < -0.05).all()


def prism(height=0.5):
    return np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, height], [1, 0, height], [0, 1, height]], float)


def hanging():
    """Two bricks, the right one of half the cells: nodes of one within faces of the other."""
    left, right = box_mesh((0, 0, 0), (0.5, 0.5, 0.5), 0.5), box_mesh((0.5, 0, 0), (1, 0.5, 0.5), 0.25)
    nodes = np.vstack([left.nodes, right.nodes])
    nodes, row = np.unique(np.round(nodes, 12), axis=0, return_inverse=True)
    cells = np.vstack([left.cells, right.cells + len(left.nodes)])
    return nodes, row.ravel()[cells]


def doubled():
    nodes, cells = bricks()
    return nodes, np.vstack([cells, cells[:1]])


def apart():
    one, two = box_mesh((0, 0, 0), (1, 1, 1), 0.5), box_mesh((2, 0, 0), (3, 1, 1), 0.25)
    return np.vstack([one.nodes, two.nodes]), np.vstack([one.cells, two.cells + len(one.nodes)])


def twins():
    one, two = box_mesh((0, 0, 0), (1, 1, 1), 0.5), box_mesh((1, 0, 0), (2, 1, 1), 0.5)
    return np.vstack([one.nodes, two.nodes]), np.vstack([one.cells, two.cells + len(one.nodes)])


def flat():
    nodes, cells = bricks()
    nodes = nodes.copy()
    x = nodes[cells[0]]
    nodes[cells[0, 3]] = x[:3].mean(axis=0)
    return nodes, cells


@pytest.mark.parametrize(
    ("made", "reported"),
    [
        (hanging, r"cells meet at \(0.5, .*without sharing a face, and at \d+ more places: hanging nodes"),
        (doubled, r"cells \d+ and \d+ at \(.*overlap, or share a face with a third one; remove doubled"),
        (apart, r"2 parts that share no face; the smallest has 48 cells, one of them at \(0\.\d+, "),
        (twins, r"two nodes at \(1, .*and 8 more such pairs: .*merge double nodes"),
        (flat, r"cell \d+ at \(.*is flat, and \d+ more; mesh again"),
    ],
)
def test_cells_that_do_not_hang_together_are_refused(tmp_path, made, reported):
    nodes, cells = made()
    write(tmp_path / "box.vtu", nodes, tetra=cells)
    said = refusals(tmp_path)
    assert re.search(r"case.toml:9: tank.mesh: box.vtu: " + reported, said), said


@pytest.mark.parametrize(
    ("points", "cells", "reported"),
    [
        (prism(), {"wedge": [range(6)]}, "1 cell of kind 'wedge'; the water takes linear tetrahedra only: mesh with"),
        (prism(), {"triangle": [range(3)]}, "no tetrahedra among its cells (1 of kind 'triangle'); mesh the volume"),
        (np.random.default_rng(0).random((10, 3)), {"tetra10": [range(10)]}, "'tetra10'; the water takes linear"),
    ],
)  # fmt: skip
def test_other_cells_are_refused_by_name(tmp_path, points, cells, reported):
    write(tmp_path / "box.vtu", points, **{kind: [list(row) for row in rows] for kind, rows in cells.items()})
    assert reported in refusals(tmp_path)


def test_a_file_that_is_not_there_or_no_mesh(tmp_path):
    (tmp_path / "boxes.vtu").write_text("nothing", encoding="utf-8")
    assert "box.vtu: no such file; did you mean 'boxes.vtu'" in refusals(tmp_path)
    assert "boxes.vtu: meshio cannot read it" in refusals(tmp_path, case_text('mesh = "boxes.vtu"'))


# ---------------------------------------------------------------- what a case may say


@pytest.mark.parametrize(
    ("tank", "reported"),
    [
        ("lower = [0, 0, 0]\nupper = [1, 1, 1]", ["tank.cell: missing; wanted edge"]),
        ('mesh = "box.vtu"\ncell = 0.1', ["tank.cell: follows from tank.mesh, which is given as well"]),
        (
            'mesh = "box.vtu"\nsplit = "kuhn"\nlower = [0, 0, 0]',
            ["tank.lower: follows", "tank.split: follows"],
        ),
        ("lower = [0, 0, 0]\nupper = [1, 0.4, 0.8]\ncell = 0.1\nscale = 1", ["tank.scale: is for tank.mesh"]),
        ('mesh = ""', ["tank.mesh: "]),
    ],
)
def test_a_box_or_a_file(tmp_path, tank, reported):
    write(tmp_path / "box.vtu", *bricks()[:1], tetra=bricks()[1])
    said = refusals(tmp_path, case_text(tank))
    assert len(said.splitlines()) == len(reported)
    for line in reported:
        assert line in said


def test_sides_are_the_flat_ends_along_the_axes(tmp_path):
    """On a bumpy top the faces that look up are no open side: only those in the plane of its highest point, or none."""
    nodes, cells = bricks()
    bumpy = nodes.copy()
    half = (nodes[:, 2] > 0.8 - 1e-9) & (nodes[:, 0] > 0.55)
    bumpy[half, 2] -= 0.02 * (1.0 + np.sin(9.0 * nodes[half, 0]))
    write(tmp_path / "box.vtu", bumpy, tetra=cells)
    mesh = mesh_of(loaded(tmp_path).tank)
    centre = mesh.nodes[mesh.boundary_faces].mean(axis=1)
    top = on_side(mesh, "z+", mesh.boundary_normal, centre)
    assert top.sum() == 2 * 5 * 4
    assert centre[top, 0].max() < 0.5
    dome = nodes.copy()
    dome[:, 2] *= 1.0 - 0.5 * (nodes[:, 0] - 0.43) ** 2
    write(tmp_path / "box.vtu", dome, tetra=cells)
    said = refusals(tmp_path)
    assert "tank.open: z+: no face of tank.mesh lies in the plane z = 0." in said
    loaded(tmp_path, case_text('mesh = "box.vtu"\nopen = []'))


def test_the_bed_along_a_side_of_a_file_is_its_lower_edge(tmp_path):
    """A beach of 1:4: level at x- and, 1.6 m on, 0.4 m higher; along y- it rises."""
    nodes, cells = sloping()
    write(tmp_path / "box.vtu", nodes, tetra=cells)
    text = case_text().replace("upper = [0.4, 0.4, 0.6]", "upper = [1.6, 0.4, 0.6]")
    tank = loaded(tmp_path, text.replace("[0.9, 0.2]", "[0.3, 0.2]")).tank
    for side, bed in (("x-", 0.0), ("x+", 0.4)):
        along = bed_along(tank, side)
        np.testing.assert_allclose(along, np.column_stack([np.linspace(0.0, 0.4, 5), np.full(5, bed)]))
    along = bed_along(tank, "y-")
    np.testing.assert_allclose(along[:, 1], 0.25 * along[:, 0], atol=1e-12)
    assert np.ptp(along[:, 0]) == pytest.approx(1.6)
    assert floor_along(tank, "x+") == pytest.approx(0.4)
    assert mean_bed(tank, "y-", 0.2) == pytest.approx(0.1)


def test_a_wave_that_fills_a_basin_is_refused(tmp_path):
    """A solitary wave of 0.3 m on 0.4 m carries 2 sqrt(4 d^3 H / 3) = 0.32 m2, by the time of its crest half of that;
    over a beach of 1.6 m with a lid at 0.8 m there is room for 0.64 m2."""
    nodes, cells = sloping()
    write(tmp_path / "box.vtu", nodes, tetra=cells)

    def filled(length, end):
        write(tmp_path / "box.vtu", nodes * [length, 1.0, 1.0], tetra=cells)
        text = case_text().replace("upper = [0.4, 0.4, 0.6]", f"upper = [{1.6 * length}, 0.4, 0.4]")
        text = text.replace("[0.9, 0.2]", f"[{0.3 * length}, 0.2]").replace('"0.3 s"', f'"{end} s"')
        wave = (
            '[[water.inflow]]\nkind = "solitary"\nside = "x-"\nlevel = 0.4\nheight = 0.3\ncrest = "1.5 s"\n'
        )
        try:
            loaded(tmp_path, text + wave)
        except BadCase as refusal:
            return "\n".join(refusal.lines)
        return ""

    assert filled(1.0, 3.0) == ""
    assert filled(0.3, 1.5) == ""
    said = filled(0.3, 3.0)
    brought = float(re.search(r"brings ([0-9.e-]+) m3", said)[1])
    assert brought == pytest.approx(0.4 * 2.0 * np.sqrt(4.0 * 0.4**3 * 0.3 / 3.0), rel=0.3)
    assert float(re.search(r"room for ([0-9.e-]+) m3", said)[1]) == pytest.approx(0.0768, rel=0.1)
    assert "no way out but its open top" in said


def test_blocks_need_a_basin_without_angles_and_overhangs(tmp_path):
    """A beach is one; a box with a corner cut out is not (more in test_basin.py)."""
    nodes, cells = sloping()
    path = write(tmp_path / "box.vtu", nodes, tetra=cells)
    loaded(tmp_path, case_text('mesh = "box.vtu"', BLOCK.replace("0.06", "0.26")))
    nodes, cells = bricks()
    middle = nodes[cells].mean(axis=1)
    used, kept = np.unique(cells[(middle[:, 0] < 0.5) | (middle[:, 2] > 0.4)], return_inverse=True)
    write(path, nodes[used], tetra=kept.reshape(-1, 4))
    loaded(tmp_path)
    said = refusals(tmp_path, case_text('mesh = "box.vtu"', BLOCK))
    assert "tank.mesh: blocks would be stopped at (0.5, " in said
    assert "the basin goes on behind the plane of that wall" in said


def test_water_and_gauges_must_be_in_the_mesh(tmp_path):
    write(tmp_path / "box.vtu", *cylinder(0.5, 0.8, 5, 8)[:1], tetra=cylinder(0.5, 0.8, 5, 8)[1])
    text = case_text().replace("upper = [0.4, 0.4, 0.6]", "upper = [0.49, 0.49, 0.6]")
    text = text.replace("lower = [0, 0, 0]", "lower = [0.45, 0.45, 0]").replace("[0.9, 0.2]", "[0.45, 0.45]")
    said = refusals(tmp_path, text)
    assert "water.fill[0]: no node of tank.mesh lies in this box" in said
    assert "gauge[0].at: 'wall' is outside tank.mesh: no cell is there" in said


def test_check_tells_the_true_mesh_and_its_thin_cells(tmp_path):
    nodes, cells = cylinder(0.5, 0.8, 5, 8)
    write(tmp_path / "box.vtu", nodes, tetra=cells)
    text = (
        case_text()
        .replace("at = [0.9, 0.2]", "at = [0.2, 0.2]")
        .replace("lower = [0, 0, 0]", "lower = [-1, -1, 0]")
    )
    case = loaded(tmp_path, text)
    rows = {row.name: row for row in forecast(case).rows}
    assert rows["mesh"].value == len(cells)
    assert rows["mesh"].remark.startswith(f"{len(nodes)} nodes")
    assert remarks(case) == []
    write(tmp_path / "box.vtu", nodes * [1.0, 1.0, 0.02], tetra=cells)
    case = loaded(tmp_path, text)
    assert any("degrees apart" in remark for remark in remarks(case))


def test_meshio_is_loaded_for_a_file_only():
    code = "import sys; from coupler.checks.read_case import load; load(sys.argv[1]); print('meshio' in sys.modules)"
    for case, loads in (("sloshing", "False"), ("sloshing_cylinder", "True")):
        run = subprocess.run(
            [sys.executable, "-c", code, str(ROOT / "cases" / case)],
            capture_output=True,
            text=True,
            check=True,
        )
        assert run.stdout.strip() == loads
