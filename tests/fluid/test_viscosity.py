"""Viscosity and walls: exact flows, momentum handed to bodies to round-off, and nothing of it where nobody asked."""

import subprocess
import sys

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.readings import gauges
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.surface.extrapolation import extend_velocity
from fluid.viscous.beyond import Beyond
from fluid.viscous.columns import Columns
from fluid.viscous.kernels import momentum_rate
from fluid.viscous.viscosity import Viscosity
from fluid.viscous.wall_friction import WallFriction, log_law
from tests.fluid.scenes import advance, rotation, tank

DENSITY = 1000.0


def full(x):
    """Fill: everything is water."""
    return x[:, 2] - 100.0


def channel(n, cut=None, viscosity=100.0, length=0.25, **parameters):
    """A channel of height 1 along x, open at its ends, driven by "gravity" along x; its walls are sides of the tank or
    bodies that cut the cells at `cut` of a cell."""
    ends = lambda normal, _: np.abs(normal[:, 0]) > 0.5  # noqa: E731
    sides = lambda normal, _: np.abs(normal[:, 1]) > 0.5  # noqa: E731
    height, foot, bodies = 1.0, 0.0, ConvexBodies.empty()
    if cut is not None:
        height, foot = 1.0 + 4.0 / n, (1.0 + cut) / n
        bodies = ConvexBodies.boxes([[0.0, 0.0, foot + 2.0], [0.0, 0.0, foot - 1.0]], [[4.0, 4.0, 2.0]] * 2)
    mesh = box_mesh(np.zeros(3), [length, 1.0 / n, height], 1.0 / n)
    settings = {"walls": "no-slip", "gravity": 1.0, "down": (1, 0, 0), "viscosity": viscosity} | parameters
    # the pressure is that of the air all along: on which side of it round-off lies is no part of the tests
    settings = {"suction": "unlimited"} | settings
    water = Water(mesh, cut_domain(mesh, bodies), full, WaterParameters(**settings), ends, sides)
    return water, foot


@pytest.mark.parametrize("cut", [None, 0.01, 0.37, 0.9])
def test_steady_channel_flow_on_any_cut(cut):
    """u = G z (1 - z)/(2ν) wherever the walls lie in their cells; the walls carry the whole drive."""
    n = 8
    water, foot = channel(n, cut)
    for _ in range(80):
        problem, _ = advance(water, 0.1)
    z = np.linspace(0.05, 0.95, 10)
    at = np.column_stack([np.full(10, 0.1), np.full(10, 0.5 / n), foot + z])
    u = gauges.velocity(water, at)
    # nodes on the sides of the tank give the parabola at nodes, so that lines between them miss 1/8 (h/H)^2 8 = 1.6 %
    np.testing.assert_allclose(u[:, 0], 5.0 * z * (1 - z), atol=0.02 * 1.25)
    assert np.abs(u[:, 1:]).max() < 0.01
    if cut is not None:
        np.testing.assert_allclose(problem.other_load[:, 0].sum(), DENSITY * 0.25 / n, rtol=2e-3)


def test_a_steady_flow_does_not_depend_on_the_step():
    """Transport and pressure are the source of the viscous stage; one after the other would be off by 5 % here."""
    found = []
    for dt in (0.05, 0.2):
        water, _ = channel(8)
        for _ in range(round(10 / dt)):
            advance(water, dt)
        found.append(water.velocity[:, 0].max())
    np.testing.assert_allclose(found[0], found[1], rtol=1e-3)
    np.testing.assert_allclose(found, 1.25, rtol=2e-2)  # eight cells


def test_vortices_decay_at_the_exact_rate_with_second_order():
    """Taylor and Green: velocities fall as exp(-2 ν k² t) between smooth walls; gravity must not matter."""
    errors = [_vortex_error(n, steps) for n, steps in ((8, 3), (16, 6))]
    assert errors[1] < 0.01
    assert np.log2(errors[0] / errors[1]) > 1.8


def _vortex_error(n, steps, nu=0.05, k=np.pi):
    water = tank([1, 1 / n, 1], 1 / n, full, viscosity=DENSITY * nu)
    x, end = k * water.topology.nodes, 0.25 / (nu * k**2)
    water.velocity[:, 0] = 0.2 * np.sin(x[:, 0]) * np.cos(x[:, 2])
    water.velocity[:, 2] = -0.2 * np.cos(x[:, 0]) * np.sin(x[:, 2])
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    exact = water.velocity * np.exp(-2 * nu * k**2 * end)
    for _ in range(steps):
        advance(water, end / steps)
    square = water.nodal_water @ ((water.velocity - exact) ** 2).sum(axis=1)
    return np.sqrt(square / (water.nodal_water @ (exact**2).sum(axis=1)))


def turned_box(walls, **parameters):
    """A box at an odd angle in a half-full tank whose sides are smooth, and velocities without any order."""
    turn = rotation([1, 2, 3], 0.7)
    box = ConvexBodies.boxes(np.array([[0.5, 0.45, 0.4]]), np.array([[0.3, 0.25, 0.2]]), np.array([turn]))
    mesh = box_mesh(np.zeros(3), [1, 1, 1], 0.125)
    settings = WaterParameters(walls=walls, **parameters)
    water = Water(
        mesh, cut_domain(mesh, box), lambda x: x[:, 2] - 0.53, settings, None, lambda n, _: n[:, 0] < 9
    )
    water.body_velocity[0] = [0.3, -0.2, 0.1, 0.5, 1.0, -0.7]
    u = np.random.default_rng(1).normal(0, 1, water.velocity.shape)
    return water, u


@pytest.mark.parametrize(
    ("walls", "more"),
    [("no-slip", {"viscosity": 20.0}), ("friction", {"viscosity": 0.0, "roughness": 0.01})],
)
def test_what_the_water_loses_the_body_gets(walls, more):
    """Force and moment, to round-off, at random velocities: rigid motions have no stress and the hats sum to one."""
    water, u = turned_box(walls, **more)
    stage = Viscosity(water.parameters)
    terms = stage._terms(water, water.level_set, DENSITY * water.nodal_water, u, 0.1)
    free = terms._replace(
        held=np.zeros(0, np.int64),
        projector=np.zeros((0, 3, 3)),
        idle=np.zeros(len(u), bool),
        beyond=Beyond.none(),  # to hand forces on keeps them, but not their moments
    )
    rate, load = momentum_rate(free, u, water.body_velocity)
    arm = water.topology.nodes - water.domain.body_centre[0]
    lost = -np.concatenate([rate.sum(axis=0), np.cross(arm, rate).sum(axis=0)])
    np.testing.assert_allclose(load[0], lost, rtol=1e-10, atol=1e-10 * np.abs(load).max())
    assert np.abs(load).max() > 1e-3


def test_friction_leaves_nodes_alone_that_hold_next_to_no_water():
    """Dry corners of wet cells with 1e-14 of the water they have room for: their hats at the wet points of rough walls
    are small, and with a share in the friction they ran a hundred times faster than any water."""
    water, _ = turned_box("friction", roughness=0.1)
    water.body_velocity[:] = 0.0
    u = np.tile([3.0, 2.0, -1.0], (len(water.level_set), 1))
    water.velocity[:] = u
    held = np.where(water.level_set < 0.0, water.nodal_water, 1e-14 * water.topology.node_volume)
    change = Viscosity(water.parameters).change(water, water.level_set, held, u, 0.1).change
    speed = np.linalg.norm(u + change, axis=1)
    assert speed.max() <= 1.01 * np.linalg.norm(u[0])
    assert speed.min() < 0.9 * np.linalg.norm(u[0])


def test_the_form_is_positive_on_any_cut():
    """Viscous and wall stress only take energy, for any velocity and on slivers: -u·r(u) > 0 where the body rests."""
    water, u = turned_box("no-slip", viscosity=20.0)
    water.body_velocity[:] = 0.0
    terms = Viscosity(water.parameters)._terms(water, water.level_set, DENSITY * water.nodal_water, u, 0.1)
    for seed in range(20):
        u = np.random.default_rng(seed).normal(0, 1, u.shape)
        rate, _ = momentum_rate(terms, u, water.body_velocity)
        assert (u * rate).sum() < 0.0


def test_plane_that_slides_drags_the_water_along():
    """Couette: a wall that moves in its own plane, cut through the cells; the steady profile is a straight line."""
    n = 8
    water, foot = channel(n, 0.37, gravity=0.01)  # its drive bends the line by a known, small parabola
    water.body_velocity[0, 0] = 0.2
    for _ in range(80):
        problem, _ = advance(water, 0.1)
    z = np.linspace(0.1, 0.9, 5)
    u = gauges.velocity(water, np.column_stack([np.full(5, 0.1), np.full(5, 0.5 / n), foot + z]))
    np.testing.assert_allclose(u[:, 0], 0.2 * z + 0.05 * z * (1 - z), atol=2e-3)
    shear, drive = 100 * 0.2, DENSITY * 0.01
    np.testing.assert_allclose(
        problem.other_load[:, 0] * n / 0.25, [-shear + drive / 2, shear + drive / 2], rtol=1e-2
    )


def test_water_at_rest_stays_at_rest_with_viscosity():
    box = ConvexBodies.boxes(np.array([[0.5, 0.45, 0.4]]), np.array([[0.3, 0.25, 0.2]]))
    water = tank(
        [1, 1, 1], 0.125, lambda x: x[:, 2] - 0.53, box, viscosity=1.0, walls="friction", roughness=1e-3
    )
    for _ in range(20):
        advance(water, 0.01)
    assert np.abs(water.velocity).max() < 1e-8


def test_bed_of_manning_slows_a_uniform_stream_as_its_law_says():
    """du/dt = -g n² u²/d^(4/3) for the mean velocity of a stream that does not vary along the tank."""
    n, depth, u0, dt = 0.03, 0.5, 1.0, 0.02
    ends = lambda normal, _: np.abs(normal[:, 0]) > 0.5  # noqa: E731
    smooth = lambda normal, _: np.abs(normal[:, 1]) > 0.5  # noqa: E731
    mesh = box_mesh(np.zeros(3), [1, 0.25, 1], 0.125)
    settings = WaterParameters(walls="friction", manning=n)
    water = Water(
        mesh,
        cut_domain(mesh, ConvexBodies.empty()),
        lambda x: x[:, 2] - depth - 1e-6,
        settings,
        ends,
        smooth,
    )
    u = np.where(water.level_set[:, None] < 0.2, [[u0, 0, 0]], 0.0)
    water.velocity[:] = u
    change = water.viscous.change(water, water.level_set, water.nodal_water, u, dt)
    mean = (water.nodal_water @ change.change)[0] / water.nodal_water.sum()
    assert mean == pytest.approx(-dt * 9.81 * n**2 * u0**2 / depth ** (4 / 3), rel=0.02)
    np.testing.assert_allclose(Columns.of(water, water.level_set, u).depth, depth, rtol=1e-4)


def test_mannings_law_is_that_of_the_bed_alone():
    """Sides that stand upright have no depth over them: drag on the nodes of the floor, none on the others."""
    water = tank([1, 0.25, 1], 0.125, lambda x: x[:, 2] - 0.5, walls="friction", manning=0.03)
    friction = WallFriction.of(WaterParameters(walls="friction", manning=0.03))
    u = np.tile([1.0, 0.0, 1.0], (len(water.topology.nodes), 1))
    drag = friction.of_nodes(water, water.level_set, friction.columns(water, water.level_set, u, 0.0), u)
    floor = water.topology.nodes[:, 2] < 1e-9
    assert drag[floor].min() > 0.0
    assert np.abs(drag[~floor]).max() == 0.0


def test_log_law_between_known_walls():
    """Half a metre off a wall of 3 mm sand: u/u* = ln(1 + 0.5/1e-4)/0.41 = 20.8."""
    assert 1 / np.sqrt(log_law(0.5, 3e-3)) == pytest.approx(np.log(5001) / 0.41)


@pytest.mark.parametrize("cell", [0.125, 0.0625])
def test_rough_bed_takes_the_stress_of_the_profile_on_any_cells(cell):
    """A stream with the profile u*/0.41 ln(z/z0), nodes holding its mean over their hats: the bed takes ρ u*² from it.

    With the velocity taken for that at half a cell the stress is a quarter low."""
    depth, friction_speed, roughness, dt = 0.5, 0.05, 3e-3, 1e-4
    ends = lambda normal, _: np.abs(normal[:, 0]) > 0.5  # noqa: E731
    smooth = lambda normal, _: np.abs(normal[:, 1]) > 0.5  # noqa: E731
    mesh = box_mesh(np.zeros(3), [1, 0.25, 1], cell)
    settings = WaterParameters(walls="friction", roughness=roughness)
    fill = lambda x: x[:, 2] - depth - 1e-6  # noqa: E731
    water = Water(mesh, cut_domain(mesh, ConvexBodies.empty()), fill, settings, ends, smooth)
    z, z0 = water.topology.nodes[:, 2], roughness / 30
    of_bed = np.log(cell / z0) - 1.5
    profile = np.where(z > 0.5 * cell, np.log(np.maximum(z, cell) / z0), of_bed) * friction_speed / 0.41
    water.velocity[:, 0] = np.where(water.level_set < 0.2, profile, 0.0)
    change = water.viscous.change(water, water.level_set, water.nodal_water, water.velocity.copy(), dt)
    taken = (water.nodal_water @ change.change)[0] / dt  # per density; over a bed of 0.25 m²
    assert taken == pytest.approx(-(friction_speed**2) * 0.25, rel=0.01)


def test_shear_along_a_bed_is_not_carried_on_into_the_air():
    """A film of two layers of nodes, slow on the bed: the air above must not run faster than the water, or the tip of
    the film takes that speed over (1.8 times the water's, with slopes taken from the cells on the bed)."""
    cell = 0.125
    smooth = lambda normal, _: np.abs(normal[:, 1]) > 0.5  # noqa: E731
    mesh = box_mesh(np.zeros(3), [2, 0.25, 1], cell)
    settings = WaterParameters(walls="friction", roughness=3e-3)
    fill = lambda x: np.maximum(x[:, 2] - 1.5 * cell, x[:, 0] - 1.3)  # noqa: E731
    water = Water(mesh, cut_domain(mesh, ConvexBodies.empty()), fill, settings, None, smooth)
    wet = water.level_set < 0.0
    cells = np.flatnonzero(wet[water.topology.cells].any(axis=1))
    speed = np.where(water.topology.nodes[:, 2] < 0.5 * cell, 0.6, 1.0)

    def fastest(rubbed):
        u = np.where(wet[:, None], speed[:, None] * [1.0, 0.0, 0.0], 0.0)
        layers = water.listed, water.layer_start
        extend_velocity(
            water.topology, layers, wet, cells, u, np.zeros_like(u), 0.0, np.full_like(u, np.inf), rubbed
        )
        return u[:, 0].max()

    assert fastest(water.nodes_at_rough_walls()) == pytest.approx(1.0, abs=1e-12)
    assert fastest(None) > 1.5


def test_friction_needs_one_law():
    for roughness, manning in ((None, None), (1e-3, 0.02)):
        with pytest.raises(ValueError, match="roughness or manning"):
            WallFriction.of(WaterParameters(walls="friction", roughness=roughness, manning=manning))


def test_smooth_water_without_viscosity_loads_none_of_it():
    """Absent means absent: neither module is imported by a step of plain water."""
    code = (
        "import sys\n"
        "from tests.fluid.scenes import advance, column, tank\n"
        "water = tank([1, 0.5, 1], 0.25, column(0.5, 0.5))\n"
        "advance(water)\n"
        "assert water.viscous is None and water.sides is None\n"
        "print(*[m for m in sys.modules if m.startswith('fluid.')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(done.stdout.split())
    viscous = {"viscous.viscosity", "viscous.kernels", "viscous.wall_friction", "transport.landing"}
    assert "fluid.step.water" in loaded
    assert loaded & {f"fluid.{name}" for name in viscous | {"sides.inflow", "sides.waves"}} == set()


def test_water_that_falls_wets_a_floor_without_slip():
    """A thick slab falls on a floor without slip and spreads. Air slips there: with u = 0 in the air, too, the edge of
    the water never came forth, the slab lay on its rim with air below (0.72 of its extent one cell higher), and what
    fell there without end gave the water more energy than it had."""
    water = tank(
        [0.8, 0.3, 0.5],
        0.05,
        lambda x: np.maximum(np.abs(x[:, 2] - 0.15) - 0.08, np.abs(x[:, 0] - 0.4) - 0.2),
        viscosity=5.0,
        walls="no-slip",
    )
    while water.time < 0.43:
        advance(water)
    wet, height = water.level_set < 0.0, water.topology.nodes[:, 2]
    on_floor, above = (wet & (np.abs(height - z) < 1e-9) for z in (0.0, 0.05))
    assert on_floor.sum() > 0.85 * above.sum()
    np.testing.assert_array_equal(water.velocity[on_floor], 0.0)
