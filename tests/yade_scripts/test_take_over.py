"""Contact that goes on where a pressed joint fails begins with the force that the joint had, whatever its stiffness."""

import numpy as np
import pytest

from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

JOINT = JointParameters(1e5, 1e-3, damping=0.0)
PUSH, DT = 1e5, 5e-6
DEPTH = PUSH / JOINT.closing_stiffness


def pressed(ratio):
    """A cube of 1 m on a fixed one, at rest under PUSH; contact `ratio` times as stiff as the joint."""
    blocks = [
        Block("low", (0, 0, 0.5), size=1.0, fixed=True),
        Block("high", (0, 0, 1.5), size=1.0, density=2000.0),
    ]
    s = Structure(blocks, ContactLaw(ratio * JOINT.closing_stiffness), JOINT, gravity=(0.0, 0.0, 0.0))
    s.displace(np.array([1]), np.array([[0.0, 0.0, -DEPTH]]), np.eye(3)[None])
    s.set_load(np.array([np.zeros(6), [0.0, 0.0, -PUSH, 0.0, 0.0, 0.0]]))
    return s


def balance(e):
    works = ("load_work", "driving_work")
    return sum(v for k, v in e.items() if k not in works) - sum(e[k] for k in works)


@pytest.mark.parametrize("ratio", [0.5, 1.0, 5.0, 25.0])
def test_neither_force_nor_energy_jumps(ratio):
    with pressed(ratio) as s:
        s.advance(DT, DT)
        held = s.energies()["joint_stored"]
        start = balance(s.energies())
        assert held == pytest.approx(0.5 * PUSH * DEPTH, rel=1e-3)
        s.joints.largest[:] = 2.0 * JOINT.opening_at_failure
        s.advance(2 * DT, DT)
        assert not s.joints.alive.any()
        e = s.energies()
        assert balance(e) == pytest.approx(start, abs=0.01 * held)
        stiffer = max(ratio, 1.0)
        assert e["contact_stored"] == pytest.approx(held * min(ratio, 1.0) / stiffer, rel=0.01)
        assert e["friction"] == pytest.approx(
            held * (1.0 - min(ratio, 1.0) / stiffer), rel=0.01, abs=0.01 * held
        )
        if ratio >= 1.0:
            s.advance(0.02)
            assert s.centre()[1, 2] == pytest.approx(1.5 - DEPTH, abs=1e-3 * DEPTH), "it stays at rest"
            assert s.energies()["kinetic"] < 1e-6 * held


@pytest.mark.parametrize("ratio", [0.5, 1.0])
def test_edges_that_cross_take_over_the_force_of_a_joint(ratio):
    """Two beams across each other, where neither has a node in the other: the corners of what lies on one another carry
    the force of the joint at once, or what a softer contact bears at that depth. From nothing, the beam would be let
    fall by a depth and swing."""
    area = 0.4**2
    stiffness = JOINT.closing_stiffness * area
    depth = PUSH / stiffness
    low = Block("low", (0.5, 0.0, -0.2), size=(4.0, 0.4, 0.4), density=2000.0, fixed=True)
    high = Block("high", (0.0, 0.7, 0.2), size=(0.4, 4.0, 0.4), density=2000.0)
    with Structure([low, high], ContactLaw(ratio * stiffness), JOINT, gravity=(0.0, 0.0, 0.0)) as s:
        s.displace(np.array([1]), np.array([[0.0, 0.0, -depth]]), np.eye(3)[None])
        s.set_load(np.array([np.zeros(6), [0.0, 0.0, -PUSH, 0.0, 0.0, 0.0]]))
        s.advance(DT, DT)
        s.joints.largest[:] = 2.0 * JOINT.opening_at_failure
        s.advance(2 * DT, DT)
        assert not s.joints.alive.any()
        contacts = s.contacts()
        corners = [(x, y) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
        assert sorted(map(tuple, contacts.point[:, :2].round(5))) == sorted(corners)
        assert (contacts.kn * contacts.depth).sum() == pytest.approx(ratio * PUSH, rel=0.01)
        assert s.energies()["contact_stored"] == pytest.approx(0.5 * ratio * PUSH * depth, rel=0.01)
