"""Tetrahedra from a mesh generator: still water stays still, bodies get their load, waves and dam breaks run."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.domain.topology import Topology
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from fluid.surface.gradient_jump_damping import damp_gradient_jumps
from fluid.transport.paths_in_solids import levels_in_solids
from tests.fluid.general import unstructured
from tests.fluid.scenes import advance, load, rotation
from tests.fluid.test_obtuse import jittered, thin_wall

WEIGHT = 1000.0 * 9.81


@pytest.fixture(scope="module")
def mesh(tmp_path_factory):
    return unstructured(8, tmp_path_factory.mktemp("mesh") / "cube.vtu")


def filled(mesh, level, bodies=None, covers="single"):
    domain = cut_domain(mesh, ConvexBodies.empty() if bodies is None else bodies, covers)
    return Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters())


def noise_after(water, steps):
    """Largest speed before and after the steps, from noise of 1e-8 m/s on still water."""
    for _ in range(3):
        advance(water)
    water.velocity += 1e-8 * np.random.default_rng(0).standard_normal(water.velocity.shape)
    water.hold(water.velocity, water.time)
    advance(water)
    start = water.fastest()
    for _ in range(steps):
        advance(water)
    return start, water.fastest()


@pytest.mark.parametrize("general", [True, False], ids=["Delaunay", "jittered"])
def test_noise_on_still_water_dies(mesh, general):
    """Velocity of single nodes along the surface and the surface fed each other: growth of 0.01 a step, tenfold in
    these 200."""
    start, end = noise_after(filled(mesh if general else jittered(0.15), 0.5), 200)
    assert end < start


@pytest.mark.parametrize(("share", "level", "seed"), [(0.15, 0.5, 1), (0.25, 0.53, 2)])
def test_noise_beside_a_thin_wall_dies(share, level, seed):
    """Nodes inside the wall whose paths end at the last cell of their water moved the surface by a velocity along it:
    growth of 0.05 a step, tenfold in these 100."""
    start, end = noise_after(filled(jittered(share), level, thin_wall(seed), "multiple"), 100)
    assert end < start


def test_velocity_along_a_level_surface_does_not_lift_it_inside_solids(mesh):
    """A flat level set under a uniform velocity: φ = z - level - dt w at every node in the wall, to round-off, though
    most of the paths end at the last cells of their water."""
    domain = cut_domain(mesh, thin_wall(1), "multiple")
    t, u, dt = Topology.of(mesh, domain), np.array([0.3, -0.2, 0.1]), 0.02
    listed, phi = np.flatnonzero(t.active), t.nodes[:, 2] - 0.5
    places, levels = levels_in_solids(t, listed, dt, np.tile(u, (len(phi), 1)), phi, mesh.spacing)
    assert t.covered[listed[places]].all()
    assert len(places) > 50
    np.testing.assert_allclose(levels, phi[listed[places]] - dt * u[2], atol=1e-12)


def test_kinks_are_damped_and_linear_velocities_are_not(mesh):
    """The operator is symmetric, positive and blind to what is linear in space, on cells with angles down to 5°."""
    t = Topology.of(mesh, cut_domain(mesh, ConvexBodies.empty(), "single"))
    cells, n = np.arange(len(t.cells)), len(t.nodes)
    rest = (np.full(n, -0.1), np.ones(n, bool), 1 / 8, -1.0)
    arrays = (t.fluid_cells, t.neighbours)
    linear = t.nodes @ np.array([[1.0, 2, -1], [0.3, -2, 1], [0.5, 0, 1]]) + [1, 2, 3]
    u = linear.copy()
    damp_gradient_jumps(cells, *rest, u, *arrays)
    np.testing.assert_allclose(u, linear, atol=1e-12)
    noise = np.random.default_rng(0).standard_normal((n, 3))
    before, momentum = t.node_volume @ noise**2, t.node_volume @ noise
    damp_gradient_jumps(cells, *rest, noise, *arrays)
    assert (t.node_volume @ noise**2 < 0.8 * before).all()
    np.testing.assert_allclose(t.node_volume @ noise, momentum, atol=1e-12)


@pytest.mark.parametrize("general", [True, False], ids=["Delaunay", "jittered"])
def test_block_through_the_surface_feels_its_buoyancy(mesh, general):
    """A turned box, half under water by symmetry: Archimedes to round-off. Cells left out of the pressure for their
    obtuse angles took up to 2 % of the load with them."""
    size, turn = [0.4, 0.3, 0.25], rotation([3, 5, 2], 0.6)
    block = ConvexBodies.boxes(np.array([[0.5, 0.48, 0.53]]), np.array([size]), turn[None])
    water = filled(mesh if general else jittered(0.25), 0.53, block, "multiple")
    for _ in range(5):
        problem, x = advance(water)
    force = load(problem, x)[0, :3]
    lift = 0.5 * WEIGHT * np.prod(size)
    np.testing.assert_allclose(force, [0, 0, lift], atol=1e-8 * lift)
    assert water.fastest() < 1e-9


def test_a_falling_column_keeps_its_volume_and_gains_no_energy(mesh):
    water = Water(
        mesh,
        cut_domain(mesh, ConvexBodies.empty(), "single"),
        lambda x: np.maximum(x[:, 0] - 0.4, x[:, 2] - 0.7),
        WaterParameters(),
    )
    start, energy = water.volume(), water.kinetic_energy() + water.potential_energy()
    while water.time < 0.5:
        advance(water)
        assert water.kinetic_energy() + water.potential_energy() < 1.02 * energy
    assert abs(water.volume() - start) < 1e-5 * start


def fastest_of_a_thousand_steps(mesh, seed, level):
    water, fastest = filled(mesh, level, thin_wall(seed), "multiple"), 0.0
    for _ in range(1000):
        advance(water)
        fastest = max(fastest, water.fastest())
    return fastest


@pytest.mark.nightly
@pytest.mark.parametrize(("seed", "level"), [(0, 0.53), (1, 0.5), (2, 0.5), (3, 0.5), (3, 0.53)])
def test_still_water_rests_for_a_thousand_steps(mesh, seed, level):
    assert fastest_of_a_thousand_steps(mesh, seed, level) < 1e-7


@pytest.mark.nightly
@pytest.mark.parametrize(("seed", "level"), [(0, 0.5), (1, 0.53), (2, 0.53)])
def test_growing_motion_of_still_water_stays_small(mesh, seed, level):
    """A weakness (docs/water.md): pressure and surface are not each other's transpose, and motion grows from round-off
    by 1 to 3 % a step, to 2 mm/s after a thousand."""
    assert fastest_of_a_thousand_steps(mesh, seed, level) < 5e-3
