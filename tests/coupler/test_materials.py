"""Presets of materials: what they bring, what overrides them, and where their numbers come from."""

import pytest

from coupler.case.docs import explanation
from coupler.case.materials import PRESETS
from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.program.errors import BadCase

CASE = """
[case]
title = "presets"
[time]
end = "1 s"
[structure]
density = 1000
[[structure.wall]]
name = "w"
lower = [0, 0, 0]
size = [4, 0.5, 2]
block = [1, 0.5, 1]
material = "brick-masonry"
[[structure.wall]]
name = "own"
lower = [0, 5, 0]
size = [4, 0.5, 2]
block = [1, 0.5, 1]
material = "concrete"
density = 2500
[structure.ground]
[contact]
friction = 0.3
[[contact.pair]]
materials = ["concrete", "ground"]
friction = 0.9
[joints]
strength = "1 kPa"
opening_at_failure = "1 mm"
[[joints.pair]]
between = ["brick-masonry", "brick-masonry"]
strength = "50 kPa"
"""


def test_a_preset_counts_less_than_what_the_case_says_and_more_than_what_it_says_of_all(tmp_path):
    from coupler.scene.build import build_structure

    (tmp_path / "case.toml").write_text(CASE)
    case = load(tmp_path).case
    with build_structure(case) as s:
        by_name = dict(zip(s.names, s.blocks))
        assert by_name["w-0-0-0"].density == 1800.0
        assert by_name["own-0-0-0"].density == 2500.0
        table = s.joints
        strength = {}
        for a, b, law in zip(table.a, table.b, table.laws):
            strength.setdefault((s.names[a].split("-")[0], "ground" if b < 0 else "wall"), set()).add(
                law.strength
            )
    assert strength["w", "wall"] == {50e3}, "the case's own pair"
    assert strength["w", "ground"] == {0.28e6}
    assert strength["own", "wall"] == {2.2e6}
    friction = {frozenset(p.materials): p.friction for p in case.contact.pair}
    assert friction[frozenset({"concrete", "ground"})] == 0.9
    assert friction[frozenset({"brick-masonry", "ground"})] == 0.8


TANK = "\n[tank]\nlower = [-1, -1, 0]\nupper = [6, 7, 3]\ncell = 0.5\n"


@pytest.mark.parametrize(
    ("ground", "rest", "below"),
    [
        ("[structure.ground]\n", TANK, "tank"),
        ("[structure.ground]\n", '[structure.ground]\nmaterial = "rock"\n', "rock"),
    ],
    ids=["floor of the tank", "a ground of another name"],
)
def test_presets_rub_on_what_they_stand_on_whatever_its_name(tmp_path, ground, rest, below):
    """A wall of bricks slid at contact.friction, 0.3, on the floor of its tank, and at 0.8 on a ground of the same."""
    (tmp_path / "case.toml").write_text(
        CASE.replace(ground, rest).replace('["concrete", "ground"]', '["concrete", "concrete"]')
    )
    friction = {frozenset(p.materials): p.friction for p in load(tmp_path).case.contact.pair}
    assert friction[frozenset({"brick-masonry", below})] == 0.8


def test_explain_knows_a_preset_by_a_word_of_its_name():
    assert explanation("Masonry") == explanation("brick") == explanation("brick-masonry")
    assert explanation("masonry").startswith('material = "brick-masonry"')


@pytest.mark.parametrize("name", PRESETS)
def test_explain_gives_numbers_and_sources(name):
    text = explanation(name)
    assert f"{PRESETS[name].density:g} kg/m3" in text
    assert PRESETS[name].source in text
    assert PRESETS[name].strength * PRESETS[name].opening * 9 / 16 == pytest.approx(PRESETS[name].energy)


QUAY = """
[case]
title = "a wall on a quay of presets alone"
[time]
end = "1 s"
[[solid]]
name = "quay"
centre = [2, 0.25, -0.5]
size = [4, 0.5, 1]
[structure]
[[structure.wall]]
name = "w"
lower = [0, 0, 0]
size = [4, 0.5, 2]
block = [1, 0.5, 1]
material = "brick-masonry"
[[structure.block]]
name = "lintel"
size = [4, 0.5, 0.5]
centre = [2, 0.25, 2.25]
material = "concrete"
[[structure.block]]
name = "held"
size = [1, 0.5, 1]
centre = [4.5, 0.25, 0.5]
fixed = true
[contact]
[joints]
"""


def test_presets_alone_are_enough_and_reach_solids_held_blocks_and_the_weaker_of_two(tmp_path):
    from coupler.scene.build import build_structure

    (tmp_path / "case.toml").write_text(QUAY)
    case = load(tmp_path).case
    brick, concrete = PRESETS["brick-masonry"], PRESETS["concrete"]
    with build_structure(case) as s:
        found = {}
        for a, b, law in zip(s.joints.a, s.joints.b, s.joints.laws):
            pair = frozenset(s.names[row].split("-")[0] for row in (a, b))
            found.setdefault(pair, set()).add((law.strength, law.opening_at_failure))
    weak = {(brick.strength, brick.opening)}
    assert found == {
        frozenset({"w"}): weak,
        frozenset({"w", "quay"}): weak,
        frozenset({"w", "held"}): weak,
        frozenset({"w", "lintel"}): weak,
    }
    friction = {frozenset(p.materials): p.friction for p in case.contact.pair}
    assert friction[frozenset({"brick-masonry", "solid"})] == brick.friction
    assert friction[frozenset({"brick-masonry", "concrete"})] == min(brick.friction, concrete.friction)
    assert remarks(case) == []


def test_a_strength_is_asked_for_where_a_material_has_none(tmp_path):
    (tmp_path / "case.toml").write_text(QUAY.replace('"brick-masonry"', '"brick-masonery"'))
    with pytest.raises(BadCase) as refused:
        load(tmp_path)
    strength, opening = str(refused.value).splitlines()
    assert "joints.strength: missing" in strength
    assert "'brick-masonery' has no preset" in strength
    assert "did you mean 'brick-masonry'?" in strength
    assert "joints.opening_at_failure: missing" in opening


def test_a_material_whose_joints_are_left_out_needs_no_strength(tmp_path):
    """Loose crates beside a masonry house: with no joint of theirs there is nothing that [joints] could say. What is
    still missing is named by the two that may touch."""
    crates = (
        '[[structure.block]]\nname = "crate"\nsize = [1, 1, 1]\ncentre = [2, 2, 0.5]\nmaterial = "cargo"\n'
    )
    loose = '\n[[joints.pair]]\nbetween = ["cargo", "{}"]\njoined = false\n'
    text = QUAY.replace("[contact]", f"{crates}[contact]", 1)

    def load_with(*others):
        (tmp_path / "case.toml").write_text(text + "".join(loose.format(name) for name in others))
        return load(tmp_path).case

    with pytest.raises(BadCase, match=r'between = \["cargo", "cargo"\]'):
        load_with("brick-masonry", "concrete", "solid", "held")
    case = load_with("brick-masonry", "concrete", "solid", "held", "cargo")
    assert case.joints.strength == PRESETS["brick-masonry"].strength


def test_a_solid_has_the_density_of_its_material_and_not_that_of_the_blocks(tmp_path):
    """Its density counts for its weight among the loads alone; a quay under crates of 350 kg/m3 weighed as they do."""
    from coupler.geometry.solids import obstacle_blocks

    def density(*overrides):
        (tmp_path / "case.toml").write_text(QUAY.replace("[structure]", "[structure]\ndensity = 350", 1))
        (quay,) = obstacle_blocks(load(tmp_path, overrides).case)
        return quay.density

    assert density() == 2400.0
    assert density("solid[0].material='timber'") == PRESETS["timber"].density
    assert density("solid[0].material='timber'", "solid[0].density=500") == 500.0


def test_a_name_near_a_preset_and_a_strength_that_counts_nowhere_are_told(tmp_path):
    with_strength = QUAY + 'strength = "1 MPa"\nopening_at_failure = "1 mm"\n'
    (tmp_path / "case.toml").write_text(with_strength.replace('"brick-masonry"', '"brick-masonery"'))
    found = remarks(load(tmp_path).case)
    assert any("'brick-masonery' is no preset; did you mean 'brick-masonry'?" in line for line in found)
    (tmp_path / "case.toml").write_text(with_strength)
    assert any("joints.strength counts nowhere" in line for line in remarks(load(tmp_path).case))


def test_a_friction_that_presets_replace_is_told_where_it_does_not_apply(tmp_path):
    """Else a sweep over contact.friction makes the same run again and again, and nobody learns why."""

    def told(friction, pair=""):
        text = QUAY.replace("[contact]", f"[contact]\n{friction}\n{pair}")
        (tmp_path / "case.toml").write_text(text)
        return [line for line in remarks(load(tmp_path).case) if line.startswith("contact.friction")]

    brick = PRESETS["brick-masonry"].friction
    (line,) = told("friction = 0.2")
    assert line.startswith("contact.friction = 0.2 does not apply")
    assert f"{brick:g} between brick-masonry and brick-masonry" in line
    assert "[[contact.pair]] materials = [" in line
    assert not told("")
    assert f"{brick:g} between" not in "".join(told(f"friction = {brick}"))
    own = '[[contact.pair]]\nmaterials = ["brick-masonry", "brick-masonry"]\nfriction = 0.3\n'
    (line,) = told("friction = 0.2", own)
    assert "brick-masonry and brick-masonry" not in line


def test_a_friction_that_counts_for_other_materials_is_not_remarked_on(tmp_path):
    """It is what stones meet one another and the timber with, though not the bricks."""
    text = QUAY.replace('material = "concrete"', 'material = "stone"').replace(
        "[contact]", "[contact]\nfriction = 0.2"
    )
    text = text.replace("[joints]", '[joints]\nstrength = "1 MPa"\nopening_at_failure = "1 mm"')
    (tmp_path / "case.toml").write_text(text)
    assert not [line for line in remarks(load(tmp_path).case) if line.startswith("contact.friction")]


def test_blocks_that_are_not_to_be_glued_to_the_ground_are_not_by_a_preset_either(tmp_path):
    (tmp_path / "case.toml").write_text(CASE.replace("[joints]", "[joints]\nground = false"))
    assert all("ground" not in pair.between for pair in load(tmp_path).case.joints.pair)


def test_a_layer_of_a_drawing_has_the_density_of_its_preset():
    from coupler.case.case import Case
    from coupler.case.materials import with_presets

    drawing = {"path": "a.obj", "size": 1, "layer": [{"name": "roof", "material": "timber"}]}
    case = {"case": {"title": "x"}, "time": {"end": 1}, "structure": {"drawing": [drawing]}}
    layer = with_presets(Case.model_validate(case)).structure.drawing[0].layer[0]
    assert layer.density == PRESETS["timber"].density
