"""Walls thinner than a cell, bonded blocks, and blocks on a floor: the exact load, decided by state and not by gaps."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import components
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import Background, box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance, load
from tests.fluid.still import RHO_G, forces, hydrostatic, pressure

N = 8
H = 1 / N
LEVEL = np.array([1.0, 0.5])
BOX = box_mesh((0, 0, 0), (1, 1, 1), H)


def jittered():
    """A cube of general tetrahedra; nodes of the boundary and of the lower water level stay in plane."""
    x = BOX.nodes.copy()
    move = np.random.default_rng(0).uniform(-0.15, 0.15, x.shape) * H
    move[(x < 1e-9) | (x > 1 - 1e-9)] = 0
    move[np.abs(x[:, 2] - LEVEL[1]) < 1e-9, 2] = 0
    return Background.from_arrays(x + move, BOX.cells)


MESH = jittered()


def plate(thickness, at, tilt, yaw):
    """A wall across the whole cube through (at, 1/2, 1/2), thickness in cells, tilt and yaw in degrees."""
    turn = Rotation.from_euler("yz", [tilt, yaw], degrees=True).as_matrix()
    point = np.array([at, 0.5, 0.5])
    return ConvexBodies.boxes([point], [[thickness * H, 4, 4]], turn[None]), turn[:, 0], point


def side_of(domain, normal, point):
    """(M,) 0 or 1: the side of the wall that each cell lies on."""
    return ((domain.centroid - point) @ normal > 0).astype(int)


def wall_load(domain, normal, point):
    """Force (3,) on all bodies of a wall between water of two levels, and the largest error of the pressure."""
    level = LEVEL[side_of(domain, normal, point)]
    p = pressure(domain, level)
    return forces(domain, p).sum(axis=0), np.abs(p - hydrostatic(domain, level)).max()


@pytest.mark.parametrize("thickness", [0.1, 0.3, 0.5, 0.9, 1.5])
@pytest.mark.parametrize("at", [0.5, 0.52, 0.5 + 0.37 * H])
@pytest.mark.parametrize(("tilt", "yaw"), [(0, 0), (10, 7), (20, -15)])
def test_wall_between_two_levels(thickness, at, tilt, yaw):
    """Water 1 m and 0.5 m deep: F = rho g (h1^2 - h2^2) / 2 b whatever thickness, place and tilt, exact pressure on
    both sides, and no cell common to them. (One field for both sides carries 1 to 36 % of it.)"""
    bodies, normal, point = plate(thickness, at, tilt, yaw)
    domain = cut_domain(MESH, bodies, "multiple")
    part = components(domain.cells, len(domain.nodes))
    side = side_of(domain, normal, point)
    assert part.max() == 1
    assert len(np.unique(2 * part + side)) == 2
    force, error = wall_load(domain, normal, point)
    assert force[0] == pytest.approx(RHO_G * 0.375, rel=1e-13)
    assert error < 1e-13 * RHO_G


def test_single_cover_leaks_through_a_thin_wall():
    """The reason for the multiple covers: half a cell thick, the wall carries almost nothing."""
    bodies, normal, point = plate(0.5, 0.52, 0, 0)
    force, _ = wall_load(cut_domain(MESH, bodies), normal, point)
    assert abs(force[0]) < 0.5 * RHO_G * 0.375


@pytest.mark.parametrize(("thickness", "tilt", "yaw"), [(0.1, 0, 0), (0.1, 10, 7), (0.5, 0, 0), (1.5, 10, 7)])
def test_water_stays_at_rest_on_both_sides(thickness, tilt, yaw):
    """The whole step with levels between nodes: no motion, no water from one side to the other, the exact load."""
    bodies, normal, point = plate(thickness, 0.52, tilt, yaw)
    domain = cut_domain(BOX, bodies, "multiple")
    side = np.zeros(len(domain.nodes), int)
    side[domain.cells] = side_of(domain, normal, point)[:, None]
    level = np.array([0.87, 0.43])
    water = Water(BOX, domain, domain.nodes[:, 2] - level[side], WaterParameters())
    before = np.bincount(side, water.nodal_water)
    for _ in range(5):
        problem, x = advance(water, rtol=1e-12)
    assert np.abs(water.velocity[water.level_set < 0]).max() < 1e-9
    np.testing.assert_allclose(np.bincount(side, water.nodal_water), before, rtol=1e-13)
    exact = RHO_G * (level[0] ** 2 - level[1] ** 2) / 2
    assert load(problem, x)[0, 0] == pytest.approx(exact, rel=1e-12)


def bricks(count, thickness, gap, angle, seed=0):
    """A wall of count x count blocks across the cube at x = 0.52, gaps [m] between them, turned a little."""
    edge = 1 / count
    at = (np.arange(count) + 0.5) * edge
    centre = np.array([[0.52, y, z] for y in at for z in at])
    size = np.tile([thickness, edge - gap, edge - gap], (len(centre), 1))
    turn = Rotation.from_rotvec(angle * np.random.default_rng(seed).normal(size=centre.shape)).as_matrix()
    return ConvexBodies.boxes(centre, size, turn)


def side_growth(bodies, amount):
    """Shift the faces between blocks outward, not those towards the water."""
    growth = np.full(len(bodies.offsets), amount)
    growth[0::6] = growth[3::6] = 0.0
    return bodies.grown(growth)


GAPS = [(gap, 0.0) for gap in (0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 5e-3)]
TURNS = [(0.0, angle) for angle in (1e-7, 1e-5, 1e-4, 1e-3)]


@pytest.mark.parametrize(("gap", "angle"), GAPS + TURNS)
def test_joints_closed_by_growth_carry_the_full_load(gap, angle):
    """A wall of 5 x 5 bonded blocks with gaps or turns of every size: exact force once the joints are closed."""
    bodies = side_growth(bricks(5, 0.5 * H, gap, angle), gap / 2 + 0.6 * angle + 1e-7)
    domain = cut_domain(MESH, bodies, "multiple")
    assert components(domain.cells, len(domain.nodes)).max() == 1
    force, error = wall_load(domain, np.array([1.0, 0, 0]), np.array([0.52, 0.5, 0.5]))
    assert force[0] == pytest.approx(RHO_G * 0.375, rel=1e-11)
    assert error < 1e-13 * RHO_G


FILM = 1e-4
"""Share of a cell by which loose blocks are drawn in."""
BLOCK = np.array([0.42, 0.35, 0.31])


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_buoyancy_of_a_loose_block_on_the_floor_does_not_hang_on_its_gap(gap, covers):
    """Drawn in by a film, a block that rests on the floor is lifted by the water it displaces, gap or not."""
    centre = np.array([0.52, 0.47, BLOCK[2] / 2 + gap])
    bodies = ConvexBodies.boxes([centre], [BLOCK]).grown(-FILM * H)
    domain = cut_domain(MESH, bodies, covers)
    force = forces(domain, pressure(domain, np.ones(len(domain.cells))))[0]
    displaced = (BLOCK - 2 * FILM * H).prod()
    np.testing.assert_allclose(force, [0, 0, RHO_G * displaced], atol=1e-8 * RHO_G)


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
def test_weight_of_water_on_a_block_bonded_to_the_floor(gap, covers):
    """Its lower face closed by the state of the joint, the water above presses it down, gap or not."""
    centre = np.array([0.52, 0.47, BLOCK[2] / 2 + gap])
    growth = np.zeros(6)
    growth[2] = gap + 1e-7
    domain = cut_domain(MESH, ConvexBodies.boxes([centre], [BLOCK]).grown(growth), covers)
    force = forces(domain, pressure(domain, np.ones(len(domain.cells))))[0]
    weight = RHO_G * BLOCK[0] * BLOCK[1] * (1 - BLOCK[2] - gap)
    np.testing.assert_allclose(force, [0, 0, -weight], atol=1e-8 * RHO_G)
