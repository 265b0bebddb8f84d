"""The volume of the nodes beside the surface, as the surface sweeps it."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.surface.volume import edge_flux, nodal_volume
from fluid.transport.swept_volume import swept
from fluid.transport.volume_transport import carry_volume
from tests.fluid.scenes import advance

CELL, DT = 0.25, 0.01
UPWARDS = np.array([0.0, 0.0, 1.0])


def rising(normal, speed, place, size=(0.75, 0.5, 2.0), bodies=None, cell=CELL):
    """Water below the plane through (0, 0, place) that moves at a speed [m/s] along its normal: the Water, what its
    nodes hold after DT, by the fluxes along the edges, by what the surface sweeps, and exactly."""
    normal = np.asarray(normal, float) / np.linalg.norm(normal)
    mesh = box_mesh(np.zeros(3), size, cell)
    domain = cut_domain(mesh, ConvexBodies.empty() if bodies is None else bodies, "single")
    at = (domain.nodes - place * UPWARDS) @ normal
    water = Water(mesh, domain, at, WaterParameters(), velocity=speed * normal * np.ones((len(at), 1)))
    water.level_set, t = at, water.topology
    velocity = np.tile(speed * normal, (len(t.cells), 1))
    nodes = np.flatnonzero(t.active)
    flux = edge_flux(t, water.graph_for(nodes), nodes, velocity, nodal_volume(t, at))
    along, total = carry_volume(flux, DT)
    more = swept(t, flux, at, np.tile(speed * normal, (len(at), 1)), total, DT)
    # what comes in and goes out through the sides of the tank, which the nodes below and above do not see
    return water, along, along + more, nodal_volume(t, at - speed * DT)


def beside(water, reach=1.5):
    """Nodes near the surface, whose hats end on no side that it moves across."""
    x, top = water.topology.nodes, water.topology.nodes[:, 2].max()
    return (np.abs(water.level_set) < reach * CELL) & (x[:, 2] > 0.0) & (x[:, 2] < top)


@pytest.mark.parametrize("place", [0.8, 0.95, 1.0, 1.13])
@pytest.mark.parametrize("speed", [-3.0, 0.4, 5.0])
def test_a_level_surface_that_rises_brings_every_node_what_a_plane_does(place, speed):
    """On the sides of the tank too, where the fluxes along the edges miss by a tenth of what comes."""
    water, along, found, exact = rising(UPWARDS, speed, place)
    near = beside(water)
    came = DT * abs(speed) * CELL**2
    assert np.abs(found - exact)[near].max() < 2e-3 * came
    assert np.abs(along - exact)[near].max() > 0.03 * came


@pytest.mark.parametrize(("place", "speed"), [(1.02, -5.0), (0.98, 5.0)], ids=["sinks", "rises"])
def test_a_level_surface_that_passes_a_layer_of_nodes_within_the_step(place, speed):
    """Cells beyond that layer, all wet or all dry at the start, are cut by its end."""
    water, _, found, exact = rising(UPWARDS, speed, place)
    assert np.abs(found - exact)[beside(water)].max() < 2e-2 * DT * abs(speed) * CELL**2


@pytest.mark.parametrize("height", [6.0, 8.0])
def test_it_is_exact_on_slender_cells(height):
    """Where corners of a cell at the surface are farther from it than three cell sizes, what comes from below counts as
    it does elsewhere: all of it was taken back."""
    cell = CELL * np.array([1.0, 1.0, height])
    size = (0.75, 0.5, 6.0 * cell[2])
    water, _, found, exact = rising(UPWARDS, 0.5, 3.95 * cell[2], size, cell=cell)
    inner = np.abs(water.topology.nodes[:, 2] - 3.0 * cell[2]) < 1.5 * cell[2]
    came = DT * 0.5 * CELL**2
    assert np.abs(found - exact)[inner].max() < 1e-9 * came


def test_what_is_swept_is_kept():
    """Along edges: what one node gets, another one gives."""
    _, along, found, _ = rising([0.3, 0.2, 1.0], 0.7, 0.9)
    assert (found - along).sum() == pytest.approx(0.0, abs=1e-15)
    assert np.abs(found - along).max() > 1e-5


def test_nothing_changes_deep_in_the_water():
    water, along, found, _ = rising([0.3, 0.2, 1.0], 0.5, 0.9, size=(1.5, 1.0, 2.0))
    deep = np.abs(water.level_set) > 3.0 * CELL
    np.testing.assert_array_equal(found[deep], along[deep])
    assert (found != along)[~deep].any()


@pytest.mark.parametrize("place", [0.8, 0.95, 1.13])
@pytest.mark.parametrize("speed", [-0.7, 0.7])
def test_it_is_exact_in_cells_that_a_wall_cuts(place, speed):
    """A wall along the way of the water, slantwise through cells; by the fluxes nodes miss a tenth of what comes."""
    turn = np.array([[0.9, -np.sqrt(0.19), 0.0], [np.sqrt(0.19), 0.9, 0.0], [0.0, 0.0, 1.0]])
    wall = ConvexBodies.boxes([[0.7, 0.5, 1.0]], [[0.3, 4.0, 4.0]], [turn])
    water, along, found, exact = rising(UPWARDS, speed, place, size=(1.5, 1.0, 2.0), bodies=wall)
    near = beside(water) & water.topology.near_solids & water.topology.active
    came = DT * abs(speed) * CELL**2
    assert water.topology.beside_solid[near].any()
    assert np.abs(found - exact)[near].max() < 2e-3 * came
    assert np.abs(along - exact)[near].max() > 0.1 * came


def test_a_column_that_rises_stays_level():
    """Ten steps of a slug in a tube: without it the surface is tilted by a fiftieth of its way."""
    mesh = box_mesh(np.zeros(3), (0.5, 0.5, 3.0), CELL)
    domain = cut_domain(mesh, ConvexBodies.empty(), "single")
    start = np.zeros((len(domain.nodes), 3))
    start[:, 2] = 0.5

    def fill(x):
        return np.maximum(0.7 - x[:, 2], x[:, 2] - 1.8)

    def out(normal, centre):
        return np.abs(normal[:, 2]) > 0.5

    water = Water(mesh, domain, fill, WaterParameters(gravity=1e-6, kick_limit=1e12), out, velocity=start)
    for _ in range(10):
        advance(water, 0.01)
    x, phi = water.topology.nodes, water.level_set
    for height in np.unique(x[:, 2].round(6)):
        layer = phi[(np.abs(x[:, 2] - height) < 1e-6) & (np.abs(phi) < 1.5 * CELL)]
        assert len(layer) == 0 or np.ptp(layer) < 1e-4 * 0.05
