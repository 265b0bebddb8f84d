"""Points of a joint that have failed and are pressed together rub, while the others hold by their law."""

import numpy as np
import pytest

from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.forces import rubbing

STILL = (0.0, 0.0, 0.0)
MU, PRESSED, SPEED = 0.4, 2e-5, 1e-3
EVERY = pytest.mark.parametrize("law", ["polynomial", "bilinear", "exponential"])


def half_failed(law, mu=MU):
    """A driven cube glued to a fixed one, pressed into it by PRESSED; half of the points have failed."""
    blocks = [
        Block("low", (0, 0, 0.5), size=1.0, fixed=True),
        Block("high", (0, 0, 1.5), size=1.0, driven=True, velocity=(SPEED, 0, 0)),
    ]
    s = Structure(
        blocks, ContactLaw(1e9, friction=mu), JointParameters(1e6, 1e-3, law=law, damping=0.0), gravity=STILL
    )
    failed = s.joints.xi_a[:, 1] > 1e-9
    failed &= np.arange(len(failed)) > 0
    s.joints.largest[failed] = 2e-3
    s.displace(np.array([1]), np.array([[0.0, 0.0, -PRESSED]]), np.eye(3)[None])
    return s, failed


@EVERY
def test_shear_is_the_law_where_it_holds_and_friction_where_it_has_failed(law):
    """Along, until the friction slides, and back; work goes where the law and friction say."""
    s, failed = half_failed(law)
    with s:
        j = s.joints
        area, rest = j.weight[failed].sum(), j.weight[~failed].sum()
        k, limit = j.parameters.stiffness, MU * j.parameters.closing_stiffness * PRESSED
        slide = 2.0 * limit / k
        start = s.energies()
        s.advance(slide / SPEED, slide / SPEED / 400)
        u = s.centre()[1, 0]
        holds = float(j.parameters.traction(u)) * rest
        assert -s.internal_force()[1, 0] == pytest.approx(limit * area + holds, rel=0.01)
        friction = s.energies()["friction"]
        assert friction == pytest.approx(limit * area * (u - limit / k), rel=0.02)
        s.drive("high", (-SPEED, 0, 0))
        s.advance(0.5 * limit / k / SPEED, slide / SPEED / 400)  # the spring goes back, nothing slides
        assert s.energies()["friction"] == pytest.approx(friction, rel=0.01)
        end = s.energies()
        assert balance(end) == pytest.approx(balance(start), abs=2e-3 * end["driving_work"])
        assert end["joint_dissipated"] == pytest.approx(s.law_dissipation(), abs=0.01 * end["driving_work"])
        assert s.tangent()[0].toarray()[6, 6] > 0.9 * k * area


@pytest.mark.parametrize("sliding", [0.5, 1.5, 20.0])
def test_friction_and_spring_take_the_work_of_one_long_substep(sliding):
    """A spring at half of its limit slides on by a multiple of what it stretches at most: the mean of its traction
    before and after, times the way, is what the spring gains and what friction takes, however long the substep."""
    k, limit = 1e9, 4e4
    start, way = 0.5 * limit / k, sliding * limit / k
    traction, taken = rubbing((start + way, 0.0, 0.0), (0.0, 0.0, 0.0), k, limit, (way, 0.0, 0.0))
    assert traction[0] == pytest.approx(min(limit, k * (start + way)))
    gained = (traction[0] ** 2 - (k * start) ** 2) / (2.0 * k)
    work = 0.5 * (k * start + traction[0]) * way
    assert gained + taken == pytest.approx(work)


def test_without_friction_failed_points_slide_freely():
    s, failed = half_failed("polynomial", 0.0)
    with s:
        s.advance(1e-5 / SPEED)
        u = s.centre()[1, 0]
        holds = float(s.joints.parameters.traction(u)) * s.joints.weight[~failed].sum()
        assert -s.internal_force()[1, 0] == pytest.approx(holds, rel=1e-6)


def test_friction_of_failed_points_comes_back_after_a_restore():
    s, _ = half_failed("polynomial")
    with s:
        s.advance(1e-5 / SPEED)
        saved = s.save()
        s.advance(1e-5 / SPEED)
        first, friction = s.internal_force().copy(), s.energies()["friction"]
        s.restore(saved)
        s.advance(1e-5 / SPEED)
        np.testing.assert_array_equal(s.internal_force(), first)
        assert s.energies()["friction"] == friction


def test_friction_that_is_let_go_takes_what_its_springs_hold():
    """k s²/2 on the failed part while it sticks."""
    s, failed = half_failed("polynomial")
    with s:
        j = s.joints
        k, limit = j.parameters.stiffness, MU * j.parameters.closing_stiffness * PRESSED
        slide = 0.5 * limit / k
        s.advance(slide / SPEED)
        before = float(j.rubbed.sum())
        held = j.release(np.array([0]), s._motion.x, s._motion.R)
        assert held == pytest.approx(0.5 * k * slide**2 * j.weight[failed].sum(), rel=0.02)
        assert float(j.rubbed.sum()) - before == pytest.approx(held)


def test_a_joint_that_slides_while_it_is_pressed_is_all_shear():
    """How deep it is pressed has no part in the mode."""
    s, _ = half_failed("polynomial")
    with s:
        s.advance(1e-6 / SPEED)
        table = s.joint_table()
        assert table.opening[0] == pytest.approx(-PRESSED, rel=1e-6)
        assert table.mode_mix[0] == pytest.approx(1.0)
