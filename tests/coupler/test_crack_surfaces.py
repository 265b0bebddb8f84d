"""Joints as surfaces: what a viewer reads is where the joints are, as large as they are, and as damaged."""

import meshio
import numpy as np
import pytest

from coupler.results.cracks import crack_columns, write_crack_surfaces
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.polyhedra import polygon_area_vector
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters


def test_the_surfaces_are_the_overlaps_of_the_faces_and_follow_their_block(tmp_path):
    """Two offset cubes and a prism: a rectangle and a triangle; block a moves by 1 m and takes them with it."""
    wedge = np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [0, 0, 2], [1, 0, 2], [0, 1, 2]], float)
    blocks = [
        Block("low", (0.5, 0.5, 0.5), size=1.0, driven=True, velocity=(0, 0, -1.0)),
        Block("beside", (1.5, 0.75, 0.5), size=1.0, fixed=True),
        Block.standing("wedge", wedge, fixed=True),
    ]
    with Structure(blocks, None, JointParameters(1e6, 0.1, damping=0.0), gravity=(0, 0, 0)) as s:
        s.advance(1.0, substep=1e-3)
        write_crack_surfaces(tmp_path / "cracks.vtu", *s.joint_polygons(), crack_columns(s))
        table = s.joint_table()
    mesh = meshio.read(tmp_path / "cracks.vtu")
    found = {}
    for block, area, centre, intact in zip(
        mesh.cells, *(mesh.cell_data[name] for name in ("area", "centre", "intact")), strict=True
    ):
        for polygon, *values in zip(block.data, area, centre, intact, strict=True):
            found[block.type] = (mesh.points[polygon], *values)
    for kind, expected in (("quad", 0.75), ("triangle", 0.5)):
        points, area, centre, intact = found[kind]
        assert np.linalg.norm(polygon_area_vector(points)) == pytest.approx(expected)
        assert area == pytest.approx(expected)
        np.testing.assert_allclose(points.mean(axis=0), centre, atol=1e-9)
        assert intact == 0
    assert found["triangle"][0][:, 2] == pytest.approx(0.0, abs=1e-9)
    assert len(table) == 2
