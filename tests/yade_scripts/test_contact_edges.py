"""Edges that cross between contact nodes: what blocks sink into each other depends on the stiffness alone."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from kernels.decorators import kernel
from tests.yade_scripts.ledger import balance
from yade_scripts.blocks.block import Block
from yade_scripts.contact.edges import CROSSES, find_crossing, pair_scratch
from yade_scripts.contact.law import ContactLaw
from yade_scripts.contact.nodes import block_edges, contact_shapes
from yade_scripts.dynamics.structure import Structure

STILL = (0.0, 0.0, 0.0)
DENSITY = 2000.0


def turned(axis, degrees):
    return Rotation.from_euler(axis, degrees, degrees=True).as_matrix()


def crossed_cubes(shift, speed):
    """A held cube on its edge, and one above it that falls edge on edge, at right angles, off the middle by `shift`."""
    diagonal = np.sqrt(2.0)
    return [
        Block("low", STILL, size=1.0, rotation=turned("x", 45), density=DENSITY, fixed=True),
        Block(
            "high", (shift, shift, diagonal + 1e-3), size=1.0, rotation=turned("y", 45), density=DENSITY,
            velocity=(0, 0, -speed),
        ),
    ]  # fmt: skip


@pytest.mark.parametrize("per_edge", [3, 5, 9, 17])
@pytest.mark.parametrize("shift", [0.0, 0.05, 0.13])
def test_crossed_edges_sink_by_the_stiffness_alone(per_edge, shift):
    """v sqrt(m/k) with k = K/2, the springs of both blocks in series, however far the nodes are from each other; a push
    off the middle turns the block and goes less deep. Nothing is gained."""
    stiffness, speed = 1e8, 0.5
    law = ContactLaw(stiffness, 0.3, 0.0, nodes_per_edge=per_edge)
    with Structure(crossed_cubes(shift, speed), law, gravity=STILL) as s:
        deepest, time = 0.0, 1e-3 / speed + 4.0 * np.sqrt(DENSITY / (0.5 * stiffness))
        for _ in range(60):
            s.advance(time / 60)
            deepest = max(deepest, np.sqrt(2.0) - s.centre()[1, 2])
        assert 0.0 < deepest < speed * np.sqrt(DENSITY / (0.5 * stiffness))
        assert s.energies()["kinetic"] < 0.5 * DENSITY * speed**2


def test_an_edge_that_lands_on_an_edge_returns_e():
    """Straight through both centres, which no node is at: restitution as for a face, nothing sideways."""
    law = ContactLaw(1e8, 0.5, 0.0, nodes_per_edge=4)
    with Structure(crossed_cubes(0.0, 0.5), law, gravity=STILL) as s:
        s.advance(0.05, substep=0.02 * np.sqrt(DENSITY / 1e8))
        v = s.velocity()[1]
        assert v[2] / 0.5 == pytest.approx(0.5, abs=0.01)
        assert np.abs(np.delete(v, 2)).max() < 1e-9


@pytest.mark.parametrize("off", [0.0, 0.1, 0.15, 0.25])
def test_a_beam_across_another_is_held_by_the_corners_where_their_edges_cross(off):
    """A beam of 4 x 0.4 x 0.4 m, its middle `off` beside that of the beam under it, on which it lies where that one has
    no node: it stands for as long as its middle is above the other (0.2 m), whose edges no node is near, and falls
    beyond. Only the nodes of its own middle would be in contact, in one line about which it would rock."""
    low = Block("low", (0.5, 0, -0.2), size=(4, 0.4, 0.4), density=DENSITY, fixed=True)
    high = Block("high", (0, off, 0.2), size=(0.4, 4, 0.4), density=DENSITY)
    with Structure([low, high], ContactLaw(1e8, 0.3, 0.5)) as s:
        s.advance(0.5)
        tilt = s.rotation()[1][1, 2]
        assert abs(tilt) > 0.02 if off > 0.2 else abs(tilt) < 1e-3
        if off < 0.2:
            assert 0.2 - s.centre()[1, 2] < 2.0 * s.mass[1] * 9.81 / 1e8


def test_beams_that_cross_where_neither_has_a_node_carry_each_other():
    """No node of either is near: pressed together, the four corners of what lies on one another carry K in all."""
    low = Block("low", (0.5, 0, -0.2), size=(4, 0.4, 0.4), density=DENSITY, fixed=True)
    high = Block("high", (0, 0.7, 0.2), size=(0.4, 4, 0.4), density=DENSITY, velocity=(0, 0, -0.01))
    with Structure([low, high], ContactLaw(1e8, 1.0, 0.0), gravity=STILL) as s:
        s.advance(2e-4)
        contacts = s.contacts()
        corners = [(x, y) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
        assert sorted(map(tuple, contacts.point[:, :2].round(5))) == sorted(corners)
        assert contacts.kn.sum() == pytest.approx(1e8)
        assert np.allclose(contacts.depth, 2e-6, rtol=0.02)


def test_an_edge_that_crosses_a_corner_is_held_while_the_vertex_of_that_corner_touches():
    """A beam lies on its edge across the corner of a block, whose vertex just touches the side of the beam: that holds
    nothing as the beam slides down along it, and the edges beside it have to."""
    inwards, sunk = 0.05, 0.0501
    diagonal = np.array([1.0, 1.0, 0.0]) / np.sqrt(2.0)
    low = Block("low", (1.0, 1.0, -1.0), size=2.0, density=DENSITY, fixed=True)
    high = Block(
        "high",
        inwards * diagonal + (0.0, 0.0, 0.5 / np.sqrt(2.0) - sunk),
        size=(4.0, 0.5, 0.5),
        rotation=turned("z", -45) @ turned("x", 45),
        density=DENSITY,
        velocity=0.7071 * diagonal - (0.0, 0.0, 0.7071),
    )
    with Structure([low, high], ContactLaw(1e8, 0.3, 0.0)) as s:
        deepest = 0.0
        for _ in range(30):
            s.advance(0.01)
            deepest = max(deepest, s.deepest()[2].max(initial=0.0))
        assert sunk < deepest < 1.2 * sunk


@pytest.mark.parametrize("spin", [-6.0, 6.0])
def test_edges_that_turn_parallel_let_go_with_what_their_springs_held(spin):
    """They no longer cross then, and the contact ends by their angle, not by their depth: the books take just what was
    in its springs, also where it rubs."""
    low, high = crossed_cubes(0.0, 0.0)
    high = high.changed(
        centre=(0.0, 0.0, np.sqrt(2.0)),
        rotation=turned("z", np.sign(spin) * 82.0) @ high.rotation,
        velocity=(0.3, 0.2, -0.2),
        spin=(0.0, 0.0, spin),
    )
    with Structure([low, high], ContactLaw(1e8, 0.3, 0.5), gravity=(0.0, 0.0, -9.81)) as s:
        s.advance(0.001)
        start = s.energies()
        for _ in range(20):
            s.advance(0.001)
            assert balance(s.energies()) == pytest.approx(balance(start), abs=1e-3 * start["kinetic"])


def test_an_edge_that_slides_past_the_end_of_another_lets_go_with_what_its_spring_held():
    """Pressed 1 mm deep by the inertia of a heavy block, without friction: the edges stop crossing while their spring
    holds 16 J of what is stored. These are lost, and booked; nothing else changes the sum of the books."""
    low, high = crossed_cubes(0.0, 0.0)
    high = high.changed(centre=(0.49, 0.0, np.sqrt(2.0) - 1e-3), velocity=(0.5, 0.0, 0.0), density=1e6)
    with Structure([low, high], ContactLaw(1e8, 0.3, 0.0), gravity=STILL) as s:
        s.displace(np.array([1]), np.zeros((1, 3)), np.eye(3)[None])  # the present depth counts in full
        before = None
        for _ in range(25):
            s.advance(1e-3)
            after = s.energies()
            before = before or after
            if s.centre()[1, 0] < 0.4999:
                assert after["friction"] == 0.0
            assert balance(after) == pytest.approx(balance(before), abs=1e-3)
        assert s.centre()[1, 0] > 0.502
        assert after["friction"] > 10.0


def overlap(blocks, centres, rotations):
    """Least overlap of two convex blocks over all axes that could part them [m]; negative where one does."""
    a, b = (x + k.vertices @ R.T for k, x, R in zip(blocks, centres, rotations))
    sides = [R @ k.planes[0].T for k, R in zip(blocks, rotations)]
    along = [np.array([p[j] - p[i] for (i, j), _ in block_edges(k)]) for k, p in zip(blocks, (a, b))]
    cross = np.cross(along[0][:, None], along[1][None]).reshape(-1, 3)
    cross = cross[np.linalg.norm(cross, axis=1) > 1e-6]
    axes = np.concatenate([sides[0].T, sides[1].T, cross / np.linalg.norm(cross, axis=1)[:, None]])
    p, q = a @ axes.T, b @ axes.T
    return min((p.max(axis=0) - q.min(axis=0)).min(), (q.max(axis=0) - p.min(axis=0)).min())


def test_other_edges_take_over_from_crossing_ones_that_are_not_the_outermost_any_more():
    """A plate that spins comes down on another with one pair of edges; as it turns another pair becomes the one that
    the blocks overlap by, eight times as deep. The springs are far too soft to matter: it is about who is found."""
    low = Block("low", (0, 0, 0), size=(4, 0.5, 3), density=DENSITY, fixed=True)
    high = Block(
        "high",
        (0.4128, -1.9414, -0.9862),
        size=(3, 4, 0.5),
        rotation=Rotation.from_matrix(
            [[0.5887, -0.5211, 0.6179], [0.0033, -0.7629, -0.6465], [0.8083, 0.3827, -0.4474]]
        ).as_matrix(),
        density=DENSITY,
        velocity=(0.3157, 0.2256, 0.3405),
        spin=(2.0440, 2.5965, 0.3411),
    )
    with Structure([low, high], ContactLaw(1e3, 0.3, 0.0), gravity=STILL) as s:
        s.advance(0.07, 1e-3)
        deep = overlap([low, high], s.centre(), s.rotation())
        assert deep > 0.1
        assert s.deepest()[2].max() > 0.9 * deep


def test_plates_that_fold_touch_where_they_overlap_and_not_at_their_far_sides():
    """Two panels of a roof side by side fold inwards, 22 mm deep in each other at one corner, which meets the side of
    the other panel. The edges of their far sides cross as well, 3.3 m deep."""
    turns = (
        [[0.998297, 0.046506, -0.035219], [-0.05359, 0.969621, -0.238671], [0.023049, 0.240151, 0.970462]],
        [
            [0.997953, 0.062485, 0.013619],
            [-0.063883, 0.964116, 0.257682],
            [0.002971, -0.258025, 0.966134],
        ],
    )
    place, size = np.array([0.19472, 3.47767, 0.00248]), (3.33496295, 3.49989283, 0.4)
    panels = [
        Block(name, (0, y, 0), size, rotation=Rotation.from_matrix(R).as_matrix(), density=600.0)
        for name, y, R in zip(("left", "right"), (0.0, 5.0), turns)
    ]
    with Structure(panels, ContactLaw(2e9, 0.3, 0.4), gravity=STILL) as s:
        s.displace(np.array([1]), (place - panels[1].centre)[None], np.eye(3)[None])
        contacts = s.contacts()
        assert 0.0 < contacts.depth.max() < 1.1 * overlap(panels, s.centre(), s.rotation())


@pytest.mark.parametrize("inwards", [0.0, 0.05, 0.1])
def test_a_beam_beside_a_column_meets_its_side_and_not_its_far_end(inwards):
    """A beam is 0.11 to 0.21 m within the side of a column, and about level with its top. An edge of the beam crosses
    edges of the column's other end as well, 1.7 m deep along the column, which is 8 to 15 overlaps: no force may come
    from there."""
    column = Block("column", (0, 0, 0), (0.376, 0.511, 1.669), density=600.0)
    turn = Rotation.from_rotvec([-0.9804, 1.2954, 1.0094]).as_matrix()
    beam = Block("beam", (0, 5, 0), (0.705, 2.747, 0.394), rotation=turn, density=600.0)
    with Structure([column, beam], ContactLaw(2e9, 0.3, 0.4), gravity=STILL) as s:
        place = np.array([-0.1513, 0.4526 - inwards, 0.4895])
        s.displace(np.array([1]), (place - beam.centre)[None], np.eye(3)[None])
        deep = overlap([column, beam], s.centre(), s.rotation())
        assert 0.1 < deep < 0.22
        assert 0.0 < s.contacts().depth.max() < 1.1 * deep


def test_a_wall_across_the_corner_of_its_footing_at_a_small_angle_is_held():
    """It overlaps the footing by 75 mm, least along the normal of two long edges that cross at less than 3 degrees;
    neither has a node within the other."""
    footing = Block("footing", (0, 0, 0), (10.00182, 7.994247, 1.914474), density=2000.0, fixed=True)
    turn = Rotation.from_matrix([[0.978123, 0.208026, 0.0], [-0.208026, 0.978123, 0.0], [0.0, 0.0, 1.0]])
    tilt = Rotation.from_matrix(
        [[0.810052, 0.182601, 0.5572], [-0.144971, 0.983141, -0.11143], [-0.568154, 0.009486, 0.822868]]
    )
    place = turn.inv().apply([5.878085, 0.806345, 2.057842])
    wall = Block(
        "wall", (20, 0, 0), (0.4, 3.997124, 2.6), rotation=(turn.inv() * tilt).as_matrix(), density=600.0
    )
    with Structure([footing, wall], ContactLaw(2e9, 0.3, 0.4), gravity=STILL) as s:
        s.displace(np.array([1]), (place - wall.centre)[None], np.eye(3)[None])
        deep = overlap([footing, wall], s.centre(), s.rotation())
        assert deep == pytest.approx(0.075, abs=0.005)
        assert s.contacts().depth.max() == pytest.approx(deep, rel=0.05)


@pytest.mark.parametrize(("seed", "most"), [(2, 2.5e-3), (7, 2.5e-3), (8, 1e-3)])
def test_a_plate_that_rolls_over_the_edges_of_another_does_not_sink_at_each_change_of_edges(seed, most):
    """It comes down slowly, slides and turns about one edge after another. Its speed alone makes 0.5 to 2.4 mm; where
    the next pair of edges is found late, the overlap of that time stays, and the one after it adds to that: 4 to 15 mm,
    and still 1.7 mm of the third if edges are looked for again after a way of ten margins."""
    random = np.random.default_rng(seed)
    plates = []
    for name, height, fixed in (("low", 0.0, True), ("high", 3.2, False)):
        turn = Rotation.from_quat(random.normal(size=4)).as_matrix()
        spin = STILL if fixed else 0.2 * random.normal(size=3)
        plates.append(
            Block(name, (0, 0, height), (4, 3, 0.4), rotation=turn, density=2000.0, spin=spin, fixed=fixed)
        )
    with Structure(plates, ContactLaw(2e9, 0.3, 0.3), gravity=(0.0, 0.0, -0.2)) as s:
        deepest = 0.0
        for _ in range(250):
            s.advance(0.04)
            deepest = max(deepest, overlap(plates, s.centre(), s.rotation()))
        assert 2e-4 < deepest < most


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 10_000))
def test_random_polyhedra_do_not_sink_into_each_other(seed):
    """Thrown at each other, the overlap stays below v sqrt(m/k) of a lone node, which carries K/2 over the nodes of its
    face: no more than nine here."""
    random = np.random.default_rng(seed)
    blocks = []
    for name, side in (("a", -1.0), ("b", 1.0)):
        points = random.normal(size=(10, 3))
        points *= 0.5 / np.linalg.norm(points, axis=1)[:, None]
        turn = Rotation.from_quat(random.normal(size=4)).as_matrix()
        place = (0.7 * side, *random.uniform(-0.2, 0.2, 2))
        blocks.append(
            Block(name, place, vertices=points, rotation=turn, density=DENSITY, velocity=(-side, 0, 0))
        )
    stiffness = 1e9
    mass = blocks[0].mass * blocks[1].mass / (blocks[0].mass + blocks[1].mass)
    with Structure(blocks, ContactLaw(stiffness, 0.3, 0.3), gravity=STILL) as s:
        deepest = 0.0
        for _ in range(100):
            s.advance(0.006)
            deepest = max(deepest, overlap(blocks, s.centre(), s.rotation()))
        assert deepest < 2.0 * np.sqrt(mass / (0.5 * stiffness / 9))


@pytest.mark.parametrize("turn", [1e-9, 3e-9, 1e-8, 1e-7, 1e-5, 1e-3])
def test_beams_that_are_nearly_parallel_may_lie_on_one_another(turn):
    """Of the edges that are looked at for where they cross, some are parallel to within round-off: nothing is divided
    by what is left of the angle between them."""
    low = Block("low", (0.5, 0, -0.2), size=(4, 0.4, 0.4), density=DENSITY, fixed=True)
    for start in (0.0, 90.0):
        R = Rotation.from_euler("z", np.radians(start) + turn).as_matrix()
        high = Block("high", (0, 0.1, 0.2), size=(0.4, 4, 0.4), density=DENSITY, rotation=R)
        with Structure([low, high], ContactLaw(1e8, 0.3, 0.5)) as s:
            s.advance(0.05)
            assert abs(0.2 - s.centre()[1, 2]) < 5.0 * s.mass[1] * 9.81 / 1e8


@kernel
def found_crossing(shapes, x, R):
    """Pair of edges of bodies 0 and 1 with the smallest overlap, and the distance by which they are apart."""
    return find_crossing(shapes, 0, 1, x, R, np.inf, pair_scratch(shapes))


def pointed(name, random, sides, top):
    """A block over a regular polygon: a prism with top = 1, else a frustum, of which only the rims are parallel."""
    turn = 2.0 * np.pi * np.arange(sides) / sides
    ring = random.uniform(0.4, 0.6) * np.stack([np.cos(turn), np.sin(turn), 0.0 * turn], axis=1)
    return Block(
        name, STILL, vertices=np.concatenate([ring - [0, 0, 0.5], top * ring + [0, 0, 0.5]]), density=DENSITY
    )


def crossings_of_all_edges(blocks, x, R):
    """Overlap along the normal of each pair of edges, and which of these are outermost and cross between their ends."""
    points = [b.vertices @ turn.T + at for b, turn, at in zip(blocks, R, x)]
    edges = [[e for e, _ in block_edges(b)] for b in blocks]
    overlaps, crosses = [], []
    for a0, a1 in edges[0]:
        for b0, b1 in edges[1]:
            p, da, q, db = (
                points[0][a0],
                points[0][a1] - points[0][a0],
                points[1][b0],
                points[1][b1] - points[1][b0],
            )
            n = np.cross(da, db)
            if np.linalg.norm(n) < CROSSES * np.linalg.norm(da) * np.linalg.norm(db):
                overlaps.append(np.inf)
                crosses.append(False)
                continue
            n *= np.sign(n @ (x[0] - x[1])) / np.linalg.norm(n)
            low, high = (points[0] @ n).min(), (points[1] @ n).max()
            s, t, _ = np.linalg.solve(np.stack([da, -db, n], axis=1), q - p)
            overlaps.append(high - low)
            crosses.append(p @ n < low + 1e-9 and q @ n > high - 1e-9 and 0.0 <= s <= 1.0 and 0.0 <= t <= 1.0)
    return np.array(overlaps), np.array(crosses)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 10_000))
def test_parallel_edges_share_a_normal_and_the_outermost_pair_is_found(seed):
    """As by going through all pairs of edges, of which two boxes have 144 with nine normals."""
    random = np.random.default_rng(seed)
    blocks = [pointed(name, random, random.integers(3, 6), random.choice([1.0, 0.6])) for name in "ab"]
    R, way = Rotation.random(2, random_state=random).as_matrix(), random.normal(size=3)
    x = np.array([np.zeros(3), random.uniform(0.5, 1.2) * way / np.linalg.norm(way)])
    number, apart = found_crossing(contact_shapes(blocks, [], 3), x, R)
    overlaps, crosses = crossings_of_all_edges(blocks, x, R)
    if overlaps.min() < 0.0:
        assert number == -1
        assert apart > 0.0
    elif crosses.any():
        assert apart == -1.0
        assert overlaps[number] == pytest.approx(overlaps[crosses].min(), abs=1e-12)
    else:
        assert (number, apart) == (-1, -1.0)
