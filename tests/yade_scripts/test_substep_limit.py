"""Substeps that are forced: refused beyond the explicit limit, with the pair; reported where only accuracy suffers."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from coupler.commands.stress.structure.watch import Watch
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.dynamics.timestep import (
    CONTACT_SHARE,
    DRIVEN_SHARE,
    HOLDING_SHARE,
    QUIET,
    SOFTENING_SHARE,
    STABLE_SHARE,
    SubstepTooLong,
    contact_limits,
    exact_joint_frequency,
)
from yade_scripts.joints.cohesion import JointParameters
from yade_scripts.joints.rules import JointRules, PairJoints

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
        assert limit.stable == pytest.approx(limit.dt / HOLDING_SHARE)
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


@pytest.mark.parametrize(
    ("change", "share"),
    [
        ({}, HOLDING_SHARE),
        ({"law": "bilinear"}, HOLDING_SHARE),
        ({"closing_ratio": 4.0}, SOFTENING_SHARE),
        ({"closing_ratio": 0.5}, SOFTENING_SHARE),
        ({"mixed_mode": "needleman"}, SOFTENING_SHARE),
    ],
)
def test_joints_that_close_as_they_open_take_longer_substeps_while_they_hold(change, share):
    with Structure(two_cubes(), None, replace(JOINT, **change), gravity=STILL) as s:
        limit = s.substep_limit()
        assert limit.dt == pytest.approx(share * limit.stable)


def test_one_joint_with_a_kink_shortens_the_substep_until_it_has_failed():
    """The kink is in the weakest joint, between the cubes; what holds the low one to the ground has none."""
    kinked = replace(JOINT, closing_ratio=4.0, strength=1e4)
    rules = JointRules(JOINT, (PairJoints("low", "high", kinked),))
    with Structure(two_cubes(velocity=(0, 0, 5.0)), None, rules, ground=0.0, gravity=STILL) as s:
        before = s.substep_limit()
        assert before.dt == pytest.approx(SOFTENING_SHARE * before.stable)
        s.advance(1e-3)
        assert s.joint_table().alive.sum() == 1
        after = s.substep_limit()
        assert after.dt == pytest.approx(HOLDING_SHARE * after.stable)


def test_substeps_are_shorter_from_where_a_joint_is_pulled_fast():
    """Less than half of the strength, applied at once, on a cube at rest: it begins with long substeps and goes on with
    short ones in the same step. Going back to before it gives the same again."""
    with Structure(two_cubes(), None, JOINT, gravity=STILL) as s:
        step, stable = 0.002, s.substep_limit().stable
        s.set_load(np.array([[0.0] * 6, [0.0, 0.0, 0.4e6, 0.0, 0.0, 0.0]]))
        before = s.save()
        assert s.substep_limit().dt == pytest.approx(HOLDING_SHARE * stable)
        first = s.advance(step)
        assert first.opening_rate > QUIET / 10
        assert step / (HOLDING_SHARE * stable) + 5 < first.substeps < step / (SOFTENING_SHARE * stable)
        after = s.save().motion
        s.restore(before)
        assert s.substep_limit().dt == pytest.approx(HOLDING_SHARE * stable)
        assert s.advance(step).substeps == first.substeps
        np.testing.assert_array_equal(s.save().motion, after)


def test_blocks_that_fly_apart_begin_with_short_substeps():
    """Although no joint has opened yet; from compression, too."""
    for speed in (0.9, -0.9):
        with Structure(two_cubes(velocity=(0, 0, speed)), None, JOINT, gravity=STILL) as s:
            limit = s.substep_limit()
            assert limit.dt == pytest.approx(SOFTENING_SHARE * limit.stable)


@pytest.mark.parametrize("law", ["polynomial", "exponential", "bilinear"])
@pytest.mark.parametrize("speed", [0.1, 0.5])
def test_the_substep_of_joints_keeps_their_energy(law, speed):
    """A wall of sixteen blocks thrown about in its joints, which are damaged by a tenth and by half, all the time in
    substeps that are taken only while joints hold: it gains no energy, and the account misses a hundred-thousandth at
    most of what it was given. (With the bilinear law and a closing ratio of 4 it gains 0.6 %.)"""
    random = np.random.default_rng(1)
    blocks = []
    for i in range(4):
        for k in range(4):
            motion = {} if k == 0 else {"velocity": speed * random.standard_normal(3)}
            motion |= {} if k == 0 else {"spin": speed * random.standard_normal(3)}
            size, centre = (1.0, 0.5, 0.35), (i + 0.5, 0.25, 0.35 * (k + 0.5))
            blocks.append(Block(f"b{i}{k}", centre, size=size, density=2000.0, fixed=k == 0, **motion))
    with Structure(blocks, None, replace(JOINT, law=law), gravity=STILL) as s:
        watch = Watch(s, s.energies()["kinetic"])
        substep = HOLDING_SHARE * s.substep_limit().stable
        watch.advance(600 * substep, substep=substep)
        assert watch.gain <= 1e-5 * watch.scale
        assert watch.drift <= 1e-5 * watch.scale
        assert s.joint_table().damage.max() > 0.5 * speed


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_explicit_limit_is_where_energy_starts_to_grow(share):
    """Two blocks swing across an elastic joint, far below damage: at 0.9 of 2/ω the energy stays in bounds, at 1.1 it
    damages the joint."""
    with Structure(two_cubes(velocity=(1e-7, 0.0, 0.0)), None, JOINT, gravity=STILL) as s:
        dt = share * 2.0 / exact_joint_frequency(s.blocks, s.joints)
        s._limits = dict.fromkeys((False, True), replace(s.substep_limit(), stable=2.0 * dt))
        s.advance(200 * dt, substep=dt)
        grown = s.joint_table().damage.max()
        if share < 1.0:
            assert grown < 1e-4
        else:
            assert grown > 0.1


def test_dashpots_shorten_the_limit():
    """√(1 + ζ²) - ζ of that without: 0.618 for the joints' ζ = 1/2, and that of the restitution for contacts."""
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
        if contact is None:
            assert damped.stable / undamped.stable == pytest.approx(share, rel=1e-9)
        else:  # the fastest mode is damped more than that of the whole block
            assert damped.stable / undamped.stable < share
        assert damped.dt / undamped.dt == pytest.approx(share, rel=1e-9)


def test_the_bound_of_one_joint_is_exact_where_its_other_side_does_not_yield():
    """A block on the ground, and one that hangs on a held block: c = 1. Between two free cubes c = 2 is a bound."""
    cube, other = two_cubes()
    found = []
    for blocks, ground in (([cube], 0.0), ([cube, other.changed(fixed=True)], None), ([cube, other], None)):
        with Structure(blocks, None, JOINT, ground=ground, gravity=STILL) as s:
            assert len(s.joints) == 1
            found.append(s.substep_limit().omega / exact_joint_frequency(s.blocks, s.joints))
    assert found[:2] == pytest.approx([1.0, 1.0], rel=1e-9)
    assert 1.0 <= found[2] <= np.sqrt(2.0)


@pytest.mark.parametrize("share", [0.9, 1.1])
def test_the_limit_with_dashpots_is_where_energy_starts_to_grow(share):
    """As above, with ζ = 1/2 of the joint's first frequency: (√1.25 - 1/2) 2/ω instead of 2/ω."""
    damped = replace(JOINT, damping=0.5)
    with Structure(two_cubes(velocity=(1e-7, 0.0, 0.0)), None, damped, gravity=STILL) as s:
        dt = share * s.substep_limit().stable * s.substep_limit().omega
        dt /= exact_joint_frequency(s.blocks, s.joints)
        s._limits = dict.fromkeys((False, True), replace(s.substep_limit(), stable=2.0 * dt))
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


def test_the_most_brittle_joint_limits_the_substep_of_a_driven_block():
    """Glued to the ground by one law and to each other by one that fails at a fifth of its opening."""
    brittle = replace(JOINT, opening_at_failure=2e-4)
    rules = JointRules(JOINT, (PairJoints("low", "high", brittle),))
    with Structure(
        two_cubes(driven=True, velocity=(0, 0, 50.0)), None, rules, ground=0.0, gravity=STILL
    ) as s:
        assert s.substep_limit().dt == pytest.approx(DRIVEN_SHARE * 2e-4 / 50.0)


K = 1e7
CUBE, COLUMN, SLAB = (1.0, 1.0, 1.0), (0.3, 0.3, 1.2), (2.0, 2.0, 0.1)


def standing(size, count=1, law=None, velocity=(0.02, 0.0, 0.0), **more):
    """Blocks on one another on the ground, which slide and begin to sink into their springs."""
    height = size[2]
    blocks = [
        Block(f"b{i}", (0, 0, (i + 0.5) * height), size=size, density=2000.0, velocity=velocity, **more)
        for i in range(count)
    ]
    return Structure(blocks, law, ground=0.0)


def _motion(s, substeps, dt, looks=40):
    """Energy [J] of motion, weight and springs at the start and at `looks` times, and what the ledger is off by [J]."""
    parts = ("kinetic", "gravity", "contact_stored")
    found, before = [], s.energies()
    found.append(sum(before[part] for part in parts))
    for _ in range(looks):
        s.advance(substeps / looks * dt, substep=dt * (1.0 + 1e-12))
        now = s.energies()
        found.append(sum(now[part] for part in parts))
    taken = sum(now[part] - before[part] for part in ("dashpot", "friction"))
    return np.array(found), abs(found[-1] - found[0] + taken)


def _scale(s):
    """Energy [J] that the blocks have at the start, and that their weight puts into springs."""
    count, m = s.n, s.mass[0]
    return 0.5 * m * count * 0.02**2 + count * (count * m * 9.81) ** 2 / K


@pytest.mark.parametrize("ratio", [1.0, 9.9])
@pytest.mark.parametrize(("size", "count"), [(CUBE, 1), (CUBE, 4), (COLUMN, 1), (SLAB, 1), (SLAB, 3)])
def test_blocks_in_contact_gain_no_energy_just_below_the_limit(size, count, ratio):
    """Friction holds. At 0.95 of √(m/K) times the factor of the dashpot, which knows neither shear nor rocking, a cube
    went from 0.4 J to 24 MJ and four of them from 1.6 J to 322 J."""
    with standing(size, count, ContactLaw(K, friction=5.0, shear_ratio=ratio)) as s:
        energy, off = _motion(s, 1200, 0.95 * s.substep_limit().stable)
        assert np.diff(energy).max() < 1e-3 * _scale(s)
        assert off < 1e-4 * _scale(s)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    size=st.tuples(*[st.floats(0.1, 2.0)] * 3),
    count=st.integers(1, 3),
    ratio=st.floats(0.1, 9.99),
    e=st.floats(0.05, 0.8),
    friction=st.floats(0.3, 10.0),
    turn=st.floats(-1.0, 1.0),
)
def test_no_box_gains_energy_just_below_the_limit(size, count, ratio, e, friction, turn):
    """Any edges, stiffness along the face, restitution and friction; the blocks rock and spin as well."""
    spin = 0.02 * np.array([turn, 1.0 - abs(turn), turn]) / max(size)
    law = ContactLaw(K, restitution=e, friction=friction, shear_ratio=ratio)
    with standing(size, count, law, velocity=(0.02 * turn, 0.01, 0.0), spin=spin) as s:
        energy, off = _motion(s, 300, 0.95 * s.substep_limit().stable)
        assert np.diff(energy).max() < 2e-3 * _scale(s)
        assert off < 2e-3 * _scale(s)


@pytest.mark.parametrize("e", [0.1, 0.3])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 9.9])
def test_the_limit_of_contacts_is_at_least_a_third_of_where_energy_starts_to_grow(ratio, e):
    """A cube at rest on the ground is pushed gently: at 0.95 of the limit it comes to rest, at three limits its motion
    grows by itself."""
    with standing(CUBE, 1, ContactLaw(K, restitution=e, friction=50.0, shear_ratio=ratio)) as s:
        stable = s.substep_limit().stable
        s.advance(1.0)
        s.set_load(np.array([[10.0, 5.0, 0.0, 1.0, 2.0, 1.0]]))
        s._limits = dict.fromkeys((False, True), replace(s.substep_limit(), stable=np.inf))
        _motion(s, 2000, 0.95 * stable)
        assert s.energies()["kinetic"] < 1e-9
        s.set_load(np.zeros((1, 6)))
        _motion(s, 2000, 3.0 * stable)
        assert s.energies()["kinetic"] > 1e-3


@pytest.mark.parametrize("ratio", [0.1, 0.5])
def test_columns_side_by_side_have_the_limit_of_their_rocking(ratio):
    """ω² = c 2 K (L²/6 + K_t/K a²/4)/I with c = 2 and I = m (a² + L²)/12: a column of edge a and length L between two
    others, whose nine nodes lie at 0 and ±L/2. Elastic, so that no dashpot shortens 2/ω."""
    a, _, L = COLUMN
    with standing(COLUMN, 2, ContactLaw(K, restitution=1.0, shear_ratio=ratio)) as s:
        omega = np.sqrt(4.0 * K * (L**2 / 6.0 + ratio * a**2 / 4.0) * 12.0 / (s.mass[0] * (a**2 + L**2)))
        assert s.substep_limit().stable == pytest.approx(2.0 / omega, rel=1e-6)


def test_a_block_that_nothing_else_moving_can_meet_has_the_longer_limit():
    law, limits = ContactLaw(K, restitution=1.0, shear_ratio=9.9), []
    for count in (1, 2):
        with standing(CUBE, count, law) as s:
            limits.append(s.substep_limit().stable)
    assert limits[0] / limits[1] == pytest.approx(np.sqrt(2.0), rel=1e-6)


@pytest.mark.parametrize("e", [1e-7, 1e-6, 1e-5, 1e-4])
def test_the_limit_of_contacts_is_found_for_next_to_no_restitution(e):
    """The dashpot alone decides about it then, so that it is a number of the shape over ζ; the search for it did not
    end."""
    block, times_zeta = Block("b", (0, 0, 0.5), size=1.0, density=2000.0), []
    for law in (ContactLaw(K, restitution=e), ContactLaw(K, restitution=1e-3)):
        times_zeta.append(contact_limits([block], np.array([K]), law)[0] * law.damping_ratio)
    assert times_zeta[0] == pytest.approx(times_zeta[1], rel=1e-3)


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    size=st.tuples(*[st.floats(0.05, 3.0)] * 3),
    count=st.integers(1, 2),
    ratio=st.floats(0.05, 1.0),
    e=st.floats(0.1, 1.0),
)
def test_the_substep_of_boxes_whose_faces_are_not_stiffer_sideways_is_that_of_accuracy(size, count, ratio, e):
    """To the last bit 0.2 √(m/K) times the factor of the dashpot, which the explicit limit leaves room for."""
    law = ContactLaw(K, restitution=e, shear_ratio=ratio)
    with standing(size, count, law) as s:
        limit, z = s.substep_limit(), law.damping_ratio
        assert limit.dt == CONTACT_SHARE * (float(np.sqrt(1.0 + z**2) - z) * np.sqrt(s.mass[0] / K))
        assert limit.dt < STABLE_SHARE * limit.stable


@pytest.mark.parametrize("size", [CUBE, COLUMN, SLAB])
def test_blocks_with_stiff_shear_springs_come_to_rest_with_the_substep_of_the_program(size):
    """K_t = 10 K, two blocks: the substep is 0.9 of the explicit limit, and the ledger of energy closes."""
    with standing(size, 2, ContactLaw(K, friction=5.0, shear_ratio=9.99), velocity=(2e-3, 0.0, 0.0)) as s:
        limit = s.substep_limit()
        assert limit.dt == pytest.approx(STABLE_SHARE * limit.stable)
        assert "K_t = 9.99e+07 N/m" in limit.what
        energy, off = _motion(s, 4000, limit.dt)
        assert s.energies()["kinetic"] < 2e-4 * _scale(s)
        assert np.diff(energy).max() < 1e-3 * _scale(s)
        assert off < 1e-4 * _scale(s)
