"""Every case of the checkout runs to its end as it is written, keeps what its expected.toml promises and gives the
figures that its README states."""

import json

import pytest

from coupler.checks.read_case import load
from coupler.program.errors import ExitCode
from coupler.results.stated import stated
from coupler.run.directory import RunDirectory
from coupler.run.execute import execute_case
from tests.coupler.test_cases import CASES

LONG = {
    "beam_bent", "bore_on_pier", "dam_break_box", "dam_break_building", "floating_box", "house_from_file",
    "house_lifted", "lobovsky_wall", "rubble_drop", "tsunami_town",
}  # fmt: skip
"""More than a dozen processor seconds each."""


def marked(place):
    marks = [pytest.mark.nightly] if place.name in LONG else []
    return pytest.param(place, id=place.name, marks=marks)


@pytest.mark.parametrize("place", [marked(place) for place in CASES])
def test_a_case_keeps_what_it_promises(place, tmp_path):
    file = load(place)
    directory = RunDirectory.create(file, tmp_path / "run")
    assert execute_case(file, directory) == ExitCode.DONE
    kept = json.loads((directory.path / "run.json").read_text(encoding="utf-8"))["figures"]["expected"]
    assert kept
    assert [what for what, found in kept.items() if not found] == []
    drifted = [
        (figure.text, figure.stated, figure.now)
        for figure in stated(place, directory.path)
        if not figure.kept
    ]
    assert drifted == [], "renew them: python -m coupler.commands.case_pages --write CASE"


def test_long_cases_are_cases():
    assert {place.name for place in CASES} > LONG
