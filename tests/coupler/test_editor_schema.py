"""The schema for editors takes every case that the program takes, and finds slips, as an editor's own tool sees it."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from coupler.case.editor_schema import schema, write
from coupler.case.keys import keys
from coupler.program.provenance import ROOT

TAPLO = Path(sys.executable).parent / "taplo"


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    place = tmp_path_factory.mktemp("schema") / "case.schema.json"
    write(place)
    return place


def lint(place, *cases):
    command = [TAPLO, "lint", "--no-auto-config", "--schema", place.as_uri(), *cases]
    return subprocess.run(command, capture_output=True, text=True, check=False)


def test_every_case_that_comes_along_passes(place):
    done = lint(place, *sorted(ROOT.glob("cases/*/case.toml")))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        (("[tank]", "[tanc]"), "tanc"),
        (("cell = ", "cel = "), "cel"),
        (('cell = "0.2 m"', "cell = -1"), "-1"),
        (('cell = "0.2 m"', 'cell = "wide"'), "wide"),
        (('kind = "level"', 'kind = "depth"'), "depth"),
    ],
)
def test_slips_are_found(place, tmp_path, change, reported):
    from coupler.case.first_cases import text_of

    assert change[0] in text_of("tank")
    (tmp_path / "case.toml").write_text(text_of("tank").replace(*change), encoding="utf-8")
    done = lint(place, tmp_path / "case.toml")
    assert done.returncode != 0
    assert reported in done.stderr


def test_every_name_has_its_meaning_and_every_quantity_its_unit():
    """What an editor shows when the pointer rests on a name."""
    text = json.dumps(schema(), ensure_ascii=False)
    for key in keys():
        assert json.dumps(key.description, ensure_ascii=False) in text
    assert "a number in Pa, or text with a unit" in text
    assert '"null"' not in text
