"""Impulses of contacts, joints and loads are all that changes the momentum of blocks, to round-off, linear and angular:
what the ledger and the split loads rest on."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

ABOUT = np.array([1.0, 2.0, -3.0])
G = 9.81


def turn(axis, angle):
    k = np.asarray(axis, float) / np.linalg.norm(axis)
    K = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def parts(structure, report, load):
    """Impulses about ABOUT of weight, load, contacts and joints on every block (n, 6)."""
    J = report.impulses
    return {
        "weight": J.of_held(structure.gravity_force(), ABOUT),
        "load": J.of_held(load, ABOUT),
        "contact": J.about(ABOUT, J.contact),
        "joint": J.about(ABOUT, J.joint),
    }


def missing(structure, load, dt, steps):
    """Largest share of the impulses of a step that the change of momentum misses, linear and angular."""
    worst, free = np.zeros(2), ~structure.fixed
    structure.set_load(load)
    for _ in range(steps):
        before = structure.momentum(ABOUT)
        found = parts(structure, structure.advance(dt), load)
        residual = structure.momentum(ABOUT) - before - sum(p[free].sum(axis=0) for p in found.values())
        for k, span in enumerate((slice(0, 3), slice(3, 6))):
            scale = sum(np.linalg.norm(p[free, span], axis=1).sum() for p in found.values())
            worst[k] = max(worst[k], np.linalg.norm(residual[span]) / scale)
    return worst


def tumbling(seed, n=4):
    rng = np.random.default_rng(seed)
    return [
        Block(
            f"b{i}",
            np.array([0.3 * (i % 2), 0.1 * i, 0.8 + 1.2 * i]),
            size=rng.uniform(0.3, 1.0, 3),
            density=2000.0,
            rotation=turn(rng.normal(size=3), 1.0),
            velocity=rng.normal(size=3),
            spin=3.0 * rng.normal(size=3),
        )
        for i in range(n)
    ], 1000.0 * rng.normal(size=(n, 6))


@settings(max_examples=5, deadline=None)
@given(st.integers(0, 1000))
def test_tumbling_blocks_that_hit_each_other_and_the_ground(seed):
    """Unequal inertias, spins, friction, impacts: the angular part holds through the turning of the axes too."""
    blocks, load = tumbling(seed)
    with Structure(blocks, ContactLaw(1e7, 0.3, 0.5), ground=0.0) as s:
        assert missing(s, load, 0.01, 60).max() < 1e-12


def test_blocks_without_contact_are_followed_all_the_same():
    blocks, load = tumbling(1)
    with Structure(blocks) as s:
        assert missing(s, load, 0.01, 10).max() < 1e-12


def test_wall_whose_joints_break():
    """Joints that fail hand their blocks over to contact within a step; nothing is lost in between."""
    blocks = wall_of_blocks("w", (0, 0, 0), (1, 0.2, 1), (0.5, 0.2, 0.25), density=2000.0, group="w")
    load = np.zeros((len(blocks), 6))
    load[:, 1] = 1500.0
    joints = JointParameters(strength=1e5, opening_at_failure=1e-3, damping=0.0)
    with Structure(blocks, ContactLaw(None, 0.3, 0.5), joints, ground=0.0) as s:
        assert missing(s, load, 0.005, 60).max() < 1e-12
        assert not s.joints.alive.all(), "no joint broke: the scene does not show what it is for"


def test_free_fall_has_its_weight_and_nothing_else():
    block = Block("b", (0, 0, 5), size=(0.4, 0.3, 0.2), density=1000.0, spin=(1.0, 2.0, 3.0))
    with Structure([block], ContactLaw(1e7, 0.3, 0.5), ground=0.0) as s:
        found = parts(s, s.advance(0.1), np.zeros((1, 6)))
        assert not found["contact"].any()
        assert not found["joint"].any()
        np.testing.assert_allclose(found["weight"][0, :3], [0, 0, -0.1 * G * 24.0], atol=1e-12)
        np.testing.assert_allclose(s.momentum(ABOUT)[:3], found["weight"][0, :3], rtol=1e-12)


def test_resting_block_is_carried_by_contact():
    """Contact carries the weight with no moment; a weight off the middle is carried with its moment."""
    block = Block("b", (0, 0, 0.5), size=(1, 1, 1), density=1000.0)
    load = np.array([[0.0, 0.0, -2000.0, 0.0, 300.0, 0.0]])
    with Structure([block], ContactLaw(1e7, 0.1, 0.5), ground=0.0) as s:
        s.set_load(load)
        s.advance(1.0)
        J = s.advance(0.1).impulses
        np.testing.assert_allclose(
            J.contact[0, :6] / 0.1, [0, 0, 1000 * G + 2000, 0, -300, 0], rtol=1e-3, atol=1.0
        )


def test_block_held_by_its_joint():
    """A block glued to a held one: the joint carries its weight without moment about its own centre (what the shear at
    the face turns, tension bends back), and the held block takes the opposite."""
    held = Block("held", (0, 0, 2), size=(1, 1, 1), density=1000.0, fixed=True)
    hanging = Block("hanging", (1.0, 0, 2), size=(1, 1, 1), density=1000.0)
    joints = JointParameters(strength=1e6, opening_at_failure=1e-3, damping=0.3)
    with Structure([held, hanging], None, joints) as s:
        s.advance(1.0)
        J = s.advance(0.05).impulses
        weight = 1000.0 * G
        np.testing.assert_allclose(J.joint[1, :3] / 0.05, [0, 0, weight], rtol=1e-3, atol=1.0)
        np.testing.assert_allclose(J.about((1.0, 0, 2), J.joint)[1, 3:] / 0.05, 0.0, atol=20.0)
        np.testing.assert_allclose(J.joint[0, :3], -J.joint[1, :3], rtol=1e-12)
        about = J.about(ABOUT, J.joint)
        np.testing.assert_allclose(about[0], -about[1], rtol=1e-9, atol=1e-9)


def test_a_step_taken_again_gives_its_own_impulses_only():
    """A second pass goes back: impulses of the first one must not stay."""
    blocks, load = tumbling(3)
    with Structure(blocks, ContactLaw(1e7, 0.3, 0.5), ground=0.0) as s:
        s.set_load(load)
        saved = s.save()
        first = s.advance(0.02).impulses
        s.restore(saved)
        again = s.advance(0.02).impulses
        np.testing.assert_array_equal(first.contact, again.contact)
        assert again.dt == pytest.approx(0.02)
