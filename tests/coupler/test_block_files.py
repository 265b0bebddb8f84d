"""Blocks from mesh files: the same bodies whatever the format, joints from shared faces, refusals with the place."""

import meshio
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from coupler.case.structure import BlockFile
from coupler.geometry.block_files import VOLUME_FACES, blocks_from_file
from coupler.geometry.mesh_files import MeshFileError
from yade_scripts.blocks.block import BOX_CORNERS, BOX_FACES
from yade_scripts.blocks.faces import touching_faces

TRIANGLES = np.array([(f[0], f[i], f[i + 1]) for f in BOX_FACES for i in (1, 2)])
BRICKS = [(x, y, z) for x in (0, 2) for y in (0, 1, 2) for z in (0, 1)]
"""Lower corners of twelve bricks of 2 x 1 x 1 that share faces, edges and corners."""


def brick(lower, size=(2.0, 1.0, 1.0)):
    return np.array(lower) + (BOX_CORNERS + 1.0) / 2.0 * np.array(size)


def joined(bodies, cells):
    """One array of points and one of cells for bodies that have the same cells."""
    steps = np.cumsum([0] + [len(b) for b in bodies[:-1]])
    return np.concatenate(bodies), np.concatenate([np.asarray(cells) + s for s in steps])


def write(folder, name, points, **cells):
    """Write with meshio; returns the path."""
    path = folder / name
    binary = {"file_format": "stl", "binary": True} if name.endswith("binary.stl") else {}
    meshio.Mesh(points, [(kind, np.asarray(rows)) for kind, rows in cells.items()]).write(path, **binary)
    return path


def read(path, **options):
    return blocks_from_file(BlockFile(path=str(path), **options))


def refused(path, **options):
    with pytest.raises(MeshFileError) as refusal:
        read(path, **options)
    return str(refusal.value)


@pytest.mark.parametrize(
    "name", ["b.stl", "b-binary.stl", "b.obj", "b.ply", "b.vtk", "b.vtu", "b.msh", "b.off"]
)
def test_touching_bricks_of_a_surface_mesh_are_distinguished_in_every_format(tmp_path, name):
    """Where bricks share an edge, four polygons and more meet; each brick must get its own twelve. All 20 joints of
    the heap are found, with their exact areas."""
    points, cells = joined([brick(b) for b in BRICKS], TRIANGLES)
    blocks = read(write(tmp_path, name, points, triangle=cells))
    assert len(blocks) == 12
    assert sorted(tuple(np.round(b.world_vertices().min(axis=0), 9)) for b in blocks) == sorted(BRICKS)
    np.testing.assert_allclose([b.volume for b in blocks], 2.0, rtol=1e-12)
    faces = touching_faces(blocks)
    assert sorted(round(f.area, 9) for f in faces) == [1.0] * 6 + [2.0] * (8 + 6)
    assert all(len(b.faces) == 6 for b in blocks)


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra", "pyramid"])
@pytest.mark.parametrize("name", ["b.msh", "b.vtk", "b.vtu"])
def test_volume_cells_are_blocks(tmp_path, kind, name):
    """A turned cube as one hexahedron, two wedges, five tetrahedra or six pyramids: the volumes add up, the inertia of
    the whole is that of the cube (parallel axes), and the inner faces become joints."""
    turn = Rotation.from_rotvec([0.3, -0.2, 0.5]).as_matrix()
    corners = 0.5 * BOX_CORNERS @ turn.T
    points = np.vstack([corners, [[0.0, 0.0, 0.0]]])
    rows = {
        "hexahedron": [range(8)],
        "wedge": [(0, 1, 2, 4, 5, 6), (0, 2, 3, 4, 6, 7)],
        "tetra": [(0, 1, 2, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 7, 5, 6), (0, 2, 7, 5)],
        "pyramid": [(*f[::-1], 8) for f in BOX_FACES],
    }[kind]
    used = points if kind == "pyramid" else corners
    blocks = read(write(tmp_path, name, used, **{kind: [list(r) for r in rows]}))
    assert len(blocks) == len(rows)
    assert sum(b.volume for b in blocks) == pytest.approx(1.0, rel=1e-12)
    whole = sum(
        b.inertia + b.mass * (b.centre @ b.centre * np.eye(3) - np.outer(b.centre, b.centre)) for b in blocks
    )
    np.testing.assert_allclose(whole, 2400.0 / 6.0 * np.eye(3), atol=1e-9)
    assert len(touching_faces(blocks)) == {"hexahedron": 0, "wedge": 1, "tetra": 4, "pyramid": 12}[kind]


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10**6))
def test_a_random_mesh_of_tetrahedra_is_joined_all_over(tmp_path_factory, seed):
    """Every inner face of a Delaunay mesh is one joint between two blocks, and the blocks fill the hull."""
    x = np.random.default_rng(seed).uniform(-1, 1, (15, 3))
    cells = Delaunay(x).simplices
    blocks = read(write(tmp_path_factory.mktemp("m"), "t.vtu", x, tetra=cells), weld=1e-9)
    keys = [tuple(sorted(c[list(f)])) for c in cells for f in VOLUME_FACES["tetra"]]
    assert len(touching_faces(blocks)) == len(keys) - len(set(keys))


@pytest.mark.parametrize("small", [(0.02, 0.02, 0.02), (0.02, 0.02, 1.0)])
def test_a_body_that_welding_leaves_nothing_of_is_refused(tmp_path, small):
    """A dowel or a rod thinner than `weld` was left out without a word, beside blocks that were read."""
    points, cells = joined([brick((0, 0, 0)), brick((3, 0, 0), small)], TRIANGLES)
    path = write(tmp_path, "b.obj", points, triangle=cells)
    assert len(read(path)) == 2
    assert "the body at (3.01, 0.01, " in refused(path, weld=0.05)


def test_single_precision_leaves_plane_faces_and_joints(tmp_path):
    """A wall of turned bricks in a binary STL: corners off by 1e-7 of their coordinates, faces quads again."""
    turn = Rotation.from_rotvec([0.1, 0.7, -0.4]).as_matrix()
    points, cells = joined([brick(b) @ turn.T + [20.0, 10.0, 5.0] for b in BRICKS], TRIANGLES)
    blocks = read(write(tmp_path, "b-binary.stl", points, triangle=cells))
    assert [len(b.faces) for b in blocks] == [6] * 12
    np.testing.assert_allclose([b.volume for b in blocks], 2.0, rtol=1e-5)
    assert len(touching_faces(blocks)) == 20


def test_map_coordinates_keep_their_digits_in_double_precision(tmp_path):
    shift = np.array([5.1e6, 4.2e5, 0.0])
    points, cells = joined([brick(b) + shift for b in BRICKS], TRIANGLES)
    blocks = read(write(tmp_path, "b.vtu", points, triangle=cells))
    np.testing.assert_allclose([b.volume for b in blocks], 2.0, rtol=1e-8)
    assert len(touching_faces(blocks)) == 20
    back = read(tmp_path / "b.vtu", offset=tuple(-shift))
    np.testing.assert_allclose(back[0].world_vertices().min(axis=0), BRICKS[0], atol=1e-9)


def test_map_coordinates_in_single_precision_are_refused_with_the_remedy(tmp_path):
    points, cells = joined([brick(b) + np.array([5.1e6, 4.2e5, 0.0]) for b in BRICKS], TRIANGLES)
    reported = refused(write(tmp_path, "b-binary.stl", points, triangle=cells))
    assert "resolve 0.61 m only" in reported
    assert "give the shift as offset" in reported


def test_scale_and_offset(tmp_path):
    """A drawing in millimetres, moved: lengths by 1e-3, masses by 1e-9."""
    path = write(tmp_path, "b.obj", 1000.0 * brick((0, 0, 0)), triangle=TRIANGLES)
    (block,) = read(path, scale="1 mm", offset=(1, 2, 3))
    np.testing.assert_allclose(block.centre, (2.0, 2.5, 3.5), rtol=1e-12)
    assert block.mass == pytest.approx(2400.0 * 2.0, rel=1e-12)


def test_a_surface_that_looks_inwards_is_turned_round(tmp_path):
    points, cells = joined([brick(b) for b in BRICKS], TRIANGLES[:, ::-1])
    blocks = read(write(tmp_path, "b.ply", points, triangle=cells))
    np.testing.assert_allclose([b.volume for b in blocks], 2.0, rtol=1e-12)


def test_a_tessellated_face_is_one_face(tmp_path):
    """A hull with many triangles in each plane face comes back with the corners and faces of the body."""
    n = 5
    grid = np.stack(np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    tets = Delaunay(grid + 0 * grid, qhull_options="QJ Pp").simplices
    keys = np.sort(np.concatenate([tets[:, list(f)] for f in VOLUME_FACES["tetra"]]), axis=1)
    unique, counts = np.unique(keys, axis=0, return_counts=True)
    outer = unique[counts == 1]
    flat = [t for t in outer if (np.ptp(grid[t], axis=0) == 0).any()]
    (block,) = read(write(tmp_path, "b.ply", grid, triangle=flat))
    assert (len(block.vertices), len(block.faces)) == (8, 6)
    assert block.volume == pytest.approx(8.0, rel=1e-12)


def dented():
    x = brick((10, 20, 30))
    x[6] = x.mean(axis=0) + 0.1
    return x


WARPED = brick((0, 0, 0)) + np.eye(8)[:, [6]] * [0, 0, 0.05]


@pytest.mark.parametrize(
    ("points", "cells", "says"),
    [
        (brick((0, 0, 0)), {"triangle": TRIANGLES[1:]}, "open surface: the edge from (0, 0, 0) m to (0, 1, 1) m"),
        (dented(), {"triangle": TRIANGLES}, "surface 0 is not convex: at (1"),
        (WARPED, {"hexahedron": [range(8)]}, "cell 0 (hexahedron) at (1, 0.5, 0.5"),
        (brick((0, 0, 0)), {"hexahedron": [(0, 1, 2, 3, 4, 6, 5, 7)]}, "cell 0 (hexahedron)"),
        (brick((0, 0, 0), (2, 1, 0)), {"hexahedron": [range(8)]}, "cell 0 (hexahedron)"),
        (brick((0, 0, 0)), {"tetra": [(0, 1, 2, 3)]}, "cell 0 (tetra) at (1, 0.5, 0) m"),
        (brick((0, 0, 0)), {"line": [(0, 1)]}, "holds no cells"),
        (np.random.default_rng(1).random((10, 3)), {"tetra10": [range(10)]}, "cells of kind 'tetra10'"),
        (brick((0, 0, 0)), {"quad": [*BOX_FACES, *BOX_FACES]}, "folded"),
        (brick((0, 0, 0), (2, 1, 0)), {"quad": BOX_FACES}, "no volume"),
    ],
)  # fmt: skip
def test_what_is_no_convex_block_is_refused_with_its_place(tmp_path, points, cells, says):
    cells = {kind: [list(row) for row in rows] for kind, rows in cells.items()}
    reported = refused(write(tmp_path, "b.vtu", points, **cells))
    assert reported.startswith("b.vtu: ")
    assert says in reported


def test_a_file_that_is_not_there_or_not_what_it_says(tmp_path):
    """meshio's own readers print, raise anything, or leave the program; a case ends with a message."""
    (tmp_path / "house.stl").write_text("not a mesh", encoding="utf-8")
    assert "no such file; did you mean 'house.stl'?" in refused(tmp_path / "hause.stl")
    assert "meshio cannot read it" in refused(tmp_path / "house.stl")
    for name in ("house.msh", "house.vtu", "house.vtk", "house.ply", "house.xyz"):
        (tmp_path / name).write_bytes(b"\x00\xff garbage \n" * 9)
        assert "meshio cannot read it" in refused(tmp_path / name)


CASE = """\
[case]
title = "blocks from a file"
[time]
end = "1 s"
[structure]
[[structure.file]]
name = "house"
path = "house.obj"
[structure.ground]
[contact]
stiffness = "1 MN/m"
"""


def test_a_case_finds_its_file_beside_it_and_refuses_it_with_the_line(tmp_path, capsys):
    """Exit code 2, the line of the path, and what is wrong in the file; overlaps inside a file are reported as well."""
    from coupler.commands.cli import main

    (tmp_path / "case.toml").write_text(CASE, encoding="utf-8")
    points, cells = joined([brick((0, 0, 0)), brick((1.5, 0, 0))], TRIANGLES)
    for wrong, says in (
        ((points, cells), "case.toml:6: structure.file[0]: 'house-1' overlaps 'house-0' by 0.5 m near (1.75, "),
        ((points, cells), "mend the file (walls around a room are cut into blocks by [[structure.drawing]])"),
        ((points[:8], cells[1:12]), "case.toml:8: structure.file[0].path: house.obj: open surface"),
        ((points[:8] - [0, 0, 0.1], cells[:12]), "'house' reaches 0.1 m below the ground"),
    ):  # fmt: skip
        write(tmp_path, "house.obj", wrong[0], triangle=wrong[1])
        import sys

        old, sys.argv = sys.argv, ["surgebreak", "check", str(tmp_path)]
        try:
            with pytest.raises(SystemExit) as end:
                main()
        finally:
            sys.argv = old
        assert end.value.code == 2
        assert says in capsys.readouterr().err
