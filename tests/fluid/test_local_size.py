"""Step, films, depths, bands and limits go by the cells at hand: coarse cells far from the water change nothing.

The mean cell of the graded meshes here is up to three times as large as the cells that the water sees."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.graph import Graph
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.surface.volume import edge_flux
from fluid.transport.volume_transport import carry_volume
from tests.fluid.scenes import advance, column

FINE, NEAR, FAR = 0.05, 0.9, 0.8
GRADES = [2, 4, 8]


def graded(times):
    """A tank 1.7 m long: cells of 5 cm to x = 0.9 m, `times` as long and as high as that beyond and above."""
    x = np.concatenate([np.arange(0, 19) * FINE, NEAR + np.arange(1, 17 // times + 1) * FINE * times])
    z = np.concatenate([np.arange(0, 13) * FINE, 0.6 + np.arange(1, 17 // times + 1) * FINE * times])
    return box_mesh(None, None, axes=(x, np.arange(0, 4) * FINE, z))


def wall():
    """A thin plate, tilted, in the way of the water."""
    return ConvexBodies.boxes([[0.6, 0.075, 0.1]], [[0.02, 0.09, 0.3]])


def run(times, steps=12, covers="single", **parameters):
    """For eleven steps the two agree to 1e-13 m/s; from then on the correction of the volume, which reaches three cells
    ahead of the water, acts on the coarse cells."""
    mesh = graded(times)
    water = Water(mesh, cut_domain(mesh, wall(), covers), column(0.3, 0.4), WaterParameters(**parameters))
    for _ in range(steps):
        advance(water)
    return water


@pytest.fixture(scope="module")
def uniform():
    return {covers: run(1, covers=covers) for covers in ("single", "multiple")}


@pytest.mark.parametrize("times", GRADES)
@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_a_dam_break_is_the_same_beside_coarse_cells(uniform, times, covers):
    one, other = uniform[covers], run(times, covers=covers)
    assert other.mesh.spacing > 1.1 * one.mesh.spacing
    assert other.time == pytest.approx(one.time, rel=1e-4)
    near = [(w.topology.nodes < [0.8, 1.0, 0.5]).all(axis=1) for w in (one, other)]
    assert near[0].sum() == near[1].sum() > 500
    np.testing.assert_allclose(other.nodal_water[near[1]], one.nodal_water[near[0]], atol=1.5e-3 * FINE**3)
    # two cells above the surface the velocity is a continuation of a continuation; nothing is carried from there; at
    # one node of the front, 2 m/s fast, the momentum that goes with the correction differs by a hundredth
    seen = np.all([w.level_set[n] < 1.5 * FINE for w, n in zip((one, other), near)], axis=0)
    np.testing.assert_allclose(other.velocity[near[1]][seen], one.velocity[near[0]][seen], atol=2e-2)
    np.testing.assert_allclose(other.pressure[near[1]], one.pressure[near[0]], rtol=5e-3, atol=10.0)


@pytest.mark.parametrize("times", GRADES)
def test_the_step_is_that_of_the_cells_that_the_water_crosses(times):
    """At rest by the cells at the surface, in motion by the cell that is crossed soonest, not by the mean cell."""
    mesh = graded(times)
    water = Water(mesh, cut_domain(mesh, ConvexBodies.empty(), "single"), column(0.3, 0.4), WaterParameters())
    assert water.stable_step() == pytest.approx(0.3 * np.sqrt(FINE / 9.81))
    water.velocity[water.level_set < 0.0] = [5.0, 0.0, 0.0]
    assert water.stable_step() == pytest.approx(water.parameters.courant * FINE / 5.0)


def test_a_uniform_mesh_has_one_size_to_the_bit():
    mesh = box_mesh((0, 0, 0), (1.3, 0.7, 0.4), 0.1)
    assert (mesh.local_size == mesh.spacing).all()
    assert (mesh.node_size == mesh.spacing).all()
    assert mesh.finest == mesh.spacing
    np.testing.assert_array_equal(mesh.size_at([[0.5, 0.5, 0.2], [9.0, 0.0, 0.0]]), mesh.spacing)


def test_water_carried_through_finer_cells_does_not_pile_up():
    """A stream through a full tank with a few finer cells: substeps go by the finer nodes, of an eighth of the median
    volume or less, too, which held up to 1.9 times what they can."""
    mesh = refined_mesh(
        box_mesh((0, 0, 0), (2, 1, 1), 0.125), [InBox((0.9, 0.45, 0.45), (1.1, 0.55, 0.55), levels=2)]
    )
    water = Water(mesh, cut_domain(mesh, ConvexBodies.empty()), lambda x: x[:, 2] - 10.0)
    t, stream = water.topology, np.broadcast_to([1.0, 0.5, 0.25], (len(mesh.cells), 3)).copy()
    listed = np.arange(len(t.nodes))
    flux = edge_flux(t, Graph.of(t, listed), listed, stream, t.node_volume.copy())
    carried, _ = carry_volume(flux, 0.06)
    inner = (np.abs(t.nodes - [1, 0.5, 0.5]) < 0.3).all(axis=1)
    assert (carried / t.node_volume)[inner].max() < 1.0 + 1e-9
