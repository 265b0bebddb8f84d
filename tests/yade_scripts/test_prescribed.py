"""Motions over time that blocks are told: closed forms of a velocity that is linear between given times."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.prescribed import Prescribed, PrescribedWay
from yade_scripts.dynamics.structure import Structure

TIMES = np.array([0.0, 0.1, 0.25, 0.4])
VELOCITIES = np.array([[0.0, 1.0, 0.0], [2.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.5, 1.0, 0.0]])
MOTION = Prescribed(TIMES, VELOCITIES)


def test_the_way_is_the_integral_of_the_velocity():
    """Trapezoids, cut at 0.2 s and 0.6 s: there the velocity is 0, and 0.5 m/s as it was at the end of the table."""
    assert MOTION.velocity(0.2) == pytest.approx([0.0, 1.0, 0.0], abs=1e-12)
    assert MOTION.way(0.2) == pytest.approx([0.1 + 0.1, 0.2, 0.0])
    end = 0.2 - 0.5 * 0.05 * 1.0 + 0.5 * 0.15 * (-0.5)
    assert MOTION.way(0.4) == pytest.approx([end, 0.4, 0.0])
    assert MOTION.way(0.6) == pytest.approx([end + 0.2 * 0.5, 0.6, 0.0])
    for time, dt in ((0.0, 0.4), (0.05, 0.1), (0.12, 0.01), (0.3, 0.5)):
        mean = (MOTION.way(time + dt) - MOTION.way(time)) / dt
        assert MOTION.mean_velocity(time, dt) == pytest.approx(mean, rel=1e-12)
    assert MOTION.fastest() == pytest.approx(np.sqrt(5.0))
    assert MOTION.fastest(0.2, 0.3) == pytest.approx(np.sqrt(2.0))
    assert MOTION.fastest(0.0, 0.05) == pytest.approx(np.sqrt(2.0))


def test_a_motion_turns_where_its_velocity_vanishes():
    assert MOTION.turning_times(0, 0.5) == pytest.approx([0.0, 0.2, 0.35, 0.5])
    assert MOTION.turning_times(0, 0.3) == pytest.approx([0.0, 0.2, 0.3])


@pytest.mark.parametrize("substep", [1e-3, 7e-3])
def test_a_driven_block_is_where_its_motion_takes_it(substep):
    """Whatever the substep, also where corners of the table lie within one; going back to a state takes it along."""
    block = Block("plate", np.zeros(3), size=np.ones(3), driven=True, velocity=VELOCITIES[0], motion=MOTION)
    with Structure([block]) as structure:
        start = structure.save()
        for end in (0.15, 0.33, 0.5):
            report = structure.advance(end - structure.time, substep)
            assert structure.centre()[0] == pytest.approx(MOTION.way(end), rel=1e-12)
        assert report.mean_velocity[0, :3] == pytest.approx((MOTION.way(0.5) - MOTION.way(0.33)) / 0.17)
        structure.restore(start)
        structure.advance(0.15, substep)
        assert structure.centre()[0] == pytest.approx(MOTION.way(0.15), rel=1e-12)


def test_displacements_lie_on_a_smooth_curve():
    """Through every twentieth of a period of a swing that starts and ends at rest: place and velocity of the swing
    within the error of a cubic spline, and the largest speed."""
    omega = 2.0 * np.pi
    times = np.linspace(0.0, 2.0, 41)
    swing = PrescribedWay.through(times, np.column_stack([1.0 - np.cos(omega * times), 0 * times, 0 * times]))
    for time in np.linspace(0.0, 2.0, 77):
        assert swing.way(time)[0] == pytest.approx(1.0 - np.cos(omega * time), abs=1e-4)
        assert swing.velocity(time)[0] == pytest.approx(omega * np.sin(omega * time), abs=0.01)
    assert swing.fastest() == pytest.approx(omega, rel=1e-3)
    assert swing.fastest(0.9, 0.95) == pytest.approx(omega * np.sin(omega * 0.1), rel=1e-2)
    assert swing.mean_velocity(0.1, 0.25) == pytest.approx((swing.way(0.35) - swing.way(0.1)) / 0.25)
    assert {0.5, 1.0, 1.5} <= set(np.round(swing.turning_times(0, 2.0), 6))
    assert swing.velocity(2.5).tolist() == [0.0, 0.0, 0.0]
