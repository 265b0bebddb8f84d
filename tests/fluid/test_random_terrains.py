"""Still water over random terrains, on meshes that fit the bed, does not move: shores at any place in the cells, slopes
up to 0.9, levels between the lowest and the highest ground, cells halved along the shore."""

import numpy as np
import pytest

from fluid.cut.bodies import ConvexBodies
from fluid.domain.physical_domain import cut_domain
from fluid.mesh.fitted_mesh import fitted_mesh
from fluid.mesh.refinement import OnBed, refined_mesh
from fluid.step.parameters import WaterParameters
from fluid.step.water import Water
from tests.fluid.scenes import advance

SIZE, CELL, LID = (8.0, 4.0), 0.5, 1.5
"""Lengths of the tank, cells and height of the lid over the highest ground [m]."""


def terrain(seed):
    """Six waves of random direction, length and height on a random plane."""
    random = np.random.default_rng(seed)
    k = random.uniform(0.2, 1.6, (6, 2)) * random.choice([-1, 1], (6, 2))
    height = random.uniform(0.02, 0.35, 6) / np.linalg.norm(k, axis=1)
    phase, tilt = random.uniform(0, 2 * np.pi, 6), random.normal(0, 0.1, 2)

    def bed(x, y):
        waves = height[:, None] * np.sin(k @ np.array([x, y]) + phase[:, None])
        return waves.sum(axis=0) + tilt[0] * (x - 4) + tilt[1] * (y - 2)

    return bed


def fastest(seed, steps, levels=0):
    """Largest speed [m/s] over so many steps of water up to a random level."""
    bed, random = terrain(seed), np.random.default_rng(1000 + seed)
    x, y = (a.ravel() for a in np.meshgrid(np.linspace(0, SIZE[0], 50), np.linspace(0, SIZE[1], 30)))
    z = bed(x, y)
    level = random.uniform(z.min() + 0.1 * np.ptp(z), z.max() + 0.2)
    fitted = fitted_mesh((0, 0, 0), (*SIZE, z.max() + LID), CELL, bed)
    mesh = fitted.mesh
    if levels:
        mesh = refined_mesh(mesh, [OnBed(bed, level - 0.3, level + 0.3, 0.5, levels)], fitted.lattice)
    domain = cut_domain(mesh, ConvexBodies.empty())
    water = Water(mesh, domain, lambda x: x[:, 2] - level, WaterParameters(), lambda n, _: n[:, 2] > 0.999)
    largest = 0.0
    for _ in range(steps):
        advance(water, rtol=1e-8)
        largest = max(largest, water.fastest())
    return largest


@pytest.mark.parametrize(("seed", "levels"), [(1, 0), (4, 0), (3, 1)])
def test_still_water_over_a_random_terrain_stays_still(seed, levels):
    assert fastest(seed, 120, levels) < 1e-6


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(100))
def test_no_random_terrain_moves_still_water_in_a_thousand_steps(seed):
    assert fastest(seed, 1000, levels=seed % 3 == 2) < 1e-6
