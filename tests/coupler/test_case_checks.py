"""What `check` refuses: bodies that cannot be where a case puts them, gauges that measure nothing, joints, motions."""

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.geometry.tank_mesh import measured
from tests.coupler.checked_case import case, reported, structure


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


def test_joints_that_let_water_in_are_measured_by_the_cells_around_them():
    row = structure(*({"size": [2, 2, 1.5], "centre": [5 + 2 * i, 5, 0.75]} for i in range(2)))
    wet = {"strength": 1e5, "opening_at_failure": 1e-3, "uplift": "full"}
    tank = {"lower": [0, 0, 0], "upper": [10, 10, 10], "cell": 1}
    far = {"refine": [{"lower": [0, 0, 7], "upper": [2, 2, 9]}]}
    near = {"refine": [{"lower": [3, 3, 0], "upper": [9, 7, 3]}]}
    (found,) = reported(measured(case(**row, joints=wet, tank=tank | far))[0])
    assert "the joint of 'b0' with 'b1' is 1.5 m wide (1 of 3 such joints are under 2 cells of 1 m)" in found
    assert reported(measured(case(**row, joints=wet, tank=tank | near))[0]) == []


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


def test_a_law_that_does_not_exist_or_has_no_potential_is_refused():
    block = structure({"centre": [7, 5, 0.5]})
    joints = {"strength": 1e5, "opening_at_failure": 1e-3}
    ((place, message),) = problems(case(joints=joints | {"law": "bilineer"}, **block))
    assert place == ("joints", "law")
    assert "did you mean 'bilinear'" in message
    wrong = joints | {"law": "bilinear", "mixed_mode": "needleman"}
    ((place, _),) = problems(case(joints=wrong, **block))
    assert place == ("joints", "mixed_mode")
