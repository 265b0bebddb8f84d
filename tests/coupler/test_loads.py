"""Loads split by what they come from: the parts add up to what the blocks do, and each is right where it is known."""

from types import SimpleNamespace

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.results.loads import BlockLoads, GroupLoads, _passed, loads
from coupler.run.run import ARRIVED, _has_arrived, load_of_what_moves
from coupler.scene.build import build
from tests.coupler.test_momentum import run, scene
from tests.fakes import no_clock

RHO, G = 1000.0, 9.81
POINT = np.array([0.2, -0.1, 0.3])


def parts_of(loads_of_block):
    return {name: value for name, value in loads_of_block.items() if np.abs(value).max() > 1e-9}


def test_parts_add_up_to_mass_times_acceleration():
    """Free blocks in a dam break, with friction, contact and joints that break: the sum over the step is the change of
    momentum and of angular momentum about a point, to round-off."""
    rows, seen = np.array([0, 1, 2]), set()
    state = {}

    def each(coupling, record):
        now = coupling.structure.momentum(POINT)
        found = loads(coupling, record, rows, POINT)
        total = record.dt * sum(part.sum(axis=0) for part in found.values())
        scale = record.dt * sum(np.abs(part).sum() for part in found.values())
        np.testing.assert_allclose(total, now - state.get("before", np.zeros(6)), atol=1e-11 * scale)
        state["before"] = now
        seen.update(name for name, part in found.items() if np.abs(part).max() > 1e-6)

    fill = [{"lower": [0, 0, 0], "upper": [0.5, 0.5, 0.4]}]
    run(scene(water={"fill": fill, "walls": "friction", "roughness": 0.002}), 0.35, each)
    assert seen == {"pressure", "friction", "contact", "joint", "weight"}


def test_free_fall_has_its_weight_alone():
    case = Case.model_validate(
        {
            "case": {"title": "t"},
            "time": {"end": 0.1},
            "structure": {
                "block": [{"name": "b", "centre": [0, 0, 2], "size": [0.2, 0.1, 0.1]}],
                "ground": {},
            },
            "contact": {"stiffness": 1e6},
        }
    )

    def each(coupling, record):
        found = parts_of(loads(coupling, record, np.array([0]), np.zeros(3)))
        assert list(found) == ["weight"]
        np.testing.assert_allclose(found["weight"][0, :3], [0, 0, -2400 * 0.002 * G])

    run(case, 0.1, each)


def wall_case(**gauge):
    """A held wall across the tank with still water of 0.37 m on one side, a cell and a half thick."""
    return Case.model_validate(
        {
            "case": {"title": "t"},
            "time": {"end": 0.05},
            "tank": {"lower": [0, 0, 0], "upper": [1, 0.3, 0.6], "cell": 0.1},
            "water": {"fill": [{"lower": [0, 0, 0], "upper": [0.53, 0.3, 0.37]}], "covers": "multiple"},
            "structure": {
                "block": [
                    {"name": "wall", "centre": [0.605, 0.15, 0.3], "size": [0.15, 0.3, 0.6], "fixed": True},
                ]
            },
            "contact": {"stiffness": 1e6},
            "gauge": [
                {"kind": "loads", "name": "w", "on": "wall", "about": [0.53, 0.15, 0.0]} | gauge,
                {"kind": "force", "name": "f", "on": "wall", "about": [0.53, 0.15, 0.0]},
            ],
        }
    )


def test_still_water_on_a_wall():
    """ρ g d² b/2 at a third of the depth, and its weight; nothing else acts on it."""
    case, depth, width = wall_case(), 0.37, 0.3
    assert problems(case) == []
    made = build(case, no_clock)
    try:
        gauge, of_force = made.gauges
        record = made.coupling.step(0.01)
        (row,), alone = gauge.read(made.coupling, record), of_force.read(made.coupling, record)
        middle = made.coupling.structure.centre()
        (own,) = BlockLoads(np.array([0]), ["wall"], middle, ["pressure", "weight"]).read(
            made.coupling, record
        )
    finally:
        made.coupling.structure.close()
    force = 0.5 * RHO * G * depth**2 * width
    assert gauge.table == "loads_w"
    assert row["pressure_force_x"] == pytest.approx(force, rel=1e-5)
    assert row["pressure_moment_y"] == pytest.approx(force * depth / 3, rel=1e-4)
    assert alone["f_force_x"] == pytest.approx(force, rel=1e-5)
    assert alone["f_moment_y"] == pytest.approx(force * depth / 3, rel=1e-4)
    assert row["total_force_x"] == pytest.approx(force, rel=1e-5)
    assert row["weight_force_z"] == pytest.approx(-2400 * 0.15 * 0.3 * 0.6 * G, rel=1e-9)
    assert row["pressure_impulse_x"] == pytest.approx(0.01 * force, rel=1e-5)
    assert row["contact_force_z"] == row["friction_force_x"] == 0.0
    # the row of a block is about its own centre, half of the wall up, where its weight has no moment
    assert own["pressure_moment_y"] == pytest.approx(force * (depth / 3 - 0.3), rel=1e-4)
    assert own["weight_moment_y"] == pytest.approx(0.0, abs=1e-9 * abs(own["weight_force_z"]))


def test_rows_of_each_block_hold_the_impulses_of_the_group():
    """Means over intervals of several steps, block by block, add up to the impulses of the group."""
    rows, names = np.array([0, 1, 2]), ["light", "foot", "top"]
    parts = ["pressure", "friction", "contact", "joint", "weight"]
    group = GroupLoads(rows, np.zeros(3), parts)
    each_block = BlockLoads(rows, names, np.zeros((3, 3)), parts, every=0.05)
    reported = []

    def each(coupling, record):
        reported.append((group.read(coupling, record)[0], each_block.read(coupling, record)))

    run(scene(), 0.2, each)
    sums, written = reported[-1][0], [row for _, rows_now in reported for row in rows_now]
    assert len(written) == 3 * 4
    assert [row["block"] for row in written[:3]] == names
    for part in parts:
        total = sum(row["over"] * row[f"{part}_force_x"] for row in written)
        assert total == pytest.approx(sums[f"{part}_impulse_x"], abs=1e-9)


def test_a_row_is_due_once_in_each_interval_whatever_rounding_does():
    """In steps of half an interval every other one has a row, although sums of 0.05 fall short of multiples of 0.1."""
    time, due = 0.0, []
    for _ in range(400):
        before, time = time, time + 0.05
        due.append(bool(_passed(before, time, 0.1)))
    assert due == [False, True] * 200


def test_accumulated_loads_go_on_from_what_was_saved():
    group = GroupLoads(np.array([0]), np.zeros(3), ["weight"], None, 0.1)
    group.windows["weight"].add(0.1, 0.1, [1.0, 2.0, 3.0])
    again = GroupLoads(np.array([0]), np.zeros(3), ["weight"], None, 0.1)
    again.restore(group.save())
    np.testing.assert_array_equal(again.windows["weight"].total, group.windows["weight"].total)
    one = BlockLoads(np.array([0]), ["a"], np.zeros((1, 3)), ["weight"], 0.5)
    one._impulse["weight"] += 1.0
    other = BlockLoads(np.array([0]), ["a"], np.zeros((1, 3)), ["weight"], 0.5)
    other.restore(one.save())
    np.testing.assert_array_equal(other._impulse["weight"], 1.0)


def test_parts_of_the_force_gauge_add_up_to_the_force():
    """Pressure over whole cells, its correction at the surface, friction: for a pier in moving, rough water."""
    case = Case.model_validate(
        {
            "case": {"title": "t"},
            "time": {"end": 0.3},
            "tank": {"lower": [0, 0, 0], "upper": [1, 0.3, 0.6], "cell": 0.1},
            "water": {
                "fill": [{"lower": [0, 0, 0], "upper": [0.5, 0.3, 0.4]}],
                "walls": "friction",
                "roughness": 0.01,
            },
            "solid": [{"name": "pier", "centre": [0.73, 0.15, 0.3], "size": [0.15, 0.1, 0.6]}],
            "gauge": [{"kind": "force", "name": "f", "on": "pier", "about": [0, 0, 0], "parts": True}],
        }
    )
    made = build(case, no_clock)
    largest = dict.fromkeys(("pressure", "surface", "friction"), 0.0)
    while made.coupling.time < 0.3 - 1e-9:
        record = made.coupling.step(made.coupling.step_size(0.3 - made.coupling.time))
        row = made.gauges[0].read(made.coupling, record)
        for what in ("force_x", "moment_y"):
            split = [row[f"f_{part}_{what}"] for part in largest]
            assert sum(split) == pytest.approx(row[f"f_{what}"], abs=1e-9)
        for part in largest:
            largest[part] = max(largest[part], abs(row[f"f_{part}_force_x"]))
    assert all(size > 1e-3 for size in largest.values()), largest


@pytest.mark.parametrize(
    ("gauge", "message"),
    [
        ({"on": "wal"}, "there is no body 'wal'"),
        ({"every": 0.01}, "is for the rows of each block"),
        ({"impulse": [1.0, 0.5]}, "the end must come after the start"),
    ],
)
def test_loads_that_cannot_be_are_refused(gauge, message):
    assert any(message in text for _, text in problems(wall_case(**gauge)))


def test_water_without_weight_is_refused():
    case = wall_case().model_copy(update={"case": wall_case().case.model_copy(update={"gravity": 0.0})})
    assert any("water needs gravity" in text for _, text in problems(case))


def test_the_largest_force_of_a_run_is_that_on_what_can_move():
    """A quay that is held bears a thousand times the load of the house on it."""
    force = np.array([[3.0, 4.0, 0.0, 0, 0, 0], [5000.0, 0.0, 0.0, 0, 0, 0]])
    record = SimpleNamespace(load=force)
    house = SimpleNamespace(structure=SimpleNamespace(fixed=np.array([False, True])))
    quay = SimpleNamespace(structure=SimpleNamespace(fixed=np.array([True, True])))
    np.testing.assert_array_equal(load_of_what_moves(house, record), [3.0, 4.0, 0.0])
    np.testing.assert_array_equal(load_of_what_moves(quay, record), [5003.0, 4.0, 0.0])
    np.testing.assert_array_equal(
        load_of_what_moves(SimpleNamespace(structure=None), record), [5003.0, 4.0, 0.0]
    )
    nothing = SimpleNamespace(load=np.zeros((0, 6)))
    np.testing.assert_array_equal(load_of_what_moves(house, nothing), np.zeros(3))


@pytest.mark.parametrize(("force", "arrived"), [(0.9, False), (1.1, True)])
def test_water_has_arrived_once_it_pushes_a_thousandth_of_the_weight_of_what_can_move(force, arrived):
    """A held quay of a hundred times that weight has no part in it; nor has water that wets no block."""
    weight = ARRIVED * 500.0 * G
    structure = SimpleNamespace(
        mass=np.array([500.0, 5e4]), fixed=np.array([False, True]), gravity=np.array([0.0, 0.0, -G])
    )
    record = SimpleNamespace(
        load=np.array([[force * weight, 0, 0, 0, 0, 0], [1e6, 0, 0, 0, 0, 0]]), wetted=True
    )
    coupling = SimpleNamespace(structure=structure)
    assert _has_arrived(coupling, record) == arrived
    record.wetted = False
    assert not _has_arrived(coupling, record)
