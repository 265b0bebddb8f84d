"""Walls, columns, arches and rubble: exact volumes, joints where they belong, and nothing that overlaps."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from yade_scripts.blocks.block import BlockError
from yade_scripts.blocks.faces import FixedPlane, touching_faces
from yade_scripts.blocks.generators.arch import Arch, abutment_blocks, arch_blocks
from yade_scripts.blocks.generators.column import column_of_boxes, column_of_drums
from yade_scripts.blocks.generators.rubble import rubble_blocks
from yade_scripts.blocks.generators.wall import wall_of_blocks

GROUND = FixedPlane((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))


def bed_area(faces):
    return sum(f.area for f in faces if abs(f.normal[2]) > 0.5)


@pytest.mark.parametrize("bond", ["stack", "running"])
@pytest.mark.parametrize("along", [None, "x", "y"])
def test_a_wall_fills_its_box_and_joins_in_every_bond(bond, along):
    """Volume, area of bed joints (three between four courses) and area of collar joints (one between two wythes) do
    not depend on the bond: only where the head joints lie does."""
    blocks = wall_of_blocks("w", (1, 2, 3), (6.0, 0.5, 2.0), (1.0, 0.25, 0.5), bond, along)
    faces = touching_faces(blocks, [GROUND])
    assert sum(b.volume for b in blocks) == pytest.approx(6.0, rel=1e-12)
    assert bed_area(faces) == pytest.approx(3 * 6.0 * 0.5, rel=1e-12)
    if along != "y":
        assert sum(f.area for f in faces if abs(f.normal[1]) > 0.5) == pytest.approx(6.0 * 2.0, rel=1e-12)
    assert len({b.name for b in blocks}) == len(blocks)


def test_running_bond_breaks_the_head_joints():
    """No head joint continues from one course to the next; each inner block lies on two."""
    blocks = wall_of_blocks("w", (0, 0, 0), (10.0, 0.3, 2.0), (1.0, 0.3, 0.5), "running")
    heads = [
        {round(b.centre[0] + 0.5 * b.size[0], 9) for b in blocks if abs(b.centre[2] - z) < 1e-9} - {10.0}
        for z in (0.25, 0.75, 1.25, 1.75)
    ]
    assert all(not (a & b) for a, b in pairwise(heads))
    beds = [f for f in touching_faces(blocks) if abs(f.normal[2]) > 0.5]
    assert {round(f.area, 6) for f in beds} == {0.15}


def test_wythes_of_a_running_bond_are_shifted_against_each_other():
    blocks = wall_of_blocks("w", (0, 0, 0), (0.5, 4.0, 1.0), (0.25, 1.0, 1.0), "running")
    inner = {round(b.centre[1], 9) for b in blocks if b.centre[0] < 0.25}
    assert inner.isdisjoint({round(b.centre[1], 9) for b in blocks if b.centre[0] > 0.25})


@pytest.mark.parametrize("sides", [3, 4, 7, 12])
def test_a_tapered_column_has_the_volume_of_its_frustum(sides):
    """V = h/3 (A + sqrt(A a) + a); drums touch over their whole faces, so three joints between four drums."""
    blocks = column_of_drums("c", (1, 2, 0), 0.5, 4.0, 4, sides, top_radius=0.3)
    area = 0.5 * sides * np.sin(2 * np.pi / sides) * np.array([0.25, 0.09])
    volume = 4.0 / 3.0 * (area.sum() + np.sqrt(area.prod()))
    assert sum(b.volume for b in blocks) == pytest.approx(volume, rel=1e-12)
    faces = touching_faces(blocks, [GROUND])
    joined = 0.5 * sides * np.sin(2 * np.pi / sides) * np.array([0.5, 0.45, 0.4, 0.35]) ** 2
    assert sorted(f.area for f in faces) == pytest.approx(sorted(joined), rel=1e-9)
    assert all(len(b.faces) == sides + 2 for b in blocks)


def test_a_column_of_boxes_stands_on_its_foot():
    blocks = column_of_boxes("c", (1, 2, 3), (0.5, 0.4, 4.0), 4)
    np.testing.assert_allclose([b.centre for b in blocks], [(1, 2, z) for z in (3.5, 4.5, 5.5, 6.5)])
    assert len(touching_faces(blocks)) == 3


@settings(max_examples=25, deadline=None)
@given(st.floats(0.15, 0.5), st.integers(2, 25), st.floats(0.02, 0.3), st.sampled_from("xy"))
def test_voussoirs_fill_the_ring_and_meet_in_whole_joints(rise, count, thickness, along):
    """A ring of chords between R and R + t has the area count/2 sin(2φ/count) ((R + t)² - R²); every joint is t × w,
    the outer ones lie on the seats of the abutments, and these take the thrust."""
    arch = Arch("a", (5, 6, 2), 1.0, rise, thickness, 0.4, count, along, (thickness, 0.5))
    blocks = arch_blocks(arch)
    angle = 2.0 * arch.half_angle / count
    ring = 0.5 * count * np.sin(angle) * ((arch.radius + thickness) ** 2 - arch.radius**2)
    assert sum(b.volume for b in blocks) == pytest.approx(0.4 * ring, rel=1e-9)
    faces = touching_faces([*blocks, *abutment_blocks(arch)])
    assert len(faces) == count + 1
    np.testing.assert_allclose([f.area for f in faces], thickness * 0.4, rtol=1e-6)
    assert {(f.a, f.b) for f in faces} == {(k, k + 1) for k in range(count - 1)} | {
        (0, count),
        (count - 1, count + 1),
    }


def test_an_arch_spans_what_it_says():
    arch = Arch("a", (0, 0, 1.0), 4.0, 1.0, 0.5, 1.0, 9)
    crown = arch_blocks(arch)[4].world_vertices()
    assert crown[:, 2].min() == pytest.approx(
        2.0 - arch.radius * (1 - np.cos(arch.half_angle / 9)), abs=1e-12
    )
    first = arch_blocks(arch)[0].world_vertices()
    assert np.abs(first - [-2.0, -0.5, 1.0]).sum(axis=1).min() < 1e-12


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"rise": 0.6}, "at most half its span"),
        ({"thickness": 0.0}, "thickness"),
        ({"count": 1}, "two voussoirs"),
        ({"along": "z"}, "along"),
        ({"abutment": (0.05, 1.0)}, "length must be at least"),
    ],
)
def test_an_arch_that_cannot_be_is_refused(changes, says):
    right = {"span": 1.0, "rise": 0.5, "thickness": 0.1, "width": 1.0, "count": 7}
    with pytest.raises(BlockError, match=says):
        Arch("a", (0, 0, 0), **(right | changes))


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from(["polyhedra", "boxes", "mixed"]))
def test_rubble_is_apart_inside_and_the_same_again(seed, shape):
    """Spheres around the blocks neither meet nor leave the box; sizes are within their range; the seed decides."""
    lower, size = np.array([1.0, 2.0, 3.0]), np.array([3.0, 2.0, 4.0])
    blocks = rubble_blocks("r", lower, size, 20, (0.2, 0.6), seed, shape)
    radius, centre = np.array([b.radius for b in blocks]), np.array([b.centre for b in blocks])
    apart = np.linalg.norm(centre[:, None] - centre[None], axis=2) - radius[:, None] - radius[None]
    assert apart[np.triu_indices(20, 1)].min() > 0.0
    corners = np.concatenate([b.world_vertices() for b in blocks])
    assert (corners > lower).all()
    assert (corners < lower + size).all()
    assert 0.2 <= 2 * radius.min() <= 2 * radius.max() <= 0.6
    again = rubble_blocks("r", lower, size, 20, (0.2, 0.6), seed, shape)
    assert all(np.array_equal(a.world_vertices(), b.world_vertices()) for a, b in zip(blocks, again))
    assert not touching_faces(blocks)


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"count": 200}, "of 200 blocks found room"),
        ({"diameter": (0.6, 0.2)}, "the smallest, then the largest"),
        ({"diameter": (0.2, 5.0)}, "does not fit"),
        ({"shape": "spheres"}, "shape"),
        ({"corners": 3}, "corners = 3"),
    ],
)
def test_rubble_that_finds_no_room_is_refused(changes, says):
    right = {"lower": (0, 0, 0), "size": (1, 1, 1), "count": 3, "diameter": (0.3, 0.4), "seed": 1}
    with pytest.raises(BlockError, match=says):
        rubble_blocks("r", **(right | changes))


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: wall_of_blocks("w", (0, 0, 0), (1, 1, 1), (1, 1, 0)), "block"),
        (lambda: wall_of_blocks("w", (0, 0, 0), (1, 1, 1), (1, 1, 1), bond="flemish"), "bond"),
        (lambda: wall_of_blocks("w", (0, 0, 0), (1, 1, 1), (1, 1, 1), along="z"), "along"),
        (lambda: column_of_drums("c", (0, 0, 0), 1.0, 2.0, 3, sides=2), "sides"),
        (lambda: column_of_drums("c", (0, 0, 0), 1.0, -2.0, 3), "positive"),
        (lambda: column_of_boxes("c", (0, 0, 0), (1, 1, 1), 0), "at least one drum"),
    ],
)
def test_walls_and_columns_that_cannot_be_are_refused(make, says):
    with pytest.raises(BlockError, match=says):
        make()
