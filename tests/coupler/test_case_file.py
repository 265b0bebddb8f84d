"""Bad cases end with `path/case.toml:LINE: section.key: what; remedy`, all mistakes at once; good ones load in SI."""

import pytest

from coupler.case.case import Case, effective, modules
from coupler.checks.read_case import load
from coupler.program.errors import BadCase

WATER = """\
[case]
title = "water in a tank"
[time]
end = "2 s"
[tank]
lower = [0, 0, 0]
upper = [4, 2, 2]
cell = "20 cm"
[water]
density = 1000
[[water.fill]]
lower = [0, 0, 0]
upper = [1, 2, 1]
"""
BLOCKS = """\
[structure]
[[structure.block]]
name = "a"
size = [1, 1, 1]
centre = [2, 1, 0.5]
[contact]
stiffness = "1 MN/m"
"""


def write(folder, text):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


def mistakes(folder, text, *overrides):
    """The lines of the refusal, without the directory."""
    with pytest.raises(BadCase) as refusal:
        load(write(folder, text), overrides)
    return [line.replace(f"{folder}/", "") for line in refusal.value.lines]


def test_a_good_case_is_in_si(tmp_path):
    case = load(write(tmp_path, WATER)).case
    assert (case.time.end, case.tank.cell, case.water.fill[0].upper) == (2.0, 0.2, (1.0, 2.0, 1.0))


def test_a_case_that_windows_wrote_is_the_same(tmp_path):
    """Its editors begin UTF-8 with a byte order mark and end lines with two characters."""
    (tmp_path / "case.toml").write_bytes(WATER.replace("\n", "\r\n").encode("utf-8-sig"))
    assert effective(load(tmp_path).case) == effective(load(write(tmp_path, WATER)).case)


def test_the_effective_case_is_complete_and_reads_back_as_the_same_case(tmp_path):
    """What is stored with the results must be enough to run them again: every default written out, nothing lost."""
    case = load(write(tmp_path, WATER + BLOCKS)).case
    reported = effective(case)
    assert reported["contact"]["friction"] == case.contact.friction
    assert Case.model_validate(reported) == case


def test_absent_sections_switch_modules_off(tmp_path):
    on = modules(load(write(tmp_path, WATER)).case)
    assert on["water"]
    assert not on["structure"]
    assert not on["coupling"]
    assert modules(load(write(tmp_path, WATER + BLOCKS)).case)["coupling"]


@pytest.mark.parametrize(
    ("wrong", "right", "message"),
    [
        # misspelt and misplaced names
        (
            "densty = 1000",
            "density = 1000",
            "case.toml:10: water.densty: unknown name; did you mean 'density'?",
        ),
        (
            "friction = 1",
            "density = 1000",
            "case.toml:10: water.friction: unknown name here; did you mean 'contact.friction'? Known here: density,",
        ),
        ("[watr]\nx = 1\n[water]", "[water]", "case.toml:9: watr: unknown name; did you mean 'water'?"),
        # missing
        (
            "",
            'end = "2 s"',
            "case.toml:3: time.end: missing; the run ends at this time [s], for instance end = ",
        ),
        ("", '[time]\nend = "2 s"', "case.toml: time: missing; write a section [time]"),
        # units and ranges
        ('end = "2 m"', 'end = "2 s"', "case.toml:4: time.end: '2 m' is a length, needs a time [s]"),
        ('end = "2"', 'end = "2 s"', "case.toml:4: time.end: '2' has no unit; write a time as a number in s"),
        (
            "density = -3",
            "density = 1000",
            "case.toml:10: water.density: -3 is out of range; must be greater than 0 k",
        ),
        ("density = inf", "density = 1000", "case.toml:10: water.density: inf is not a finite number"),
        ("density = nan", "density = 1000", "case.toml:10: water.density:"),
        (
            "theta = 0.4",
            "density = 1000",
            "case.toml:10: water.theta: 0.4 is out of range; must be at least 0.5",
        ),
        # shapes
        (
            "lower = [0, 0]",
            "lower = [0, 0, 0]",
            "case.toml:6: tank.lower: too few values (2); corner with the",
        ),
        ("lower = [0, 0, 0, 0]", "lower = [0, 0, 0]", "case.toml:6: tank.lower: 4 values where 3 belong"),
        ("lower = 3", "lower = [0, 0, 0]", "case.toml:6: tank.lower: 3 is not a list of numbers"),
        (
            "[water.fill]",
            "[[water.fill]]",
            "case.toml:11: water.fill: write [[water.fill]] with double brackets",
        ),
        (
            'covers = "doubel"',
            "density = 1000",
            "case.toml:10: water.covers: 'doubel' is not known; one of 'single'",
        ),
        (
            "title = 3",
            'title = "water in a tank"',
            "case.toml:2: case.title: 3 is not a text; put it in quotes",
        ),
        # no water, and water that does not fit
        (
            "",
            "[[water.fill]]\nlower = [0, 0, 0]\nupper = [1, 2, 1]\n",
            "case.toml:9: water: no water: write at least",
        ),
        (
            "upper = [1, 2, 3]",
            "upper = [1, 2, 1]",
            "case.toml:11: water.fill[0]: water fill 0 reaches 1 m beyond the ",
        ),
        (
            "upper = [0, 2, 1]",
            "upper = [1, 2, 1]",
            "case.toml:13: water.fill[0].upper: x: upper (0 m) must be greater",
        ),
        ('cell = "3 m"', 'cell = "20 cm"', "case.toml:8: tank.cell: 3 m is larger than the smallest side"),
    ],
)
def test_one_mistake_one_line(tmp_path, wrong, right, message):
    assert right in WATER
    lines = mistakes(tmp_path, WATER.replace(right, wrong, 1))
    assert len(lines) == 1
    assert lines[0].startswith(message)


def test_all_mistakes_are_reported_at_once_in_the_order_of_the_file(tmp_path):
    """An unknown name does not hide the geometry behind it."""
    text = WATER.replace("density", "densty") + BLOCKS.replace("centre = [2, 1, 0.5]", "centre = [2, 1, 0.3]")
    lines = mistakes(tmp_path, text)
    assert [line.split(": ")[0] for line in lines] == ["case.toml:10", "case.toml:15"]
    assert "'a' reaches 0.2 m beyond the side z- of the tank" in lines[1]


def test_water_needs_a_tank(tmp_path):
    text = WATER.replace('[tank]\nlower = [0, 0, 0]\nupper = [4, 2, 2]\ncell = "20 cm"\n', "")
    assert mistakes(tmp_path, text)[0].startswith("case.toml:5: water: the water needs a section [tank]")


def test_blocks_need_contact(tmp_path):
    (line,) = mistakes(tmp_path, WATER + BLOCKS.replace('[contact]\nstiffness = "1 MN/m"\n', ""))
    assert line.startswith("case.toml:14: structure: blocks need [joints], which hold them together")


def test_an_empty_case_says_what_to_write(tmp_path):
    (line,) = mistakes(tmp_path, '[case]\ntitle = "x"\n[time]\nend = 1\n')
    assert line == "case.toml: nothing to compute: write a section [water] or [structure], or both"


# ---------------------------------------------------------------- overrides


def test_overrides_change_values_like_the_file(tmp_path):
    folder = write(tmp_path, WATER + BLOCKS)
    case = load(
        folder, ["time.end=3 s", "water.density=1025", "structure.block[0].density=600", "water.theta=0.7"]
    ).case
    assert (case.time.end, case.water.density, case.water.theta) == (3.0, 1025.0, 0.7)
    assert case.structure.block[0].density == 600.0


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("time.end=3 m", "--set time.end=3 m: time.end: '3 m' is a length, needs a time [s]"),
        ("time.ende=3", "--set time.ende=3: time.ende: unknown name; did you mean 'end'?"),
        (
            "water.density=-1",
            "--set water.density=-1: water.density: -1 is out of range; must be greater than 0 kg/m3",
        ),
        ("time.end", "--set time.end: write KEY=VALUE"),
        (
            "structure.block[4].density=1",
            "--set structure.block[4].density=1: there is no item [4]; the list has 1",
        ),
        (
            "structure.block.density=1",
            "--set structure.block.density=1: 'density' is inside a list; say which item",
        ),
        ("time.end.x=1", "--set time.end.x=1: 'x' is below a value"),
        (
            "tank.open=[z-]",
            "--set tank.open=[z-]: tank.open: '[z-]' is not a list, in which names and numbers with units need quotes; "
            """write ["z-"], on the command line --set 'tank.open=["z-"]'; each is one of x-, x+, y-, y+, z-, z+""",
        ),
        (
            "tank.open=z-, x+",
            "--set tank.open=z-, x+: tank.open: 'z-, x+' is not a list, in which names and numbers with units need "
            """quotes; write ["z-", "x+"], on the command line --set 'tank.open=["z-", "x+"]'; each is one of x-""",
        ),
        (
            "water.fill[0].upper=[1 m, 2, 50 cm]",
            "--set water.fill[0].upper=[1 m, 2, 50 cm]: water.fill[0].upper: '[1 m, 2, 50 cm]' is not a list, in which "
            """names and numbers with units need quotes; write ["1 m", 2, "50 cm"], on the command line """
            """--set 'water.fill[0].upper=["1 m", 2, "50 cm"]'; corner with the largest coordinates [m]""",
        ),
        ("tank.upper=3 m", "--set tank.upper=3 m: tank.upper: '3 m' is not a list of numbers; "),
    ],
)
def test_a_bad_override_is_reported_with_its_place(tmp_path, override, message):
    (line,) = mistakes(tmp_path, WATER + BLOCKS, override)
    assert line.startswith(message)


# ---------------------------------------------------------------- files


def test_no_such_case_names_the_nearest(tmp_path):
    (tmp_path / "dam_break").mkdir()
    with pytest.raises(BadCase, match=r"no such case; did you mean '.*dam_break'\?"):
        load(tmp_path / "dam_braek")


def test_a_directory_without_a_case_says_how_to_get_one(tmp_path):
    with pytest.raises(BadCase, match=r"no case.toml in this directory; `surgebreak init"):
        load(tmp_path)


def test_what_is_no_toml_is_reported_with_its_line(tmp_path):
    assert mistakes(tmp_path, WATER.replace("cell = ", "cell "))[0].startswith(
        "case.toml:8: not valid TOML: "
    )


def test_what_is_no_text_is_reported(tmp_path):
    (tmp_path / "case.toml").write_bytes(b"title = '\xff'")
    with pytest.raises(BadCase, match="not a text in UTF-8"):
        load(tmp_path)
