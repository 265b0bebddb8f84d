"""Blocks from drawings: nothing lost, openings kept, joints across every cut, whatever the file, and refusals that show
the place."""

import time

import meshio
import numpy as np
import pytest
import trimesh
from manifold3d import Manifold

from coupler.case.case import Case
from coupler.case.structure import BlockFile, Drawing
from coupler.checks.remarks import remarks
from coupler.commands.blocks.command import write_bodies
from coupler.geometry.block_files import blocks_from_file
from coupler.geometry.bodies import Body
from coupler.geometry.drawing.drawing import cut_drawing
from coupler.geometry.drawing.reading import BadDrawing
from coupler.geometry.mesh_files import MeshFileError
from tests.coupler.drawings import HOUSE_OPENINGS, box, ell, house, mesh, write
from yade_scripts.blocks.faces import touching_faces


def cut(path, size=1.2, **options):
    return cut_drawing(
        Drawing(path=str(path), name="house", size=size, **options), density=2400.0, material="block"
    )


def members(found):
    return {block.name.rsplit("-", 1)[0] for block in found.blocks}


@pytest.fixture(scope="module")
def house_of_blocks(tmp_path_factory):
    return cut(write(tmp_path_factory.mktemp("house") / "house.obj", house=house()))


def check_whole(found, body):
    """Volumes are equal, and all that cutting laid open is joined again: each cut has two sides and one joint."""
    blocks = list(found.blocks)
    assert sum(b.volume for b in blocks) == pytest.approx(body.volume(), rel=1e-9)
    assert found.volume == pytest.approx(body.volume(), rel=1e-9)
    inner = sum(f.area for f in touching_faces(blocks, []))
    skins = sum(Manifold.hull_points(b.world_vertices()).surface_area() for b in blocks)
    assert 2.0 * inner == pytest.approx(skins - body.surface_area(), rel=1e-6)


def test_a_house_of_three_rooms_with_nine_openings(house_of_blocks):
    check_whole(house_of_blocks, house())
    assert members(house_of_blocks) == {
        f"house-{name}"
        for name in ("wall0x-", "wall0x+", "wall0y-", "wall0y+", "wall0x1", "wall0y1", "roof0")
    }


def test_openings_are_kept(house_of_blocks):
    bodies = [Body.of_block(b) for b in house_of_blocks.blocks]
    for low, high in HOUSE_OPENINGS:
        inside = np.random.default_rng(1).uniform(low, high, (200, 3))
        assert all((body.depth(inside) < 1e-9).all() for body in bodies)


def test_thin_walls_are_one_block_thick_and_blocks_of_the_wanted_size(house_of_blocks):
    for block in house_of_blocks.blocks:
        assert Body.of_block(block).thickness() == pytest.approx(0.25, abs=1e-9)
        assert np.ptp(block.world_vertices(), axis=0).max() <= 1.5 * 1.2 + 1e-9


def test_a_building_with_two_storeys_and_a_stair(tmp_path):
    found = cut(write(tmp_path / "ell.ply", ell=ell()))
    check_whole(found, ell())
    assert {"house-floor0", "house-roof1", "house-pier0", "house-wall0x-", "house-wall1x-"} <= members(found)
    assert not any(name.startswith("house-floor2") for name in members(found))


def test_storeys_are_counted_from_the_ground_however_high_the_building(tmp_path):
    """Five storeys of 3 m on a slab between the walls: the slab lies on the ground, and ends no storey."""
    body = box((0, 0, 0), (6, 4, 15.25))
    for k in range(5):
        body -= box((0.3, 0.3, 0.25 + 3 * k), (5.7, 3.7, 3.0 + 3 * k))
    found = cut(write(tmp_path / "tower.obj", house=body), size=2.0)
    check_whole(found, body)
    slabs = {name for name in members(found) if "wall" not in name and "pier" not in name}
    assert slabs == {
        "house-base0",
        "house-floor0",
        "house-floor1",
        "house-floor2",
        "house-floor3",
        "house-roof4",
    }
    walls = {name.rstrip("xy+-") for name in members(found) if "wall" in name}
    assert walls == {f"house-wall{k}" for k in range(5)}


@pytest.mark.parametrize("ending", ["stl", "ply"])
def test_single_precision_gives_the_same_blocks(tmp_path, ending, house_of_blocks):
    """Coordinates such as 6.7 are not exact in these files; they are read as they were typed."""
    found = cut(write(tmp_path / f"house.{ending}", house=house()))
    check_whole(found, house())
    assert abs(len(found.blocks) - len(house_of_blocks.blocks)) <= 2  # cuts that are alike may fall otherwise


def test_a_house_that_stands_askew_is_cut_along_its_own_walls(tmp_path):
    body = house().rotate((0, 0, 27.0))
    found = cut(write(tmp_path / "askew.obj", house=body))
    check_whole(found, body)
    assert abs(len(found.blocks) - 114) <= 4


def test_a_roof_of_two_slopes(tmp_path):
    """A gable: two plates that lean on one another, on four walls."""
    walls = box((0, 0, 0), (6, 4, 3)) - box((0.3, 0.3, 0), (5.7, 3.7, 3))
    ridge = Manifold.hull_points([[x, y, z] for x in (0, 6) for y, z in ((0, 3), (4, 3), (2, 4.5))])
    body = walls + (ridge - ridge.translate((0, 0, -0.4)))
    found = cut(write(tmp_path / "gable.obj", house=body), size=1.5)
    check_whole(found, body)
    assert any("-roof0" in name for name in members(found))


def test_running_bond_shifts_every_other_course(tmp_path):
    """A wall of 6 x 0.25 x 2 m in blocks of 1 x 0.5 m: courses of six, and of seven with two halves."""
    path = write(tmp_path / "wall.obj", wall=box((0, 0, 0), (6, 0.25, 2)))
    found = cut(path, size=1.0, course=0.5, bond="running")
    courses = [[b for b in found.blocks if abs(b.centre[2] - z) < 0.1] for z in (0.25, 0.75, 1.25, 1.75)]
    assert [len(course) for course in courses] == [6, 7, 6, 7]
    lengths = sorted(round(float(np.ptp(b.world_vertices()[:, 0])), 6) for b in courses[1])
    assert lengths == [0.5, 0.5, 1.0, 1.0, 1.0, 1.0, 1.0]
    check_whole(found, box((0, 0, 0), (6, 0.25, 2)))


def test_slivers_go_to_a_neighbour(tmp_path):
    """A window 3 cm from a corner leaves a strip of 3 cm beside it, which no block can be; with the parapet above and
    below it is no strip. The one beside the window stays and is reported."""
    body = box((0, 0, 0), (4, 0.3, 3)) - box((0.03, -1, 1), (1.2, 1, 2))
    found = cut(write(tmp_path / "strip.obj", wall=body))
    check_whole(found, body)
    assert [round(width, 6) for _, width in found.slivers] == [0.03]


def test_bodies_that_overlap_are_one_and_of_layers_the_later_gives_way(tmp_path):
    """Walls drawn as boxes through one another at the corner; a slab of another layer through both."""
    one, other = box((0, 0, 0), (4, 0.3, 3)), box((0, 0, 0), (0.3, 4, 3))
    slab = box((0, 0, 2.8), (4, 4, 3.0))
    found = cut(write(tmp_path / "layers.obj", brick=one + other, concrete=slab))
    assert found.layers["brick"][0] == pytest.approx((one + other).volume())
    assert found.layers["concrete"][0] == pytest.approx((slab - one - other).volume())
    check_whole(found, one + other + slab)


def test_layers_say_material_density_and_what_is_left_out(tmp_path):
    path = write(
        tmp_path / "layers.obj", brick=box((0, 0, 0), (2, 0.3, 2)), table=box((5, 5, 0), (6, 6, 1)),
        concrete=box((0, 0, 2), (2, 2, 2.2)),
    )  # fmt: skip
    rules = [
        {"name": "concrete", "material": "concrete", "density": 2500.0},
        {"name": "table", "leave_out": True},
    ]
    found = cut(path, layer=rules)
    assert {(b.material, b.density) for b in found.blocks} == {("block", 2400.0), ("concrete", 2500.0)}
    assert "table" not in found.layers
    with pytest.raises(BadDrawing, match="no layer 'glass'; it has brick, table, concrete"):
        cut(path, layer=[{"name": "glass"}])


def test_a_room_without_a_door_stays_hollow(tmp_path):
    body = box((0, 0, 0), (3, 3, 3)) - box((0.3, 0.3, 0.3), (2.7, 2.7, 2.7))
    check_whole(cut(write(tmp_path / "vault.stl", vault=body)), body)
    furnished = body + box((1, 1, 0.3), (1.5, 1.5, 1)).translate((0, 0, 0.5))
    check_whole(cut(write(tmp_path / "furnished.stl", vault=furnished)), furnished)


def write_facing(path, *parts):
    """One layer of boxes (lower, upper, whether it faces inwards)."""
    found = [(*mesh(box(low, high)), inwards) for low, high, inwards in parts]
    bodies = [trimesh.Trimesh(x, t[:, ::-1] if turn else t, process=False) for x, t, turn in found]
    trimesh.util.concatenate(bodies).export(path)
    return path


ROOM = (((0, 0, 0), (3, 3, 3), False), ((0.5, 0.5, 0.5), (2.5, 2.5, 2.5), True))
"""A vault of 27 - 8 m³."""


@pytest.mark.parametrize(
    ("parts", "volume", "turned"),
    [
        ((((0, 0, 0), (1, 1, 1), False), ((3, 0, 0), (4, 1, 1), True)), 2.0, 1),
        ((*ROOM, ((1, 1, 0.5), (2, 2, 1.5), True)), 20.0, 1),
        ((*ROOM, ((1, 1, 0.5), (2, 2, 1.5), False)), 20.0, 0),
        ((*ROOM, ROOM[1]), 19.0, 0),
    ],
)
def test_what_faces_inwards_and_is_no_room_is_a_body(tmp_path, parts, volume, turned):
    """Beside another body and in a room it was left out without a word; a room that is drawn twice is one."""
    found = cut(write_facing(tmp_path / "inwards.ply", *parts))
    assert found.volume == pytest.approx(volume, rel=1e-6)
    assert sum(b.volume for b in found.blocks) == pytest.approx(volume, rel=1e-6)
    assert len(found.turned) == turned


def test_in_the_opening_of_a_frame_a_wall_that_faces_inwards_stays(tmp_path):
    """The box around the frame holds the wall, the frame does not."""
    frame = box((0, 0, 0), (4, 0.4, 3)) - box((0.5, -1, 0), (3.5, 1, 2.5))
    points, triangles = mesh(box((1, 0.1, 0), (3, 0.3, 1)))
    both = [trimesh.Trimesh(*mesh(frame)), trimesh.Trimesh(points, triangles[:, ::-1])]
    trimesh.util.concatenate(both).export(tmp_path / "portal.stl")
    found = cut(tmp_path / "portal.stl", size=0.5)
    assert found.volume == pytest.approx(frame.volume() + 0.4, rel=1e-6)
    case = Case.model_validate(
        {
            "case": {"title": "portal"},
            "time": {"end": 1.0},
            "structure": {"drawing": [{"path": str(tmp_path / "portal.stl"), "size": 0.5}]},
            "contact": {},
        }
    )
    assert [text for text in remarks(case) if "drawing" in text] == [
        "structure.drawing[0]: layer 'all': the surface around (2, 0.2, 0.5) m faces the other way than the others; it "
        "lies within no other body and is taken for a body, not for a room: draw it facing outwards"
    ]


@pytest.mark.parametrize(
    ("parts", "text"),
    [
        ((*ROOM, ((1, 1, 0.4), (2, 2, 1.5), True)), r"around \(1.5, 1.5, 0.95\) m .* lies partly in a room"),
        (
            (((9, 0, 0), (19, 9, 9), False), *((low, high, not inwards) for low, high, inwards in ROOM)),
            r"around \(1.5, 1.5, 1.5\) m .* holds another body",
        ),
    ],
)
def test_what_may_be_a_room_or_a_body_is_refused_with_its_place(tmp_path, parts, text):
    with pytest.raises(BadDrawing, match=text):
        cut(write_facing(tmp_path / "either.ply", *parts))


def test_an_open_surface_is_refused_with_its_edges(tmp_path):
    points, triangles = mesh(box((0, 0, 0), (2, 1, 1)))
    meshio.Mesh(points, [("triangle", triangles[1:])]).write(tmp_path / "open.obj")
    with pytest.raises(BadDrawing, match=r"open surface: the edge .* 3 edges are open") as refusal:
        cut(tmp_path / "open.obj")
    assert refusal.value.lines.shape == (3, 2, 3)


@pytest.mark.parametrize(
    ("name", "text"), [("house.dwg", "drawings end in stl"), ("nothing.stl", "nothing.stl")]
)
def test_what_is_no_drawing_is_refused(tmp_path, name, text):
    (tmp_path / name).write_text("no drawing")
    with pytest.raises(MeshFileError, match=text):
        cut(tmp_path / name)


def test_blocks_that_are_written_are_read_again(tmp_path, house_of_blocks):
    write_bodies(tmp_path / "blocks.obj", house_of_blocks)
    again = blocks_from_file(BlockFile(path=str(tmp_path / "blocks.obj")))
    assert sum(b.volume for b in again) == pytest.approx(house().volume(), rel=1e-9)
    assert len(again) == len(house_of_blocks.blocks)


def test_step_files_by_their_bodies(tmp_path):
    """A wall with a window and a slab on it, in millimetres, as a drawing office writes them."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
    occ = gmsh.model.occ
    wall, hole = occ.addBox(0, 0, 0, 4000, 300, 3000), occ.addBox(1000, -10, 1000, 1000, 400, 1000)
    occ.cut([(3, wall)], [(3, hole)])
    occ.addBox(0, 0, 3000, 4000, 2000, 250)
    occ.synchronize()
    gmsh.write(str(tmp_path / "house.step"))
    gmsh.finalize()
    found = cut(tmp_path / "house.step")
    assert found.volume == pytest.approx((4 * 3 - 1) * 0.3 + 4 * 2 * 0.25, rel=1e-9)
    assert sum(b.volume for b in found.blocks) == pytest.approx(found.volume, rel=1e-9)


def test_ifc_files_by_their_materials(tmp_path):
    """A wall of brick and a slab of concrete, as extruded rectangles in millimetres."""
    ifcopenshell = pytest.importorskip("ifcopenshell")
    file = ifcopenshell.file(schema="IFC4")
    origin = file.createIfcAxis2Placement3D(file.createIfcCartesianPoint((0.0, 0.0, 0.0)))
    context = file.createIfcGeometricRepresentationContext(None, "Model", 3, 1e-5, origin)
    metre = file.createIfcSIUnit(None, "LENGTHUNIT", "MILLI", "METRE")
    units = file.createIfcUnitAssignment([metre])
    file.createIfcProject(ifcopenshell.guid.new(), None, "p", None, None, None, None, [context], units)

    def body(kind, material, low, size):
        centre = file.createIfcCartesianPoint((low[0] + size[0] / 2, low[1] + size[1] / 2))
        profile = file.createIfcRectangleProfileDef(
            "AREA", None, file.createIfcAxis2Placement2D(centre), *size[:2]
        )
        foot = file.createIfcAxis2Placement3D(file.createIfcCartesianPoint((0.0, 0.0, low[2])))
        up = file.createIfcDirection((0.0, 0.0, 1.0))
        solid = file.createIfcExtrudedAreaSolid(profile, foot, up, size[2])
        shape = file.createIfcShapeRepresentation(context, "Body", "SweptSolid", [solid])
        element = file.create_entity(kind, ifcopenshell.guid.new(), Name=material)
        element.ObjectPlacement = file.createIfcLocalPlacement(None, origin)
        element.Representation = file.createIfcProductDefinitionShape(None, None, [shape])
        file.createIfcRelAssociatesMaterial(
            ifcopenshell.guid.new(), None, None, None, [element], file.createIfcMaterial(material)
        )

    body("IfcWall", "brick", (0.0, 0.0, 0.0), (4000.0, 300.0, 3000.0))
    body("IfcSlab", "concrete", (0.0, 0.0, 3000.0), (4000.0, 2000.0, 250.0))
    file.write(str(tmp_path / "house.ifc"))
    found = cut(tmp_path / "house.ifc")
    assert {name: volume for name, (volume, _) in found.layers.items()} == pytest.approx(
        {"brick": 3.6, "concrete": 2.0}
    )


def test_a_drawing_in_millimetres_is_refused_before_blocks_are_made_and_told_its_unit(tmp_path):
    write(tmp_path / "house.stl", all=house().scale([1000.0] * 3))
    began = time.process_time()
    with pytest.raises(BadDrawing, match="it is 9000 x 7000 x 3000 m as it is read") as refused:
        cut_drawing(Drawing(path=str(tmp_path / "house.stl"), size=1.2))
    assert time.process_time() - began < 5.0
    assert 'drawn in millimetres, write scale = "1 mm"' in str(refused.value)
    assert "then it is 9 x 7 x 3 m" in str(refused.value)
    cut = cut_drawing(Drawing(path=str(tmp_path / "house.stl"), size=1.2, scale="1 mm"))
    assert cut.extent == pytest.approx([9.0, 7.0, 3.0])


def test_more_blocks_than_wanted_are_refused_by_the_number_of_the_case(tmp_path):
    write(tmp_path / "house.stl", all=house())
    with pytest.raises(
        BadDrawing, match=r"at most 50 \(most_blocks\). Take a larger size, or raise most_blocks"
    ):
        cut_drawing(Drawing(path=str(tmp_path / "house.stl"), size=1.2, most_blocks=50))
