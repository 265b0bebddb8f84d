"""The state of a structure goes through a file into a new process, which goes on bit for bit."""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from yade_scripts.blocks.block import Block
from yade_scripts.blocks.generators.column import column_of_boxes
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics.state import OtherStructure, StructureState
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

STILL = (0.0, 0.0, 0.0)
WEDGE = np.array([[0.1, 0, 0.6], [0.6, 0, 0.6], [0.1, 0.4, 0.6], [0.1, 0, 0.9]])


def torn():
    """A joint being torn by a driven block, half open at half time, with damping and shear."""
    blocks = [
        Block("a", (0, 0, 0.5), size=1.0, fixed=True),
        Block("b", (0, 0, 1.5), size=1.0, driven=True, velocity=(0.004, 0, 0.01), spin=(0, 1e-3, 0)),
    ]
    return Structure(blocks, None, JointParameters(1e6, 1e-3, damping=0.05), gravity=STILL)


def hanging():
    """A chain that stretches under a load that is held, opening its joints part of the way, faster and faster."""
    blocks = column_of_boxes("c", (0, 0, 0), (1.0, 1.0, 3), 3)
    s = Structure(
        blocks, None, JointParameters(1e6, 2e-3, law="bilinear", damping=0.0), ground=0.0, gravity=STILL
    )
    load = np.zeros((3, 6))
    load[2] = (2e5, 1e5, 4e5, 1e4, -2e4, 3e4)
    s.set_load(load)
    return s


def bouncing():
    """Blocks that spin, bounce and slide: a box and a wedge on the ground, one on the other."""
    blocks = [
        Block("box", (0, 0, 0.3), size=(0.5, 0.4, 0.3), velocity=(1.0, 0.2, -1.0), spin=(1.0, 4.0, 2.0)),
        Block.standing("wedge", WEDGE, velocity=(0.5, 0, -2.0), spin=(2.0, 1.0, 0)),
    ]
    return Structure(blocks, ContactLaw(stiffness=1e6, restitution=0.6, friction=0.3), None, ground=0.0)


def collapsing():
    """A wall that a shot breaks: joints half open and gone, pieces sliding on one another and on the ground."""
    blocks = [
        *wall_of_blocks("w", (0, -0.25, 0), (3.0, 0.5, 3.0), (1.0, 0.5, 1.0)),
        Block("shot", (1.5, -0.7, 1.5), size=0.6, density=5000.0, velocity=(0, 12.0, 0)),
    ]
    return Structure(blocks, ContactLaw(), JointParameters(2e5, 2e-3, damping=0.0), ground=0.0)


def tumbling():
    """Debris of all shapes that falls, spins and lies on other debris: contacts of corners and of edges."""
    draw = np.random.default_rng(4)
    blocks = []
    for i in range(12):
        block = Block(
            f"b{i}",
            np.array([0.8 * (i % 3), 0.8 * (i // 3 % 2), 0.7 + 0.8 * (i // 6)]) + draw.uniform(-0.1, 0.1, 3),
            size=draw.uniform(0.1, 0.9, 3),
            rotation=Rotation.from_rotvec(draw.uniform(-2.0, 2.0, 3)).as_matrix(),
            velocity=draw.uniform(-1.0, 1.0, 3),
            spin=draw.uniform(-6.0, 6.0, 3),
        )
        if i % 3 == 0:
            corners = WEDGE - WEDGE.mean(axis=0) + block.centre
            block = Block.standing(block.name, corners, velocity=block.velocity, spin=block.spin)
        blocks.append(block)
    return Structure(blocks, ContactLaw(stiffness=3e6, restitution=0.4, friction=0.4), None, ground=0.0)


def scattered():
    """A wall that four boxes knock over; its blocks come to lie on one another with their edges crossed."""
    draw = np.random.default_rng(3)
    blocks = wall_of_blocks("w", (0, -0.25, 0), (3.0, 0.3, 3.0), (1.0, 0.3, 0.5))
    for i in range(4):
        shot = Block(
            f"s{i}",
            (0.3 + 0.8 * i, -1.2 - 0.2 * i, 1.0 + 0.5 * i),
            size=draw.uniform(0.3, 0.8, 3),
            rotation=Rotation.random(random_state=i).as_matrix(),
            velocity=(0, 9.0, 0),
            spin=draw.uniform(-5.0, 5.0, 3),
        )
        blocks.append(shot)
    return Structure(blocks, ContactLaw(), JointParameters(3e4, 2e-3, damping=0.0), ground=0.0)


def turning():
    """Two beams that turn nearly on the spot until one meets the other."""
    size = (1.0, 0.12, 0.2)
    blocks = [
        Block("a", (0, 0, 0), size=size, velocity=(0.01, 0, 0), spin=(0, 0, 2.0)),
        Block("b", (0.1, 0.5, 0.03), size=size, spin=(0, 0, 1.0)),
    ]
    return Structure(blocks, ContactLaw(stiffness=1e6, restitution=0.6), None, gravity=STILL)


SCENES = {
    "torn": (torn, 0.004, 10),
    "hanging": (hanging, 0.004, 10),
    "bouncing": (bouncing, 0.02, 20),
    "collapsing": (collapsing, 0.004, 16),
    "scattered": (scattered, 0.004, 380),
    "tumbling": (tumbling, 0.01, 120),
    "turning": (turning, 0.01, 80),
}
"""How to build it, length of a step [s], steps."""


def steps(s, name, first, last):
    """Go from step `first` to `last`; every figure that a step leaves."""
    rows = []
    for _ in range(first, last):
        report = s.advance(SCENES[name][1])
        e = s.energies()
        rows.append(
            [s.time, report.substeps, report.load_work, len(report.broken), len(s.contacts()), *e.values()]
        )
    return np.array(rows)


def figures(s, rows):
    """All that tells the end of a scene."""
    out = {"rows": rows, "centre": s.centre(), "rotation": s.rotation(), "velocity": s.velocity()}
    table = s.joint_table()
    if table is not None:
        out |= {f"joints.{name}": value for name, value in vars(table).items()}
    contacts = s.contacts()
    out |= {f"contacts.{name}": value for name, value in vars(contacts).items()}
    return out


def path(name, before_step):
    """Places and velocities (steps, n, 15) of a scene; before_step(structure, step): called before each."""
    build, dt, count = SCENES[name]
    rows = []
    with build() as s:
        for k in range(count):
            before_step(s, k)
            s.advance(dt)
            rows.append(np.concatenate([s.centre(), s.rotation().reshape(s.n, 9), s.velocity()], axis=1))
    return np.array(rows)


def search_in_each_substep(s, k):
    if k == 0:
        contacts, settle = s._contacts, s._contacts.settle

        def settle_and_search(dt):
            settle(dt)
            contacts.search()

        contacts.settle = settle_and_search


def go_back_to_here(s, k):
    s.restore(StructureState.of(s.save().arrays()))


@pytest.mark.parametrize("disturb", [search_in_each_substep, go_back_to_here, lambda s, k: s.save()])
@pytest.mark.parametrize("name", ["bouncing", "collapsing", "scattered", "tumbling", "turning"])
def test_when_neighbours_are_looked_for_and_contacts_are_read_changes_no_bit(name, disturb):
    """What a restarted scene does not know is when the neighbours were looked for last; and neither that nor how often
    somebody has looked at the contacts is part of the physics."""
    np.testing.assert_array_equal(path(name, disturb), path(name, lambda s, k: None))


def rolling():
    """A plate that comes down slowly and rolls over the edges of another one."""
    turn = Rotation.from_rotvec
    return Structure(
        [
            Block("low", (0, 0, 0), (4, 3, 0.4), rotation=turn((0.5, 0.9, 0.2)).as_matrix(), fixed=True),
            Block("high", (0, 0, 2.4), (4, 3, 0.4), rotation=turn((-0.7, 0.4, 1.3)).as_matrix()),
        ],
        ContactLaw(2e9, 0.3, 0.3),
        gravity=(0.0, 0.0, -0.2),
    )


def test_a_restored_state_is_saved_as_it_was():
    """The histories of all contacts, and how far edges in contact may move until others are sought: what is forgotten
    changes the motion only where the next search would have found other edges."""
    names, held = ("calm", "shear", "push", "speed", "overlap"), False
    with rolling() as s:
        while not held:
            assert s.time < 8.0, "no edges carried"
            s.advance(0.02)
            saved = s.save().arrays()
            held = all(np.any(saved[f"contacts/{name}"] > 0.0) for name in names)
    with rolling() as s:
        s.restore(StructureState.of(saved))
        again = s.save().arrays()
    assert set(again) == set(saved)
    for name, values in saved.items():
        np.testing.assert_array_equal(again[name], values, err_msg=name)


def test_beams_that_turn_on_the_spot_meet_before_they_are_in_one_another():
    """The neighbours are looked for in time where no centre moves."""
    with turning() as s:
        depths = [0.0]
        while s.time < 0.7:
            s.advance(1e-3)
            depths.append(max(s.contacts().depth.max(initial=0.0), s.deepest()[2].max(initial=0.0)))
    assert 0.0 < max(depths) < 0.01


CHILD = """
import sys
import numpy as np
from tests.yade_scripts.test_restart import SCENES, figures, steps
from yade_scripts.dynamics.state import StructureState
name, state, result = sys.argv[1:]
build, _, count = SCENES[name]
with build() as s, np.load(state) as arrays:
    s.restore(StructureState.of(arrays))
    np.savez(result, **figures(s, steps(s, name, count // 2, count)))
"""


def in_a_new_process(*words):
    subprocess.run([sys.executable, "-c", CHILD, *map(str, words)], check=True, env=os.environ)


@pytest.mark.parametrize("name", SCENES)
def test_continued_and_restarted_are_the_same_to_the_last_bit(name, tmp_path):
    """Positions, velocities, contacts, joints, energies and substeps of the second half of a scene: in the process that
    began it, and in a new one that knows only how it was built and the file."""
    build, _, count = SCENES[name]
    with build() as s:
        steps(s, name, 0, count // 2)
        table, contacts = s.joint_table(), s.contacts()
        if name == "collapsing":
            assert 0 < (~table.alive).sum() < len(table)
            assert ((table.damage > 0.05) & table.alive).any()
            assert contacts.slides.any()
        if name in ("torn", "hanging"):
            assert ((table.damage > 0.05) & table.alive).all()
        np.savez(tmp_path / "state.npz", **s.save().arrays())
        expected = figures(s, steps(s, name, count // 2, count))
    in_a_new_process(name, tmp_path / "state.npz", tmp_path / "result.npz")
    with np.load(tmp_path / "result.npz") as found:
        assert set(found) == set(expected)
        for key in expected:
            np.testing.assert_array_equal(found[key], expected[key], err_msg=key)
    assert expected["rows"][:, 1].min() > 1


def test_arrays_and_back_lose_nothing():
    with collapsing() as s:
        steps(s, "collapsing", 0, 5)
        state = s.save()
        flat = StructureState.of(state.arrays()).arrays()
    assert set(flat) == set(state.arrays())
    for name, value in state.arrays().items():
        np.testing.assert_array_equal(flat[name], value, err_msg=name)


def test_contacts_that_are_just_taking_over_from_a_joint_are_part_of_the_state():
    """A joint under compression fails in the very last substep before the state is saved: the contact begins with the
    depth that the joint had, in both."""
    with Structure(
        column_of_boxes("c", (0, 0, 0), (1.0, 1.0, 4), 4),
        ContactLaw(),
        JointParameters(2e5, 1e-3, damping=0.0),
        ground=0.0,
    ) as s:
        s.advance(0.05)
        s.joints.largest[s.joints.joint_of == 1] = 1.01e-3
        assert s.advance(s.stable_substep()[0]).broken.tolist() == [1]
        state = s.save()
        s.advance(0.002)
        expected = s.centre()
        s.restore(state)
        s.advance(0.002)
        assert len(s.contacts()) > 0
        np.testing.assert_array_equal(s.centre(), expected)


def test_the_speed_of_a_driven_block_is_restored_with_the_substep_that_it_asks_for():
    """`drive` after the start is part of the state: the substep follows the motion, not the description."""
    with torn() as s:
        s.drive("b", velocity=(0, 0, 0.03))
        limit = s.stable_substep()
        s.advance(0.004)
        state = s.save()
        s.drive("b", velocity=(0, 0, -0.001))
        s.restore(state)
        assert s.stable_substep() == limit
        assert s.velocity()[1, 2] == 0.03


def test_a_state_of_another_structure_is_refused_with_the_difference():
    with collapsing() as s:
        state = s.save()
    with (
        bouncing() as s,
        pytest.raises(OtherStructure, match="blocks: 10 in the state, 2 here; points of joints: "),
    ):
        s.restore(state)
    arrays = state.arrays()
    del arrays["motion"]
    with pytest.raises(OtherStructure, match="motion missing"):
        StructureState.of(arrays)
