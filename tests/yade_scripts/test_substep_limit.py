"""Substeps that are forced: refused beyond the explicit limit, with the pair; reported where only accuracy suffers."""

from dataclasses import replace

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.dynamics.timestep import DRIVEN_SHARE, SubstepTooLong, exact_joint_frequency
from yade_scripts.joints.cohesion import JointParameters

STILL = (0.0, 0.0, 0.0)
JOINT = JointParameters(1e6, 1e-3, damping=0.0)


def two_cubes(**more):
    return [
        Block("low", (0, 0, 0.5), size=1.0, density=2000.0),
        Block("high", (0, 0, 1.5), size=1.0, density=2000.0, **more),
    ]


def test_a_substep_beyond_the_explicit_limit_is_refused_with_the_pair():
    """In a single step and for the whole structure; nothing has moved then."""
    with Structure(two_cubes(), None, JOINT, gravity=STILL) as s:
        limit = s.substep_limit()
        assert limit.stable == pytest.approx(10.0 * limit.dt)
        with pytest.raises(SubstepTooLong, match="joint low - high"):
            s.advance(1.0, substep=1.01 * limit.stable)
        assert s.time == 0.0
    with pytest.raises(SubstepTooLong, match="unstable beyond"):
        Structure(two_cubes(), None, JOINT, gravity=STILL, substep=1.01 * limit.stable)


def test_a_substep_that_is_only_inaccurate_is_reported():
    with Structure(two_cubes(), ContactLaw(1e8), gravity=STILL) as s:
        limit = s.substep_limit()
        assert limit.remark(limit.dt) == ""
        assert "contact of block" in limit.remark(2.0 * limit.dt)


def test_the_substep_of_the_structure_is_taken():
    with Structure(two_cubes(), None, JOINT, gravity=STILL, substep=1e-6) as s:
        assert s.advance(1e-5).substeps == 10


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_explicit_limit_is_where_energy_starts_to_grow(share):
    """Two blocks swing across an elastic joint, far below damage: at 0.9 of 2/ω the energy stays in bounds, at 1.1 it
    damages the joint."""
    with Structure(two_cubes(velocity=(1e-7, 0.0, 0.0)), None, JOINT, gravity=STILL) as s:
        dt = share * 2.0 / exact_joint_frequency(s.blocks, s.joints)
        s._limit = replace(s.substep_limit(), stable=2.0 * dt)
        s.advance(200 * dt, substep=dt)
        grown = s.joint_table().damage.max()
        if share < 1.0:
            assert grown < 1e-4
        else:
            assert grown > 0.1


def test_dashpots_shorten_the_limit():
    """√(1 + ζ²) - ζ of the limit without: 0.618 for the joints' ζ = 1/2, and that of the restitution for contacts."""
    for contact, joints, damping in [
        (None, JOINT, 0.5),
        (ContactLaw(1e8, restitution=0.1), None, ContactLaw(1e8, restitution=0.1).damping_ratio),
    ]:
        damped_joints = joints and replace(joints, damping=damping)
        undamped_contact = contact and replace(contact, restitution=1.0)
        with Structure(two_cubes(), contact, damped_joints, gravity=STILL) as s:
            damped = s.substep_limit()
        with Structure(two_cubes(), undamped_contact, joints, gravity=STILL) as s:
            undamped = s.substep_limit()
        share = np.sqrt(1.0 + damping**2) - damping
        assert share < 0.75
        assert damped.stable / undamped.stable == pytest.approx(share, rel=1e-9)
        assert damped.dt / undamped.dt == pytest.approx(share, rel=1e-9)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_limit_with_dashpots_is_where_energy_starts_to_grow(share):
    """As above, with ζ = 1/2 of the joint's first frequency: (√1.25 - 1/2) 2/ω instead of 2/ω."""
    damped = replace(JOINT, damping=0.5)
    with Structure(two_cubes(velocity=(1e-7, 0.0, 0.0)), None, damped, gravity=STILL) as s:
        dt = share * s.substep_limit().stable * s.substep_limit().omega
        dt /= exact_joint_frequency(s.blocks, s.joints)
        s._limit = replace(s.substep_limit(), stable=2.0 * dt)
        s.advance(200 * dt, substep=dt)
        grown = s.joint_table().damage.max()
        if share < 1.0:
            assert grown < 1e-4
        else:
            assert grown > 0.01


@pytest.mark.parametrize(
    ("motion", "speed"),
    [
        ({"velocity": (0.0, 0.0, 300.0)}, 300.0),
        ({"spin": (0.0, 400.0, 0.0)}, 400.0 * np.sqrt(0.75)),
        ({"velocity": (0.0, 0.0, 300.0), "spin": (0.0, 400.0, 0.0)}, 300.0 + 400.0 * np.sqrt(0.75)),
    ],
)
def test_a_driven_block_opens_no_joint_by_more_than_a_share_of_its_opening_in_a_substep(motion, speed):
    """Moved on, turned, or both: the fastest point of the cube is one of its corners."""
    with Structure(two_cubes(driven=True, **motion), None, JOINT, gravity=STILL) as s:
        limit = s.substep_limit()
        assert limit.dt == pytest.approx(DRIVEN_SHARE * JOINT.opening_at_failure / speed)
        assert "prescribed motion of block high" in limit.what
