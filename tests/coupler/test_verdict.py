"""The verdict of a run: how blocks are divided, what is watched while it goes, and in which words it is reported."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from coupler.case.case import Case
from coupler.checks.case import problems
from coupler.commands.report.stands import stands
from coupler.results.history import read_history
from coupler.run.summary import read_summary
from coupler.verdict.attitude import tilt_of
from coupler.verdict.damage import Rules, state_of
from coupler.verdict.divisions import Divisions, in_words, member, storey
from coupler.verdict.judge import _largest, places_of, verdict
from coupler.verdict.rocking import rocking
from coupler.verdict.watch import Peaks
from coupler.verdict.words import _loads, _of_bodies, sentences, unreached
from tests.coupler.resumed import DRY, begin
from tests.coupler.test_docs import FIGURES
from tests.coupler.verdict_scene import record, verdict_scene
from yade_scripts.blocks.block import Block


def test_the_name_of_a_block_says_wall_and_storey():
    assert member("house-wall1x--3-0-1", "house") == "house-wall1x-"
    assert member("pier-12", "pier") == "pier"
    assert storey("house-wall1x-", "house") == storey("house-roof1", "house") == "house-storey1"
    assert storey("pier", "pier") is None
    assert in_words("house-wall1x-", {"house"}) == "wall x- of storey 2"
    assert in_words("house-roof1", {"house", "hut"}) == "roof of storey 2 (house)"
    assert in_words("house-storey0", {"house"}) == "the ground storey"


def test_names_of_tables_are_no_walls_blocks_or_storeys():
    """Walls that are called as those of a house, or as its blocks, stay what the case calls them."""

    def part(kind, name, *blocks, group=None):
        made = tuple(SimpleNamespace(name=block, group=group or name) for block in blocks)
        return SimpleNamespace(path=("structure", kind, 0), name=name, blocks=made)

    parts = [
        part("wall", "east-wall2", "east-wall2-0-0-0", "east-wall2-1-0-0"),
        part("wall", "pier-4", "pier-4-0-0-0"),
        part("building", "east", "east-wall2x--0-0-0", "east-roof2-0-0-0", group="wall"),
        part("building", "east-annex", "east-annex-wall0y+-0-0-0", group="wall"),
        part("block", "quay-pier3", "quay-pier3"),
    ]
    found = Divisions.of(parts, 7)
    assert found.bodies.names == ("east-wall2", "pier-4", "east", "east-annex", "quay-pier3")
    walls = ("east-wall2x-", "east-roof2", "east-annex-wall0y+")
    assert found.members.names == ("east-wall2", "pier-4", *walls, "quay-pier3")
    assert found.storeys.names == ("east-storey2", "east-annex-storey0")
    assert [found.members_of(k) for k in range(4)] == [("east-wall2",), ("pier-4",), walls[:2], walls[2:]]
    reported = [in_words(name, found.bodies.names) for name in found.members.names]
    assert reported == [
        "east-wall2", "pier-4", "wall x- of storey 3 (east)", "roof of storey 3 (east)",
        "wall y+ of the ground storey (east-annex)", "quay-pier3",
    ]  # fmt: skip


@pytest.fixture
def scene():
    return verdict_scene()


def test_nothing_happened(scene):
    s, watch, coupling = scene
    watch.step(coupling, record(0.1))
    reported = verdict(s, watch)
    assert (reported["state"], reported["first_break"], reported["displaced"]["blocks"]) == (
        "stands",
        None,
        0,
    )
    assert reported["largest"]["force"] is None
    assert "no joint of 2 broke" in list(sentences(reported))
    assert "until the run ended at t = 0.1 s" in unreached(reported, 0.1)


def test_a_town_is_told_house_by_house():
    """All houses together are damaged at most while most of them stand, so the second line says which collapsed."""
    states = {"H1": "stands", "H2": "collapsed", "H3": "damaged", "H4": "collapsed", "H5": "stands"}
    bodies = [{"name": name, "state": state, "joints": 9} for name, state in states.items()]
    crate = {"name": "crate", "state": "collapsed", "joints": 0}
    (line,) = _of_bodies([*bodies, crate])
    assert line == "of 5 bodies with joints 2 collapsed (H2, H4), 1 is damaged (H3), 2 stand"
    assert list(_of_bodies([bodies[1], crate])) == []
    (line,) = _of_bodies([{"name": f"H{i}", "state": "damaged", "joints": 1} for i in range(11)])
    assert line.endswith("H6, H7 and 3 more)")


def test_blocks_without_joints_are_not_said_to_keep_them():
    rules = {joined: state_of(0.0, 0.0, (0, 0), Rules(), joined=joined)[1] for joined in (True, False)}
    assert "joint" in rules[True]
    assert rules[False] == "no block left its place"


def test_a_base_that_gapes_is_said_to_hold_by_a_part_of_its_face(scene):
    s, watch, coupling = scene
    s.torn[0] = 5.0 / 18.0
    watch.step(coupling, record(0.1))
    reported = verdict(s, watch)
    assert (reported["state"], reported["joints_torn"]) == ("damaged", 1)
    said = list(sentences(reported))
    assert said[0] == "DAMAGED: 14% of its joined area is torn, though no joint broke"
    assert "no joint of 2 broke, one is torn: it holds by a part of its face" in said
    s.broke[1] = 0.2
    watch.step(coupling, record(0.2))
    assert any("1 more holds by a part of its face" in line for line in sentences(verdict(s, watch)))


def test_the_largest_load_stays_with_its_time_and_the_moment_is_about_the_foot(scene):
    """100 kN at half the height of the upper block: 1.5 m above the foot, so 150 kN m. Half of it with an uplift of
    90 kN is the larger force, and the smaller horizontal one."""
    s, watch, coupling = scene
    push, lift = np.zeros((3, 3)), np.zeros((3, 3))
    push[1, 0] = 1e5
    lift[1, 2] = 9e4
    watch.step(coupling, record(0.5, load=push))
    watch.step(coupling, record(0.6, load=0.5 * push + lift))
    largest = verdict(s, watch)["largest"]
    assert (largest["force"]["value"], largest["force"]["time"]) == pytest.approx((np.hypot(5e4, 9e4), 0.6))
    assert (largest["horizontal"]["value"], largest["horizontal"]["time"]) == pytest.approx((1e5, 0.5))
    assert largest["moment"]["value"] == pytest.approx(1.5e5)
    assert largest["moment"]["about"] == pytest.approx([5.0, 0.0, 0.0])
    assert watch.pressure.value[1] == pytest.approx(1e5)  # over a face of 1 m2
    assert watch.impulse[0] == pytest.approx([1.5e3, 0.0, 900.0])  # 10 ms of the whole and of half
    for name in FIGURES:
        found = {"verdict": verdict(s, watch)}
        for part in name.split("."):
            found = found[part]
        assert isinstance(found, float | int), name


def test_the_way_of_a_block_that_is_carried_off_is_no_overturning_moment(scene):
    """1 kN of buoyancy on the crate 3 m off, and no moment about its own centre: nothing overturns it. About the fixed
    middle of its foot that buoyancy had 3 kN m."""
    s, watch, coupling = scene
    lift = np.zeros((3, 3))
    lift[2, 2] = 1e3
    for way in (0.0, 3.0):
        s.x[2, 0] += way
        watch.step(coupling, record(0.5 + way, load=lift))
        assert watch.moment.value[list(watch.divisions.bodies.names).index("crate")] == pytest.approx(0.0)


def test_displaced_blocks_are_listed_from_the_farthest_on(scene):
    s, watch, coupling = scene
    s.x = s.x + np.array([[0.2, 0, 0], [0.5, 0, 0], [0, 0, 0]])
    watch.step(coupling, record(0.4))
    reported = verdict(s, watch)["displaced"]["list"]
    assert [found["block"] for found in reported] == ["wall-1", "wall-0"]


def test_a_block_that_comes_back_has_left_its_place_and_is_no_collapse(scene):
    """Half of the weight that is judged."""
    s, watch, coupling = scene
    s.x = s.x + np.array([[0, 0, 0], [0.3, 0, 0], [0, 0, 0]])
    watch.step(coupling, record(0.4))
    assert verdict(s, watch)["state"] == "collapsed"
    s.x = s.x - np.array([[0, 0, 0], [0.3, 0, 0], [0, 0, 0]])
    watch.step(coupling, record(0.5))
    reported = verdict(s, watch)
    (gone,) = reported["displaced"]["list"]
    assert gone == {
        "block": "wall-1", "way": pytest.approx(0.3), "left_at": 0.4, "shift": pytest.approx([0, 0, 0]), "tilt": 0.0
    }  # fmt: skip
    assert (reported["state"], reported["weight_moved"], reported["weight_out"]) == ("damaged", 0.5, 0.0)
    assert reported["rule"] == "1 block left its place, of which none stayed out of it"
    assert "1 of these is back in place" in list(sentences(reported))


def tilted(s, angle, rows=(0, 1), toe=(5.2, 0.0, 0.0), slid=0.0):
    """Turn these blocks about a toe by an angle [rad] towards +x, and let them slide."""
    c, d = np.cos(angle), np.sin(angle)
    turn = np.array([[c, 0, d], [0, 1, 0], [-d, 0, c]])
    s.x, s.turn = s.x.copy(), s.turn.copy()
    for i in rows:
        s.x[i] = toe + turn @ (s.blocks[i].centre - toe) + [slid, 0, 0]
        s.turn[i] = turn


def test_what_slid_leans_or_has_overturned_is_told_apart(scene):
    """The wall lies on its face at 90 degrees, 0.8 m lower; the crate that slid on the level is turned about the
    vertical, which is no tilt."""
    s, watch, coupling = scene
    s.broke[:] = 0.3
    tilted(s, np.pi / 2, rows=(1,))
    tilted(s, np.pi / 6, rows=(0,))
    watch.step(coupling, record(0.4))
    reported = verdict(s, watch)
    found = reported["displaced"]
    assert (found["upright"], found["leaning"], found["overturned"]) == (0, 1, 1)
    fallen = found["list"][0]
    assert (fallen["block"], fallen["tilt"]) == ("wall-1", pytest.approx(np.pi / 2))
    assert fallen["shift"] == pytest.approx([1.7, 0.0, -1.3])
    said = list(sentences(reported))
    assert "at the end, of these: 1 leaning (by up to 45), 1 overturned (by more than 45)" in said
    assert any("(at the end 1.7 m sideways, 1.3 m down, tilted by 90 degrees)" in line for line in said)


def test_a_turn_about_the_vertical_is_no_tilt_and_a_block_may_begin_askew(scene):
    s = scene[0]
    askew = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])
    s.blocks[0] = Block("askew", s.blocks[0].centre, size=np.ones(3), density=1000.0, rotation=askew)
    c, d = np.cos(0.7), np.sin(0.7)
    about_z = np.array([[c, -d, 0], [d, c, 0], [0, 0, 1.0]])
    s.turn = np.array([about_z @ askew, about_z, np.eye(3)])
    assert tilt_of(s) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("angle", "slid", "state"),
    [(0.09, 0.0, "damaged"), (0.19, 0.0, "damaged"), (0.21, 0.0, "collapsed"), (0.09, 0.1, "collapsed")],
)
def test_a_wall_that_rocks_has_not_collapsed_before_its_weight_passes_the_toe(scene, angle, slid, state):
    """The wall is 2 m high and 0.4 m thick: its centre of mass is above the toe at atan(0.2) = 0.197. One that has slid
    by a quarter of its thickness has left its place, however it leans."""
    s, watch, coupling = scene
    s.broke[0] = 0.3  # it stands on the ground
    tilted(s, angle, slid=slid)
    watch.step(coupling, record(0.4))
    reported = verdict(s, watch)
    assert (reported["state"], reported["weight_moved"]) == (state, 1.0)
    rocks = 2 if state == "damaged" else 0
    assert reported["displaced"]["rocking"] == rocks
    assert any("rock at the end" in line for line in sentences(reported)) == (rocks > 0)


def test_a_block_that_falls_off_what_rocks_is_out_of_its_place(scene):
    """The upper block is no piece of the lower one any more: the corners of its own base have moved."""
    s, watch, coupling = scene
    s.broke[:] = 0.3
    tilted(s, 0.1)
    watch.step(coupling, record(0.4))
    reported = verdict(s, watch)
    assert (reported["state"], reported["weight_out"], reported["displaced"]["rocking"]) == (
        "collapsed",
        0.5,
        1,
    )


def test_a_block_that_is_driven_does_not_rock(scene):
    """Its motion takes it, wherever its weight turns."""
    s, watch, coupling = scene
    s.fixed[2] = True
    tilted(s, 0.3, rows=(2,), toe=(3.5, 0.0, 0.0))
    watch.step(coupling, record(0.4))
    found = verdict(s, watch)["displaced"]
    assert found == dict.fromkeys(found, 0) | {"first": None, "list": []}


def test_blocks_on_a_held_one_rock_each_by_itself(scene):
    """Crate and upper block are joined to the lower one, which is held: that one falls does not keep the other, whose
    centre is before its toe, from coming back."""
    s, table = scene[0], scene[0].joint_table()
    table.a, table.b = np.array([2, 1]), np.array([0, 0])
    s.joint_table = lambda: table
    s.fixed[0] = True
    tilted(s, 0.3, rows=(2,), toe=(3.5, 0.0, 0.0))
    s.x = s.x - np.array([[0, 0, 0], [0, 0, 0.5], [0, 0, 0]])
    assert rocking(s, np.array([False, True, True]), np.full(3, 0.1)).tolist() == [False, False, True]


def test_a_block_that_lost_a_support_does_not_rock(scene):
    """One edge of its base is in its place and ahead of its centre, which has fallen."""
    s, watch, coupling = scene
    s.broke[:] = 0.3
    tilted(s, -0.2, rows=(1,), toe=(5.2, 0.0, 1.0))
    s.x[1, 2] = 2.9 - s.x[1, 2]
    watch.step(coupling, record(0.4))
    assert verdict(s, watch)["displaced"]["rocking"] == 0


def test_a_wall_whose_foot_was_pushed_from_under_it_does_not_rock(scene):
    """It turned about an edge half way up, where its two blocks are joined: that edge is in its place, and the centre,
    which has risen, before it, but nothing stands there that bears the weight. Its foot is 0.2 m off."""
    s, watch, coupling = scene
    s.broke[0] = 0.3
    tilted(s, 0.2, toe=(5.2, 0.0, 1.0))
    watch.step(coupling, record(0.4))
    assert s.x[:2, 2].mean() > 1.0
    assert s.x[:2, 0].mean() < 5.2
    assert verdict(s, watch)["displaced"]["rocking"] == 0


def test_pressure_counts_only_while_a_block_is_in_its_place(scene):
    s, watch, coupling = scene
    push = np.zeros((3, 3))
    push[1, 0] = 1e5
    s.x = s.x + np.array([[0, 0, 0], [0.3, 0, 0], [0, 0, 0]])
    watch.step(coupling, record(0.4, load=push))
    assert watch.pressure.value[1] == 0.0


def test_a_run_reports_the_judged_body_with_the_largest_force(scene):
    _, watch, coupling = scene
    push = np.array([[30.0, 0, 0], [0, 40.0, 0], [900.0, 0, 0]])  # the crate is not judged
    watch.step(coupling, record(0.1, load=push))
    assert watch.strongest() == ("wall", pytest.approx(50.0))


def test_the_order_of_failure_goes_by_the_first_break(scene):
    s, watch, _ = scene
    s.broke[:] = (0.9, 0.4)
    reported = verdict(s, watch)
    assert reported["first_break"]["blocks"] == ["wall-1", "wall-0"]
    assert reported["first_break"]["place"] == pytest.approx([5.0, 0.0, 1.0])
    assert reported["order"] == ["wall"]


def test_a_joint_is_placed_at_the_middle_of_its_corners_at_the_start():
    """A triangle and a square, which have moved since."""

    class Moved:
        def joint_polygons(self, at_start=False):
            assert at_start
            triangle = [[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 6.0]]
            square = [[1.0, 1.0, 5.0], [3.0, 1.0, 5.0], [3.0, 3.0, 5.0], [1.0, 3.0, 5.0]]
            return np.array(triangle + square), np.array([0, 3, 7])

    assert places_of(Moved()).tolist() == [[1.0, 1.0, 2.0], [2.0, 2.0, 5.0]]
    none = SimpleNamespace(joint_polygons=lambda at_start: (np.zeros((0, 3)), np.zeros(1, int)))
    assert places_of(none).shape == (0, 3)


def test_depth_and_moment_are_those_of_a_body_that_is_judged():
    """Three bodies, the first and the second of them judged, and a wall of no body; forces of all that is judged come
    last. The deepest water, beside the third body, does not count, nor does that beside the first, which is shallower
    than that beside the second. The moment is the larger of the two, although the force on that body is the smaller
    one: a low wall that takes much is not turned over like a tall one that takes less. In a town of five houses that
    about the middle of them all was 365 kN m, and the largest of a house 14."""
    peaks = Peaks(np.array([0.4, 0.9, 1.5]), np.array([1.0, 2.0, 3.0]))
    watch = SimpleNamespace(
        divisions=SimpleNamespace(
            bodies=SimpleNamespace(label=np.array([0, 0, 1, -1, 2]), names=("A", "B", "C"))
        ),
        judged=np.array([True, True, True, True, False]),
        force=Peaks(np.array([2.0, 1.0, 3.0, 7.0]), np.array([0.1, 0.2, 0.3, 0.7])),
        push=Peaks(np.array([1.0, 2.0, 3.0, 6.0]), np.array([0.1, 0.2, 0.3, 0.6])),
        moment=Peaks(np.array([4.0, 5.0, 0.0, 8.0]), np.array([0.4, 0.5, np.nan, 0.8])),
        direction=np.arange(12.0).reshape(4, 3),
        foot=-np.arange(12.0).reshape(4, 3),
        depth=peaks,
        depth_at=np.arange(6.0).reshape(3, 2),
    )
    assert _largest(watch, 3, judged=True) == {
        "force": {"value": 7.0, "time": 0.7, "direction": [9.0, 10.0, 11.0]},
        "horizontal": {"value": 6.0, "time": 0.6},
        "moment": {"value": 5.0, "time": 0.5, "about": [-3.0, -4.0, -5.0], "of": "B"},
        "depth": {"value": 0.9, "time": 2.0, "place": [2.0, 3.0]},
    }
    assert "middle of the base of B 5 N m at 0.5 s" in next(_loads(_largest(watch, 3, judged=True)))
    watch.judged = np.array([True, True, False, True, False])  # of a single body all that is judged counts
    moment = _largest(watch, 3, judged=True)["moment"]
    assert moment == {"value": 8.0, "time": 0.8, "about": [-9.0, -10.0, -11.0]}
    assert _largest(watch, 2) == {
        "force": {"value": 3.0, "time": 0.3, "direction": [6.0, 7.0, 8.0]},
        "horizontal": {"value": 3.0, "time": 0.3},
        "moment": None,
        "depth": {"value": 1.5, "time": 3.0, "place": [4.0, 5.0]},
    }


def test_a_run_tells_that_a_shot_broke_a_column(tmp_path):
    """A block of 300 kg at 12 m/s on the upper half of a column of three drums: it breaks a joint at once, and what the
    column gave back is what the shot lost."""
    run = begin(tmp_path / "case", DRY, tmp_path / "run", "time.checkpoint_every=0")
    reported = read_summary(run)["figures"]["verdict"]
    assert reported["state"] == "damaged"
    assert 0.0 < reported["first_break"]["time"] < 0.1
    assert reported["joints"] == 3
    (hit,) = [hit for hit in reported["hits"]["list"] if hit["block"] == "shot"]
    assert hit["other"] == "column-1"
    assert hit["impulse"] == pytest.approx(300.0 * hit["speed"], rel=0.02)
    assert hit["speed"] > 10.0
    rows = read_history(run / "blocks.csv")
    assert list(rows["member"]) == ["shot", "column", "column", "column"]
    assert np.nanmin(rows["first_break"][1:]) == reported["first_break"]["time"]
    assert stands(read_summary(run), tmp_path)[0].startswith('<p class="verdict state-damaged">DAMAGED')


CASE = {
    "case": {"title": "a wall"},
    "time": {"end": 1.0},
    "structure": {"wall": [{"lower": [0, 0, 0], "size": [1, 0.2, 1], "block": [0.5, 0.2, 0.5]}]},
    "contact": {"stiffness": 1e6},
}


def test_what_is_driven_apart_neither_stands_nor_falls(tmp_path):
    """No block of it moves freely, so there is no verdict: the joint that broke is not called whole."""
    case = Path(__file__).parents[2] / "cases" / "joint_pulled"
    run = begin(tmp_path / "case", (case / "case.toml").read_text(encoding="utf-8"), tmp_path / "run")
    figures = read_summary(run)["figures"]
    assert figures["joints_broken"] == 1
    assert figures.get("verdict") is None


def test_a_name_that_nothing_has_is_refused():
    ((path, message),) = problems(Case.model_validate(CASE | {"verdict": {"on": ["wal"]}}))
    assert path == ("verdict", "on", 0)
    assert "wall" in message


def test_a_verdict_without_a_structure_is_refused():
    case = {name: value for name, value in CASE.items() if name not in ("structure", "contact")}
    case |= {
        "tank": {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell": 0.5},
        "water": {"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 0.5]}]},
        "verdict": {"moved": 0.5},
    }
    assert [path for path, _ in problems(Case.model_validate(case))] == [("verdict",)]
