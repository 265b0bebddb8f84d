"""Bodies that move through the water: what they displace, what they feel, what they leave behind."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.background import box_mesh
from fluid.numerics.solve import solve
from fluid.step.water import Water
from tests.fluid.scenes import advance, load, tank


def drive(water, body, velocity, steps, dt):
    """Move one body at a prescribed velocity (steps, 3); yields (problem, x) of every step."""
    for v in np.broadcast_to(velocity, (steps, 3)):
        yield advance(water, dt, np.append(v, np.zeros(3)), rtol=1e-9)
        body = body.moved(body.centre + dt * v)
        again = cut_domain(
            water.mesh, body, water.domain.covers, previous=water.domain, moved=np.array([True])
        )
        water.move_solids(again)


def box(centre, size):
    return ConvexBodies.boxes(np.array([centre]), np.array([size]))


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_box_pushed_under_lifts_the_surface_by_what_it_displaces(covers):
    """From dry to half sunk: the water keeps its volume, nothing is invented by the motion, the level rises by
    displaced volume / free area."""
    size, body = np.array([0.3, 0.25, 0.2]), box([0.5, 0.5, 0.63], [0.3, 0.25, 0.2])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.5, body, covers=covers)
    moved = 0.0
    for _ in drive(water, body, [0, 0, -0.5], 40, 0.01):
        moved += abs(water.report.reinserted)
    assert abs(water.volume_error()) < 2e-3
    assert moved < 1e-3 * water.initial_volume
    draft_lowest = 0.43 - 0.1
    rise = size[0] * size[1] * (0.5 - draft_lowest) / (1 - size[0] * size[1])
    wet = water.domain.volume[(water.level_set[water.domain.cells] < 0).any(axis=1)].sum()
    assert wet > 0.5
    np.testing.assert_allclose(_mean_level(water), 0.5 + rise, atol=0.35 * rise)


def _mean_level(water):
    """Height of φ = 0 averaged over columns of nodes beside the walls, away from the body."""
    x = water.topology.nodes
    levels = []
    for xy in ([0, 0], [1, 0], [0, 1], [1, 1], [0.5, 0], [0.5, 1]):
        at = np.flatnonzero(np.all(np.isclose(x[:, :2], xy), axis=1))
        at = at[np.argsort(x[at, 2])]
        phi = water.level_set[at]
        k = np.flatnonzero(phi < 0)[-1]
        levels.append(x[at[k], 2] + phi[k] / (phi[k] - phi[k + 1]) * (x[at[k + 1], 2] - x[at[k], 2]))
    return np.mean(levels)


def test_added_mass_does_not_drift():
    """A box accelerated steadily in a closed full tank: F = -c_a ρ V a with c_a constant while the box has hardly
    moved.  Without the remainder of the cells c_a doubles in ten steps."""
    size, acceleration, dt = [0.26, 0.22, 0.24], 1e-3, 0.01
    body = box([0.5, 0.5, 0.5], size)
    water = tank([1, 1, 1], 1 / 12, lambda x: x[:, 2] - 10.0, body)
    speed = acceleration * dt * np.arange(1, 16)
    velocity = np.column_stack([speed, 0 * speed, 0 * speed])
    force = np.array([load(p, x)[0, 0] for p, x in drive(water, body, velocity, 15, dt)])
    added = -force / (1000.0 * np.prod(size) * acceleration)
    assert 0.2 < added[0] < 0.6
    np.testing.assert_allclose(added, added[0], rtol=0.03)


def test_work_on_the_body_leaves_the_water():
    """Energy of the water plus the work done on a body driven through it never grows, and little is lost."""
    body = box([0.3, 0.5, 0.4], [0.3, 0.25, 0.2])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.8, body)
    start, work = water.kinetic_energy() + water.potential_energy(), 0.0
    for problem, x in drive(water, body, [0.3, 0, 0], 30, 0.01):
        work += water.report.work_on_bodies
        np.testing.assert_allclose(
            water.report.work_on_bodies, 0.01 * load(problem, x)[0, 0] * 0.3, rtol=1e-4, atol=1e-7
        )
    assert work < 0  # the driver pushes: the water receives
    lost = start - work - (water.kinetic_energy() + water.potential_energy())
    assert -1e-3 * abs(work) < lost < 1.2 * abs(work)


@pytest.mark.parametrize("covers", ["single", "multiple"])
def test_still_bodies_change_nothing(covers):
    """The same domain cut anew: the fields are carried over bit for bit, the water stays at rest."""
    body = box([0.5, 0.5, 0.5], [0.05, 1.2, 1.2])
    water = tank([1, 1, 1], 0.125, lambda x: x[:, 2] - 0.53, body, covers=covers)
    for _ in range(4):
        advance(water, 0.01)
        water.move_solids(cut_domain(water.mesh, body, covers))
    assert np.abs(water.velocity).max() < 1e-8


def test_thin_wall_with_covers_holds_different_levels():
    """A wall thinner than a cell, 0.71 m of water on one side and 0.33 m on the other: nothing moves, because each
    side has its own nodes, and the wall carries ρ g (h1² - h2²) b / 2 but for the cells of the water lines, where
    the dry corners of the load are zero: second order in h, 5e-4 here."""
    body = box([0.52, 0.5, 0.5], [0.05, 1.2, 1.2])
    mesh = box_mesh(np.zeros(3), np.ones(3), 0.125)
    domain = cut_domain(mesh, body, "multiple")
    level = domain.nodes[:, 2] - np.where(_side_of_nodes(domain) < 0.52, 0.71, 0.33)
    water = Water(mesh, domain, level)
    for _ in range(20):
        problem, x = advance(water, 0.01)
    assert np.abs(water.velocity).max() < 1e-7
    np.testing.assert_allclose(load(problem, x)[0, 0], 9810 * (0.71**2 - 0.33**2) / 2, rtol=1e-3)


def _side_of_nodes(domain):
    """x of the fluid that each node belongs to: the mean centroid of the cells around it."""
    n, weight = len(domain.nodes), np.repeat(domain.volume, 4)
    total = np.bincount(domain.cells.ravel(), weight * np.repeat(domain.centroid[:, 0], 4), minlength=n)
    return total / np.maximum(np.bincount(domain.cells.ravel(), weight, minlength=n), 1e-300)


def test_heaving_box_and_water_together_only_lose_energy():
    """A box of half the density of water let go above its draft, with its mass inside the pressure solve: the energy
    of both falls slowly and does not come back (8 % of the swing), and the box ends nearer to its draft."""
    size, centre, dt = 0.3, np.array([0.5, 0.5, 0.55]), 0.01
    mass = 0.5 * 1000.0 * size**3
    inertia = np.array(
        [mass] * 3 + [1e9] * 3
    )  # it may not turn: an upright cube of half density would capsize
    body, velocity = box(centre, [size] * 3), np.zeros(6)
    water = tank([1, 1, 1], 0.1, lambda x: x[:, 2] - 0.5, body)
    energies, heights = [], []
    for _ in range(60):
        problem = water.predict(dt)
        G, weight = problem.coupling, np.array([0, 0, -9.81 * mass, 0, 0, 0])
        free = velocity + dt / inertia * (weight - G.T @ problem.known)
        found = solve(
            problem.matrix,
            problem.rhs + G @ free,
            problem.guess,
            1e-9,
            lambda x, G=G: G @ (dt / inertia * (G.T @ x)),
        )
        velocity = free - dt / inertia * (G.T @ found.x)
        water.farther = dt * (velocity[None] - water.pushed_by)
        water.pushed_by = velocity[None].copy()
        water.correct(problem, found.x)
        body = body.moved(body.centre + dt * velocity[:3])
        water.move_solids(cut_domain(water.mesh, body, previous=water.domain, moved=np.array([True])))
        own = 0.5 * mass * velocity[:3] @ velocity[:3] + mass * 9.81 * body.centre[0, 2]
        energies.append(own + water.kinetic_energy() + water.potential_energy())
        heights.append(body.centre[0, 2])
    swing = 0.5 * 9810 * size**2 * 0.05**2
    climb = np.max(np.array(energies) - np.minimum.accumulate(energies))
    assert climb < 0.08 * swing
    assert energies[0] - energies[-1] < 0.6 * swing
    assert 0.44 < min(heights) < 0.5


def test_copies_of_a_node_that_splits_get_the_water_that_they_hold():
    """The edges of a plate at the surface pass a plane of nodes by a thousandth of a cell. Copies that nodes beside
    them split into shared their water by what they can hold, so that most of it came to lie on the plate."""
    level, cell = 0.35, 0.125
    mesh = box_mesh((0.0, 0.0, 0.0), (1.0, 1.0, 0.5), cell)
    inside, beyond = (
        cut_domain(
            mesh,
            ConvexBodies.boxes(np.array([[0.5, 0.5, level]]), np.array([[side, side, 0.02]])),
            "multiple",
        )
        for side in (0.75 - 2e-4, 0.75 + 2e-4)
    )
    water = Water(mesh, inside, inside.nodes[:, 2] - level)
    at_rest = Water(mesh, beyond, beyond.nodes[:, 2] - level)
    copies = [np.bincount(domain.parent_node, minlength=len(mesh.nodes)) for domain in (inside, beyond)]
    split = (copies[0] == 1) & (copies[1] > 1)
    water.move_solids(beyond)
    assert split.sum() > 10
    split = split[beyond.parent_node]
    np.testing.assert_allclose(
        water.nodal_water[split], at_rest.nodal_water[split], rtol=0.02, atol=1e-4 * cell**3
    )
