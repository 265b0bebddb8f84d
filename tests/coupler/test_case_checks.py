"""Bodies that cannot be where the case puts them, and what a box is: the geometry behind the messages."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.checks.remarks import remarks
from coupler.checks.thin_walls import thin_remarks
from coupler.geometry.bodies import Body, overlap_depth, rotation_matrix
from coupler.geometry.tank_mesh import measured
from yade_scripts.blocks.block import Block

SPACE = st.floats(-3.0, 3.0)
EDGE = st.floats(0.1, 2.0)


def turns(draw):
    axis = draw(st.tuples(SPACE, SPACE, SPACE).filter(lambda a: np.linalg.norm(a) > 0.1))
    return rotation_matrix(axis, draw(st.floats(-3.2, 3.2)))


@st.composite
def boxes(draw):
    """Centre, size, rotation."""
    return (
        np.array(draw(st.tuples(SPACE, SPACE, SPACE))),
        np.array(draw(st.tuples(EDGE, EDGE, EDGE))),
        turns(draw),
    )


@st.composite
def stones(draw):
    """A box, or a random hull of ten corners."""
    if draw(st.booleans()):
        return Body.box(*draw(boxes()))
    random = np.random.default_rng(draw(st.integers(0, 10**6)))
    x = random.normal(size=(10, 3))
    x /= np.linalg.norm(x, axis=1)[:, None]
    return Body.of_block(Block.standing("h", x + random.uniform(-2, 2, 3)))


@given(boxes())
def test_a_rotation_keeps_lengths_and_handedness(box):
    rotation = box[2]
    assert np.allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
    assert np.isclose(np.linalg.det(rotation), 1.0, rtol=1e-12)


@settings(deadline=None)
@given(stones(), stones())
def test_overlap_is_symmetric_and_agrees_with_points_and_planes(a, b):
    """A point in both bodies proves an overlap; corners on far sides of a plane prove that there is none; the depth is
    the same seen from either."""
    depth = overlap_depth(a, b)
    assert np.isclose(depth, overlap_depth(b, a), atol=1e-9)
    share = np.random.default_rng(0).dirichlet(np.full(len(a.vertices), 0.3), 100)
    inside_a = share @ a.vertices
    if (b.depth(inside_a) > 0.0).any():
        assert depth > 0.0
    heights = linprog_gap(a.vertices, b.vertices)
    assert (depth <= 1e-9) == heights if abs(depth) > 1e-6 else True


def linprog_gap(a, b):
    """Whether a plane n·x = c has a on one side and b on the other: a linear program, not an axis test."""
    rows = np.vstack([np.c_[a, -np.ones(len(a))], np.c_[-b, np.ones(len(b))]])
    found = linprog(np.zeros(4), A_ub=rows, b_ub=-np.ones(len(rows)), bounds=[(None, None)] * 4)
    return found.status == 0


@settings(deadline=None)
@given(stones(), SPACE, SPACE, SPACE)
def test_moving_apart_by_more_than_the_depth_can_part_two_bodies(a, x, y, z):
    """The depth is a length by which some move parts them: never more than a body's own thickness plus the other's."""
    b = Body(a.vertices + np.array([x, y, z]), a.normals, a.edges)
    assert overlap_depth(a, b) <= 2 * a.thickness() + 1e-9
    far = Body(a.vertices + a.normals[0] * 1.0001 * np.ptp(a.vertices @ a.normals[0]), a.normals, a.edges)
    assert overlap_depth(a, far) < 0.0


def test_the_depth_of_boxes_is_that_of_the_face_they_share():
    a = Body.box((0, 0, 0), (1, 1, 1), rotation_matrix((1, 2, 3), 0.7))
    b = Body.box(rotation_matrix((1, 2, 3), 0.7) @ [0.7, 0, 0], (1, 1, 1), rotation_matrix((1, 2, 3), 0.7))
    assert np.isclose(overlap_depth(a, b), 0.3, rtol=1e-12)


def case(**sections):
    """A tank of 10 m with water in its left half, and whatever sections come on top."""
    base = {
        "case": {"title": "x"},
        "time": {"end": 1},
        "tank": {"lower": [0, 0, 0], "upper": [10, 10, 10], "cell": 1},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [5, 10, 5]}]},
    }
    return Case.model_validate({k: v for k, v in (base | sections).items() if v is not None})


def structure(*blocks, **more):
    return {
        "structure": {
            "block": [{"name": f"b{i}", "size": [1, 1, 1], **b} for i, b in enumerate(blocks)],
            **more,
        },
        "contact": {"stiffness": 1e6},
    }


def reported(case):
    return [".".join(map(str, path)) + ": " + text for path, text in problems(case)]


def test_overlapping_blocks_are_named_both_with_the_overlap():
    found = reported(case(**structure({"centre": [7, 5, 0.5]}, {"centre": [7.8, 5, 0.5]})))
    assert found == ["structure.block.1: 'b1' overlaps 'b0' by 0.2 m; move one of them by that much"]


def test_a_pressure_gauge_inside_a_block_that_stands_fast_is_refused():
    gauge = [{"kind": "pressure", "name": "g", "at": [7, 5, 0.5]}]
    (found,) = reported(case(gauge=gauge, **structure({"centre": [7, 5, 0.5], "fixed": True})))
    assert found == "gauge.0.at: 'g' lies 0.5 m inside 'b0'; put it on the face"


def test_touching_blocks_do_not_overlap():
    """Decimal fractions are not exact in binary: 0.1 + 0.2 against 0.3 must count as touching."""
    a, b = {"centre": [7, 5, 0.15], "size": [1, 1, 0.3]}, {"centre": [7, 5, 0.1 + 0.2 + 0.5]}
    assert reported(case(**structure(a, b))) == []


def test_a_block_in_a_solid_is_an_overlap():
    solid = [{"name": "pier", "centre": [7, 5, 1], "size": [2, 2, 2]}]
    assert reported(case(solid=solid, **structure({"centre": [7, 5, 0.5]}))) == [
        "structure.block.0: 'b0' overlaps 'pier' by 1 m; move one of them by that much"
    ]


def test_a_block_in_the_water_is_a_floating_or_sunken_body_and_allowed():
    assert reported(case(**structure({"centre": [2, 5, 4.5]}))) == []


def test_a_fill_swallowed_by_a_solid_is_no_water():
    found = reported(case(solid=[{"centre": [2.5, 5, 2.5], "size": [5, 10, 5]}]))
    assert found == ["water.fill.0: this water lies wholly inside 'solid', so there is none"]


def test_a_block_beyond_the_tank_is_reported_with_the_side_and_the_distance():
    (found,) = reported(case(**structure({"centre": [9.7, 5, 0.5]})))
    assert "reaches 0.2 m beyond the side x+ of the tank (x = 10 m)" in found


def test_a_turned_block_reaches_further_than_its_edges():
    """A cube turned by 45 degrees about z is √2 wide: half of that is 0.707 m from its centre."""
    turned = {"centre": [9.4, 5, 0.5], "rotation": {"axis": [0, 0, 2], "angle": np.pi / 4}}
    (found,) = reported(case(**structure(turned)))
    assert "reaches 0.1071 m beyond the side x+" in found


def test_a_block_below_the_ground():
    dry = structure({"centre": [0, 0, 0.3]}, ground={"level": 0})
    assert reported(case(tank=None, water=None, **dry)) == [
        "structure.block.0: 'b0' reaches 0.2 m below the ground (z = 0 m); raise it"
    ]


def test_an_axis_without_direction():
    turned = {"centre": [7, 5, 0.5], "rotation": {"axis": [0, 0, 0], "angle": 1}}
    assert reported(case(**structure(turned))) == [
        "structure.block.0.rotation.axis: [0, 0, 0] is not a direction; write for instance [0, 0, 1]"
    ]


def building(**changes):
    house = {"lower": [6, 2, 0], "size": [4, 6, 8], "wall_thickness": 0.5, "block": [1, 1]} | changes
    parts = structure(**{"building": [house]})
    return case(**parts, joints={"strength": 1e5, "opening_at_failure": 1e-3})


def test_a_building_fits():
    assert reported(building(opening=[{"wall": "x-", "lower": [2, 0], "size": [1, 2]}])) == []


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            {"opening": [{"wall": "x-", "lower": [5.5, 0], "size": [1, 2]}]},
            "reaches from 5.5 to 6.5 m along the wall",
        ),
        (
            {"opening": [{"wall": "y+", "lower": [0, 7], "size": [1, 2]}]},
            "reaches from 7 to 9 m in height, outside",
        ),
        ({"wall_thickness": 2}, "two walls of 2 m leave no room in 'building' (4 m)"),
        ({"storeys": 16}, "storeys of 0.5 m have no room above floors of 0.5 m"),
        ({"size": [5, 6, 8]}, "reaches 1 m beyond the side x+ of the tank"),
    ],
)
def test_buildings_that_cannot_be(changes, says):
    (found,) = reported(building(**changes))
    assert says in found


def test_joints_that_let_water_in_are_two_cells_wide():
    """Reported for the narrowest, and not where they keep it out, by themselves or by pairs."""
    row = structure(*({"size": [2, 2, 0.5], "centre": [3 + 2 * i, 5, 0.25]} for i in range(3)))
    wet = {"strength": 1e5, "opening_at_failure": 1e-3, "uplift": "full"}
    (found,) = reported(case(**row, joints=wet))
    assert found.startswith(
        "joints.uplift: the joint of 'b0' with 'b1' is 0.5 m wide (2 of 5 such joints are under 2"
    )
    across = {"between": ["block", "block"], "uplift": "none"}
    assert reported(case(**row, joints=wet | {"uplift": "damage", "pair": [across]})) == []
    assert reported(case(**row, joints=wet | {"uplift": "none"})) == []


def test_a_block_in_a_room_is_free_and_one_in_the_wall_is_not():
    house = {"lower": [4, 2, 0], "size": [6, 6, 8], "wall_thickness": 0.5, "block": [1, 1]}
    joints = {"strength": 1e5, "opening_at_failure": 1e-3}
    assert reported(case(**structure({"centre": [7, 5, 0.5]}, building=[house]), joints=joints)) == []
    (found,) = reported(case(**structure({"centre": [4.8, 5, 0.5]}, building=[house]), joints=joints))
    assert "'building' overlaps 'b0' by 0.2 m" in found


@pytest.mark.parametrize(
    ("gauge", "says"),
    [
        ({"kind": "level", "at": [11, 5]}, "'g' is outside the tank: x = 11 m, not in 0 to 10 m"),
        ({"kind": "pressure", "at": [7, 5, 1]}, "'g' lies 1 m inside 'pier'; put it on the face"),
        ({"kind": "force", "on": "peer"}, "there is no body 'peer'; did you mean 'pier'?"),
        ({"kind": "motion", "of": "b1"}, "there is no block 'b1'; there are b0"),
        (
            {"kind": "reaction", "on": "peer"},
            "there is no block, group or solid 'peer'; did you mean 'pier'?",
        ),
    ],
)
def test_gauges_that_measure_nothing(gauge, says):
    solid = [{"name": "pier", "centre": [7, 5, 1], "size": [2, 2, 2]}]
    (found,) = reported(
        case(solid=solid, gauge=[{"name": "g", **gauge}], **structure({"centre": [2, 2, 0.5]}))
    )
    assert says in found


@pytest.mark.parametrize(
    ("shape", "says"),
    [
        (
            {"at": [9.9, 5, 1], "edges": [[0.4, 0, 0], [0, 1, 0]]},
            "out of the tank: no cell is at (10.07, 4.583, 1) m",
        ),
        ({"at": [5, 5, 0.1], "radius": 0.2, "normal": [1, 0, 0]}, "'g' reaches out of the tank"),
    ],
)
def test_a_patch_that_reaches_out_of_the_tank_is_refused_before_a_run(shape, says):
    (found,) = reported(case(gauge=[{"name": "g", "kind": "patch", **shape}]))
    assert says in found


def test_a_patch_in_the_corner_of_the_tank_is_in_it():
    edges = [[0, 0.3, 0], [0, 0, 0.3]]
    for at in ([10, 0.15, 0.15], [0, 9.85, 9.85]):
        assert reported(case(gauge=[{"name": "g", "kind": "patch", "at": at, "edges": edges}])) == []


def test_a_box_of_a_volume_gauge_beside_the_tank_is_refused():
    (found,) = reported(
        case(gauge=[{"name": "g", "kind": "volume", "lower": [11, 0, 0], "upper": [12, 1, 1]}])
    )
    assert "'g' lies beside the tank: x from 11 to 12 m, the tank from 0 to 10 m" in found
    wide = {"name": "g", "kind": "volume", "lower": [-1, -1, -1], "upper": [12, 11, 11]}
    assert reported(case(gauge=[wide])) == []


def test_a_reaction_needs_a_structure():
    """What holds a fixed solid is asked of the structure, and a case of water alone has none."""
    solid = [{"name": "pier", "centre": [7, 5, 1], "size": [2, 2, 2]}]
    (found,) = reported(case(solid=solid, gauge=[{"name": "g", "kind": "reaction", "on": "pier"}]))
    assert "there is no section [structure]" in found


def test_a_gauge_on_the_face_of_a_solid_is_where_it_belongs():
    solid = [{"name": "pier", "centre": [7, 5, 1], "size": [2, 2, 2]}]
    assert reported(case(solid=solid, gauge=[{"name": "g", "kind": "pressure", "at": [6, 5, 1]}])) == []


def test_names_are_unique():
    found = reported(case(**structure({"centre": [7, 5, 0.5]}, {"centre": [2, 5, 0.5], "name": "b0"})))
    assert found == [
        "structure.block.1.name: 'b0' is taken by structure.block[0]; give every body its own name"
    ]


def test_blocks_without_joints_need_a_contact_stiffness():
    """With joints the contact takes over their stiffness; without, there is none to take."""
    loose = structure({"centre": [7, 5, 0.5]}) | {"contact": {}}
    assert reported(case(**loose)) == [
        "contact: stiffness: missing; without [joints] there is nothing to take it from"
    ]
    assert reported(case(joints={"strength": 1e5, "opening_at_failure": 1e-3}, **loose)) == []


def test_a_contact_pair_says_something_of_its_own():
    for own, wrong in (({}, True), ({"friction": 0.0}, False), ({"uplift": "none"}, False)):
        found = structure({"centre": [7, 5, 0.5]})
        found["contact"]["pair"] = [{"materials": ["block", "tank"], **own}]
        says = "contact.pair.0: says nothing of this pair: give friction, uplift or both, or leave it out"
        assert reported(case(**found)) == [says] * wrong


def test_a_motion_needs_its_block():
    found = reported(
        case(motion=[{"block": "b00", "velocity": [0, 0, 1]}], **structure({"centre": [7, 5, 0.5]}))
    )
    assert found == ["motion.0.block: there is no block 'b00'; did you mean 'b0'?"]


MOVED = {"block": "b0", "velocity": [0.1, 0, 0]}


@pytest.mark.parametrize(
    ("block", "motion", "says"),
    [
        (
            {"fixed": True, "velocity": [1, 0, 0]},
            [],
            "structure.block.0.velocity: 'b0' has fixed = true as well, and a block that is held does not move",
        ),
        ({"fixed": True, "spin": [0, 0, 1]}, [], "structure.block.0.spin: 'b0' has fixed = true as well"),
        (
            {"fixed": True},
            [MOVED],
            "motion.0.block: 'b0' of structure.block[0] is held in place for the whole run",
        ),
        ({}, [MOVED, MOVED], "motion.1.block: the motion of 'b0' is given by motion[0] already"),
        (
            {"velocity": [0, 0, 1]},
            [MOVED],
            "motion.0.velocity: 'b0' has a velocity at the start as well (structure.block[0].velocity)",
        ),
        ({"spin": [0, 0, 1]}, [MOVED], "motion.0.velocity: 'b0' has a spin at the start as well"),
    ],
)
def test_a_block_has_one_motion(block, motion, says):
    """A block that is held and moves, or moves in two ways, is a contradiction that nobody resolves in silence."""
    (found,) = reported(case(motion=motion, **structure({"centre": [7, 5, 0.5], **block})))
    assert found.startswith(says)


def test_a_block_may_be_told_that_it_rests_at_the_start():
    rests = {"centre": [7, 5, 0.5], "velocity": [0, 0, 0], "spin": [0, 0, 0]}
    assert reported(case(**structure(rests | {"fixed": True}))) == []
    assert reported(case(motion=[MOVED], **structure(rests))) == []


@pytest.mark.parametrize(
    ("changes", "remarked"),
    [
        ({}, True),
        ({"contact": {"stiffness": 1e9, "pair": [{"materials": ["block", "tank"], "friction": 0}]}}, False),
        ({"joints": {"strength": 1e5, "opening_at_failure": 1e-3}}, False),
        ({"tank": {"lower": [0, 0, 0], "upper": [4, 2, 3], "cell": 0.5}}, False),
        ({"tank": {"lower": [0, 0, 0], "upper": [4, 1, 3], "cell": 0.5, "open": ["z+", "y+"]}}, False),
    ],
    ids=["a slice", "no friction", "joined", "a gap", "an open side"],
)
def test_loose_blocks_from_side_to_side_of_a_slice_are_remarked(changes, remarked):
    """Their friction on the sides carries a load that a longer wall does not have, and kept one standing."""
    wall = {"name": "w", "lower": [2, 0, 0], "size": [0.5, 1, 2], "block": [0.5, 0.5, 0.5]}
    tank = {"lower": [0, 0, 0], "upper": [4, 1, 3], "cell": 0.5}
    made = case(**{"structure": {"wall": [wall]}, "contact": {"stiffness": 1e9}, "tank": tank} | changes)
    found = [text for text in remarks(made) if "rub on both sides" in text]
    assert bool(found) == remarked
    if remarked:
        assert "reach from y- to y+ of the tank and rub on both sides, with friction 0.5" in found[0]
        assert found[0].endswith(
            'materials = ["block", "tank"], friction = 0, and [structure.ground] for that of the floor'
        )


@pytest.mark.parametrize(
    ("place", "more", "remarked"),
    [
        ([3, 5, 1], {}, True),
        ([8, 5, 1], {}, False),
        ([3, 5, 8], {}, False),
        ([3, 5, 1], {"joints": {"strength": 1e5, "opening_at_failure": 1e-3}}, False),
        ([3, 5, 1], {"water": None}, False),
    ],
    ids=["in water", "beside it", "above it", "joined", "no water"],
)
def test_loose_blocks_in_water_without_their_weight_are_remarked(place, more, remarked):
    """A dry arch under water came apart in the first tenth of its ramp, and stands with its weight from the start."""
    blocks = structure({"centre": place, "size": [2, 2, 2]})
    blocks["structure"] |= {"start": "ramp", "ramp": 1.0}
    found = [text for text in remarks(case(**blocks | more)) if "start = 'ramp'" in text]
    assert bool(found) == remarked


def test_walls_thinner_than_a_cell_are_remarked():
    """Single covers lose load on walls thinner than a cell; allowed, but not in silence."""
    thin = {"centre": [7, 5, 1], "size": [0.2, 2, 2]}
    assert remarks(case(**structure({"centre": [7, 5, 0.5]}))) == []
    assert remarks(case(**structure(thin)))[0].startswith("b0 is 0.2 m thick, thinner than a cell (1 m)")
    wall = {"name": "w", "lower": [6, 2, 0], "size": [1.4, 4, 2], "block": [1.4, 2, 1]}
    found = [
        text
        for text in remarks(case(structure={"wall": [wall]}, contact={"stiffness": 1e8}))
        if "thin" in text
    ]
    assert found[0].startswith("w is 1.4 m thick, thinner than two cells (1 m): with single covers")
    assert "water pass through" in found[0]


QUAY = {"name": "quay", "centre": [30.3, 4, 3], "size": [1.2, 8, 6]}
FINE_BOX = {"refine": [{"lower": [0, 0, 0], "upper": [3, 8, 2], "levels": 2}]}


def long_tank(solid, **tank):
    """A tank of 40 x 8 x 8 m, measured, with cells of 1 m unless `tank` says otherwise."""
    content = case(
        tank={"lower": [0, 0, 0], "upper": [40, 8, 8], "cell": 1, **tank},
        water={"fill": [{"lower": [0, 0, 0], "upper": [10, 8, 4]}]},
        solid=[solid],
    )
    found, wrong = measured(content)
    assert wrong == []
    return found


@pytest.mark.parametrize(
    ("solid", "tank", "says"),
    [
        (QUAY, {}, "quay is 1.2 m thick, thinner than two cells (1 m)"),
        (QUAY, FINE_BOX, "quay is 1.2 m thick, thinner than two cells (1 m)"),
        (
            QUAY | {"size": [2.5, 8, 6]},
            {"stretch": [{"along": "x", "lower": 20, "cell": 4}]},
            "quay is 2.5 m thick, thinner than a cell (4 m)",
        ),
        (QUAY, {"stretch": [{"along": "y", "cell": 2}]}, "quay is 1.2 m thick, thinner than two cells (1 m)"),
        (QUAY, {"refine": [{"around": ["quay"], "levels": 1}]}, ""),
        (
            {"name": "mole", "centre": [20, 4, 1], "size": [36, 1.2, 2]},
            FINE_BOX,
            "mole is 1.2 m thick, thinner than two cells (1 m)",
        ),
    ],
)
def test_walls_are_thin_by_the_cells_that_they_stand_in(solid, tank, says):
    """Finer cells elsewhere make no wall thicker; coarser ones across it make it thinner, along it they do not."""
    found = [text for text in thin_remarks(long_tank(solid, **tank))]
    assert [text[: len(says)] for text in found] == ([says] if says else [])


def test_bodies_that_fill_a_slice_are_not_thin_across_it():
    """Water is on both sides of a wall along a slice, not across it, where the wall reaches from side to side."""
    slice_of = {"tank": {"lower": [0, 0, 0], "upper": [40, 1, 8], "cell": 1}}
    wall = {"name": "w", "size": [3, 1, 6]}
    bodies = [
        {"solid": [wall | {"centre": [20, 0.5, 3]}]},
        structure(wall | {"centre": [20, 0.5, 3]}),
        structure(wall=[{"name": "w", "lower": [20, 0, 0], "size": [3, 1, 6], "block": [3, 1, 1]}]),
    ]
    assert [list(thin_remarks(case(**slice_of, **body))) for body in bodies] == [[], [], []]
    (found,) = thin_remarks(case(**slice_of, solid=[wall | {"centre": [20, 0.5, 3], "size": [0.8, 1, 6]}]))
    assert found.startswith("w is 0.8 m thick, thinner than a cell (1 m)")
    (found,) = thin_remarks(case(**slice_of, solid=[wall | {"centre": [20, 0.4, 3], "size": [3, 0.6, 6]}]))
    assert found.startswith("w is 0.6 m thick")


def test_blocks_walls_and_buildings_are_thin_by_the_cells_that_they_stand_in():
    parts = {
        "block": [{"name": "slab", "centre": [30, 4, 0.25], "size": [2, 2, 0.5]}],
        "wall": [{"name": "w", "lower": [20, 0, 0], "size": [1.5, 4, 2], "block": [1.5, 2, 1]}],
        "building": [
            {"name": "h", "lower": [10, 0, 0], "size": [6, 6, 4], "wall_thickness": 1.2, "block": [1, 1]}
        ],
    }
    for kind, tables in parts.items():
        made = case(
            tank={"lower": [0, 0, 0], "upper": [40, 8, 8], "cell": 1, **FINE_BOX},
            structure={kind: tables},
            contact={"stiffness": 1e6},
        )
        (found,) = thin_remarks(measured(made)[0])
        assert found.startswith(f"{tables[0]['name']} is "), found


def test_joints_that_let_water_in_are_measured_by_the_cells_around_them():
    row = structure(*({"size": [2, 2, 1.5], "centre": [5 + 2 * i, 5, 0.75]} for i in range(2)))
    wet = {"strength": 1e5, "opening_at_failure": 1e-3, "uplift": "full"}
    tank = {"lower": [0, 0, 0], "upper": [10, 10, 10], "cell": 1}
    far = {"refine": [{"lower": [0, 0, 7], "upper": [2, 2, 9]}]}
    near = {"refine": [{"lower": [3, 3, 0], "upper": [9, 7, 3]}]}
    (found,) = reported(measured(case(**row, joints=wet, tank=tank | far))[0])
    assert "the joint of 'b0' with 'b1' is 1.5 m wide (1 of 3 such joints are under 2 cells of 1 m)" in found
    assert reported(measured(case(**row, joints=wet, tank=tank | near))[0]) == []


def test_a_single_pass_with_blocks_lighter_than_the_water_is_remarked():
    """Of the free blocks the lightest is named; stone needs no second pass, nor a block that is held or driven."""
    stone, wood = {"centre": [7, 5, 0.5]}, {"centre": [7, 7, 0.5], "density": 500.0}
    single = {"coupling": {"passes": 1}}
    (found,) = remarks(
        case(**single, **structure(stone, wood, wood | {"centre": [7, 2, 0.5], "density": 400.0}))
    )
    assert found.startswith("coupling.passes = 1 with 'b2' of 400 kg/m3, lighter than the water (1000 kg/m3)")
    assert "leave coupling.passes at 2" in found
    driven = {"motion": [{"block": "b1", "velocity": [0, 0, 0.1]}]}
    for silent in (
        structure(stone, wood),
        single | structure(stone),
        single | structure(stone, wood | {"fixed": True}),
        single | driven | structure(stone, wood),
        single | {"water": None} | structure(stone, wood),
    ):
        assert not [text for text in remarks(case(**silent)) if "passes" in text]


def test_a_mesh_beyond_the_memory_of_the_machine_is_refused(monkeypatch):
    """6000 cells do not fit into 1 MB; the message names a cell that fits."""
    content = {
        "case": {"title": "a tank"},
        "time": {"end": 1},
        "tank": {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell": 0.1},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 0.5]}]},
    }
    assert problems(Case.model_validate(content)) == []
    monkeypatch.setattr("coupler.program.memory.os.sysconf", lambda name: 1000)
    ((place, message),) = problems(Case.model_validate(content))
    assert place == ("tank", "cell")
    fits = float(message.rpartition("cells of ")[2].split()[0])
    each = 660  # bytes, measured on meshes below 1.4 million cells (docs/speed.md)
    assert 6 * fits**-3 * each < 1e6 < 6 * (0.8 * fits) ** -3 * each


def test_too_few_points_for_joints_that_close_stiffly_are_remarked():
    """Three Gauss points miss the edge that such a joint turns about."""
    block = structure({"centre": [7, 5, 0.5]})
    joints = {"strength": 1e5, "opening_at_failure": 1e-3, "closing_ratio": 10.0}
    assert remarks(case(joints=joints | {"points": 3}, **block))[0].startswith(
        "joints.points = 3 with joints.closing_ratio = 10"
    )
    for enough in (6, "auto"):
        assert remarks(case(joints=joints | {"points": enough}, **block)) == []


def test_a_law_that_does_not_exist_or_has_no_potential_is_refused():
    block = structure({"centre": [7, 5, 0.5]})
    joints = {"strength": 1e5, "opening_at_failure": 1e-3}
    ((place, message),) = problems(case(joints=joints | {"law": "bilineer"}, **block))
    assert place == ("joints", "law")
    assert "did you mean 'bilinear'" in message
    wrong = joints | {"law": "bilinear", "mixed_mode": "needleman"}
    ((place, _),) = problems(case(joints=wrong, **block))
    assert place == ("joints", "mixed_mode")


@pytest.mark.parametrize(
    ("sections", "says"),
    [
        (structure({"centre": [7, 5, 0.5]}, density=2.4), "density of 'b0' is 2.4 kg/m3"),
        (
            {
                **structure({"centre": [7, 5, 0.5]}),
                "joints": {"strength": "2 mPa", "opening_at_failure": 1e-3},
            },
            "joints.strength is 0.002 Pa",
        ),
        (
            {**structure({"centre": [7, 5, 0.5]}), "joints": {"strength": 1e6, "opening_at_failure": 1}},
            "joints.opening_at_failure is 1 m",
        ),
        (
            structure({"centre": [7, 5, 2], "rotation": {"axis": [0, 0, 1], "angle": 90}}),
            "structure.block[0].rotation.angle is 90 rad, more than a full turn; degrees are text",
        ),
        (
            {
                "solid": [
                    {
                        "name": "s",
                        "centre": [7, 5, 3],
                        "size": [1, 1, 1],
                        "rotation": {"axis": [1, 0, 0], "angle": -45},
                    }
                ]
            },
            "solid[0].rotation.angle is -45 rad",
        ),
        (
            {**structure({"centre": [7, 5, 0.5]}), "contact": {"stiffness": 1e6, "friction": 40}},
            "contact.friction is 40, rougher than any dry faces; it is the tangential over the normal force, which for "
            "an angle of 40 degrees is 0.84",
        ),
        (
            {
                **structure({"centre": [7, 5, 0.5]}),
                "contact": {"stiffness": 1e6, "pair": [{"materials": ["block", "tank"], "friction": 35}]},
            },
            "contact.pair[0].friction is 35",
        ),
        (
            {"water": {"density": 1, "fill": [{"lower": [0, 0, 0], "upper": [5, 10, 5]}]}},
            'water.density is 1 kg/m3; other units are text, "1 t/m3"',
        ),
        (
            {"gauge": [{"kind": "pressure", "name": "g", "at": [1, 1, 1], "impulse": [2, 3]}]},
            "gauge 'g' begins to add up at 2 s",
        ),
        (
            {"gauge": [{"kind": "flux", "name": "g", "at": [7, 0, 0], "edges": [[0, 10, 0], [0, 0, 5]]}]},
            "75 % of the patch of gauge 'g' lies outside the tank, where nothing flows; its key at is the centre",
        ),
        (
            {**structure({"centre": [7, 5, 2]}), "gauge": [{"kind": "reaction", "name": "g", "on": "b0"}]},
            "gauge 'g' measures what holds 'b0', and nothing does, so that it reads 0",
        ),
    ],
)
def test_values_that_look_like_a_wrong_unit_are_reported(sections, says):
    """Allowed, since somebody may mean it: g/cm3 as a plain number, mPa for MPa, m for mm, a window after the end."""
    assert any(says in remark for remark in remarks(case(**sections)))
    assert reported(case(**sections)) == []


def test_a_unit_weight_that_is_given_as_a_density_is_remarked_on():
    """24 kN/m3 of concrete as 24 kg/m3: the house swims away. A loose float of foam is meant."""
    wall = {"lower": [7, 4, 0], "size": [1, 2, 2], "block": [1, 1, 1], "density": 24}
    sections = {"structure": {"wall": [wall]}, "contact": {"stiffness": 1e9}}
    found = [text for text in remarks(case(**sections)) if "unit weight" in text]
    assert found == [
        "the density of 'wall-0-0-0' is 24 kg/m3, that of foam; a unit weight of 24 kN/m3 is a density of 2446 kg/m3"
    ]
    buoy = structure({"centre": [7, 5, 2], "density": 24}) | {"contact": {"stiffness": 1e9}}
    assert not [text for text in remarks(case(**buoy)) if "unit weight" in text]


def test_plausible_angles_friction_and_densities_are_not_remarked_on():
    """A full turn, rubber on concrete, sea water."""
    block = {"centre": [7, 5, 2], "rotation": {"axis": [0, 0, 1], "angle": "360 deg"}}
    water = {"density": 1025, "fill": [{"lower": [0, 0, 0], "upper": [5, 10, 5]}]}
    found = case(water=water, **structure(block) | {"contact": {"stiffness": 1e9, "friction": 1.2}})
    assert remarks(found) == []
