"""Contact of blocks in YADE: restitution, sliding, rest, toppling, and the account of their work."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from coupler.commands.verify.figures import columns
from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block
from yade_scripts.contact.law import (
    ContactError,
    ContactLaw,
    PairFriction,
    damping_ratio,
    paper_damping_ratio,
    restitution_without_tension,
)
from yade_scripts.dynamics.structure import Structure

K = 1e8
G = 9.81


def cube(z, **more):
    return Block("cube", (0.0, 0.0, z), size=1.0, density=2000.0, **more)


def test_damping_ratios_against_the_closed_forms():
    ref = columns("dem_restitution_linear_dashpot")
    for e, zeta, e_cut in zip(ref["e_in"], ref["zeta"], ref["e_cut"]):
        assert paper_damping_ratio(e) == pytest.approx(zeta, abs=2e-6)
        assert restitution_without_tension(paper_damping_ratio(e)) == pytest.approx(e_cut, abs=2e-6)
        assert restitution_without_tension(damping_ratio(e)) == pytest.approx(e, rel=1e-9)


@pytest.mark.parametrize("e", [0.1, 0.5, 0.9, 1.0])
def test_a_face_that_lands_flat_returns_e(e):
    """On the ground; the energies before and after account for the dashpot."""
    law = ContactLaw(stiffness=K, restitution=e)
    with Structure([cube(0.5 + 1e-4, velocity=(0, 0, -1.0))], law, ground=0.0, gravity=(0, 0, 0)) as s:
        before = balance(s.energies())
        s.advance(0.04, substep=0.02 * np.sqrt(2000.0 / K))
        after = s.energies()
        assert s.velocity()[0, 2] == pytest.approx(e, abs=0.005)
        assert balance(after) == pytest.approx(before, rel=1e-3)
        assert after["dashpot"] == pytest.approx((1 - e**2) * before, rel=0.01, abs=1.0)


def test_the_paper_rule_returns_what_its_closed_form_says():
    """Equation (3) as printed gives 0.5503 for e = 0.5 once the contact cannot pull."""
    law = ContactLaw(stiffness=K, restitution=0.5, rule="paper")
    assert law.obtained_restitution == pytest.approx(0.5503, abs=1e-4)
    with Structure([cube(0.5 + 1e-4, velocity=(0, 0, -1.0))], law, ground=0.0, gravity=(0, 0, 0)) as s:
        s.advance(0.04, substep=0.02 * np.sqrt(2000.0 / K))
        assert s.velocity()[0, 2] == pytest.approx(0.5503, abs=0.005)


@pytest.mark.parametrize("density", [2000.0, 200.0, 2e6])
def test_two_free_blocks_return_e_whatever_their_masses(density):
    """Effective mass in the dashpot; momentum to round-off."""
    blocks = [
        Block("a", (0, 0, 0.5), size=1.0, density=density),
        Block("b", (0, 0, 1.5 + 1e-4), size=1.0, density=2000.0, velocity=(0, 0, -1.0)),
    ]
    with Structure(blocks, ContactLaw(stiffness=K, restitution=0.5), gravity=(0, 0, 0)) as s:
        s.advance(0.05, substep=0.02 * np.sqrt(min(density, 2000.0) / K))
        v = s.velocity()[:, 2]
        assert v[1] - v[0] == pytest.approx(0.5, abs=0.01)
        assert s.mass @ v == pytest.approx(-2000.0, rel=1e-12)


@pytest.mark.parametrize(("slope", "slides"), [(0.45, False), (0.55, True), (0.8, True)])
def test_a_block_slides_when_the_slope_exceeds_the_friction(slope, slides):
    """Gravity turned by `slope` = tan of the angle, μ = 0.5: a = (slope - 0.5) g_n, else it stays."""
    n = G / np.hypot(1.0, slope)
    with Structure(
        [cube(0.5)], ContactLaw(stiffness=K, friction=0.5), ground=0.0, gravity=(slope * n, 0, -n)
    ) as s:
        s.advance(0.1)
        v0 = s.velocity()[0, 0]
        s.advance(0.2)
        acceleration = (s.velocity()[0, 0] - v0) / 0.2
    assert acceleration == pytest.approx((slope - 0.5) * n if slides else 0.0, abs=0.01)


def test_a_sliding_block_has_no_stiffness_along_the_floor():
    """Its normal forces tremble in the last digits: by the friction of the substep before, four of nine nodes seemed to
    stick, and the pressure solve counted on a block held by the floor that slid on at 2 m/s. One at rest is held."""
    law = ContactLaw(stiffness=K, restitution=0.2, friction=0.1)
    sliding = Block(
        "b", (0, 0, 0.25), size=np.array([1.0, 0.8, 0.5]), velocity=(2.0, 1.0, 0.0), spin=(0, 0, 0.6)
    )
    with Structure([sliding], law, ground=0.0) as s:
        for _ in range(20):
            s.advance(0.005)
            stiffness = s.tangent()[0].toarray()[:3, :3].diagonal() / K
            np.testing.assert_allclose(stiffness, [0.0, 0.0, 1.0], atol=1e-9)
        assert not s.contacts().slides.all()
    with Structure([cube(0.5)], law, ground=0.0, gravity=(0.05 * G, 0, -G)) as s:
        s.advance(0.1)
        assert s.tangent()[0].toarray()[0, 0] > 0.1 * K


def test_ledger_of_a_block_that_drops_bounces_and_slides_to_rest():
    """Kinetic + potential + springs + dashpots + friction stays within 1e-3 of the energy put in."""
    block = cube(0.55, velocity=(3.0, 0.0, -1.0))
    with Structure([block], ContactLaw(stiffness=K, restitution=0.5, friction=0.3), ground=0.0) as s:
        start = s.energies()
        s.advance(0.3, substep=0.01 * np.sqrt(2000.0 / K))
        end = s.energies()
    given = start["kinetic"] + 2000.0 * G * 0.05
    assert balance(end) == pytest.approx(balance(start), abs=1e-3 * given)
    assert end["friction"] > 0.1 * given
    assert end["dashpot"] > 0.05 * given


@pytest.mark.parametrize("at", [(0.0, 0.0), (0.9, 0.7)])
@pytest.mark.parametrize("below", [1.0, 1.3, 3.0])
def test_a_cube_sinks_by_its_weight_over_k_whatever_is_below_it(below, at):
    """On a face of its own size, somewhat larger and three times larger, over its nodes and between them: the
    stiffness is the one that was asked for. (Only the nodes of the small face are in contact then.)"""
    low = Block("low", (0, 0, -0.5), size=(below, below, 1), density=2000.0, fixed=True)
    high = Block("high", (*(0.5 * (below - 1.0) * np.array(at)), 0.5), size=1.0, density=2000.0)
    with Structure([low, high], ContactLaw(stiffness=K, restitution=0.3)) as s:
        s.advance(0.4)
        assert 0.5 - s.centre()[1, 2] == pytest.approx(2000.0 * G / K, rel=3e-3)  # one node off the middle
        assert s.contacts().kn.sum() == pytest.approx(K)


def test_a_block_between_larger_plates_presses_both_with_half_of_the_stiffness():
    """One plate is driven on until the block is pressed by 2 mm: two pairs of stiffness K in series."""
    gap, press, fast = 0.01, 0.002, 0.1
    plates = [
        Block("still", (0.0, 0, 0), size=(0.2, 0.6, 0.6), density=2000.0, fixed=True),
        Block("driven", (0.6 + gap, 0, 0), size=(0.2, 0.6, 0.6), driven=True, velocity=(-fast, 0.0, 0.0)),
    ]
    block = Block("block", (0.3 + 0.5 * gap, 0, 0), size=(0.4, 0.3, 0.3), density=1000.0)
    with Structure([*plates, block], ContactLaw(1e6, 0.2), gravity=(0.0, 0.0, 0.0)) as s:
        s.advance((gap + press) / fast)
        s.drive("driven")
        s.advance(0.2)
        c = s.contacts()
        for row, side in ((0, -1.0), (1, 1.0)):
            force = c.normal_force[c.b == row, 0].sum() - c.normal_force[c.a == row, 0].sum()
            assert force == pytest.approx(side * 0.5e6 * press, rel=1e-3)


def test_a_stack_stays_where_it_was_put():
    """Three offset blocks at rest: no drift, no spin; the lowest carries all the weight."""
    blocks = [Block(f"b{i}", (0.1 * i, 0.05 * i, i + 0.5), size=1.0, density=2000.0) for i in range(3)]
    with Structure(blocks, ContactLaw(stiffness=1e9, friction=0.5), ground=0.0) as s:
        s.advance(1.0)
        assert np.abs(s.centre() - [b.centre for b in blocks]).max() < 1e-3
        assert np.abs(s.velocity()).max() < 1e-3
        weight = -s.gravity_force()[:, 2]
        np.testing.assert_allclose(s.internal_force()[:, 2], weight, rtol=0.02)


@pytest.mark.parametrize(("tilt", "falls"), [(20.0, False), (33.0, True)])
def test_a_tilted_block_rocks_back_or_topples(tilt, falls):
    """Base 1, height 2: the centre passes the edge at atan(1/2) = 26.6 degrees."""
    R = Rotation.from_euler("y", tilt, degrees=True).as_matrix()
    foot = (R @ np.array([0.5, 0.0, -1.0]))[2]
    block = Block("tower", (0, 0, -foot), size=(1, 1, 2), rotation=R, density=2000.0)
    with Structure([block], ContactLaw(stiffness=1e9, restitution=0.1, friction=2.0), ground=0.0) as s:
        s.advance(1.5)
        upright = abs(s.rotation()[0, 2, 2])
    assert (upright < 0.3) == falls


def test_a_block_stops_at_a_tank_wall():
    from yade_scripts.blocks.faces import FixedPlane

    wall = FixedPlane((2.0, 0.0, 0.0), (-1.0, 0.0, 0.0), "east")
    block = Block("b", (0.0, 0.0, 0.5), size=1.0, density=2000.0, velocity=(5.0, 0.0, 0.0))
    with Structure(
        [block], ContactLaw(stiffness=1e9, friction=0.0, restitution=0.5), planes=[wall], gravity=(0, 0, 0)
    ) as s:
        s.advance(0.5, substep=2e-5)
        assert s.velocity()[0, 0] == pytest.approx(-2.5, abs=0.05)
        assert s.centre()[0, 0] < 1.5


@pytest.mark.parametrize(
    "wrong",
    [
        {"stiffness": -1.0},
        {"restitution": 0.0},
        {"restitution": 1.1},
        {"friction": -0.1},
        {"nodes_per_edge": 2},
        {"rule": "x"},
        {"shear_ratio": 0.0},
        {"shear_ratio": 10.01},
    ],
)
def test_impossible_constants_are_refused_by_name(wrong):
    (name,) = wrong
    with pytest.raises(ContactError, match=name):
        ContactLaw(**({"stiffness": K} | wrong))


def prism(corners, height, **more):
    """A regular prism of circumradius 0.5 m standing on z = 0."""
    angle = 2.0 * np.pi * np.arange(corners) / corners
    ring = 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ends = [np.column_stack([ring, np.full(corners, z)]) for z in (0.0, height)]
    return Block("prism", (0.0, 0.0, 0.5 * height + 1e-4), vertices=np.concatenate(ends), **more)


@pytest.mark.parametrize("corners", [3, 5, 8])
def test_a_prism_that_lands_flat_returns_e_and_sinks_by_its_weight_over_k(corners):
    """Any number of nodes on the face shares K and one dashpot among them."""
    e, block = 0.5, prism(corners, 0.8, velocity=(0, 0, -1.0))
    with Structure([block], ContactLaw(K, e), ground=0.0, gravity=(0, 0, 0)) as s:
        s.advance(0.06, substep=0.02 * np.sqrt(block.mass / K))
        assert s.velocity()[0, 2] == pytest.approx(e, abs=0.005)
        assert np.abs(s.velocity()[0, 3:]).max() < 1e-9
    with Structure([prism(corners, 0.8)], ContactLaw(K, 0.1), ground=0.0) as s:
        s.advance(1.0)
        assert 0.4 - s.centre()[0, 2] == pytest.approx(block.mass * G / K, rel=1e-3)


def test_friction_goes_by_the_pair_of_materials():
    """On a slope of 30 degrees: a = g (sin - mu cos) with the friction of the two materials that touch."""
    law = ContactLaw(K, 0.3, 0.8, pairs=(PairFriction("ice", "ground", 0.1),))
    blocks = [
        Block("sledge", (0, 0, 0.5), size=1.0, material="ice"),
        Block("stone", (0, 3, 0.5), size=1.0),
    ]
    slope = np.radians(30.0)
    with Structure(blocks, law, ground=0.0, gravity=(G * np.sin(slope), 0, -G * np.cos(slope))) as s:
        s.advance(0.2)
        before = s.velocity()[:, 0]
        s.advance(0.3)
        a = (s.velocity()[:, 0] - before) / 0.3
    assert a[0] == pytest.approx(G * (np.sin(slope) - 0.1 * np.cos(slope)), rel=1e-3)
    assert abs(a[1]) < 1e-3


@pytest.mark.parametrize("shear_ratio", [1.0, 0.3])
def test_the_tangential_restitution_is_that_of_the_contact_point(shear_ratio):
    """A tip that sticks: after half a swing of the tangential spring the slip has turned round, e_t of it."""
    e_t, speed = 0.6, 0.05
    tips = 0.1 * np.array(
        [[3**0.5, 0, 0], [-(3**0.5), 0, 0], [0, 3**0.5, 0], [0, -(3**0.5), 0], [0, 0, 1], [0, 0, -1]]
    )
    block = Block("b", (0, 0, 0.1 - 2e-5), vertices=tips, velocity=(speed, 0, 0))
    law = ContactLaw(1e9, 1.0, 1e6, shear_ratio=shear_ratio, tangential_restitution=e_t)
    effective, k = (
        block.mass / 3.5,
        shear_ratio * 1e9 / 7,
    )  # a sphere yields 3.5 times as much at its surface; 7 nodes
    zeta = paper_damping_ratio(e_t)
    swing = np.pi * np.sqrt(effective / k / (1.0 - zeta**2))
    with Structure([block], law, ground=0.0, gravity=(0, 0, 0)) as s:
        s.set_load(np.array([[0, 0, -1e9 / 7 * 2e-5, 0, 0, 0]]))
        s.advance(swing, substep=swing / 2000)
        v = s.velocity()[0]
    assert (v[0] - v[4] * 0.1) / speed == pytest.approx(-e_t, rel=0.01)


def test_a_slab_between_unequal_blocks_carries_a_thousandfold_mass():
    """A heavy block on a light one on the ground, set down as deep as the weights above press them: nothing moves."""
    foot, joint = 20020.0 * G / 1e9, 20000.0 * G / 1e9
    blocks = [
        Block("light", (0, 0, 0.5 - foot), size=1.0, density=20.0),
        Block("heavy", (0, 0, 1.5 - foot - joint), size=1.0, density=20000.0),
    ]
    with Structure(blocks, ContactLaw(1e9, 0.1), ground=0.0) as s:
        s.advance(0.5)
        np.testing.assert_allclose(s.centre(), [b.centre for b in blocks], atol=1e-10)
        assert np.abs(s.velocity()).max() < 1e-9


def test_the_uplift_of_a_pair_is_that_of_both_materials_and_not_of_one():
    """Bricks on rock keep the water out; bricks on bricks do not."""
    law = ContactLaw(uplift=1.0, pairs=(PairFriction("brick", "rock", uplift=0.0),))
    assert law.uplift_between("brick", "rock") == law.uplift_between("rock", "brick") == 0.0
    assert law.uplift_between("brick", "brick") == law.uplift_between("rock", "rock") == 1.0
