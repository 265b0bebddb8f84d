"""Manning's friction: streams find depth and velocity of his formula, U = d^(2/3) S^(1/2) / n, by themselves."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.mesh.refinement import InBox, refined_mesh
from fluid.sides.inflow import Side, Sides
from fluid.sides.waves import steady
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.viscous.columns import Columns
from fluid.viscous.wall_friction import WallFriction
from tests.fluid.scenes import advance

DRY = ConvexBodies.empty()


def is_across(normal, _):
    return np.abs(normal[:, 1]) > 0.5


def means(water, columns_across=2):
    """Depth and velocity (nx, 3) over the columns along x."""
    c = Columns.of(water, water.level_set, water.velocity)
    return c.depth.reshape(-1, columns_across).mean(axis=1), c.velocity.reshape(-1, columns_across, 3).mean(
        axis=1
    )


@pytest.mark.parametrize("cells", [4, 8])
def test_drive_along_the_bed_ends_at_the_velocity_of_the_formula(cells):
    """A full channel of depth 1 whose weight points along it with 0.05 g. Without mixing the water above the lowest
    cells gets faster and faster (it ran into the cap of the speed, 1.4 times this)."""
    n, drive = 0.5, 1.0
    mesh = box_mesh(np.zeros(3), [0.5, 1 / cells, 1.0], 1 / cells)
    settings = WaterParameters(
        walls="friction", manning=n, gravity=drive, down=(1, 0, 0), suction="unlimited"
    )
    ends = lambda normal, _: np.abs(normal[:, 0]) > 0.5  # noqa: E731
    water = Water(mesh, cut_domain(mesh, DRY), lambda x: x[:, 2] - 100.0, settings, ends, is_across)
    for _ in range(120):
        advance(water, 0.1)
    _, u = means(water, 1)
    np.testing.assert_allclose(u[:, 0], 1.0 / n, rtol=0.02)


@pytest.mark.parametrize("step", [0.01, 1.0, 100.0])
def test_the_bed_takes_what_a_step_of_any_length_leaves_of_the_stream(step):
    """A pool of 0.75 m at 2 m/s: U' + dt C_f U'^2/d = 2 m/s with C_f = g n^2/d^(1/3), n = 0.05."""
    mesh = box_mesh(np.zeros(3), [1.0, 0.5, 1.0], 0.25)
    settings = WaterParameters(walls="friction", manning=0.05)
    water = Water(mesh, cut_domain(mesh, DRY), lambda x: x[:, 2] - 0.75, settings)
    u = np.tile([2.0, 0.0, 0.0], (len(water.level_set), 1))
    columns = WallFriction.of(settings).columns(water, water.level_set, u, step)
    drag = settings.gravity * 0.05**2 / 0.75 ** (4 / 3)
    left = columns.velocity[:, 0]
    np.testing.assert_allclose(left + step * drag * left**2, 2.0, rtol=1e-9)
    np.testing.assert_allclose(columns.left, 0.5 * left, rtol=1e-9)


@pytest.mark.parametrize("levels", [0, 2])
def test_the_depth_is_that_of_the_water_on_cells_of_several_sizes(levels):
    """A pool of 1 m at 2 m/s on cells most of which are finer, which make the columns: coarse ones straddle several of
    them, and where each counted in the one of its centre, depths were 0.67 to 1.33 m."""
    mesh = box_mesh(np.zeros(3), [8.0, 8.0, 2.0], 0.5)
    if levels:
        mesh = refined_mesh(mesh, [InBox((1, 1, 0), (7, 7, 2), levels)])
    settings = WaterParameters(walls="friction", manning=0.03)
    water = Water(mesh, cut_domain(mesh, DRY), lambda x: x[:, 2] - 1.0, settings)
    u = np.tile([2.0, 0.0, 0.0], (len(water.level_set), 1))
    friction = WallFriction.of(settings)
    columns = friction.columns(water, water.level_set, u, 0.0)
    drag = friction.of_nodes(water, water.level_set, columns, u)
    floor = (mesh.nodes[:, 2] == 0.0) & (np.abs(mesh.nodes[:, :2] - 4.0) < 4.0).all(axis=1)
    stress = 1000.0 * settings.gravity * 0.03**2 * 2.0
    np.testing.assert_allclose(drag[floor], stress * mesh.boundary_of_nodes[floor], rtol=1e-7)
    mixing = friction.mixing(water, columns, np.flatnonzero((water.level_set[mesh.cells] < 0.0).any(axis=1)))
    np.testing.assert_allclose(mixing, mixing.mean(), rtol=1e-7)


def stream(start, until, manning, slope=0.1, cell=0.25, length=16.0):
    """Water that comes onto a plane with the depth 1/start and leaves it freely: velocity of the formula for the depth
    1 at n = 0.06 times `start`, so that its discharge is the same."""
    u = np.sqrt(slope) / 0.06
    fitted = fitted_mesh((0, 0, -slope * length), (length, 2 * cell, 1.6), cell, lambda x, _: -slope * x)
    mesh = fitted.mesh
    side = Side.of(mesh, lambda normal, _: normal[:, 0] < -0.5, steady((1, 0, 0), 1.0 / start, start * u))
    settings = WaterParameters(walls="friction", manning=manning)
    leaves = lambda normal, _: (normal[:, 2] > 0.999) | (normal[:, 0] > 0.5)  # noqa: E731
    fill = lambda x: x[:, 2] + slope * x[:, 0] - 1.0 / start  # noqa: E731
    water = Water(mesh, cut_domain(mesh, DRY), fill, settings, leaves, is_across, Sides([side]))
    water.velocity[:] = np.where(
        water.level_set[:, None] < 2 * cell, [[start * u, 0, -slope * start * u]], 0.0
    )
    time = 0.0
    while time < until:
        dt = min(water.stable_step(), 0.1)
        advance(water, dt)
        time += dt
    return *means(water), u


def test_stream_down_a_plane_runs_at_normal_depth():
    """On a mesh that fits the plane; Froude number 1.7, so what it does is not said at its end. Without friction it
    has 1.27 times this velocity there after 3 s, and goes on."""
    depth, u, formula = stream(0.9, 5.0, 0.06)
    there = slice(-12, -4)
    assert depth[there].mean() == pytest.approx(1.0, rel=0.03)
    assert u[there, 0].mean() == pytest.approx(formula, rel=0.035)


def test_beds_of_several_kinds_rub_where_they_are():
    """n as a function of the place: half of the bed rough, the other half smooth."""
    mesh = box_mesh(np.zeros(3), [2, 0.25, 1], 0.125)
    settings = WaterParameters(walls="friction", manning=lambda x, y: np.where(x < 1.0, 0.06, 0.03))
    water = Water(mesh, cut_domain(mesh, DRY), lambda x: x[:, 2] - 0.5, settings)
    u = np.tile([1.0, 0.0, 0.0], (len(water.topology.nodes), 1))
    friction = water.viscous.friction
    drag = friction.of_nodes(water, water.level_set, friction.columns(water, water.level_set, u, 0.0), u)
    x = water.topology.nodes[:, 0]
    rough, smooth = drag[x < 0.9].sum() / 0.9, drag[x > 1.1].sum() / 0.9
    assert rough == pytest.approx(4.0 * smooth, rel=0.1)


HOUSE = ([2.0, 2.0, 1.0], [1.8, 1.8, 3.0])
"""Centre and size [m]: covers four fifths of the width of the columns at its sides, on cells of 0.5 m."""


def depths(mesh, solids, level, covers="multiple"):
    """Depth (n,) [m] in Manning's law of the cells that hold still water up to the level [m], and the Water."""
    centre, size = zip(*solids)
    domain = cut_domain(mesh, ConvexBodies.boxes(centre, size), covers)
    settings = WaterParameters(walls="friction", manning=0.03)
    water = Water(mesh, domain, lambda x: x[:, 2] - level, settings)
    wet = (water.level_set[water.topology.cells] < 0.0).any(axis=1)
    columns = Columns.of(water, water.level_set, np.zeros((len(water.level_set), 3)))
    return columns.over(np.flatnonzero(wet))[0], water


@pytest.mark.parametrize("covers", ["single", "multiple"])
@pytest.mark.parametrize("levels", [0, 1])
@pytest.mark.parametrize("bed", [0.0, 0.35])
@pytest.mark.parametrize("level", [0.93, 1.5])
def test_the_depth_beside_a_house_is_that_of_the_water(level, bed, levels, covers):
    """Over the whole area of the columns it was 0.3 and 0.54 m beside the house in water of 1.5 m. The bed is a solid
    that cuts the lowest cells."""
    mesh = box_mesh(np.zeros(3), [4.0, 4.0, 2.0], 0.5)
    if levels:
        mesh = refined_mesh(mesh, [InBox((0, 0, 0), (1.9, 4, 2), levels)])
    solids = [HOUSE, ([2.0, 2.0, bed - 1.0], [9.0, 9.0, 2.0])]
    found, _ = depths(mesh, solids if bed else solids[:1], level, covers)
    np.testing.assert_allclose(found, level - bed, rtol=1e-6)


def test_friction_beside_a_house_is_that_of_open_water():
    """The drag on the floor over its area is the same everywhere; it was up to 44 % larger at the house."""
    mesh = box_mesh(np.zeros(3), [4.0, 4.0, 2.0], 0.5)
    _, water = depths(mesh, [HOUSE], 1.5)
    friction = water.viscous.friction
    u = np.tile([2.0, 0.0, 0.0], (len(water.level_set), 1))
    columns = friction.columns(water, water.level_set, u, 0.0)
    drag = friction.of_nodes(water, water.level_set, columns, u)
    area = np.linalg.norm(water.walls.rough_area, axis=1)[water.walls.rough_area[:, 2] < 0.0].sum()
    assert area == pytest.approx(16.0 - 1.8**2)
    assert drag.sum() / area == pytest.approx(1000.0 * 9.81 * 0.03**2 / 1.5 ** (1 / 3) * 2.0, rel=1e-6)


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 0.8), (1.2, 2.5), (1.1, 1.4)], ids=["roof under water", "block afloat", "deck"]
)
def test_columns_with_water_above_or_below_a_solid_have_its_mean_depth(low, high):
    """1.5 m less what a solid takes of the column: nowhere is the depth that of the part beside it."""
    mesh = box_mesh(np.zeros(3), [4.0, 4.0, 2.0], 0.5)
    found, _ = depths(mesh, [([2.0, 2.0, 0.5 * (low + high)], [1.8, 1.8, high - low])], 1.5)
    covered = np.array(
        [0.0, 0.8, 0.64, 1.0]
    )  # of columns away from it, at a side, at a corner, over or under it
    np.testing.assert_allclose(
        np.unique(found.round(6)), np.unique((1.5 - covered * (min(high, 1.5) - low)).round(6))
    )


def test_a_column_with_next_to_no_open_area_keeps_its_depth():
    """A house that ends 1e-6 of a cell before the next column."""
    mesh = box_mesh(np.zeros(3), [4.0, 4.0, 2.0], 0.5)
    found, _ = depths(mesh, [([2.0, 2.0, 1.0], [2.0 - 1e-6, 2.0 - 1e-6, 3.0])], 1.5)
    np.testing.assert_allclose(found, 1.5, rtol=1e-4)


@pytest.mark.parametrize(
    ("there", "factor"), [(2.0, 0.5), (1.0, 1.0), (0.5, 2.0), (0.25, 4.0), (0.1, 4.0), (0.0, 4.0)]
)
def test_the_stress_of_a_stream_is_put_on_water_at_the_bed_that_has_a_quarter_of_its_speed_at_least(
    there, factor
):
    """τ = ρ C_f |U| U is linear in u at the bed: C_f |U|²/|u| has no bound where that water stands."""
    friction = WallFriction(None, 0.03, 1000.0, 9.81)
    one = np.ones(1)
    found = friction._bed(2.0 * one, 0.1, np.zeros((1, 3)), one, there * one)
    assert found == pytest.approx(factor * 9.81 * 0.03**2 / 2.0 ** (1.0 / 3.0))
