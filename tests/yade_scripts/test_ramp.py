"""Weight that comes on gradually: no swing, and the accounts of energy and momentum know of it."""

import numpy as np
import pytest

from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

G, MASS = 9.81, 2000.0
GLUE = JointParameters(1e6, 1e-3, damping=0.0)
SINK = MASS * G / GLUE.stiffness
"""Of a cube of 1 m on its joint with the ground [m]."""


def swings(ramp):
    """Cube on a joint without damping: (deepest place in m below the start, structure at the end, start's energies)."""
    block = Block("b", (0, 0, 0.5), size=1.0, density=MASS)
    period = 2.0 * np.pi * np.sqrt(MASS / GLUE.stiffness)
    with Structure([block], ContactLaw(1e9), GLUE, ground=0.0, ramp=ramp * period) as s:
        start, deepest, momentum = s.energies(), 0.0, 0.0
        for _ in range(60):
            report = s.advance(period * (ramp + 2.0) / 60)
            deepest = max(deepest, 0.5 - s.centre()[0, 2])
            weight = report.impulses.of_weight(s.gravity_force(), np.zeros(3))[0, 2]
            momentum += weight + report.impulses.joint[0, 2]
            assert momentum == pytest.approx(MASS * s.velocity()[0, 2], abs=1e-9 * MASS)
        return deepest, balance(s.energies()) - balance(start), s.energies()["driving_work"]


def test_a_weight_that_comes_on_at_once_sinks_twice_as_deep_as_one_that_comes_on_gradually():
    """Energy: lifted work is half of the weight times its way."""
    sudden, _, no_work = swings(0.0)
    gradual, off, work = swings(12.0)
    assert sudden == pytest.approx(2.0 * SINK, rel=0.01)
    assert gradual == pytest.approx(SINK, rel=0.01)
    assert no_work == 0.0
    assert work == pytest.approx(-0.5 * MASS * G * SINK, rel=0.02)
    assert off == pytest.approx(0.0, abs=1e-3 * MASS * G * SINK)


def test_a_ramp_goes_on_where_it_was_after_a_restore():
    block = Block("b", (0, 0, 0.5), size=1.0, density=MASS)
    with Structure([block], ContactLaw(1e9), GLUE, ground=0.0, ramp=0.5) as s:
        s.advance(0.2)
        saved = s.save()
        s.advance(0.2)
        first = s.centre().copy()
        s.restore(saved)
        s.advance(0.2)
        np.testing.assert_array_equal(s.centre(), first)
        assert s.weight_now()[0, 2] > s.gravity_force()[0, 2]  # less than the whole, downwards
        s.advance(0.2)
        np.testing.assert_array_equal(s.weight_now(), s.gravity_force())


def test_weight_comes_on_and_ends_without_a_jump_of_its_rate():
    """3 s² - 2 s³ of it at the share s of the ramp."""
    block = Block("b", (0, 0, 0.5), size=1.0, density=MASS)
    with Structure([block], ContactLaw(1e9), GLUE, ground=0.0, ramp=0.4) as s:
        for share in (0.25, 0.5, 0.75):
            s.advance(0.1)
            expected = -MASS * G * (3.0 * share**2 - 2.0 * share**3)
            assert s.weight_now()[0, 2] == pytest.approx(expected, rel=1e-6)
