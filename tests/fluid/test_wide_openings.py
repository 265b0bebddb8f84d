"""Thresholds for thin plates with free edges: added mass, doors and narrow openings, and nothing lost at rest."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.coupling_matrix import wetted_coupling
from fluid.domain.covers import EDGES_APART, WIDE_OPENINGS, components
from fluid.domain.hats import hat_values
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.numerics.solve import solve
from tests.fluid.plane_reference import released
from tests.fluid.still import RHO_G, forces, laplace, pressure
from tests.fluid.test_slits import LEVELS, opened
from tests.fluid.test_thin_walls import BLOCK, FILM, MESH, H, plate, wall_load


def added_mass(cells_wide, connection, place, turn):
    """Added mass of a square plate 0.3 h thick, accelerated along its normal in a closed box four times as wide with a
    free surface, in units of 0.579 π/4 rho a^3 (unbounded, infinitely thin)."""
    n = round(4 * cells_wide)
    a, h = 0.5, 2 / n
    mesh = box_mesh((0, 0, 0), (2, 2, 2), h)
    body = ConvexBodies.boxes([1 + h * np.asarray(place)], [[0.3 * h, a, a]], turn[None])
    domain = cut_domain(mesh, body, "multiple", connection=connection)
    K, _ = laplace(domain, np.ones(len(domain.cells), dtype=bool))
    flux = wetted_coupling(domain) @ np.append(turn[:, 0], np.zeros(3))
    used = (K.diagonal() > 0) & (domain.nodes[:, 2] < 2 - 1e-9)
    A = sp.csr_array(K[used][:, used])
    x = solve(A, flux[used], np.zeros(used.sum()), 1e-8).x
    return flux[used] @ x / (0.579 * np.pi / 4 * a**3)


@pytest.mark.parametrize("turned", [False, True])
def test_added_mass_of_a_thin_plate(turned):
    """5.6 cells wide: within 15 % of theory with thresholds; without, half of it is lost through the edges."""
    turn = Rotation.from_euler("yz", [25, 10], degrees=True).as_matrix() if turned else np.eye(3)
    place = (0.2, -0.3, 0.4)
    assert added_mass(5.6, WIDE_OPENINGS, place, turn) == pytest.approx(1, abs=0.15)
    assert added_mass(5.6, None, place, turn) < 0.6


@pytest.mark.nightly
@pytest.mark.parametrize(("cells_wide", "spread"), [(2.8, 0.32), (5.6, 0.15), (8, 0.08)])
def test_added_mass_converges(cells_wide, spread):
    """At random places and turns."""
    rng = np.random.default_rng(0)
    for _ in range(4):
        turn = Rotation.random(rng=rng).as_matrix()
        found = added_mass(cells_wide, WIDE_OPENINGS, rng.uniform(-0.5, 0.5, 3), turn)
        assert found == pytest.approx(1, abs=spread)


@pytest.mark.parametrize("thickness", [0.1, 0.9])
@pytest.mark.parametrize(("tilt", "yaw"), [(0, 0), (20, -15)])
def test_full_walls_stay_exact(thickness, tilt, yaw):
    bodies, normal, point = plate(thickness, 0.52, tilt, yaw)
    domain = cut_domain(MESH, bodies, "multiple", connection=WIDE_OPENINGS)
    force, error = wall_load(domain, normal, point)
    assert force[0] == pytest.approx(RHO_G * 0.375, rel=1e-13)
    assert error < 1e-13 * RHO_G


@pytest.mark.parametrize("behind", [0.1, 0.3, 0.5, 0.7])
@pytest.mark.parametrize("turned", [False, True])
def test_water_before_a_wall_is_one(behind, turned):
    """Wherever a wall of many cells lies between the nodes, each node has one copy, but within two cells of its edges:
    slivers that the wall leaves of cells stay with the water before it."""
    turn = Rotation.from_euler("yz", [30, 12], degrees=True).as_matrix() if turned else np.eye(3)
    h, size = 1 / 16, np.array([0.4, 0.7, 0.7])
    mesh = box_mesh((0, 0, 0), (1, 1, 1), h)
    centre = np.array([0.5 + behind * h, 0.5, 0.5])
    domain = cut_domain(
        mesh, ConvexBodies.boxes([centre], [size], turn[None]), "multiple", connection=WIDE_OPENINGS
    )
    there = np.abs((domain.nodes - centre) @ turn)
    off_edges = (there < size / 2 - 2 * h).sum(axis=1) >= 2
    number = np.bincount(domain.parent_node[off_edges])
    assert number.max() == 1


@pytest.mark.parametrize("connection", [WIDE_OPENINGS, EDGES_APART])
@pytest.mark.parametrize("tilt", [0.0, 1e-4])
@pytest.mark.parametrize("shift", [1e-4, 1e-2])
def test_blocks_in_a_stack_that_are_not_flush_leave_no_water_of_its_own(shift, tilt, connection):
    """Three blocks one on the other, moved and turned a little: between the side of one and the extended side of the
    next lie slivers. Apart from the water before them (20 to 70 here) they are films that moving blocks empty at any
    pressure, 8e10 Pa in a wall under a bore."""
    h = 1 / 6
    rng = np.random.default_rng(0)
    size = np.array([2.6 * h, 2.6 * h, 0.7 / 3])
    centre = 0.5 + np.array([0.137, -0.230, 0.0]) * h + shift * h * rng.uniform(-1, 1, (3, 3))
    centre[:, 2] = 0.15 + size[2] * (np.arange(3) + 0.5)
    turn = Rotation.from_euler("xyz", tilt * rng.uniform(-1, 1, (3, 3))).as_matrix()
    mesh = box_mesh((0, 0, 0), (1, 1, 1), h)
    domain = cut_domain(
        mesh, ConvexBodies.boxes(centre, np.tile(size, (3, 1)), turn), "multiple", connection=connection
    )
    of_sides = np.abs(domain.face_normal[:, 2]) < 0.5
    side, all_of_it = (
        np.bincount(domain.face_cell, domain.face_area * counted, minlength=len(domain.cells))
        for counted in (of_sides, 1.0)
    )
    beside = (side > 0.005 * h**2) & (side > 0.9 * all_of_it)
    assert beside.sum() > 100
    assert not (beside & (domain.volume < 0.02 * h * side)).any()


@pytest.mark.parametrize("gap", [0.0, 1e-9, 1e-3])
def test_films_under_blocks_stay_connected(gap):
    """A film far thinner than the thresholds still has the pressure of the water around: full buoyancy."""
    bodies = ConvexBodies.boxes([[0.52, 0.47, BLOCK[2] / 2 + gap]], [BLOCK]).grown(-FILM * H)
    domain = cut_domain(MESH, bodies, "multiple", connection=WIDE_OPENINGS)
    assert components(domain.cells, len(domain.nodes)).max() == 0
    force = forces(domain, pressure(domain, np.ones(len(domain.cells))))[0]
    np.testing.assert_allclose(force, [0, 0, RHO_G * (BLOCK - 2 * FILM * H).prod()], atol=1e-8 * RHO_G)


@pytest.mark.parametrize("width", [2.4, 1.2])
def test_doors_of_a_cell_and_more(width):
    """Load on a thin wall with a wide opening within 8 %; without thresholds 25 to 40 % of it is missing."""
    h, thickness = 1 / 12, 0.02
    low, high = 0.27 - width * h / 2, 0.27 + width * h / 2
    truth = released(0.52, thickness, [(low, high)], LEVELS, 1e-3)[0]
    assert opened(12, thickness, [(-1, low), (high, 2)], WIDE_OPENINGS) == pytest.approx(truth, rel=0.08)
    assert opened(12, thickness, [(-1, low), (high, 2)], None) < 0.8 * truth


def test_openings_to_pockets_that_are_dropped_count_as_closed():
    """∫∇N dV over the water is balanced by the solids at every node inside but those with several copies. Of two blocks
    3e-5 of a cell apart the film between them is a pocket of its own, which is dropped: nodes at its rim have one copy
    left, and the opening that was closed there still acts on the water."""
    h = 0.1
    mesh = box_mesh((0, 0, 0), (1, 1, 1), h)
    size = np.array([0.35, 0.35, 0.25])
    centre = [[0.537, 0.537, 0.3], [0.537, 0.537, 0.3 + size[2] + 3e-5 * h]]
    domain = cut_domain(
        mesh,
        ConvexBodies.boxes(centre, np.broadcast_to(size, (2, 3))),
        "multiple",
        connection=WIDE_OPENINGS,
    )
    missed = np.zeros((len(domain.nodes), 3))
    gradients = mesh.gradients[domain.parent_cell]
    for a in range(4):
        np.add.at(missed, domain.cells[:, a], domain.volume[:, None] * gradients[:, a])
    around = domain.cells[domain.face_cell]
    hats = hat_values(domain.face_cell, domain.face_points, domain.hats, domain.nodes).mean(axis=1)
    for a in range(4):
        np.add.at(missed, around[:, a], (domain.face_area * hats[:, a])[:, None] * domain.face_normal)
    inside = ((domain.nodes > 0.5 * h) & (domain.nodes < 1.0 - 0.5 * h)).all(axis=1)
    missed = np.abs(missed).max(axis=1)
    assert missed[inside & ~domain.several].max() < 1e-15
    alone = np.bincount(domain.parent_node)[domain.parent_node] == 1
    assert missed[inside & domain.several & alone].max() > 1e-9
