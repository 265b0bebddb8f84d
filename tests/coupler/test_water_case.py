"""The water of a case: what is refused, what is built, and runs through sides whose books must balance."""

import meshio
import numpy as np
import pytest

from coupler.case.case import Case, modules
from coupler.case.inflow_records import RecordError, record_of
from coupler.case.water import RecordInflow
from coupler.checks.case import problems, remarks
from coupler.geometry.tank_mesh import measured
from coupler.run.forecast import forecast
from coupler.scene.build import build
from coupler.scene.build_water import sea_level
from coupler.scene.side_energy import coming_energy
from coupler.step.limits import Diverged, check_pressure
from fluid.mesh.background import box_mesh
from fluid.numerics import bounded
from fluid.numerics.solve import NotConverged
from fluid.sides.waves import record_along
from tests.fakes import no_clock

TANK = {"lower": [0, 0, 0], "upper": [2, 0.2, 1], "cell": 0.1, "smooth": ["y-", "y+"]}
FILL = [{"lower": [0, 0, 0], "upper": [2, 0.2, 0.5]}]


def case(water=None, **more):
    sections = {
        "case": {"title": "t"},
        "time": {"end": 1.0},
        "tank": TANK,
        "water": {"fill": FILL} | (water or {}),
    }
    return Case.model_validate(sections | more)


def reported(*args, **kwargs):
    return [f"{'.'.join(map(str, path))}: {text}" for path, text in problems(case(*args, **kwargs))]


def run(found, end):
    coupling, rows = build(found, no_clock), []
    while coupling.coupling.time < end - 1e-9:
        record = coupling.coupling.step(coupling.coupling.step_size(end - coupling.coupling.time))
        rows.append({k: v for g in coupling.gauges for k, v in g.read(coupling.coupling, record).items()})
    return coupling.coupling, record, rows


@pytest.mark.parametrize(
    ("water", "message"),
    [
        ({"walls": "no-slip"}, "water.walls: walls that hold the water need water.viscosity"),
        ({"walls": "friction"}, "friction needs water.roughness or water.manning"),
        ({"roughness": 0.01}, 'water.roughness: is for walls = "friction"'),
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


def test_a_side_that_absorbs_is_three_cells_from_the_one_opposite():
    def found(width, absorbs=True):
        sea = {"side": "y-", "level": 0.5, "absorbs": absorbs}
        tank = TANK | {"upper": [1, width, 1], "cell": 0.1}
        read = case({"sea": [sea], "fill": [{"lower": [0, 0, 0], "upper": [1, width, 0.5]}]}, tank=tank)
        return [text for path, text in problems(read) if path == ("water", "sea", 0, "absorbs")]

    assert found(0.3) == []
    assert found(0.2, absorbs=False) == []
    assert "the side opposite to y- is only 2 cells away" in found(0.2)[0]


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
    early, late = (remarks(case({"inflow": [wave | {"crest": crest}]})) for crest in (0.6, 2.0))
    assert "59 % of its height" in early[0]
    assert late == []


def test_a_dry_start_is_allowed_where_water_comes_in():
    assert (
        reported({"fill": [], "inflow": [{"kind": "steady", "side": "x-", "level": 0.3, "velocity": 1.0}]})
        == []
    )


@pytest.mark.parametrize(
    "side",
    [
        {"inflow": [{"kind": "steady", "side": "x-", "level": 0.3, "velocity": 1.0}]},
        {"sea": [{"side": "x+", "level": 0.4}]},
    ],
)
def test_a_dry_start_keeps_its_books_from_the_first_step(side):
    """A film of water beside the side, as it was, lost half of its volume and could not balance its energy; errors of
    energy are shares of what the side can bring, not of what came in so far."""
    found = case({"fill": [], **side})
    assert "water" in [row.name for row in forecast(found).rows]
    coupling = build(found, no_clock).coupling
    strip = 0.1 * 0.2 * (0.3 if "inflow" in side else 0.4)
    assert coupling.water.volume() == pytest.approx(strip, rel=0.15)  # cells cut off its upper edge
    for _ in range(8):
        record = coupling.step(0.01)
        assert record.balance.energy_error < 0.02
        assert abs(coupling.water.volume_error()) < 1e-5
    assert coupling.water.sides.entered > 0.0


def test_energy_that_a_side_can_bring():
    """A sea 0.2 m above the water: ½ ρ g Δz² over its depth; a stream on a dry bed has its speed too."""
    sea = coming_energy(case({"sea": [{"side": "x+", "level": 0.7}]}))
    assert sea(0.0) == sea(0.3) == pytest.approx(0.5 * 1000 * 0.2 * 0.7 * 9.81 * 0.2**2)
    stream = {"kind": "steady", "side": "x-", "level": 0.3, "velocity": 1.0}
    both = coming_energy(case({"fill": [], "inflow": [stream]}))
    assert both(0.0) == pytest.approx(0.5 * 1000 * 0.2 * 0.3 * (9.81 * 0.3**2 + 0.3))


def test_a_wave_without_its_still_water_is_remarked():
    bore = {"kind": "bore", "side": "x-", "ahead": 0.4, "level": 0.8}
    assert "bore at x- runs into still water up to z = 0.4 m" in remarks(case({"inflow": [bore]}))[0]
    assert remarks(case({"inflow": [bore | {"ahead": 0.5}]})) == []


def test_modules_tell_what_is_on():
    on = modules(case({"viscosity": "1 mPa s", "sea": [{"side": "x+", "level": 0.5}]}))
    assert (on["viscosity"], on["wall friction"], on["inflow"]) == (True, False, True)


def read(path, side="x-", turn=0.0, **keys):
    return record_of(RecordInflow(kind="record", side=side, path=str(path), **keys), turn)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("time,level\n0,1\n", "no column velocity"),
        ("time,level,velocity\n0,1\n", "r.csv:2: 2 values; every line needs 3"),
        ("time,level,velocity\n1,1,0\n0,1,0\n", "r.csv:3: times must increase; 0 s comes after 1 s"),
        ("# a\n\ntime,level,velocity\n0,a,0\n", "r.csv:4: 'a' is not a number"),
        ("time,level,velocity\n0,,0\n", "r.csv:2: '' is not a number"),
        ("time,level,velocity\n0,nan,0\n", "r.csv:2: '0,nan,0' is not finite"),
        ("time,level,velocity\n", "no line of numbers"),
        ("time;level;velocity\n0;1;0\n", "no column time, level, velocity"),
        ("", "no column"),
    ],
)
def test_records_that_cannot_be_read_say_why(tmp_path, text, says):
    path = tmp_path / "r.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(RecordError, match=says):
        read(path)


def test_a_record_that_is_not_there_names_the_nearest_file(tmp_path):
    (tmp_path / "bore.csv").write_text("time,level,velocity\n0,1,0\n", encoding="utf-8")
    with pytest.raises(RecordError, match=r"no such file; did you mean 'bore.csv'"):
        read(tmp_path / "Bore.csv")


def test_a_record_saved_by_a_spreadsheet_may_begin_with_a_byte_order_mark(tmp_path):
    path = tmp_path / "r.csv"
    path.write_bytes("time,level,velocity\r\n0,1,0\r\n1,2,0\r\n".encode("utf-8-sig"))
    assert list(read(path).level[:, 0]) == [1, 2]


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


def test_columns_of_a_record_may_stand_in_any_order(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("# a wave\nlevel, velocity, time\n1.0, 2.0, 0\n1.5, 2.5, 3\n", encoding="utf-8")
    found = read(path)
    assert (list(found.time), list(found.level[:, 0]), list(found.velocity[:, 0])) == (
        [0, 3],
        [1, 1.5],
        [2, 2.5],
    )


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


def test_water_at_rest_lifts_a_hull_and_a_box_of_one_shape_alike():
    """A wedge half under water as a hull of points: the force gauge gives its displaced weight and the moment about
    a point, whatever shape the table has."""
    low, high = np.array([0.8, 0.05, 0.2]), np.array([1.1, 0.15, 0.4])
    corners = [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    middle = 0.5 * (low + high)
    gauge = {"kind": "force", "name": "f", "on": "s", "about": [0, 0, 0]}
    tables = (
        {"name": "s", "vertices": [list(map(float, c)) for c in corners]},
        {"name": "s", "centre": list(middle), "size": list(high - low)},
    )
    weight = 1000 * 9.81 * np.prod(high - low)
    for solid in tables:
        _, _, rows = run(case(solid=[solid], gauge=[gauge]), 0.05)
        assert rows[-1]["f_force_z"] == pytest.approx(weight, rel=1e-6)
        assert rows[-1]["f_moment_x"] == pytest.approx(middle[1] * weight, rel=1e-5)
        assert rows[-1]["f_moment_y"] == pytest.approx(-middle[0] * weight, rel=1e-5)


def test_wave_onto_a_beach_keeps_its_books():
    """Solitary wave, rough beach from a hull, sea behind: volume to 1e-4 of what was handled, energy never gained."""
    beach = [[1, -1, 0], [2.5, -1, 0], [2.5, -1, 0.4], [1, 1, 0], [2.5, 1, 0], [2.5, 1, 0.4]]
    inflow = [{"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.05, "crest": 1.6}]
    water = {
        "viscosity": "1 mPa s", "walls": "friction", "manning": 0.025,
        "inflow": inflow, "sea": [{"side": "x+", "level": 0.5}],
    }  # fmt: skip
    gauges = [
        {"kind": "flux", "name": "q", "at": [0.4, 0.1, 0.5], "edges": [[0, 0.2, 0], [0, 0, 1]]},
        {
            "kind": "patch",
            "name": "p",
            "at": [0.01, 0.1, 0.1],
            "edges": [[0, 0.1, 0], [0, 0, 0.1]],
            "mean_over": 0.1,
        },
    ]
    coupling, record, rows = run(case(water, solid=[{"name": "beach", "vertices": beach}], gauge=gauges), 2.1)
    assert coupling.water.sides.entered > 0.005
    assert abs(coupling.water.volume_error()) < 1e-4
    assert record.balance.energy_error < 0.02
    # the crest brings c H in a second over the width, give or take the coarse cells
    assert max(row["q_flux"] for row in rows) == pytest.approx(2.33 * 0.05 * 0.2, rel=0.25)
    # the first tenth of a second, in which inflow and sea set the still water moving at once, left out
    assert max(row["p_mean"] for row in rows[6:]) == pytest.approx(9810 * 0.45, rel=0.02)


def test_a_wave_pushes_still_water_only_where_it_begins_half_way():
    """The first step beside an inflow and a sea: a crest of a tenth of the depth 3.2 depths away has speed at once,
    which takes a push; one 8 depths away begins at rest, and the water stays still."""
    gauge = {"kind": "patch", "name": "p", "at": [0.01, 0.1, 0.1], "edges": [[0, 0.1, 0], [0, 0, 0.1]]}

    def first(crest):
        wave = {"kind": "solitary", "side": "x-", "level": 0.5, "height": 0.05, "crest": crest}
        sides = {"inflow": [wave], "sea": [{"side": "x+", "level": 0.5}]}
        return run(case(sides, gauge=[gauge]), 0.03)[2][0]["p_pressure"] / (9810 * 0.4)

    assert first(1.6) > 1.03
    assert first(4.0) == pytest.approx(1.0, abs=2e-3)


def test_a_stone_that_covers_gauges_leaves_their_cells_empty():
    """It sinks past them: before and behind it they read the water, inside it there is none, and the run goes on."""
    stone = {"name": "stone", "size": [0.12] * 3, "centre": [0.51, 0.1, 0.62], "velocity": [0, 0, -3.0]}
    windows = {"mean_over": 0.01, "impulse": [0, 1]}
    at = [0.51, 0.1, 0.4]
    found = Case.model_validate(
        {
            "case": {"title": "t"},
            "time": {"end": 1.0, "step_max": 0.01},
            "tank": TANK,
            "water": {"fill": FILL},
            "structure": {"density": 5000, "block": [stone]},
            "contact": {"stiffness": 1e6},
            "gauge": [
                {"kind": "pressure", "name": "point", "at": at, **windows},
                {"kind": "patch", "name": "disc", "at": at, "radius": 0.02, "normal": [1, 0, 0], **windows},
                {"kind": "velocity", "name": "u", "at": at, "mean_over": 0.01},
            ],
        }
    )
    coupling, _, rows = run(found, 0.16)
    coupling.structure.close()  # one scene of YADE a process
    empty, disc = ([row[f"{name}_pressure"] is None for row in rows] for name in ("point", "disc"))
    assert not empty[0]
    assert any(disc)
    assert not empty[-1]
    assert empty == [row["u_velocity_x"] is None for row in rows]
    assert disc == [row["disc_covered"] == 1.0 for row in rows]
    assert not any(whole and not middle for whole, middle in zip(disc, empty))
    assert any(0.0 < row["disc_covered"] < 1.0 for row in rows)
    impulse = np.array([row["point_impulse"] for row in rows])
    assert (np.diff(impulse)[empty[1:]] == 0.0).all()
    assert impulse[-1] > impulse[0] > 0.0


@pytest.mark.parametrize(
    ("water", "cause"),
    [
        ({}, "nothing moves or flows in, so look at the mesh"),
        ({"sea": [{"side": "x+", "level": 0.5}]}, "a full chamber that an inflow or a sea fills"),
    ],
)
def test_a_pressure_that_is_not_found_is_reported_with_its_place_and_cause(monkeypatch, water, cause):
    """The message once blamed moving solids where there are none."""
    coupling = build(case(water), no_clock).coupling

    def fails(problem, rtol):
        assert np.isfinite(problem.rhs).all()
        raise NotConverged("no way", np.ones(1), unknown=7)

    monkeypatch.setattr(bounded, "solve_pressure", fails)
    dofs = coupling.water.predict(1e-3).dofs
    place = ", ".join(f"{x:.3g}" for x in coupling.water.topology.nodes[dofs[7]])
    with pytest.raises(Diverged) as error:
        coupling.step(1e-3)
    assert f"no way Water has no room to go at ({place}) m" in str(error.value)
    assert cause in str(error.value)


def test_a_pressure_beyond_all_bounds_is_reported_with_its_place_and_cause():
    pressure, nodes = np.array([0.0, -2e9]), np.array([[0.0, 0, 0], [1.0, 2, 3.5]])
    never, most = (lambda: 0.0), (lambda: 3e9)
    check_pressure(1.0, pressure[:1], nodes, blocks=True, sides=True, to_start=never)
    check_pressure(1.0, pressure, nodes, blocks=True, sides=True, to_start=most)
    with pytest.raises(
        Diverged, match=r"-2e\+09 Pa .* at \(1, 2, 3.5\) m: .* a block closes or makes smaller or an inflow"
    ):
        check_pressure(1.0, pressure, nodes, blocks=True, sides=True, to_start=never)
    with pytest.raises(Diverged, match="slivers of water"):
        check_pressure(1.0, pressure, nodes, blocks=False, sides=False, to_start=never)


def test_an_inflow_sets_the_water_going_in_a_step_however_short():
    """Half a metre of water at rest, an inflow of 1 m/s beside it, a step of 1 µs: 1000 kg/m³ · 1 m/s · 1 m / 1 µs
    is 1 GPa, what that takes, and no chamber without a way out. Steps of half the length need twice as much."""
    tables = {
        "case": {"title": "start"},
        "tank": {"lower": [0, 0, 0], "upper": [1, 0.5, 1], "cell": 0.125, "open": ["z+", "x+"]},
        "water": {
            "fill": [{"lower": [0, 0, 0], "upper": [1, 0.5, 0.5]}],
            "inflow": [{"kind": "steady", "side": "x-", "level": 0.5, "velocity": 1.0}],
        },
        "time": {"end": 1e-4},
    }
    coupling = build(Case.model_validate(tables), no_clock).coupling
    record = coupling.step(1e-6)
    assert record.retries == 0
    assert coupling.water.pressure.max() > 1e8
    for _ in range(3):
        coupling.step(1e-4)
    assert np.abs(coupling.water.pressure).max() < 1e7


@pytest.mark.parametrize(("level", "pockets"), [(0.3, 0), (0.8, 1)])
def test_air_leaves_through_a_sea_above_its_level(level, pockets):
    """A tank under a lid, half full: its air is trapped where the sea beside it stands up to the lid, and open air
    where it does not."""
    tables = {
        "case": {"title": "air"},
        "tank": {"lower": [0, 0, 0], "upper": [1, 0.5, 0.5], "cell": 0.125, "open": []},
        "water": {
            "fill": [{"lower": [0, 0, 0], "upper": [1, 0.5, 0.25]}],
            "sea": [{"side": "x+", "level": level}],
            "air": {"model": "trapped"},
        },
        "time": {"end": 0.1},
    }
    coupling = build(Case.model_validate(tables), no_clock).coupling
    assert len(coupling.water.air) == pockets
    for _ in range(3):
        coupling.step(0.01)
    assert len(coupling.water.air) == pockets


# ---------------------------------------------------------------- records of other models, and tides

GEOCLAW = """# gauge_id=   101 location=(   3.8823000000E+05   4.2530500000E+06 ) num_var=  4
# Stationary gauge
# level, time, q[  1  2  3], eta, aux[]
# file format ascii, time series follow in this file
 1 0.0E+00 2.0E+00  0.0E+00  0.0E+00  5.0E-01
 1 1.0E+01 2.5E+00  5.0E+00  2.5E+00  1.0E+00
 2 1.0E+01 2.5E+00  5.0E+00  1.0E+00  1.0E+00
 2 2.0E+01 0.0E+00  1.0E-09  0.0E+00 -1.5E+00
"""
OLD_GEOCLAW = (
    "##  gauge name  101 gauge number  1 loc  0.0E+00 0.0E+00\n##  level time  dependent vars 1 ... nvar\n"
)


@pytest.mark.parametrize("head", [GEOCLAW, OLD_GEOCLAW + "".join(GEOCLAW.splitlines(True)[4:])])
def test_gauge_of_geoclaw_is_a_record(tmp_path, head):
    """Depth and momenta over the axes of the file; a time written on two levels counts once; dry is at rest."""
    path = tmp_path / "gauge00101.txt"
    path.write_text(head)
    found = read(path, start=5.0, zero=0.5)
    np.testing.assert_allclose(found.time, [-5, 5, 15])
    np.testing.assert_allclose(found.level[:, 0], [0, 0.5, -2])
    np.testing.assert_allclose(found.velocity[:, 0], [0, 2, 0])
    np.testing.assert_allclose(found.sideways[:, 0], [0, 0.4, 0])
    np.testing.assert_allclose(read(path, side="x+").velocity[:, 0], [0, -2, 0])
    np.testing.assert_allclose(read(path, side="y-").velocity[:, 0], [0, 0.4, 0])
    turned = read(path, turn=np.pi / 2)  # x of the file lies along y of the tank
    np.testing.assert_allclose([turned.velocity[1, 0], turned.sideways[1, 0]], [-0.4, 2])


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("Stationary gauge", "Lagrangian particle, q[2,3] replaced by (x(t),y(t))", "stationary one is needed"),
        ("format ascii", "format binary64", "write gauges as ascii"),
        ("q[  1  2  3]", "q[  1]", r"it holds q\[1\]"),
        (" 2 2.0E+01", " 2 2.0E+00", "times run back"),
        (" 5.0E-01\n", "\n", "gauge.txt:5: 5 values"),
    ],
)  # fmt: skip
def test_gauge_of_geoclaw_that_is_no_record_is_refused(tmp_path, old, new, says):
    path = tmp_path / "gauge.txt"
    path.write_text(GEOCLAW.replace(old, new))
    with pytest.raises(RecordError, match=says):
        read(path)


def thetis(path, fields=("uv_2d", "elev_2d"), dims=(2, 1), names=("north", "south")):
    import h5py

    with h5py.File(path, "w") as file:
        file["time"] = np.array([[0.0], [10.0]])
        for k, name in enumerate(names):
            file[name] = np.array([[0.0, 0.0, 0.0], [1.0 + k, 0.5, 2.0]])[:, 3 - sum(dims) :]
        file.attrs["field_names"] = np.array(fields, "S")
        file.attrs["field_dims"] = dims
    return path


def test_detector_of_thetis_is_a_record(tmp_path):
    path = thetis(tmp_path / "diagnostic_coast.hdf5")
    found = read(path, gauge="south")
    assert (list(found.level[:, 0]), list(found.velocity[:, 0]), list(found.sideways[:, 0])) == (
        [0, 2],
        [0, 2],
        [0, 0.5],
    )
    with pytest.raises(RecordError, match="several detectors, north, south; name one"):
        read(path)
    with pytest.raises(RecordError, match="no detector 'nort'; did you mean 'north'"):
        read(path, gauge="nort")
    with pytest.raises(RecordError, match="no field uv_2d; they have elev_2d"):
        read(thetis(tmp_path / "b.h5", ("elev_2d",), (1,), ("a",)))


def test_levels_alone_come_in_as_a_long_wave(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time,level\n0,0\n10,0.5\n")
    spec = RecordInflow(kind="record", side="x-", path=str(path), velocity="long-wave")
    found = record_of(spec, bed=-2.0)
    assert found.velocity[1, 0] == pytest.approx(2 * np.sqrt(9.81) * (np.sqrt(2.5) - np.sqrt(2.0)))
    with pytest.raises(RecordError, match="no column velocity"):
        read(path)


def test_record_along_a_side(tmp_path):
    path = tmp_path / "r.csv"
    path.write_text("time,along,level,velocity,sideways\n0,0,1,0,0\n0,5,1,0,0\n2,0,2,4,1\n2,5,1,2,0\n")
    found = read(path)
    assert found.varies
    assert found.level_at(1.0) == 1.25
    flow = record_along((1, 0, 0), found.time, found.along, found.level, found.velocity, found.sideways)
    points = np.array([[0, 0, 0], [0, 2.5, 0], [0, 9, 0.0]])
    np.testing.assert_allclose(flow.level_at(points, 2.0), [2, 1.5, 1])
    np.testing.assert_allclose(flow.velocity(points, 1.0), [[2, 0.5, 0], [1.5, 0.25, 0], [1, 0, 0]])
    path.write_text("time,along,level,velocity\n0,0,1,0\n0,5,1,0\n2,0,2,4\n2,6,1,2\n")
    with pytest.raises(RecordError, match="expected 5 m, got 6 m"):
        read(path)
    path.write_text("time,along,level,velocity\n0,0,1,0\n0,5,1,0\n2,0,2,4\n")
    with pytest.raises(RecordError, match="every time needs the same 2 places"):
        read(path)


TIDE = {"side": "x+", "level": 0.5}


def test_tide_of_a_sea(tmp_path):
    from coupler.case.water import Sea

    level = sea_level(Sea(**TIDE, tide={"amplitude": 0.2, "period": 40, "high": 10}))
    np.testing.assert_allclose([level(t) for t in (0, 10, 20, 30)], [0.5, 0.7, 0.5, 0.3], atol=1e-12)
    (tmp_path / "tide.csv").write_text("time,level\n0,0.5\n100,1.5\n")
    level = sea_level(Sea(**TIDE, tide={"path": str(tmp_path / "tide.csv")}))
    assert level(50.0) == 1.0


@pytest.mark.parametrize(
    ("tide", "says"),
    [
        ({}, "write amplitude and period, or path"),
        ({"amplitude": 0.1}, "write amplitude and period, or path"),
        ({"amplitude": 0.6, "period": 1}, "its level varies from z = -0.1"),
        ({"path": "/nowhere/tide.csv"}, "no such file"),
    ],
)
def test_tide_that_cannot_be_is_refused(tide, says):
    assert any(says in line for line in reported({"sea": [{**TIDE, "tide": tide}]}))


@pytest.mark.parametrize("absorbs", [False, True])
def test_water_follows_a_slow_tide_and_its_volume_adds_up(absorbs):
    """A basin of 2 m beside a sea that rises by 0.1 m in 10 s: waves cross it ten times in that."""
    tide = {"amplitude": 0.05, "period": 20.0, "high": 10.0}
    sea = {"side": "x+", "level": 0.55, "tide": tide, "absorbs": absorbs}
    found = case({"sea": [sea]}, time={"end": 10.0}, gauge=[{"name": "g", "kind": "level", "at": [1.0, 0.1]}])
    coupling, _, rows = run(found, 10.0)
    water = coupling.water
    assert rows[-1]["g_level"] == pytest.approx(0.6, abs=0.005)
    brought = water.sides.entered - water.sides.left
    assert water.volume() == pytest.approx(2 * 0.2 * 0.5 + brought, rel=1e-6)
    assert water.volume() == pytest.approx(2 * 0.2 * 0.6, rel=0.01)


def surface_file(tmp_path, heights, x=(0.0, 1.0, 2.0)):
    path = tmp_path / "start.csv"
    rows = [f"{a},{b},{z}" for a, z in zip(x, heights) for b in (0.0, 0.2)]
    path.write_text("x,y,z\n" + "\n".join(rows) + "\n")
    return str(path)


def with_surface(**more):
    return {"fill": [FILL[0] | more]}


def test_water_starts_below_the_heights_of_a_file(tmp_path):
    """A ridge across the tank, between the nodes of the file straight: its volume is that below the lines."""
    path = surface_file(tmp_path, (0.3, 0.5, 0.3))
    found = case(with_surface(surface=path))
    assert problems(found) == []
    coupling = build(found, no_clock).coupling
    assert coupling.water.volume() == pytest.approx(2.0 * 0.2 * 0.4, rel=2e-3)
    assert forecast(found)["water"] == pytest.approx(
        2.0 * 0.2 * 0.4, rel=3e-3
    )  # summed over a raster of columns


def test_a_slope_turns_the_surface_about_the_middle_of_its_box():
    found = case(with_surface(slope=[0.1, 0.0]))
    assert problems(found) == []
    water = build(found, no_clock).coupling.water
    assert water.volume() == pytest.approx(2.0 * 0.2 * 0.5, rel=1e-12)
    nodes = water.domain.nodes
    wet = water.level_set < 0.0
    np.testing.assert_array_equal(wet, nodes[:, 2] < 0.5 + 0.1 * (nodes[:, 0] - 1.0) - 1e-12)


@pytest.mark.parametrize(
    ("heights", "x", "more", "message"),
    [
        ((0.3, 0.6, 0.3), (0, 1, 2), {}, "water.fill.0.surface: rises to z = 0.6 m"),
        (
            (-0.3, -0.2, 0.0),
            (0, 1, 2),
            {},
            "surface: lies at z = -0.3 to 0 m, below the box of water (z = 0 m)",
        ),
        ((0.3, 0.4, 0.3), (0, 0.5, 1), {}, "surface: has no height over 49.6%"),
        ((0.3, 0.4, 0.3), (0, 1, 2), {"slope": [0.1, 0]}, "slope: the surface is given by a file as well"),
    ],
)
def test_a_surface_that_does_not_fit_its_box_is_refused(heights, x, more, message, tmp_path):
    told = reported(with_surface(surface=surface_file(tmp_path, heights, x), **more))
    assert len(told) == 1
    assert message in told[0]


def test_slopes_that_leave_the_tank_and_files_that_are_none_are_refused(tmp_path):
    (told,) = reported(with_surface(slope=[0.6, 0.0]))
    assert told == "water.fill.0.slope: rises to z = 1.1 m at (2, 0) m, above the top of the tank (1 m)"
    (told,) = reported(with_surface(surface=str(tmp_path / "starts.csv")))
    assert told.endswith("no such file")
    (tmp_path / "bad.csv").write_text("x,y,z\n0,0,wet\n")
    (told,) = reported(with_surface(surface=str(tmp_path / "bad.csv")))
    assert "no three numbers x, y, z" in told
