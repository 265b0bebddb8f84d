"""The pressure: exact at the release of a dam, symmetric positive definite, in balance with bodies."""

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

import kernels.threads as threads
from coupler.commands.verify.figures import columns
from fluid.cut.bodies import ConvexBodies
from fluid.domain.moments import cells_touching
from fluid.pressure import projection
from fluid.pressure.projection import cell_gradient, with_ghosts
from fluid.step.remainders import carry_remainder
from tests.fluid.scenes import advance, column, rotation, tank


@pytest.mark.parametrize("width", [0.5, 1.0])
def test_first_pressure_after_a_dam_vanishes(width):
    """Series solution of Laplace p = 0 in the released column (header of the CSV); error falls with h."""
    table = np.column_stack(list(columns("dam_release_initial_pressure").values()))
    table = table[table[:, 0] == width]
    errors = []
    for cell in (0.1, 0.05):
        water = tank([width + 0.5, 2 * cell, 1.2], cell, column(width, 1.0))
        advance(water, 1e-4)
        nodes = water.topology.nodes
        errors.append(_mean_error(nodes, water.pressure / 9810.0, table))
    assert errors[1] < 0.01
    assert errors[1] < 0.65 * errors[0]


def _mean_error(nodes, p, table):
    """Mean |p - p_exact| over the tabulated points that are nodes of the middle plane."""
    middle = np.isclose(nodes[:, 1], nodes[nodes[:, 1] > 0, 1].min())
    found = []
    for _, x, z, exact in table:
        at = np.flatnonzero(middle & np.isclose(nodes[:, 0], x) & np.isclose(nodes[:, 2], z))
        if len(at):
            found.append(abs(p[at[0]] - exact))
    assert len(found) > 5
    return np.mean(found)


@pytest.fixture(scope="module")
def cut():
    """A closed full tank with two tilted bodies, one through a wall: every kind of cut cell."""
    bodies = ConvexBodies.boxes(
        np.array([[0.5, 0.45, 0.4], [0.9, 0.5, 0.7]]),
        np.array([[0.3, 0.25, 0.2], [0.4, 0.1, 0.3]]),
        np.array([rotation([1, 2, 3], 0.7), rotation([0, 1, 1], 0.3)]),
    )
    return tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 10.0, bodies)


def test_matrix_is_symmetric_positive_definite_with_a_surface():
    water = tank([1, 1, 1], 0.25, lambda x: (x - 0.5) @ [0.3, 0.1, 1.0])
    A = water.predict(0.01).matrix.toarray()
    np.testing.assert_allclose(A, A.T, atol=1e-14 * np.abs(A).max())
    assert np.linalg.eigvalsh(A).min() > 0


def test_edges_without_stiffness_have_no_entry():
    """Along the diagonals of split bricks the gradients of the two ends are perpendicular in every cell, cut or not: of
    14 neighbours of a node inside only the six along the axes are left, and the diagonal."""
    bodies = ConvexBodies.boxes([[0.5, 0.45, 0.4]], [[0.3, 0.25, 0.2]], [rotation([1, 2, 3], 0.7)])
    A = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.8, bodies).predict(0.01).matrix
    assert (A.data != 0.0).all()
    assert np.diff(A.indptr).max() == 7


def test_constants_are_the_null_space_of_a_closed_tank(cut):
    """Only the compliance that fixes the level of a pocket, 1e-8 of the rest, answers to a constant pressure."""
    A = cut.predict(0.01).matrix
    ones = np.ones(A.shape[0])
    p = cut.parameters
    expected = cut.topology.node_volume.sum() * p.pocket_compliance * 0.01 / (p.density * cut.mesh.spacing**2)
    np.testing.assert_allclose(ones @ (A @ ones), expected, rtol=1e-6)
    assert np.abs(A @ ones).max() < 1e-4 * A.diagonal().max()


def test_bodies_take_from_the_water_what_they_give(cut):
    """Newton's third law on the discrete level: mass balance (A x = rhs + G V) and load (-Gᵀ p) share one G, so that
    the momentum of the pressure over the water is minus the load on bodies and walls."""
    t = cut.topology
    cells = cells_touching(np.ones(len(t.nodes), bool), t.cells)
    p = t.nodes @ [1.0, -2.0, 0.5] + 3.0
    gradient = cell_gradient(cells, p, t.cells, t.parent, t.gradients)
    over_water = (t.volume[cells, None] * gradient).sum(axis=0)
    faces = cut.mesh.boundary_faces
    x = cut.mesh.nodes[faces]
    assert cut.coupling.shape == (len(t.nodes), 12)
    on_bodies = -(cut.coupling.T @ p).reshape(-1, 6)[:, :3].sum(axis=0)
    on_whole_walls = np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]) / 2 * p[faces].mean(axis=1)[:, None]
    # the second body sticks out through the wall x = 1: compare the directions its opening does not face
    np.testing.assert_allclose((on_bodies + on_whole_walls.sum(axis=0))[1:], over_water[1:], atol=1e-10)


@pytest.mark.parametrize(("viscosity", "left"), [(0.0, 1 / 3), (1.25, 1 / 5)])
def test_the_remainder_of_a_cell_is_swept_out_as_fast_as_water_crosses_it(viscosity, left):
    """β = 1/(1 + (4 ν/l + 2 |u|) dt/l) of what is left and kicked; |u| = 5 m/s of the mean, dt = 0.1 s, l = 0.5 m."""
    u = np.array([[3.0, 4.0, 0.0]] * 4)
    u[0] += [1.0, -2.0, 6.0]
    u[1] -= [1.0, -2.0, 6.0]
    remainder, kick = np.array([[0.3, 0.0, -0.6]]), np.array([[3.0, 6.0, 0.0]])
    cells, size = np.array([[0, 1, 2, 3]]), np.array([0.5])
    held = (np.array([0]), remainder, kick)
    out = carry_remainder(np.array([0]), held, 0.02, u, 0.1, viscosity, cells, size)
    np.testing.assert_allclose(out, [[0.36 * left, 0.12 * left, -0.6 * left]], rtol=1e-12)


def test_water_that_has_hardly_moved_since_it_turned_keeps_the_remainder_of_its_cell():
    """The pressure changes the remainder by 18 m/s², sweeping in full by 0.02 · 20 = 0.4 m/s²: a 45th of that counts,
    β = 1/(1 + 20/45 · 0.1). Viscosity, 20/s more, acts in full, and twice as much of it counts as steady."""
    u, remainder, kick = (
        np.array([[3.0, 4.0, 0.0]] * 4),
        np.array([[0.0, 0.02, 0.0]]),
        np.array([[0.0, 0.0, 18.0]]),
    )
    cells, size, held = np.array([[0, 1, 2, 3]]), np.array([0.5]), (np.array([0]), remainder, kick)
    for viscosity, left in ((0.0, 1.0 / (1.0 + 2.0 / 45.0)), (1.25, 1.0 / (3.0 + 4.0 / 45.0))):
        out = carry_remainder(np.array([0]), held, 0.02, u, 0.1, viscosity, cells, size)
        np.testing.assert_allclose(out, [[0.0, 0.02 * left, 0.36 * left]], rtol=1e-12)


def test_a_sliver_of_water_does_not_decide_the_pressure_beyond_the_surface():
    """Two cells share a dry corner. The water of one, a millionth of the room of the other, has a thousand times its
    pressure: beyond the surface goes on what the other one has (-ρ g φ, to a thousandth)."""
    phi = np.array([-0.1, -0.2, -0.3, 0.4, -0.1, -0.2, -0.3])
    pressure, wet = -9810.0 * phi, phi < 0.0
    pressure[4:] *= 1000.0
    pressure[3] = 0.0
    cells = np.array([[0, 1, 2, 3], [4, 5, 6, 3]], np.uint32)
    volume = np.array([1e-3, 1e-9])
    out = with_ghosts(pressure, np.zeros(7), wet, np.zeros(7, bool), phi, np.arange(2), cells, volume)
    assert out[3] == pytest.approx(-9810.0 * 0.4, rel=2e-3)
    np.testing.assert_array_equal(out[wet], pressure[wet])


def test_water_that_hangs_together_with_a_surface_is_found_on_any_number_of_threads():
    """Rows that a sweep to and fro does not reach at once: chains whose numbers are in no order."""
    rng = np.random.default_rng(2)
    ends = [rng.permutation(3000)[:500] for _ in range(4)]
    row, col = (np.concatenate([e[a] for e in ends]) for a in (slice(None, -1), slice(1, None)))
    A = sp.coo_array((np.ones(len(row)), (row, col)), shape=(3000, 3000))
    A = sp.csr_array(A + A.T + sp.eye_array(3000))
    seed = np.zeros(3000, bool)
    seed[ends[0][7]] = True
    part = connected_components(A)[1]
    expected = part == part[ends[0][7]]
    assert 500 < expected.sum() < 2900
    for number in (1, 2, 3, 4):
        threads.use(number, least=1)
        found = projection._reached(A.indptr, A.indices, seed)
        threads.use(1)
        np.testing.assert_array_equal(found, expected)
    assert not projection._reached(A.indptr, A.indices, np.zeros(3000, bool)).any()
