"""Contact that goes on where a pressed joint fails begins with the force that the joint had, whatever its stiffness,
and with no more energy than the springs of the joint held; what they held beyond that is booked once."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

JOINT = JointParameters(1e5, 1e-3, damping=0.0)
KC = JOINT.closing_stiffness
PUSH, DT = 1e5, 5e-6
DEPTH = PUSH / KC


def scene(low, high, stiffness, depth, turn=None, friction=0.5, push=(0.0, 0.0, -PUSH)):
    """Block `high` on `low`, pressed `depth` into it and turned by a rotation vector, under a push."""
    s = Structure([low, high], ContactLaw(stiffness, friction=friction), JOINT, gravity=(0.0, 0.0, 0.0))
    turned = Rotation.from_rotvec(np.zeros(3) if turn is None else turn).as_matrix()
    s.displace(np.array([1]), np.array([[0.0, 0.0, -depth]]), turned[None])
    s.set_load(np.array([np.zeros(6), [*push, 0.0, 0.0, 0.0]]))
    return s


def cubes(ratio, **more):
    """A cube of 1 m on a fixed one; contact `ratio` times as stiff as the joint."""
    low = Block("low", (0, 0, 0.5), size=1.0, fixed=True)
    return scene(low, Block("high", (0, 0, 1.5), size=1.0, density=2000.0), ratio * KC, DEPTH, **more)


def beams(ratio, push=(0.0, 0.0, -PUSH), friction=0.5):
    """Two beams across each other, where neither has a node in the other."""
    low = Block("low", (0.5, 0.0, -0.2), size=(4.0, 0.4, 0.4), density=2000.0, fixed=True)
    high = Block("high", (0.0, 0.7, 0.2), size=(0.4, 4.0, 0.4), density=2000.0)
    stiffness = KC * 0.4**2
    return scene(low, high, ratio * stiffness, PUSH / stiffness, push=push, friction=friction)


def fail(s):
    """Let the joint fail within the next substep. → energies before"""
    s.advance(DT, DT)
    before = s.energies()
    s.joints.largest[:] = 2.0 * JOINT.opening_at_failure
    s.advance(2 * DT, DT)
    assert not s.joints.alive.any()
    return before


def pressing(s):
    c = s.contacts()
    return float((c.kn * np.maximum(c.depth, 0.0)).sum())


@pytest.mark.parametrize("ratio", [0.5, 1.0, 5.0, 25.0])
def test_neither_force_nor_energy_jumps(ratio):
    with cubes(ratio) as s:
        before = fail(s)
        held = before["joint_stored"]
        assert held == pytest.approx(0.5 * PUSH * DEPTH, rel=1e-3)
        e = s.energies()
        assert balance(e) == pytest.approx(balance(before), abs=0.01 * held)
        stiffer = max(ratio, 1.0)
        assert e["contact_stored"] == pytest.approx(held * min(ratio, 1.0) / stiffer, rel=0.01)
        assert e["friction"] == pytest.approx(
            held * (1.0 - min(ratio, 1.0) / stiffer), rel=0.01, abs=0.01 * held
        )
        if ratio >= 1.0:
            s.advance(0.02)
            assert s.centre()[1, 2] == pytest.approx(1.5 - DEPTH, abs=1e-3 * DEPTH), "it stays at rest"
            assert s.energies()["kinetic"] < 1e-6 * held


@pytest.mark.parametrize("ratio", [0.5, 1.0, 5.0])
def test_edges_that_cross_take_over_the_force_of_a_joint(ratio):
    """The corners of what lies on one another carry the force of the joint at once, or what a softer contact bears at
    that depth. From nothing, the beam would be let fall by a depth and swing."""
    with beams(ratio) as s:
        before = fail(s)
        held = before["joint_stored"]
        contacts = s.contacts()
        corners = [(x, y) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
        assert sorted(map(tuple, contacts.point[:, :2].round(5))) == sorted(corners)
        assert pressing(s) == pytest.approx(min(ratio, 1.0) * PUSH, rel=0.01)
        e = s.energies()
        assert e["contact_stored"] == pytest.approx(held * min(ratio, 1.0 / ratio), rel=0.01)
        assert balance(e) == pytest.approx(balance(before), abs=0.01 * held)


@pytest.mark.parametrize("ratio", [1.0, 5.0, 100.0])
@pytest.mark.parametrize("edge", [1.0, 4.0])
def test_a_small_joint_between_large_faces(ratio, edge):
    """Only the area that was joined counts, not the faces of the blocks."""
    low = Block("low", (0.0, 0.0, -0.5), size=(edge, edge, 1.0), fixed=True)
    high = Block("high", (0.5 * edge, 0.0, 0.5), size=(1.0, 1.0, 1.0), density=2000.0)
    depth = PUSH / (0.5 * KC)
    with scene(low, high, ratio * KC, depth) as s:
        assert s.joints.area.sum() == pytest.approx(0.5)
        before = fail(s)
        held = before["joint_stored"]
        assert held == pytest.approx(0.5 * PUSH * depth, rel=2e-3)
        assert pressing(s) == pytest.approx(PUSH, rel=0.02)
        assert balance(s.energies()) == pytest.approx(balance(before), abs=0.01 * held)


@pytest.mark.parametrize("turn", [(2e-4, 0.0, 0.0), (1e-3, 0.0, 0.0), (6e-4, 4e-4, 1e-4)])
@pytest.mark.parametrize("ratio", [0.5, 1.0, 5.0, 100.0])
def test_a_bent_joint(ratio, turn):
    """Nodes lie on the rim, where a bent joint is pressed most: they must not hold more than it did."""
    with cubes(ratio, turn=turn) as s:
        force = s.joints.pressing(np.array([0]), s._motion.x, s._motion.R)[0]
        before = fail(s)
        held, e = before["joint_stored"], s.energies()
        assert balance(e) == pytest.approx(balance(before), abs=0.02 * held)
        assert e["contact_stored"] <= 1.02 * held
        assert e["friction"] >= -1e-12 * held
        if ratio >= 5.0:
            assert pressing(s) == pytest.approx(force, rel=0.03)


@pytest.mark.parametrize("build", [cubes, beams])
@pytest.mark.parametrize("ratio", [1.0, 5.0])
@pytest.mark.parametrize("friction", [0.0, 0.2, 0.8])
def test_a_push_along_the_joint(build, ratio, friction):
    """What slides and what sticks after the take-over keeps the balance, and slides as friction lets it."""
    along = 0.5 * PUSH
    with build(ratio, push=(along, 0.0, -PUSH), friction=friction) as s:
        before = fail(s)
        held, v = before["joint_stored"], s._motion.v[1, 0]
        s.advance(2e-3, DT)
        e = s.energies()
        assert balance(e) == pytest.approx(balance(before), abs=0.02 * (held + e["load_work"]))
        if build is cubes and friction < 0.5:
            mass = s.blocks[1].mass
            rate = (s._motion.v[1, 0] - v) / 2e-3
            assert rate == pytest.approx((along - friction * PUSH) / mass, rel=0.05)


def test_on_the_ground():
    """The same on a fixed plane, with a block turned into it."""
    high = Block("high", (0, 0, 0.5), size=1.0, density=2000.0)
    floor = FixedPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    contact = ContactLaw(20.0 * KC, friction=0.0)
    with Structure([high], contact, JOINT, planes=[floor], gravity=(0.0, 0.0, 0.0)) as s:
        turned = Rotation.from_rotvec((1e-3, 0.0, 0.0)).as_matrix()
        s.displace(np.array([0]), np.array([[0.0, 0.0, -DEPTH]]), turned[None])
        s.set_load(np.array([[0.0, 0.0, -PUSH, 0.0, 0.0, 0.0]]))
        before = fail(s)
        held, e = before["joint_stored"], s.energies()
        assert balance(e) == pytest.approx(balance(before), abs=0.01 * held)
        assert 0.0 < e["friction"] <= held


def test_without_contact_the_springs_are_lost():
    """In a scene without contact a joint that fails under compression takes its energy along."""
    low = Block("low", (0, 0, 0.5), size=1.0, fixed=True)
    with Structure([low, Block("high", (0, 0, 1.5), size=1.0)], None, JOINT, gravity=(0.0, 0.0, 0.0)) as s:
        s.displace(np.array([1]), np.array([[0.0, 0.0, -DEPTH]]), np.eye(3)[None])
        before = fail(s)
        assert balance(s.energies()) == pytest.approx(balance(before), abs=1e-3 * before["joint_stored"])


def row_that_breaks(seek):
    """Four cubes in a row, bonded to one another and to the floor, whose joints fail one after the other → places and
    velocities, work that friction took, and how often neighbours were looked for. seek: looked for at each failure."""
    blocks = [
        Block(f"cube {k}", (k, 0, 0.5), size=1.0, density=2000.0, velocity=(v, 0.0, -0.2))
        for k, v in enumerate((0.3, 0.1, -0.1, -0.3))
    ]
    with Structure(blocks, ContactLaw(2.0 * JOINT.closing_stiffness), JOINT, ground=0.0) as s:
        searches, contacts = [], s._contacts
        look = contacts._neighbours
        contacts._neighbours = lambda: searches.append(None) or look()
        if seek:
            contacts._add_pairs = lambda parted: contacts.search()
        for joint in range(len(s.joints)):
            s.advance(40 * DT, DT)
            s.joints.largest[s.joints.joint_of == joint] = 2.0 * JOINT.opening_at_failure
            s.advance(40 * DT, DT)
        assert not s.joints.alive.any()
        assert len(s.contacts()) > 0
        return s.centre().copy(), s.velocity().copy(), s.energies()["friction"], len(searches)


def test_a_joint_that_fails_adds_its_blocks_to_the_known_neighbours():
    """The same bits as from looking for all neighbours anew, without looking."""
    *kept, few = row_that_breaks(seek=False)
    *anew, many = row_that_breaks(seek=True)
    assert all((a == b).all() for a, b in zip(map(np.asarray, kept), map(np.asarray, anew)))
    assert kept[2] > 0.0
    assert (few, many) == (0, 7)
