"""Gauges read what is there: a pool at rest has its level, its pressure and its volume everywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.point_location import Outside
from fluid.pressure.projection import with_ghosts
from fluid.readings import gauges
from fluid.readings.at_surface import Around, Found, _read
from fluid.readings.clip import clipped, volumes
from tests.fluid.scenes import advance, column, load, rotation, tank


@pytest.fixture(scope="module")
def pool():
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437)
    advance(water, 0.01)
    return water


def test_level(pool):
    for xy in ([0.5, 0.5], [0.01, 0.99], [0.0, 0.0], [1.0, 0.3]):
        assert abs(gauges.level(pool, xy) - 0.437) < 1e-9


def test_pressure_at_depth_and_in_the_air(pool):
    p = gauges.pressure(pool, [[0.3, 0.4, 0.1], [0.3, 0.4, 0.9]])
    np.testing.assert_allclose(p, [9810 * 0.337, 0.0], rtol=1e-6)


def test_air_has_neither_pressure_nor_velocity():
    """Also within the cells that the surface cuts, whose lower nodes have both."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437)
    advance(water, 0.01)
    water.velocity[:] = [1.0, 0.0, 0.0]
    points = np.array([[0.3, 0.4, 0.43], [0.3, 0.4, 0.44], [0.3, 0.4, 0.49]])
    assert gauges.pressure(water, points)[0] > 0.0
    np.testing.assert_array_equal(gauges.pressure(water, points)[1:], 0.0)
    np.testing.assert_allclose(gauges.velocity(water, points)[:, 0], [1.0, 0.0, 0.0], rtol=1e-12)


def test_pressure_up_to_the_surface(pool):
    """Interpolated between the last node under water and the air at the next, it was up to a quarter of a cell of water
    too high."""
    z = np.linspace(0.3, 0.4369, 30)
    places = np.column_stack([np.full_like(z, 0.31), np.full_like(z, 0.43), z])
    np.testing.assert_allclose(gauges.pressure(pool, places), 9810 * (0.437 - z), atol=1e-5)


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize(("angle", "depth"), [(0.83, 0.44), (0.4, 0.35), (1.1, 0.52)])
def test_pressure_at_the_water_line_on_a_block(angle, depth, covers):
    """Nodes inside the block that lie under the surface, but have only air around them, have no pressure of their
    own."""
    block = ConvexBodies.boxes([[0.6, 0.5, 0.3]], [[0.7, 3.0, 0.3]], [rotation([0, 1, 0], angle)])
    water = tank([1.25, 0.25, 1], 0.125, lambda x: x[:, 2] - depth, block, covers=covers)
    advance(water, 0.01)
    random = np.random.default_rng(1)
    places = random.uniform((0.0, 0.0, depth - 0.125), (1.25, 0.25, depth), (1000, 3))
    found = gauges.pressure(water, places)
    free = np.isfinite(found)
    assert free.sum() > 300
    np.testing.assert_allclose(found[free], 9810 * (depth - places[free, 2]), atol=1e-4)


def test_pressure_goes_on_to_dry_nodes_as_for_the_gradient():
    """Both make it from the pressures of the cells around a dry node, in different loops."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437 - 0.05 * x[:, 0])
    wet, random = water.level_set < 0.0, np.random.default_rng(2)
    water.pressure[:] = np.where(wet, 1e4 * (1.0 + random.random(len(wet))), 0.0)
    t, phi, air = water.topology, water.level_set, np.zeros(len(wet))
    cut = np.flatnonzero(wet[t.cells].any(axis=1)).astype(np.uint32)
    ghosts = with_ghosts(water.pressure, air, wet, water.walls.open_node, phi, cut, t.cells, t.volume)
    dry = np.flatnonzero(~wet & np.isin(np.arange(len(wet)), t.cells[cut]))
    around = Around(t.node_start, t.node_cells, t.cells, t.volume)
    found = Found(water.pressure, air, phi, np.zeros(len(wet), bool), water.walls.open_node)
    corners = np.stack([dry, *3 * [np.full(len(dry), np.flatnonzero(wet)[0])]], axis=1)
    deep = water.pressure[corners[:, 1]]
    read = _read(corners, np.tile([-1.0, 1.0, 0.0, 0.0], (len(dry), 1)), found, around)
    np.testing.assert_allclose(deep - read, ghosts[dry], rtol=1e-12, atol=1e-9)
    assert len(dry) > 50


def test_no_pressure_below_that_of_the_air_beside_it():
    """Where the pressure rises unevenly with the depth, it would be continued to less at the surface."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437)
    water.pressure[:] = np.where(
        water.level_set < 0.0, 1e4 * np.random.default_rng(2).random(len(water.pressure)), 0.0
    )
    places = np.random.default_rng(3).uniform((0, 0, 0.376), (1, 1, 0.437), (500, 3))
    found = gauges.pressure(water, places)
    assert found.min() == 0.0
    assert found.max() > 1e3


def test_velocity_at_rest(pool):
    assert np.abs(gauges.velocity(pool, [[0.3, 0.4, 0.1]])).max() < 1e-9


def test_depth_over_a_sloping_bed_reaches_down_to_it():
    """Between the samples too: without, up to a sample's distance of it was missing."""
    from coupler.step.immersion import Immersion
    from fluid.mesh.fitted_mesh import fitted_mesh
    from fluid.step.parameters import WaterParameters
    from fluid.step.water import Water

    mesh = fitted_mesh((0, 0, -1), (4, 2, 1), 0.5, lambda x, y: 0.37 * x - 0.93).mesh
    water = Water(
        mesh, Immersion(mesh, None, [], "single").domain, lambda x: x[:, 2] - 0.31, WaterParameters()
    )
    places = np.random.default_rng(1).uniform((0.1, 0.1), (2.5, 1.9), (40, 2))
    depth = gauges.levels(water, places)
    np.testing.assert_allclose(depth, 0.31 - (0.37 * places[:, 0] - 0.93), atol=3e-4)
    for xy, wanted in zip(places[:5], depth):
        assert gauges.level(water, xy) == pytest.approx(wanted, abs=1e-12), "alone as among others"


@pytest.mark.parametrize("cell", [0.5, 0.25, 0.125])
@pytest.mark.parametrize("top", [0.51, 0.6, 0.63, 0.75])
def test_depth_over_a_solid_begins_at_its_top(cell, top):
    """On planes of nodes and between them: a twentieth of a cell inside the solid was counted as well."""
    box = ConvexBodies.boxes([[0.5, 0.5, 0.5 * top]], [[0.6, 0.6, top]])
    water = tank([1, 1, 1.5], cell, lambda x: x[:, 2] - 1.26, box)
    depth = gauges.levels(water, [[0.41, 0.53], [0.05, 0.07]])
    np.testing.assert_allclose(depth, [1.26 - top, 1.26], atol=1e-9)


@pytest.mark.parametrize("thickness", [0.005, 0.02, 0.1, 0.3])
@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_depth_over_and_under_a_plate(thickness, covers):
    """Every face of it counted a twentieth of a cell too much; plates thinner than two of these were overlooked."""
    plate = ConvexBodies.boxes([[0.5, 0.5, 0.42]], [[0.6, 0.6, thickness]])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.81, plate, covers=covers)
    assert gauges.level(water, (0.51, 0.47)) == pytest.approx(0.81 - thickness, abs=1e-9)


@pytest.mark.parametrize("angle", [0.05, 0.5, 1.2])
def test_depth_through_an_inclined_plate(angle):
    """A line leaves out of it its thickness over the cosine of the angle."""
    plate = ConvexBodies.boxes([[0.5, 0.5, 0.4]], [[0.4, 2.0, 0.07]], [rotation([0, 1, 0], angle)])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.9, plate)
    assert gauges.level(water, (0.51, 0.47)) == pytest.approx(0.9 - 0.07 / np.cos(angle), abs=1e-9)


def test_depth_beside_stacked_blocks_and_over_them():
    """The joint between two blocks is no water, and along an upright face a line runs in the water."""
    stack = ConvexBodies.boxes([[0.5, 0.5, 0.15], [0.5, 0.5, 0.42]], [[0.4, 0.4, 0.3], [0.4, 0.4, 0.24]])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.81, stack)
    depth = gauges.levels(water, [[0.5, 0.5], [0.3, 0.5], [0.302, 0.5], [0.298, 0.5], [0.31, 0.5]])
    np.testing.assert_allclose(depth, [0.27, 0.81, 0.81, 0.81, 0.27], atol=1e-9)


@pytest.mark.parametrize("lean", [0.01, -0.01])
def test_a_line_that_is_nowhere_deep_in_a_leaning_wall_runs_beside_it(lean):
    """Up to 4 mm behind its faces on either side, less than a twentieth of a cell: as if the wall stood upright. A line
    that gets 14 mm deep has no water."""
    wall = ConvexBodies.boxes([[0.5, 0.5, 0.4]], [[0.2, 2.0, 1.2]], [rotation([0, 1, 0], lean)])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.81, wall)
    depth = gauges.levels(water, [[0.4, 0.5], [0.6, 0.5], [0.41, 0.5], [0.59, 0.5]])
    np.testing.assert_allclose(depth, [0.81, 0.81, 0.0, 0.0], atol=1e-9)


def test_depth_on_a_solid_over_a_sloping_bed():
    """Down to the bed where the line passes no solid, and from the bed up to one that floats close above it."""
    from fluid.mesh.fitted_mesh import fitted_mesh
    from fluid.step.parameters import WaterParameters
    from fluid.step.water import Water

    mesh = fitted_mesh((0, 0, -1), (4, 2, 1), 0.5, lambda x, y: 0.37 * x - 0.93).mesh
    boxes = ConvexBodies.boxes([[1.0, 1.0, -0.4], [2.5, 1.0, 0.125]], [[0.6, 0.6, 0.2], [0.6, 0.6, 0.15]])
    water = Water(mesh, cut_domain(mesh, boxes), lambda x: x[:, 2] - 0.31, WaterParameters())
    bed = 0.37 * np.array([0.3, 1.1, 2.5]) - 0.93
    depth = gauges.levels(water, [[0.3, 0.4], [1.1, 0.9], [2.5, 1.1]])
    np.testing.assert_allclose(depth, 0.31 - bed - [0.0, 0.2, 0.15], atol=3e-4)


@pytest.mark.parametrize("behind", [0.01, 0.04, 0.3])
def test_depth_from_a_foot_on_begins_there(behind):
    """The top of a solid that stands on the floor, up to a twentieth of a cell behind its side, where a line runs
    beside it: found to a ten-thousandth of a cell, an absorbing sea drove still water at 20 µm/s."""
    solid = ConvexBodies.boxes([[0.5, 0.5, 0.315]], [[0.6, 0.6, 0.63]])
    water = tank([1, 1, 1.5], 0.25, lambda x: x[:, 2] - 1.26, solid)
    depth = gauges.levels(water, [[0.2 + 0.25 * behind, 0.5], [0.1, 0.5]], np.array([0.63, 0.0]))
    np.testing.assert_allclose(depth, [0.63, 1.26], atol=1e-12)


def test_depth_from_the_bed_on_is_exact_where_the_bed_is_known():
    from fluid.mesh.fitted_mesh import fitted_mesh
    from fluid.step.parameters import WaterParameters
    from fluid.step.water import Water

    mesh = fitted_mesh((0, 0, -1), (4, 2, 1), 0.5, lambda x, y: 0.37 * x - 0.93).mesh
    water = Water(mesh, cut_domain(mesh, ConvexBodies.empty()), lambda x: x[:, 2] - 0.31, WaterParameters())
    places = np.random.default_rng(1).uniform((0.1, 0.1), (2.5, 1.9), (40, 2))
    bed = 0.37 * places[:, 0] - 0.93
    np.testing.assert_allclose(gauges.levels(water, places, bed), 0.31 - bed, atol=1e-12)


def test_level_is_the_wet_length():
    """A sheet of water in the air over a pool counts with its thickness, not with its height."""
    water = tank([1, 1, 1], 0.125, lambda x: np.minimum(x[:, 2] - 0.3, np.abs(x[:, 2] - 0.75) - 0.19))
    assert abs(gauges.level(water, (0.51, 0.32)) - 0.68) < 0.01


def test_volume_of_all_and_of_a_half(pool):
    np.testing.assert_allclose(gauges.volume_in_box(pool, [0, 0, 0], [1, 1, 1]), 0.437, rtol=1e-9)
    np.testing.assert_allclose(gauges.volume_in_box(pool, [0, 0, 0], [0.5, 1, 1]), 0.437 / 2, rtol=1e-9)


def test_gauge_outside_the_tank_is_refused(pool):
    with pytest.raises(Outside, match=r"\(2, 0.5, 0.5\) m.* outside the mesh of the tank.*under the bed"):
        gauges.pressure(pool, [[2.0, 0.5, 0.5]])


def test_pressure_on_the_face_of_a_solid():
    """A gauge on the wall of a box that is flush with cell faces reads the water, one inside reads nothing."""
    box = ConvexBodies.boxes(np.array([[0.5, 0.5, 0.25]]), np.array([[0.5, 0.5, 0.5]]))
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.8, box)
    advance(water, 0.01)
    for x in (0.25, 0.75):
        np.testing.assert_allclose(gauges.pressure(water, [x, 0.5, 0.3]), 9810 * 0.5, rtol=1e-6)
    assert np.isnan(gauges.pressure(water, [0.5, 0.5, 0.25]))


@pytest.mark.parametrize("thickness", [0.01, 0.05])
@pytest.mark.parametrize("place", [0.5, 0.53, 0.5625])
def test_gauges_read_their_own_side_of_a_wall_thinner_than_a_cell(place, thickness):
    """Two pools, 0.65 m and 0.35 m deep. The cells that the wall cuts in two hold both; a sensor on its face, one close
    to it, a level gauge and a flow meter read the pool that they are in, and in the middle of the wall is nothing."""
    low, high = place - 0.5 * thickness, place + 0.5 * thickness
    wall = ConvexBodies.boxes(np.array([[place, 0.5, 0.5]]), np.array([[thickness, 2.0, 2.0]]))
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.35, wall, covers="multiple")
    left = np.zeros(len(water.level_set), bool)
    left[water.domain.cells[water.domain.centroid[:, 0] < place]] = True
    depth = np.where(left, 0.65, 0.35)
    water.level_set[:] = water.topology.nodes[:, 2] - depth
    water.pressure[:] = np.maximum(-9810 * water.level_set, 0.0)
    water.velocity[:] = np.where(left, 2.0, -1.0)[:, None]
    for x, deep, u in (
        (low, 0.65, 2.0),
        (low - 0.03, 0.65, 2.0),
        (high, 0.35, -1.0),
        (high + 0.03, 0.35, -1.0),
    ):
        for y in (0.5, 0.3, 0.41):  # on mesh planes and off them
            assert gauges.pressure(water, [x, y, 0.25]) == pytest.approx(9810 * (deep - 0.25))
        assert gauges.level(water, (x, 0.41)) == pytest.approx(deep, abs=1e-9)
        across = gauges.flux(water, [x, 0.5, 0.1], [[0, 0.3, 0], [0, 0, 0.1]])
        assert across == pytest.approx(0.03 * u)
    if thickness > 0.02:  # else its middle counts as on its face
        assert np.isnan(gauges.pressure(water, [place, 0.3, 0.25]))


def test_a_gauge_inside_a_block_smaller_than_a_cell_reads_nothing():
    """No cell lies wholly inside it; its own faces say where it is."""
    block = ConvexBodies.boxes(np.array([[0.5, 0.5, 0.3]]), np.array([[0.1, 0.1, 0.1]]))
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.8, block)
    assert np.isnan(gauges.pressure(water, [0.5, 0.5, 0.3]))
    assert np.isnan(gauges.velocity(water, [0.5, 0.5, 0.26])).all()
    assert gauges.level(water, (0.5, 0.5)) == pytest.approx(0.7, abs=1e-9)
    assert gauges.level(water, (0.6, 0.5)) == pytest.approx(0.8)


def test_pressure_read_is_the_pressure_that_acts():
    """The nodal pressure summed over the wetted faces of a box is the load on it, also while a front hits it and
    the pressures of start and end of the step differ: a gauge must not read more than the structure feels."""
    box = ConvexBodies.boxes(np.array([[0.75, 0.25, 0.2]]), np.array([[0.2, 0.5, 0.4]]))
    water = tank([1, 0.5, 0.5], 0.0625, column(0.5, 0.4), box)
    largest = 0.0
    for _ in range(40):
        problem, x = advance(water)
        acted = problem.load(water.pressure[problem.dofs] - problem.known)
        np.testing.assert_allclose(acted, load(problem, x), rtol=1e-9, atol=1e-9)
        largest = max(largest, np.abs(water.end_pressure - water.pressure).max())
    assert largest > 100.0, "the scene has no impact in which the two could be confused"


def streaming(velocity, level=0.437):
    """A pool that moves as one, as its state has it."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - level)
    water.velocity[:] = velocity
    return water


@settings(max_examples=20, deadline=None)
@given(st.tuples(*[st.floats(-2, 2)] * 3), st.floats(0.05, 0.9))
def test_uniform_flow_through_a_plane(velocity, level):
    """u·n times the wet area, wherever the surface crosses the patch; velocity at a point is the velocity."""
    water = streaming(velocity, level)
    across = gauges.flux(water, [0.4, 0.5, 0.5], [[0, 0.6, 0], [0, 0, 0.9]])
    wet = min(max(level - 0.05, 0.0), 0.9) * 0.6
    assert across == pytest.approx(velocity[0] * wet, abs=1e-9)
    np.testing.assert_allclose(gauges.velocity(water, [0.3, 0.3, 0.04]), velocity, atol=1e-12)


def test_flux_through_a_slanted_plane_counts_its_projection():
    water = streaming((1.0, 0.0, 0.0), 0.9)
    slanted = gauges.flux(water, [0.5, 0.5, 0.4], [[0.3, 0.4, 0.0], [0, 0, 0.5]])
    assert slanted == pytest.approx(0.4 * 0.5, rel=1e-12)


@pytest.mark.parametrize("top", [0.1875, 0.2, 0.25, 0.27])
@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_flux_over_a_sill_begins_at_its_top(top, covers):
    """Wherever the top lies in the cells, and whether the patch ends above it, at it or within the sill."""
    sill = ConvexBodies.boxes(np.array([[0.5, 0.5, 0.5 * top]]), np.array([[0.3, 2.0, top]]))
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437, sill, covers=covers)
    water.velocity[:] = [1.5, 0.0, 0.0]
    for low in (0.0, 0.11, top, 0.3):
        across = gauges.flux(water, [0.47, 0.5, 0.5 * (low + 1.0)], [[0, 1, 0], [0, 0, 1.0 - low]])
        assert across == pytest.approx(1.5 * (0.437 - max(low, top)), rel=1e-6)


def test_flux_over_a_sloping_bed_begins_at_it():
    """The patch may reach below the bed, which lies between any two points at which one could look."""
    from coupler.step.immersion import Immersion
    from fluid.mesh.fitted_mesh import fitted_mesh
    from fluid.step.parameters import WaterParameters
    from fluid.step.water import Water

    mesh = fitted_mesh((0, 0, -1), (4, 2, 1), 0.5, lambda x, y: 0.37 * x - 0.93).mesh
    water = Water(
        mesh, Immersion(mesh, None, [], "single").domain, lambda x: x[:, 2] - 0.31, WaterParameters()
    )
    water.velocity[:] = [2.0, 0.0, 0.0]
    for x in np.random.default_rng(1).uniform(0.1, 2.5, 10):
        across = gauges.flux(water, [x, 0.9, 0.0], [[0, 1.3, 0], [0, 0, 1.9]])
        assert across == pytest.approx(2.0 * 1.3 * (0.31 - (0.37 * x - 0.93)), rel=1e-6)
    with pytest.raises(Outside):
        gauges.flux(water, [9.0, 0.9, 0.0], [[0, 1.3, 0], [0, 0, 1.9]])


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0.0, 0.97), min_size=3, max_size=3), st.floats(0.02, 0.6), st.floats(0.1, 0.9))
def test_volume_in_any_box_under_a_flat_surface(lower, edge, level):
    water = tank([1, 1, 1], 0.25, lambda x: x[:, 2] - level)
    level = gauges.level(water, (0.5, 0.5))  # not to the last digit where the surface runs through nodes
    upper = np.minimum(np.add(lower, edge), 1.0)
    deep = max(min(upper[2], level) - lower[2], 0.0)
    exact = (upper[0] - lower[0]) * (upper[1] - lower[1]) * deep
    assert gauges.volume_in_box(water, np.array(lower), upper) == pytest.approx(exact, abs=1e-7)


def test_boxes_that_share_a_border_share_the_water():
    """A tilted surface and a box in the tank: the parts add up to what the tank holds, whatever cuts what."""
    box = ConvexBodies.boxes(np.array([[0.52, 0.5, 0.25]]), np.array([[0.3, 0.4, 0.5]]))
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.4 - 0.3 * x[:, 0], box)
    cut = 0.531
    left = gauges.volume_in_box(water, [0, 0, 0], [cut, 1, 1])
    right = gauges.volume_in_box(water, [cut, 0, 0], [1, 1, 1])
    assert left + right == pytest.approx(water.volume(), rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.floats(0.0, 0.97), min_size=3, max_size=3), st.floats(0.02, 0.6), st.floats(0.1, 0.9))
def test_volume_in_any_box_beside_a_solid(lower, edge, level):
    """What the box and the solid have in common is taken out, wherever both end inside the same cells."""
    low, high = np.array([0.37, 0.29, 0.0]), np.array([0.71, 0.66, 0.55])
    solid = ConvexBodies.boxes([(low + high) / 2], [high - low])
    water = tank([1, 1, 1], 0.25, lambda x: x[:, 2] - level, solid)
    lower, upper = np.array(lower), np.minimum(np.add(lower, edge), [1.0, 1.0, level])
    common = np.minimum(upper, high) - np.maximum(lower, low)
    exact = np.maximum(upper - lower, 0.0).prod() - np.maximum(common, 0.0).prod()
    if lower[2] >= level:
        exact = 0.0
    assert gauges.volume_in_box(water, lower, np.add(lower, edge)) == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_volume_beside_a_slanting_solid(covers):
    """A square of half a diagonal of 0.31 m on edge: beyond x = 0.6 m it takes a triangle of 0.21² m² of the box."""
    solid = ConvexBodies.boxes(
        [[0.5, 0.5, 0.5]], [[0.31 * 2**0.5] * 2 + [2.0]], [rotation([0, 0, 1], np.pi / 4)]
    )
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437, solid, covers=covers)
    found = gauges.volume_in_box(water, [0.6, 0, 0.1], [1, 1, 1])
    assert found == pytest.approx((0.4 - 0.21**2) * 0.337, rel=1e-9)


def test_parts_of_a_clipped_cell_fill_it():
    """Volumes of both sides of a random plane, and the mean of a value that is carried along."""
    rng = np.random.default_rng(3)
    tets = rng.normal(size=(50, 4, 4))
    v = tets[:, :, :3] @ rng.normal(size=3) - 0.2
    one, other = clipped(tets, v), clipped(tets, -v)
    assert volumes(one).sum() + volumes(other).sum() == pytest.approx(volumes(tets).sum(), rel=1e-12)
    whole, parts = (float(volumes(t) @ t[:, :, 3].mean(axis=1)) for t in (tets, np.concatenate([one, other])))
    assert parts == pytest.approx(whole, rel=1e-9)
