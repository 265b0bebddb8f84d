"""Tables of the structure: what they make, and refusals with line, key and remedy."""

import numpy as np
import pytest

from coupler.checks.read_case import load
from coupler.geometry.parts import parts_of
from coupler.program.errors import BadCase
from coupler.scene.build import rows_by_name

HEAD = """\
[case]
title = "blocks"
[time]
end = "1 s"
[contact]
stiffness = "1 MN/m"
[structure]
density = 2000
"""
BLOCK = """\
[[structure.block]]
name = "wedge"
vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
"""
COLUMN = """\
[[structure.column]]
foot = [5, 0, 0]
height = 3
drums = 3
radius = 0.4
"""
ARCH = """\
[[structure.arch]]
foot = [0, 0, 5]
span = 4
thickness = 0.4
width = 0.5
voussoirs = 9
abutment = [1, 1]
"""
RUBBLE = """\
[[structure.rubble]]
lower = [20, 0, 0]
size = [2, 2, 2]
count = 5
diameter = [0.3, 0.5]
"""
PAIRS = (
    """\
[[contact.pair]]
materials = ["brick", "ground"]
friction = 0.3
[[contact.pair]]
materials = ["block", "brick"]
friction = 0.9
[structure.ground]
"""
    + BLOCK
    + """\
[[structure.wall]]
lower = [30, 0, 0]
size = [4, 0.2, 1]
block = [0.4, 0.2, 0.2]
material = "brick"
"""
)
WALL = """\
[[structure.wall]]
lower = [30, 0, 0]
size = [4, 0.2, 1]
block = [0.4, 0.2, 0.2]
bond = "running"
"""


def write(folder, text):
    (folder / "case.toml").write_text(HEAD + text, encoding="utf-8")
    return folder


def made(folder, text, *overrides):
    """The blocks by name."""
    case = load(write(folder, text), overrides).case
    return {block.name: block for part in parts_of(case) for block in part.blocks}


@pytest.mark.parametrize(("faces", "inertia"), [(20, 1.02), (80, 1.001), (320, 1.0001)])
def test_a_block_with_a_diameter_has_volume_and_inertia_of_the_sphere(faces, inertia, tmp_path):
    text = f'[[structure.block]]\nname = "ball"\ncentre = [1, 2, 3]\ndiameter = 0.4\nfaces = {faces}\n'
    ball = made(tmp_path, text)["ball"]
    mass = 2000.0 * np.pi / 6.0 * 0.4**3
    assert ball.mass == pytest.approx(mass, rel=1e-12)
    assert len(ball.faces) == faces
    np.testing.assert_allclose(ball.centre, [1, 2, 3])
    moments = np.linalg.eigvalsh(ball.inertia) / (0.4 * mass * 0.2**2)
    assert (moments >= 1.0).all()
    assert (moments <= inertia).all()


def test_a_polyhedron_stands_where_its_vertices_are(tmp_path):
    block = made(tmp_path, BLOCK)["wedge"]
    np.testing.assert_allclose(block.centre, [0.25] * 3, rtol=1e-12)
    assert block.mass == pytest.approx(2000.0 / 6.0, rel=1e-12)


def test_a_polyhedron_with_a_centre_is_moved_and_turned_there(tmp_path):
    """A quarter turn about z carries the corner at x into y."""
    text = BLOCK + 'centre = [10, 0, 3]\nrotation = { axis = [0, 0, 1], angle = "90 deg" }\n'
    block = made(tmp_path, text)["wedge"]
    corners = np.array([[0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, 0, 1]]) - [-0.25, 0.25, 0.25] + [10, 0, 3]
    np.testing.assert_allclose(sorted(block.world_vertices().tolist()), sorted(corners.tolist()), atol=1e-12)


def test_every_generator_makes_its_blocks_under_its_name(tmp_path):
    blocks = made(tmp_path, BLOCK + COLUMN + ARCH + RUBBLE + WALL)
    groups = [b.group for b in blocks.values()]
    assert {g: groups.count(g) for g in groups} == {
        "wedge": 1,
        "column": 3,
        "arch": 11,
        "rubble": 5,
        "wall": 53 - 1,
    }
    assert blocks["arch-low"].fixed
    assert blocks["arch-high"].centre[0] > 2.0
    assert {b.density for b in blocks.values()} == {2000.0}


def test_a_part_of_a_generator_may_be_driven(tmp_path):
    """An abutment that is held gives way to the motion that a case prescribes."""
    text = ARCH + '[[motion]]\nblock = "arch-high"\nvelocity = [0.1, 0, 0]\n'
    block = made(tmp_path, text)["arch-high"]
    assert (block.driven, block.fixed) == (True, False)
    np.testing.assert_allclose(block.velocity, [0.1, 0, 0])


def test_gauges_find_blocks_groups_and_parts(tmp_path):
    case = load(write(tmp_path, BLOCK + 'group = "odd"\n' + COLUMN + ARCH)).case
    rows = rows_by_name(case, parts_of(case))
    assert rows["odd"].tolist() == rows["wedge"].tolist() == [0]
    assert rows["column"].tolist() == [1, 2, 3]
    assert rows["column-1"].tolist() == [2]
    assert rows["arch"].tolist() == list(range(4, 15))


@pytest.mark.parametrize(
    ("text", "wrong", "right", "message"),
    [
        (BLOCK, "", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n",
         "9: structure.block[0].size: missing; give size (edges of a box), vertices"),
        (BLOCK, "size = [1, 1, 1]", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
         "9: structure.block[0].centre: missing; centre of mass of the box"),
        (BLOCK, 'name = "wedge"\nsize = [1, 1, 1]', 'name = "wedge"',
         "12: structure.block[0].vertices: size is given as well"),
        (BLOCK, "diameter = 1", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
         "9: structure.block[0].centre: missing; centre of mass of the sphere"),
        (BLOCK, "diameter = 1\nfaces = 40", "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]",
         "12: structure.block[0].faces: 40"),
        (BLOCK, 'name = "wedge"\nfaces = 80', 'name = "wedge"',
         "11: structure.block[0].faces: is for a sphere (diameter)"),
        (BLOCK, "[1, 1, 0]]", "[0, 0, 1]]",
         "9: structure.block[0]: block 'wedge': its 4 vertices span no volume"),
        (BLOCK, "[0, 0, 1], [0.1, 0.1, 0.1]]", "[0, 0, 1]]",
         "9: structure.block[0]: block 'wedge': vertex 4 lies 0.1 m inside the convex hull"),
        (BLOCK, "[0, 1, 0]]", "[0, 1, 0], [0, 0, 1]]",
         "11: structure.block[0].vertices: 3 values where at least 4"),
        (COLUMN, "", "radius = 0.4\n", "9: structure.column[0]: 'column' needs either size"),
        (COLUMN, "radius = 0.4\nsize = [1, 1]", "radius = 0.4",
         "9: structure.column[0]: 'column' needs either size"),
        (COLUMN, "size = [1, 1]\ntop_radius = 1", "radius = 0.4",
         "14: structure.column[0].top_radius: is for round"),
        (COLUMN, "radius = 0.4\nsides = 2", "radius = 0.4",
         "14: structure.column[0].sides: 2 is out of range"),
        (ARCH, "span = 4\nrise = 2.5", "span = 4",
         "9: structure.arch[0]: arch 'arch': rise = 2.5 m of a span of 4.0 m"),
        (ARCH, "abutment = [0.1, 1]", "abutment = [1, 1]", "9: structure.arch[0]: arch 'arch': abutment"),
        (RUBBLE, "count = 500", "count = 5", "9: structure.rubble[0]: rubble 'rubble': only "),
        (RUBBLE, "diameter = [0.5, 0.3]", "diameter = [0.3, 0.5]",
         "9: structure.rubble[0]: rubble 'rubble': diameter"),
        (RUBBLE, 'count = 5\nshape = "rocks"', "count = 5",
         "13: structure.rubble[0].shape: 'rocks' is not known; one of"),
        (WALL, 'bond = "runing"', 'bond = "running"',
         "13: structure.wall[0].bond: 'runing' is not known; one of 'stack' or "
         "'running'; did you mean 'running'?"),
        (WALL + ARCH, 'span = 4\nname = "wall"', "span = 4",
         "17: structure.arch[0].name: 'wall' is taken by structure.wall[0]"),
        (COLUMN, "radius = 0.4\n[[structure.block]]\nname = \"column-1\"\nsize = [1, 1, 1]\ncentre = [0, 0, 9]",
         "radius = 0.4",
         "9: structure.column[0].name: a block of 'column' would be called 'column-1' as structure.block[0] is"),
        (ARCH + BLOCK, '[-1.9, 0, 5.5], [-2.4, 0, 5.5], [-2, 0.1, 5.5], [-2.1, 0, 6]',
         "[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]",
         "9: structure.arch[0]: 'arch' overlaps 'wedge'"),
        (ARCH, 'abutment = [1, 1]\n[[motion]]\nblock = "arch-hihg"\nvelocity = [1, 0, 0]',
         "abutment = [1, 1]",
         "17: motion[0].block: there is no block 'arch-hihg'; did you mean 'arch-high'?"),
        ('[[structure.file]]\npath = "house.stl"\n', "", "",
         "10: structure.file[0].path: "),
        ('[[structure.file]]\npath = ""\n', "", "", "10: structure.file[0].path: "),
    ],
)  # fmt: skip
def test_one_mistake_one_line(tmp_path, text, wrong, right, message):
    assert right in text
    changed = text.replace(right, wrong, 1) if right else text
    with pytest.raises(BadCase) as refusal:
        load(write(tmp_path, changed))
    (line,) = [line.replace(f"{tmp_path}/", "") for line in refusal.value.lines]
    assert line.startswith(f"case.toml:{message}")


def test_friction_by_pairs_of_materials_reaches_the_contact_law(tmp_path, monkeypatch):
    """Order does not matter; pairs that are not given have the friction of all."""
    from coupler.scene import build
    from yade_scripts.dynamics import structure

    seen = {}

    def keep(blocks, contact, joints, ground, planes, *_, **__):
        seen.update(contact=contact, planes=planes, materials={b.material for b in blocks})

    monkeypatch.setattr(structure, "Structure", keep)
    build.build_structure(load(write(tmp_path, PAIRS)).case)
    table = seen["contact"].friction_table(["block", "brick", "ground"])
    np.testing.assert_allclose(table, [[0.5, 0.9, 0.5], [0.9, 0.5, 0.3], [0.5, 0.3, 0.5]])
    assert seen["materials"] == {"block", "brick"}
    assert [plane.material for plane in seen["planes"]] == ["ground"]


def test_a_joint_has_the_same_defaults_in_a_case_and_in_a_script():
    """Two numbers for one default would give two answers to one scene."""
    from dataclasses import MISSING, fields

    from coupler.case.case import Joints
    from yade_scripts.joints.cohesion import JointParameters

    of_scripts = {f.name: f.default for f in fields(JointParameters) if f.default is not MISSING}
    assert of_scripts == {name: Joints.model_fields[name].default for name in of_scripts}


@pytest.mark.parametrize(
    "key", ["restitution", "friction", "shear_ratio", "tangential_restitution", "uplift_share"]
)
def test_a_contact_has_the_same_limits_in_a_case_and_in_the_law(key):
    """What the check of a case lets through must not be refused by the run that follows."""
    from pydantic import ValidationError

    from coupler.case.case import Contact
    from yade_scripts.contact.law import ContactError, ContactLaw

    def allowed(make, error):
        try:
            make()
        except error:
            return False
        return True

    more = {"uplift": "share"} if key == "uplift_share" else {}
    for value in (-0.1, 0.0, 0.5, 1.0, 1.1, 9.9, 10.0, 10.1):
        in_case = allowed(lambda value=value: Contact(**{key: value}, **more), ValidationError)
        in_law = allowed(lambda value=value: ContactLaw(**{key.removesuffix("_share"): value}), ContactError)
        assert in_case == in_law, (key, value)
