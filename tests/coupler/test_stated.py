"""Figures that the README of a case states, against a run: how they are found, compared and renewed."""

import shutil

import pytest

from coupler.case.promises import mistakes_in
from coupler.commands.case_pages import compare
from coupler.program.errors import BadCase
from coupler.program.provenance import ROOT
from coupler.results.stated import places, renew, stated
from tests.coupler.test_cases import CASES
from tests.coupler.test_expected import write_history

README = """The largest is 4.1 m, at the end
2.00 km.

| x | 3.99, 0.5 |
"""
ENTRY = '[[stated]]\ntext = "{}"\ntable = "history/a.csv"\ncolumn = "x"\ntake = "largest"\n'


def against_a_run(folder, *entries):
    write_history(folder)
    (folder / "README.md").write_text(README, encoding="utf-8")
    (folder / "expected.toml").write_text("".join(entries), encoding="utf-8")
    assert mistakes_in(folder) == []
    return stated(folder, folder)


@pytest.mark.parametrize(
    ("text", "more", "figure", "now", "kept"),
    [
        ("largest is {} m", "", "4.1", 4.0, True),  # one unit of the last digit
        ("largest is {} m", "tolerance = 0.05", "4.1", 4.0, False),
        ("at the end {} km", "scale = 0.5", "2.00", 2.0, True),  # over the end of a line
        ("at the end {} km", "scale = 0.51", "2.00", 2.04, False),
        ("| x | {},", "", "3.99", 4.0, True),
        ("| x | {...}, {} |", "scale = 0.125", "0.5", 0.5, True),
        ("largest is {} m", 'from = 0.5\nto = 1.5\ntake = "mean"', "4.1", 2.125, False),
    ],
)
def test_a_figure_is_found_and_compared(tmp_path, text, more, figure, now, kept):
    entry = ENTRY.replace("{}", text)
    entry = entry.replace('take = "largest"\n', "") if "take" in more else entry
    (found,) = against_a_run(tmp_path, entry + more)
    assert (found.stated, found.kept) == (figure, kept)
    assert found.now == pytest.approx(now, rel=1e-12)


def test_only_figures_beyond_their_tolerance_are_renewed(tmp_path):
    entries = [
        ENTRY.replace("{}", "largest is {} m") + "scale = 10\n",
        ENTRY.replace("{}", "end {} km") + "scale = 0.51\n",
        ENTRY.replace("{}", "| {},"),
    ]
    entries[2] = entries[2].replace("| {}", "| x | {}")
    found = against_a_run(tmp_path, *entries)
    assert renew(README, found) == README.replace("4.1 m", "40.0 m").replace("2.00", "2.04")


def test_a_figure_without_a_value_is_not_kept_and_stays(tmp_path):
    (found,) = against_a_run(tmp_path, ENTRY.replace("{}", "largest is {} m").replace('"x"', '"y"'))
    assert not found.kept
    assert found.reason == "history/a.csv has no column 'y'"
    assert renew(README, [found]) == README


@pytest.mark.parametrize(("text", "times"), [("smallest is {} m", 0), ("{} m", 1), ("{}", 4)])
def test_a_text_must_be_in_the_readme_once(tmp_path, text, times):
    if times == 1:
        assert len(against_a_run(tmp_path, ENTRY.replace("{}", text))) == 1
        return
    with pytest.raises(BadCase, match=rf"stated\[0\].text: README.md has .* {times} times"):
        against_a_run(tmp_path, ENTRY.replace("{}", text))


@pytest.mark.parametrize("text", ["4.1 m", "{} m to {} m"])
def test_a_text_marks_one_figure(tmp_path, text):
    (tmp_path / "expected.toml").write_text(ENTRY.replace("{}", text), encoding="utf-8")
    (line,) = mistakes_in(tmp_path)
    assert line.endswith("expected.toml:1: stated[0]: text must mark the place of the figure once, as {}")


@pytest.mark.parametrize("place", CASES, ids=lambda place: place.name)
def test_the_pages_of_the_checkout_have_their_figures(place):
    places(place, (place / "README.md").read_text(encoding="utf-8"))


def test_a_page_is_compared_with_a_run_of_its_case_and_renewed(tmp_path, capsys):
    case = tmp_path / "added_mass"
    shutil.copytree(ROOT / "cases" / "added_mass", case, ignore=shutil.ignore_patterns("runs"))
    page = case / "README.md"
    right = page.read_text(encoding="utf-8")
    page.write_text(right.replace("gives 4.37 mm/s", "gives 4.50 mm/s"), encoding="utf-8")
    assert not compare(case, write=True)
    assert capsys.readouterr().out.split()[:6] == [
        "added_mass",
        "4.50",
        "4.3699",
        "-0.13009",
        "0.01",
        "DIFFERS",
    ]
    assert page.read_text(encoding="utf-8") == right
