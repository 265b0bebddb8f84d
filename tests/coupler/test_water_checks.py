"""What the checks of a case with water refuse or remark."""

import math

import meshio
import numpy as np
import pytest

from coupler.case.case import modules
from coupler.checks.case import problems
from coupler.checks.remarks import remarks
from coupler.geometry.tank_mesh import measured
from coupler.scene.build import build
from coupler.scene.side_energy import coming_energy
from fluid.mesh.background import box_mesh
from fluid.sides.waves import SolitaryWave, n_wave
from tests.coupler.water_cases import TANK, case, reported, run
from tests.fakes import no_clock


@pytest.mark.parametrize(
    ("water", "message"),
    [
        ({"walls": "no-slip"}, "water.walls: walls that hold the water need water.viscosity"),
        ({"walls": "friction"}, "friction needs water.roughness or water.manning"),
        ({"roughness": 0.01}, 'water.roughness: is for walls = "friction"'),
        ({"openings": "wide"}, "water.openings: 'wide' is for several sets of unknowns beside thin walls"),
        ({"cracks": "closed"}, "water.cracks: 'closed' is for joints that break"),
        ({"fill": []}, "no water: write at least one"),
        ({"sea": [{"side": "x+", "level": 1.5}]}, "z = 1.5 m is not between the floor"),
        (
            {"sea": [{"side": "x+", "level": 0.5}, {"side": "x+", "level": 0.4}]},
            "x+ is given to water.sea[0] already",
        ),
        (
            {"inflow": [{"kind": "bore", "side": "x-", "ahead": 0.6, "level": 0.5}]},
            "z = 0.6 m must lie above the floor",
        ),
        (
            {"inflow": [{"kind": "solitary", "side": "x-", "level": 0.2, "height": 0.2, "crest": 1.0}]},
            "breaks at once on a depth of 0.2 m",
        ),
        ({"inflow": [{"kind": "record", "side": "x-", "path": "/nowhere.csv"}]}, "no such file"),
        (
            {"inflow": [{"kind": "steady", "side": "x-", "level": 0.5, "velocity": 3.0}]},
            "water.inflow.0.velocity: 3 m/s strike still water 0.5 m deep: as a bore it would rise to z = 1.32 m",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_place(water, message):
    assert any(message in line for line in reported(water)), reported(water)


def test_a_tank_that_its_inflow_fills_is_refused():
    """0.2 m x 0.5 m x 1 m/s bring 0.1 m3 in a second, there is room for 0.2 m3. A side as a way out is
    enough; an open top lets out spray only, and a stream that takes back what returns does not fill a tank."""
    stream = {"kind": "steady", "side": "x-", "level": 0.5, "velocity": 1.0}
    closed = TANK | {"open": []}

    def filled(end, tank, **more):
        found = problems(case({"inflow": [stream], **more}, tank=tank, time={"end": end}))
        return [text for path, text in found if path == ("water", "inflow", 0)]

    assert filled(1.9, closed) == []
    assert "brings 0.21 m3 until the end of the run (2.1 s)" in filled(2.1, closed)[0]
    assert filled(2.1, TANK) == []
    assert "room for 0.2 m3 and no way out but its open top" in filled(2.3, TANK)[0]
    assert filled(2.3, TANK | {"open": ["z+", "x+"]}) == []
    assert filled(2.3, TANK, inflow=[stream | {"absorbs": True}]) == []
    assert filled(2.1, closed, sea=[{"side": "x+", "level": 0.5}]) == []


def test_a_side_beside_the_way_lets_out_what_a_full_tank_presses_over_its_edge():
    """0.5 m x 2 m x 1 m/s across a tank whose open side or sea beside the way is 0.2 m wide: 0.2 m3 of room are full
    in 0.2 s but for what leaves, (2/3)^1.5 sqrt(g d³) 0.2 m of the depth d that the far side throws back."""
    stream = {"kind": "steady", "side": "y-", "level": 0.5, "velocity": 1.0}
    deep = 0.5 + 1.0 * math.sqrt(0.5 / 9.81)
    for _ in range(100):  # u = (d - h) sqrt(g (h + d) / (2 h d)) for the depth d
        deep = 0.5 + 1.0 / math.sqrt(0.5 * 9.81 * (0.5 + deep) / (0.5 * deep))
    out = (2.0 / 3.0) ** 1.5 * math.sqrt(9.81 * max(deep, TANK["upper"][2]) ** 3) * 0.2

    def filled(end, **more):
        tank = TANK | {"open": more.pop("open", [])}
        found = problems(case({"inflow": [stream], **more}, tank=tank, time={"end": end}))
        return [text for path, text in found if path == ("water", "inflow", 0)]

    full = 0.2 / (1.0 - out)
    for way in ({"open": ["x+"]}, {"sea": [{"side": "x+", "level": 0.5}]}):
        assert filled(0.98 * full, **way) == []
        assert f"no way out but x+ (x+ let out at most {out:.3g} m3/s)" in filled(1.02 * full, **way)[0]
    assert filled(1.02 * full, open=["y+"]) == []
    assert filled(1.02 * full, open=["x+", "z-"]) == []


def test_a_wave_that_lifts_its_tank_above_its_crest_is_refused():
    """A crest of 0.1 m on 0.5 m brings sqrt(16/3 0.5³ 0.1) 0.2 m3 in all; a tank of 1 m has room for 0.02 m3 up to the
    crest, one of 3 m for 0.06."""
    wave = {"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.1, "crest": 2.0}

    def found(length, end=5.0, **more):
        fill = [{"lower": [0, 0, 0], "upper": [length, 0.2, 0.5]}]
        tank = TANK | {"upper": [length, 0.2, 1]}
        with_fill = {"inflow": [wave | more], "fill": fill}
        return [text for _, text in problems(case(with_fill, tank=tank, time={"end": end}))]

    assert "room for 0.02 m3 under the crest (z = 0.6 m)" in found(1.0)[0]
    assert found(1.0, end=1.0) == []
    assert found(1.0, absorbs=True) == []
    assert found(3.0) == []
    (low,) = found(3.0, level=0.35)
    assert "the crest at z = 0.45 m, but the water of the tank stands above that" in low
    assert "(water.fill up to z = 0.5 m)" in low  # not: room for -0.03 m3


def test_a_wave_that_draws_its_tank_below_its_trough_is_refused():
    """A trough of 0.05 m on 0.5 m takes (3 sqrt(3)/4) H/γ = 0.0736 m2 in a slice; a wall throws a trough of 0.1 m back:
    a tank of 0.74 m has that water above it."""

    def found(length, end=8.0, **more):
        wave = {"kind": "n-wave", "side": "x-", "level": 0.5, "height": 0.05, "middle": 4.0}
        fill = [{"lower": [0, 0, 0], "upper": [length, 0.2, 0.5]}]
        tank = TANK | {"upper": [length, 0.2, 1]}
        with_fill = {"inflow": [wave | more], "fill": fill}
        return [text for _, text in problems(case(with_fill, tank=tank, time={"end": end}))]

    (drawn,) = found(0.7)
    assert "draws 0.0147 m3 out of the tank until the end of the run (8 s), which holds 0.0142 m3" in drawn
    assert "above the trough that the far side throws back (z = 0.399 m)" in drawn
    assert found(0.8) == []
    assert found(0.7, end=3.0) == []
    assert found(0.7, absorbs=True) == []


@pytest.mark.parametrize("fitted", [False, True])
def test_a_record_that_lifts_its_tank_above_what_a_wall_throws_back_is_refused(tmp_path, fitted):
    """0.2 m x 0.6 m x 0.5 m/s bring 0.06 m3 in a second. Thrown back by a wall that stands 0.73 m deep, and there is
    room for 0.0918 m3 below; also in a mesh from a file. An open side opposite lets all of it pass, one beside its way
    what runs over the edge, (2/3)^1.5 sqrt(g d³) a metre."""
    (tmp_path / "swell.csv").write_text("time,level,velocity\n0,0.6,0.5\n9,0.6,0.5\n")
    swell = {"kind": "record", "side": "x-", "path": str(tmp_path / "swell.csv")}
    tank = TANK
    if fitted:
        mesh, path = box_mesh(np.zeros(3), [2, 0.2, 1], 0.1), tmp_path / "tank.vtk"
        meshio.write(path, meshio.Mesh(mesh.nodes, [("tetra", mesh.cells)]))
        tank = {"mesh": str(path)}

    def found(end, sides=("z+",)):
        read, wrong = measured(
            case({"inflow": [swell]}, tank=tank | {"open": list(sides)}, time={"end": end})
        )
        assert wrong == []
        return [text for path, text in problems(read) if path == ("water", "inflow", 0)]

    assert found(1.4) == []
    assert "brings 0.096 m3" in found(1.6)[0]
    assert "under what the far side throws back (z = 0.73 m)" in found(1.6)[0]
    assert found(3.0, ["z+", "x+"]) == []
    assert found(3.0, ["z+", "y+"]) == []


def test_a_wave_whose_still_water_runs_out_is_refused():
    """0.5 m of water leave a tank 1 m long by its open end at 8/27 sqrt(g d³): an eighth of a metre is left when
    4/27 sqrt(g 0.5 m) t = 1 m, at 3.05 s. The crest is far away and brings nothing."""
    wave = {"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.1, "crest": 50.0}
    fill = [{"lower": [0, 0, 0], "upper": [1, 0.2, 0.5]}]

    def found(end, sides=("z+", "x+"), **more):
        tank = TANK | {"upper": [1, 0.2, 1], "open": list(sides)}
        read = case({"inflow": [wave], "fill": fill} | more, tank=tank, time={"end": end})
        return [text for path, text in problems(read) if path == ("water", "inflow", 0)]

    assert found(3.0) == []
    assert "runs out by x+ (tank.open): about 0.119 m are left" in found(3.2)[0]
    assert "end before 3 s" in found(3.2)[0]
    assert "runs out by x+ and y+" in found(3.0, ["z+", "x+", "y+"])[0]
    assert found(9.0, ["z+"]) == []
    assert found(9.0, inflow=[wave | {"absorbs": True}]) == []
    assert found(9.0, inflow=[{"kind": "steady", "side": "x-", "level": 0.5, "velocity": 1.0}]) == []
    assert found(9.0, ["z+", "y+"], sea=[{"side": "x+", "level": 0.5}]) == []


def test_an_n_wave_whose_trough_comes_when_the_water_has_run_out_is_refused():
    """Its crest keeps the tank at half of its depth until 2 s, and its trough leaves less than a quarter at 2.7 s; as
    long as what the crest brought counted as there until the end, two fifths were left."""
    wave = {
        "kind": "n-wave",
        "side": "x-",
        "level": 0.5,
        "height": 0.1,
        "middle": 2.0,
        "leading": "elevation",
    }
    fill = [{"lower": [0, 0, 0], "upper": [1, 0.2, 0.5]}]
    tank = TANK | {"upper": [1, 0.2, 1], "open": ["z+", "x+"]}

    def found(end):
        read = case({"inflow": [wave], "fill": fill}, tank=tank, time={"end": end})
        return [text for path, text in problems(read) if path == ("water", "inflow", 0)]

    assert found(2.2) == []
    assert "runs out by x+ (tank.open)" in found(4.0)[0]


def test_a_side_that_absorbs_is_three_cells_from_the_one_opposite_and_a_sea_before_dry_cells():
    def found(width, absorbs=True, filled=0.5):
        sea = {"side": "y-", "level": 0.5, "absorbs": absorbs}
        tank = TANK | {"upper": [1, width, 1], "cell": 0.1}
        fills = [
            {"lower": [0, 0, 0], "upper": [filled, width, 0.5]},
            {"lower": [0, 0, 0], "upper": [1, width, 0.3]},
        ]
        read = case({"sea": [sea], "fill": fills}, tank=tank)
        return [text for path, text in problems(read) if path[:3] == ("water", "sea", 0)]

    assert found(0.3) == []
    assert "the side opposite to y- is only 2 cells away" in found(0.2)[0]
    assert "the water of a sea would reach it at once" in found(0.2, absorbs=False)[0]
    assert found(0.2, absorbs=False, filled=1.0) == []
    assert found(0.3, absorbs=False) == []


def test_a_bore_may_run_until_its_reflection_is_back():
    """0.6 m behind a bore into 0.5 m: water of 0.42 m/s, 0.25 m2/s. A wall throws back 0.71 m; a tank of 1 m that
    is 0.2 m wide has room for 0.042 m3 up to there."""
    bore = {"kind": "bore", "side": "x-", "level": 0.6, "ahead": 0.5}

    def found(end, top=1.0, **more):
        fill = [{"lower": [0, 0, 0], "upper": [1.0, 0.2, 0.5]}]
        in_tank = case(
            {"inflow": [bore | more], "fill": fill}, tank=TANK | {"upper": [1, 0.2, top]}, time={"end": end}
        )
        return [text for _, text in problems(in_tank)]

    assert found(0.75) == []
    assert "m3 under what the far side throws back (z = 0.709" in found(0.95)[0]
    assert found(0.95, absorbs=True) == []
    # 0.03 m3 up to a lid at 0.65 m
    assert any("room for 0.03 m3 under what the far side" in text for text in found(0.7, 0.65))
    assert not any("far side" in text for text in found(0.5, 0.65))


def test_what_a_record_takes_back_leaves_room(tmp_path):
    """To and fro: 0.2 m x 0.5 m x 2/pi x 1 m/s, 0.0637 m3, come in within a second and leave in the next."""
    rows = [f"{t:.2f},0.5,{np.sin(np.pi * t):.6f}" for t in np.arange(0.0, 20.01, 0.05)]
    (tmp_path / "swell.csv").write_text("\n".join(["time,level,velocity", *rows]), encoding="utf-8")
    swell = {"kind": "record", "side": "x-", "path": str(tmp_path / "swell.csv")}
    for end in (0.9, 20.0):
        assert problems(case({"inflow": [swell]}, time={"end": end})) == []
    small = TANK | {"upper": [0.5, 0.2, 1]}
    fill = {"fill": [{"lower": [0, 0, 0], "upper": [0.5, 0.2, 0.5]}]}
    assert problems(case({"inflow": [swell]} | fill, tank=small, time={"end": 0.4})) == []
    found = [text for _, text in problems(case({"inflow": [swell]} | fill, tank=small, time={"end": 20.0}))]
    assert any("brings 0.0635 m3 until the end" in text for text in found), found


def test_water_without_air_above_it_may_not_leave():
    """Full to its closed top with an open side: what leaves leaves a hole. An open top, or some air, and it may."""
    whole = {"fill": [{"lower": [0, 0, 0], "upper": [2, 0.2, 1]}]}
    for sides, wrong in ((["x+"], True), (["x+", "z+"], False), ([], False)):
        found = problems(case(whole, tank=TANK | {"open": sides}))
        assert [path for path, text in found if "no air is there" in text] == [("water", "fill", 0)] * wrong
    below = {"fill": [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.9]}]}
    assert problems(case(below, tank=TANK | {"open": ["x+"]})) == []


def test_water_up_to_the_brim_sinks_as_it_leaves():
    """A tank full to its open top, open on one side too: without a surface up there nothing could give way, and the
    water in the tank stayed while 2 % of it had left by 0.09 s, 45 % by 0.4 s. What fell is what energy there is."""
    tank = {"lower": [0, 0, 0], "upper": [1, 0.4, 1], "cell": 0.2, "open": ["x+", "z+"]}
    fill = {"fill": [{"lower": [0, 0, 0], "upper": [1, 0.4, 1]}]}
    coupling, record, _ = run(case(fill, tank=tank), 0.4)
    assert coupling.water.volume() < 0.27
    assert abs(coupling.water.volume_error()) < 1e-4
    assert record.balance.energy_error < 0.01
    still, _, _ = run(case(fill, tank=tank | {"open": ["z+"]}), 0.4)
    assert np.abs(still.water.velocity).max() < 1e-9
    assert still.water.volume() == pytest.approx(0.4, rel=1e-9)


def test_a_drop_that_the_cells_cannot_hold_is_refused():
    """With air on both sides and under two and a half cells; a layer on the floor and a slice between walls are not."""
    for low, high, wrong in (
        ([0.5, 0, 0.5], [1.0, 0.2, 0.74], True),
        ([0.5, 0, 0.5], [1.0, 0.2, 0.76], False),
        ([0, 0, 0], [2, 0.2, 0.11], False),
        ([0.5, 0, 0], [0.6, 0.2, 0.5], True),
        (
            [1.0, 0, 0.7],
            [0.5, 0.2, 0.5],
            False,
        ),  # corners in the wrong order: refused, but not as a thin drop
    ):
        found = problems(case({"fill": [{"lower": low, "upper": high}]}))
        assert [path for path, text in found if "with air on both sides" in text] == [
            ("water", "fill", 0)
        ] * wrong


@pytest.mark.parametrize(
    ("fill", "thin"),
    [
        ([[0, 0, 0], [2, 0.2, 0.29]], "water.fill[0] is 0.29 m thin, 2.9 cells"),
        ([[0, 0, 0], [0.15, 0.2, 0.6]], "water.fill[0] is 0.15 m thin, 1.5 cells"),
        ([[0.5, 0, 0.5], [1.0, 0.2, 0.69]], "water.fill[0] is 0.19 m thin, 1.9 cells"),
        ([[0, 0, 0], [2, 0.2, 0.3]], None),
        ([[0, 0, 0], [0.5, 0.2, 0.5]], None),
    ],
)
def test_water_that_the_mesh_does_not_resolve_is_remarked(fill, thin):
    """From wall to wall any width is a slice, here of two cells and of one."""
    low, high = fill
    for width in (0.2, 0.1):
        found = remarks(
            case(
                {"fill": [{"lower": low, "upper": [high[0], width, high[2]]}]},
                tank=TANK | {"upper": [2, width, 1]},
            )
        )
        assert [thin is not None and text.startswith(thin) for text in found] == [True] * (thin is not None)


def test_a_layer_on_other_water_is_not_thin():
    boxes = [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.3]}, {"lower": [0, 0, 0.3], "upper": [0.5, 0.2, 0.4]}]
    assert remarks(case({"fill": boxes})) == []
    assert "water at water.sea[0] is 0.1 m thin" in remarks(case({"sea": [{"side": "x+", "level": 0.1}]}))[0]


def test_keys_are_refused_only_where_nothing_reads_them():
    assert reported({"openings": "wide", "covers": "multiple"}) == []
    assert reported({"openings": "all", "cracks": "open", "air": {"gamma": 1.4}}) == []


def in_parts(water, **tank):
    found, wrong = measured(case(water, tank=TANK | tank))
    assert wrong == []
    return found


HIGH_UP = {"lower": [1.2, 0, 0.6], "upper": [2, 0.2, 1.0], "levels": 2}


def test_water_is_measured_by_the_cells_that_it_is_in():
    """Finer cells elsewhere resolve neither a layer nor the water at a side; finer cells around it do."""
    layer = {"fill": [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.25]}]}
    assert "0.25 m thin, 2.5 cells" in remarks(in_parts(layer, refine=[HIGH_UP]))[0]
    cube = {"fill": [{"lower": [0, 0, 0], "upper": [0.25, 0.2, 0.25]}]}
    assert len([text for text in remarks(in_parts(cube, refine=[HIGH_UP])) if "thin" in text]) == 1
    flat = HIGH_UP | {"lower": [0, 0, 0], "upper": [2, 0.2, 0.3]}
    assert remarks(in_parts(layer, refine=[flat])) == []
    sea = {"sea": [{"side": "x+", "level": 0.1}]}
    (found,) = [text for text in remarks(in_parts(sea, refine=[HIGH_UP])) if "thin" in text]
    assert "water.sea[0] is 0.1 m thin, 1 cells" in found
    assert "take cells of 0.025 m there" in found
    assert not [text for text in remarks(in_parts(sea, refine=[flat])) if "thin" in text]


def test_a_drop_is_measured_by_the_cells_that_it_is_in():
    drop = {"fill": [{"lower": [0.5, 0, 0.5], "upper": [1.0, 0.2, 0.7]}]}
    around = {"lower": [0.3, 0, 0.3], "upper": [1.2, 0.2, 0.9]}
    for region, wrong in ((HIGH_UP, True), (around, False)):
        found = problems(in_parts(drop, refine=[region]))
        assert any("with air on both sides" in text for _, text in found) == wrong


def test_cells_between_opposite_sides_are_counted_beside_a_finer_part():
    sea = {"sea": [{"side": "y+", "level": 0.5, "absorbs": True}]}
    for region, wrong in ((HIGH_UP, True), (HIGH_UP | {"lower": [0, 0, 0]}, False)):
        found = problems(in_parts(sea, refine=[region]))
        assert any("side opposite to y+ is only 2 cells away" in text for _, text in found) == wrong


def test_the_split_of_a_case_is_that_of_its_mesh():
    """Mirrored bricks: nodes in which diagonals end hold three times the water of the others, away from the walls."""
    cube = {"lower": [0, 0, 0], "upper": [1, 1, 1], "cell": 0.25}
    most = {}
    for split in ("kuhn", "mirrored"):
        found = case({"fill": [{"lower": [0, 0, 0], "upper": [1, 1, 1]}]}, tank=cube | {"split": split})
        topology = build(found, no_clock).coupling.water.topology
        inner = np.all((topology.nodes > 0.01) & (topology.nodes < 0.99), axis=1)
        most[split] = topology.node_volume[inner].max() / topology.node_volume[inner].min()
    assert most == pytest.approx({"kuhn": 1.0, "mirrored": 3.0})


def test_a_wave_that_has_begun_before_the_start_is_remarked():
    """At the first step it would come in as a jump, and strike."""
    wave = {"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.05}
    early, late = (
        remarks(case({"inflow": [wave | {"crest": crest}]}, time={"end": 3.0})) for crest in (0.6, 2.0)
    )
    assert "59 % of its height" in early[0]
    assert late == []


def test_a_dry_start_is_allowed_where_water_comes_in():
    assert (
        reported({"fill": [], "inflow": [{"kind": "steady", "side": "x-", "level": 0.3, "velocity": 1.0}]})
        == []
    )


def test_energy_that_a_side_can_bring():
    """A sea 0.2 m above the water: ½ ρ g Δz² over its depth; a stream on a dry bed has its speed too."""
    sea = coming_energy(case({"sea": [{"side": "x+", "level": 0.7}]}))
    assert sea(0.0) == sea(0.3) == pytest.approx(0.5 * 1000 * 0.2 * 0.7 * 9.81 * 0.2**2)
    stream = {"kind": "steady", "side": "x-", "level": 0.3, "velocity": 1.0}
    both = coming_energy(case({"fill": [], "inflow": [stream]}))
    assert both(0.0) == pytest.approx(0.5 * 1000 * 0.2 * 0.3 * (9.81 * 0.3**2 + 0.3))


def test_energy_that_a_tide_can_bring_is_that_of_the_time_that_a_wave_takes_through_the_tank():
    """What has entered by then has had the level of the sea until then; the tide rises from 0.5 m to 0.7 m in 20 s."""
    tide = {"amplitude": 0.1, "period": 40.0, "high": 20.0}
    made = case({"sea": [{"side": "x+", "level": 0.6, "tide": tide}]})
    crossing = (made.tank.upper[0] - made.tank.lower[0]) / np.sqrt(9.81 * 1.0)
    level = 0.6 - 0.1 * np.cos(np.pi * (5.0 + crossing) / 20.0)
    expected = 0.5 * 1000 * 0.2 * level * 9.81 * (level - 0.5) ** 2
    assert coming_energy(made)(5.0) == pytest.approx(expected)


def test_energy_that_a_solitary_wave_can_bring_has_the_speed_of_its_surface():
    """Under a crest the water is faster at the surface than at the bed, from the second order on."""
    wave = {"kind": "solitary", "side": "x-", "level": 0.4, "height": 0.2, "crest": 2.0}
    crest = SolitaryWave(0.4, 0.2, 9.81, 2.0)
    bed, top = crest.speed_at(np.array([0.0, 0.6]), 2.0)
    assert top > 1.05 * bed
    expected = 0.5 * 1000 * 0.2 * 0.6 * (9.81 * 0.6**2 + 0.6 * top**2)
    assert coming_energy(case({"fill": [], "inflow": [wave]}))(0.0) == pytest.approx(expected)


def test_a_wave_without_its_still_water_is_remarked():
    bore = {"kind": "bore", "side": "x-", "ahead": 0.4, "level": 0.8}
    assert "bore at x- runs into still water up to z = 0.4 m" in remarks(case({"inflow": [bore]}))[0]
    assert remarks(case({"inflow": [bore | {"ahead": 0.5}]})) == []


def test_modules_tell_what_is_on():
    on = modules(case({"viscosity": "1 mPa s", "sea": [{"side": "x+", "level": 0.5}]}))
    assert (on["viscosity"], on["wall friction"], on["inflow"]) == (True, False, True)


def test_a_record_that_rises_above_the_tank_is_refused(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time,level,velocity\n0,0.1,0\n1,50,0\n", encoding="utf-8")
    inflow = {"kind": "record", "side": "x-", "path": str(path)}
    assert any("above the top of the tank" in line for line in reported({"inflow": [inflow]}))


@pytest.mark.parametrize("kind", [{"kind": "solitary", "crest": 2}, {"kind": "n-wave", "middle": 2}])
def test_a_wave_higher_than_the_sides_is_refused(kind):
    """Still water of 0.8 m in a tank of 1 m; half of the depth does not break, but runs over."""
    wave = {"side": "x-", "level": 0.8, "height": 0.4, **kind}
    found = reported({"fill": [], "inflow": [wave]})
    assert any("its crest reaches z = 1.2 m, above the top of the tank (1 m)" in line for line in found), (
        found
    )
    assert not reported({"fill": [], "inflow": [wave | {"height": 0.15}]})


@pytest.mark.parametrize(
    "solid",
    [
        {},
        {"centre": [1, 0.1, 0.2]},
        {"centre": [1, 0.1, 0.2], "size": [0.2, 0.2, 0.2], "vertices": [[0, 0, 0]]},
        {"vertices": [[1, 0, 0], [1.2, 0, 0], [1, 0.1, 0]]},
        {"path": "/nowhere.stl"},
    ],
)
def test_solids_that_are_none_are_refused(solid):
    assert any(line.startswith("solid.0") for line in reported(solid=[solid]))


@pytest.mark.parametrize(
    ("more", "tank", "where"),
    [
        ({}, {"open": ["x+"]}, "open at x+"),
        ({"sea": [{"side": "x+", "level": 0.7}]}, {}, r"beside a sea at z = 0.7 m (x+)"),
        ({"sea": [{"side": "x+", "level": 0.7}]}, {"open": ["z+"]}, None),
        ({"sea": [{"side": "x+", "level": 1.0}]}, {}, None),
    ],
)
def test_water_up_to_a_closed_top_has_no_way_out(more, tank, where):
    """It would hang under the top: a sea below it drew it out against nothing, and gained a fifth of the energy."""
    found = case(
        {"fill": [{"lower": TANK["lower"], "upper": TANK["upper"]}]} | more, tank=TANK | {"open": []} | tank
    )
    told = [text for _, text in problems(found) if "no air is there" in text]
    assert (where is None and told == []) or (len(told) == 1 and f"which is {where} and closed" in told[0])


def test_a_sea_whose_tide_cannot_be_read_beside_a_full_tank_is_refused_for_its_tide():
    """Other checks ask for its level only where it has one."""
    full = [{"lower": TANK["lower"], "upper": TANK["upper"]}]
    sea = [{"side": "x+", "level": 0.7, "tide": {"path": "nowhere.csv"}}]
    found = problems(case({"fill": full, "sea": sea}, tank=TANK | {"open": []}))
    assert [path for path, _ in found] == [("water", "sea", 0, "tide", "path")]


@pytest.mark.parametrize(
    ("inflow", "said"),
    [
        ({"absorbs": True}, "absorbs = true takes a part of the discharge back"),
        ({"velocity": 0.0}, "velocity is 0 m/s: take a positive velocity"),
        ({"velocity": -0.5}, "velocity is -0.5 m/s"),
    ],
)
def test_an_inflow_that_keeps_its_discharge_brings_all_of_it(inflow, said):
    spec = {"kind": "steady", "side": "x-", "level": 0.4, "velocity": 0.2, "keeps": "discharge", **inflow}
    found = problems(case({"inflow": [spec]}, tank=TANK | {"open": ["x+"]}))
    assert [path for path, _ in found] == [("water", "inflow", 0, "keeps")]
    assert said in found[0][1]


def test_a_steady_stream_into_a_sea_that_absorbs_is_told_to_raise_its_level():
    """Water 0.4 m deep at 0.2 m/s: a run stands at 0.4366 to 0.4376 m, by the invariants of long waves 0.4378 m."""

    def told(sea, velocity=0.2, **inflow):
        water = {
            "fill": [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.4]}],
            "inflow": [{"kind": "steady", "side": "x-", "level": 0.4, "velocity": velocity, **inflow}],
            "sea": [{"side": "x+", "level": 0.4, **sea}],
        }
        return [text for text in remarks(case(water)) if "stream" in text]

    (found,) = told({"absorbs": True})
    assert (
        "water.sea[0].absorbs = true: the level there rises by about 0.038 m above that of the sea" in found
    )
    assert 'keeps = "discharge"' in found
    (follows,) = told({"absorbs": True}, keeps="discharge")
    assert "rises by about 0.038 m" in follows
    assert "keeps =" not in follows
    assert told({"absorbs": False}) == told({"absorbs": True}, velocity=0.02) == []
    assert told({"absorbs": True}, velocity=-0.2) == told({"absorbs": True}, absorbs=True) == []
    assert told({"side": "y+", "absorbs": True}) == []


@pytest.mark.parametrize(
    ("wave", "key"),
    [
        ({"kind": "solitary", "height": 0.05, "theory": "goring"}, "crest"),
        ({"kind": "solitary", "height": 0.05, "theory": "grimshaw"}, "crest"),
        ({"kind": "n-wave", "height": 0.02}, "middle"),
    ],
    ids=["solitary", "of third order", "n-wave"],
)
def test_the_time_from_which_a_wave_is_not_under_way_at_the_start_is_said(wave, key):
    """A run that begins at that time has a twentieth of the wave at its side, by the formulas that drive it, and none
    of the remark; that of a third-order wave of a tenth of the depth is 0.06."""
    depth = 0.5
    fill = [{"lower": TANK["lower"], "upper": [*TANK["upper"][:2], depth]}]

    def said(time):
        inflow = [{"side": "x-", "level": depth, **wave, key: time}]
        return [
            text for text in remarks(measured(case({"fill": fill, "inflow": inflow}))[0]) if "strikes" in text
        ]

    (found,) = said(0.1)
    assert found.endswith("s or later, not at 0.1 s")
    time = float(found.split(f"let its {key} come at ")[1].split(" s or later")[0])
    assert said(time) == []
    assert len(said(0.98 * time)) == 1
    if key == "crest":
        order = {"goring": 1, "grimshaw": 3}[wave["theory"]]
        made = SolitaryWave(depth, wave["height"], 9.81, time, order)
        shares = [made.elevation(0.0) / wave["height"]]
    else:
        flow = n_wave((1.0, 0.0, 0.0), 0.0, depth, wave["height"], 9.81, time)
        shares = [abs(flow.level(t) - depth) / wave["height"] for t in (0.0, -0.1, -1.0)]
    assert max(shares) == pytest.approx(0.05, rel=0.2 if wave.get("theory") == "grimshaw" else 0.02)


def test_a_roughness_larger_than_the_cells_is_remarked_on():
    """In cells of 0.1 m: the log law holds over the stones of a bed, and not among them."""
    rough = {"walls": "friction", "roughness": 0.3}
    (said,) = [text for text in remarks(case(rough)) if "roughness" in text]
    assert (
        "water.roughness = 0.3 m is larger than the finest cells on walls, solids and blocks (0.1 m)" in said
    )
    assert not [text for text in remarks(case(rough | {"roughness": 0.01})) if "roughness" in text]


@pytest.mark.parametrize(
    ("finer", "more", "finest"),
    [
        ({"refine": [{"lower": [0.8, 0.05, 0.45], "upper": [1.2, 0.15, 0.55]}]}, {}, None),
        ({"refine": [{"lower": [0.8, 0.0, 0.0], "upper": [1.2, 0.2, 0.1]}]}, {}, "0.05 m"),
        ({"stretch": [{"along": "x", "lower": 0.0, "upper": 0.1, "cell": 0.0125}]}, {}, "0.05 m"),
        (
            {"refine": [{"around": ["post"], "margin": 0.05}]},
            {"solid": [{"name": "post", "centre": [1, 0.1, 0.6], "size": [0.1, 0.1, 0.1]}]},
            "0.05 m",
        ),
    ],
)
def test_a_roughness_is_compared_with_the_cells_that_have_walls(finer, more, finest):
    """Finer cells at the surface, in the middle of the water, feel no wall: only those of the bed, of sides that are
    neither open nor smooth, and of bodies count. A cell of 12.5 x 100 x 100 mm counts as a cube of 50 mm."""
    water = {"walls": "friction", "roughness": 0.08}
    made, _ = measured(case(water, tank=TANK | finer, **more))
    found = [text for text in remarks(made) if "is larger than the finest" in text]
    assert [finest in text for text in found] == ([] if finest is None else [True])
