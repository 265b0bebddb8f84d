"""The site: builds without a warning, has every page, shows equations and lists as GitHub does, and fetches nothing."""

import re
from xml.etree import ElementTree

import pytest

pytest.importorskip("mkdocs")

from coupler.commands.pages import pages
from coupler.commands.site import hooks
from coupler.commands.site.command import NoPages, docs
from coupler.program.provenance import ROOT


@pytest.mark.parametrize("place", sorted(pages()), ids=lambda place: place.stem)
def test_a_page_made_from_code_is_that_of_the_present_code(place):
    assert place.read_text(encoding="utf-8") == pages()[place](), "run python -m coupler.commands.pages"


def test_lists_tables_and_equations_need_no_blank_lines():
    text = (
        "Of these:\n- one\n  goes on\n$$x$$\n  still\n- two\n\nA table\n| a |\n|---|\n"
        "$$a = b \\tag{1}$$\n$$c = d$$\nmore\n$$\ne\n$$\nend\n```\nx\n- y\n```"
    )
    assert hooks._spaced(text).split("\n\n") == [
        "Of these:",
        "- one\n    goes on",
        "    $$x$$",
        "    still",
        "- two",
        "A table",
        "| a |\n|---|",
        "$$a = b \\tag{1}$$",
        "$$c = d$$",
        "more",
        "$$\ne\n$$",
        "end\n```\nx\n- y\n```",
    ]


def test_equations_become_mathml_with_their_numbers():
    html = r'<p><span class="arithmatex">\(a &lt; b\)</span></p><div class="arithmatex">\[\frac{1}{2}\tag{3}\]</div>'
    made = hooks.on_page_content(html)
    assert "<mo>&#x0003C;</mo>" in made
    assert '<span class="number">(3)</span>' in made
    assert "tag" not in made
    ElementTree.fromstring(f"<x>{made}</x>")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    place = tmp_path_factory.mktemp("site") / "site"
    docs(place)
    return place


def test_the_site_builds_without_a_warning_and_has_every_page(site):
    built = {page.relative_to(site).with_suffix("").as_posix() for page in site.rglob("*.html")}
    wanted = {page.stem for page in (ROOT / "docs").glob("*.md")}
    wanted |= {f"cases/{page.parent.name}" for page in ROOT.glob("cases/*/README.md")}
    wanted |= {f"notebooks/{page.stem}" for page in (ROOT / "docs").glob("notebooks/*.ipynb")}
    assert wanted | {"about", "changelog", "contributing", "architecture", "cases/index"} <= built


def test_no_equation_and_no_list_is_left_as_text(site):
    for page in site.rglob("*.html"):
        text = re.sub(r"<(pre|code)\b.*?</\1>", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
        body = text.partition("<article")[2].partition("</article>")[0]
        assert "$$" not in body, page
        assert 'class="arithmatex"' not in body, page
        assert not re.search(r"<p>[^<]*\n- ", body), page


def test_the_site_fetches_nothing(site):
    for page in site.rglob("*.html"):
        loaded = re.findall(
            r'<(?:script|link|img)[^>]*(?:src|href)="(https?://[^"]+)"', page.read_text(encoding="utf-8")
        )
        assert loaded == [], page


def test_a_folder_that_is_no_site_is_left_as_it_is(tmp_path):
    (tmp_path / "mine.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(NoPages, match="no site of before"):
        docs(tmp_path)
    assert (tmp_path / "mine.txt").exists()
