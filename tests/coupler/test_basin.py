"""Blocks in basins from mesh files that are no boxes: what their walls and bed are, water at rest around blocks in
them, blocks that slide, rest and are stopped, refusals with the place."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.geometry.basin import BasinError, basin_of
from coupler.program.errors import BadCase
from coupler.scene.build import build, build_structure
from fluid.mesh.background import Background, box_mesh
from tests.coupler.basins import cylinder, write
from tests.coupler.resumed import directory_of
from tests.fakes import no_clock

SLOPE = 0.25

CASE = """\
[case]
title = "blocks in a basin"
[time]
end = "0.5 s"
step_max = "20 ms"
[tank]
mesh = "box.vtu"
WATER
[structure]
density = 2000
BLOCK
[contact]
stiffness = "1 MN/m"
friction = FRICTION
"""
WATER = """\
[water]
[[water.fill]]
lower = [-9, -9, -9]
upper = [9, 9, 0.45]
"""


def warped(bed, size=(1.6, 0.4, 0.8), cell=0.1):
    """Nodes and cells of bricks whose columns stand on a bed z(x, y) under a level top."""
    mesh = box_mesh((0, 0, 0), size, cell)
    nodes = mesh.nodes.copy()
    foot = bed(nodes[:, 0], nodes[:, 1])
    nodes[:, 2] = foot + nodes[:, 2] * (size[2] - foot) / size[2]
    return nodes, mesh.cells


def beach(x, y):
    return SLOPE * x


def on_beach(along, lift=0.0):
    """Centre of a block of 0.16 x 0.2 x 0.12 m that lies on the beach, and its turn."""
    a = np.arctan(SLOPE)
    up = np.array([-np.sin(a), 0.0, np.cos(a)])
    centre = np.array([along, 0.2, SLOPE * along]) + (0.06 + lift) * up
    return list(map(float, centre)), -a


def block(along, lift=0.0, more=""):
    centre, turn = on_beach(along, lift)
    return (
        f'[[structure.block]]\nname = "b"\ncentre = {centre}\nsize = [0.16, 0.2, 0.12]\n'
        f"rotation = {{ axis = [0, 1, 0], angle = {turn} }}\n{more}"
    )


def loaded(place, made, what, water="", friction=0.5):
    directory = directory_of(
        place, CASE.replace("WATER", water).replace("BLOCK", what).replace("FRICTION", str(friction))
    )
    write(directory / "box.vtu", made[0], tetra=made[1])
    return load(directory).case


# ---------------------------------------------------------------- what it is


def test_the_bed_of_a_beach_is_where_the_mesh_ends():
    """A bed with a kink between two rows of nodes too; no wall but the sides of the box."""

    def kinked(x, y):
        return np.maximum(0.25 * x - 0.1, 0.1 * y)

    for bed, off in ((beach, 1e-12), (kinked, 0.02)):
        basin = basin_of(Background.from_arrays(*warped(bed)))
        assert len(basin.point) == 0
        np.testing.assert_allclose(basin.bed, bed(*np.meshgrid(basin.x, basin.y, indexing="ij")), atol=off)


def test_a_round_tank_has_a_wall_for_each_facet_and_a_level_floor():
    basin = basin_of(Background.from_arrays(*cylinder(0.5, 0.75, 4, 6)))
    assert basin.bed is None
    assert len(basin.point) == 24
    np.testing.assert_allclose(
        np.einsum("ij,ij->i", basin.normal, -basin.point * [1, 1, 0]), 0.5 * np.cos(np.pi / 24)
    )
    np.testing.assert_allclose(basin.normal[:, 2], 0.0, atol=1e-12)


def without(cut):
    """The cells of a box but those whose middle `cut` names."""
    mesh = box_mesh((0, 0, 0), (1.2, 0.8, 0.4), 0.1)
    kept = mesh.cells[~cut(*mesh.nodes[mesh.cells].mean(axis=1).T)]
    used, cells = np.unique(kept, return_inverse=True)
    return mesh.nodes[used], cells.reshape(kept.shape)


def test_an_angle_of_a_basin_is_refused_with_its_place():
    with pytest.raises(BasinError, match=r"stopped at \(.*goes on behind the plane of that wall, 0.\d+ m at"):
        basin_of(Background.from_arrays(*without(lambda x, y, z: (x > 0.6) & (y > 0.4))))


def test_an_overhang_is_refused():
    with pytest.raises(BasinError, match=r"stopped at|twice"):
        basin_of(Background.from_arrays(*without(lambda x, y, z: (x > 0.8) & (z > 0.1) & (z < 0.2))))


@pytest.mark.parametrize(
    ("centre", "reported"),
    [([1.2, 0.2, 0.3], r"'b' reaches 0\.\d+ m into the bed of tank.mesh"), ([0.3, 0.2, 0.06], None)],
)
def test_blocks_below_the_bed_are_refused(tmp_path, centre, reported):
    what = f'[[structure.block]]\nname = "b"\ncentre = {centre}\nsize = [0.1, 0.1, 0.1]\n'
    if reported is None:
        what = what.replace("0.06", "0.16")
        loaded(tmp_path, warped(beach), what)
        return
    with pytest.raises(BadCase, match=reported):
        loaded(tmp_path, warped(beach), what)


def test_blocks_behind_a_wall_are_refused(tmp_path):
    what = '[[structure.block]]\nname = "b"\ncentre = [0.42, 0.2, 0.2]\nsize = [0.1, 0.1, 0.1]\n'
    with pytest.raises(BadCase, match=r"'b' reaches 0\.\d+ m into the wall of tank.mesh through"):
        loaded(tmp_path, cylinder(0.5, 0.75, 4, 6), what)


# ---------------------------------------------------------------- blocks


def test_a_block_slides_down_the_beach_by_the_law_of_friction(tmp_path):
    """s = 1/2 g (sin a - mu cos a) t² within 2 %, over many triangles of the lattice."""
    case = loaded(tmp_path, warped(beach), block(1.3), friction=0.1)
    a = np.arctan(SLOPE)
    g = 9.81 * (np.sin(a) - 0.1 * np.cos(a))
    with build_structure(case) as structure:
        structure.advance(0.1)
        start = structure.centre()[0].copy()
        structure.advance(0.5)
        way = structure.centre()[0] - start
    down = np.array([-np.cos(a), 0.0, -np.sin(a)])
    assert way @ down == pytest.approx(0.5 * g * (0.6**2 - 0.1**2), rel=0.02)


def test_a_block_is_stopped_by_the_wall_of_a_round_tank(tmp_path):
    """It slides on the floor against a facet that no axis is normal to, and stays inside."""
    turn = np.radians(37.5)
    out = np.array([np.cos(turn), np.sin(turn), 0.0])
    what = (
        '[[structure.block]]\nname = "b"\ncentre = [0.1, 0.1, 0.05]\nsize = [0.1, 0.1, 0.1]\n'
        f"rotation = {{ axis = [0, 0, 1], angle = {turn} }}\nvelocity = {list(map(float, 2.0 * out))}\n"
    )
    case = loaded(tmp_path, cylinder(0.5, 0.75, 4, 6), what, friction=0.05)
    with build_structure(case) as structure:
        farthest = 0.0
        for _ in range(50):
            structure.advance(0.01)
            farthest = max(farthest, structure.centre()[0] @ out)
    assert farthest == pytest.approx(0.5 * np.cos(np.pi / 24) - 0.05, abs=5e-3)


def advance(coupling, steps):
    """The last of so many steps."""
    return [coupling.step(0.02) for _ in range(steps)][-1]


def test_still_water_carries_a_held_block_by_its_weight(tmp_path):
    """A block under water close above the slanting bed: nothing moves, and the load is ρ g V to 1e-6."""
    case = loaded(tmp_path, warped(beach), block(0.6, lift=0.05, more="fixed = true\n"), WATER)
    coupling = build(case, no_clock).coupling
    try:
        last = advance(coupling, 30)
        assert coupling.water.fastest() < 1e-7
        assert last.load[0, :3] == pytest.approx([0.0, 0.0, 9810 * 0.16 * 0.2 * 0.12], rel=1e-6, abs=1e-4)
    finally:
        coupling.structure.close()


def test_a_block_rests_on_the_slanting_bed_under_water(tmp_path):
    """Friction of one half holds it on a slope of a quarter: neither it nor the water moves."""
    case = loaded(tmp_path, warped(beach), block(0.7), WATER)
    coupling = build(case, no_clock).coupling
    try:
        start = coupling.structure.centre()[0].copy()
        advance(coupling, 40)
        assert np.linalg.norm(coupling.structure.centre()[0] - start) < 1e-3
        assert np.abs(coupling.structure.velocity()).max() < 1e-4
        assert coupling.water.fastest() < 1e-3
    finally:
        coupling.structure.close()
