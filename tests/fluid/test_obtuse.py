"""Meshes with obtuse angles: the pressure stays definite and water at rest stays at rest."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fluid.cut.bodies import ConvexBodies
from fluid.domain.graph import Graph
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.mesh.background import Background, box_mesh
from fluid.pressure.active_cells import WetPart
from fluid.pressure.indefinite_cells import about, reserve
from fluid.pressure.projection import pressure_matrix
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance

N = 8
BOX = box_mesh((0, 0, 0), (1, 1, 1), 1 / N)


def jittered(share):
    """The inner nodes of the cube moved by up to `share` of a cell."""
    x = BOX.nodes.copy()
    move = np.random.default_rng(1).uniform(-share, share, x.shape) / N
    move[(x < 1e-9) | (x > 1 - 1e-9)] = 0
    return Background.from_arrays(x + move, BOX.cells)


def thin_wall(seed):
    """A plate right through the tank, 0.1 to 0.8 cells thick, at a random place and tilt."""
    random = np.random.default_rng(seed)
    turn = Rotation.from_rotvec(random.uniform(-0.4, 0.4, 3)).as_matrix()[None]
    size = np.array([[0.05 * random.uniform(0.3, 2.0), 3.0, 3.0]])
    return ConvexBodies.boxes(np.zeros((1, 3)), size).moved(random.uniform(0.4, 0.6, (1, 3)), turn)


def test_bricks_split_into_tetrahedra_have_no_obtuse_angles():
    """So that nothing of this costs anything on the meshes that cases make."""
    assert not BOX.is_obtuse
    assert jittered(0.15).is_obtuse


@pytest.mark.parametrize(("share", "level", "seed"), [(0.15, 0.5, 0), (0.25, 0.5, 3), (0.25, 0.53, 0)])
def test_water_on_both_sides_of_a_thin_wall_stays_at_rest(share, level, seed):
    """Rows that obtuse cells made negative moved such water with 0.01 to 1 m/s within 50 steps, or conjugate gradients
    met a direction of negative curvature."""
    mesh = jittered(share)
    domain = cut_domain(mesh, thin_wall(seed), "multiple")
    water = Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters())
    for _ in range(50):
        advance(water)
    assert water.fastest() < 1e-7


def surfaces(nodes, count):
    """Level sets (N,) [m] of tilted and wavy surfaces that pass close to a node."""
    random = np.random.default_rng(1)
    for _ in range(count):
        slope, wave = random.uniform(-1.5, 1.5, 2), random.uniform(0, 0.1)
        phi = nodes[:, 2] - nodes[:, :2] @ slope - wave * np.sin(9 * nodes[:, 0])
        phi -= phi[random.integers(len(nodes))] + random.choice([1e-3, 1e-2, 3e-4])
        if (phi < 0).any():
            yield phi


def test_the_matrix_is_definite_wherever_the_surface_lies():
    """Some of these matrices are not without what is added behind obtuse angles; where nothing is, nothing changes."""
    mesh = jittered(0.4)
    domain = cut_domain(mesh, ConvexBodies.empty(), "single")
    t = Topology.of(mesh, domain)
    nowhere, graph = np.zeros(len(t.nodes), bool), Graph.of(t, np.arange(len(t.nodes)))
    indefinite = 0
    for phi in surfaces(t.nodes, 40):
        part = WetPart.of(t, domain, phi, mesh.spacing)
        dofs, kept = np.flatnonzero(part.nodes), graph.without(t, part.void)
        spare = reserve(t, part.cells, part.nodes)
        matrix, _, turned = pressure_matrix(kept, phi, dofs, nowhere, 1.0, spare)
        plain = pressure_matrix(kept, phi, dofs, nowhere, 1.0, np.full(len(phi), np.inf))[0]
        assert np.linalg.eigvalsh(matrix.toarray())[0] > 0
        assert abs(matrix - matrix.T).max() <= 1e-12 * matrix.diagonal().max()
        np.testing.assert_allclose((matrix - plain).diagonal(), turned, atol=1e-9 * matrix.diagonal().max())
        indefinite += np.linalg.eigvalsh(plain.toarray())[0] <= 0
    assert indefinite > 0


def test_rows_held_back_know_the_pressure_of_water_at_rest():
    """φ times the slope of the nodes beside the surface; the node itself counts for little."""
    t = Topology.of(BOX, cut_domain(BOX, ConvexBodies.empty(), "single"))
    graph, phi = Graph.of(t, np.arange(len(t.nodes))), t.nodes[:, 2] - 0.501
    beside = (phi < 0) & (phi > -0.2)
    row = np.flatnonzero(beside & (t.nodes[:, 2] == 0.5))[:1]
    at_rest = -1e4 * phi
    np.testing.assert_allclose(about(graph, row, beside, phi, at_rest), at_rest[row], rtol=1e-12)
    disturbed = np.where(np.arange(len(phi)) == row, 1e3, at_rest)
    np.testing.assert_allclose(about(graph, row, beside, phi, disturbed), at_rest[row], rtol=1e-2)
