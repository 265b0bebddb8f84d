"""Presets of materials: what they bring, what overrides them, and where their numbers come from."""

import pytest

from coupler.case.docs import explanation
from coupler.case.materials import PRESETS
from coupler.checks.read_case import load

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
    assert strength["w", "ground"] == {0.25e6}
    assert strength["own", "wall"] == {2.2e6}
    friction = {frozenset(p.materials): p.friction for p in case.contact.pair}
    assert friction[frozenset({"concrete", "ground"})] == 0.9
    assert friction[frozenset({"brick-masonry", "ground"})] == 0.75


@pytest.mark.parametrize("name", PRESETS)
def test_explain_gives_numbers_and_sources(name):
    text = explanation(name)
    assert f"{PRESETS[name].density:g} kg/m3" in text
    assert PRESETS[name].source in text
    assert PRESETS[name].strength * PRESETS[name].opening * 9 / 16 == pytest.approx(PRESETS[name].energy)
