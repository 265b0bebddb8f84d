"""Lumped slits: against graded plane solutions, at rest, in steady flow; and what openings do that the mesh sees."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.covers import WIDE_OPENINGS
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import Background, box_mesh
from fluid.pressure.slits import Cracks, Slits, conductance
from fluid.step import state
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.plane_reference import released
from tests.fluid.scenes import advance
from tests.fluid.still import RHO_G, forces, pressure

GRAVITY = 9.81
WEIGHT = np.array([0.0, 0.0, -GRAVITY])
DENSITY = RHO_G / GRAVITY
LEVELS = (1.0, 0.5)
CLOSED = 0.375
"""Load on the closed wall in rho g b."""


def slice_mesh(n, seed=0):
    """A slice two cells wide of a unit tank, nodes moved a little except on the sides and on the lower level."""
    h = 1 / n
    box = box_mesh((0, 0, 0), (1, 2 * h, 1), h)
    x = box.nodes.copy()
    move = np.random.default_rng(seed).uniform(-0.15, 0.15, x.shape) * h
    move[(x < 1e-9) | (x > x.max(axis=0) - 1e-9)] = 0
    move[np.abs(x[:, 2] - LEVELS[1]) < 1e-9, 2] = 0
    return Background.from_arrays(x + move, box.cells)


def wall(at, thickness, pieces):
    """Bodies across the slice between the heights (low, high) of every piece."""
    centre = [[at, 0.5, (low + high) / 2] for low, high in pieces]
    return ConvexBodies.boxes(centre, [[thickness, 4, high - low] for low, high in pieces])


def levels(domain, at):
    return np.where(domain.centroid[:, 0] > at, LEVELS[1], LEVELS[0])


def slit_at(domain, at, thickness, height, opening, spacing):
    """The slit of a crack at that height between bodies 0 and 1, through the wall and across the slice."""
    y = domain.memory.mesh.nodes[:, 1].max()
    x = at + np.array([-1, -1, 1, 1]) * thickness / 2
    corners = np.column_stack([x, [0, y, y, 0], np.full(4, height)])
    cracks = Cracks(corners, np.array([0, 4]), np.array([opening]), np.array([[0, 1]]), np.array([7]))
    return Slits.of(domain, cracks, spacing)


def lumped(n, thickness, opening, at=0.52, height=0.27):
    """Force on the wall in rho g b and growth of the flow in g per width, geometry closed and slit lumped."""
    mesh = slice_mesh(n)
    domain = cut_domain(mesh, wall(at, thickness, [(-1, height), (height, 2)]), "multiple")
    slit = slit_at(domain, at, thickness, height, opening, mesh.spacing)
    every = np.arange(len(domain.nodes))
    matrix, _ = slit.pressure_terms(every, np.zeros(len(every)), WEIGHT, 1.0, DENSITY)
    p = pressure(domain, levels(domain, at), matrix * DENSITY)
    width = mesh.nodes[:, 1].max()
    flow = slit.advanced(every, p, WEIGHT, 1.0, DENSITY).flow.sum() / GRAVITY
    return forces(domain, p)[:, 0].sum() / RHO_G / width, flow / width


def opened(n, thickness, pieces, connection, at=0.52):
    """The same force with the opening left to the mesh."""
    mesh = slice_mesh(n)
    domain = cut_domain(mesh, wall(at, thickness, pieces), "multiple", connection=connection)
    load = forces(domain, pressure(domain, levels(domain, at)))[:, 0].sum()
    return load / RHO_G / mesh.nodes[:, 1].max()


def reference(thickness, opening, at=0.52, height=0.27):
    gap = (height - opening / 2, height + opening / 2)
    return released(at, thickness, [gap], LEVELS, min(1e-3, opening / 15))


SLITS = [
    (12, 0.02, 0.04, 0.038), (12, 0.02, 0.01, 0.012), (12, 0.08, 0.02, 0.038), (12, 0.08, 0.001, 0.012),
]  # fmt: skip
MORE_SLITS = [
    (n, thickness, opening, 0.012 if opening <= 0.01 else 0.038)
    for n in (12, 24)
    for thickness in (0.02, 0.08)
    for opening in (0.04, 0.02, 0.01, 1e-3, 1e-4)
]


@pytest.mark.parametrize(("n", "thickness", "opening", "limit"), SLITS)
def test_slit_against_the_plane_solution(n, thickness, opening, limit):
    """Load within 1.2 % for openings up to an eighth of a cell (a quarter at h = 1/24), 3.8 % up to one cell; flow
    within 2 %."""
    force, flow = reference(thickness, opening)
    ours, through = lumped(n, thickness, opening)
    assert ours == pytest.approx(force, rel=limit)
    assert through == pytest.approx(flow, rel=0.02)


@pytest.mark.nightly
@pytest.mark.parametrize(("n", "thickness", "opening", "limit"), MORE_SLITS)
def test_more_slits(n, thickness, opening, limit):
    test_slit_against_the_plane_solution(n, thickness, opening, limit)


def test_an_open_slit_of_a_thin_wall_acts_as_wide_as_a_cell():
    """Why narrow cracks are closed: left to the mesh, an opening of 0.012 h takes more off the load than one of a whole
    cell should, and closed is nearer to the truth below about a quarter of a cell."""
    h = 1 / 12
    for opening, closed_is_better in ((0.012 * h, True), (0.12 * h, True), (1.2 * h, False)):
        truth = reference(0.24 * h, opening)[0]
        pieces = [(-1, 0.27 - opening / 2), (0.27 + opening / 2, 2)]
        open_ = opened(12, 0.24 * h, pieces, None)
        assert open_ < 0.18
        assert (abs(CLOSED - truth) < abs(open_ - truth)) == closed_is_better


@pytest.mark.parametrize(
    ("opening", "limit"), [(0.012, 0.01), (0.12, 0.04), (0.48, 0.05), (1.2, 0.09), (2.4, 0.06)]
)
def test_channels_through_thick_walls_are_integrated(opening, limit):
    """In a wall of three cells the channel itself is cut exactly: the load is off by 9 % where it is as wide as a cell
    and by less the narrower it is, so such cracks stay open."""
    h = 1 / 12
    pieces = [(-1, 0.27 - opening * h / 2), (0.27 + opening * h / 2, 2)]
    truth = reference(3 * h, opening * h)[0]
    assert opened(12, 3 * h, pieces, None) == pytest.approx(truth, rel=limit)


def edge_error(n, connection):
    """Mean error of the load on a gate of 0.3 h over an opening of about 0.3, places at random, in rho g b."""
    h, rng, error = 1 / n, np.random.default_rng(1), []
    for _ in range(4):
        at, low = 0.5 + rng.uniform(-1, 1) * h, 0.3 + rng.uniform(-0.5, 0.5) * h
        truth = released(at, 0.3 * h, [(0, low)], LEVELS, 2e-3 * h)[0]
        error.append(opened(n, 0.3 * h, [(low, 2)], connection, at) - truth)
    return np.mean(error)


def test_free_edges_of_thin_walls():
    """A free edge acts as if the wall were too short; thresholds take 80 % of that off, loads 0.10 to 0.15."""
    assert -0.035 < edge_error(8, None) < -0.02
    assert abs(edge_error(8, WIDE_OPENINGS)) < 0.006


def test_slit_between_equal_levels_stays_at_rest():
    """Pressure and weight balance in every slit: no flow, level or inclined, wherever its mouths are."""
    mesh = slice_mesh(8)
    domain = cut_domain(mesh, wall(0.52, 0.04, [(-1, 0.3), (0.3, 2)]), "multiple")
    slit = slit_at(domain, 0.52, 0.04, 0.3, 1e-3, mesh.spacing)
    p = RHO_G * (1 - domain.nodes[:, 2])
    every = np.arange(len(p))
    assert len(slit) == 2
    moved = slit.advanced(every, p, WEIGHT, 0.1, DENSITY)
    np.testing.assert_allclose(moved.flow, 0, atol=1e-15)
    matrix, rhs = slit.pressure_terms(every, p, WEIGHT, 0.1, DENSITY)
    np.testing.assert_allclose(rhs, 0, atol=1e-15)
    np.testing.assert_allclose(matrix.sum(axis=1), 0, atol=1e-15)
    assert abs(matrix - matrix.T).max() < 1e-15 * abs(matrix).max()


def test_steady_flow_of_a_slit_is_torricellis():
    """Under a constant difference of level the flow grows to C_d g L sqrt(2 g Δz), from either side, and what one side
    loses the other gains."""
    mesh = slice_mesh(8)
    domain = cut_domain(mesh, wall(0.52, 0.04, [(-1, 0.3), (0.3, 2)]), "multiple")
    slit = slit_at(domain, 0.52, 0.04, 0.3, 0.01, mesh.spacing)
    every = np.arange(len(domain.nodes))
    for high, low in (LEVELS, LEVELS[::-1]):
        level = np.zeros(len(every))
        level[domain.cells] = np.where(domain.centroid[:, 0] > 0.52, low, high)[:, None]
        p = RHO_G * (level - domain.nodes[:, 2])
        for _ in range(200):
            slit = slit.advanced(every, p, WEIGHT, 0.01, DENSITY)
        steady = 0.6 * 0.01 * 2 * mesh.spacing * np.sqrt(2 * GRAVITY * 0.5)
        assert abs(slit.flow.sum()) == pytest.approx(steady, rel=1e-6)
        brought = slit.carried(0.1)
        right = np.zeros(len(every), dtype=bool)
        right[domain.cells[domain.centroid[:, 0] > 0.52]] = True
        assert brought.sum() == pytest.approx(0, abs=1e-15)
        assert brought[right].sum() == pytest.approx(0.1 * steady * np.sign(high - low), rel=1e-6)


def test_a_dry_mouth_gives_nothing():
    """The flow goes on into a dry mouth, and ends where it would come out of one."""
    mesh = slice_mesh(8)
    domain = cut_domain(mesh, wall(0.52, 0.04, [(-1, 0.3), (0.3, 2)]), "multiple")
    slit = slit_at(domain, 0.52, 0.04, 0.3, 0.01, mesh.spacing)
    first = np.flatnonzero((slit.difference > 0.0).sum(axis=1))
    push = RHO_G * np.ones(len(first))
    assert (slit.advanced(first, push, WEIGHT, 0.01, DENSITY).flow > 0.0).all()
    assert (slit.advanced(first, -push, WEIGHT, 0.01, DENSITY).flow == 0.0).all()


def test_flows_are_taken_over_by_name():
    mesh = slice_mesh(8)
    domain = cut_domain(mesh, wall(0.52, 0.04, [(-1, 0.3), (0.3, 2)]), "multiple")
    slit = slit_at(domain, 0.52, 0.04, 0.3, 0.01, mesh.spacing)
    every = np.arange(len(domain.nodes))
    moving = slit.advanced(every, RHO_G * domain.nodes[:, 0], WEIGHT, 0.01, DENSITY)
    y, x = 2 * mesh.spacing, 0.52 + np.array([-0.02, -0.02, 0.02, 0.02])
    corners = np.column_stack([x, [0, y, y, 0], np.full(4, 0.3)])
    cracks = Cracks(corners, np.array([0, 4]), np.array([0.02]), np.array([[0, 1]]), np.array([7]))
    np.testing.assert_array_equal(Slits.of(domain, cracks, mesh.spacing, moving).flow, moving.flow)
    assert np.abs(moving.flow).min() > 0


def test_crack_behind_another_block_has_no_slit():
    """Only edges with water at both mouths count: a joint whose one edge meets a third body is no way through."""
    mesh = slice_mesh(8)
    pieces = wall(0.52, 0.04, [(-1, 0.3), (0.3, 2)])
    more = ConvexBodies.boxes(
        [*pieces.centre, [0.64, 0.5, 0.3]], [[0.04, 4, 1.3], [0.04, 4, 1.7], [0.2, 4, 0.4]]
    )
    domain = cut_domain(mesh, more, "multiple")
    assert len(slit_at(domain, 0.52, 0.04, 0.3, 0.01, mesh.spacing)) == 0


def test_conductance_of_a_wide_opening_is_its_channel():
    """Beyond two cells the mesh sees the mouths: only the channel is left."""
    assert conductance(np.array(0.5), np.array(1.0), np.array(0.2), 0.1) == pytest.approx(2.5)


def crack_of_tank(opening):
    x = 0.52 + np.array([-0.02, -0.02, 0.02, 0.02])
    corners = np.column_stack([x, [0, 0.25, 0.25, 0], np.full(4, 0.27)])
    return Cracks(corners, np.array([0, 4]), np.array([opening]), np.array([[0, 1]]), np.array([3]))


def tank_with_slit(opening):
    """Two basins 0.87 m and 0.43 m deep, parted by a wall with a slit at 0.27 m: Water, nodes (N,) on the right."""
    mesh = box_mesh((0, 0, 0), (1, 0.25, 1), 1 / 8)
    domain = cut_domain(mesh, wall(0.52, 0.04, [(-1, 0.27), (0.27, 2)]), "multiple")
    right = np.zeros(len(domain.nodes), dtype=bool)
    right[domain.cells[domain.centroid[:, 0] > 0.52]] = True
    water = Water(mesh, domain, domain.nodes[:, 2] - np.where(right, 0.43, 0.87), WaterParameters())
    water.set_cracks(crack_of_tank(opening))
    return water, right


def test_water_flows_through_a_slit_into_the_other_basin():
    """Over 0.6 s the higher basin loses what the slit carried and the lower one gains it, the total stays, and the flow
    has come to Torricelli's for the difference of level that is left."""
    water, right = tank_with_slit(0.005)
    before, through = [water.nodal_water[~right].sum(), water.nodal_water[right].sum()], 0.0
    while water.time < 0.6:
        advance(water, dt=0.01)
        through += 0.01 * abs(water.slits.flow.sum())
    lost, gained = before[0] - water.nodal_water[~right].sum(), water.nodal_water[right].sum() - before[1]
    drop = 0.44 - (lost + gained) / (0.25 * 0.48)
    assert lost == pytest.approx(through, rel=0.05)
    assert gained == pytest.approx(through, rel=0.05)
    assert lost - gained == pytest.approx(0, abs=1e-6 * sum(before))
    steady = 0.6 * 0.005 * 0.25 * np.sqrt(2 * GRAVITY * drop)
    assert abs(water.slits.flow.sum()) == pytest.approx(steady, rel=0.03)


def test_saved_flow_goes_on_bit_for_bit():
    """The flow of a slit has inertia, so it is part of the state."""
    water, _ = tank_with_slit(0.005)
    for _ in range(4):
        advance(water, dt=0.01)
    again, _ = tank_with_slit(0.005)
    state.restore(again, water.domain, state.save(water))
    for one in (water, again):
        one.set_cracks(crack_of_tank(0.006))
        advance(one, dt=0.01)
    assert np.abs(water.slits.flow).min() > 0
    np.testing.assert_array_equal(water.slits.flow, again.slits.flow)
    np.testing.assert_array_equal(water.velocity, again.velocity)
