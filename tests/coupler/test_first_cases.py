"""First cases of `init`: each is a case without a mistake; words that people use are understood."""

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from coupler.case.docs import WORDS, explanation, keys
from coupler.case.first_cases import FIRST_CASES, CannotBegin, text_of, write_first_case
from coupler.checks.read_case import load
from coupler.commands.cli import app
from coupler.program.errors import UnknownName
from coupler.program.provenance import ROOT
from tests.coupler.test_cli import surgebreak


@pytest.mark.parametrize("name", FIRST_CASES)
def test_every_first_case_is_a_case(tmp_path, name):
    write_first_case(tmp_path / name, name)
    case = load(tmp_path / name).case
    assert case.time.end > 0.0
    assert len(FIRST_CASES[name].questions) <= 6


def test_the_start_page_shows_the_case_that_init_writes(tmp_path):
    written = write_first_case(tmp_path).read_text(encoding="utf-8")
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    shown = page.split("```toml\n")[1].split("```")[0]
    assert shown == written
    for wrong in ("cell =", "density ="):
        line = next(i for i, text in enumerate(written.splitlines(), 1) if text.startswith(wrong))
        assert f"first/case.toml:{line}: " in page


def test_the_start_page_shows_what_check_and_run_report(tmp_path):
    """Who follows the page compares these lines with his own."""
    write_first_case(tmp_path / "first")
    page = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    for command in ("check", "run"):
        told = {line.strip() for line in surgebreak(command, tmp_path / "first").stdout.splitlines()}
        shown = page.split(f"**`{command}` reports**")[1].split("```text\n")[1].split("```")[0]
        for line in shown.replace("\n  ", " ").splitlines():
            if not line.startswith("memory"):  # that of the process so far and what is computed
                assert line in told


def test_answers_stand_in_the_case_with_their_units(tmp_path):
    said = {"Height of the wall": "250 cm", "Tensile strength": "1 MPa", "Thickness": "0.5"}

    def ask(question, usual):
        return next((answer for start, answer in said.items() if question.startswith(start)), "")

    write_first_case(tmp_path, "wall", ask)
    case = load(tmp_path).case
    (wall,) = case.structure.wall
    assert (wall.size[2], wall.size[0], case.joints.strength) == (2.5, 0.5, 1e6)
    assert case.water.fill[0].upper[2] == 3.0


def test_an_answer_of_the_wrong_kind_is_asked_again():
    heard = []

    def ask(question, usual):
        heard.append(question)
        return "3 kg" if len(heard) == 1 else usual

    text_of("wall", ask)
    assert "3 kg" in heard[1]
    assert len(heard) == 7


def test_an_unknown_first_case_names_those_that_there_are(tmp_path):
    with pytest.raises(CannotBegin, match=r"hous: there is none; did you mean 'house'\?.*quay: containers"):
        write_first_case(tmp_path, "hous")


def test_the_wizard_on_the_command_line(tmp_path):
    done = CliRunner().invoke(
        app, ["init", str(tmp_path / "q"), "--template", "quay", "--ask"], input="2 m\n\n\n\n\n"
    )
    assert done.exit_code == 0, done.output
    assert load(tmp_path / "q").case.water.fill[0].upper[2] == 5.0


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("wave", "water.inflow"),
        ("tsunami", "water.sea"),
        ("glue", "joints"),
        ("houses", "structure.building"),
    ],
)
def test_words_that_people_use_are_understood(word, name):
    assert f"[{name}]" in explanation(word) or f"\n{name} " in explanation(word)


def test_a_word_leads_to_the_first_cases_that_have_it():
    """Who asks for a quay wants to begin with one; and a name of several kinds is explained for each of them."""
    templates = {"quay": "quay, harbour", "Containers": "quay", "tsunami": "harbour", "glue": ""}
    for word, names in templates.items():
        found = re.findall(r"init DIR --template (\w+): ", explanation(word))
        assert ", ".join(found) == names
    of_a_record = "2 (sqrt(g h) - sqrt(g d))"
    assert of_a_record in explanation("tide gauge")


def test_words_lead_to_names_that_there_are():
    known = {key.path for key in keys()}
    assert {path for paths in WORDS.values() for path in paths} - known == set()


def test_nonsense_is_still_an_unknown_name():
    with pytest.raises(UnknownName, match=r"joint\.strenth: no such name"):
        explanation("joint.strenth")


def test_a_case_is_drawn_before_it_is_run(tmp_path):
    """Containers, quay and water of the first case of a quay: the picture has the colours of all of them."""
    pytest.importorskip("PIL")
    from PIL import Image

    from coupler.commands.blocks.command import draw_case

    write_first_case(tmp_path, "quay")
    draw_case(load(tmp_path).case, tmp_path / "quay.png")
    picture = Image.open(tmp_path / "quay.png")
    pixels = np.asarray(picture.convert("RGB")).reshape(-1, 3)
    assert len(np.unique(pixels, axis=0)) > 20


def test_a_case_over_terrain_is_drawn_with_its_ground_and_the_water_above_it(tmp_path):
    from coupler.commands.blocks.command import _bed_triangles, _surface_over

    case = load(write_first_case(tmp_path / "town", "town")).case
    bed = _bed_triangles(case)
    assert np.ptp(bed[:, :, 0]) == pytest.approx(60.0)
    assert (bed[:, :, 2].min(), bed[:, :, 2].max()) == pytest.approx((-2.5, 2.5), abs=0.1)
    sea, column = (_surface_over(bed, fill) for fill in case.water.fill)
    assert 20.0 < sea[:, :, 0].max() < 40.0, "the sea ends at the beach"
    assert column[:, :, 2].max() == 5.0
