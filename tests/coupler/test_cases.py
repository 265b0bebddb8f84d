"""The cases of the checkout: each passes its checks, says what it is, and promises numbers with a source."""

import tomllib

import pytest

from coupler.checks.read_case import load
from coupler.checks.remarks import remarks
from coupler.program.provenance import ROOT
from coupler.results.expected import TAKE
from coupler.run.forecast import forecast
from coupler.scene.build import build_structure

CASES = sorted(path.parent for path in (ROOT / "cases").glob("*/case.toml"))


DRAFTS = {
    "tsunami_town": [
        "thinner than a cell",
        "under 3 cells water is not resolved",
        "under 3 cells its load there is too small",
    ]
}
"""Cases that are coarser than their remarks want, and say so in their README: what they may be remarked for."""


@pytest.mark.parametrize("place", CASES, ids=lambda place: place.name)
def test_a_case_of_the_checkout(place):
    allowed = DRAFTS.get(place.name, [])
    found = remarks(load(place).case)
    assert len(found) == len(allowed)
    assert all(part in remark for part, remark in zip(allowed, found))
    readme = (place / "README.md").read_text(encoding="utf-8")
    for heading in ("Physics", "Source", "Cost", "Picture", "Numbers to expect"):
        assert f"**{heading}" in readme
    for entry in tomllib.loads((place / "expected.toml").read_text(encoding="utf-8"))["expect"]:
        assert {"what", "table", "column", "take", "source"} <= set(entry)
        assert entry["take"] in TAKE
        assert "value" in entry or "at_least" in entry or "at_most" in entry


def test_the_strong_building_differs_in_its_joints_alone():
    weak = load(ROOT / "cases" / "dam_break_building").case
    strong = load(ROOT / "cases" / "dam_break_building", ["joints.strength='3 MPa'"]).case
    assert strong.joints.strength == 20 * weak.joints.strength
    assert strong.model_copy(update={"joints": weak.joints}) == weak


DRY = [place for place in CASES if "\n[tank]" not in (place / "case.toml").read_text(encoding="utf-8")]


@pytest.mark.parametrize("place", DRY, ids=lambda place: place.name)
def test_a_dry_case_starts_and_keeps_its_energy(place):
    """Blocks as they touch in real scenes: flush faces, voussoirs, stones in the air."""
    with build_structure(load(place).case) as s:
        start = s.energies()
        s.advance(5e-3)
        end = s.energies()
    works = ("load_work", "driving_work")
    gained = sum(end[k] - start[k] for k in end if k not in works) - sum(end[k] for k in works)
    assert abs(gained) < 1e-3 * (
        sum(abs(end[k]) for k in works) + abs(end["kinetic"]) + abs(end["contact_stored"])
    )


def test_the_exact_frequency_of_the_joints_is_reported_on_request():
    """The bound that sets the substep lies between it and √2 of it."""
    case = load(ROOT / "cases" / "bonded_wall_pulled").case
    name = "frequency of the joints, exact"
    assert name not in [row.name for row in forecast(case).rows]
    row = next(row for row in forecast(case, exact=True).rows if row.name == name)
    with build_structure(case) as s:
        assert row.value <= s.substep_limit().omega * (1.0 + 1e-12)
        assert s.substep_limit().omega <= 2.0**0.5 * row.value * (1.0 + 1e-12)
