"""The momentum of the water closes every step: what its cells get from the pressure is what sides and bodies give, to
round-off and with arms, whatever cuts the cells; the rest is shown by name."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.numerics.sums import about
from fluid.sides.inflow import Side, Sides
from fluid.sides.waves import steady
from fluid.step.momentum import NUMERICAL, PHYSICAL, momentum
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance, column, load, rotation, tank

RHO, G = 1000.0, 9.81
SIZE = [1, 0.5, 0.5]


def tilted_boxes():
    """One box on the floor and through a side, one thinner than a cell, both turned."""
    R = rotation([1, 2, 0.5], 0.4)
    centre, size = [[0.63, 0.45, 0.1], [0.4, 0.2, 0.3]], [[0.2, 0.3, 0.33], [0.1, 0.02, 0.3]]
    return ConvexBodies.boxes(np.array(centre), np.array(size), np.array([R, R.T]))


def scale_of(change):
    """Size of the impulses that act on the water in a step [N s]."""
    return sum(np.linalg.norm(change.lines[name][:3]) for name in PHYSICAL)


def missing(water):
    """Share of the impulses of the last step that the lines miss, linear or angular (arms are below 1 m)."""
    change = water.report.momentum
    assert set(change.lines) == {*PHYSICAL, *NUMERICAL}
    residual = change.after - change.before - sum(change.lines.values())
    np.testing.assert_allclose(change.after, momentum(water), rtol=1e-12, atol=1e-12 * scale_of(change))
    return max(np.abs(residual).max(), np.abs(change.pressure_closure).max()) / scale_of(change)


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_dam_break_against_tilted_boxes_closes(covers):
    water = tank(SIZE, 0.0625, column(0.5, 0.4), tilted_boxes(), covers=covers)
    for _ in range(30):
        problem, x = advance(water)
        assert missing(water) < 1e-13
        reported = about(water.reference, load(problem, x), water.domain.body_centre)
        np.testing.assert_allclose(water.report.momentum.lines["bodies"], -problem.dt * reported, rtol=1e-12)
    assert np.abs(reported).max() > 1.0, "the water has not reached the boxes"


def test_moving_bodies_close():
    """A box driven through the surface and turned: the fields are handed to new cuts, the books go on from there."""
    mesh = box_mesh(np.zeros(3), SIZE, 0.0625)
    box = ConvexBodies.boxes(np.array([[0.5, 0.25, 0.3]]), np.array([[0.2, 0.15, 0.1]]))
    water = Water(mesh, cut_domain(mesh, box), lambda x: x[:, 2] - 0.23, WaterParameters())
    motion = np.array([0.3, 0.1, -0.5, 0.0, 2.0, 1.0])
    place, R, dt = np.array([0.5, 0.25, 0.3]), np.eye(3), 0.01
    for _ in range(12):
        place, R = place + dt * motion[:3], rotation(motion[3:], dt * np.linalg.norm(motion[3:])) @ R
        water.move_solids(cut_domain(mesh, box.moved(place[None], R[None]), previous=water.domain))
        advance(water, dt, motion)
        assert missing(water) < 1e-13


def test_still_water_is_carried_by_its_tank():
    """Weight and floor in balance, with no moment, and nothing else: no line of the scheme acts at rest."""
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.437)
    for _ in range(4):
        advance(water, 0.01)
    lines = water.report.momentum.lines
    weight = 0.01 * RHO * G * 0.437
    np.testing.assert_allclose(lines["weight"], [0, 0, -weight, 0, 0, 0], atol=1e-8 * weight)
    np.testing.assert_allclose(lines["tank"], [0, 0, weight, 0, 0, 0], atol=1e-8 * weight)
    assert max(np.abs(lines[name]).max() for name in NUMERICAL) < 1e-8 * weight


def test_without_a_surface_the_scheme_adds_nothing_to_the_pressure():
    """A box shaken in a full closed tank: nodes get exactly what the cells get, linear and angular."""
    box = ConvexBodies.boxes(np.array([[0.53, 0.27, 0.21]]), np.array([[0.3, 0.2, 0.15]]))
    water = tank(SIZE, 0.0625, lambda x: np.full(len(x), -1.0), box)
    rate = 5.0 * np.array([1.0, 0.5, -0.3, 2.0, 0.0, 1.0])
    dt, bodies = 0.005, 0.0
    for k in range(3):
        advance(water, dt, (k + 1) * dt * rate, rtol=1e-10)
        lines = water.report.momentum.lines
        bodies = np.linalg.norm(lines["bodies"][:3])
        np.testing.assert_allclose(lines["surface"], 0.0, atol=1e-10 * scale_of(water.report.momentum))
    assert bodies > 0.01


@pytest.mark.parametrize(
    "walls", [{"viscosity": 1.0, "walls": "no-slip"}, {"walls": "friction", "roughness": 0.01}]
)
def test_wall_shear_is_shared_by_bodies_and_sides(walls):
    """What viscosity takes out of the water, bodies and sides get, as far as its linear solver goes (1e-7). What acts
    beyond the surface acts on the nodes beside it, with a moment that differs by up to 2 % of the shear."""
    water = tank(SIZE, 0.0625, column(0.5, 0.4), tilted_boxes(), **walls)
    largest = 0.0
    for _ in range(20):
        advance(water)
        assert missing(water) < 1e-13
        lines = water.report.momentum.lines
        shear = np.linalg.norm(lines["tank_shear"][:3])
        largest = max(largest, shear)
        assert np.abs(lines["shear_solve"][:3]).max() < 1e-5 * max(shear, 1e-3)
        assert np.abs(lines["shear_solve"][3:]).max() < (0.02 if "viscosity" in walls else 1e-5) * max(
            shear, 1e-3
        )
    assert largest > 1e-3


def test_what_goes_through_sides_is_booked():
    """A stream through the tank: inflow brings ρ q u, the sea takes it; the rest closes as before."""
    mesh = box_mesh(np.zeros(3), [1, 0.25, 0.5], 0.0625)
    left = Side.of(mesh, lambda n, c: n[:, 0] < -0.5, steady((1.0, 0.0, 0.0), 0.3, 0.5))
    right = Side.of(mesh, lambda n, c: n[:, 0] > 0.5, level=lambda t: 0.3)
    domain = cut_domain(mesh, ConvexBodies.empty())
    water = Water(mesh, domain, lambda x: x[:, 2] - 0.3, WaterParameters(), sides=Sides([left, right]))
    for _ in range(20):
        problem, _ = advance(water, 0.01)
        assert missing(water) < 1e-12
    brought = problem.predicted.through[water.topology.nodes[:, 0] == 0.0].sum()
    assert brought == pytest.approx(0.01 * 0.3 * 0.25 * 0.5, rel=0.03)


def test_water_that_falls_out_takes_its_momentum_and_energy_along():
    water = tank(SIZE, 0.0625, column(0.5, 0.4), None, lambda n, c: n[:, 0] > 0.5)
    left = energy = 0.0
    for _ in range(60):
        advance(water)
        assert missing(water) < 1e-13
        left, energy = left + water.report.left, energy + water.report.left_energy
    assert water.report.momentum.lines["sides"][0] < 0.0
    assert left == pytest.approx(water.initial_volume - water.conserved_volume, rel=1e-9)
    assert energy > 0.5 * RHO * left, "it leaves with more than a metre a second"
