"""Start at rest: settled structures do not move, deflect as beams of blocks do, and refuse what cannot stand."""

import re

import numpy as np
import pytest

from coupler.commands.verify.figures import columns
from yade_scripts.blocks.block import Block
from yade_scripts.blocks.faces import FixedPlane
from yade_scripts.blocks.generators.building import Building, Opening, building_blocks
from yade_scripts.blocks.generators.wall import wall_of_blocks
from yade_scripts.contact.law import ContactLaw
from yade_scripts.dynamics import equilibrium
from yade_scripts.dynamics.equilibrium import SLACK, CannotStand, Search, settle
from yade_scripts.dynamics.structure import Structure
from yade_scripts.joints.cohesion import JointParameters

G = 9.81
STILL = 1e-6
"""Largest speed of what is at rest [m/s]."""


def portal():
    """Two piers and a lintel: a wall with a door."""
    blocks = wall_of_blocks("left", (0, -0.25, 0), (1.0, 0.5, 3.0), (1.0, 0.5, 1.0))
    blocks += wall_of_blocks("right", (3.0, -0.25, 0), (1.0, 0.5, 3.0), (1.0, 0.5, 1.0))
    return blocks + wall_of_blocks("lintel", (0, -0.25, 3.0), (4.0, 0.5, 1.0), (1.0, 0.5, 1.0))


def tall_hall():
    """A hall of 20 m x 10 m x 12 m in blocks of 2 m: soft joints under a high weight."""
    door = Opening((30, 11, 0), (31, 13, 2))
    return building_blocks(Building((30, 7), (50, 17), 12.0, 1.0, 2.0, openings=(door,)))


@pytest.mark.parametrize(
    ("blocks", "law"),
    [
        (
            wall_of_blocks("w", (0, -0.25, 0), (4.0, 0.5, 3.0), (1.0, 0.5, 0.5)),
            JointParameters(1e6, 1e-3, damping=0.0),
        ),
        (portal(), JointParameters(2e6, 1e-3, damping=0.0)),
        (tall_hall(), JointParameters(5e5, 0.02, damping=0.0)),
    ],
    ids=["wall", "portal", "hall"],
)
@pytest.mark.parametrize("contact", [None, ContactLaw(stiffness=1e9)], ids=["joints", "with contact"])
def test_a_settled_structure_stays_at_rest(blocks, law, contact):
    """0.1 s after settling: no block moves, no joint broke, and none counts as loose."""
    with Structure(blocks, contact, law, ground=0.0) as s:
        assert settle(s) > 0.0
        placed = s.centre()
        s.advance(0.1)
        assert np.abs(s.velocity()).max() < STILL
        assert np.abs(s.centre() - placed).max() < 0.1 * STILL
        assert s.joint_table().alive.all()
        assert not s.loose().any()
        weight = s.mass.sum() * G
        residual = s.internal_force() + s.gravity_force()
        assert np.abs(residual).max() < 1e-6 * weight


def cantilever(count, fixed_end=True):
    """Blocks of 1 m x 0.5 m x 0.5 m in a row along x, the first one fixed."""
    return [
        Block(f"b{i}", (i, 0.0, 5.0), size=(1.0, 0.5, 0.5), fixed=fixed_end and i == 0, density=2000.0)
        for i in range(count)
    ]


def test_a_cantilever_of_blocks_deflects_as_its_joints_turn():
    """Rigid blocks on joint springs k: each joint carries M = w (L - s)²/2 and V = w (L - s), turns by M/(k I) and
    slides by V/(k A); the blocks follow. Small deflection, joints elastic (k = 27/4 T_max/δ_f, closing the same)."""
    law = JointParameters(strength=1e9, opening_at_failure=1e-2, damping=0.0)
    count, edge = 5, 0.5
    with Structure(cantilever(count), None, law) as s:
        settle(s)
        sunk, turned = s.centre()[:, 2] - 5.0, s.rotation()[:, 0, 2]
    w, k, area, inertia = 2000.0 * G * edge**2, law.stiffness, edge**2, edge**4 / 12.0
    z, theta = np.zeros(count), np.zeros(count)
    for i in range(1, count):
        out = count - i
        bend = w * out**2 / 2.0 / (k * inertia)
        theta[i] = theta[i - 1] + bend
        z[i] = z[i - 1] - 0.5 * theta[i - 1] - w * out / (k * area) - 0.5 * theta[i]
    np.testing.assert_allclose(turned, theta, rtol=5e-4, atol=1e-12)
    np.testing.assert_allclose(sunk, z, rtol=5e-4, atol=1e-12)


def test_a_cantilever_that_cannot_carry_itself_is_refused_by_its_joint():
    """M at the root: 2000·9.81·0.25·5²/2 = 61 kN m against about 0.24 T_max h³ = 3 kN m."""
    law = JointParameters(strength=1e5, opening_at_failure=1e-3, damping=0.0)
    with Structure(cantilever(6), None, law) as s, pytest.raises(CannotStand, match="'b0' with 'b1'"):
        settle(s)


def test_blocks_that_nothing_holds_are_left_alone():
    """A row in the air has no equilibrium; it is not moved and falls."""
    with Structure(cantilever(3, fixed_end=False), None, JointParameters(1e6, 1e-3, damping=0.0)) as s:
        assert settle(s) == 0.0
        s.advance(0.01)
        assert s.velocity()[:, 2] == pytest.approx(-G * 0.01, rel=0.05)


@pytest.mark.parametrize(("share", "stands"), [(0.95, True), (1.05, False)])
def test_a_cantilever_of_six_blocks_carries_the_strength_of_its_root(share, stands):
    """Cubes of 0.2 m, load P at the free face, 1.2 m from the root: P = M_max/1.2 m with the root's largest moment
    M_max = 0.3802 T_max h³ for a closing stiffness of ten times k_0 (a rigid one would give 0.4523)."""
    ref = columns("coh_joint_Mmax_vs_N")
    row = np.flatnonzero((ref["kc_over_K0"] == 10.0) & (ref["n"] == 0.0))[0]
    law = JointParameters(1e6, 1e-3, closing_ratio=10.0, damping=0.0)
    blocks = [Block(f"b{i}", (0.2 * i, 0.0, 0.0), size=0.2, fixed=i == 0) for i in range(7)]
    strength = ref["mmax"][row] * law.strength * 0.2**3 / 1.2
    load = np.zeros((7, 6))
    load[6, 2] = -share * strength
    load[6, 4] = 0.1 * share * strength
    with Structure(blocks, None, law, gravity=(0.0, 0.0, 0.0)) as s:
        if not stands:
            with pytest.raises(CannotStand, match="'b0' with 'b1'"):
                settle(s, load)
            return
        settle(s, load)
        assert np.abs(s.internal_force() + load)[1:].max() < 1e-6 * strength
        assert 0.3 < s.joint_table().damage[0] < 1.0


@pytest.mark.parametrize("law", ["polynomial", "bilinear", "exponential"])
@pytest.mark.parametrize("ratio", [10.0, 1e4])
def test_stiff_closing_settles_too(law, ratio):
    """A door frame that leans on its open and closed joints: no load out of balance but what the rounding of positions
    (1e-16 of 4 m) makes in joints of up to 5e13 N/m, and it stays at rest."""
    parameters = JointParameters(2e6, 1e-3, closing_ratio=ratio, law=law, damping=0.0)
    with Structure(portal(), None, parameters, ground=0.0) as s:
        settle(s)
        residual = s.internal_force() + s.gravity_force()
        assert np.abs(residual).max() < (1e-6 if ratio == 10.0 else 5e-5) * s.mass.sum() * G
        placed = s.centre()
        s.advance(0.02 / np.sqrt(ratio))
        assert np.abs(s.velocity()).max() < STILL
        assert np.abs(s.centre() - placed).max() < 0.1 * STILL


def test_a_search_that_went_too_far_leaves_no_damage_behind():
    """The damage after settling is that of the equilibrium: with slow loading in small steps one gets the same."""
    law = JointParameters(1.2e6, 1e-3, closing_ratio=1e3, damping=0.0)
    with Structure(portal(), None, law, ground=0.0) as s:
        settle(s)
        at_once = s.joint_table().damage
    with Structure(portal(), None, law, ground=0.0) as s:
        for share in np.linspace(0.1, 1.0, 10):
            settle(s, (share - 1.0) * s.gravity_force())
        np.testing.assert_allclose(at_once, s.joint_table().damage, rtol=1e-3, atol=1e-6)
    assert at_once.max() > 1e-3


def test_stiff_closing_does_not_carry_what_it_cannot():
    """The same frame a thousand times weaker is refused, not settled somewhere else."""
    law = JointParameters(2e3, 1e-3, closing_ratio=1e4, damping=0.0)
    with Structure(portal(), None, law, ground=0.0) as s, pytest.raises(CannotStand):
        settle(s)


def test_needleman_settles_where_sliding_pushes_the_faces_apart():
    law = JointParameters(2e6, 1e-3, mixed_mode="needleman", damping=0.0)
    with Structure(portal(), None, law, ground=0.0) as s:
        settle(s)
        residual = s.internal_force() + s.gravity_force()
        assert np.abs(residual).max() < 1e-6 * s.mass.sum() * G


def test_a_step_that_is_far_too_long_is_cut_until_it_overshoots_by_little():
    """A block lifted off its joint by 0.1 mm and sent 1 m down into it, where closing is ten thousand times as stiff:
    of the whole way only a share is left, downwards, and what the joint gives back there is within SLACK."""
    law = JointParameters(1e6, 1e-3, closing_ratio=1e4, damping=0.0)
    with Structure([Block("b", (0, 0, 0.5), size=1.0)], None, law, ground=0.0) as s:
        s.displace(np.array([0]), np.array([[0.0, 0.0, 1e-4]]), np.eye(3)[None])
        search = Search(s, np.array([0]), s.gravity_force())
        residual, way = search.residual(), np.array([0.0, 0.0, -1.0, 0.0, 0.0, 0.0])
        search.along(way, residual)
        gone = 0.5 + 1e-4 - s.centre()[0, 2]
        assert 0.0 < gone < 2e-4
        assert search.residual() @ way > -SLACK * (residual @ way)


def wall_in_a_flume():
    """2 m high and 0.4 m thick, in running bond, between the sides of a flume of its own width."""
    sides = [FixedPlane((0, 0, 0), (0, 1, 0)), FixedPlane((0, 0.5, 0), (0, -1, 0))]
    return wall_of_blocks("w", (1, 0, 0), (0.4, 0.5, 2.0), (0.2, 0.25, 0.25), bond="running"), sides


def uneven_load(blocks):
    """Of water 0.6 m deep in front (x = 1 m), on one half of the wall 1 % heavier than on the other."""
    F = np.zeros((len(blocks), 6))
    for row, block in enumerate(blocks):
        x, y, z = block.centre
        if x < 1.15 and z < 0.6:
            F[row, 0] = 9.81e3 * (0.6 - z) * 0.25**2 * (1.01 if y > 0.25 else 1.0)
    return F


@pytest.mark.parametrize("ratio", [1.0, 20.0, 1e4])
def test_a_wall_between_the_sides_of_a_flume_settles(ratio, monkeypatch):
    """Upright joints neither open nor close but for 1e-10 m, where a stiffness of both sides is that of neither, and
    contacts with the sides push in some places tried and not in others. Newton's method ends in a few steps, and what
    it finds stays at rest."""
    monkeypatch.setattr(equilibrium, "MOST_ITERATIONS", 40)
    blocks, sides = wall_in_a_flume()
    law = JointParameters(8e3, 1e-3, closing_ratio=ratio, damping=0.0)
    with Structure(blocks, ContactLaw(friction=0.6), law, ground=0.0, planes=sides) as s:
        load = uneven_load(blocks)
        settle(s, load)
        residual = s.internal_force() + s.gravity_force() + load
        assert np.abs(residual).max() < 1e-6 * np.abs(s.gravity_force()).max()
        assert 0.02 < s.joint_table().damage.max() < 0.5


def test_contacts_hold_a_joined_block_by_the_depth_there_is():
    """A block on a joint is pushed by u against a wall that stood 0.1 mm from it and that nothing joins it to: with
    P = k A u + K (u - gap), and a moment that lets it slide upright, the search ends at u, whatever it tried on the
    way. The joint has softened by 2 u/δ_f there."""
    gap, u, K = 1e-4, 3e-4, 4e9
    law = JointParameters(1e9, 1.0, damping=0.0)
    wall = FixedPlane((0.5 + gap, 0, 0), (-1, 0, 0))
    contact = ContactLaw(stiffness=K)
    with Structure([Block("b", (0, 0, 0.5), size=1.0)], contact, law, ground=0.0, planes=[wall]) as s:
        joint = law.stiffness * u
        load = np.zeros((1, 6))
        load[0, 0], load[0, 4] = joint + K * (u - gap), -0.5 * joint
        settle(s, load)
        assert s.centre()[0, 0] == pytest.approx(u, rel=2e-3)
        assert s.contacts().depth == pytest.approx(u - gap, rel=3e-3)


def test_a_search_without_end_tells_the_damage_and_the_block_where_it_stands(monkeypatch):
    """Broken off after one step: the damage is that of the place tried, not that from before the search."""
    monkeypatch.setattr(equilibrium, "MOST_ITERATIONS", 1)
    blocks, _ = wall_in_a_flume()
    law = JointParameters(8e3, 1e-3, damping=0.0)
    with Structure(blocks, None, law, ground=0.0) as s, pytest.raises(CannotStand) as told:
        settle(s, uneven_load(blocks))
    assert "no equilibrium after 1 iterations" in str(told.value)
    assert re.search(r"left on 'w-\d-\d-\d'", str(told.value))
    assert re.search(r"damage 0\.(0[1-9]|[1-9])", str(told.value))


def test_places_that_were_tried_leave_no_damage():
    """A block lifted by a tenth of the opening at failure and put back: the joint has not noted it until `keep`."""
    law = JointParameters(1e6, 1e-3, damping=0.0)
    with Structure([Block("b", (0, 0, 0.5), size=1.0)], None, law, ground=0.0) as s:
        search, lift = Search(s, np.array([0]), s.gravity_force()), np.array([0.0, 0.0, 1e-4, 0.0, 0.0, 0.0])
        search._move(lift)
        assert search.damage == pytest.approx(0.1)
        assert s.joints.largest.max() == 0.0
        search.keep()
        assert s.joints.largest == pytest.approx(1e-4)


def test_by_hand_contacts_are_stiff_along_their_normals_alone():
    """A block glued to the ground that overlaps a rough wall: the wall holds it by K across and not at all along it,
    with the secant as with the tangent; in motion it holds it along, too."""
    K = 1e8
    wall = FixedPlane((0.51, 0, 0), (-1, 0, 0))  # apart at the start: they are not joined
    law, contact = JointParameters(1e8, 10.0, damping=0.0), ContactLaw(stiffness=K, friction=0.9)
    with Structure([Block("b", (0, 0, 0.5), size=1.0)], contact, law, ground=0.0, planes=[wall]) as s:
        s.displace(np.array([0]), np.array([[0.011, 0.0, 0.0]]), np.eye(3)[None])
        for stiffness in (s.secant_without_friction(), s.tangent_without_friction()):
            along_x, along_y = stiffness.diagonal()[:2]
            assert along_x == pytest.approx(law.stiffness + K, rel=0.01)
            assert along_y == pytest.approx(law.stiffness, rel=0.01)
        assert s.tangent()[0].diagonal()[1] > 1.1 * law.stiffness


@pytest.mark.parametrize(("gap", "ratio"), [(-1e-11, 20.0), (1e-11, 1.0)])
def test_the_tangent_beside_closing_is_that_of_its_own_side(gap, ratio):
    """A joint twenty times as stiff in closing, a hundred millionth of its opening at failure from it."""
    law = JointParameters(1e6, 1e-3, closing_ratio=20.0, damping=0.0)
    with Structure([Block("b", (0, 0, 0.5), size=1.0)], None, law, ground=0.0) as s:
        s.displace(np.array([0]), np.array([[0.0, 0.0, gap]]), np.eye(3)[None])
        assert s.tangent_without_friction().diagonal()[2] == pytest.approx(ratio * law.stiffness, rel=1e-3)
