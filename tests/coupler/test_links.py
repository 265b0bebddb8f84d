"""Links of the pages: every file that one names is there, and every heading that one points to."""

import re

import pytest

from coupler.program.provenance import ROOT

LINK = re.compile(r"\]\(([^)\s]+)\)")
PAGES = sorted(
    [*ROOT.glob("[ACR]*.md"), *(ROOT / "docs").glob("*.md"), *(ROOT / "cases").glob("*/README.md")]
)


def anchors(page):
    """Those that headings of a page get on the usual sites: small letters, words with hyphens, no other signs."""
    lines = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL).splitlines()
    titles = [line.lstrip("#").strip().lower() for line in lines if re.match(r"#{1,6} ", line)]
    return {re.sub(r"[^\w\- ]", "", title).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page):
    lost = []
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if target.startswith(("http://", "https://", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        place = (page.parent / name).resolve() if name else page
        if not place.exists() or (anchor and anchor not in anchors(place)):
            lost.append(target)
    assert lost == []


def test_every_page_can_be_reached_from_the_readme():
    """A page that nothing links to is read by nobody."""
    seen, left = set(), [ROOT / "README.md"]
    while left:
        page = left.pop()
        if page in seen or page.suffix != ".md":
            continue
        seen.add(page)
        for target in LINK.findall(page.read_text(encoding="utf-8")):
            place = (page.parent / target.partition("#")[0]).resolve()
            if place.is_file():
                left.append(place)
    assert {page.name for page in PAGES if page.parent == ROOT / "docs"} <= {page.name for page in seen}


@pytest.mark.parametrize("name", ["ARCHITECTURE.md", "CONTRIBUTING.md"])
def test_files_that_recipes_name_are_there(name):
    """Whoever follows a recipe opens them."""
    text = (ROOT / name).read_text(encoding="utf-8")
    named = re.findall(r"`((?:coupler|fluid|yade_scripts|tests|docs|cases)/[\w/.]*)`", text)
    assert named
    assert [path for path in named if not (ROOT / path.replace("NAME", "__init__")).exists()] == []


def test_equations_that_are_referred_to_are_there():
    """Those of theory.md, each once: in the page itself, and where code names one as "theory (9)"."""
    theory = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    numbers = [*re.findall(r"\\tag\{(\w+)\}", theory), "4"]  # (4) stands in the table of laws
    assert len(numbers) == len(set(numbers)) > 30
    named = set(re.findall(r"(?<![\w$\\{^])\((\d{1,2}[a-k]?)\)", theory))
    for room in ("coupler", "fluid", "yade_scripts"):
        for file in (ROOT / room).rglob("*.py"):
            named |= set(re.findall(r"\btheory \((\d+\w?)\)", file.read_text(encoding="utf-8")))
    assert named - set(numbers) == set()
