"""Buildings at rest that take no substeps: they wake in time, and nothing is lost on the way."""

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.physics.scenes import RHO, SLICE, G, run, standing_wall
from tests.physics.test_wall_under_still_water import force_and_arm
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.equilibrium import settle
from yade_scripts.dynamics.state import StructureState
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

SHARE = 0.02
LAW = JointParameters(1e5, 1e-3, damping=0.02)
BOOKED = ("load_work", "driving_work")


def walls(sleep, count=2, shot=None, substep=None):
    """Walls 1 m x 2 m of 8 blocks, 4 m apart along x, settled on the ground; shot: velocity of a block before them."""
    blocks = []
    for k in range(count):
        blocks += wall_of_blocks(f"wall{k}", (4.0 * k, 0, 0), (0.25, 1.0, 2.0), (0.25, 0.5, 0.5))
    if shot:
        blocks.append(Block("shot", (-1.0, 0.5, 1.4), size=0.4, velocity=shot))
    s = Structure(blocks, ContactLaw(restitution=0.2), LAW, ground=0.0, sleep=sleep, substep=substep)
    settle(s)
    return s


def leaning(sleep):
    """A wall whose foot stands 1 mm deep in a bank beside it, to which no joint holds it."""
    blocks = wall_of_blocks("wall0", (0.0, 0, 0), (0.25, 1.0, 2.0), (0.25, 0.5, 0.5))
    slope = np.array([-0.2, 0.0, 1.0]) / np.hypot(0.2, 1.0)
    bank = FixedPlane((0.25, 0.0, 1e-3), slope, "bank")
    s = Structure(blocks, ContactLaw(restitution=0.2), LAW, ground=0.0, planes=[bank], sleep=sleep)
    settle(s)
    return s


def pushed(s, force, of="wall0"):
    """A load (n, 6) of `force` [N] along x on each block of a wall."""
    load = np.zeros((s.n, 6))
    load[[name.startswith(of) for name in s.names], 0] = force
    return load


def total(s):
    """Energies less the work that was put in [J]."""
    e = s.energies()
    return sum(value for name, value in e.items() if name not in BOOKED) - sum(e[name] for name in BOOKED)


def momentum_missing(s, before, report, load):
    """What the impulses of a step do not explain of the change of momentum, (6,)."""
    about, i = np.zeros(3), report.impulses
    given = i.about(about, i.contact) + i.about(about, i.joint) + i.of_held(load, about)
    given += i.of_weight(s.gravity_force(), about)
    return s.momentum(about) - before - given.sum(axis=0)


def advance(s, load, dt=5e-3):
    """A step, its momentum checked to round-off."""
    before = s.momentum(np.zeros(3))
    s.set_load(load)
    report = s.advance(dt)
    weight = dt * abs(s.gravity_force()[:, 2]).sum()
    assert np.abs(momentum_missing(s, before, report, load)).max() < 1e-7 * weight
    return report


def test_what_stands_settled_sleeps_from_the_start_and_only_what_is_pushed_wakes():
    with walls(SHARE) as s:
        assert not s.asleep.any()
        assert advance(s, pushed(s, 0.0)).substeps == 1
        assert s.asleep.all()
        one = [name.startswith("wall0") for name in s.names]
        report = advance(s, pushed(s, 2000.0))
        assert (s.asleep != one).all()
        assert report.substeps > 10
        assert np.abs(s.velocity()[one]).max() > 0.0
        assert not s.velocity()[s.asleep].any()


def test_a_load_wakes_when_it_changes_a_traction_by_the_share_of_the_strength():
    """The bending of a cantilever by a force at its top: σ = F h/(b t²/6) at the outer points of the base joint, less
    at the Gauss points; the wall must wake between half of the share by the beam and three times it."""
    with walls(SHARE, count=1) as s:
        top = np.zeros((s.n, 6))
        rows = np.flatnonzero(s.centre()[:, 2] > 1.5)
        at_share = SHARE * LAW.strength * (1.0 * 0.25**2 / 6.0) / s.centre()[rows[0], 2]
        advance(s, top)
        woke_at = None
        for part in np.arange(0.3, 4.0, 0.1):
            top[rows, 0] = part * at_share / len(rows)
            advance(s, top)
            if not s.asleep.all():
                woke_at = part
                break
        assert woke_at is not None
        assert 0.5 < woke_at < 3.0


def test_it_wakes_where_the_equilibrium_under_the_load_changes_a_traction_by_the_share():
    """By the equilibrium of the same wall without sleep: it sleeps at 0.97 of that load, and wakes at 1.03 of it."""
    with walls(None, count=1) as s:
        rows, joints = np.flatnonzero(s.centre()[:, 2] > 1.5), s.joints
        load = np.zeros((s.n, 6))
        load[rows, 0] = 50.0
        every, opened = np.arange(len(joints)), []
        for force in (0.0, 1.0):
            settle(s, force * load)
            opened.append(joints.openings(every, s._motion.x, s._motion.R))
        per_strength = (joints.k0 / LAW.strength)[:, None] * np.array([1.0, 1.0, 1.0])
        per_strength[:, 1] *= joints.beta
        change = (np.abs(opened[1] - opened[0]) * per_strength).max()
    for part, asleep in ((0.97, True), (1.03, False)):
        with walls(SHARE, count=1) as s:
            advance(s, 0.0 * load)
            advance(s, part * SHARE / change * load)
            assert s.asleep.all() == asleep


def test_what_sleeps_on_a_held_block_still_presses_on_it():
    """Two posts on a fixed slab, out of its middle: while they sleep, their joints give it the weight of both and its
    moment, as in the balance of momentum and as a reaction."""
    slab = Block("slab", (0, 0, -0.1), size=(2.0, 1.0, 0.2), fixed=True)
    posts = [Block(name, (x, 0, 0.25), size=0.5) for name, x in (("left", -0.3), ("right", 0.7))]
    with Structure([slab, *posts], None, LAW, sleep=SHARE) as s:
        settle(s)
        report = s.advance(5e-3)
        assert s.asleep.tolist() == [False, True, True]
        weight = posts[0].mass * G
        pressed, about = report.impulses.joint[0], s.centre()[0]
        assert pressed[2] == pytest.approx(-2.0 * weight * report.dt_s, rel=1e-6)
        moment = report.impulses.about(about, report.impulses.joint)[0, 4]
        assert moment == pytest.approx(0.4 * weight * report.dt_s, rel=1e-6)
        assert s.reaction()[0, 2] == pytest.approx(2.0 * weight + slab.mass * G, rel=1e-6)
        assert s.reaction()[0, 4] == pytest.approx(-0.4 * weight, rel=1e-6)


def test_what_hangs_on_a_driven_block_does_not_sleep():
    """Its joint moves its end without any load on the block."""
    blocks = [
        Block("foot", (0, 0, 0.25), size=0.5),
        Block("head", (0, 0, 0.75), size=0.5, driven=True, velocity=(0, 0, 1e-3)),
    ]
    with Structure(blocks, None, LAW, ground=0.0, sleep=SHARE) as s:
        settle(s)
        for _ in range(20):
            s.advance(5e-3)
            assert not s.asleep.any()
        assert s.centre()[0, 2] > 0.25 + 2e-5


def test_the_slowest_period_is_that_of_the_eigenvalue_problem():
    """A slab glued to the ground rocks about its foot: its turning takes part in the mode with its own inertia, which
    makes the period a sixth longer than its mass at its centre alone."""
    slab = Block("slab", (0, 0, 0.5), size=(0.25, 1.0, 1.0))
    with Structure([slab], ContactLaw(), LAW, ground=0.0, sleep=SHARE) as s:
        settle(s)
        (island,) = s._sleep.islands()
        mass = np.zeros((6, 6))
        mass[:3, :3], mass[3:, 3:] = s.mass[0] * np.eye(3), slab.inertia
        period = 2.0 * np.pi / np.sqrt(eigh(s.tangent()[0].toarray(), mass, eigvals_only=True)[0])
        assert s._sleep._slowest(island) == pytest.approx(period, rel=1e-2)


def test_what_was_displaced_stays_awake_for_a_period():
    """However little: what holds it has to be seen at its new place first."""
    with walls(SHARE, count=1) as s:
        for _ in range(10):
            advance(s, pushed(s, 0.0), 0.05)
        assert s.asleep.all()
        s.displace(np.array([s.n - 1]), np.array([[1e-9, 0.0, 0.0]]), np.eye(3)[None])
        assert not s.asleep.any()
        advance(s, pushed(s, 0.0), 1e-3)
        assert not s.asleep.any()


def test_what_was_displaced_before_it_slept_is_watched_for_another_period():
    """A wall that was displaced falls asleep after a period, but not if it was displaced again in between."""
    found, way = {}, (np.array([[1e-9, 0.0, 0.0]]), np.eye(3)[None])
    for again in (False, True):
        with walls(SHARE, count=1) as s:
            top = np.array([s.n - 1])
            advance(s, pushed(s, 0.0))
            s.displace(top, *way)
            steps = 0
            while not s.asleep.any():
                assert steps < 300, "it never sleeps"
                if again and steps == found[False] - 1:
                    s.displace(top, *way)
                s.advance(5e-3)
                steps += 1
            found[again] = steps
    assert found[False] > 3
    assert found[True] >= 2 * found[False] - 2


def test_energy_and_momentum_stay_closed_while_asleep_at_waking_and_at_falling_asleep():
    """Pushed by so little that nothing breaks, released, slowed down as water does it, asleep again."""
    with walls(SHARE) as s:
        start, scale = total(s), None
        states = []
        for k in range(200):
            load = pushed(s, 15.0 if 2 <= k < 6 else 0.0)
            advance(s, load - 2000.0 * s.velocity() * [1, 1, 1, 0, 0, 0], 0.01)
            states.append(int(s.asleep.sum()))
            scale = max(scale or 0.0, s.energies()["kinetic"])
            if k > 6 and s.asleep.all():
                break
        assert states[0] == s.n
        assert min(states) == s.n // 2
        assert states[-1] == s.n
        assert s.sleeps.figures()["falls"] == 3
        assert s.sleeps.figures()["wakes"] == 1
        assert abs(total(s) - start) < 1e-3 * scale
        assert 0.0 < s.sleeps.put_to_rest < 1e-2 * scale


def test_one_that_breaks_breaks_as_if_the_others_were_not_asleep():
    """Two walls far apart have nothing to do with each other: with equal substeps, what one does is the same whether
    the other sleeps or not."""
    found = {}
    for sleep in (SHARE, None):
        with walls(sleep, substep=5e-5) as s:
            broken = [len(advance(s, pushed(s, 8000.0)).broken) for _ in range(40)]
            first = [name.startswith("wall0") for name in s.names]
            found[sleep] = broken, s.centre()[first], s.velocity()[first]
            assert s.asleep.any() == (sleep is not None)
    assert sum(found[None][0]) > 0
    assert found[SHARE][0] == found[None][0]
    np.testing.assert_allclose(found[SHARE][1], found[None][1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(found[SHARE][2], found[None][2], rtol=0, atol=1e-7)


def test_something_loose_wakes_what_it_comes_near_to_before_it_touches():
    """A shot through the first wall: that wall takes the blow as it does without sleep; the second sleeps on."""
    found = {}
    for sleep in (SHARE, None):
        with walls(sleep, shot=(8.0, 0, 0)) as s:
            none, woke = pushed(s, 0.0), None
            for _ in range(30):
                advance(s, none)
                first = [name.startswith("wall0") for name in s.names]
                if sleep and woke is None and not s.asleep[first].any():
                    woke = s.velocity()[s.names.index("shot"), 0]
            shot = s.names.index("shot")
            found[sleep] = s.velocity()[shot], s.joint_table().alive.sum()
            if sleep:
                assert woke == pytest.approx(8.0, rel=1e-12)  # not braked yet
                assert s.asleep[[name.startswith("wall1") for name in s.names]].all()
    assert found[SHARE][1] == found[None][1] < 20
    np.testing.assert_allclose(found[SHARE][0], found[None][0], atol=0.02)


def test_what_also_presses_on_the_ground_by_contact_sleeps_and_keeps_that_contact():
    """It used to stay awake for good. Energy and momentum stay closed, and pushed over the bank it does as if it had
    never slept."""
    found = {}
    for sleep in (SHARE, None):
        with leaning(sleep) as s:
            none, start = pushed(s, 0.0), None
            for _ in range(40):
                advance(s, none - 2000.0 * s.velocity() * [1, 1, 1, 0, 0, 0], 0.01)
            assert len(s.contacts().a) > 0
            pressed = s.contacts().normal_force.sum(axis=0)
            assert s.asleep.all() == (sleep is not None)
            if sleep:
                start = total(s)
                assert advance(s, none, 0.01).substeps == 1
                assert total(s) == pytest.approx(start, abs=1e-12 * abs(start))
                np.testing.assert_allclose(s.contacts().normal_force.sum(axis=0), pressed, rtol=1e-12)
                with np.errstate(all="raise"):  # nothing limits the substep now
                    s.tangent()
            else:
                advance(s, none, 0.01)
            broken = [len(advance(s, pushed(s, 8000.0)).broken) for _ in range(15)]
            found[sleep] = sum(broken), s.centre()
    assert found[SHARE][0] == found[None][0] > 0
    np.testing.assert_allclose(found[SHARE][1], found[None][1], rtol=0, atol=1e-3)


def test_contacts_press_on_a_sleeper_as_after_a_restart():
    """It falls asleep while it still moves a little, and its contacts' dashpots with it; asleep it is at rest. With the
    forces of the dashpots its tractions would change by another share of the strength after a restart, and an island
    might wake in another step."""
    with leaning(SHARE) as s:
        load = pushed(s, 60.0)
        for k in range(400):
            s.set_load(load if k < 6 else -2000.0 * s.velocity() * [1, 1, 1, 0, 0, 0])
            s.advance(0.01)
            if k > 7 and s.asleep.all():
                break
        pressed = [sleeper.pressed.copy() for sleeper in s._sleep._sleepers]
        assert s.sleeps.put_to_rest > 0.0
        assert np.abs(pressed[0]).max() > 0.0
        saved = {name: np.array(a) for name, a in s.save().arrays().items()}
    with leaning(SHARE) as s:
        s.restore(StructureState.of(saved))
        for before, sleeper in zip(pressed, s._sleep._sleepers, strict=True):
            np.testing.assert_array_equal(sleeper.pressed, before)


@pytest.mark.parametrize("make", [walls, leaning])
@pytest.mark.parametrize("at", [1, 4, 12])
def test_a_restart_goes_on_bit_for_bit_across_sleep(at, make):
    """Saved while all sleep, while one is awake, and while it breaks; the second run begins from the saved numbers."""

    def go(s, first, last):
        for k in range(first, last):
            advance(s, pushed(s, 0.0 if k < 3 else 6000.0))

    with make(SHARE) as s:
        go(s, 0, at)
        saved = s.save().arrays()
        go(s, at, 20)
        whole = s.save().arrays()
    with make(SHARE) as s:
        s.restore(StructureState.of({name: np.array(value) for name, value in saved.items()}))
        again = s.save().arrays()
        assert all(np.array_equal(again[name], saved[name], equal_nan=True) for name in saved)
        go(s, at, 20)
        resumed = s.save().arrays()
    assert whole.keys() == resumed.keys()
    assert all(np.array_equal(whole[name], resumed[name], equal_nan=True) for name in whole)


def test_back_to_the_start_of_a_step_wakes_and_sleeps_as_often_as_wanted():
    """A step that is taken again finds the same: the second pass of the coupling."""
    with walls(SHARE) as s:
        advance(s, pushed(s, 0.0))
        start = s.save()
        found = []
        for force in (8000.0, 0.0, 8000.0):
            s.restore(start)
            assert s.asleep.all()
            advance(s, pushed(s, force))
            found.append((s.asleep.copy(), s.centre()))
        assert not np.array_equal(found[0][0], found[1][0])
        assert np.array_equal(found[0][0], found[2][0])
        assert np.array_equal(found[0][1], found[2][1])


def breaking_time(sleep):
    """Step in which the base of a wall under a level that rises by 2.5 mm a step opens beyond failure at its edge, who
    slept in each, and how many substeps it took."""
    coupling = standing_wall(0.94, strength=1e5, opening=2e-4, sleep=sleep, passes=1)
    with coupling.structure as s:
        asleep, substeps = [], 0
        for k in range(80):
            depth = 0.94 + 2.5e-3 * k
            load = np.zeros((s.n, 6))
            for row, centre in enumerate(s.centre()):
                low, high = centre[2] - 0.125, centre[2] + 0.125
                force, arm = force_and_arm(low, high, depth)
                load[row, 0], load[row, 4] = force, force * arm
            s.set_load(load)
            report = s.advance(0.02)
            asleep.append(bool(s.asleep.all()))
            substeps += report.substeps
            if s.joint_damage()[0].max() >= 1.0:
                return k, asleep, substeps
    raise AssertionError("did not break")


def test_a_wall_under_water_that_rises_breaks_in_the_same_step_as_without_sleep():
    """Its load grows by hundredths of what it carries: it sleeps through the first of them, wakes, and breaks when the
    one that never slept does."""
    awake, slept = breaking_time(None), breaking_time(SHARE)
    assert abs(awake[0] - slept[0]) <= 1
    assert not any(awake[1])
    assert slept[1][0]
    assert not slept[1][-1]
    assert slept[2] < awake[2]


def test_a_wall_under_still_water_sleeps_with_the_water_beside_it():
    """Coupled steps: the wall is asleep, its load hydrostatic, volume, energy and momentum kept."""
    coupling = standing_wall(1.0, sleep=SHARE, passes=1)
    with coupling.structure as s:
        place, records = s.centre(), []
        run(coupling, 0.1, records.append)
        assert s.asleep.all()
        assert {record.substeps for record in records} == {1}
        assert np.array_equal(s.centre(), place)
        assert records[-1].load[:, 0].sum() == pytest.approx(0.5 * RHO * G * SLICE, rel=1e-3)
        assert records[-1].balance.energy_error < 1e-4
        assert max(record.momentum.error for record in records) < 1e-9
