"""Viscous liquids and fast water come to dry sides of the tank with their surface, not with their volume alone."""

from dataclasses import replace

import numpy as np
import pytest

from fluid.step.predictor import _transported
from fluid.transport.advection import Fields
from fluid.transport.landing import gained
from tests.fluid.scenes import advance, tank

CELL = 0.1


def slab(foot, across=2, viscosity=200.0, speed=1.0):
    """A slab that falls with `speed` [m/s]; its lower face is a plane at the height `foot` [cells] over the floor, or
    before the side x = 0 (across = 0), which it moves to."""
    water = tank(
        [0.6, 0.3, 0.6],
        CELL,
        lambda x: np.maximum(foot * CELL - x[:, across], x[:, across] - 0.5),
        viscosity=viscosity,
    )
    water.velocity[water.listed, across] = -speed
    water.hold(water.velocity, 0.0)
    return water


@pytest.mark.parametrize("across", [0, 2])
def test_a_plane_surface_comes_to_a_side_with_the_velocity_of_its_water(across):
    """Exactly, since φ is linear there; with the velocity of the nodes of the side it would stay where it is."""
    water, dt = slab(0.6, across), 0.04
    phi = _transported(water, dt, 1.0, np.zeros(len(water.level_set)), 1.0)[1]
    on_side = np.flatnonzero(water.topology.nodes[:, across] == 0.0)
    np.testing.assert_allclose(phi[on_side], 0.6 * CELL - dt, rtol=1e-9)


def test_only_viscous_liquids_are_carried_so_where_they_are_slow():
    """By no share of it where water is as fast as it is thin: |u| h/ν = 100 and more; in full up to 10."""
    shares = []
    for reynolds in (5.0, 55.0, 200.0):
        water = slab(0.6, viscosity=1000.0 * CELL / reynolds)
        water.parameters = replace(
            water.parameters, gravity=100.0
        )  # waves of one cell are three times as fast
        gain, _ = gained(water, 0.04, water.velocity, Fields.of(water.velocity, water.level_set))
        shares.append(-gain.min(initial=0.0) / 0.04)
    # half of it at the node, all of it a cell above: 0.5 + 0.5 (0.4 s) is s at the foot of the path
    np.testing.assert_allclose(shares, [1.0, 0.625, 0.0], atol=2e-3)


def test_fast_water_is_carried_so_as_far_as_its_velocity_follows_its_momentum():
    """By no share of it up to the speed of the shallow-water wave of a cell, in full from three times that."""
    shares, wave = [], np.sqrt(9.81 * CELL)
    for speed in (1.0, 2.0, 3.0):
        water = slab(0.6, viscosity=0.0, speed=speed * wave)
        gain, _ = gained(water, 0.04 / speed, water.velocity, Fields.of(water.velocity, water.level_set))
        shares.append(-gain.min(initial=0.0) / (0.04 * wave))
    np.testing.assert_allclose(shares[0], 0.0, atol=1e-12)
    np.testing.assert_allclose(shares[2], 1.0, rtol=1e-9)
    assert 0.5 < shares[1] < 0.8


def test_the_front_of_a_dam_break_does_not_slow_down_before_a_wall():
    """A slab that flies at a wall with three times the speed of the wave of a cell is there when its distance over its
    speed says so, within the step. With the velocity of the nodes of the wall it is there late by 1.5 times what a cell
    takes."""
    water = slab(3.5, across=0, viscosity=0.0, speed=3.0)
    on_side = water.topology.nodes[:, 0] == 0.0
    dt = 0.5 * CELL / 3.0
    while (water.level_set[on_side] > 0.0).all():
        advance(water, dt=dt)
    assert 3.5 * CELL / 3.0 - dt < water.time < 3.5 * CELL / 3.0 + 1.1 * dt


def fall_of_a_drop(cells):
    """A cube of 0.107 m and 40 Pa s is let go 37 mm over the floor: the largest rise of its energy beyond the work of
    viscosity over the potential energy that it has released by 0.35 s, and the height of its centre [m] at 0.12 s."""
    edge = 0.107
    h, lower = edge / cells, np.array([0.107, 0.107, 0.037])
    size = np.ceil(np.array([0.32, 0.32, 0.2]) / h) * h

    def cube(x):
        return (np.abs(x - lower - 0.5 * edge) - 0.5 * edge).max(axis=1)

    water = tank(size, h, cube, viscosity=40.0)
    energy, viscous, rest, height = [], 0.0, [], None
    while water.time < 0.35:
        left = 0.12 - water.time
        step = water.stable_step()
        advance(water, min(step, left) if left > 1e-9 else step)
        viscous += water.report.energy_change["viscosity and friction"]
        energy.append(water.potential_energy())
        rest.append(water.kinetic_energy() + energy[-1] - viscous)
        if height is None and water.time > 0.12 - 1e-9:
            height = water.nodal_water @ water.topology.nodes[:, 2] / water.nodal_water.sum()
    rise = max(b - a for i, a in enumerate(rest) for b in rest[i:])
    return rise / (energy[0] - min(energy)), height


def test_a_drop_of_three_cells_gains_no_energy_as_it_lands():
    """It gained a quarter of what it released, and its centre was 6 mm behind as it landed."""
    rise, height = fall_of_a_drop(3.2)
    fine = fall_of_a_drop(8.0)[1]
    assert rise < 0.02
    np.testing.assert_allclose(height, fine, atol=0.03 * 0.107)
