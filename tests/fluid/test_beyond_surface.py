"""What viscosity takes at the surface it takes from the water: dry nodes of cut cells change with the wet ones."""

import numpy as np
import pytest

from fluid.viscous.beyond import follow
from fluid.viscous.kernels import hold_rate, momentum_rate, unheld_rate
from fluid.viscous.solve import Implicit
from fluid.viscous.viscosity import Viscosity
from tests.fluid.scenes import advance, tank
from tests.fluid.test_viscosity import DENSITY, turned_box

STEP, STEPS, RATE = 0.005, 4, 1.0


def drawn_out(viscosity, place):
    """A square beam in free fall, drawn out along x and pressed flat along z with 1/s; it stands `place` cells off the
    nodes. Its energy [J] at the end, what viscosity is said to have taken, and its volume [m³]."""
    cell = 0.1
    low = np.array([0.45, 0.0, 0.35]) + place * cell
    high = low + np.array([0.7, 9.0, 0.7])
    outside = lambda x: np.maximum(low - x, x - high)[:, [0, 2]].max(axis=1)  # noqa: E731
    water = tank([1.6, 0.2, 1.6], cell, outside, viscosity=viscosity)
    x = water.topology.nodes[water.listed] - 0.5 * (low + high)
    water.velocity[water.listed, 0], water.velocity[water.listed, 2] = RATE * x[:, 0], -RATE * x[:, 2]
    water.set_cell_velocity(water.velocity[water.topology.cells].mean(axis=1))
    taken = 0.0
    for _ in range(STEPS):
        advance(water, STEP)
        taken -= water.report.energy_change.get("viscosity and friction", 0.0)
    return water.kinetic_energy() + water.potential_energy(), taken, water.nodal_water.sum()


@pytest.mark.parametrize("place", [0.0, 0.25, 0.5])
def test_a_liquid_that_is_drawn_out_loses_what_its_stresses_take(place):
    """2μ ε:ε = 4 μ a² for each m³ and second at the strain rate a. The water lost 0.71 to 0.77 of it as long as dry
    nodes changed on their own: their velocity is continued from the water at the end of the step."""
    viscosity = 1.0
    without, with_it = drawn_out(0.0, place), drawn_out(viscosity, place)
    exact = 4.0 * viscosity * RATE**2 * with_it[2] * STEPS * STEP
    np.testing.assert_allclose(with_it[1], exact, rtol=0.01)
    np.testing.assert_allclose(without[0] - with_it[0], exact, rtol=0.08)


def stage(seed=1):
    """Terms of a half-full tank with sides without slip and a box, its masses (N,), a velocity (N, 3) without any
    order, and the water."""
    water, u = turned_box("no-slip", viscosity=20.0)
    mass = DENSITY * water.nodal_water
    terms = Viscosity(water.parameters)._terms(water, water.level_set, mass, u, 0.1)
    return terms, mass, u, water


def continuation(terms, n):
    """E (N, N): velocities of all nodes from those in the water, with the shares by their definition."""
    dense = np.eye(n)
    for s, i in enumerate(terms.beyond.nodes):
        row = slice(terms.beyond.start[s], terms.beyond.start[s + 1])
        dense[i] = 0.0
        dense[i, terms.beyond.wet[row]] = terms.beyond.share[row]
    return dense


def test_dry_nodes_of_cut_cells_follow_their_wet_neighbours():
    """With the number of cells that two nodes share over the square of their distance; a mean, since no momentum may
    be lost."""
    terms, mass, u, water = stage()
    wet, cells, nodes = water.level_set < 0.0, water.topology.cells, water.topology.nodes
    np.testing.assert_array_equal(terms.beyond.nodes, np.flatnonzero(~wet & (mass > 0.0)))
    E = continuation(terms, len(mass))
    for i in terms.beyond.nodes[::7]:
        around = cells[(cells == i).any(axis=1)]
        j, shared = np.unique(around, return_counts=True)
        j, shared = j[wet[j] & (mass[j] > 0.0)], shared[wet[j] & (mass[j] > 0.0)]
        share = shared / ((nodes[i] - nodes[j]) ** 2).sum(axis=1)
        np.testing.assert_allclose(E[i, j], share / share.sum(), rtol=1e-12)
    np.testing.assert_allclose(E.sum(axis=1), 1.0, rtol=1e-12)
    followed = u.copy()
    follow(terms.beyond, followed)
    np.testing.assert_allclose(followed, E @ u, atol=1e-12)


def test_the_stage_with_nodes_beyond_the_surface_is_the_dense_one():
    """Rᵀ Eᵀ P (M + τ K) P E R d = Rᵀ Eᵀ P r with the projectors P of the sides, R of the sides on wet nodes."""
    terms, mass, u, water = stage()
    n, none = len(mass), np.zeros((len(water.body_velocity), 6))
    rate, _ = momentum_rate(terms, u, none)
    free, _ = unheld_rate(terms, u, none)
    hold_rate(terms, u, free)
    E, held = continuation(terms, n), np.ones((n, 3), bool)
    for i, projector in zip(terms.held, terms.projector):
        np.testing.assert_array_equal(projector, np.diag(np.diag(projector)))
        held[i] = np.diag(projector) == 1.0
    held &= ~terms.idle[:, None]
    np.testing.assert_allclose(rate, held * (E.T @ free), atol=1e-9 * np.abs(free).max())
    tau = 1e-3
    fixed = (np.zeros((len(none), 6, 6)), np.zeros(len(none), bool))
    found = Implicit(terms, mass, tau, fixed).solve(tau * rate, none, 1e-10, 1000)
    d = found.d
    assert found.left <= 1e-10
    change, load = unheld_rate(terms, d, none)
    np.testing.assert_allclose(found.rate, change, atol=1e-12 * np.abs(change).max())
    np.testing.assert_allclose(found.load, load, atol=1e-12 * np.abs(load).max())
    hold_rate(terms, d, change)
    missed = held * (E.T @ (held * (mass[:, None] * d - tau * change))) - tau * rate
    assert np.abs(missed).max() < 1e-8 * np.abs(tau * rate).max()
    np.testing.assert_allclose(d, held * (E @ d), atol=1e-12 * np.abs(d).max())
