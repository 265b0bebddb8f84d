"""Houses from footprints: rectangles, rules, and what is refused."""

import ast
import json
import re
import sys
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.geometry.bodies import overlap_depth
from coupler.geometry.footprints import best_rectangle, epsg_code, read_footprints
from coupler.geometry.parts import parts_of
from coupler.geometry.solids import solids_of
from coupler.geometry.town import _overlapping
from coupler.program.errors import BadCase
from coupler.program.extras import EXTRAS
from coupler.run.clock import Clock
from coupler.run.execute import drawn
from coupler.scene.build import build, build_structure

ROOT = Path(__file__).resolve().parents[2]

CASE = """
[case]
title = "town"
[time]
end = "1 s"
[tank]
lower = [0, 0, -2]
upper = [40, 30, 14]
cell = "2 m"
[terrain]
path = "ground.csv"
origin = [1000, 2000]
[water]
[[water.fill]]
lower = [0, 0, -2]
upper = [20, 30, 0]
[structure]
[[structure.town]]
path = "houses.geojson"
name_from = "id"
storeys_from = "levels"
wall_thickness = "0.4 m"
block = ["3 m", "3 m"]
[[structure.town.rule]]
attribute = "built"
equals = "timber"
material = "timber"
density = 500
storey_height = "2.5 m"
[contact]
[joints]
strength = "1 MPa"
opening_at_failure = "2 mm"
"""


def ring(middle, size, degrees=0.0, at=(1000.0, 2000.0)):
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    corners = np.array(middle) + 0.5 * np.array(size) * [[-1, -1], [1, -1], [1, 1], [-1, 1]] @ turn.T + at
    return [*corners.tolist(), corners[0].tolist()]


def feature(points, **properties):
    return {
        "type": "Feature",
        "properties": properties,
        "geometry": {"type": "Polygon", "coordinates": [points]},
    }


HOUSES = [
    feature(ring((30, 8), (9, 7), 20), id="a", built="brick", levels=2),
    feature(ring((30, 22), (8, 6), -30), id="b", built="timber", levels=1),
]


def loaded(tmp_path, *sets, houses=HOUSES):
    rows = [f"{1000 + x},{2000 + y},{0.1 * (x - 20)}" for x in range(0, 41, 2) for y in range(0, 31, 2)]
    (tmp_path / "ground.csv").write_text("x,y,z\n" + "\n".join(rows) + "\n")
    (tmp_path / "houses.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": houses}))
    (tmp_path / "case.toml").write_text(CASE)
    return load(tmp_path, sets).case


@pytest.mark.parametrize("degrees", [0.0, 20.0, -44.0, 89.0])
def test_rectangle_of_a_turned_footprint(degrees):
    middle, size, turn, share = best_rectangle(np.array(ring((3, 4), (9, 7), degrees, at=(0, 0))[:-1]))
    np.testing.assert_allclose(middle, (3, 4), atol=1e-9)
    assert share == pytest.approx(1.0)
    assert abs(turn) <= np.pi / 4 + 1e-9
    along = np.array([np.cos(turn), np.sin(turn)])
    wanted = np.radians(degrees)
    same = abs(along @ [np.cos(wanted), np.sin(wanted)]) > 0.99
    np.testing.assert_allclose(size, (9, 7) if same else (7, 9), atol=1e-9)


def test_corners_that_are_none_and_double_ones_are_dropped(tmp_path):
    points = [[0, 0], [5, 0], [10, 0], [10, 0], [10, 6], [0, 6], [0, 0]]
    (tmp_path / "h.geojson").write_text(json.dumps({"features": [feature(points[::-1])]}))
    (found,) = read_footprints(tmp_path / "h.geojson")
    assert len(found.corners) == 4
    assert found.area == pytest.approx(60.0)


def test_houses_stand_where_the_file_has_them_with_what_the_rules_say(tmp_path):
    case = loaded(tmp_path)
    a, b = parts_of(case)
    assert (a.name, b.name) == ("a", "b")
    for part, middle in ((a, (30, 8)), (b, (30, 22))):
        mass = np.array([block.mass for block in part.blocks])
        centre = mass @ np.array([block.centre for block in part.blocks]) / mass.sum()
        np.testing.assert_allclose(centre[:2], middle, atol=1e-6)
    tops = [max(block.world_vertices()[:, 2].max() for block in part.blocks) for part in (a, b)]
    feet = [min(block.world_vertices()[:, 2].min() for block in part.blocks) for part in (a, b)]
    np.testing.assert_allclose(np.subtract(tops, feet), (6.0, 2.5))
    assert {block.material for block in b.blocks} == {"timber"}
    assert {block.density for block in b.blocks} == {500.0}
    assert [solid.name for solid in solids_of(case)] == ["a-footing", "b-footing"]


def both_in_one_feature():
    """The two houses as the polygons of one feature, as surveys write a farm with its barn."""
    rings = [[house["geometry"]["coordinates"][0]] for house in HOUSES]
    properties = {"id": "farm", "built": "brick", "levels": 2}
    return [
        {
            "type": "Feature",
            "properties": properties,
            "geometry": {"type": "MultiPolygon", "coordinates": rings},
        }
    ]


@pytest.mark.parametrize(
    ("sets", "names"),
    [([], ["farm", "farm-1"]), (["structure.town[0].name_from=absent"], ["town-0", "town-0-1"])],
)
def test_every_polygon_of_a_feature_is_a_house_with_a_name_of_its_own(tmp_path, sets, names):
    """They share the number and the attributes of the feature, and were refused as houses of one name."""
    case = loaded(tmp_path, *sets, houses=both_in_one_feature())
    assert [part.name for part in parts_of(case)] == names


def test_the_first_footprint_without_storeys_is_told_by_the_number_of_its_feature(tmp_path):
    silent = feature(ring((34, 15), (4, 4)), id="shed", built="brick", levels=None)
    found = remarks(loaded(tmp_path, houses=[*both_in_one_feature(), silent]))
    assert any(
        "1 of 3 footprints say nothing under 'levels' (the first is feature 1)" in line for line in found
    )


def test_footprints_beside_the_tank_and_sheds_across_its_side_are_left_out(tmp_path):
    beside = [feature(ring((44, 15), (8, 6)), id="c"), feature(ring((43, 33), (4, 4), 45), id="d")]
    shed = feature(ring((40, 8), (2, 1)), id="e")
    case = loaded(tmp_path, "structure.town[0].least_area=5", houses=[*HOUSES, *beside, shed])
    assert [part.name for part in parts_of(case)] == ["a", "b"]


def turned_houses(*more):
    """A grid of 15 x 15 houses of several sizes and turns that do not touch one another, and further ones."""
    draw = np.random.default_rng(3)
    made = [
        SimpleNamespace(lower=(20.0 * x, 20.0 * y, 0.0), size=(*draw.uniform(6, 13, 2), 6.0), turn=turn)
        for x in range(15)
        for y, turn in enumerate(draw.uniform(0, 1.5, 15))
    ]
    for k, house in enumerate([*made, *more]):
        house.name, house.outline = f"house-{k}", None
        yield house


def test_only_houses_whose_boxes_meet_are_compared(monkeypatch):
    """225 houses are 25 200 pairs, 1600 took 22 s; the first house that overlaps an earlier one is reported, with the
    first of those that it overlaps."""
    compared = []

    def counted(a, b, enough):
        compared.append((a, b))
        return overlap_depth(a, b, enough)

    monkeypatch.setattr("coupler.geometry.bodies.overlap_depth", counted)
    monkeypatch.setattr("coupler.geometry.town.houses_of", lambda case, town: tuple(turned_houses()))
    assert list(_overlapping(None, (), None)) == []
    assert len(compared) < 2 * 225

    more = [
        SimpleNamespace(lower=(x - 4, x - 4, 0.0), size=(12.0, 12.0, 3.0), turn=0.3) for x in (40.0, 20.0)
    ]
    monkeypatch.setattr("coupler.geometry.town.houses_of", lambda case, town: tuple(turned_houses(*more)))
    ((_, told),) = _overlapping(None, (), None)
    assert re.match(r"'house-225' at \(42, 42\) m overlaps 'house-32' by", told)


ELL = [[0, 0], [10, 0], [10, 3], [3, 3], [3, 10], [0, 10], [0, 0]]


@pytest.mark.parametrize(
    ("houses", "sets", "reported"),
    [
        (
            [feature(ring((60, 8), (9, 7)))],
            ["structure.town[0].name_from=absent"],
            "none of its footprints lies in the tank",
        ),
        (
            [feature(ring((39, 8), (9, 7)), id="a")],
            [],
            r"feature 0 lies across the side of the tank, at \(43.5",
        ),
        (  # no corner of it in the tank
            [feature(ring((40.5, 30.5), (4, 4), 45), id="a")],
            [],
            r"feature 0 lies across the side of the tank, at \(4",
        ),
        ([feature(ring((20, 15), (90, 80)), id="a")], [], "feature 0 lies across the side of the tank"),
        ([feature(ring((10, 8), (6, 6)), id="a")], [], r"'a' stands at z = -0.7 m under 0.7 m of the water"),
        ([*HOUSES, feature(ring((33, 9), (6, 6)), id="c")], [], r"'c' at \(33, 9\) m overlaps 'a' by"),
        ([HOUSES[0], HOUSES[0]], [], "two houses called 'a'"),
        ([feature(np.add(ELL, (1025, 2010)).tolist(), id="a")], [], "fills 51% of its rectangle"),
        (
            [feature(ring((30, 8), (9, 7)), id="a", levels="two")],
            [],
            "levels = 'two' is no number of storeys",
        ),
        (
            [feature(ring((30, 8), (9, 7)), id="a", levels="inf")],
            [],
            "levels = 'inf' is no number of storeys",
        ),
        (
            HOUSES,
            ["structure.town[0].rule[0].attribute=bilt"],
            "no footprint has 'bilt'; did you mean 'built'?",
        ),
        (
            [{"type": "Feature", "geometry": {"type": "Point"}}],
            [],
            "feature 0 is a Point; footprints are polygons",
        ),
        (
            HOUSES,
            ["terrain=absent"],
            r"houses from footprints stand on the terrain; write a section \[terrain\]",
        ),
        (HOUSES, ["structure.town[0].path=houses.shape"], "no footprints are read from .shape"),
        (
            HOUSES,
            ["structure.town[0].storeys_from=level"],
            r"storeys_from: no footprint has 'level'; did you mean 'levels'\?",
        ),
        (
            [feature([[1026, 2005], [1034, 2011], [1034, 2005], [1026, 2012], [1026, 2005]], id="a")],
            [],
            r"the outline of feature 0 crosses itself at \(1030\.\d+, 2008",
        ),
        (
            [feature(ring((12.5, 41.9), (1e-4, 1e-4), at=(0.0, 0.0)), id="a")],
            [],
            r"coordinates, such as \(12\.\d+, 41\.\d+\), look like degrees: write crs = \"EPSG:4326\"",
        ),
    ],
)
def test_footprints_that_cannot_be_houses_are_refused(houses, sets, reported, tmp_path):
    (tmp_path / "houses.shape").write_text("")
    with pytest.raises(BadCase) as error:
        loaded(tmp_path, *sets, houses=houses)
    assert re.search(reported, "\n".join(error.value.lines)), error.value.lines


# ---------------------------------------------------------------- outlines and pads

L = np.array([[0, 0], [9, 0], [9, 4], [5, 4], [5, 8], [0, 8]], float)


OUTLINE = 'structure.town[0].shape="outline"'


def placed(shape, middle=(30.0, 15.0), degrees=0.0):
    a = np.radians(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    corners = (np.array(shape) - np.mean(shape, axis=0)) @ turn.T + middle + [1000.0, 2000.0]
    return [*corners.tolist(), corners[0].tolist()]


@pytest.mark.parametrize("degrees", [0.0, 25.0])
def test_footprint_that_is_no_rectangle_becomes_a_ring_of_walls_and_slabs(tmp_path, degrees):
    """An L: walls of 0.4 m along its outline, 3 m high with a slab of 0.4 m over all of it; nothing overlaps, and all
    faces between blocks are joined."""
    case = loaded(
        tmp_path, OUTLINE, houses=[feature(placed(L, degrees=degrees), id="L1", built="brick", levels=1)]
    )
    blocks = [block for part in parts_of(case) for block in part.blocks]
    plan, length = 56.0, 34.0
    wall = plan - (plan - 0.4 * length + 0.16 * 4)  # inside: five corners take t², one gives it back
    volume = sum(ConvexHull(b.world_vertices()).volume for b in blocks)
    assert volume == pytest.approx(plan * 0.4 + wall * 2.6, rel=1e-6)
    assert {re.sub(r"(-\d+)+$", "", b.name) for b in blocks} == {
        *(f"L1-wall0n{e}" for e in range(6)),
        "L1-roof0",
    }
    footings = [s for s in solids_of(case) if s.name.startswith("L1-footing")]
    assert sum(ConvexHull(s.vertices[:, :2]).volume for s in footings) == pytest.approx(plan, rel=1e-6)
    structure = build(case, Clock()).coupling.structure
    try:
        assert len(structure.joints) > len(blocks)
    finally:
        structure.close()


def test_wall_that_leaves_no_room_is_refused_with_the_edge(tmp_path):
    houses = [feature(placed(L), id="L1", built="brick", levels=1)]
    with pytest.raises(BadCase, match="'L1': no room between walls of 3 m at the edge from"):
        loaded(
            tmp_path,
            OUTLINE,
            "structure.town[0].wall_thickness=3",
            "structure.town[0].floor_thickness=0.4",
            houses=houses,
        )


def test_footing_reaches_beyond_the_walls_as_a_pad(tmp_path):
    case = loaded(
        tmp_path,
        "structure.town[0].pad=1.5",
        houses=[feature(ring((30, 15), (8, 6)), id="a", built="brick", levels=1)],
    )
    (footing,) = solids_of(case)
    np.testing.assert_allclose(np.ptp(footing.vertices, axis=0)[:2], [11, 9])


def test_pairs_of_joints_take_the_names_of_a_town_and_of_its_houses(tmp_path):
    def on_footings(*sets):
        with build_structure(loaded(tmp_path, *sets)) as s:
            ends = [(s.names[a], s.names[b]) for a, b in zip(s.joints.a, s.joints.b) if b >= 0]
        return {one.partition("-")[0] for one, other in ends if other.endswith("-footing")}

    assert on_footings() == {"a", "b"}
    for name, left in (("a", {"b"}), ("town", set())):
        assert on_footings(f'joints.pair=[{{between=["{name}", "ground"], joined=false}}]') == left


def test_ground_with_a_hole_is_the_only_mistake_that_is_reported(tmp_path):
    """Without ground there are no houses, but the materials of their rules have names all the same."""
    loaded(tmp_path, 'joints.pair=[{between=["timber","timber"], strength="1 kPa"}]')
    rows = (tmp_path / "ground.csv").read_text().splitlines()
    (tmp_path / "ground.csv").write_text("\n".join([*rows[:100], *rows[101:]]) + "\n")
    with pytest.raises(BadCase) as error:
        load(tmp_path, ('joints.pair=[{between=["timber","timber"], strength="1 kPa"}]',))
    assert len(error.value.lines) == 1
    assert "holes (no data)" in error.value.lines[0]


def test_a_fault_of_the_terrain_is_told_once(tmp_path):
    loaded(tmp_path)
    path = tmp_path / "case.toml"
    path.write_text(
        path.read_text() + '[[joints.pair]]\nbetween = ["timber", "ground"]\nstrength = "2 MPa"\n'
    )
    with pytest.raises(BadCase) as refused:
        load(tmp_path, ["terrain.path=nowhere.csv"])
    (line,) = str(refused.value).splitlines()
    assert "no such file" in line
    with pytest.raises(BadCase) as refused:
        load(tmp_path, ["terrain.origin=[0, 0]"])
    assert len(str(refused.value).splitlines()) == 1


def test_the_extent_of_the_terrain_is_told_and_that_its_unit_is_taken_to_be_metres(tmp_path):
    (line,) = drawn(loaded(tmp_path))
    assert line.startswith("terrain ground.csv: 40 x 30 m, heights from -2 to 2 m")
    assert line.endswith("the file names no unit and is taken to be in metres (terrain.scale)")
    (line,) = drawn(loaded(tmp_path, "terrain.crs=EPSG:32654"))
    assert "names no unit" not in line


@pytest.mark.parametrize(
    ("value", "says"), [("timbre", "did you mean 'timber'?"), ("stone", "there are 'brick', 'timber'")]
)
def test_a_rule_for_a_value_that_no_footprint_has_is_told(tmp_path, value, says):
    found = remarks(loaded(tmp_path, f"structure.town[0].rule[0].equals={value}"))
    assert any(
        f"rule[0] changes nothing: no footprint has built = '{value}'; {says}" in line for line in found
    )
    assert not any("changes nothing" in line for line in remarks(loaded(tmp_path)))


def test_footprints_without_a_number_of_storeys_are_told(tmp_path):
    one, other = HOUSES
    silent = {**other, "properties": {**other["properties"], "levels": None}}
    found = remarks(loaded(tmp_path, houses=[one, silent]))
    assert any(
        "1 of 2 footprints say nothing under 'levels' (the first is feature 1): they get storeys = 1" in line
        for line in found
    )
    assert not any("say nothing" in line for line in remarks(loaded(tmp_path)))


UTM_54 = 'PROJCS["WGS 84 / UTM zone 54N",GEOGCS["WGS 84",AUTHORITY["EPSG","4326"]],AUTHORITY["EPSG","32654"]]'


@pytest.mark.parametrize(
    ("crs", "refused"),
    [
        ("urn:ogc:def:crs:EPSG::32654", None),
        ("EPSG:32653", "32653"),
        ("urn:ogc:def:crs:OGC:1.3:CRS84", "4326"),
    ],
)
def test_footprints_in_another_coordinate_system_than_the_terrain_are_refused(tmp_path, crs, refused):
    case = loaded(tmp_path, "terrain.crs=EPSG:32654")
    path = tmp_path / "houses.geojson"
    data = json.loads(path.read_text())
    path.write_text(json.dumps(data | {"crs": {"type": "name", "properties": {"name": crs}}}))
    if refused is None:
        assert len(parts_of(load(tmp_path, ["terrain.crs=EPSG:32654"]).case)) == len(parts_of(case)) == 2
        return
    with pytest.raises(
        BadCase, match=f'EPSG:{refused}, that of the terrain EPSG:32654; write crs = "EPSG:{refused}"'
    ):
        load(tmp_path, ["terrain.crs=EPSG:32654"])


def test_code_of_a_coordinate_system_is_the_outermost_of_its_text():
    assert epsg_code(UTM_54) == "32654"
    assert epsg_code('PROJCRS["x",BASEGEOGCRS["y",ID["EPSG",4326]],ID["EPSG",32610]]') == "32610"
    assert epsg_code('PROJCS["WGS_1984_UTM_Zone_10N"]') is None


def test_every_package_that_reads_maps_is_in_the_extra():
    """What is imported in the processes that read rasters and footprints must come with `pip install .[terrain]`."""
    used = set()
    for module in ("footprints", "terrain/raster"):
        tree = ast.parse((ROOT / "coupler" / "geometry" / f"{module}.py").read_text())
        for node in ast.walk(tree):
            names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
            names += [node.module] if isinstance(node, ast.ImportFrom) and node.module else []
            used |= {name.split(".")[0] for name in names}
    outside = used - set(sys.stdlib_module_names) - {"array_types", "coupler", "numpy", "scipy", "__future__"}
    assert outside == set(EXTRAS["terrain"])
    told = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]["terrain"]
    assert {re.match(r"[a-z]+", line)[0] for line in told} == outside
