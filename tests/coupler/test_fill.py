"""Where the water stands at the start, from boxes of a case."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler.geometry.start_surfaces import StartSurface
from coupler.scene.fill import _side, merged, start_level, start_velocity
from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance

TANK = ((0.0, 0.0, 0.0), (1.0, 0.5, 0.5))
CELL = 0.125


def water_in(boxes):
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, ConvexBodies.empty())
    return Water(mesh, domain, start_level(boxes, TANK, mesh, domain), WaterParameters())


@pytest.mark.parametrize("seam", [0.5, 0.5 * CELL])
def test_boxes_that_touch_are_one_pool(seam):
    """The distance to both is zero on the face that they share: taken as a surface, the water falls apart there."""
    halves = [((0.0, 0.0, 0.0), (seam, 0.5, 0.3)), ((seam, 0.0, 0.0), (1.0, 0.5, 0.3))]
    water, whole = water_in(halves), water_in([((0.0, 0.0, 0.0), (1.0, 0.5, 0.3))])
    assert water.volume() == pytest.approx(whole.volume(), rel=1e-12)
    for _ in range(10):
        advance(water)
    assert np.abs(water.velocity).max() < 1e-9


def test_a_sliver_beside_a_solid_counts_to_the_side_on_which_it_mostly_lies():
    """Nodes whose cells a solid leaves next to nothing on either side of the surface, more below it or more above."""
    faces = SimpleNamespace(
        edge=np.full(2, CELL), at_water_line=lambda ending, *_: np.zeros(len(ending), bool)
    )
    low, high, cut = np.array([-2e-6, -1e-6]) * CELL, np.array([1e-6, 2e-6]) * CELL, np.ones(2, bool)
    below, above = _side(np.zeros(2), low, high, cut, cut, faces)
    assert below == -np.inf
    assert above > 0.0


def test_a_tank_full_of_water_has_no_surface():
    mesh = box_mesh(*TANK, CELL)
    level = start_level([TANK], TANK, mesh, cut_domain(mesh, ConvexBodies.empty()))
    np.testing.assert_array_equal(level, -1.0)


def test_boxes_on_top_of_each_other_keep_their_own_surfaces():
    """A step of two boxes: water to 0.25 m over one half, to 0.375 m over the other; only the seam goes."""
    low, high = ((0.0, 0.0, 0.0), (1.0, 0.5, 0.25)), ((0.0, 0.0, 0.25), (0.5, 0.5, 0.375))
    assert water_in([low, high]).volume() == pytest.approx(0.125 + 0.03125, rel=0.03)


@pytest.mark.parametrize("seam", [0.3, 1.0 / 3.0, 0.3125, 0.1 + 0.2, 0.5])
def test_where_boxes_touch_makes_no_difference_to_the_water(seam):
    """Between nodes too: the level beside the seam is that of one box."""
    parts = [((0.0, 0.0, 0.0), (seam, 0.4, 0.2)), ((seam, 0.0, 0.0), (0.75, 0.4, 0.2))]
    whole = water_in([((0.0, 0.0, 0.0), (0.75, 0.4, 0.2))])
    np.testing.assert_array_equal(water_in(parts).level_set, whole.level_set)


@pytest.mark.parametrize(
    "box",
    [
        ((0.0, 0.0, 0.0), (0.5, 0.5, 0.25)),
        ((0.5, 0.0, 0.0), (1.0, 0.5, 0.25)),
        ((0.25, 0.125, 0.125), (0.75, 0.375, 0.375)),
    ],
)
def test_a_box_between_planes_of_nodes_holds_its_volume(box):
    """Give or take a third of half a brick along the edges that the diagonal of the bricks runs across, which had been
    lost whole: 6 % of the second box, 29 % of the third."""
    low, high = np.array(box)
    bricks = np.prod((high - low) / CELL)
    lost = {0.0: 0.01, 0.5: 2.0, 0.25: 7.0}[box[0][0]]
    assert water_in([box]).volume() / np.prod(high - low) == pytest.approx(1.0, abs=0.35 * lost / bricks)


def test_boxes_become_one_where_they_fill_one():
    box = ((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    eight = [
        ((x, y, z), (x + 0.5, y + 0.5, z + 0.5)) for x in (0.0, 0.5) for y in (0.0, 0.5) for z in (0.0, 0.5)
    ]
    assert merged(eight, 1e-9) == [box]
    assert merged([box, box, ((0.2, 0.0, 0.0), (1.5, 1.0, 1.0))], 1e-9) == [
        ((0.0, 0.0, 0.0), (1.5, 1.0, 1.0))
    ]
    apart = [box, ((1.1, 0.0, 0.0), (2.0, 1.0, 1.0)), ((1.0, 0.0, 0.0), (1.1, 1.0, 0.5))]
    assert len(merged(apart, 1e-9)) == 3


def test_water_starts_with_the_velocity_of_the_box_that_it_is_in():
    """Of two boxes the one that a node lies in counts, beyond both the nearest; none where all water is at rest."""
    boxes = [((0, 0, 0), (1, 1, 1)), ((2, 0, 0), (3, 1, 1))]
    nodes = np.array([[0.5, 0.5, 0.5], [2.5, 0.5, 0.5], [1.2, 0.5, 0.5], [1.8, 0.5, 0.5], [0.5, 0.5, 4.0]])
    found = start_velocity(boxes, [(3.0, 0.0, -1.0)], nodes)
    np.testing.assert_array_equal(found[:, 0], [3.0, 0.0, 3.0, 0.0, 3.0])
    np.testing.assert_array_equal(found[:, 2], [-1.0, 0.0, -1.0, 0.0, -1.0])
    assert start_velocity(boxes, [(0.0, 0.0, 0.0)], nodes) is None


def test_pools_on_both_sides_of_a_thin_wall_stay_at_levels_in_the_nodes():
    """The lower surface passes through nodes that lie, on the other side of the wall, deep in the higher pool: their
    copies on the low side counted as a seam of the fills, wet up to the higher level, and the low pool rose by 1 %."""
    low, high, wall = 2 * CELL, 3 * CELL, 0.55
    solid = ConvexBodies.boxes(np.array([[wall, 0.25, 0.25]]), np.array([[0.02, 0.502, 0.6]]))
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, solid, "multiple")
    boxes = [((0.0, 0.0, 0.0), (wall, 0.5, high)), ((wall, 0.0, 0.0), (1.0, 0.5, low))]
    level = start_level(boxes, TANK, mesh, domain)
    at = np.flatnonzero(np.isclose(domain.nodes[:, 2], low))
    copies = at[np.isin(domain.parent_node[at], domain.parent_node[at][np.abs(level[at]) < 1e-12])]
    assert set(np.round(level[copies], 9)) == {0.0, round(low - high, 9)}
    water = Water(mesh, domain, level, WaterParameters())
    for _ in range(10):
        advance(water)
    assert np.abs(water.velocity).max() < 1e-7


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_water_around_a_hull_is_at_rest_at_its_lower_edges_too(covers):
    """Four boxes around a hull and one under it end at its faces. Beside its lower edges no side of a box cuts a cell
    short, but nothing in the cells there is dry: taken as surfaces, these sides took a fifth of its buoyancy away."""
    low, high, top = np.array([0.257, 0.154, 0.152]), np.array([0.643, 0.371, 0.6]), 0.33
    solid = ConvexBodies.boxes(0.5 * (low + high)[None], (high - low)[None])
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, solid, covers)
    boxes = [
        ((0.0, 0.0, 0.0), (1.0, 0.5, low[2])),
        ((0.0, 0.0, 0.0), (low[0], 0.5, top)),
        ((high[0], 0.0, 0.0), (1.0, 0.5, top)),
        ((0.0, 0.0, 0.0), (1.0, low[1], top)),
        ((0.0, high[1], 0.0), (1.0, 0.5, top)),
    ]
    water = Water(mesh, domain, start_level(boxes, TANK, mesh, domain), WaterParameters())
    plane = Water(mesh, domain, domain.nodes[:, 2] - top, WaterParameters())
    np.testing.assert_allclose(water.nodal_water, plane.nodal_water, rtol=1e-12, atol=1e-18)
    for _ in range(5):
        advance(water)
    assert np.abs(water.velocity).max() < 1e-8


@pytest.mark.parametrize(
    ("covers", "angle", "above"), [("multiple", 0.5, -0.05), ("multiple", 0.5, 0.05), ("single", 0.5, 0.05)]
)
def test_the_water_line_on_slanting_faces_is_at_rest(covers, angle, above):
    """The surface on a layer of nodes, half way up a beam that is turned about its axis: slivers behind its faces that
    hardly reach below the surface were dry a cell beyond it, others wet above it, and the water moved at 1 m/s."""
    top, (c, s) = 2 * CELL, (np.cos(angle), np.sin(angle))
    turned = np.array([[[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]]])
    solid = ConvexBodies.boxes(np.array([[0.5, 0.27, top + above]]), np.array([[0.3, 0.3, 0.2]]), turned)
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, solid, covers)
    level = start_level([((0.0, 0.0, 0.0), (1.0, 0.5, top))], TANK, mesh, domain)
    water = Water(mesh, domain, level, WaterParameters())
    for _ in range(5):
        advance(water)
    assert np.abs(water.velocity).max() < 1e-7


def sloped(heights, box):
    return StartSurface(heights, np.array(box[0]), np.array(box[1]))


def water_under(heights, boxes, solid=None, covers="single", cell=CELL):
    """Water in boxes that end at one surface, in the tank with fixed bodies or none."""
    mesh = box_mesh(*TANK, cell)
    domain = cut_domain(mesh, ConvexBodies.empty() if solid is None else solid, covers)
    tops = [sloped(heights, box) for box in boxes]
    return Water(mesh, domain, start_level(boxes, TANK, mesh, domain, tops), WaterParameters())


WHOLE = ((0.0, 0.0, 0.0), (1.0, 0.5, 0.3))
HALVES = [((0.0, 0.0, 0.0), (0.43, 0.5, 0.3)), ((0.43, 0.0, 0.0), (1.0, 0.5, 0.3))]


@pytest.mark.parametrize("boxes", [[WHOLE], HALVES], ids=["one", "side by side"])
def test_a_plane_that_is_not_level_has_its_exact_volume(boxes):
    water = water_under(lambda x, y: 0.25 + 0.13 * (x - 0.5) + 0.07 * (y - 0.25), boxes)
    assert water.volume() == pytest.approx(0.125, rel=1e-12)


def test_a_curved_surface_comes_to_its_volume_with_the_square_of_the_cells():
    """η = 0.2 + 0.2 x²: 0.5 (0.2 + 0.2/3) m³."""
    exact = 0.5 * (0.2 + 0.2 / 3.0)
    off = [
        abs(water_under(lambda x, y: 0.2 + 0.2 * x**2, [WHOLE], cell=h).volume() - exact)
        for h in (0.125, 0.0625)
    ]
    assert off[0] < 0.01 * exact
    assert off[1] < 0.35 * off[0]


def test_the_level_under_a_curved_surface_is_a_distance():
    """η = 0.1 + 0.35 x², as steep as 0.7 at x = 1: within a tenth of the distance to the nearest of its points."""
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, ConvexBodies.empty())
    tops = [sloped(lambda x, y: 0.1 + 0.35 * x**2, WHOLE)]
    level = start_level([WHOLE], TANK, mesh, domain, tops)
    x = np.linspace(0.0, 1.0, 4001)
    way = domain.nodes[:, None, [0, 2]] - np.stack([x, 0.1 + 0.35 * x**2], axis=1)
    nearest = np.linalg.norm(way, axis=2).min(axis=1)
    near = (nearest < 0.5 * CELL) & (domain.nodes[:, 0] > 0.5) & (domain.nodes[:, 0] < 1.0)
    assert near.sum() > 5
    np.testing.assert_allclose(np.abs(level[near]), nearest[near], rtol=0.1)


def test_a_surface_from_a_file_that_is_level_stays_level_around_a_hull():
    """As with the level top of a box: nothing moves beside the edges of the hull."""
    low, high, top = np.array([0.257, 0.154, 0.152]), np.array([0.643, 0.371, 0.6]), 0.33
    solid = ConvexBodies.boxes(0.5 * (low + high)[None], (high - low)[None])
    for covers in ("single", "multiple"):
        boxes = [((0.0, 0.0, 0.0), (low[0], 0.5, 0.4)), ((low[0], 0.0, 0.0), (1.0, 0.5, 0.4))]
        water = water_under(lambda x, y: np.full(x.shape, top), boxes, solid, covers)
        plane = Water(water.mesh, water.domain, water.domain.nodes[:, 2] - top, WaterParameters())
        np.testing.assert_allclose(water.nodal_water, plane.nodal_water, rtol=1e-12, atol=1e-18)
        for _ in range(5):
            advance(water)
        assert np.abs(water.velocity).max() < 1e-8


def test_a_box_under_a_slope_and_a_level_one_are_one_pool():
    """A ramp of water that meets a level pool at its height: no seam between them."""
    boxes = [((0.0, 0.0, 0.0), (0.5, 0.5, 0.4)), ((0.5, 0.0, 0.0), (1.0, 0.5, 0.25))]
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, ConvexBodies.empty())
    ramp = sloped(lambda x, y: 0.25 + 0.2 * (0.5 - x), boxes[0])
    water = Water(mesh, domain, start_level(boxes, TANK, mesh, domain, [ramp]), WaterParameters())
    assert water.volume() == pytest.approx(0.125 + 0.5 * 0.5 * 0.05, rel=3e-3)


def test_the_first_mode_of_a_tank_from_a_slope_of_its_surface_swings_in_its_period():
    """ω² = g k tanh(k h), k = π/L; a plane is the first mode but for 1/9 of the third and less."""
    water = water_under(lambda x, y: 0.25 + 0.02 * (x - 0.5), [((0.0, 0.0, 0.0), (1.0, 0.5, 0.3))])
    k = np.pi / 1.0
    period = 2.0 * np.pi / np.sqrt(9.81 * k * np.tanh(k * 0.25))
    steps = int(0.75 * period / 0.01)
    moving = []
    for _ in range(steps):
        advance(water, 0.01)
        moving.append(water.kinetic_energy())
    time, moving = 0.01 * np.arange(1, steps + 1), np.array(moving)
    near = np.abs(time - 0.5 * period) < 0.12 * period
    fit = np.polyfit(time[near], moving[near], 2)  # it comes to rest on the other side after half a period
    assert -0.5 * fit[1] / fit[0] == pytest.approx(0.5 * period, rel=0.03)
    assert moving[near].min() < 0.1 * moving.max()
    assert moving.max() == pytest.approx(
        0.5 * 9810.0 * 0.5 * 0.02**2 / 12.0, rel=0.1
    )  # the potential energy of the slope


@pytest.mark.parametrize("split", ["kuhn", "mirrored"])
@pytest.mark.parametrize(
    ("level", "lower", "thickness"),
    [
        (0.35, 0.34, 0.014),
        (0.35, 0.325, 0.015),
        (0.35, 0.352, 0.012),
        (0.35, 0.28, 0.09),
        (3 * CELL, 0.364, 0.015),
        (3 * CELL, 0.35, 0.02),
        (3 * CELL, 0.379, 0.012),
    ],
    ids=[
        "afloat",
        "under water",
        "over water",
        "thick",
        "on nodes",
        "on nodes under water",
        "on nodes over water",
    ],
)
def test_water_under_a_plate_at_the_surface_is_at_rest(split, level, lower, thickness):
    """The copies of nodes on the lower side of a plate at the surface lie above the water. The surface was taken away
    over the middle of plates some cells wide, but not at their edges, and water moved at 0.1 to 0.5 m/s. On a layer of
    nodes the copies above the plate were wetted through its edges."""
    tank = ((0.0, 0.0, 0.0), (1.0, 1.0, 0.5))
    centre = np.array([[0.51, 0.49, lower + 0.5 * thickness]])
    solid = ConvexBodies.boxes(centre, np.array([[0.77, 0.77, thickness]]))
    mesh = box_mesh(*tank, CELL, split=split)
    domain = cut_domain(mesh, solid, "multiple")
    water = Water(
        mesh, domain, start_level([(tank[0], (1.0, 1.0, level))], tank, mesh, domain), WaterParameters()
    )
    for _ in range(8):
        problem, x = advance(water)
    assert np.abs(water.velocity).max() < 1e-7
    wet = min(max(level - lower, 0.0), thickness)
    assert problem.load(x)[0, 2] == pytest.approx(9810.0 * 0.77**2 * wet, rel=1e-6, abs=1e-6)


@pytest.mark.parametrize("draught", [0.0, 0.05])
def test_water_under_a_light_raft_is_at_rest(draught):
    """Thicker than a cell, with a draught of less: the nodes above its lower face have no other side, as in a plate
    with single covers."""
    tank, level = ((0.0, 0.0, 0.0), (1.0, 1.0, 0.75)), 0.35
    centre = np.array([[0.51, 0.49, level - draught + 0.15]])
    mesh = box_mesh(*tank, CELL)
    domain = cut_domain(mesh, ConvexBodies.boxes(centre, np.array([[0.77, 0.77, 0.3]])))
    water = Water(
        mesh, domain, start_level([(tank[0], (1.0, 1.0, level))], tank, mesh, domain), WaterParameters()
    )
    for _ in range(8):
        advance(water)
    assert np.abs(water.velocity).max() < 1e-7


def test_a_box_that_ends_in_a_closed_lid_has_no_surface_under_it():
    """The lid goes from wall to wall, and no edge of it shows the top of the box."""
    solid = ConvexBodies.boxes(np.array([[0.5, 0.25, 0.36]]), np.array([[1.002, 0.502, 0.03]]))
    mesh = box_mesh(*TANK, CELL)
    domain = cut_domain(mesh, solid, "multiple")
    level = start_level([((0.0, 0.0, 0.0), (1.0, 0.5, 0.35))], TANK, mesh, domain)
    below = np.unique(domain.cells[domain.centroid_of(np.arange(len(domain.cells)))[:, 2] < 0.345])
    assert (level[below] < 0.0).all()
