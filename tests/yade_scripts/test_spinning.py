"""Plates that spin flat on the ground: friction of an even pressure stops them."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure

G, MU, K, SPIN = 9.81, 0.3, 1e7, 5.0


def square():
    """Mean distance from the middle: (sqrt 2 + ln(1 + sqrt 2))/6 of the edge."""
    block = Block("plate", (0, 0, 0.05), size=(1.0, 1.0, 0.1), density=2000.0, spin=(0, 0, SPIN))
    return block, (np.sqrt(2.0) + np.log(1.0 + np.sqrt(2.0))) / 6.0


def disc(sides=24):
    """A prism of many sides: that of its circle of equal area is 2/3 R."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    ring = np.stack([0.5 * np.cos(angle), 0.5 * np.sin(angle)], axis=1)
    corners = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (0.0, 0.1)])
    block = Block("disc", (0, 0, 0.05), vertices=corners, density=2000.0, spin=(0, 0, SPIN))
    return block, 2.0 / 3.0 * np.sqrt(block.volume / 0.1 / np.pi)


@pytest.mark.parametrize("plate", [square, disc])
def test_a_plate_that_spins_stops_as_under_an_even_pressure(plate):
    """t = I ω/(μ m g r), r the mean distance of the points of the face; the energy goes into friction."""
    block, mean_distance = plate()
    block = block.changed(centre=(0, 0, 0.05 - block.mass * G / K))
    time = block.inertia[2, 2] * SPIN / (MU * block.mass * G * mean_distance)
    with Structure([block], ContactLaw(K, 0.3, MU), ground=0.0) as s:
        s.advance(0.9 * time)
        assert s.velocity()[0, 5] == pytest.approx(0.1 * SPIN, rel=0.02)
        s.advance(0.2 * time)
        assert abs(s.velocity()[0, 5]) < 1e-3 * SPIN
        assert s.energies()["friction"] == pytest.approx(0.5 * block.inertia[2, 2] * SPIN**2, rel=0.01)
        assert np.abs(s.velocity()[0, :3]).max() < 1e-6


def test_a_plate_on_a_slab_slows_as_under_an_even_pressure_and_keeps_angular_momentum():
    upper, mean_distance = square()
    upper = upper.changed(spin=(0, 0, 4 * SPIN))
    slab = Block("slab", (1.0, 1.0, -0.1), size=(4.0, 4.0, 0.2), density=2000.0)
    press = 1e4
    with Structure([upper, slab], ContactLaw(K, 0.3, MU), gravity=(0, 0, 0)) as s:
        s.set_load(np.array([[0, 0, -press, 0, 0, 0], [0, 0, press, -press, press, 0]]))
        start = s.momentum(np.zeros(3))[5]
        s.advance(0.2)
        before = s.velocity()[0, 5]
        s.advance(0.02)
        slower = (before - s.velocity()[0, 5]) / 0.02
        assert s.momentum(np.zeros(3))[5] == pytest.approx(start, rel=1e-9)
    assert slower == pytest.approx(MU * press * mean_distance / upper.inertia[2, 2], rel=0.01)
